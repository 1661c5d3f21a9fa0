"""Standards and measured sections in numbers that were published: facts, held wherever the tests run; whole files:
test_wheel, test_rail, test_crossing_benchmark.

Sources: EN 13715:2020, annexes A and D, table D.1, and EN 13674-1:2017, as transcribed in github.com/rohrbecka/EN13715
and EN13674; S1002's polynomials in EN 13715, annex C; heights of the S&C benchmark's UK crossing 56E1-R245-1:9.25
(Bezin, Palsson et al., Veh. Syst. Dyn. 61 (2023) 644) read off its sections in CONTACT's test bank, 96 positions out of
70,000.
"""

import numpy as np
import pytest

from geometry.profiles.rail import rail_head
from geometry.profiles.wheel import wheel_profile
from geometry.surfaces.crossing import CastCrossing

MM = 1e-3
# EPS with a flange 28.5 mm thick, y from -39 mm in steps of 0.5 mm, z to the flange [mm]
TABLE_D1 = np.array(
    """
    6.867 6.464 6.104 5.780 5.488 5.224 4.985 4.768 4.573 4.398 4.241 4.101 3.978 3.871
    3.776 3.683 3.592 3.503 3.417 3.332 3.248 3.167 3.088 3.011 2.935 2.862 2.790
    """.split(),
    float,
)
# y range, centre, radius [mm], z to the flange: EPS with h = 30, e = 28.5 (s = 4), and S1002
EPS_ARCS = (
    ((-69.9, -62.9), (-49.5, 11.519), 20.5),
    ((-62.5, -57.2), (-55.0, 18.0), 12.0),
    ((-56.8, -51.9), (-59.0, 18.0), 12.0),
    ((-51.6, -44.7), (-64.733, 10.425), 21.5),
    ((-42.3, -39.1), (-30.211, 16.446), 13.0),
    ((-25.9, -17.7), (-6.5, 100.871), 100.0),
    ((-17.5, 18.9), (19.0, 329.453), 330.0),
)
S1002_ARCS = (
    ((-38.4, -35.1), (-26.210665, 16.446), 13.0),
    ((-49.6, -39.8), (-58.558326, 8.834924), 20.0),
    ((-62.7, -49.7), (-55.0, 16.0), 12.0),
    ((-69.9, -62.8), (-49.5, 9.519259), 20.5),
)
S1002_B = (
    0.0,
    -3.358537058e-2,
    1.565681624e-3,
    -2.810427944e-5,
    5.844240864e-8,
    -1.562379023e-8,
    5.309217349e-15,
    -5.957839843e-12,
    2.646656573e-13,
)
S1002_C = (
    -4.320221063e3,
    -1.038384026e3,
    -1.065501873e2,
    -6.051367875,
    -0.2054332446,
    -4.169739389e-3,
    -4.687195829e-5,
    -2.252755540e-7,
)
CORNERS = {
    "56E1": (12.7, (22.2409, 15.1643), (25.7, 34.9)),
    "60E1": (13.0, (23.0160, 14.9491), (26.1, 35.9)),
    "60E2": (8.0, (28.0099, 14.6997), (35.4, 35.99)),
}
CROWNS = {
    "56E1": ((305.0, 5.8), (80.0, 25.5)),
    "60E1": ((300.0, 10.1), (80.0, 25.9)),
    "60E2": ((200.0, 11.8), (70.0, 24.4)),
}
AT = (-28.0, -20.0, -12.0, 0.0, 12.0, 26.0, 38.0, 50.0)  # y [mm]
HEIGHTS = (  # x, height above the approach rail's crown at AT [mm], None beside the running surface or on its edges
    (-894.74, None, -1.562, -0.396, -0.000, -0.422, -3.078, None, None),
    (-717.84, None, -1.558, -0.405, 0.000, -0.323, -2.945, None, None),
    (-695.25, None, -1.519, -0.456, 0.002, 0.278, -2.073, None, None),
    (-683.96, None, -1.474, -0.490, 0.002, 0.448, -1.374, None, None),
    (-661.38, None, -1.317, -0.552, 0.002, 0.546, 0.424, None, None),
    (-638.80, None, -1.111, -0.592, 0.002, 0.584, 1.274, None, None),
    (-616.22, None, -0.999, -0.599, 0.001, 0.601, 1.301, None, None),
    (-545.28, None, -0.999, -0.599, 0.001, 0.601, 1.301, None, None),
    (-383.93, None, -1.046, -0.599, 0.001, 0.601, 1.301, None, -4.957),
    (-184.78, None, None, None, 0.000, 0.601, 1.301, None, -0.625),
    (-85.20, None, None, None, None, 0.601, 1.301, 1.541, 1.542),
    (47.56, None, None, None, None, None, 1.301, 1.901, 2.501),
    (133.91, None, None, None, None, None, 1.192, 1.901, 2.501),
    (148.88, None, None, None, None, None, None, 1.858, 2.455),
    (163.84, -4.294, None, None, None, None, None, 1.778, 2.374),
    (178.81, -4.088, None, None, None, None, None, 1.697, 2.294),
    (228.71, -3.451, -3.213, None, None, None, None, 1.431, 2.025),
    (287.66, None, -2.317, -2.427, None, None, None, None, 1.707),
    (326.96, None, -1.721, -1.714, None, None, None, None, 1.495),
    (366.26, None, -1.124, -1.118, None, None, None, None, None),
    (385.91, None, -0.999, -0.818, None, None, None, None, None),
    (504.61, None, -0.999, -0.599, -0.752, None, None, None, None),
    (623.31, None, -0.999, -0.599, -0.113, -0.709, None, None, None),
    (860.70, None, -0.999, -0.599, 0.001, 0.576, -0.125, -0.722, None),
)
NOSE_WIDTHS = (
    (134.0, 11.8),
    (144.0, 16.0),
    (164.0, 18.1),
    (179.0, 19.8),
    (229.0, 25.2),
    (327.0, 35.8),
    (386.0, 42.2),
    (544.0, 59.4),
)  # 14 mm below the crown [mm]


