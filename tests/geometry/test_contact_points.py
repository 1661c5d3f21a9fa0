"""Contact points: closed forms for sphere, cylinder and cone, yawed and rolled; symmetry; several points; published
flange jump.

TIGHT: positions and heights are exact but for the profiles' Hermite interpolation. On arcs of 0.3 m sampled every 0.1
mm its slope errs by less than h^3 z'''' ~ 1e-12 * 3 / 0.3^3 ~ 1e-10, which moves a contact of relative radius 0.2 m by
2e-11 m.
"""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import root

from geometry.contact.prismatic_search import RESOLUTION, ROUGH, ContactSearch, Motion, creepages, creepages_at
from geometry.contact.rail_kinds import branches
from geometry.profiles.profile import Profile, arc, graph, line
from geometry.profiles.rail import rail_head
from geometry.profiles.wheel import wheel_profile
from geometry.wheelset import RailPosition, Track, Wheelset, WheelsetError

MM = 1e-3
TIGHT = 1e-9
RADIUS, CROWN = 0.45, 0.3
SPACING = 0.1 * MM


def bowl(radius: float, half: float) -> Profile:
    """Arc through (0, 0) that opens upwards."""
    rise = radius - np.sqrt(radius**2 - half**2)
    return Profile.from_pieces([arc((-half, rise), (half, rise), radius, SPACING)], "bowl")


def crown_rail(radius: float = CROWN) -> Profile:
    """Rail with one crown of this radius and steep sides, so that it has a gauge point."""
    half = 30 * MM
    drop = radius - np.sqrt(radius**2 - half**2)
    slope = half / (radius - drop)
    side = lambda sign: line((sign * half, -drop), (sign * (half + 15 * MM / 3), -drop - 15 * MM), 1 * MM)
    left = line((-(half + 5 * MM), -drop - 15 * MM), (-half, -drop), 1 * MM)
    assert slope < 1
    return Profile.from_pieces([left, arc((-half, -drop), (half, -drop), -radius, SPACING), side(1)], "crown")


def cone_wheel(slope: float, low: float = -50 * MM, high: float = 60 * MM) -> Profile:
    return Profile.from_pieces([line((low, slope * low), (high, slope * high), 1 * MM)], "cone")


def search_for(wheel: Profile, rail: Profile, **positions) -> ContactSearch:
    return ContactSearch(Wheelset(wheel, radius=RADIUS), Track(rail, **positions))


def rail_axis(search: ContactSearch, side: str) -> np.ndarray:
    """y, z of the crown's centre in track axes."""
    offset = getattr(search.track, f"{side}_position")
    sign = 1 if side == "left" else -1
    return np.array([sign * search.track.gauge_offset(side) + offset.lateral, offset.vertical - CROWN])


def axle(state: Wheelset) -> tuple[np.ndarray, np.ndarray]:
    """A point and the direction of the axle, written down anew from the angles."""
    direction = np.array(
        [-np.sin(state.yaw) * np.cos(state.roll), np.cos(state.yaw) * np.cos(state.roll), np.sin(state.roll)]
    )
    return np.array([state.x, state.y, state.z]), direction


