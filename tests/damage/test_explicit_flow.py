"""Plastic flow of a life study by passes of fe_full: the chain of its passes where nothing wears, what wear takes off
the mesh, a kill between the blocks and within a stop."""

from dataclasses import replace

import numpy as np
import pytest

from geometry.surfaces.bodies import REGIONS
from rail_fem import hierarchy
from rail_fem.case.casefile import CaseError, load_case
from rail_fem.damage.study import StudyError, run_study
from rail_fem.fe.carried import FADES, SteelBefore, height_off
from rail_fem.models import fe_full
from rail_fem.result.fields import MESH
from rail_fem.result.result import load
from tests.rail_fem.test_readme import ROOT

FLOW = ROOT / "cases" / "damage" / "crossing_flow.toml"
X, Y = np.arange(0.300, 0.420, 2e-3), np.arange(-0.05, 0.07, 0.5e-3)
QUICK = {
    "damage.passes": 30,
    "damage.explicit": {"every": 20, "passes": 1},
    "damage.plastic_flow": False,
    "damage.block": 20,
    "damage.cells": 12,
    "damage.patch_spacing": "6 mm",
    "damage.plan_spacing": "0.5 mm",
    "run.rigid_hertz": {"start": "335 mm", "end": "385 mm"},
    "run.fe_full": {
        "element_size": "6 mm",
        "start": "335 mm",
        "end": "385 mm",
        "history_interval": "20 us",
        "field_frames": 1,
        "mass_scaling": "auto",
    },
}
CASE = load_case(FLOW, QUICK)


@pytest.fixture(scope="module")
def stops(tmp_path_factory):
    """Two stops of two passes without wear between them, and the four in a row."""
    folder = tmp_path_factory.mktemp("stops")
    settings = CASE.runs["fe_full"].model_copy(update={"error_twin": False})
    two, none = settings.model_copy(update={"passes": 2}), np.zeros((2, len(X), len(Y)))
    for name, before in (("a", None), ("b", folder / "a")):
        fe_full.solve_on(SteelBefore(before, X, Y, none), CASE.scene, two, folder / name).save(folder / name)
    return folder, fe_full.solve(CASE.scene, settings.model_copy(update={"passes": 4}), folder / "row")


def test_stops_without_wear_are_the_passes_in_a_row(stops):
    """To the last bit."""
    folder, row = stops
    second = load(folder / "b")
    for name, column in row.history.items():
        assert np.array_equal(column, second.history[name], equal_nan=True), name
    assert second.metal == row.metal and row.metal["nose"]["values"]["integral"] > 0
    with np.load(folder / "b" / "plastic.npz") as one, np.load(folder / "row" / "plastic.npz") as two:
        assert all(np.array_equal(one[name], two[name]) for name in two.files)


def test_wear_takes_the_surface_down_and_fades_below_it(stops):
    """Of what lies within the plan; the flow that is told afterwards is without it, where the pass has not been."""
    folder, _ = stops
    with np.load(folder / "a" / MESH) as stored:
        arrays = {name: stored[name] for name in fe_full.MESH_ARRAYS}
    mesh = fe_full.HexMesh(region_names=REGIONS, **arrays)
    worn = np.zeros((2, len(X), len(Y)))
    worn[1] = 50e-6
    before = SteelBefore(folder / "a", X, Y, worn)
    off = height_off(mesh, mesh.points, CASE.scene.crossing.surface, before)
    nose = np.unique(mesh.cells[mesh.region == 1])
    x, y, z = mesh.points[nose].T
    inside = (x > X[0]) & (x < X[-1]) & (y > Y[0]) & (y < Y[-1])
    top = CASE.scene.crossing.surface.heights(x, y, "nose")
    surface, deep = inside & (np.abs(top - z) < 1e-5), inside & (top - z > FADES) & (top > -0.5)
    assert surface.sum() > 20 and deep.sum() > 20
    assert off[nose][surface] == pytest.approx(50e-6, rel=2e-3) and not off[nose][deep].any()
    others = np.setdiff1d(np.arange(len(off)), nose)
    assert not off[others].any()

    settings = CASE.runs["fe_full"].model_copy(update={"passes": 2, "error_twin": False})
    fe_full.solve_on(before, CASE.scene, settings, folder / "worn")
    flows = []
    for name in ("b", "worn"):
        with np.load(folder / name / "plastic.npz") as stored:
            flows.append(stored["nose_lowered"])
    with np.load(folder / "worn" / "steel.npz") as stored:
        moved = stored["worn"]  # by where the nodes are now: those at the plan's end may have left it
    within = (mesh.points[:, 0] > X[0] + 1e-3) & (mesh.points[:, 0] < X[-1] - 1e-3)
    assert moved[within] == pytest.approx(off[within], abs=2e-6)
    assert np.median(np.abs(flows[1] - flows[0])) < 3e-6


def test_a_kill_in_a_stop_or_behind_it_changes_no_bit(tmp_path, monkeypatch):
    run_study(CASE, None, tmp_path / "whole", False, False, lambda words: None)
    report = (tmp_path / "whole" / "report.md").read_text()
    assert "Plastic flow by fe_full" in report and "held from stop to stop" in report
    assert "At each stop 1 pass(es) of P8-worn at 75 mph, told from x = 335 to 345 mm" in report
    goes_on, calls = fe_full.solve_on, []

    class Stopped(Exception):
        pass

    def stop(before, *args, **options):
        calls.append(before.folder)
        if len(calls) == 2:
            raise Stopped
        return goes_on(before, *args, **options)

    monkeypatch.setattr(fe_full, "solve_on", stop)
    with pytest.raises(Stopped):
        run_study(CASE, None, tmp_path / "cut", False, False, lambda words: None)
    run_study(CASE, None, tmp_path / "cut", True, False, lambda words: None)
    assert calls[0] is None and [own.name for own in calls[1:]] == ["stop_000", "stop_000"]
    with np.load(tmp_path / "whole" / "damage.npz") as one, np.load(tmp_path / "cut" / "damage.npz") as two:
        assert one.files == two.files and all(np.array_equal(one[n], two[n], equal_nan=True) for n in one.files)
    one, two = ((tmp_path / name / "damage.json").read_text() for name in ("whole", "cut"))
    assert one == two


def test_what_does_not_go_together_is_refused(tmp_path):
    for key, value in (("damage.plastic_flow", True), ("damage.grindings", [1.0]), ("damage.passes", 1e6)):
        with pytest.raises(CaseError, match="explicit"):
            load_case(FLOW, QUICK | {key: value})
    without = replace(CASE, runs={name: run for name, run in CASE.runs.items() if name != "fe_full"})
    with pytest.raises(StudyError, match=r"\[run.fe_full\]"):
        run_study(without, None, tmp_path, False, False, lambda words: None)
    assert hierarchy.MODELS["fe_full"].module == fe_full.__name__
