import pytest

from rail_fem.run import doctor, installation
from rail_fem.run.doctor import PartFinding, _probe, examine


def test_everything_a_run_needs_is_looked_at(monkeypatch):
    """Whether it is well is tried by the README's doctor command."""
    monkeypatch.setattr(doctor, "_probe", lambda subject, *_: PartFinding(subject, True, ""))
    assert [finding.subject for finding in examine()] == [
        "python",
        "numpy",
        "packages",
        "dolfinx",
        "numba",
        "gmsh",
        "rendering",
        "card",
        "mpi",
    ]


@pytest.mark.parametrize(
    "code, said",
    [
        ("import module_that_is_absent", "module_that_is_absent"),
        ("raise SystemExit(3)", "exit code 3"),
        ("import os; os.abort()", "exit code -6"),
    ],
)
def test_broken_library_is_a_finding_with_a_remedy_and_not_a_crash(code, said):
    finding = _probe("thing", code, "install it")
    assert not finding.well and said in finding.line() and "-> install it" in finding.line()


def test_library_that_hangs_is_a_finding(monkeypatch):
    monkeypatch.setattr(doctor, "PROBE_SECONDS", 0.2)
    assert "no answer" in _probe("thing", "import time; time.sleep(60)", "remove it").line()


def test_what_is_well_needs_no_remedy():
    assert "->" not in PartFinding("thing", True, "works", "install it").line()


def test_what_only_the_explicit_models_need_may_be_absent_where_setup_has_not_been(monkeypatch):
    """`pip install .`: no fault, but said; in an environment of setup.sh the same absence is a fault."""
    monkeypatch.setattr(doctor, "_probe", lambda subject, *_: PartFinding(subject, True, ""))
    monkeypatch.setattr(doctor, "missing", lambda names: [n for n in names if n in installation.EXPLICIT])
    monkeypatch.setattr(doctor, "made_by_setup", lambda: False)
    found = {finding.subject: finding for finding in examine()}
    assert [name for name, finding in found.items() if finding.absent] == ["dolfinx", "gmsh", "mpi"]
    assert all(finding.well for finding in found.values())
    assert "no explicit models" in found["dolfinx"].line() and "-> on Debian" in found["dolfinx"].line()
    monkeypatch.setattr(doctor, "made_by_setup", lambda: True)
    assert not {finding.subject: finding for finding in examine()}["packages"].well
