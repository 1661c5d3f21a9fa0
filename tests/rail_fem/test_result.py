import json
import os

import numpy as np
import pytest

from rail_fem.result import events
from rail_fem.result.fields import FieldsError
from rail_fem.result.history import COLUMNS, complete_history
from rail_fem.result.quantities import FORCES, reported
from rail_fem.result.result import RESULT_VERSION, Cost, PassResult, PatchSummary, Peak, load
from rail_fem.scene.units import si_factor
from tests.rail_fem.surrogate_run import surrogate_mesh, surrogate_strain, write_run
from tests.rail_fem.test_scene import make_scene


def make_result(**changes) -> PassResult:
    time = np.linspace(0, 10e-3, 7)
    values = {
        "model": "fe_full",
        "scene": make_scene(),
        "settings": {"element_size": 1.5e-3, "max_steps": None},
        "history": {"time": time, "x": 0.2 + 33.528 * time, "force": 86e3 * (1 + time), "energy_elastic": time**2},
        "peaks": {"largest_force_nose": Peak(188.18e3, "N", x=0.35, time=5e-3)},
        "patches": (PatchSummary(0.0, 0.2, 0.03, "wing", area=1e-4),),
        "transfer_x": 0.3,
        "energies": {"elastic": 1.0, "plastic": float("nan")},
        "cost": Cost(12.0, 1000, 50, 2, 4e6, 1e9),
        "error_estimate": {"force": 0.02, "pressure": float("inf")},
        "warnings": ("coarse",),
        "trust": {"hourglass": {"share": 0.01, "note": None}},
    }
    return PassResult(**(values | changes))


def test_result_reads_back_as_it_was_saved(tmp_path):
    result = make_result()
    result.save(tmp_path)
    back = load(tmp_path)
    for name in COLUMNS:
        np.testing.assert_array_equal(back.history[name], result.history[name])
    for name in (
        "model",
        "scene",
        "settings",
        "cost",
        "error_estimate",
        "warnings",
        "trust",
        "transfer_x",
        "versions",
        "fault",
    ):
        assert getattr(back, name) == getattr(result, name), name
    assert back.peaks["largest_force_nose"].value == 188.18e3 and np.isnan(back.peaks["largest_force_nose"].y)
    assert back.patches[0].region == "wing" and np.isnan(back.patches[0].width)
    assert np.isnan(back.energies["plastic"])


def test_csv_holds_engineers_units_and_reads_back_to_si(tmp_path):
    """Nine digits are written, so a value comes back within 5e-9 of itself."""
    result = make_result()
    result.save(tmp_path)
    assert (tmp_path / "history.csv").read_text().startswith("time [ms],x [mm],force [kN],")
    table = np.loadtxt(tmp_path / "history.csv", delimiter=",", skiprows=1, ndmin=2)
    for values, (name, column) in zip(table.T, COLUMNS.items(), strict=True):
        np.testing.assert_allclose(values * si_factor(column.unit), result.history[name], rtol=5.1e-9)


def test_what_a_model_does_not_resolve_is_nan():
    history = make_result().history
    assert np.isnan(history["force_nose"]).all() and np.isnan(history["contact_y"]).all()


def test_json_is_strict_and_has_no_nan(tmp_path):
    make_result().save(tmp_path)

    def refuse(word):
        raise ValueError(word)

    json.loads((tmp_path / "result.json").read_text(), parse_constant=refuse)


def test_result_cannot_be_changed():
    result = make_result()
    with pytest.raises(AttributeError):
        result.transfer_x = 0.0
    with pytest.raises(ValueError):
        result.history["force"][0] = 0.0


@pytest.mark.parametrize(
    "columns, said",
    [
        ({"time": [0.0], "x": [0.0], "forse": [1.0]}, "unknown column"),
        ({"time": [0.0]}, "x missing"),
        ({"time": [0.0, 1.0], "x": [0.0]}, "shape"),
        ({"time": [[0.0]], "x": [[0.0]]}, "shape"),
    ],
)
def test_histories_that_fit_no_common_axis_are_refused(columns, said):
    with pytest.raises(ValueError, match=said):
        complete_history(columns)


def test_empty_history_is_saved_and_read(tmp_path):
    """A run that failed before its first row still has a result that says why."""
    make_result(history={"time": [], "x": []}, fault="unstable at step 3").save(tmp_path)
    back = load(tmp_path)
    assert back.fault == "unstable at step 3" and back.history["force"].shape == (0,)
    assert (tmp_path / "history.csv").read_text().count("\n") == 1


def test_failed_save_leaves_the_old_result_whole(tmp_path, monkeypatch):
    make_result().save(tmp_path)
    before = {path.name: path.read_bytes() for path in tmp_path.iterdir()}

    def full_disk(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "replace", full_disk)
    with pytest.raises(OSError):
        make_result(transfer_x=0.9).save(tmp_path)
    assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == before


def test_another_version_and_an_absent_result_are_refused(tmp_path):
    with pytest.raises(FileNotFoundError, match="no result.json"):
        load(tmp_path)
    make_result().save(tmp_path)
    text = (tmp_path / "result.json").read_text()
    for other in (2, 9):
        (tmp_path / "result.json").write_text(text.replace(f'n": {RESULT_VERSION}', f'n": {other}', 1))
        with pytest.raises(ValueError, match=f"version {other}, .*run it again"):
            load(tmp_path)


def test_the_peaks_of_a_history_are_found_once_for_all_reported_forces(monkeypatch):
    result, calls = make_result(), []
    monkeypatch.setattr(events, "force_peaks", lambda *asked, **named: calls.append(asked) or {})
    found = reported(result)
    assert len(calls) == 1 and set(found) & set(FORCES) == set(result.peaks) & set(FORCES)


def test_the_fields_of_a_result_are_those_in_its_folder_and_its_mesh_has_their_volume(tmp_path):
    pyvista = pytest.importorskip("pyvista")
    solved = write_run(tmp_path)
    result, strain = load(tmp_path), surrogate_strain(surrogate_mesh())
    assert result.folder == tmp_path and "folder" not in result.summary()
    assert np.array_equal(result.fields.plastic_strain, strain)
    mesh = result.mesh()
    assert isinstance(mesh, pyvista.UnstructuredGrid) and np.array_equal(mesh["plastic_strain"], strain)
    corners = result.fields.points[result.fields.cells]  # of bricks
    bricks = np.prod(corners[:, 6] - corners[:, 0], axis=1).sum()
    assert mesh.volume == pytest.approx(bricks, rel=1e-6)  # VTK keeps points in single precision
    with pytest.raises(FieldsError, match="frame"):
        result.mesh(frame=3)
    with pytest.raises(FieldsError, match="load_result"):
        solved.mesh()
