"""Cast crossing: design rules, sections ready for lofting, a surface without steps."""

import numpy as np
import pytest

from geometry.axes import GAUGE_POINT_DEPTH
from geometry.profiles.rail import gauge_face, rail_head
from geometry.surfaces.crossing import CastCrossing, CrossingError
from geometry.surfaces.crossing_surface import FLOOR, centre_line_y

MM = 1e-3
RATIOS = (9.25, 10.75)


def gauge_face_y(section: np.ndarray, side: str) -> float:
    """y of the gauge (or field) side face 14 mm down."""
    top = int(np.argmax(section[:, 1]))
    part = section[: top + 1] if side == "gauge" else section[top:][::-1]
    return float(np.interp(-GAUGE_POINT_DEPTH, part[:, 1], part[:, 0]))


@pytest.mark.parametrize("ratio", RATIOS)
def test_the_taper_is_the_unit_crossing_angle_by_centre_line_measure(ratio):
    """dy/dx of the nose's field face is tan(2 atan(1 / 2N)); the flangeway is constant."""
    crossing = CastCrossing(ratio)
    xs = np.array([0.3, 0.5]) * crossing.stretch
    nose = [gauge_face_y(crossing.nose_section(x), "field") for x in xs]
    wing = [gauge_face_y(crossing.wing_section(x), "gauge") for x in xs]
    assert np.diff(nose)[0] / np.diff(xs)[0] == pytest.approx(np.tan(2 * np.arctan(1 / (2 * ratio))), rel=1e-9)
    # the wing's smooth joint is 0.1 um off
    assert np.subtract(wing, nose) == pytest.approx([crossing.flangeway] * 2, abs=2e-7)


def test_plain_rail_is_56e1_set_to_the_gauge_face():
    crossing, head = CastCrossing(), rail_head("56E1", spacing=0.02 * MM)
    shift = crossing.shape.leg.gauge_line - gauge_face(head)
    y = np.linspace(-34, 34, 300) * MM
    # chords of 0.02 mm on R12.7: 4e-9, times the slope
    assert np.abs(crossing.top_height(-2.0, y + shift, "wing") - head.height(y)).max() < 2e-8


def test_cast_plane_is_one_in_twenty_and_the_gauge_face_one_in_four():
    crossing = CastCrossing(9.25)
    y = np.linspace(-20, 28, 50) * MM
    assert np.abs(crossing.top_height(-0.55, y, "wing") - y / 20).max() < 1e-15
    face = crossing.top_height(-0.55, np.array([-40.0, -38.0]) * MM, "wing")
    assert np.diff(face)[0] == pytest.approx(2 * MM * 4)


@pytest.mark.parametrize("slope", [0.015, 0.025, 0.05])
def test_a_cast_plane_of_another_slope_turns_about_the_running_line_and_keeps_the_gauge_face(slope):
    crossing, benchmark = CastCrossing(cast_slope=slope), CastCrossing()
    y = np.linspace(-15, 28, 50) * MM
    assert np.abs(crossing.top_height(-0.645, y, "wing") - slope * y).max() < 1e-15
    face = np.array([-40.0, -38.0]) * MM
    assert crossing.top_height(-0.645, face, "wing") == pytest.approx(
        benchmark.top_height(-0.645, face, "wing"), abs=1e-15
    )
    for x in (-0.69, -0.3, 0.1, 0.4):
        points = crossing.wing_section(x)[1 : crossing.wing_features["plane"]]
        error = np.abs(crossing.top_height(x, points[:, 0], "wing") - points[:, 1])
        assert error.max() < (1e-12 if x > crossing.shape.leg_end else 1e-7), x


def test_wing_plane_is_fixed_at_first_and_falls_by_divergence_times_slope_later():
    crossing = CastCrossing(9.25)
    x = np.array([0.08, 0.10])
    assert np.ptp(crossing.top_height(x, 40 * MM, "wing")) == 0.0
    x = np.array([0.20, 0.30])
    fall = np.diff(crossing.top_height(x, 60 * MM, "wing"))[0] / 0.1
    angle = 2 * np.arctan(1 / 18.5)
    assert fall == pytest.approx(-0.05 * np.cos(angle) * np.tan(angle), rel=1e-9)


