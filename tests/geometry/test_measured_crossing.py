"""A crossing by its own sections: the surface that they were cut from, its path and its outlines; what is refused."""

import numpy as np
import pytest

from geometry.path.wheel_path import wheel_path
from geometry.profiles.wheel import wheel_profile
from geometry.surfaces.crossing import CastCrossing, CrossingError
from geometry.surfaces.measured_crossing import SEGMENTS, measured_crossing, moved
from geometry.surfaces.section_cuts import cut_section
from geometry.surfaces.sections import SectionCrossing

MM = 1e-3
STATIONS = np.concatenate([[-1.0, -0.9], np.arange(-0.8, -0.05, 0.05), np.arange(0.0, 0.6, 0.01)])


@pytest.fixture(scope="module")
def cast():
    return CastCrossing(9.25)


@pytest.fixture(scope="module")
def sections(cast):
    return [cut_section(cast, x) for x in STATIONS]


@pytest.fixture(scope="module")
def crossing(sections):
    return measured_crossing(STATIONS, sections, label="cut")


def test_the_wheel_runs_over_sections_as_over_the_surface_they_were_cut_from(cast, crossing):
    """Sections 10 mm apart: half the spacing squared times the surface's curvature along x, some micrometres."""
    x = np.arange(0.15, 0.45, 2 * MM)
    exact, own = (wheel_path(wheel_profile("P8-worn"), c, x) for c in (cast, crossing))
    assert own.height == pytest.approx(exact.height, abs=8e-6)
    assert own.transfers == pytest.approx(exact.transfers, abs=1 * MM)


def test_ends_go_straight_on_where_that_is_asked_for(sections):
    short, long = (measured_crossing(STATIONS, sections, extended) for extended in (False, True))
    assert short.x_range == (STATIONS[0], STATIONS[-1])
    y = np.linspace(-0.02, 0.02, 9)
    assert long.top_height(STATIONS[0] - 5.0, y, "wing") == pytest.approx(
        short.top_height(STATIONS[0], y, "wing"), abs=1e-12
    )
    with pytest.raises(CrossingError, match="leaves the modelled crossing"):
        wheel_path(wheel_profile("P8"), short, np.array([STATIONS[-1]]))
    wheel_path(wheel_profile("P8"), long, np.array([STATIONS[-1] + 1.0]))


def test_of_points_that_lie_closer_than_they_are_printed_some_are_left_out(sections):
    """They cost minutes of smoothing; those of exact sections stay, however close."""
    section = sections[40]
    y = np.arange(section[0, 0], section[-1, 0], 0.02 * MM)
    exact = np.column_stack([y, np.interp(y, *section.T)])
    for points, kept in ((exact, 1.0), (exact.round(5), 0.2)):
        (body, *_) = SectionCrossing.from_points(STATIONS[40:41], [points]).wings
        assert len(body.line) == pytest.approx(kept * len(body.u), rel=0.5 * (1 - kept))


def test_steep_faces_of_points_printed_coarser_than_they_lie_do_not_turn_back(cast, sections):
    """Every 0.1 mm, to 0.1 mm: smoothed, some faces would, and stay as they are."""
    every = [np.arange(points[0, 0], points[-1, 0], 0.1 * MM) for points in sections[::2]]
    printed = [np.column_stack([y, np.round(np.interp(y, *own.T), 4)]) for y, own in zip(every, sections[::2])]
    y = np.linspace(0.02, 0.05, 7)
    height = measured_crossing(STATIONS[::2], printed).top_height(0.0, y, "wing")
    assert height == pytest.approx(cast.top_height(0.0, y, "wing"), abs=0.1 * MM)


def test_outlines_have_the_same_points_and_lie_on_the_surface(crossing):
    for body, positions in (("wing", (-0.7, 0.1, 0.4)), ("nose", (0.25, 0.4))):
        for x in positions:
            line = getattr(crossing, f"{body}_section")(x)
            assert len(line) == sum(SEGMENTS.values()) + 1
            head = line[SEGMENTS["face"] + 1 : -SEGMENTS["side"] - 2]
            # an outline's chord of 0.1 mm over a corner of 6 mm is 0.2 um below it, over an edge more
            assert np.median(np.abs(crossing.top_height(x, head[:, 0], body) - head[:, 1])) < 1e-6
            assert line[0, 1] == line[-1, 1] == -55 * MM
    assert crossing.nose_section(0.05) is None


def test_the_one_body_that_is_left_behind_the_wing_is_the_nose(cast, sections):
    ended = [s if x < 0.5 else s[s[:, 0] < 25 * MM] for x, s in zip(STATIONS, sections)]
    crossing = measured_crossing(STATIONS, ended)
    assert np.isfinite(crossing.top_height(0.55, 0.0, "nose")) and np.isnan(crossing.top_height(0.55, 0.0, "wing"))


@pytest.mark.parametrize(
    "harm, complaint",
    [
        (lambda x, s: (x, [moved(p, True, 0, 0) for p in s]), "mirror = true"),
        (lambda x, s: (x, [p + [5 * MM, 0] for p in s]), 'give lateral = "-5.01 mm"'),
        (lambda x, s: (x, [p + [0, 30 * MM] for p in s]), 'give height = "-30.00 mm"'),
        (lambda x, s: (x, [p - [0, 10 * MM] for p in s]), 'give height = "10.00 mm"'),
        (lambda x, s: (x, [p * (1 if k < 40 else 0.1) for k, p in enumerate(s)]), "jumps by .* one unit"),
        (lambda x, s: (x, [p if k != 40 else moved(p, True, 0, 0) for k, p in enumerate(s)]), "jumps by|lacks"),
        (lambda x, s: (x, [p if k != 50 else p[p[:, 0] > 20 * MM] for k, p in enumerate(s)]), "lacks the nose"),
        (lambda x, s: (x[[1, 0, *range(2, len(x))]], s), "does not lie beyond"),
        (lambda x, s: (x[:3], s[:3]), "needs at least 4"),
        (lambda x, s: (x, s[:-1]), "give one station to each"),
        (lambda x, s: (x, [p - [0, 0.1] for p in s]), "lies at z = -100.00 mm: is its vertical axis up"),
    ],
)
def test_sections_that_are_no_crossing_are_refused_with_the_place(sections, harm, complaint):
    with pytest.raises(CrossingError, match=complaint):
        measured_crossing(*harm(STATIONS, sections))


def test_a_wheel_beside_its_way_derails(cast, crossing):
    """Shifted by 60 mm towards the field side it stands with its tread's end beside the wing at x = 0.2 m."""
    for surface in (cast, crossing):
        with pytest.raises(CrossingError, match="derails: at x = 0.2 m .* falls into the flangeway"):
            wheel_path(wheel_profile("P8"), surface, np.array([0.2]), lateral_shift=60 * MM)
