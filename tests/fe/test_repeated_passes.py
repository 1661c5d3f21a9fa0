"""Passes on the steel that the one before has left: nothing left, nothing changed; hardening; a kill between them."""

from dataclasses import replace

import numpy as np
import pytest

from rail_fem.case.casefile import load_case
from rail_fem.damage.flow import read_flow
from rail_fem.fe.metal import fallen
from rail_fem.models import fe_full
from rail_fem.models.fe_full import Run
from rail_fem.result.result import load
from rail_fem.settings.explicit import FeSettings
from rail_fem.show.passes import after_passes, passes_figure, passes_rows
from rail_fem.show.report import result_report

SCENE = load_case("nose_transfer").scene
SETTINGS = FeSettings(
    element_size="6 mm",
    start="335 mm",
    end="385 mm",
    history_interval="20 us",
    field_frames=1,
    passes=2,
    mass_scaling="auto",
)


@pytest.fixture(scope="module")
def passes(tmp_path_factory):
    folder = tmp_path_factory.mktemp("passes")
    return folder, fe_full.solve(SCENE, SETTINGS, folder)


def test_on_steel_that_does_not_yield_every_pass_is_the_first(tmp_path):
    """Up to what the static start leaves: 0.3 % of the load (rail_fem.fe.static_start)."""
    strong = {"grade": "Mn13", "strength": "1000 %"}
    scene = SCENE.replace(materials={"wing": strong, "nose": strong, "wheel": "R8T"})
    second = fe_full.solve(scene, SETTINGS, tmp_path)
    first = load(tmp_path / "pass_0001")
    assert max(report.get("block_nose", 0.0) for report in second.passes) == 0.0
    force = first.history["force"]
    assert force.max() > scene.static_wheel_load
    assert np.abs(second.history["force"] - force).max() < 5e-3 * force.max()


def test_a_second_pass_begins_with_the_strain_of_the_first_and_adds_less(passes):
    folder, second = passes
    first = load(folder / "pass_0001")
    before, after = (result.metal["nose"]["values"]["integral"] for result in (first, second))
    assert 0 < before < after < 2 * before
    assert first.passes[0] == second.passes[0] and len(first.passes) == 1 and len(second.passes) == 2
    assert second.passes[1]["integral_nose"] == pytest.approx(after, rel=1e-12)


def test_a_kill_in_the_second_pass_changes_no_bit_of_the_result(passes, tmp_path, monkeypatch):
    goes_on = Run._step

    class Stopped(Exception):
        pass

    def stop(run):
        goes_on(run)
        if run.folder == tmp_path and run.dynamics.step_count == 60:
            run.save()
            raise Stopped

    with monkeypatch.context() as patch, pytest.raises(Stopped):
        patch.setattr(Run, "_step", stop)
        fe_full.solve(SCENE, SETTINGS, tmp_path, restart=True)
    again = fe_full.solve(SCENE, SETTINGS, tmp_path, restart=True)
    whole = passes[1]
    assert again.passes == whole.passes
    assert all(again.history[name].tobytes() == values.tobytes() for name, values in whole.history.items())


def test_what_each_pass_did_is_said_and_drawn(passes, tmp_path):
    folder, result = passes
    shown = result_report(result)
    assert "PEEQ block wing" in shown and shown.count("mm3") > 4
    passes_figure(result, "passes").savefig(tmp_path / "passes.png")
    assert (tmp_path / "passes.png").stat().st_size > 10_000


def test_a_node_that_slides_down_has_sunk_only_below_the_surface_it_was_on():
    """Nodes that go aside along the surface and 10 um below it: told to second order in how far they went."""
    crossing, errors = SCENE.crossing.surface, []
    y = np.linspace(-0.03, 0.03, 61)
    before = np.column_stack([np.full(61, 0.35), y, crossing.heights(np.full(61, 0.35), y, "nose")])
    for way in (200e-6, 100e-6):
        after = before + [way, way, 0.0]
        after[:, 2] = crossing.heights(after[:, 0], after[:, 1], "nose") - 10e-6
        at, lowered = fallen(before, after, crossing, "nose")
        assert 10 < len(at) < 61 and set(np.round(at[:, 1], 9)) <= set(np.round(after[:, 1], 9))
        errors.append(np.median(np.abs(lowered - 10e-6)))
    assert errors[0] < 2e-6 and 3 < errors[0] / errors[1] < 5


def test_a_life_can_begin_on_the_surface_that_the_passes_have_left(passes):
    """As rail_fem.damage reads it: the fall that the run reports of its strips; it goes on where the wheel stood."""
    folder, result = passes
    x, y = np.arange(0.300, 0.420, 0.5e-3), np.arange(-0.05, 0.05, 0.25e-3)
    result.save(folder)
    flow, (low, high) = read_flow(folder, SCENE, (x, y))
    assert (low, high) == pytest.approx((0.335, 0.345), abs=1e-4)
    for field, part in zip(flow, ("wing", "nose")):
        strips = result.metal[part]["surface"]
        near = np.flatnonzero((np.array(strips["x"]) > low) & (np.array(strips["x"]) < high))
        reported = max(np.array(strips["fall"])[near])
        assert field[(x > low) & (x < high)].max() == pytest.approx(reported, rel=0.15, abs=2e-6)
        assert np.array_equal(field[x > 0.35], np.broadcast_to(field[x > 0.35][0], field[x > 0.35].shape))
    assert flow.max() > 20e-6
    with np.load(folder / "plastic.npz") as stored:
        alone = dict(stored) | {"wing_at": np.zeros((0, 2)), "wing_lowered": np.zeros(0)}  # a body that is not meshed
    (folder / "alone").mkdir()
    result.save(folder / "alone")
    np.savez(folder / "alone" / "plastic.npz", **alone)
    nose, _ = read_flow(folder / "alone", SCENE, (x, y))
    assert not nose[0].any() and np.array_equal(nose[1], flow[1])


def test_ten_passes_foretell_a_hundred_where_strain_still_grows(passes):
    _, result = passes
    still = {name: value for name, value in result.passes[0].items() if not name.startswith(("block", "integral"))}
    grown = [still | {"block_nose": 0.02 * number, "block_wing": 0.01} for number in range(1, 11)]
    last = passes_rows(replace(result, passes=tuple(grown)))[-1].split()
    assert last[0] == "100" and last[last.index("200") + 1] == "%" and "foretold:" in last
    assert last.count("resolved") == 3
    assert "foretold" not in passes_rows(replace(result, passes=tuple(grown[:5])))[-1]
    assert "foretold" not in passes_rows(replace(result, passes=tuple(grown[:1] * 10)))[-1]


@pytest.mark.parametrize("power", [0.0, -0.3, -2.0])
def test_what_grows_by_a_power_of_the_pass_goes_on_exactly(power):
    """The first passes may add something else, as a groove is pressed: the last half tells."""
    grown = np.cumsum([5.0, 3.0, *(0.7 * np.arange(3, 101.0) ** power)])
    assert after_passes(grown[:10], 100) == pytest.approx(grown[-1], rel=1e-10)


@pytest.mark.parametrize("grown", [[1.0, 1.0, 1.0, 1.0], [1.0, 2.0, 3.0, 2.5], [1.0], [1.0, np.nan, 3.0, 4.0]])
def test_what_has_stopped_to_grow_is_not_foretold(grown):
    assert np.isnan(after_passes(np.array(grown), 100))