@pytest.mark.parametrize("lateral, yaw, lift", [(0, 0, 0), (4 * MM, 0.03, 0), (-7 * MM, -0.06, 8 * MM)])
def test_spheres_touch_crowns_where_the_distance_of_their_centres_says(lateral, yaw, lift):
    """Two equations for height and roll: each sphere's centre is RADIUS + CROWN from its rail's axis."""
    search = search_for(bowl(RADIUS, 60 * MM), crown_rail(), left_position=RailPosition(vertical=lift))
    state = search.settle(lateral, yaw, held_at="axle")
    arm = search.wheelset.datum_arm

    def centre(sign, z, roll):
        return np.array([lateral + sign * arm * np.cos(yaw) * np.cos(roll), z + sign * arm * np.sin(roll)])

    def miss(unknown):
        return [
            np.hypot(*(centre(sign, *unknown) - rail_axis(search, side))) - RADIUS - CROWN
            for side, sign in (("left", 1), ("right", -1))
        ]

    z, roll = root(miss, [RADIUS, 0.0], tol=1e-14).x  # to round-off, which fsolve would warn of
    assert state.z == pytest.approx(z, abs=TIGHT)
    assert state.roll == pytest.approx(roll, abs=TIGHT)
    for side, sign in (("left", 1), ("right", -1)):
        found = search.contacts(state, side)
        towards = (rail_axis(search, side) - centre(sign, z, roll)) / (RADIUS + CROWN)
        exact = [-sign * arm * np.sin(yaw) * np.cos(roll), *(centre(sign, z, roll) + RADIUS * towards)]
        assert len(found) == 1
        assert np.abs(found.position[0] - exact).max() < TIGHT
        assert found.angle[0] == pytest.approx(sign * np.arctan2(towards[0], -towards[1]), abs=1e-8)
        assert abs(found.gap[0]) < TIGHT
        assert found.curvature[0] == pytest.approx([1 / RADIUS, 1 / RADIUS + 1 / CROWN], rel=1e-6)


@pytest.mark.parametrize("yaw, lift", [(0.0, 0.0), (0.05, 0.0), (-0.08, 5 * MM), (0.02, -12 * MM)])
def test_cylinders_touch_on_the_common_perpendicular_of_two_skew_lines(yaw, lift):
    """Wheel cylinder and rail crown: distance of axle and rail axis = RADIUS + CROWN; crossed at the yaw angle."""
    search = search_for(cone_wheel(0.0), crown_rail(), left_position=RailPosition(vertical=lift))
    state = search.settle(0.0, yaw)
    start, direction = axle(state)
    for side in ("left", "right"):
        foot = np.array([0.0, *rail_axis(search, side)])
        perpendicular = np.cross(direction, [1.0, 0, 0])
        perpendicular *= np.sign(perpendicular[2]) / np.linalg.norm(perpendicular)
        assert (start - foot) @ perpendicular == pytest.approx(RADIUS + CROWN, abs=TIGHT)
        along, *_ = np.linalg.solve(np.array([[1.0, 0, 0], -direction, perpendicular]).T, start - foot)
        found = search.contacts(state, side)
        exact = foot + [along, 0, 0] + CROWN * perpendicular
        assert np.abs(found.position[0] - exact).max() < TIGHT
        assert np.abs(found.normal[0] - perpendicular).max() < 1e-8
        crossing = np.arccos(abs(direction[0])) - np.pi / 2  # between the rail and the plane across the axle
        product = np.prod(found.curvature[0])
        assert product == pytest.approx(np.cos(crossing) ** 2 / (RADIUS * CROWN), rel=1e-6)


@pytest.mark.parametrize("slope", [0.02, 0.1, -0.05])
@pytest.mark.parametrize("yaw", [0.0, 0.03, -0.09])
def test_a_cone_touches_a_crown_along_its_generator(slope, yaw):
    """Tangent plane along the rail: sin(angle) cos(yaw) = sin(cone angle); it passes through the cone's apex on the
    axle."""
    search = search_for(cone_wheel(slope), crown_rail())
    state = search.settle(0.0, yaw)
    start, direction = axle(state)
    angle = np.arcsin(np.sin(np.arctan(slope)) / np.cos(yaw))
    normal = np.array([0, -np.sin(angle), np.cos(angle)])
    touch = rail_axis(search, "left") + CROWN * normal[1:]
    apex = start + (search.wheelset.datum_arm + RADIUS / slope) * direction
    assert state.roll == pytest.approx(0, abs=1e-12)
    assert (touch - apex[1:]) @ normal[1:] == pytest.approx(0, abs=TIGHT)
    generator = direction - (direction @ normal) * normal
    exact = apex + generator * (touch[0] - apex[1]) / generator[1]
    found = search.contacts(state, "left")
    assert found.angle[0] == pytest.approx(angle, abs=TIGHT)
    assert np.abs(found.position[0] - exact).max() < TIGHT
    assert found.rolling_radius[0] == pytest.approx(
        np.linalg.norm(np.cross(found.position[0] - start, direction)), abs=TIGHT
    )


