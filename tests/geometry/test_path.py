"""Rigid wheel path: exact answers on plane, ramp and crown, order of the search, published path over the benchmark."""

import numpy as np
import pytest

from geometry.axes import tread_datum_y
from geometry.path.path_search import BodySearch, _tabulated
from geometry.path.wheel_path import wheel_path
from geometry.profiles.profile import Profile, arc, line
from geometry.profiles.wheel import wheel_profile
from geometry.surfaces.crossing import CastCrossing, CrossingError
from tests.order import assert_order

MM = 1e-3
RADIUS = 0.425
TIGHT = 1e-9  # the refinement closes in to 2e-8 m in place; heights are flat there, edges slope by less than 0.1


def cone(slope: float, start: float, end: float) -> Profile:
    """Wheel whose tread has this slope (0: cylinder) between two distances from its tread datum."""
    return Profile.from_pieces([line((start, slope * start), (end, slope * end), 1 * MM)], "cone")


def axle_height(crossing, wheel, x, **options):
    """Axle height above the crown's level, less the radius: what the exact answers below give."""
    search = BodySearch(crossing, wheel, options.pop("body", "wing"), x, RADIUS, tread_datum_y(), 0.25 * MM, 0.1)
    return search.contacts(np.asarray(x, float))


def test_a_cylinder_on_the_cast_plane_stands_on_its_outer_edge():
    """Plane z = y / 20: contact below the axle, at the wheel's field-side edge."""
    crossing, wheel = CastCrossing(9.25), cone(0.0, -5 * MM, 20 * MM)
    x = np.array([-0.55, -0.52, -0.50])
    height, point = axle_height(crossing, wheel, x)
    edge = tread_datum_y() + 20 * MM
    assert np.abs(height - edge / 20).max() < TIGHT
    assert np.abs(point - np.column_stack([x, np.full(3, edge), np.full(3, edge / 20)])).max() < 1e-7


@pytest.mark.parametrize("slope, edge", [(0.02, 20 * MM), (0.08, -5 * MM)])
def test_a_cone_on_the_cast_plane_stands_on_the_edge_its_slope_selects(slope, edge):
    """Flatter than the plane: field-side edge; steeper: gauge-side edge. Its radius there is R - slope * edge."""
    crossing = CastCrossing(9.25)
    height, point = axle_height(crossing, cone(slope, -5 * MM, 20 * MM), np.array([-0.52]))
    y = tread_datum_y() + edge
    assert height[0] == pytest.approx(y / 20 - slope * edge, abs=TIGHT)
    assert point[0, 1] == pytest.approx(y, abs=1e-7)


def test_a_crowned_wheel_touches_where_its_slope_is_that_of_the_plane():
    """Tread z = Rc - sqrt(Rc^2 - y^2): slope 1:20 at y = Rc * 0.05 / sqrt(1.0025)."""
    crossing, crown = CastCrossing(9.25), 0.2
    half = 20 * MM
    drop = crown - np.sqrt(crown**2 - half**2)
    wheel = Profile.from_pieces([arc((-half, drop), (half, drop), crown, 0.1 * MM)], "crowned")
    height, point = axle_height(crossing, wheel, np.array([-0.52]))
    touch = crown * 0.05 / np.sqrt(1.0025)
    exact = (tread_datum_y() + touch) / 20 - (crown - np.sqrt(crown**2 - touch**2))
    assert height[0] == pytest.approx(exact, abs=TIGHT)
    # sqrt(2 * round-off * Rc): a maximum is flat
    assert point[0, 1] == pytest.approx(tread_datum_y() + touch, abs=5e-6)


def test_a_cone_on_the_rail_crown_touches_where_the_slopes_meet():
    """56E1 crown R305 and cone 1:200: slope -y / sqrt(R^2 - y^2) = 0.005."""
    crossing, slope, crown = CastCrossing(9.25), 0.005, 0.305
    height, point = axle_height(crossing, cone(slope, -30 * MM, 30 * MM), np.array([-2.0]))
    shift = crossing.shape.leg.gauge_line + 34.887 * MM  # rail centre line, set to the crossing's gauge face
    touch = -crown * slope / np.sqrt(1 + slope**2)
    exact = np.sqrt(crown**2 - touch**2) - crown - slope * (touch + shift - tread_datum_y())
    assert height[0] == pytest.approx(exact, abs=1e-8)  # the rail line's chords: 0.02 mm
    assert point[0, 1] == pytest.approx(touch + shift, abs=0.05 * MM)


