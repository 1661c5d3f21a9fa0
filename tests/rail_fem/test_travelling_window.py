"""A travelling window that is too short is refused before anything is meshed; a shorter window is less work."""

import numpy as np
import pytest

from rail_fem.case.casefile import load_case
from rail_fem.case.estimate import estimate_run
from rail_fem.case.preflight import preflight_errors
from rail_fem.fe.plan.travelling_window import SPARE, largest_half_patch, least_window, length_errors
from rail_fem.fe.plan.travelling_window import with_window as decided
from rail_fem.settings.explicit import WINDOW_ENDS

CASE = load_case("nose_transfer")
SETTINGS = CASE.runs["fe_full"].model_copy(
    update={
        "element_size": 2e-3,
        "element_aspect": 1.0,
        "wheel_element_ratio": 1.0,
        "window_ahead": None,
        "window_behind": None,
    }
)


def with_window(**lengths):
    return SETTINGS.model_copy(update=lengths)


def test_a_window_shorter_than_patch_and_plastic_zone_is_refused_with_the_length_to_use():
    ahead, behind = least_window(CASE.scene, SETTINGS)
    assert 0.015 < behind < 0.040 and 0.015 < ahead < 0.060
    settings = with_window(window_ahead=0.010, window_behind=0.080)
    (message,) = preflight_errors(CASE.scene, settings, 1, "fe_full")
    assert message.startswith("run.fe_full.window_ahead: 10 mm is shorter than")
    advised = 1e-3 * float(message.split("give ")[1].split()[0])
    assert ahead < advised < ahead + 1e-3
    assert length_errors(CASE.scene, with_window(window_ahead=advised, window_behind=0.080), "fe_full") == []
    assert len(length_errors(CASE.scene, with_window(window_ahead=0.0, window_behind=0.0), "fe_full")) == 2
    for enough in (with_window(), with_window(window_ahead=1.001 * ahead), with_window(window_behind=1.001 * behind)):
        assert length_errors(CASE.scene, enough, "fe_full") == []


def test_a_heavier_load_needs_a_longer_window():
    heavy = CASE.scene.replace_si(vehicle={"vehicle_sprung_mass": 300e3})
    assert largest_half_patch(heavy) > 1.5 * largest_half_patch(CASE.scene)
    assert min(np.subtract(least_window(heavy, SETTINGS), least_window(CASE.scene, SETTINGS))) > 5e-3


def test_work_follows_the_window_and_memory_the_body():
    whole, windowed = (
        estimate_run(CASE.scene, s) for s in (SETTINGS, with_window(window_ahead=0.05, window_behind=0.05))
    )
    assert windowed.wall_time < 0.7 * whole.wall_time
    # steel ahead of the path's end is meshed as well, as far as the window holds it there
    longer = SETTINGS.model_copy(update={"end": SETTINGS.end + with_window(window_ahead=0.05).beyond_end})
    assert windowed.memory == pytest.approx(estimate_run(CASE.scene, longer).memory) and windowed.memory > whole.memory
    behind = estimate_run(CASE.scene, with_window(window_ahead=None, window_behind=2.0))
    assert behind.wall_time == pytest.approx(whole.wall_time)


def test_a_coarser_twin_has_a_window_longer_by_its_slabs():
    """Both ends by what three elements grow by; what is not set stays so."""
    twin = with_window(window_ahead=0.060, window_behind=0.050, wheel_element_ratio=1.5).coarser(2.0)
    assert (twin.element_size, twin.wheel_size) == pytest.approx((4e-3, 6e-3))
    assert (twin.window_ahead, twin.window_behind) == pytest.approx((0.066, 0.056))
    twin = with_window(window_ahead="auto", window_behind=0.050).coarser(2.0)
    assert (twin.window_ahead, twin.window_behind) == ("auto", pytest.approx(0.056))
    plain = SETTINGS.coarser(1.5)
    assert plain.element_size == pytest.approx(3e-3)
    assert (plain.window_ahead, plain.window_behind) == (None, None)


@pytest.mark.parametrize("size", [0.5e-3, 2e-3, 6e-3])
@pytest.mark.parametrize("profile", ["P8-worn", "P8-hollow"])
def test_an_automatic_window_follows_its_elements_and_is_long_enough_on_any_scene(size, profile):
    """45 mm on the main job's elements, longer by the slabs of larger ones; by what contact far from the axle of a
    hollow wheel asks for; by the property alone where no scene is at hand."""
    scene = load_case(CASE.path, {"scene.wheel.profile": profile}).scene
    auto = with_window(window_ahead="auto", window_behind="auto", element_size=size)
    found = decided(scene, auto)
    assert length_errors(scene, found, "fe_full") == [] and found.has_window
    assert min(np.subtract(found.window_lengths, least_window(scene, auto))) >= SPARE
    assert min(np.subtract(found.window_lengths, auto.window_lengths)) >= 0
    if profile == "P8-worn":
        assert found.window_lengths == pytest.approx(auto.window_lengths, abs=1e-3)
        main = decided(scene, CASE.runs["fe_full"])
        assert [getattr(main, end) for end in WINDOW_ENDS] == [0.045, 0.045]
    one = decided(scene, with_window(window_ahead="auto", window_behind=None))
    assert one.window_behind is None and isinstance(one.window_ahead, float)
    assert decided(scene, found) is found
