"""The verification page says what happened, a failure above all."""

from pathlib import Path

from rail_fem.case.casefile import load_case
from rail_fem.hierarchy import MODELS, solve
from rail_fem.studies.verification import hard_cases, main, page, speed_against_error
from tests.commands import call

ROOT = Path(__file__).resolve().parents[2]
THREE = """
import pytest
def test_what_holds(): pass
def test_what_does_not_hold(): assert 1 == 2
@pytest.mark.skip(reason="no file")
def test_what_needs_a_file(): pass
"""


def test_every_case_has_a_row_with_its_outcome_and_failures_are_counted(tmp_path):
    (tmp_path / "test_three.py").write_text(THREE)
    text = hard_cases((str(tmp_path / "test_three.py"),))
    assert "| what holds | `test_three` | held |" in text
    assert "| what does not hold | `test_three` | **failed**: assert 1 == 2 |" in text
    assert "| what needs a file | `test_three` | not run: no file |" in text
    assert text.endswith("3 cases, 1 failed.\n")


def test_every_model_has_a_row_or_the_command_that_makes_it(tmp_path):
    """The command is the program's own: of the light models it adds the rows that were missing."""
    case = tmp_path / "case_02.toml"
    case.write_text((ROOT / "cases" / "thesis" / "case_02.toml").read_text())
    scene = load_case(case).scene
    for model in ("lumped", "rigid_hertz"):
        solve(model, scene).save(tmp_path / "runs" / "case_02" / model)
    text = speed_against_error(tmp_path / "runs" / "case_02")
    assert (
        "No run by p2_formula, bem_passage, bem_plastic, fe_window, fe_full: `rail-fem sweep CASE --model p2_f" in text
    )
    call("sweep", case, "--model", "p2_formula", "--model", "bem_passage", "--out", tmp_path / "runs")
    text = speed_against_error(tmp_path / "runs" / "case_02")
    assert all(f"| {model} | {model} |" in text for model in list(MODELS)[:4]) and "No run by bem_plastic" in text


def test_what_was_not_asked_for_is_said(capsys):
    assert "Not asked for" in speed_against_error(None)
    assert page({"one": lambda: "two\n"}) == "# Verification, from the runs\n\n## one\n\ntwo\n"
    assert capsys.readouterr().err == "one ...\n"  # it was silent for minutes


def test_a_quick_look_takes_two_sizes_and_says_that_orders_have_no_meaning(capsys):
    """It took a core minute: --quick left the orders as they were."""
    main(only="orders", quick=True)
    said = capsys.readouterr().out
    assert "orders have no meaning" in said and "3: " in said and ", 24: " not in said
