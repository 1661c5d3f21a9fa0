"""Contact on rails that change along x: exact answers on planes, cylinders and valleys; the prismatic search's own;
every basin that a grid finds."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.ndimage import label

from geometry.contact.flange_back import back_gap
from geometry.contact.lofted_search import SurfaceSearch
from geometry.contact.prismatic_search import ContactSearch, Motion, creepages
from geometry.path.wheel_path import wheel_path
from geometry.profiles.formats.slices import read_slices
from geometry.profiles.profile import Profile, ProfileError
from geometry.profiles.wheel import wheel_profile
from geometry.surfaces.crossing import CastCrossing
from geometry.surfaces.loft_kernel import RIDGE, SIDE, WIDEST, window
from geometry.surfaces.lofted_rail import LoftedBody, RailSurface
from geometry.surfaces.sections import SectionCrossing
from geometry.wheelset import SIDES, CheckRail, Track, Wheelset, WheelsetError
from tests.geometry.cut_sections import write_cut_sections
from tests.geometry.lofted_rails import RADIUS, on_left, sphere, surface
from tests.outside import needs, outside

MM, UM = 1e-3, 1e-6
MIDDLE = 1.435 / 2 + 35 * MM  # y of a surface's own origin in side axes
BENCHMARK = outside("formats/uk_crossing.slcs")


def centre(state: Wheelset) -> np.ndarray:
    """Middle of the left wheel's circle at its tread datum, in track axes."""
    axle = np.array(
        [-np.sin(state.yaw) * np.cos(state.roll), np.cos(state.yaw) * np.cos(state.roll), np.sin(state.roll)]
    )
    return np.array([state.x, state.y, state.z]) + state.datum_arm * axle


@pytest.mark.parametrize("along, across", [(0.0, 0.05), (0.03, -0.04), (-0.08, 0.1)])
@pytest.mark.parametrize("yaw, roll", [(0.0, 0.0), (0.03, 0.004)])
def test_a_sphere_touches_a_tilted_plane_below_its_centre(along, across, yaw, roll):
    """Uneven sections of z = a x + b y: gap = distance of the centre less the radius, curvature 1 / R both ways."""
    search = on_left(sphere(), surface(lambda x, y: along * x + across * y, np.array([-0.3, -0.11, 0.02, 0.05, 0.31])))
    state = replace(search.wheelset, y=1 * MM, z=RADIUS + 2 * MM, yaw=yaw, roll=roll)
    normal = np.array([-along, -across, 1]) / np.sqrt(1 + along**2 + across**2)
    gap = (centre(state) - [0, MIDDLE, 0]) @ normal - RADIUS
    found = search.contacts(state, "left")
    assert len(found) == 1
    assert found.gap[0] == pytest.approx(gap, abs=1e-9)
    assert np.abs(found.position[0] - (centre(state) - RADIUS * normal)).max() < 1e-9
    assert np.abs(found.normal[0] - normal).max() < 1e-9
    # second derivative of the wheel's Hermite table
    assert found.curvature[0] == pytest.approx([1 / RADIUS, 1 / RADIUS], rel=1e-5)
    assert creepages(state, found, Motion(30.0, spin=0.0))[0, 0] == pytest.approx(
        normal[2] / np.hypot(normal[0], normal[2]), abs=1e-9
    )


@pytest.mark.parametrize("radius", [0.5, -1.0])
def test_a_sphere_on_a_cylinder_across_the_track(radius):
    """Crest (or valley) of this radius, cut every 2 mm: a cubic spline errs by 5/384 h^4 z'''' = 5e-12 m, its curvature
    by h^2/12 z'''' = 1e-5 / m."""
    bow = lambda x, y: 0 * y + np.sign(radius) * (np.sqrt(radius**2 - x**2) - abs(radius))
    x = 50 * MM
    search = on_left(sphere(), surface(bow, np.arange(-0.2, 0.2001, 2 * MM)), x)
    height = np.sign(radius) * np.sqrt((radius + RADIUS) ** 2 - x**2) - radius
    state = replace(search.wheelset, z=height)
    towards = np.sign(radius) * np.array([-x, 0, -radius - height]) / abs(radius + RADIUS)
    found = search.contacts(state, "left").lowest()
    assert found.gap[0] == pytest.approx(0, abs=1e-9)
    assert np.abs(found.position[0] - (centre(state) + RADIUS * towards)).max() < 1e-9
    assert found.curvature[0] == pytest.approx(sorted([1 / RADIUS, 1 / RADIUS + 1 / radius]), rel=1e-4)