@pytest.mark.parametrize("slope, edge", [(0.02, 40 * MM), (0.08, -30 * MM)])
@pytest.mark.parametrize("yaw", [0.0, 0.05])
def test_a_cone_on_a_plane_stands_on_the_rim_that_its_slope_selects(slope, edge, yaw):
    """Plane of slope 1:20: the tilted rim circle's lowest point is centre . n - r sqrt(1 - (n . e)^2)."""
    half = 80 * MM
    plane = Profile.from_pieces(
        [
            line((-half, -half / 20 - 20 * MM), (-half + 1 * MM, -half / 20), 1 * MM),
            line((-half + 1 * MM, -half / 20), (half, half / 20), 5 * MM),
        ],
        "plane",
    )
    search = search_for(cone_wheel(slope, -30 * MM, 40 * MM), plane.shifted(0, -half / 20))
    state = search.settle(0.0, yaw)
    start, direction = axle(state)
    incline = (half / 20 + half / 20) / (2 * half - 1 * MM)
    normal = np.array([0, -incline, 1.0]) / np.hypot(1, incline)
    centre = start + (search.wheelset.datum_arm + edge) * direction
    on_plane = np.array([0, search.track.gauge_offset("left") + half, 0.0])
    radius = RADIUS - slope * edge
    assert (centre - on_plane) @ normal == pytest.approx(radius * np.sqrt(1 - (normal @ direction) ** 2), abs=TIGHT)
    found = search.contacts(state, "left")
    down = -(normal - (normal @ direction) * direction)
    assert np.abs(found.position[0] - (centre + radius * down / np.linalg.norm(down))).max() < 1e-8
    assert found.station[0] == pytest.approx(edge, abs=TIGHT)


@pytest.mark.parametrize("count", [2, 3])
def test_equal_crowns_carry_equally_under_a_cylinder(count):
    """A rail top of waves of equal height: one point a crest, one pitch apart, all of the same gap."""
    pitch, height = 10 * MM, 0.2 * MM
    half = count * pitch / 2
    y = np.linspace(-half, half, 400 * count + 1)
    phase = 2 * np.pi * (y + half) / pitch
    top = graph(
        y,
        -height * (1 + np.cos(phase)) / 2,
        height * np.pi / pitch * np.sin(phase),
        height * 2 * (np.pi / pitch) ** 2 * np.cos(phase),
    )
    sides = [
        line((-half - 5 * MM, -16 * MM), (-half, -height), 1 * MM),
        line((half, -height), (half + 5 * MM, -16 * MM), 1 * MM),
    ]
    search = search_for(cone_wheel(0.0), Profile.from_pieces([sides[0], top, sides[1]], "waves"))
    found = search.contacts(search.settle(), "left", reach=1e-6)
    assert len(found) == count
    assert np.ptp(found.gap) < 1e-12
    assert np.diff(found.rail_station) == pytest.approx(np.full(count - 1, pitch), abs=1e-8)


def p8_search(**options) -> ContactSearch:
    return ContactSearch(Wheelset(wheel_profile("P8")), Track.plain_line(), **options)


@pytest.mark.parametrize("lateral, yaw", [(0.0, 0.0), (3.3 * MM, 0.02), (11 * MM, -0.01)])
def test_what_is_mirrored_gives_the_same_answer_to_the_last_bit(lateral, yaw):
    search = p8_search()
    here, there = search.settle(lateral, yaw), search.settle(-lateral, -yaw)
    assert (here.z, here.y, here.roll) == (there.z, -there.y, -there.roll)
    for side, other in (("left", "right"), ("right", "left")):
        a, b = search.contacts(here, side), search.contacts(there, other)
        assert np.array_equal(a.position, b.position * [1, -1, 1])
        assert (
            np.array_equal(a.angle, b.angle)
            and np.array_equal(a.rolling_radius, b.rolling_radius)
            and np.array_equal(a.curvature, b.curvature)
        )