def test_p8_passes_the_printed_table_and_arcs_of_en_13715():
    """Printed to 1 um."""
    wheel, y = wheel_profile("P8"), -39.0 + 0.5 * np.arange(len(TABLE_D1))
    assert wheel.height(y * MM) / MM == pytest.approx(-np.array(TABLE_D1), abs=1.1e-3)
    on_arcs(wheel, EPS_ARCS, 1.6e-3)


def test_s1002_is_its_printed_polynomials_and_arcs():
    wheel = wheel_profile("S1002")
    for factors, limits in (
        (S1002_B, (-25.9, 32.1)),
        (S1002_C, (-34.9, -26.1)),
        ((1.364323640, -0.066666667), (32.2, 59.0)),
    ):
        y = np.linspace(*limits, 200)
        assert wheel.height(y * MM) / MM == pytest.approx(-np.polynomial.polynomial.polyval(y, factors), abs=1e-3)
    on_arcs(wheel, S1002_ARCS, 1e-3)


def on_arcs(wheel, arcs, print_of: float) -> None:
    """Every point of the profile between the limits lies on the arc [mm]."""
    y, z = wheel.points.T / MM
    for (low, high), (centre_y, centre_z), radius in arcs:
        inside = (y > low) & (y < high)
        assert inside.sum() > 5
        assert np.hypot(y - centre_y, -z - centre_z)[inside] == pytest.approx(radius, abs=print_of), (low, high)


@pytest.mark.parametrize("name", CORNERS)
def test_heads_pass_the_printed_arcs_of_en_13674(name):
    """The corner's centre is printed to 0.1 um, the crown's lies under it by its radius."""
    y, z = rail_head(name).points.T / MM
    radius, centre, limits = CORNERS[name]
    inside = (y > limits[0]) & (y < limits[1])
    assert np.hypot(y - centre[0], -z - centre[1])[inside] == pytest.approx(radius, abs=2e-4)
    radius, end = CROWNS[name][0]
    assert np.hypot(y, -z - radius)[np.abs(y) < end] == pytest.approx(radius, abs=1e-6)


def test_the_parametric_crossing_stands_as_high_as_the_benchmarks_sections():
    """95 positions of wing, nose and leg: 0.08 mm, the leg transition and the knuckle's edge; outside of these 0.012
    mm."""
    crossing, y = CastCrossing(9.25), np.array(AT) * MM
    off = {}
    for x, *heights in HEIGHTS:
        nose = crossing.top_height(x * MM, y, "nose") if x * MM >= crossing.nose_x else np.full(len(y), np.nan)
        found = np.fmax(crossing.top_height(x * MM, y, "wing"), nose) / MM
        off |= {(x, at): height - here for at, height, here in zip(AT, heights, found) if height is not None}
    assert len(off) == 95 and max(map(abs, off.values())) < 0.08
    assert max(abs(v) for (x, y), v in off.items() if x > -80 or -630 < x < -300) < 0.012


def test_the_nose_of_the_parametric_crossing_is_as_wide_as_the_benchmarks():
    """Printed to 0.1 mm, taken between sections 10 to 20 mm apart where the nose widens by 1:9.25 and more steeply at
    its tip: 0.6 mm."""
    crossing, y = CastCrossing(9.25), np.arange(-60, 60, 0.01) * MM
    for x, width in NOSE_WIDTHS:
        metal = y[crossing.top_height(x * MM, y, "nose") > -14 * MM]
        assert np.ptp(metal) / MM == pytest.approx(width, abs=0.6), x
