"""Scripts can read every answer, rely on every exit code, and ask for silence; what needs no library imports none."""

import json
import re
import subprocess
import sys
from pathlib import Path

import pytest

from rail_fem.commands.ending import EXIT_CODES
from rail_fem.files.strict_json import dumps, nan_for_none, to_plain
from tests.commands import call
from tests.ranks import run_on_ranks

pytestmark = pytest.mark.usefixtures("undrawn")
ROOT = Path(__file__).resolve().parents[2]
REFERENCE = ROOT / "cases" / "nose_transfer.toml"
# pydantic is missing here: typer itself reads lists with it
HEAVY = {"dolfinx", "mpi4py", "gmsh", "meshio", "vtk", "pyvista", "numpy", "scipy", "numba", "matplotlib", "pint"}


@pytest.fixture(scope="module")
def case(tmp_path_factory):
    folder = tmp_path_factory.mktemp("case")
    text = REFERENCE.read_text(encoding="utf-8").partition("[run.")[0]
    text += '[run.p2_formula]\ndip_angle = "15 mrad"\n[run.lumped]\nstart = "300 mm"\nend = "400 mm"\n'
    (folder / "nose.toml").write_text(text, encoding="utf-8")
    return folder / "nose.toml"


@pytest.fixture(scope="module")
def runs(case):
    """A folder with a finished run of each of two models."""
    for model in ("p2_formula", "lumped"):
        call("-q", "run", case, "--model", model, "--out", case.parent / "runs" / model)
    return case.parent / "runs"


def literal(text: str):
    raise AssertionError(f"{text} is no JSON")


def strict(text: str) -> dict:
    """One JSON object and nothing else; no NaN."""
    found = json.loads(text, parse_constant=literal)
    assert isinstance(found, dict)
    return found


def test_what_is_not_known_is_null_and_comes_back():
    values = {"a": float("nan"), "b": [float("inf"), -float("inf")], "c": (1, "x"), "d": Path("p")}
    assert strict(dumps(values)) == {"a": None, "b": ["inf", "-inf"], "c": [1, "x"], "d": "p"}
    back = nan_for_none(to_plain({"a": float("nan"), "b": float("inf"), "keep": None}), keep=("keep",))
    assert back["a"] != back["a"] and back["b"] == float("inf") and back["keep"] is None


def test_every_answer_can_be_had_as_one_json_object(case, runs, tmp_path):
    checked = strict(call("check", case, "--model", "lumped", "--json").stdout)
    assert checked["scene"]["speed"] == pytest.approx(33.528) and checked["errors"] == [] and checked["warnings"]
    explicit = strict(call("check", REFERENCE, "--json").stdout)
    assert explicit["cost"]["ranks"] == 1, "as many as `run` by itself takes"
    assert explicit["cost"]["cells"] > 1e4 and len(explicit["derived"]["rigid_transfers"]) == 1
    ran = strict(call("run", case, "--model", "lumped", "--out", tmp_path / "run", "--json").stdout)
    shown = strict(call("show", tmp_path / "run", "--figures", "none", "--json").stdout)
    assert ran["peaks"] == shown["peaks"] and ran["transfer_x"] is None and shown["model"] == "lumped"
    assert strict(call("show", runs, "--json").stdout)["runs"] == [
        str(runs / name) for name in ("lumped", "p2_formula")
    ]
    compared = strict(call("compare", runs, "--within", "50%", "--quantity", "largest force", "--json").stdout)
    assert compared["reference"] == "lumped" and compared["within"]["least_expensive"] is None
    assert {run["name"] for run in compared["runs"]} == {"lumped", "p2_formula"}
    assert compared["runs"][0]["errors"]["strain"] is None or compared["runs"][0]["reference"]
    listed = strict(call("list", "--json").stdout)
    assert "P8-worn" in listed["wheels"] and listed["models"][0]["name"] == "p2_formula"
    swept = strict(call("sweep", case, "--model", "p2_formula", "--out", tmp_path / "sweep", "--json").stdout)
    assert swept["jobs"][0]["state"] == "finished" and swept["rows"][0]["largest_force [kN]"] is None


def test_the_doctor_answers_in_json(monkeypatch, capsys):
    from rail_fem.run import doctor

    found = [doctor.PartFinding("python", True, "3"), doctor.PartFinding("gmsh", False, "gone", "get it")]
    monkeypatch.setattr(doctor, "examine", lambda: iter(found))
    assert doctor.tell(as_json=True) == 1
    answer = strict(capsys.readouterr().out)
    assert answer["faults"] == 1 and answer["findings"][1]["remedy"] == "get it"