def test_facing_and_trailing_differ_in_the_sign_of_x_alone():
    """A prismatic track looks the same backwards: yaw mirrored in x gives the same heights and -x."""
    search = p8_search()
    facing, trailing = search.settle(5 * MM, 0.03), search.settle(5 * MM, -0.03)
    assert (facing.z, facing.roll) == (trailing.z, trailing.roll)
    a, b = search.contacts(facing, "left"), search.contacts(trailing, "left")
    assert np.array_equal(a.position, b.position * [-1, 1, 1])
    assert a.ahead[0] != 0


def test_units_scale_all_lengths():
    """Everything 1.25 times larger: the same angles, lengths 1.25 times as large."""
    scaled = lambda p: Profile(p.points * 1.25, p.angle_before, p.angle_after, p.curvature / 1.25, p.label)
    wheel, track = wheel_profile("P8"), Track.plain_line()
    small = ContactSearch(Wheelset(wheel, radius=0.4), track)
    arm = small.wheelset.datum_arm * 1.25
    large = ContactSearch(
        Wheelset(scaled(wheel), radius=0.5, back_to_back=2 * (arm - 0.070)),
        Track(scaled(track.left), gauge=1.435 * 1.25, gauge_point=14 * MM * 1.25),
    )
    a, b = small.settle(4 * MM, 0.01), large.settle(5 * MM, 0.01)
    assert b.roll == pytest.approx(a.roll, abs=1e-12)
    assert b.z == pytest.approx(1.25 * a.z, abs=1e-12)
    assert large.contacts(b, "left").position == pytest.approx(1.25 * small.contacts(a, "left").position, abs=1e-9)


def test_s1002_on_uic60_reaches_its_flange_where_the_manchester_benchmark_does():
    """Gauge 1435, back-to-back 1360, 1:40: the contact jumps to the flange between 5 and 6.5 mm (VERIFICATION.md
    section C)."""
    search = ContactSearch(Wheelset(wheel_profile("S1002"), radius=0.46), Track.plain_line("60E1", 1 / 40))
    shifts = np.arange(0, 10.05, 0.1) * MM
    stations, angles = np.array(
        [(c.station[0], c.angle[0]) for c in (search.contacts(search.settle(y), "right").lowest() for y in -shifts)]
    ).T
    jump = np.argmin(np.diff(stations))
    assert stations[jump + 1] - stations[jump] < -5 * MM
    assert 5.0 * MM <= shifts[jump] <= 6.5 * MM
    assert np.degrees(angles[shifts > 7 * MM]).min() > 60


def test_points_are_the_same_at_any_resolution():
    """The first search only finds the neighbourhood; what is found is refined."""
    states = [(s * MM, yaw) for s, yaw in ((0.3, 0.0), (4.0, 0.02), (11.0, -0.02))]
    answers = []
    for resolution in (0.1 * MM, 1.0 * MM):
        search = p8_search(resolution=resolution)
        answers.append(
            [
                (*search.contacts(search.settle(*s), side).lowest().position[0],)
                for s in states
                for side in ("left", "right")
            ]
        )
    # a position where slopes are flat: round-off 1e-15 / (curvature ~ 3 / m) and kinks of the second derivative
    assert np.abs(np.subtract(*answers)).max() < 1e-7


def wavy(profile: Profile, every: int, seed: int) -> Profile:
    """Every so many of a profile's points, moved by twelve waves 0.4 to 2 mm long, 3 um in root mean square."""
    random, points = np.random.default_rng(seed), profile.points[::every].copy()
    length, phase = random.uniform(0.4 * MM, 2 * MM, 12), random.uniform(0, 2 * np.pi, 12)
    points[:, 1] += 3e-6 / np.sqrt(6) * np.sin(2 * np.pi * points[:, :1] / length + phase).sum(axis=1)
    return Profile.from_points(points, "wavy")


