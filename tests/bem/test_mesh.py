"""Curves, outlines and meshes: what they keep, and what they refuse."""

import numpy as np
import pytest

from bem.plane.curve import Curve, _tangents, arc, divide, split_at_corners
from bem.plane.mesh import Sizing, Zone, mesh_outline
from bem.plane.outline import Edge, Outline, OutlineError, block_behind
from tests.order import assert_order

SQUARE = np.array([[0, 0], [1, 0], [1, 1], [0, 1], [0, 0.0]])


def test_curve_is_of_fourth_order():
    counts, errors = np.array([12, 24, 48, 96]), []
    for count in counts:
        curve = Curve.through(arc((0, 0), 1.0, 0, 2, count + 1))
        # the one-sided tangents at the ends are of lower order
        s = np.linspace(0.2 * curve.length, 0.8 * curve.length, 999)
        errors.append(np.abs(np.hypot(*curve.at(s).T) - 1).max())
    assert_order(2 / counts, errors, expected=4)


def test_curve_tangents_are_unit_and_true():
    curve = Curve.through(arc((0, 0), 1.0, 0, 2, 200))
    s = np.linspace(0.1, 1.9, 50)
    at, along = curve.at(s), curve.direction(s)
    np.testing.assert_allclose(np.hypot(*along.T), 1, atol=1e-14)
    np.testing.assert_allclose(np.sum(at * along, axis=1), 0, atol=1e-5)  # third order in the spacing of 0.01


def test_corners_are_found_and_duplicates_dropped():
    doubled = np.repeat(SQUARE, 2, axis=0)
    assert len(split_at_corners(doubled, np.radians(20))) == 4


def test_division_follows_the_wanted_size():
    curve = Curve.through(np.array([[-1.0, 0.0], [1.0, 0.0]]))
    size = Sizing(0.2, [Zone([[0.0, 0.0]], 1e-4, 0.01)], growth=0.3)
    s = divide(curve, size)
    middle, length = curve.at((s[1:] + s[:-1]) / 2), np.diff(s)
    assert s[0] == 0 and s[-1] == curve.length
    ratio = length / size(middle)
    # rounding the count up makes elements smaller by up to a fraction of one; sizes vary within an element
    assert ratio.max() < 1.02 and ratio.min() > 0.7


def test_reversed_loops_and_holes_put_the_material_on_the_left():
    for points in (SQUARE, SQUARE[::-1]):
        mesh = mesh_outline(
            Outline([[Edge(points, "wall")], [Edge(arc((0.5, 0.5), 0.2, 0, 2 * np.pi, 90), "hole")]]), Sizing(0.1)
        )
        outward = mesh.middles + 1e-3 * mesh.normals - 0.5
        wall = np.isin(np.arange(mesh.densities), mesh.of_edge("wall"))
        assert np.all(np.abs(outward[wall]).max(axis=1) > 0.5)
        assert np.all(np.hypot(*outward[~wall].T) < 0.2)


def test_cells_cover_the_boundary_and_corners_have_two_densities():
    mesh = mesh_outline(Outline([[Edge(SQUARE, "wall")]]), Sizing(0.1))
    assert mesh.elements == 40 and mesh.densities == 44
    assert mesh.cell_length.sum() == pytest.approx(4.0)
    assert (~mesh.smooth).sum() == 8


def test_block_behind_a_profile_is_above_or_below_it():
    x = np.linspace(-1, 1, 21)
    profile = np.column_stack([x, 0.1 * x**2])
    for level, sign in ((1.0, 1), (-1.0, -1)):
        mesh = mesh_outline(block_behind(profile[::-1], level), Sizing(0.2))
        face = mesh.of_edge("face")
        assert np.all(mesh.normals[face, 1] * sign < 0)


@pytest.mark.parametrize(
    "loops, message",
    [
        ([[Edge(SQUARE[:3], "a"), Edge(SQUARE[2:] + 0.01, "b")]], "begins"),
        ([[Edge(SQUARE, "a")], [Edge(SQUARE * 0.5 + 0.7, "b")]], "crosses"),
        ([[Edge(np.array([[0, 0], [1, 0], [0, 0.0]]), "thin")]], "no area"),
        ([], "at least one loop"),
    ],
)
def test_boundaries_that_enclose_no_body_are_refused(loops, message):
    with pytest.raises(OutlineError, match=message):
        Outline(loops)


def test_unknown_edges_and_bad_sizes_are_refused():
    outline = Outline([[Edge(SQUARE, "wall")]])
    with pytest.raises(OutlineError, match="wall"):
        outline.edge_curves("floor")
    with pytest.raises(OutlineError, match="positive"):
        Sizing(0.0)
    with pytest.raises(OutlineError, match="lies within"):
        block_behind(np.array([[-1, 0], [1, 1.0]]), 0.5)


def test_tangents_of_a_parabola_are_its_own_however_its_points_are_spaced():
    knots = np.array([0.0, 0.1, 0.5, 0.6, 1.6, 1.7])
    points = np.column_stack([knots, 3.0 * knots**2 - knots])
    assert _tangents(points, knots) == pytest.approx(
        np.column_stack([np.ones(6), 6.0 * knots - 1.0]), rel=1e-12, abs=1e-12
    )