def test_nose_is_symmetric_about_its_centre_line():
    """A point and its mirror image across the line that halves the crossing angle have the same height."""
    crossing = CastCrossing(10.75)
    c, half = crossing.shape, np.arctan(1 / 21.5)
    rng = np.random.default_rng(1)
    x, y = rng.uniform(0.25, 0.9, 200), rng.uniform(-30, 30, 200) * MM
    origin = np.array([c.stretch * c.cross_x, c.leg.gauge_line])
    axis = np.array([np.cos(half), np.sin(half)])
    offset = np.column_stack([x, y]) - origin
    mirrored = origin + 2 * np.outer(offset @ axis, axis) - offset
    heights, images = crossing.top_height(x, y, "nose"), crossing.top_height(*mirrored.T, "nose")
    near = heights > -30 * MM
    assert near.sum() > 100
    # steep faces magnify the rounding of the mirrored position: slope 4 times 1e-16 m, many operations
    assert np.abs(heights - images)[near].max() < 1e-13


def test_topping_line_and_roof_of_the_nose():
    crossing = CastCrossing(9.25)
    x = np.array([0.18, 0.34])
    middle = centre_line_y(x, crossing.shape)
    slope = np.diff(crossing.top_height(x, middle, "nose"))[0] / 0.16
    assert slope == pytest.approx(crossing.topping_slope, rel=1e-9)
    assert crossing.top_height(0.6, np.array([-20.0, -10.0]) * MM, "nose") == pytest.approx(
        [-1.0 * MM, -0.5 * MM], abs=1e-12
    )


def test_lengths_stretch_with_the_ratio_and_sections_do_not():
    """The nose at the end of its blunt ramp: same height and corner, at 1.162 times the distance."""
    short, long = CastCrossing(9.25), CastCrossing(10.75)
    assert long.nose_x == pytest.approx(138.2 * MM, abs=0.05 * MM)  # published proposal, printed to 0.1 mm
    y = np.linspace(-34, -27, 30) * MM
    a, b = (c.top_height(0.25 * c.stretch, y, "nose") for c in (short, long))
    # the topping follows the centre line, whose angle differs: 12.7 mm * (0.0541 - 0.0465) * 0.0153 = 1.5 um
    assert np.abs(a - b).max() < 1.5e-6


@pytest.mark.parametrize("ratio", RATIOS)
def test_top_height_and_sections_are_the_same_surface(ratio):
    crossing = CastCrossing(ratio)
    for x in (-0.9, -0.69, -0.55, -0.2, 0.0, 0.1, 0.16, 0.2, 0.35, 0.5, 0.95):
        for body, section in (("wing", crossing.wing_section(x)), ("nose", crossing.nose_section(x))):
            if section is None:
                continue
            last = crossing.wing_features["plane"] if body == "wing" else len(section) - 1
            points = section[1:last]  # feet apart: there the floor cuts the faces
            error = np.abs(crossing.top_height(x, points[:, 0], body) - points[:, 1])
            assert error.max() < (1e-12 if x > crossing.shape.leg_end else 1e-7), (x, body)


FITTED = {"cast_slope": 0.025, "wing_raise": -2.5 * MM, "topping_slope": 18e-3, "topping_depth": 5.4 * MM}
TOPPED = {"nose_lowering": -0.87 * MM, "topping_slope": 18.2e-3, "topping_depth": 3.08 * MM}


@pytest.mark.parametrize(
    "ratio, step, changes",
    [
        pytest.param(9.25, 1.0 * MM, {}, marks=pytest.mark.validate),
        pytest.param(10.75, 0.5 * MM, {}, marks=pytest.mark.validate),
        (10.75, 1.0 * MM, TOPPED),
        pytest.param(10.75, 1.0 * MM, FITTED, marks=pytest.mark.validate),
    ],
)
def test_sections_keep_their_points_and_move_continuously(ratio, step, changes):
    """Same count, feet on the floor, order kept; neighbours in x move by no more than the taper allows (no jump). Also
    where a high nose is so narrow that its corners meet in a ridge."""
    crossing = CastCrossing(ratio, **changes)
    for make, start in ((crossing.wing_section, -0.8), (crossing.nose_section, crossing.nose_x)):
        sections = np.array([make(x) for x in np.arange(start, 1.0, step)])
        assert np.abs(sections[:, [0, -1], 1] - FLOOR).max() < 1e-15
        assert np.all(np.diff(sections[:, :, 0], axis=1) > -1e-12)
        assert np.hypot(*np.diff(sections, axis=1).transpose(2, 0, 1)).min() > 0.05 * MM
        # fastest move: the corners' foot of the blunt ramp (1:1.4) and the field side behind the leg, below 1 m per m
        assert np.abs(np.diff(sections, axis=0)).max() < 1.0 * step