@pytest.mark.parametrize("across", [0.0, 0.08])
def test_a_wheel_in_a_valley_touches_ahead_and_behind(across):
    """Two planes z = a |x| + b y, no valley from y = 10 mm inwards if they are tilted: equal points R n below the
    centre, found as two, one on each; the valley's line is between sections 1 mm apart."""
    slope = 0.05
    share = lambda y: np.clip((y + 1 * (across == 0) - 10 * MM) / (10 * MM), 0, 1)
    height = lambda x, y: slope * abs(x) * share(y) + across * y
    search = on_left(sphere(), surface(height, np.arange(-0.1605, 0.161, 1 * MM)))
    state = replace(search.wheelset, z=RADIUS)
    found = search.contacts(state, "left", reach=1e-6)
    assert len(found) == 2
    assert np.ptp(found.gap) < 1e-12
    normal = np.array([[slope, -across, 1], [-slope, -across, 1]]) / np.sqrt(1 + slope**2 + across**2)
    expected = centre(state) - RADIUS * normal
    assert found.position[np.argsort(found.position[:, 0])] == pytest.approx(expected, abs=1e-9)
    assert found.gap == pytest.approx((centre(state) - [0, MIDDLE, 0]) @ normal.T - RADIUS, abs=1e-9)


def test_a_ridge_between_two_stations_is_a_line_or_ends_where_it_does():
    """Slopes of two stations 1 mm apart; in the second case from 0.3 mm on all belongs to one side."""
    memory = np.zeros(max(RIDGE, SIDE) + 1)
    memory[[RIDGE, SIDE]] = 1, 1
    at = lambda s, there: window.py_func(
        s, SimpleNamespace(memory=memory, ridges=np.array([[0.0, MM], [0.01, there], [0.0, 0.0], [0.3 * MM, 0.0]]))
    )
    assert at(0.2 * MM, 0.03) == pytest.approx((0.014, WIDEST))
    assert at(0.2 * MM, WIDEST) == (0.01, WIDEST) and at(0.4 * MM, WIDEST) == (WIDEST, WIDEST)


@pytest.mark.parametrize("lateral, yaw", [(0.0, 0.0), (6.5 * MM, 0.02), (-11 * MM, -0.03)])
def test_a_prismatic_rail_gives_what_the_prismatic_search_gives(lateral, yaw):
    wheelset, track = Wheelset(wheel_profile("P8")), Track.plain_line()
    prism, loft = ContactSearch(wheelset, track), SurfaceSearch(wheelset, track).at(3.0)
    a, b = prism.settle(lateral, yaw), loft.settle(lateral, yaw)
    assert (b.z, b.roll) == pytest.approx((a.z, a.roll), abs=1e-14)
    for side in SIDES:
        one, two = prism.contacts(a, side, 0.1 * MM), loft.contacts(b, side, 0.1 * MM)
        assert len(one) == len(two)
        assert np.abs(one.position + [3, 0, 0] - two.position).max() < 1e-12
        assert (
            np.abs(one.tensor - two.tensor).max() < 1e-6 and np.abs(one.rail_station - two.rail_station).max() < 1e-12
        )


@pytest.fixture(scope="module")
def crossing() -> CastCrossing:
    return CastCrossing(9.25)


@pytest.fixture(scope="module")
def rail(crossing) -> RailSurface:
    return RailSurface.of_crossing(crossing, -0.85, 0.62)


@pytest.mark.parametrize("x, lateral, yaw", [(-0.65, -3 * MM, 0.01), (0.27, 2 * MM, -0.005)])
def test_left_and_right_facing_and_trailing_are_mirror_images(rail, x, lateral, yaw):
    """In y to the last bit; in x to round-off, as sums of spline weights are taken in another order."""
    wheelset, track = Wheelset(wheel_profile("P8")), Track.plain_line()
    left, right = SurfaceSearch(wheelset, track, left=rail).at(x), SurfaceSearch(wheelset, track, right=rail).at(x)
    a, b = left.settle(lateral, yaw), right.settle(-lateral, -yaw)
    assert (a.z, a.y, a.roll) == (b.z, -b.y, -b.roll)
    one, two = left.contacts(a, "left", 0.2 * MM), right.contacts(b, "right", 0.2 * MM)
    assert np.array_equal(one.position, two.position * [1, -1, 1]) and np.array_equal(one.curvature, two.curvature)
    turned = SurfaceSearch(wheelset, track, left=rail.turned()).at(-x)
    c = turned.settle(lateral, -yaw)
    assert (c.z, c.roll) == pytest.approx((a.z, a.roll), abs=1e-12)
    assert np.abs(turned.contacts(c, "left", 0.2 * MM).position * [-1, 1, 1] - one.position).max() < 1e-9


