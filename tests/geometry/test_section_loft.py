"""Sections between sections: arcs stay arcs, ends are met, unlike sections give no zig-zag, order in the distance; the
upper line of two bodies."""

from dataclasses import replace

import numpy as np
import pytest

from geometry.profiles.profile import Profile, ProfileError, arc, graph, line
from geometry.profiles.rail import rail_head
from geometry.surfaces.lofted_rail import RailSurface
from geometry.surfaces.section_loft import SectionLoft, between, marks, matched_body, upper_line
from geometry.surfaces.switch import Switch
from tests.order import assert_order

MM = 1e-3


def dome(radius: float, centre: tuple[float, float], half: float = np.radians(80)) -> Profile:
    """Arc over the same angles whatever its radius."""
    ends = [np.array(centre) + radius * np.array([sign * np.sin(half), np.cos(half)]) for sign in (-1, 1)]
    return Profile.from_pieces([arc(*ends, -radius, radius / 200)], f"dome {radius:g}")


@pytest.mark.parametrize("share", [0.0, 0.3, 1.0])
def test_between_two_arcs_lies_the_arc_of_linear_radius_and_centre(share):
    """Hermite arcs of 1/200 radius a step: error h^4 / (384 R^3) ~ 1e-13 m."""
    section = between(dome(5 * MM, (0, 0)), dome(13 * MM, (-7 * MM, 3 * MM)), share)
    centre, radius = np.array([-7 * MM, 3 * MM]) * share, 5 * MM + share * 8 * MM
    assert np.hypot(*(section.points - centre).T) == pytest.approx(radius, abs=1e-11)
    outward = (section.points - centre) / radius
    assert np.column_stack([-np.sin(section.angle_after), np.cos(section.angle_after)]) == pytest.approx(
        outward, abs=1e-7
    )


@pytest.mark.parametrize("share, own", [(0.0, 0), (1.0, 1)])
def test_both_ends_are_the_sections_themselves(share, own):
    pair = rail_head("56E1"), rail_head("60E2", 1 / 40)
    section, y = between(*pair, share), np.linspace(-30, 30, 601) * MM
    # a step over the joint of R80 and R12.7
    assert np.abs(section.graph_part().height(y) - pair[own].graph_part().height(y)).max() < 1e-8


def turns(profile: Profile) -> float:
    """How much a line turns left in all [rad]; none on a convex head."""
    angle = np.unwrap(np.arctan2(*np.diff(profile.points, axis=0).T[::-1]))
    return float(np.maximum(np.diff(angle), 0).sum())


@pytest.mark.parametrize("share", [0.2, 0.5, 0.8])
@pytest.mark.parametrize("first", [0.5, 1.5])
def test_a_thin_and_a_wide_section_join_without_a_zig_zag(first, share):
    """Both are convex, and so is what lies between: it turns left by no more than 1e-4 rad in all."""
    section = between(Switch().drawn_switch_rail(first), rail_head("56E1"), share)
    assert turns(section) < 1e-4 and section.is_graph


def test_averages_at_equal_y_would_make_a_staircase_of_two_faces():
    """What matching is for: two switch rails whose faces stand 20 mm apart."""
    pair = Switch().drawn_switch_rail(1.5), Switch().drawn_switch_rail(3.0)
    y = np.arange(-78, -29, 0.2) * MM
    naive = np.mean([np.interp(y, *p.points.T, left=-36 * MM) for p in pair], axis=0)
    assert turns(Profile.from_points(np.column_stack([y, naive]))) > 1.0
    assert turns(between(*pair, 0.5)) < 1e-4


def test_sections_of_a_switch_rail_converge_to_its_drawing():
    """Second order in their distance: the switch rail's width is quadratic in x."""
    steps, errors = np.array([0.8, 0.4, 0.2]), []
    for step in steps:
        switch, x = Switch(heights=((0.0, -14e-3), (80e-3, -2e-3)), spacing=step, length=4.8), 2.0 + step / 2
        drawn, lofted = (
            switch.drawn_switch_rail(x),
            SectionLoft(
                np.array([2.0, 2.0 + step]), (switch.drawn_switch_rail(2.0), switch.drawn_switch_rail(2.0 + step))
            ).section(x),
        )
        y = np.linspace(drawn.points[0, 0] + 1 * MM, -31 * MM, 400)
        errors.append(np.abs(drawn.height(y) - lofted.height(y)).max())
        assert np.diff(replace(switch, length=4.7).loft.x).max() <= step  # no farther apart where they do not divide
    assert_order(steps, errors, expected=2)


