"""The verification page says what happened, a failure above all."""

from rail_fem.studies.verification import hard_cases, page, speed_against_error

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


def test_what_was_not_asked_for_is_said_and_a_smoke_page_says_so(monkeypatch):
    monkeypatch.delenv("RAIL_FEM_SMOKE", raising=False)
    assert "Not asked for" in speed_against_error(None)
    assert page({"one": lambda: "two\n"}) == "# Verification, from the runs\n\n## one\n\ntwo\n"
    monkeypatch.setenv("RAIL_FEM_SMOKE", "1")
    assert "no meaning" in page({})