def wheel_points(state: Wheelset, s: np.ndarray, theta: np.ndarray) -> np.ndarray:
    """(3, n, m)  points of the left wheel in track axes, written down anew from the angles."""
    forward = np.array([np.cos(state.yaw), np.sin(state.yaw), 0])
    left, up = np.array([-np.sin(state.yaw), np.cos(state.yaw), 0]), np.array([0, 0, 1.0])
    axle, down = (
        np.cos(state.roll) * left + np.sin(state.roll) * up,
        np.sin(state.roll) * left - np.cos(state.roll) * up,
    )
    radius = (state.radius - state.left.height(s))[:, None]
    return np.array(
        [
            (state.x, state.y, state.z)[i]
            + (state.datum_arm + s[:, None]) * axle[i]
            + radius * (np.sin(theta) * forward[i] + np.cos(theta) * down[i])
            for i in range(3)
        ]
    )


@pytest.mark.parametrize(
    "x, lateral, yaw",
    [
        (-0.66, 4 * MM, 0.0),
        (-0.45, -6 * MM, 0.015),
        (0.1, 0.0, -0.01),
        (0.24, 3 * MM, 0.004),
        (0.252, 0.0, 0.0),
        (0.35, 9 * MM, -0.02),
        (0.5, -8 * MM, 0.02),
    ],
)
def test_every_place_where_a_grid_on_the_wheel_comes_near_the_crossing_is_found(crossing, rail, x, lateral, yaw):
    """Grid of 0.05 by 0.4 mm against the crossing's own closed forms. The wheel just touches (surface: 4 um at edges,
    sections 4 mm apart); each cluster of grid points within 30 um of touch has its point."""
    search = SurfaceSearch(Wheelset(wheel_profile("P8")), Track.plain_line(), left=rail).at(x)
    state = search.settle(lateral, yaw)
    state = replace(state, z=state.z - search.contacts(state, "left").lowest().gap[0])
    s, theta = np.arange(-42, 64, 0.05) * MM, np.linspace(-0.14, 0.14, 315)
    px, py, pz = wheel_points(state, s, theta)
    py = py - MIDDLE
    gap = pz - np.fmax(
        crossing.top_height(px, py, "wing"),
        crossing.top_height(np.maximum(px, crossing.nose_x), py, "nose") + np.where(px < crossing.nose_x, -1, 0),
    )
    gap = np.where(np.isfinite(gap), gap, 1.0)
    reach = 30 * UM
    assert -5 * UM < gap.min() < 3 * UM
    found = search.contacts(state, "left", reach)
    clusters, count = label(gap < reach - 5 * UM)
    for k in range(1, count + 1):
        rows, columns = np.nonzero(clusters == k)
        near = (np.abs(found.station[:, None] - s[rows]) < 0.11 * MM) & (
            np.abs(found.position[:, :1] - px[rows, columns]) < 0.9 * MM
        )
        assert near.any()
    assert count <= len(found)


@pytest.fixture(scope="module", params=[pytest.param("benchmark", marks=needs("formats/uk_crossing.slcs")), "own file"])
def sections_file(request, tmp_path_factory):
    """148 sections of the benchmark; or our own, cut from the parametric crossing every 16 mm, every 5 mm beside the
    nose's tip, and written."""
    if request.param == "benchmark":
        return BENCHMARK
    stations = np.unique(np.round(np.concatenate([np.arange(-1.1, 1.05, 16 * MM), np.arange(0.12, 0.22, 5 * MM)]), 6))
    return write_cut_sections(tmp_path_factory.mktemp("cut"), stations)


def test_the_path_over_measured_sections_is_that_over_the_parametric_crossing(sections_file):
    """Points matched at equal distances from the gauge faces; gate: rail_fem's own
    (tests/geometry/test_section_path.py)."""
    wheel, x = wheel_profile("P8"), np.arange(-0.75, 0.6, 15 * MM)
    rail = RailSurface.of_sections(SectionCrossing.from_slices(read_slices(sections_file)), -1.0, 1.0)
    search = SurfaceSearch(Wheelset(wheel, radius=0.46, z=0.46), Track.plain_line(), left=rail)
    clear = lambda at: search.contacts(replace(search.wheelset, x=at), "left").lowest()
    height = np.array([-(c.gap / c.normal[:, 2])[0] for c in map(clear, [-0.85, *x])])
    model = wheel_path(wheel, CastCrossing(9.25), x, radius=0.46).height
    assert np.abs(height[1:] - height[0] - model).max() < 0.06 * MM


def test_a_switch_blade_that_covers_its_stock_rail_is_the_surface():
    """A flat stock rail and a blade on top of it that rises with x: the wheel stands on the blade where that is higher,
    never on what it covers."""
    flat = np.column_stack([np.linspace(-40, 40, 81) * MM, np.zeros(81)])
    blade = lambda x: np.column_stack([np.linspace(-40, 40, 81) * MM, np.full(81, 0.01 * x)])
    x = np.array([-0.5, 0.0, 0.5])
    rail = RailSurface((LoftedBody.through(x, [flat] * 3), LoftedBody.through(x, [blade(at) for at in x])))
    for at, slope in ((-0.2, 0.0), (0.2, 0.01)):
        found = on_left(sphere(), rail, at).contacts(
            Wheelset(sphere(), radius=RADIUS, x=at, z=RADIUS - 4 * MM), "left", 10 * MM
        )
        assert len(found) == 1
        assert found.normal[0, 0] == pytest.approx(-np.sin(np.arctan(slope)), abs=1e-9)