@pytest.mark.parametrize("ratio", RATIOS)
def test_the_running_surface_has_no_steps_along_the_track(ratio):
    """Height along x at fixed y: halving the step halves every change of height, so that what jumps is slope alone.

    A step of height s would keep its size; slopes on the running band stay below that of the leg transition (0.1).
    """
    crossing = CastCrossing(ratio)
    k = crossing.stretch
    for body, start, end, ys in (
        ("wing", -0.9, -0.3 * k, np.arange(-8, 31, 4.0)),
        ("nose", 0.3 * k, 0.9, np.arange(-24, -14, 2.0)),
    ):
        for step in (0.2 * MM, 0.1 * MM):
            x = np.arange(start, end, step)
            jump = np.abs(np.diff(crossing.top_height(x[:, None], ys * MM, body), axis=0)).max()
            assert jump < 0.15 * step


@pytest.mark.parametrize("ratio", RATIOS)
def test_slopes_along_the_track_jump_only_at_the_machined_features(ratio):
    """On the running band the slope is continuous but where two cuts meet; there it turns by less than 15 mrad.

    Cuts: leg transition (its ridge), wing plane that starts to travel, topping against roof, roof ridge.
    """
    crossing = CastCrossing(ratio)
    step, k = 0.1 * MM, crossing.stretch
    leg = crossing.shape.leg_start, crossing.shape.leg_end
    bands = {
        ("wing", 0.0): [leg],
        ("wing", 20.0): [leg],
        ("wing", 44.0): [(0.13 * k, 0.15 * k)],
        ("nose", -20.0): [(0.36 * k, 0.40 * k)],
        ("nose", -10.0): [(0.36 * k, 0.48 * k)],
    }
    for (body, y), features in bands.items():
        start, end = (
            (-0.9, -0.2) if y < 30 and body == "wing" else (0.02, 0.25 * k) if body == "wing" else (0.33 * k, 0.9)
        )
        x = np.arange(start, end, step)
        turn = np.abs(np.diff(crossing.top_height(x, y * MM, body), n=2)) / step
        inside = np.zeros(len(turn), bool)
        for low, high in features:
            inside |= (x[1:-1] >= low - step) & (x[1:-1] <= high + step)
        assert turn.max() < 15e-3, (body, y)
        assert turn[~inside].max() < 0.1e-3, (body, y, x[1:-1][~inside][turn[~inside].argmax()])


def test_there_is_no_nose_ahead_of_its_tip():
    crossing = CastCrossing()
    assert crossing.nose_section(crossing.nose_x - 1e-6) is None
    assert np.isnan(crossing.top_height(crossing.nose_x - 1e-6, -25 * MM, "nose"))
    assert np.isnan(crossing.top_height(0.5, 300 * MM, "wing"))


@pytest.mark.parametrize(
    "arguments, complaint",
    [
        ({"ratio": 2.0}, "ratio = 2 is outside"),
        ({"ratio": float("nan")}, "ratio = nan is outside"),
        ({"flangeway": 41.0}, "flangeway = 41 is outside"),
        ({"topping_slope": -0.01}, "topping_slope = -0.01 is outside"),
    ],
)
def test_impossible_crossings_are_refused(arguments, complaint):
    with pytest.raises(CrossingError, match=complaint):
        CastCrossing(**arguments)


def test_places_off_the_crossing_and_unknown_bodies_are_refused():
    crossing = CastCrossing()
    with pytest.raises(CrossingError, match="x = 5 m is outside the modelled crossing 1:10.75"):
        crossing.wing_section(5.0)
    with pytest.raises(CrossingError, match="x = nan m is outside"):
        crossing.top_height(np.nan, 0.0, "wing")
    with pytest.raises(CrossingError, match="unknown body 'frog'; known: wing, nose"):
        crossing.top_height(0.0, 0.0, "frog")
