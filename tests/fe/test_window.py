"""The model fe_window: the FE takes up the motion that rigid_hertz hands over."""

import numpy as np
import pytest

from rail_fem.case.casefile import load_case
from rail_fem.contact.contact_table import contact_table
from rail_fem.fe.start_state import from_rigid_hertz, resting
from rail_fem.models import fe_window
from rail_fem.passes.plastic_indentation import contacts_of
from rail_fem.passes.vertical_dynamics import TRACK, WHEEL
from rail_fem.passes.vertical_pass import run_pass
from rail_fem.result.runfolder import differences, fingerprint
from rail_fem.run.form import PANEL
from rail_fem.settings.explicit import FeWindowSettings
from rail_fem.settings.light import RigidHertzSettings

APPROACH = RigidHertzSettings(start=0.095, end=0.54)


@pytest.fixture(scope="module")
def scene():
    return load_case("thesis/case_02").scene


def test_a_light_pass_that_has_not_moved_yet_hands_over_the_state_at_rest(scene):
    """On the flat start of the window: vertical speed of the path 0.02 m/s at most, forces to the settling of the first
    step."""
    given, at_rest = from_rigid_hertz(scene, APPROACH, 0.0955), resting(scene, 0.0)
    assert (given.force, given.suspension, given.foundation) == pytest.approx(
        (at_rest.force, at_rest.suspension, at_rest.foundation), rel=2e-3
    )
    assert np.abs([given.axle, given.sprung, given.crossing]).max() < 0.02


def test_the_state_is_that_of_the_light_pass_and_in_the_air_there_is_none(scene):
    run = run_pass(
        scene, APPROACH, contacts_of(scene, APPROACH, contact_table(scene, 0.095, 0.54, APPROACH.path_spacing))
    )
    at = 20000 if len(run.x) > 40000 else len(run.x) // 2
    state = from_rigid_hertz(scene, APPROACH, float(run.x[at]))
    assert (
        state.force == run.force[:, at].sum()
        and state.axle == run.motion.velocity[at, WHEEL]
        and state.foundation == -run.motion.position[at, TRACK]
    )
    on_beam = from_rigid_hertz(scene.replace_si(bearers=PANEL), APPROACH, float(run.x[at]))
    assert on_beam.beam.height(float(run.x[at])) == -on_beam.foundation < 0 == on_beam.crossing
    lifted = np.flatnonzero(run.force.sum(axis=0) == 0)
    with pytest.raises(ValueError, match="in the air at x = "):
        from_rigid_hertz(scene, APPROACH, float(run.x[lifted[len(lifted) // 2]]))
    with pytest.raises(ValueError, match="give an earlier approach_start"):
        from_rigid_hertz(scene, APPROACH, 0.05)


def test_what_hands_over_follows_the_law_of_indentation_that_belongs_to_the_run(scene):
    """On the falling wing the wheel comes another way to x = 250 mm by each law; a window begun by one is not gone on
    with by the other."""
    windows = [
        FeWindowSettings(start=0.25, end=0.35, approach_start=0.095, indentation_law=law)
        for law in ("rolled", "fully plastic")
    ]
    rolled, plastic = (from_rigid_hertz(scene, fe_window.approach_of(window), 0.25) for window in windows)
    assert abs(rolled.force - plastic.force) > 0.02 * plastic.force
    assert differences(*(fingerprint("fe_window", scene, window) for window in windows))
    assert windows[0] == FeWindowSettings(start=0.25, end=0.35, approach_start=0.095)


def test_the_bodies_go_on_as_the_light_pass_left_them(scene):
    """After the settling (0.3 ms, cut short for the test) crossing and wheel start at the given heights and speeds;
    0.06 ms later these have changed by what the forces can do: force / mass * time."""
    settle, later = 0.3e-3, 0.06e-3
    settings = FeWindowSettings(
        element_size=5e-3, start=0.21, end=0.35, approach_start=0.095, settle_time=settle, field_frames=1, max_steps=900
    )
    state = from_rigid_hertz(scene, RigidHertzSettings(start=0.095, end=0.35), 0.21 + scene.speed * settle)
    history = fe_window.solve(scene, settings).history
    time = history["time"]
    assert time[-1] > settle + later
    assert history["crossing_height"][time < settle] == pytest.approx(-state.foundation, rel=1e-12)
    after = (time > settle) & (time <= settle + later + 1e-9)
    for height, speed, mass in (
        ("crossing_height", state.crossing, scene.foundation.track_mass),
        ("wheel_height", state.axle, scene.vehicle.wheel_unsprung_mass),
    ):
        found = np.polyfit(time[after], history[height][after], 1)[0]
        assert found == pytest.approx(speed, abs=later * 2 * scene.static_wheel_load / mass)
    assert min(abs(state.crossing), abs(state.axle)) > 1e-3  # there is something to take up
