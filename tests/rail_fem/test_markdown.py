"""Tables of the reports: a cell stays a cell whatever stands in it, a short row is told."""

import pytest

from rail_fem.files.markdown import markdown_table
from rail_fem.show.table_and_figure import Table


def test_a_table_has_a_rule_and_a_line_for_each_row():
    lines = markdown_table(["case", "force [kN]"], [["one", "100"], ["two", ""]])
    assert lines == ["| case | force [kN] |", "|---|---|", "| one | 100 |", "| two |  |"]


def test_bars_and_line_breaks_do_not_end_a_cell():
    (*_, row) = markdown_table(["what", "why"], [["a|b", "first\nsecond"]])
    assert row == "| a\\|b | first second |"


def test_a_row_of_another_length_is_refused():
    with pytest.raises(ValueError, match="a row of 1 cells in a table of 2 columns: alone"):
        markdown_table(["what", "why"], [["alone"]])


def test_a_number_that_is_not_known_is_a_dash():
    assert Table(["error", "of"], [[float("nan"), 0], [0.5, 1]]).markdown().splitlines()[2:] == [
        "| - | 0 |",
        "| 0.5 | 1 |",
    ]
