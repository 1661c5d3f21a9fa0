"""One cuboid of eigenstrain in a half-space: free surface, equilibrium, Hooke's law, Mindlin's solution integrated."""

import numpy as np
import pytest

from bem.halfspace.stress import rectangle_stress
from bem.material import Elastic
from bem.patch import ContactInputError
from tests.bem.plastic.cuboid import Cuboid, cuboid_displacement, cuboid_stress

STEEL = Elastic(210e9, 0.3)
BOX = Cuboid((-1.0, 1.2), (-0.7, 0.9), (0.4, 1.1))
UNIT = np.eye(6)
PAIR = ((0, 0), (1, 1), (2, 2), (1, 2), (0, 2), (0, 1))


def mindlin(x, source, elastic):
    """(3, 3, ...) displacement along i at x (3,) by a unit force along j at source (3, ...); Mindlin, Physics 7 (1936)
    195, as printed in textbooks."""
    nu = elastic.poisson
    dx, dy, z, c = x[0] - source[0], x[1] - source[1], x[2], source[2]
    r1 = np.sqrt(dx**2 + dy**2 + (z - c) ** 2)
    r2 = np.sqrt(dx**2 + dy**2 + (z + c) ** 2)
    deep, k, m = r2 + z + c, 3 - 4 * nu, 4 * (1 - nu) * (1 - 2 * nu)
    out = np.empty((3, 3, *np.shape(dx)), dtype=complex)
    for i, (u, v) in enumerate(((dx, dy), (dy, dx))):
        out[i, i] = k / r1 + 1 / r2 + u**2 / r1**3 + k * u**2 / r2**3
        out[i, i] += 2 * c * z / r2**3 * (1 - 3 * u**2 / r2**2) + m / deep * (1 - u**2 / (r2 * deep))
        out[1 - i, i] = u * v * (1 / r1**3 + k / r2**3 - 6 * c * z / r2**5 - m / (r2 * deep**2))
        out[2, i] = u * ((z - c) / r1**3 + k * (z - c) / r2**3 - 6 * c * z * (z + c) / r2**5 + m / (r2 * deep))
        out[i, 2] = u * ((z - c) / r1**3 + k * (z - c) / r2**3 + 6 * c * z * (z + c) / r2**5 - m / (r2 * deep))
    out[2, 2] = k / r1 + (8 * (1 - nu) ** 2 - k) / r2 + (z - c) ** 2 / r1**3
    out[2, 2] += (k * (z + c) ** 2 - 2 * c * z) / r2**3 + 6 * c * z * (z + c) ** 2 / r2**5
    return out / (16 * np.pi * elastic.shear * (1 - nu))


def by_quadrature(x, strain, elastic, points=16):
    """u_i = integral of G_ij,l' (C : strain)_jl, the derivative to the source by a complex step."""
    nodes, weights = np.polynomial.legendre.leggauss(points)
    axes = [((h - l) / 2 * nodes + (h + l) / 2, (h - l) / 2 * weights) for l, h in (BOX.x, BOX.y, BOX.z)]
    source = np.array(np.meshgrid(*(a[0] for a in axes), indexing="ij"))
    weight = np.einsum("i,j,k->ijk", *(a[1] for a in axes))
    tensor = np.zeros((3, 3))
    for value, (i, j) in zip(strain, PAIR):
        tensor[i, j] = tensor[j, i] = value
    nu = elastic.poisson
    force = 2 * elastic.shear * (tensor + nu / (1 - 2 * nu) * np.trace(tensor) * np.eye(3))
    total = np.zeros(3)
    for l in range(3):
        moved = source.astype(complex)
        moved[l] += 1e-30j
        slope = mindlin(x, moved, elastic).imag / 1e-30
        total += np.einsum("ijabc,j,abc->i", slope, force[:, l], weight)
    return total


@pytest.mark.parametrize("nu", [0.0, 0.3, 0.4999])
def test_displacement_is_mindlins_solution_integrated(nu):
    """Points outside, far enough for Gauss points; every strain component at once."""
    elastic = Elastic(210e9, nu)
    strain = np.array([1.0, -0.6, 0.3, 0.7, -0.4, 0.9])
    points = np.array([[2.5, 1.0, 0.5], [0.3, -2.6, 0.0], [-0.2, 0.1, 2.6], [-2.4, 2.0, 1.6]])
    exact = cuboid_displacement(points, BOX, strain, elastic)
    for point, one in zip(points, exact):
        assert np.abs(by_quadrature(point, strain, elastic) - one).max() < 1e-8 * np.abs(one).max()


