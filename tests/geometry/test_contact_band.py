"""Contact bands on the plan of the crossing: closed forms for crown and plane; numbers of a path whose shape is
known."""

import numpy as np
import pytest

from geometry.axes import tread_datum_y
from geometry.path.contact_band import AWAY, band_edges, clearance, path_numbers
from geometry.path.wheel_path import wheel_path
from geometry.profiles.profile import Profile, line
from geometry.profiles.wheel import wheel_profile
from geometry.surfaces.crossing import CastCrossing

MM = 1e-3


def cone(slope: float, start: float, end: float) -> Profile:
    return Profile.from_pieces([line((start, slope * start), (end, slope * end), 1 * MM)], "cone")


def test_a_cone_on_the_rail_crown_runs_on_a_band_of_hertz_width():
    """56E1 crown of R = 305 mm: half width sqrt(R d) for an approach d, of which half is overlap; the grid's step to
    either side."""
    crossing, approach, step = CastCrossing(9.25), 20e-6, 0.05 * MM
    wheel = cone(0.005, -30 * MM, 30 * MM)
    run = wheel_path(wheel, crossing, np.arange(-2.1, -1.9, 1 * MM))
    y = np.arange(-25 * MM, 25 * MM, step)
    edges = band_edges(clearance(crossing, wheel, run, np.array([-2.0]), y, "wing"), y, approach)
    assert edges[0].mean() == pytest.approx(run.contact_point[100, 1], abs=step)
    assert (edges[0, 1] - edges[0, 0]) / 2 == pytest.approx(np.sqrt(0.305 * approach), abs=step)


def test_the_clearance_of_the_touched_place_is_zero_and_none_is_below():
    """Spacing h of the axle's positions: h^2 / (8 R) = 0.3 um above what the exact path would leave."""
    crossing, wheel = CastCrossing(9.25), wheel_profile("P8")
    run = wheel_path(wheel, crossing, np.arange(0.2, 0.35, 1 * MM))
    y = np.arange(-60, 80, 0.5) * MM
    for body, carries in (("wing", ~run.on_nose), ("nose", run.on_nose)):
        near = clearance(crossing, wheel, run, run.contact_point[carries][20:-20, 0], y, body)
        assert near.min() > -1e-8
        at = np.array(
            [clearance(crossing, wheel, run, p[:1], p[1:2], body)[0, 0] for p in run.contact_point[carries][20:-20:10]]
        )
        assert np.abs(at).max() < 0.4e-6


def test_beside_the_wheel_and_off_the_body_nothing_is_near():
    crossing, wheel = CastCrossing(9.25), cone(0.0, -5 * MM, 20 * MM)
    run = wheel_path(wheel, crossing, np.arange(-0.56, -0.5, 1 * MM))
    y = np.array([tread_datum_y() - 6 * MM, tread_datum_y() + 21 * MM])
    assert (clearance(crossing, wheel, run, np.array([-0.53]), y, "wing") == AWAY).all()
    assert (clearance(crossing, wheel, run, np.array([-0.53]), np.array([0.0]), "nose") == AWAY).all()
    assert np.isnan(band_edges(np.full((2, 3), AWAY), np.arange(3.0), 1e-4)).all()


@pytest.mark.parametrize("name, lift, lowest, dip", [("P8", 0.49, 272, 18.3), ("P1", -0.28, 298, 18.8)])
def test_numbers_of_the_path_match_the_published_ones(name, lift, lowest, dip):
    """On the benchmark's sections, found by others (geometry_and_materials.md 3.7)."""
    crossing = CastCrossing(9.25)
    run = wheel_path(wheel_profile(name), crossing, np.arange(-0.9, 0.5, 2 * MM), radius=0.46)
    numbers = path_numbers(run, crossing)
    assert numbers.ramp_lift / MM == pytest.approx(lift, abs=0.01)
    assert numbers.lowest_x / MM == pytest.approx(lowest, abs=3)
    assert numbers.dip / MM == pytest.approx(dip, abs=0.3)
    assert numbers.dip == numbers.fall + numbers.rise


def test_trailing_climbs_what_facing_falls():
    crossing = CastCrossing(9.25)
    run = wheel_path(wheel_profile("P8"), crossing, np.arange(-0.9, 0.5, 2 * MM), radius=0.46)
    numbers = path_numbers(run, crossing)
    assert numbers.trailing_slope == pytest.approx(-run.slope.min())
    assert numbers.trailing_slope == pytest.approx(numbers.fall, rel=0.03)  # the wing's fall is even
