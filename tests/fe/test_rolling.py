"""On level rail a wheel that rolls drags nothing; one that is braked slides, and so does one that turns in
the wrong sense."""

import dataclasses

import numpy as np
import pytest

from rail_fem.case.casefile import load_case
from rail_fem.fe.running import running_of
from rail_fem.models import fe_full
from rail_fem.scene.scene import Material
from rail_fem.settings.explicit import FeSettings

SETTINGS = FeSettings(
    element_size=5e-3, start=0.095, end=0.130, settle_time=0.8e-3, history_interval=10e-6, field_frames=1
)
RIM = 0.02  # of the friction, that the coarse patch may lack


@pytest.fixture(scope="module")
def scene():
    """The wing rail before the nose, level along x, of a steel that stays elastic."""
    scene = load_case("nose_transfer").scene
    return scene.model_copy(update={"materials": scene.materials.model_copy(update={"wing": Material(grade="R8T")})})


@pytest.fixture(scope="module")
def placed(scene):
    """The mesh of all these passes."""
    return fe_full.make_mesh(scene, SETTINGS, running_of(scene, SETTINGS))


def rolled(scene, placed, monkeypatch, factor: float = 1.0, **changes):
    """A pass whose wheel begins at `factor` times the spin of pure rolling; and that spin."""
    settings = SETTINGS.model_copy(update=changes)
    running = running_of(scene, settings)
    running = dataclasses.replace(running, spin=factor * running.spin)
    monkeypatch.setattr(fe_full, "running_of", lambda *given: running)
    monkeypatch.setattr(fe_full, "make_mesh", lambda *given: placed)
    return fe_full.solve(scene, settings), running.spin


def friction_used(result, scene) -> tuple[float, float]:
    """Longitudinal force, and friction's work per distance, over the friction that the vertical force could carry; over
    the last half of the distance."""
    history = result.history
    late = history["x"] > history["x"][[0, -1]].mean()
    most = scene.friction * history["force"][late].mean()
    return history["force_longitudinal"][late].mean() / most, np.ptp(history["energy_friction"][late]) / np.ptp(
        history["x"][late]
    ) / most


def test_a_free_wheel_rolls_without_drag(scene, placed, monkeypatch):
    result, spin = rolled(scene, placed, monkeypatch)
    history = result.history
    assert history["force"][-1] > 0.9 * scene.static_wheel_load
    assert np.abs(history["force_longitudinal"]).max() < 0.1 * scene.static_wheel_load
    along, work = friction_used(result, scene)
    assert abs(along) < 0.1 and 0 <= work < 1e-4
    assert np.abs(history["creep_longitudinal"][10:]).max() < 5e-4
    assert history["wheel_spin"] == pytest.approx(spin, rel=1e-3)


def test_a_free_wheel_that_turns_too_fast_is_slowed_by_the_moment_of_its_force(scene, placed, monkeypatch):
    """0.5 % too fast it drives itself forward, by less and less. I d(spin) = - r F dt to the 2 % by which the patch is
    not a point; its rotation's energy to round-off; and all that rotation loses is work of towing and friction."""
    result, spin = rolled(scene, placed, monkeypatch, 1.005)
    history, inertia = result.history, scene.vehicle.wheel_spin_inertia
    force, creep, last = history["force_longitudinal"], history["creep_longitudinal"], history["wheel_spin"][-1]
    assert creep[10] < -4e-3 and abs(creep[-1]) < 0.7 * abs(creep[10]) and force[-1] > 0.1 * scene.static_wheel_load
    steps = np.diff(history["time"], prepend=0.0)
    assert inertia * (last - spin) == pytest.approx(-scene.wheel.radius * (force @ steps), rel=0.02)
    assert result.energies["rotation"] == pytest.approx(0.5 * inertia * (last**2 - spin**2), rel=1e-9)
    assert (
        abs(result.energies["contact_loss"])
        < 0.3 * result.energies["friction"]  # a quarter on elements of 5 mm
        < 3e-3 * abs(result.energies["rotation"])
    )


def test_a_braked_wheel_slides_with_the_whole_friction(scene, placed, monkeypatch):
    along, work = friction_used(rolled(scene, placed, monkeypatch, 0.0, spin="held")[0], scene)
    assert -1.0 < along < -1.0 + RIM and 1.0 - RIM < work < 1.0


@pytest.mark.validate
def test_a_wheel_that_turns_the_wrong_way_slides_twice_as_fast(scene, placed, monkeypatch):
    along, work = friction_used(rolled(scene, placed, monkeypatch, -1.0, spin="held")[0], scene)
    assert -1.0 < along < -1.0 + RIM and 2.0 * (1.0 - RIM) < work < 2.0


def test_held_spin_stays_as_it_is(scene, placed, monkeypatch):
    result, spin = rolled(scene, placed, monkeypatch, 1.005, spin="held", max_steps=60)
    assert (result.history["wheel_spin"] == spin).all() and result.energies["rotation"] == 0.0