def test_a_cylinder_on_a_ramp_touches_ahead_of_its_axle():
    """Topping plane of slope a along x: axle at R sqrt(1 + a^2) above it, contact R a / sqrt(1 + a^2) ahead."""
    crossing = CastCrossing(9.25)
    wheel = cone(0.0, -22 * MM, -15 * MM)
    x = np.array([0.28, 0.29, 0.30])
    height, point = axle_height(crossing, wheel, x, body="nose")
    c = crossing.shape
    a = c.topping_slope * (1 - c.tan_half_angle**2 / (1 + c.tan_half_angle**2))  # along x at fixed y
    y = tread_datum_y() - 15 * MM  # the plane rises to the field side, like the centre line's foot
    plane = crossing.top_height(x, y, "nose")
    assert np.abs(height - (plane + RADIUS * (np.sqrt(1 + a * a) - 1))).max() < TIGHT
    # a flat maximum: position to sqrt(2 R * round-off) = 1e-8, times the golden section's own 2e-8
    assert np.abs(point[:, 0] - x - RADIUS * a / np.sqrt(1 + a * a)).max() < 1e-7


def test_the_slope_on_a_ramp_is_the_ramps():
    """The wheel climbs as its ramp does, 5 % here, of which a slope taken as ahead / R would lack 6e-5. Position to
    1e-7 m, over R."""
    crossing, x = CastCrossing(9.25, topping_slope=0.05, topping_depth=10 * MM), np.array([0.28, 0.29, 0.30])
    path = wheel_path(cone(0.0, -22 * MM, -15 * MM), crossing, x)
    y = path.nose_point[:, 1]
    ramp = (crossing.top_height(x + MM, y, "nose") - crossing.top_height(x, y, "nose")) / MM
    assert path.on_nose.all() and (ramp > 0.049).all()
    assert path.slope == pytest.approx(ramp, abs=1e-6)


def test_slope_is_the_derivative_of_height():
    crossing, wheel = CastCrossing(), wheel_profile("P8-worn")
    x = np.concatenate([np.linspace(-0.7, -0.6, 7), np.linspace(0.2, 0.42, 9)])
    step = 1e-5
    path, ahead, behind = (wheel_path(wheel, crossing, x + d) for d in (0.0, step, -step))
    smooth = (path.on_nose == ahead.on_nose) & (path.on_nose == behind.on_nose)
    assert smooth.sum() > 12
    # step / 2R, and the ridges
    assert np.abs(path.slope - (ahead.height - behind.height) / (2 * step))[smooth].max() < 5e-5


def test_the_first_search_is_second_order_and_the_refined_height_does_not_feel_it():
    crossing, wheel = CastCrossing(), wheel_profile("S1002")
    x = np.linspace(-0.9, 0.5, 301)
    refined, errors = {}, []
    sizes = np.array([1.0, 0.5, 0.25, 0.125]) * MM
    for size in sizes:
        search = BodySearch(crossing, wheel, "wing", x, RADIUS, tread_datum_y(), size, 0.1)
        refined[size] = search.contacts(x)[0]
        errors.append(np.sqrt(np.mean((search.first_search(x) - refined[size]) ** 2)))
    assert_order(sizes, errors, 2, slack=0.3)
    for size in sizes[:-1]:
        assert np.abs(refined[size] - refined[sizes[-1]]).max() < TIGHT


def test_wing_and_nose_carry_at_once_at_the_transfer():
    crossing, wheel = CastCrossing(), wheel_profile("P8-worn")
    path = wheel_path(wheel, crossing, np.linspace(0.0, 0.7, 200))
    assert len(path.transfers) == 1
    at = wheel_path(wheel, crossing, path.transfers)
    assert max(at.wing_gap[0], at.nose_gap[0]) < 1e-8  # placed to 1e-7 m where the slopes differ by 0.02
    assert np.all(path.on_nose == (path.x > path.transfers[0]))
    shuffled = np.random.default_rng(0).permutation(path.x)
    np.testing.assert_array_equal(wheel_path(wheel, crossing, shuffled).transfers, path.transfers)


def test_height_is_zero_on_plain_line_and_gaps_are_never_negative():
    path = wheel_path(wheel_profile("P8"), CastCrossing(), np.linspace(-1.5, 0.9, 241))
    assert np.abs(path.height[path.x < -0.9]).max() < TIGHT
    assert np.nanmin(path.wing_gap) == 0.0 and np.nanmin(path.nose_gap) == 0.0
    assert np.all((path.wing_gap == 0.0) | (path.nose_gap == 0.0))


def test_contact_points_lie_on_both_surfaces():
    crossing, wheel = CastCrossing(), wheel_profile("P8")
    path = wheel_path(wheel, crossing, np.linspace(-0.8, 0.7, 151))
    x, y, z = path.contact_point.T
    rolling = RADIUS - wheel.height(y - tread_datum_y())
    on_wheel = RADIUS + path.height - np.sqrt(rolling**2 - (x - path.x) ** 2)
    plain = wheel_path(wheel, crossing, np.array([-5.0])).contact_point[0]
    on_wheel += plain[2] - wheel.height(plain[1] - tread_datum_y())
    assert np.abs(on_wheel - z).max() < TIGHT