@pytest.mark.parametrize("every", [(1, 1), (5, 1), (2, 2), (5, 5)])
def test_no_minimum_of_a_rough_profile_is_missed(every):
    """Points 0.1 to 0.6 mm apart on wheel and rail. The judge looks at stations 0.02 mm apart: a twentieth of the
    shortest wave. What hides between two stations is a few times ROUGH at most: twice from each profile, over the
    cosine of the angle (60 degrees)."""
    wheel, rail = wavy(wheel_profile("P8"), every[0], 3).graph_part(), wavy(rail_head("60E1", 1 / 40), every[1], 103)
    search, judge = (ContactSearch(Wheelset(wheel), Track(rail), fine) for fine in (RESOLUTION, 0.02 * MM))
    random = np.random.default_rng(3)
    for _ in range(40):
        state = search.settle(random.uniform(-9, 9) * MM, random.uniform(-0.02, 0.02))
        for side in ("left", "right"):
            lowest, found = (of.contacts(state, side).vertical_gap.min() for of in (judge, search))
            assert found - lowest < 2 * 2 * ROUGH / np.cos(np.radians(60))


def random_states(count: int, seed: int, noise: float) -> int:
    """Random shifts and yaws on plain line, a new noisy wheel for every fifty; returns in how many both wheels have a
    point where they stand: roughness between two stations is not resolved."""
    missed: set[int] = set()
    random, wheel = np.random.default_rng(seed), wheel_profile("P8")
    for k in range(count):
        if k % 50 == 0:
            points = wheel.points[::5] + [0.0, noise] * random.standard_normal((len(wheel.points[::5]), 2))
            search = ContactSearch(
                Wheelset(Profile.from_points(points, "noisy P8").graph_part()),
                Track.plain_line(gauge=1.435 + random.uniform(-5, 15) * MM),
            )
        state = search.settle(random.uniform(-15, 15) * MM, random.uniform(-0.05, 0.05))
        for side in ("left", "right"):
            found = search.contacts(replace(state, z=state.z - 50e-6), side)
            values = np.concatenate([np.ravel(v) for v in (found.position, found.angle, found.curvature, found.gap)])
            assert len(found) >= 1 and np.isfinite(values).all()
            missed |= {k} if found.gap.min() >= 2 * noise else set()
    return count - len(missed)


@pytest.mark.parametrize("noise", [0.0, 10e-6, 100e-6])
def test_random_states_on_plain_line_always_find_their_points(noise):
    assert random_states(150, 3, noise) == 150


@pytest.mark.validate
@pytest.mark.parametrize("noise", [0.0, 10e-6, 30e-6, 100e-6])
def test_ten_thousand_random_states(noise):
    """A wheel as rough as 0.1 mm on each of its points may touch at a peak that no station shows: three of 2,500."""
    assert random_states(2500, 7, noise) >= (2497 if noise > 50e-6 else 2500)


def test_creepages_of_a_free_rolling_cone():
    """1 - r / R along, -sin(roll-free angle) / R about the normal; yawed, across: -(r / R) sin(yaw) / cos(cone
    angle)."""
    search = search_for(cone_wheel(0.05), crown_rail())
    state = search.settle(3 * MM, 0.0)
    for side, sign in (("left", 1), ("right", -1)):
        found = search.contacts(state, side)
        along, across, spin = creepages(state, found, Motion(30.0))[0]
        arm = found.position[0, 2] - state.z
        assert along == pytest.approx(
            1 + (np.cos(state.roll) * arm - np.sin(state.roll) * (found.position[0, 1] - state.y)) / RADIUS, abs=1e-12
        )
        assert across == pytest.approx(0, abs=1e-12)
        assert spin == pytest.approx(np.sin(state.roll - sign * found.angle[0]) / RADIUS, abs=1e-12)
    yawed = search.settle(0.0, 0.004)
    found = search.contacts(yawed, "left")
    assert creepages(yawed, found, Motion(30.0))[0, 1] == pytest.approx(
        -found.rolling_radius[0] / RADIUS * np.sin(0.004) / np.cos(np.arctan(0.05)), abs=1e-12
    )
    # locked wheel slides at full speed
    assert creepages(yawed, found, Motion(30.0, spin=0.0))[0, 0] == pytest.approx(1.0, abs=1e-12)


