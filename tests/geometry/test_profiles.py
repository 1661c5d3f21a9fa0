"""Profile: exact on lines and arcs, tangents and kinks kept, bad input refused with its position."""

import numpy as np
import pytest

from geometry.profiles.profile import Profile, ProfileError, arc, line, spline


def test_an_arc_keeps_its_end_points_radius_and_tangent():
    piece = arc((0.0, 0.0), (0.01, 0.01), 0.01, 1e-4)  # quarter circle, turning left, about (0, 0.01)
    assert np.allclose(np.hypot(piece.points[:, 0], piece.points[:, 1] - 0.01), 0.01, atol=1e-17, rtol=1e-14)
    assert piece.angle[0] == pytest.approx(0.0, abs=1e-14) and piece.angle[-1] == pytest.approx(np.pi / 2, abs=1e-14)
    assert np.all(piece.curvature == 100.0)


@pytest.mark.parametrize("spacing", [1.0, 0.3, 0.25, 0.09])
def test_a_straight_piece_is_sampled_no_farther_apart_than_told(spacing):
    gaps = np.hypot(*np.diff(line((0.0, 0.0), (0.6, 0.8), spacing).points, axis=0).T)
    assert gaps.max() <= spacing * (1 + 1e-12) and gaps.min() > spacing / 2
    assert gaps.sum() == pytest.approx(1.0, rel=1e-12)


def test_interpolation_on_an_arc_is_fourth_order():
    errors, steps = [], np.array([8e-3, 4e-3, 2e-3, 1e-3])
    for spacing in steps:
        profile = Profile.from_pieces([arc((-0.03, -0.0146), (0.03, -0.0146), -0.04, spacing)])
        y = np.linspace(-0.029, 0.029, 4001)
        exact = np.sqrt(0.04**2 - y**2) - np.sqrt(0.04**2 - 0.03**2) - 0.0146
        errors.append(np.abs(profile.height(y) - exact).max())
    order = np.log2(errors[-2] / errors[-1])
    assert 3.7 < order < 4.3, (steps, errors)


def test_arc_length_of_a_circle_is_fourth_order():
    lengths = [Profile.from_pieces([arc((-0.03, 0.0), (0.03, 0.0), 0.04, h)]).arc_length[-1] for h in (4e-3, 2e-3)]
    errors = np.abs(np.array(lengths) - 2 * 0.04 * np.arcsin(0.75))
    assert 14 < errors[0] / errors[1] < 18


def test_slope_is_the_derivative_of_height():
    profile = Profile.from_pieces(
        [spline(np.linspace(0, 0.02, 9), 1e-3 * np.sin(np.linspace(0, 3, 9)), 0.1, -0.1, 1e-4)]
    )
    y, h = np.linspace(0.001, 0.019, 50), 1e-7
    assert np.allclose(profile.slope(y), (profile.height(y + h) - profile.height(y - h)) / (2 * h), atol=1e-7)


def test_a_kink_keeps_both_tangents_and_a_smooth_joint_has_one():
    profile = Profile.from_pieces([line((0, 0), (1e-2, 0), 1e-3), line((1e-2, 0), (2e-2, 1e-2), 1e-3)])
    at = int(np.argmin(np.abs(profile.points[:, 0] - 1e-2)))
    assert profile.angle_before[at] == 0.0 and profile.angle_after[at] == pytest.approx(np.pi / 4)
    others = np.delete(np.arange(len(profile.points)), at)
    assert np.all(profile.angle_before[others] == profile.angle_after[others])
    assert profile.height(np.array([0.5e-2, 1.5e-2])) == pytest.approx([0.0, 0.5e-2], abs=1e-16)


@pytest.mark.parametrize("side", [1, -1], ids=["falling", "rising"])
def test_a_line_that_ends_upright_stays_between_its_points(side):
    """A rail head's round corner down to its side: the cubic's tangent there is endless, and a cubic through it would
    swing far out."""
    ends = [(0.0, 0.0), (side * 0.013, -0.013)][::side]
    profile = Profile.from_pieces([arc(*ends, -0.013, 1e-3)])
    points = profile.points
    y = np.linspace(points[0, 0], points[-1, 0], 2001)
    i = np.clip(np.searchsorted(points[:, 0], y), 1, len(points) - 1)
    ends = points[[i - 1, i], 1]
    assert (profile.height(y) >= ends.min(axis=0) - 1e-12).all() and (
        profile.height(y) <= ends.max(axis=0) + 1e-12
    ).all()
    # the arc over a chord of 1 mm
    assert np.abs(np.hypot(y, profile.height(y) + 0.013) - 0.013).max() < 1e-3**2 / (8 * 0.013)


def test_height_outside_the_profile_is_nan_and_the_arrays_cannot_be_changed():
    profile = Profile.from_points(np.column_stack([np.linspace(0, 1e-2, 5), np.zeros(5)]))
    assert np.isnan(profile.height(np.array([-1e-6, 1.1e-2]))).all()
    with pytest.raises(ValueError):
        profile.points[0, 0] = 1.0


@pytest.mark.parametrize(
    "points, complaint",
    [
        (np.zeros((2, 2)), "at least 3 points"),
        (np.array([[0, 0], [1, np.nan], [2, 0]]), "not finite, the first at index 1"),
        (np.array([[0, 0], [1, 0], [1, 0], [2, 0]]), "point 2 repeats point 1"),
    ],
)
def test_malformed_points_are_refused_with_their_place(points, complaint):
    with pytest.raises(ProfileError, match=complaint):
        Profile.from_points(points, "bad")


def test_a_line_that_turns_back_has_no_height_function():
    profile = Profile.from_points(np.array([[0, 0], [1e-2, 0], [0.5e-2, 1e-2]]), "hook")
    with pytest.raises(ProfileError, match="hook: z is no function of y"):
        profile.height(np.array([0.2e-2]))


def test_the_graph_part_leaves_out_vertical_and_undercut_sides():
    points = np.array([[1, -4], [0, -2], [0, 0], [1, 1], [2, 1.2], [3, 1], [4, 0], [4, -2], [3, -4]]) * 1e-2
    part = Profile.from_points(points).graph_part()
    assert np.array_equal(part.points, points[2:7])


def test_pieces_that_do_not_meet_are_refused():
    with pytest.raises(ProfileError, match="do not meet at y=0.010000.*gap 0.001"):
        Profile.from_pieces([line((0, 0), (1e-2, 0), 1e-3), line((1.1e-2, 0), (2e-2, 0), 1e-3)])
    with pytest.raises(ProfileError, match="cannot join"):
        arc((0, 0), (1e-2, 0), 1e-3, 1e-4)
