"""The field of a uniform body force in a cell, and the cells that fill a body."""

import numpy as np
import pytest
from numpy.polynomial.legendre import leggauss

from bem.dynamic.body_force import CellForces, cell_tractions, displacement_of_cells, path_forces, stress_of_cells
from bem.dynamic.cells import CellError, fill_with_cells
from bem.material import STEEL
from bem.plane.curve import arc
from bem.plane.kelvin import point_force_displacement, point_force_stress
from bem.plane.mesh import Sizing, mesh_outline
from bem.plane.outline import Edge, Outline, polygon_moments


def box(width: float, height: float, size: float):
    """Mesh of a rectangle with its lower left corner at the origin, held below."""
    a, b, c, d = (0, 0), (width, 0), (width, height), (0, height)
    sides = [
        Edge(np.array([p, q], float), name)
        for p, q, name in ((a, b, "held"), (b, c, "right"), (c, d, "face"), (d, a, "left"))
    ]
    return mesh_outline(Outline([sides]), Sizing(size))


@pytest.fixture(scope="module")
def ring():
    """A ring of radii 1 and 0.4 m in cells of at most 0.25 m."""
    outer, inner = Edge(arc((0, 0), 1.0, 0, 2 * np.pi)), Edge(arc((0.1, 0), 0.4, 0, 2 * np.pi))
    mesh = mesh_outline(Outline([[outer], [inner]]), Sizing(0.1))
    return mesh, fill_with_cells(mesh, Sizing(0.25))


def exact_area(mesh) -> float:
    return float((mesh.start.conj() * mesh.end).imag.sum() / 2)


def test_cells_fill_a_body_with_a_hole(ring):
    mesh, cells = ring
    assert abs(cells.area.sum() / exact_area(mesh) - 1) < 1e-12
    assert cells.side.max() <= 0.25
    middle = (cells.area[:, None] * cells.centre).sum(axis=0) / cells.area.sum()
    assert middle[0] == pytest.approx(-0.1 * 0.4**2 / (1 - 0.4**2), rel=0.02)  # the polygon's hole is a little smaller


def test_quadrature_of_every_cell_is_exact_for_quadratics(ring):
    """Second moments about the origin of all cells together are those of the polygon with its hole."""
    mesh, cells = ring
    a, b = mesh.start, mesh.end
    cross = (a.conj() * b).imag
    exact = (cross * (a.real**2 + a.real * b.real + b.real**2)).sum() / 12
    weight = cells.weight * cells.area[cells.of]
    assert (weight * cells.points[:, 0] ** 2).sum() == pytest.approx(exact, rel=1e-12)


def dense_quadrature(cells, k: int, value, away: complex) -> np.ndarray:
    """Mean of value(xi) over a cell that is the whole square, by 40 x 40 Gauss points."""
    t, w = leggauss(40)
    x, y = np.meshgrid(t, t)
    xi = complex(*cells.centre[k]) + cells.side[k] / 2 * (x + 1j * y)
    return np.tensordot(np.outer(w, w).ravel() / 4, value(xi.ravel()), axes=1)


@pytest.mark.parametrize(
    ("away", "bound"), [(0.8 + 0.3j, 1e-12), (7.9 + 0.1j, 1e-11), (5.7 + 5.7j, 5e-5), (40.0, 1e-7)]
)
def test_field_outside_a_square_is_the_mean_of_point_forces(away, bound):
    """Near, between and beyond the distance where moments take over: there the next is (side / distance)^4."""
    cells = fill_with_cells(box(0.3, 0.3, 0.1), Sizing(0.1))
    k = int(np.argmin(np.abs(cells.centre - 0.15).sum(axis=1)))
    assert cells.whole[k]
    z = np.array([complex(*cells.centre[k]) + away * cells.side[k]])
    point = np.column_stack([z.real, z.imag])
    moved, stress = displacement_of_cells(point, cells, STEEL), stress_of_cells(point, cells, STEEL)
    for axis, force in enumerate((1.0, 1j)):
        column = axis * len(cells) + k
        u = dense_quadrature(
            cells, k, lambda xi, w=force: point_force_displacement(z[0] - xi, 0, w, STEEL.kolosov), away
        )
        s = dense_quadrature(cells, k, lambda xi, w=force: point_force_stress(z[0] - xi, 0, w, STEEL.kolosov), away)
        u = u / (2 * STEEL.shear)
        assert np.abs(moved[:, column] - [u.real, u.imag]).max() < bound * abs(u)
        assert np.abs(stress[:, 0, column] - s).max() < bound * np.abs(s).max() + 1e-14


