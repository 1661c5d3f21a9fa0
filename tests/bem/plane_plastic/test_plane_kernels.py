"""Initial stress in plane cells: closed forms held to quadrature, to Eshelby's circle and to energy."""

import numpy as np
import pytest

from bem.material import Elastic
from bem.plane.kelvin import point_force_stress
from bem.plane_plastic.cells import Cells, from_corner_grid
from bem.plane_plastic.influence import OF_STRAIN, TO_PLANE, cell_strain, edge_forces, strain_at_cells, strain_of_stress
from bem.plane_plastic.kernels import edge_pair

STRESS = np.array([1.0, -0.4, 0.7])  # xx, yy, xy of the initial stress
QUAD = np.array([[0.0, 0.0], [1.0, 0.1], [0.9, 0.8], [-0.1, 0.6]])


def one_cell(corners: np.ndarray) -> Cells:
    return Cells(corners, np.array([0, len(corners)]), np.array([[0, *(len(corners) * np.arange(1, 4) // 4)]]))


def dipole(angle: np.ndarray, poisson: float) -> np.ndarray:
    """Stress (k, 3) at polar angles, one metre from a point of initial stress: differences of Kelvin's solution, of
    sixth order."""
    kappa, step, out = 3 - 4 * poisson, 0.01, 0.0
    z = np.exp(1j * angle)
    for force, direction, level in ((1, 1, STRESS[0]), (1j, 1j, STRESS[1]), (1, 1j, STRESS[2]), (1j, 1, STRESS[2])):
        for k, weight in ((1, 45 / 60), (2, -9 / 60), (3, 1 / 60)):
            for sign in (1, -1):
                field = point_force_stress(z, sign * k * step * direction, force, kappa)
                out = out + level * sign * weight / step * field
    return out


def by_quadrature(point: np.ndarray, corners: np.ndarray, poisson: float, count: int = 60) -> np.ndarray:
    """C : e (3,) at a point of uniform initial stress in a polygon, in polar coordinates about the point: with g(angle)
    / r^2 the dipole's field, the polygon less a unit disc gives the integral of g ln r over its boundary; Eshelby's
    disc the rest where the point lies inside."""
    x, w = np.polynomial.legendre.leggauss(count)
    z = (corners - point) @ [1, 1j]
    total, turn = np.zeros(3), 0.0
    for a, b in zip(z, np.roll(z, -1)):
        sweep = np.angle(b / a)
        angle = np.angle(a) + sweep * (x + 1) / 2
        distance = (np.conj(a) * (b - a)).imag / (np.exp(-1j * angle) * (b - a)).imag
        total += (w * sweep / 2 * np.log(distance)) @ dipole(angle + np.pi, poisson)
        turn += sweep
    if turn > np.pi:
        mean, half = (STRESS[0] + STRESS[1]) / 2, (STRESS[0] - STRESS[1]) / 2
        bulk = mean * (1 - 2 * poisson) / (2 * (1 - poisson)) / (1 - 2 * poisson)  # stress of an isotropic strain
        round_ = (3 - 4 * poisson) / (4 * (1 - poisson))
        total += [bulk + round_ * half, bulk - round_ * half, round_ * STRESS[2]]
    return total


@pytest.mark.parametrize("poisson", [0.0, 0.3, 0.4999])
@pytest.mark.parametrize("point", [(0.4, 0.3), (0.05, 0.1), (1.4, -0.3), (0.5, 0.9)])
def test_strain_of_a_cell_at_a_point_is_the_quadrature_of_kelvins_dipoles(poisson, point):
    """Inside (with the free term) and outside."""
    cells, elastic = one_cell(QUAD), Elastic(1.0, poisson)
    edges, forces = edge_forces(cells, np.array([0]))
    z, e = cells.complex_vertices, np.arange(len(edges))
    points = np.repeat([point], 4, axis=0)
    field = strain_at_cells(points, z[edges], z[cells.following[edges]], e, e, len(e), elastic).reshape(3, -1)
    expected = strain_of_stress(by_quadrature(np.array(point), QUAD, poisson), poisson)
    np.testing.assert_allclose(field @ (forces @ STRESS), expected, rtol=0, atol=1e-8)


@pytest.mark.parametrize("poisson", [0.0, 0.3, 0.4999])
def test_mean_strain_of_a_round_cell_is_eshelbys(poisson):
    """512 corners: the polygon's mean differs from the circle's by 1 / n^2."""
    angle = 2 * np.pi * np.arange(512) / 512
    cells = one_cell(np.column_stack([np.cos(angle), np.sin(angle)]))
    chosen = np.array([0])
    found = cell_strain(cells, chosen, chosen, Elastic(1.0, poisson))[:, 0, :, 0] @ STRESS
    mean, half = (STRESS[0] + STRESS[1]) / 2, (STRESS[0] - STRESS[1]) / 2
    bulk, round_ = mean * (1 - 2 * poisson) / (2 * (1 - poisson)), (3 - 4 * poisson) / (4 * (1 - poisson))
    np.testing.assert_allclose(found, [bulk + round_ * half, bulk - round_ * half, round_ * STRESS[2]], atol=2e-5)


def test_double_integrals_of_two_edges_are_their_quadrature():
    rng, (x, w) = np.random.default_rng(3), np.polynomial.legendre.leggauss(40)
    for _ in range(20):
        a, b = rng.normal(size=2) + 1j * rng.normal(size=2)
        c, d = 8 + rng.normal(size=2) + 1j * rng.normal(size=2)
        away = (a + (b - a) * (x + 1) / 2)[:, None] - (c + (d - c) * (x + 1) / 2)
        weight = np.outer(w, w) / 4 * abs(b - a) * abs(d - c)
        log_r, twist = edge_pair(a, b, c, d)
        assert abs(log_r - (np.log(abs(away)) * weight).sum()) < 1e-12
        assert abs(twist - (away / np.conj(away) * weight).sum()) < 1e-12


def test_double_integrals_add_up_where_edges_touch():
    """An edge cut in two, seen from an edge that shares its end, and from the line behind it."""
    for far in (1.3j, 2.0 + 0.0j, -0.7 + 0.4j):
        whole = edge_pair(0j, 1 + 0j, 1 + 0j, 1 + far)
        parts = [edge_pair(0j, 0.4 + 0j, 1 + 0j, 1 + far), edge_pair(0.4 + 0j, 1 + 0j, 1 + 0j, 1 + far)]
        np.testing.assert_allclose(whole, np.sum(parts, axis=0), atol=1e-14)
    whole = edge_pair(0j, 1 + 0j, 0j, 1 + 0j)
    half, beside = edge_pair(0j, 0.5 + 0j, 0j, 0.5 + 0j), edge_pair(0j, 0.5 + 0j, 0.5 + 0j, 1 + 0j)
    np.testing.assert_allclose(whole, 2 * (np.array(half) + beside), atol=1e-14)


@pytest.mark.parametrize("height", [1.0, 0.05])
def test_the_influence_is_symmetric_and_takes_no_energy(height):
    """2 G e by plastic stress, weighted by area: eigenvalues between 0 (stress of rigid walls) and 1 (no stress), also
    for flat cells; with the strain at the middle of square cells the lowest would be negative."""
    x, y = np.meshgrid(np.r_[0.0, 1, 2, 2.7, 4, 5, 6, 7], -height * np.r_[0.0, 1, 2, 2.6, 3.5, 4.5])
    cells = from_corner_grid(np.stack([x, y], axis=2))
    every = np.arange(cells.count)
    strain = cell_strain(cells, every, every, Elastic(1.0, 0.3))
    matrix = np.einsum("ac,cidj,de->aiej", OF_STRAIN, strain, TO_PLANE).reshape(3 * cells.count, -1)
    weight = np.tile(np.sqrt(cells.areas), 3)
    matrix = matrix * weight[:, None] / weight
    assert np.abs(matrix - matrix.T).max() < 1e-3  # pairs far off go by Gauss points
    values = np.linalg.eigvalsh((matrix + matrix.T) / 2)
    assert values[0] > -1e-4
    assert values[-1] < 1 + 1e-4