def test_the_loft_converges_to_the_crossing_it_was_cut_from(crossing):
    """Where the surface is smooth, sections 4 mm apart hold 0.01 um; 16 mm apart err by at least as much."""
    random = np.random.default_rng(0)
    x, y = random.uniform(-0.55, -0.48, 2000), random.uniform(-25, 25, 2000) * MM
    exact = crossing.top_height(x, y, "wing")
    errors = [
        np.abs(RailSurface.of_crossing(crossing, -0.6, -0.4, spacing).height(x, y) - exact)[exact > -5 * MM]
        for spacing in (16 * MM, 4 * MM)
    ]
    assert np.percentile(errors[1], 95) < 0.01 * UM
    assert np.percentile(errors[1], 95) <= np.percentile(errors[0], 95)


def random_states(rail: RailSurface, count: int, seed: int, noise: float) -> int:
    """Random positions, shifts and yaws on the crossing, a new noisy wheel every 50; returns how many stood on finite
    points."""
    random, new, stood = np.random.default_rng(seed), wheel_profile("P8"), 0
    for k in range(count):
        if k % 50 == 0:
            points = new.points[::5] + [0.0, noise] * random.standard_normal((len(new.points[::5]), 2))
            wheel = new if noise == 0 else Profile.from_points(points, "noisy P8").graph_part()
            whole = SurfaceSearch(
                Wheelset(wheel), Track.plain_line(gauge=1.435 + random.uniform(-3, 6) * MM), left=rail
            )
        search = whole.at(random.uniform(-0.7, 0.5))
        state = search.settle(random.uniform(-10, 10) * MM, random.uniform(-0.03, 0.03))
        for side in SIDES:
            found = search.contacts(replace(state, z=state.z - 50 * UM), side)
            values = np.concatenate([np.ravel(v) for v in (found.position, found.angle, found.curvature, found.gap)])
            assert len(found) >= 1 and np.isfinite(values).all() and found.gap.min() < 2 * noise
        stood += 1
    return stood


@pytest.mark.parametrize("noise", [0.0, 10 * UM, 100 * UM])
def test_random_states_on_the_crossing_find_their_points(rail, noise):
    assert random_states(rail, 100, 3, noise) == 100


def test_flange_backs_stop_at_check_rail_and_wing_where_these_are(rail):
    """The check rail opposite holds the wheelset off the nose from x = -0.3 m on; the wing beside the flange, 41 mm
    from the nose, from 0 m on."""
    track = Track.plain_line(left_check=CheckRail(0.041), right_check=CheckRail(0.041))
    search = SurfaceSearch(
        Wheelset(wheel_profile("P8")), track, left=rail, checked={"right": (-0.3, 1.0), "left": (0.0, 1.0)}
    )
    free = SurfaceSearch(Wheelset(wheel_profile("P8")), Track.plain_line(), left=rail)
    for x, lateral, side in ((0.3, 8 * MM, "right"), (0.3, -8 * MM, "left"), (-0.2, 8 * MM, "right")):
        held = search.at(x).settle(lateral, 0.004)
        check = search.at(x).track.check_rail(side)
        gap = back_gap(held, side, check, track.gauge / 2 - check.flangeway)
        assert gap == pytest.approx(0, abs=1e-9)
        assert abs(held.y + held.radius * np.sin(held.roll)) < 5 * MM
    for x, lateral in ((-0.5, 8 * MM), (-0.2, -8 * MM)):
        assert search.at(x).settle(lateral).y == free.at(x).settle(lateral).y


def test_what_cannot_be_is_refused(rail):
    wheelset, track = Wheelset(wheel_profile("P8")), Track.plain_line()
    search = SurfaceSearch(wheelset, track, left=rail)
    with pytest.raises(WheelsetError, match="known from"):
        search.at(0.6)
    with pytest.raises(WheelsetError, match="known from"):
        search.at(float("nan"))
    with pytest.raises(WheelsetError, match="stands over no rail"):
        search.at(0.0).settle(0.3)
    section = np.column_stack([np.linspace(-1, 1, 9), np.zeros(9)])
    with pytest.raises(ProfileError, match="growing x"):
        LoftedBody.through([0.0, 0.0], [section, section])
    with pytest.raises(ProfileError, match="not finite"):
        LoftedBody.through([0.0, 1.0], [section, section * np.nan])
    with pytest.raises(ProfileError, match="turns back"):
        LoftedBody.through([0.0, 1.0], [section, section[::-1]])