def test_a_wheelset_that_yaws_and_rolls_drags_its_points_about_its_centre():
    """To the creepages of plain rolling come velocities omega x r over the speed, in the plane z = 0 and along its
    normal; 20 and 30 mrad/s at (0.02, 0.7, -0.45) m from the centre."""
    state = p8_search().settle()
    point = np.array([[state.x + 0.02, state.y + 0.7, state.z - 0.45]])
    up = np.array([[0.0, 0.0, 1.0]])
    plain = creepages_at(state, point, up, Motion(30.0))
    turned = creepages_at(state, point, up, Motion(30.0, yaw=0.02, roll=0.03))
    added = np.array([-0.02 * 0.7, 0.02 * 0.02 + 0.03 * 0.45, 0.02]) / 30.0
    assert turned - plain == pytest.approx(added[None], abs=1e-15)


def test_bad_input_is_refused_with_place_and_size():
    search = p8_search()
    with pytest.raises(WheelsetError, match="yaw"):
        search.settle(0.0, 0.3)
    with pytest.raises(WheelsetError, match="stands over no rail"):
        search.settle(0.3)
    with pytest.raises(WheelsetError, match="held_at"):
        search.settle(held_at="bogie")
    for radius in (float("nan"), "0.46", 460):
        with pytest.raises(WheelsetError, match="radius = .* is outside"):
            Wheelset(wheel_profile("P8"), radius=radius)
    with pytest.raises(WheelsetError, match="speed"):
        creepages(search.settle(), search.contacts(search.settle(), "left"), Motion(0.0))
    with pytest.raises(WheelsetError, match="gauge point"):
        Track(bowl(0.3, 5 * MM)).gauge_offset("left")
    backwards = Profile.from_points(wheel_profile("P8").points[::-1])
    with pytest.raises(WheelsetError, match="turns back"):
        ContactSearch(Wheelset(backwards), Track.plain_line())
    with pytest.raises(WheelsetError, match="gauge"):
        Track(rail_head("56E1"), gauge=1435)


def test_the_lowest_point_of_a_lifted_wheel_is_the_first_to_touch():
    """On the flange the gap along the normal is a fraction of the vertical one: lifted by 1 mm the flange is nearest,
    but the tread comes down first."""
    search = ContactSearch(Wheelset(wheel_profile("S1002"), radius=0.46), Track(rail_head("60E1", 1 / 40)))
    for lateral in np.arange(-6, 6.1, 0.5) * MM:
        state = search.settle(lateral)
        lifted = replace(state, z=state.z + 1 * MM)
        for side in ("left", "right"):
            touching, above = (
                search.contacts(state, side).lowest(),
                search.contacts(lifted, side, reach=5 * MM).lowest(),
            )
            assert above.station[0] == pytest.approx(touching.station[0], abs=0.1 * MM)
            assert above.vertical_gap[0] == pytest.approx(1 * MM, abs=1e-9)


def test_what_is_no_side_is_refused_by_name():
    search = ContactSearch(Wheelset(wheel_profile("P8")), Track.plain_line())
    with pytest.raises(WheelsetError, match='"left" nor "right"'):
        search.contacts(search.settle(), "Right")


@pytest.mark.parametrize(
    "make",
    [
        lambda p: Track(p),
        lambda p: Track(rail_head("60E1"), p),
        lambda p: Wheelset(p),
        lambda p: Wheelset(wheel_profile("P8"), p),
    ],
)
def test_a_profile_in_millimetres_is_refused(make):
    points = rail_head("60E1").graph_part().points * 1e3
    with pytest.raises(WheelsetError, match="look like mm"):
        make(Profile.from_points(points))


def test_a_wheel_with_its_flange_on_the_rail_is_derailed():
    search = ContactSearch(Wheelset(wheel_profile("P8")), Track.plain_line())
    assert [search.derailed(search.settle(y * MM)) for y in (0.0, 8.0, 11.0, -11.0)] == [()] * 4
    assert [search.derailed(search.settle(y * MM)) for y in (30.0, 45.0, -30.0)] == [("left",), ("left",), ("right",)]


def test_what_only_compiled_code_can_tell_apart_says_so_elsewhere():
    with pytest.raises(NotImplementedError, match="branches is for compiled code only"):
        branches(np.zeros((4, 2)))
