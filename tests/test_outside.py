"""What a run says of tests that need files of others, and where it looks for those."""

import subprocess
import sys

from tests.outside import ABSENT, PROJECT, VARIABLE, outside, report


def test_a_run_names_the_tests_that_it_did_not_run_and_where_their_files_can_be_had(tmp_path):
    run = subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "-n", "0", "-p", "no:cacheprovider", "tests/geometry/test_rail.py"],
        cwd=PROJECT,
        text=True,
        capture_output=True,
        env={"PATH": "/usr/bin:/bin", VARIABLE: str(tmp_path), "PYTHONPATH": str(PROJECT)},
    )
    assert run.returncode == 0, run.stdout
    assert "3 test(s) were NOT RUN" in run.stdout and "profiles/rail_60E2_head_upright.csv: 1 test(s)" in run.stdout
    assert (
        "tests/geometry/test_rail.py::test_heads_match_the_transcribed_tables" in run.stdout
        and "github.com/rohrbecka/EN13674" in run.stdout
    )
    assert f"{VARIABLE}=FOLDER ./test.sh" in run.stdout


def test_every_file_that_tests_name_has_a_source():
    named = {
        line.partition(ABSENT)[2]
        for line in (ABSENT + "formats/MBench_UIC60_v3.prr", ABSENT + "profiles/wheel_P1_like_APPROX.csv")
    }
    lines = report({name: ["tests/a.py::test_one[1]", "tests/a.py::test_one[2]"] for name in named})
    assert "4 test(s)" in lines[0] and not any("from: not named" in line for line in lines)
    assert sum("tests/a.py::test_one" in line for line in lines) == 2


def test_files_are_looked_for_where_the_variable_says_and_in_contacts_own_layout(tmp_path, monkeypatch):
    monkeypatch.setenv(VARIABLE, str(tmp_path))
    assert outside("formats/a.prr") == tmp_path / "formats" / "a.prr"
    (tmp_path / "a.prr").write_text("")
    assert outside("formats/a.prr") == tmp_path / "a.prr"
    monkeypatch.delenv(VARIABLE)
    assert outside("formats/a.prr") == PROJECT.parent / "shared" / "data" / "formats" / "a.prr"