@pytest.mark.parametrize("share", [0.0, 0.4, 1.0])
def test_a_flat_top_stays_flat_up_to_its_edge(share):
    """The edge keeps both of its tangents: no cubic swings over it."""
    pair = Switch().drawn_switch_rail(2.0), Switch().drawn_switch_rail(3.0)
    section = between(*pair, share)
    tops = [p.points[:, 1].max() for p in pair]
    top = (1 - share) * tops[0] + share * tops[1]
    y = np.linspace(-35, -30.5, 4001) * MM
    assert section.height(y) == pytest.approx(top, abs=1e-9)
    edge = np.argmax(np.abs(section.angle_after - section.angle_before))
    assert section.points[edge] == pytest.approx([-30.5 * MM, top], abs=1e-9)
    assert np.tan([section.angle_before[edge], section.angle_after[edge]]) == pytest.approx([0, -20], abs=1e-6)


def test_marks_grow_along_a_section_and_a_hollow_is_no_feature():
    y = np.linspace(-20, 20, 401) * MM
    wavy = Profile.from_pieces(
        [graph(y, -(y**2) / 0.1 + 0.05 * MM * np.sin(y / MM), -2 * y / 0.1 + 0.05 * np.cos(y / MM))]
    )
    found = marks(wavy, np.radians([10.0, 0.0, -10.0]))
    assert (np.diff(found) >= 0).all() and len(found) == 5


def test_a_matched_body_passes_through_its_sections_and_refuses_features_that_come_and_go():
    """Through the drawn switch rails to what 24 nodes on a feature leave: the joint of corner and flat top lies within
    one, 1 mm between nodes, where the curvature jumps by 79 / m: less than 79 (0.5 mm)^2 / 8 = 2.5 um there, nothing
    elsewhere."""
    x = np.array([2.0, 2.5, 3.0])
    drawn = [Switch().drawn_switch_rail(at) for at in x]
    surface = RailSurface((matched_body(x, drawn),))
    y = np.linspace(-50, -30.6, 300) * MM
    miss = np.abs(surface.height(np.full(300, 2.5), y) - drawn[1].height(y))
    assert miss.max() < 2.5e-6 and np.median(miss) < 1e-9
    with pytest.raises(ProfileError, match="section at x = 2 m has no length in feature"):
        matched_body(x[:2], [drawn[0], dome(13 * MM, (-40 * MM, -13 * MM))])


def test_the_upper_line_is_the_higher_of_both_and_exact_where_they_cross():
    """Two arcs of one radius whose centres are 2 c apart cross in the middle, sqrt(R^2 - c^2) over the centres."""
    radius, apart = 13 * MM, 4 * MM
    pair = dome(radius, (-apart, 0.0)), dome(radius, (apart, 0.0))
    both = upper_line(*pair)
    y = np.linspace(-10, 10, 1001) * MM
    assert both.height(y) == pytest.approx(np.fmax(pair[0].height(y), pair[1].height(y)), abs=1e-12)
    kink = np.argmax(both.angle_after - both.angle_before)
    assert both.points[kink] == pytest.approx([0, np.sqrt(radius**2 - apart**2)], abs=1e-11)
    assert both.angle_after[kink] - both.angle_before[kink] == pytest.approx(2 * np.arcsin(apart / radius), abs=1e-6)


def test_the_upper_line_reaches_to_both_ends():
    """From the first to the last y of both lines, whichever of them is higher there."""
    y = np.linspace(-0.01, 0.01, 21)
    left, right = (Profile.from_points(np.column_stack([y, slope * y])) for slope in (-0.3, 0.2))
    both = upper_line(left, right)
    assert both.points[0] == pytest.approx([-0.01, 0.003], abs=1e-12) and both.points[-1] == pytest.approx(
        [0.01, 0.002], abs=1e-12
    )


def test_beside_one_line_the_upper_line_is_the_other():
    low = Profile.from_pieces([line((-50 * MM, -20 * MM), (0.0, -20 * MM), 1 * MM)])
    high = Profile.from_pieces([line((-10 * MM, -5 * MM), (30 * MM, -5 * MM), 1 * MM)])
    both = upper_line(low, high)
    assert both.height(np.array([-40, -11, -9, 20]) * MM) == pytest.approx(
        [-20 * MM, -20 * MM, -5 * MM, -5 * MM], abs=1e-9
    )
    assert both.points[0, 0] == -50 * MM and both.points[-1, 0] == 30 * MM


def test_what_cannot_be_is_refused():
    a, b = dome(5 * MM, (0, 0)), dome(5 * MM, (0.1, 0))
    with pytest.raises(ProfileError, match="lie apart"):
        upper_line(a, b)
    with pytest.raises(ProfileError, match="share 1.5"):
        between(a, b, 1.5)
    with pytest.raises(ProfileError, match="outside its stations"):
        SectionLoft(np.array([0.0, 1.0]), (a, b)).section(2.0)