@pytest.mark.parametrize("component", range(6))
def test_surface_is_free_of_tractions(component):
    points = np.random.default_rng(1).uniform(-3, 3, (40, 3)) * [1, 1, 0]
    stress = cuboid_stress(points, BOX, UNIT[component], STEEL)
    assert np.abs(stress[:, 2:5]).max() < 1e-13 * np.abs(stress).max()


def gradient(field, points, step=1e-3):
    """Fourth-order central differences: (n, components, 3)."""
    parts = []
    for axis in range(3):
        e = step * np.eye(3)[axis]
        parts.append(
            (8 * (field(points + e) - field(points - e)) - field(points + 2 * e) + field(points - 2 * e)) / (12 * step)
        )
    return np.stack(parts, axis=-1)


@pytest.mark.parametrize("component", range(6))
def test_stress_is_in_equilibrium_and_hookes_of_the_displacement_inside_and_outside(component):
    rng = np.random.default_rng(component)
    points = np.vstack([rng.uniform([-0.9, -0.6, 0.5], [1.1, 0.8, 1.0], (6, 3)), rng.uniform(1.3, 2.5, (6, 3))])
    strain = UNIT[component]
    stress = lambda p: cuboid_stress(p, BOX, strain, STEEL)
    slope = gradient(stress, points)
    position = ((0, 5, 4), (5, 1, 3), (4, 3, 2))
    divergence = np.stack([sum(slope[:, position[i][j], j] for j in range(3)) for i in range(3)])
    size = np.abs(stress(points)).max()
    assert np.abs(divergence).max() < 1e-6 * size  # h^4 f'''''/30 with f''''' below 1e6 near the faces
    u = gradient(lambda p: cuboid_displacement(p, BOX, strain, STEEL), points)
    found = np.stack([(u[:, i, j] + u[:, j, i]) / 2 for i, j in PAIR], axis=1)
    found[:6] -= strain
    hooke = 2 * STEEL.shear * found
    hooke[:, :3] += 2 * STEEL.shear * 0.3 / 0.4 * found[:, :3].sum(axis=1)[:, None]
    assert np.abs(hooke - stress(points)).max() < 1e-7 * size


def test_tractions_and_displacement_are_continuous_through_the_faces():
    strain = np.array([1.0, -0.6, 0.3, 0.7, -0.4, 0.9])
    off = 1e-7
    for axis, tractions in ((0, (0, 4, 5)), (1, (1, 3, 5)), (2, (2, 3, 4))):
        point = np.array([0.3, 0.2, 0.7])
        point[axis] = (BOX.x, BOX.y, BOX.z)[axis][1]
        both = np.array([point - off * np.eye(3)[axis], point + off * np.eye(3)[axis]])
        stress = cuboid_stress(both, BOX, strain, STEEL)
        moved = cuboid_displacement(both, BOX, strain, STEEL)
        assert np.abs(np.diff(stress, axis=0)[0, list(tractions)]).max() < 1e-5 * np.abs(stress).max()
        assert np.abs(np.diff(stress, axis=0)).max() > 0.1 * np.abs(stress).max()
        assert np.abs(np.diff(moved, axis=0)).max() < 1e-5 * np.abs(moved).max()


def test_surface_displacement_is_boussinesqs_stress_by_reciprocity():
    """A unit pressure on a small rectangle does as much work on the eigenstrain as the eigenstrain's displacement on
    it."""
    strain, point, side = np.array([1.0, -0.6, 0.3, 0.0, 0.0, 0.0]), np.array([0.4, 1.7, 0.0]), 1e-3
    nodes, weights = np.polynomial.legendre.leggauss(12)
    work = 0.0
    for xn, xw in zip(nodes, weights):
        for yn, yw in zip(nodes, weights):
            for zn, zw in zip(nodes, weights):
                at = np.array([0.1 + 1.1 * xn, 0.1 + 0.8 * yn, 0.75 + 0.35 * zn]) - point
                edges = (np.array([at[k] - side / 2, at[k] + side / 2]) for k in (0, 1))
                work += xw * yw * zw * strain @ rectangle_stress(0, *edges, at[2], 0.3)[:, 0, 0]
    normal = cuboid_displacement(point[None], BOX, strain, STEEL)[0, 2]
    assert normal == pytest.approx(work * 1.1 * 0.8 * 0.35 / side**2, rel=1e-6)


@pytest.mark.parametrize("box", [((1, 0), (0, 1), (0, 1)), ((0, 1), (0, 1), (-0.1, 1)), ((0, np.nan), (0, 1), (0, 1))])
def test_impossible_cuboids_are_refused(box):
    with pytest.raises(ContactInputError):
        Cuboid(*box)


def test_observers_above_the_surface_are_refused():
    with pytest.raises(ContactInputError, match="z >= 0"):
        cuboid_stress(np.array([[0, 0, -0.1]]), BOX, UNIT[0], STEEL)