def test_stress_balances_the_body_force_inside_a_cell():
    """div sigma = -b by differences; the step of 1e-3 sides leaves an error of its square."""
    cells = fill_with_cells(box(0.2, 0.2, 0.1), Sizing(0.2))
    assert len(cells) == 1
    h, at = 2e-4, np.array([0.07, 0.11])
    points = at + h * np.array([[1, 0], [-1, 0], [0, 1], [0, -1]])
    s = stress_of_cells(points, cells, STEEL)
    for axis in (0, 1):
        xx, yy, xy = s[:, :, axis]
        divergence = np.array([xx[0] - xx[1] + xy[2] - xy[3], xy[0] - xy[1] + yy[2] - yy[3]]) / (2 * h)
        wanted = np.zeros(2)
        wanted[axis] = -1 / cells.area[0]
        assert np.abs(divergence - wanted).max() < 1e-5 / cells.area[0]


def test_tractions_around_the_body_balance_every_force(ring):
    """Forces and moments, of the slivers at the boundary too."""
    mesh, cells = ring
    n, tractions = len(cells), cell_tractions(mesh, cells, STEEL)
    fx, fy = tractions[: mesh.densities], tractions[mesh.densities :]
    moment = mesh.middles[:, 0] @ fy - mesh.middles[:, 1] @ fx
    one, zero = np.ones(n), np.zeros(n)
    assert np.abs(fx.sum(axis=0) + np.r_[one, zero]).max() < 1e-12
    assert np.abs(fy.sum(axis=0) + np.r_[zero, one]).max() < 1e-12
    assert np.abs(moment + np.r_[-cells.centre[:, 1], cells.centre[:, 0]]).max() < 1e-12


def test_tractions_come_from_the_stresses(ring):
    """What the balance adds is small: a force in the middle of the body, second order in the element."""
    mesh, cells = ring
    k = int(np.argmax(np.where(cells.whole, cells.side, 0)))
    points, begin, end, cell = mesh.paths()
    parts = path_forces(points[begin], points[end], cells, STEEL)
    plain = np.bincount(cell, parts[: len(begin), k], mesh.densities)
    assert np.abs(cell_tractions(mesh, cells, STEEL)[: mesh.densities, k] - plain).max() < 0.01 * np.abs(plain).max()


def test_cell_forces_are_a_load_like_any_other(ring):
    mesh, cells = ring
    forces = np.random.default_rng(1).normal(size=2 * len(cells))
    load = CellForces(cells, forces)
    point = np.array([[0.7, 0.2]])
    assert load.displacement(point, STEEL).shape == (1, 2) and load.stress(point, STEEL).shape == (1, 3)
    a = np.array([3.0 + 0j, 0 + 3j, -3.0 + 0j, -3j])
    x, y = load.path_force(a, np.roll(a, -1), STEEL).sum(axis=1)
    assert abs(x + forces[: len(cells)].sum()) < 0.02 * np.abs(forces).sum()
    assert abs(y + forces[len(cells) :].sum()) < 0.02 * np.abs(forces).sum()


@pytest.mark.parametrize(("size", "words"), [(0.0, "coarse size"), (1e-4, "choose a larger size")])
def test_cells_of_no_size_or_too_many_are_refused(size, words):
    with pytest.raises(ValueError, match=words):
        fill_with_cells(box(1.0, 1.0, 0.2), Sizing(size))


def test_an_infinite_body_is_refused():
    mesh = mesh_outline(Outline([[Edge(arc((0, 0), 1.0, 0, 2 * np.pi))]], infinite=True), Sizing(0.2))
    with pytest.raises(CellError, match="infinite"):
        fill_with_cells(mesh, Sizing(0.2))


def test_a_polygon_without_area_has_its_first_corner_as_centre():
    """A clipped piece may run to and fro along one line; its area is none and its centroid not 0 / 0."""
    there_and_back = np.array([1 + 1j, 2 + 2j, 3 + 3j])
    area, centre = polygon_moments(there_and_back, np.roll(there_and_back, -1))
    assert area == 0.0 and centre == 1 + 1j
    square = np.array([0, 2, 2 + 2j, 2j]) + 5
    area, centre = polygon_moments(square, np.roll(square, -1))
    assert area == pytest.approx(4.0) and centre == pytest.approx(6 + 1j)