# lift over the leg transition [mm], steepest rise there [mrad], lowest x [mm], fall before and mean rise after it
# [mrad], of rigid wheels of radius 460 mm over the benchmark sections: geometry_and_materials.md 3.7, computed on the
# data by others
PUBLISHED = {
    "P8": (0.49, 21.6, 272, 7.3, 11.0),
    "P8-worn": (1.10, 34.6, 304, 7.1, 7.9),
    "P1": (-0.28, 0.0, 298, 5.4, 13.4),
    "S1002": (0.61, 16.8, 276, 7.2, 10.3),
}


@pytest.mark.parametrize("name", PUBLISHED)
def test_paths_over_the_benchmark_crossing_match_the_published_ones(name):
    """Differences: 0.01 mm in lift, 0.7 mrad in the steepest rise, 2 mm in the lowest point; rise as a mean over 55
    mm."""
    lift, steepest, lowest, fall, rise = PUBLISHED[name]
    crossing, wheel = CastCrossing(9.25), wheel_profile(name)
    entry = wheel_path(wheel, crossing, np.linspace(-0.8, -0.5, 301), radius=0.46)
    nose = wheel_path(wheel, crossing, np.linspace(0.15, 0.42, 271), radius=0.46)
    at = nose.transfers[0]
    around = wheel_path(wheel, crossing, np.array([at - 0.02, at, at + 0.055]), radius=0.46).height
    assert entry.height[-1] / MM == pytest.approx(lift, abs=0.01)
    assert max(entry.slope.max(), 0.0) / MM == pytest.approx(steepest, abs=0.75)
    assert nose.x[np.argmin(nose.height)] / MM == pytest.approx(lowest, abs=2.5)
    assert (around[0] - around[1]) / 0.02 / MM == pytest.approx(fall, abs=0.15)
    assert (around[2] - around[1]) / 0.055 / MM == pytest.approx(rise, abs=0.25)


def test_a_hollow_wheel_is_lifted_by_its_false_flange_and_shows_no_dip():
    """Published: lifted 2.70 mm, no dip. It leaves the wing where the chamfer of the rim comes off the wing's
    corner."""
    crossing, wheel = CastCrossing(9.25), wheel_profile("P8-hollow")
    entry = wheel_path(wheel, crossing, np.linspace(-0.8, -0.58, 221), radius=0.46)
    nose = wheel_path(wheel, crossing, np.linspace(0.15, 0.6, 226), radius=0.46)
    assert np.interp(-0.6, entry.x, entry.height) / MM == pytest.approx(2.70, abs=0.03)
    assert nose.slope.max() < 1e-3 and nose.height.min() == pytest.approx(nose.height[-1], abs=1e-7)
    assert 0.42 < nose.transfers[0] < 0.465  # between benchmark sections: wing carries at 425 mm, nose at 465 mm


def test_a_shifted_wheel_changes_its_path_smoothly_through_zero_shift():
    crossing, wheel = CastCrossing(), wheel_profile("P8-worn")
    heights = [wheel_path(wheel, crossing, np.array([0.1, 0.25]), lateral_shift=s).height for s in (-1e-5, 0.0, 1e-5)]
    assert np.abs(heights[0] - 2 * heights[1] + heights[2]).max() < 1e-7


@pytest.mark.parametrize(
    "arguments, complaint",
    [
        ({"x": np.array([np.nan])}, "at least one finite"),
        ({"x": np.array([[0.0, 0.1]])}, r"as \(n,\)"),
        ({"x": np.array([9.0])}, r"leaves the modelled crossing, -10 to 1.\d+ m: keep x within -9\.9 to 1\.\d+ m"),
        ({"x": np.array([0.0]), "radius": 425.0}, "radius = 425 m is outside"),
        ({"x": np.array([0.0]), "lateral_shift": 1.0}, "stands over neither wing nor nose at x = 0"),
    ],
)
def test_impossible_paths_are_refused(arguments, complaint):
    with pytest.raises(CrossingError, match=complaint):
        wheel_path(wheel_profile("P8"), CastCrossing(), **arguments)


def test_a_path_asked_for_again_is_the_same_and_its_first_search_is_kept():
    crossing, wheel, x = CastCrossing(9.5), wheel_profile("P8"), np.linspace(-0.9, -0.6, 60)
    first = wheel_path(wheel, crossing, x)
    kept = _tabulated.cache_info()
    again = wheel_path(wheel_profile("P8"), CastCrossing(9.5), x)
    assert np.array_equal(first.height, again.height) and np.array_equal(first.wing_point, again.wing_point)
    now = _tabulated.cache_info()
    assert now.misses == kept.misses and now.hits == kept.hits + 3  # wing, nose, and the wing on plain line
    other = wheel_path(wheel, CastCrossing(9.5, leg_lowering=0.5e-3), x)
    assert np.abs(other.height - first.height).max() > 0.1e-3