def test_exit_codes_are_those_that_the_help_names(case, tmp_path):
    text = " ".join(call("--help").stdout.split())
    assert all(f"{code} {meaning}" in text for code, meaning in EXIT_CODES.items())
    documented = (ROOT / "docs" / "outputs.md").read_text(encoding="utf-8")
    assert all(f"| {code} |" in documented for code in EXIT_CODES)
    call("list", code=0)
    fails = case.parent / "fails.toml"
    steps = '[run.lumped]\ntime_step = "0.01 us"\n'  # more of them than are taken
    fails.write_text(case.read_text(encoding="utf-8").partition("[run.")[0] + steps, encoding="utf-8")
    failed = call("run", fails, "--set", "scene.speed=1 mph", "--out", tmp_path / "run", "--json", code=1)
    assert "the run failed" in failed.stderr and strict(failed.stdout)["fault"]
    refused = call("check", case, "--set", "scene.sped=1 mph", "--json", code=2)
    assert strict(refused.stdout) == {"fault": refused.stderr.rstrip("\n"), "exit_code": 2}
    assert "no such command" in call("chekc", code=2).stderr.lower()


def test_quiet_says_nothing_of_what_goes_on_and_verbose_says_more(case, tmp_path):
    loud = call("run", case, "--model", "p2_formula", "--out", tmp_path / "a")
    quiet = call("-q", "run", case, "--model", "p2_formula", "--out", tmp_path / "b")
    verbose = call("-v", "run", case, "--model", "p2_formula", "--out", tmp_path / "c")
    assert "peaks" in loud.stdout and not loud.stderr and (quiet.stdout, quiet.stderr) == ("", "")
    assert "peaks" in verbose.stdout and "numpy" in verbose.stderr
    assert "peaks" in call("-q", "show", tmp_path / "b", "--figures", "none").stdout
    assert (
        "holds a run already"
        in call("-q", "run", case, "--model", "p2_formula", "--out", tmp_path / "b", code=2).stderr
    )


@pytest.mark.mpi
@pytest.mark.validate
def test_several_ranks_give_one_json_object(case, tmp_path):
    answer = run_on_ranks(2, "-m", "rail_fem", "check", case, "--model", "lumped", "--json")
    assert answer.returncode == 0 and strict(answer.stdout)["model"] == "lumped"


def imported_by(*words: object) -> set[str]:
    """Packages that the program has imported by the end of a command, or by `import rail_fem` alone; it ends well and
    says nothing on standard error."""
    code = f"""
import sys
import rail_fem
rail_fem.__version__
if {len(words)}:
    from rail_fem.__main__ import main
    sys.argv = ["rail-fem", *{[*map(str, words)]!r}]
    try:
        main()
    except SystemExit as ended:
        assert not ended.code
print(*sorted({{name.partition(".")[0] for name in sys.modules}}), file=sys.stderr)
"""
    answer = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True)
    assert answer.returncode == 0 and len(answer.stderr.splitlines()) == 1, answer.stderr
    return set(answer.stderr.split())


@pytest.mark.parametrize("words", [["--version"], ["--help"], ["sweep", "--help"], []])
def test_version_and_help_import_no_library(words):
    """Also `import rail_fem`: judged by what is imported, not by the clock."""
    assert not imported_by(*words) & HEAVY


def test_check_does_not_import_what_draws(case):
    found = imported_by("check", case, "--model", "rigid_hertz")
    assert "numpy" in found and "matplotlib" not in found


def test_the_terminal_shows_no_log_where_a_library_has_set_a_handler_for_all(tmp_path):
    """As ffcx does; the warnings stand in the report, what its compiler says nowhere."""
    words = ["rail-fem", "run", "cases/nose_transfer.toml", "--model", "p2_formula", "--out", str(tmp_path / "run")]
    code = f"""
import atexit, logging, sys
logging.basicConfig(level="INFO")
atexit.register(logging.info, "running build_ext")
sys.argv = {words!r}
from rail_fem.__main__ import main
main()
"""
    answer = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True)
    assert answer.returncode == 0 and "dip limit: " in answer.stdout
    assert not re.search("WARNING|INFO", answer.stdout + answer.stderr)


@pytest.mark.parametrize(
    "changes, words",
    [
        (["scene.crossing.family=joint"], "never changes body"),
        (["run.fe_window.start=900 mm"], "900 mm lies not before"),
        (["run.fe_window.end=200 mm"], "lies not before 200 mm: give both"),
    ],
)
def test_a_window_that_cannot_be_found_is_an_input_error_of_check(tmp_path, changes, words):
    """What forbids the run left its ends open, and the cost asked for them."""
    text = Path("cases/nose_transfer.toml").read_text(encoding="utf-8")
    (tmp_path / "case.toml").write_text(text.replace("ratio = 10.75", "").partition("[run.")[0] + "[run.fe_window]\n")
    told = call("check", tmp_path / "case.toml", *(word for one in changes for word in ("--set", one)), code=2).output
    assert "run.fe_window.start, end: " in told and words in told
