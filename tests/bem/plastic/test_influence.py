"""Influence of many cuboids by FFT: the sum of single ones, symmetric, and never gaining energy."""

import numpy as np
import pytest

from bem.material import Elastic
from bem.patch import ContactInputError, Grid
from bem.plastic.influence import Cells, StressInfluence
from bem.plastic.surface import SurfaceDisplacement
from bem.steel.deviator import FROM_DEVIATOR, MEAN, TO_DEVIATOR
from tests.bem.plastic.cuboid import Cuboid, cuboid_displacement, cuboid_stress

STEEL = Elastic(210e9, 0.3)
CELLS = Cells(1e-3, 1.3e-3, 0.7e-3, 4, 3, 3)


def random_strain(seed, shape=CELLS.shape):
    return 1e-3 * np.random.default_rng(seed).normal(size=shape)


def cuboid_of(k, i, j):
    c = CELLS
    return Cuboid(
        ((i - 0.5) * c.dx, (i + 0.5) * c.dx), ((j - 0.5) * c.dy, (j + 0.5) * c.dy), (k * c.dz, (k + 1) * c.dz)
    )


def test_mean_stress_over_a_cell_is_that_of_the_cuboids():
    """Against Gauss points over depth (12) and the same 3 x 3 along the surface; logarithms at touching faces limit the
    depth's."""
    strain = np.zeros(CELLS.shape)
    strain[1, :, 1, 1] = random_strain(0)[1, :, 1, 1]
    influence = StressInfluence(CELLS, STEEL)
    deviator, mean = influence.deviator(strain), influence.mean(strain)
    flat, deep = np.polynomial.legendre.leggauss(3), np.polynomial.legendre.leggauss(12)
    tensor = FROM_DEVIATOR @ strain[1, :, 1, 1]
    for k, i, j, tolerance in ((0, 0, 0, 1e-8), (1, 1, 1, 1e-6), (2, 1, 1, 1e-6), (1, 3, 2, 1e-9), (0, 3, 1, 1e-8)):
        points, weights = [], []
        for a, u in zip(*flat):
            for b, v in zip(*flat):
                for c, w in zip(*deep):
                    points.append(((i + a / 2) * CELLS.dx, (j + b / 2) * CELLS.dy, (k + 0.5 + c / 2) * CELLS.dz))
                    weights.append(u * v * w / 8)
        stress = np.array(weights) @ cuboid_stress(np.array(points), cuboid_of(1, 1, 1), tensor, STEEL)
        size = np.abs(stress).max()
        assert np.abs(TO_DEVIATOR @ stress - deviator[k, :, i, j]).max() < tolerance * size
        assert abs(MEAN @ stress - mean[k, i, j]) < tolerance * size


def test_surface_displacement_is_that_of_the_cuboids():
    strain = random_strain(4)
    grid = Grid(0.0, 0.0, CELLS.dx, CELLS.dy, CELLS.nx, CELLS.ny)
    found = SurfaceDisplacement(grid, CELLS.nz, CELLS.dz, STEEL)(strain)
    x, y = grid.points()
    points = np.column_stack([x.ravel(), y.ravel(), 0 * x.ravel()])
    total = np.zeros((x.size, 3))
    for k in range(CELLS.nz):
        for i in range(CELLS.nx):
            for j in range(CELLS.ny):
                total += cuboid_displacement(points, cuboid_of(k, i, j), FROM_DEVIATOR @ strain[k, :, i, j], STEEL)
    expected = total[:, 2].reshape(x.shape)
    assert np.abs(found - expected).max() < 1e-10 * np.abs(expected).max()


def test_work_is_mutual_and_never_gained():
    """Betti, and a negative quadratic form also for strains that alternate from cell to cell."""
    cells = Cells(1e-4, 1e-4, 1e-4, 8, 8, 5)
    influence = StressInfluence(cells, STEEL)
    one, two = random_strain(1, cells.shape), random_strain(2, cells.shape)
    there, back = np.vdot(one, influence.deviator(two)), np.vdot(two, influence.deviator(one))
    assert there == pytest.approx(back, rel=1e-10)
    i, j, k = np.meshgrid(np.arange(8), np.arange(8), np.arange(5), indexing="ij")
    for signs in ((-1.0) ** (i + j), (-1.0) ** (i + j + k), (-1.0) ** k, (-1.0) ** i, np.ones(i.shape)):
        for component in range(5):
            strain = np.zeros(cells.shape)
            strain[:, component] = np.moveaxis(signs, 2, 0)
            assert np.vdot(strain, influence.deviator(strain)) < 0


def eddy(per_length: float, depth: float) -> tuple[Cells, np.ndarray, np.ndarray]:
    """Cells, mean plastic strain of each and fall of the surface by the displacement (psi_z, 0, -psi_x) with psi =
    exp(-r^2) about a point on the axis at a depth: its strain keeps the volume and fits together."""
    side, count = 1 / per_length, 2 * int(np.ceil(2.4 * per_length))
    cells = Cells(side, side, side, count, count, int(np.ceil((depth + 2.4) * per_length)))
    middle = (np.arange(count) - (count - 1) / 2) * side
    at = np.meshgrid(cells.depths - depth, middle, middle, indexing="ij")
    points, weights = np.polynomial.legendre.leggauss(3)
    tensor = np.zeros((6, *at[0].shape))
    for a, wa in zip(points, weights):
        for b, wb in zip(points, weights):
            for c, wc in zip(points, weights):
                z, x, y = (one + off * side / 2 for one, off in zip(at, (a, b, c)))
                psi = wa * wb * wc / 8 * np.exp(-(x**2 + y**2 + z**2))
                slide = (4 * z**2 - 4 * x**2) * psi / 2
                tensor += [4 * x * z * psi, 0 * psi, -4 * x * z * psi, -2 * x * y * psi, slide, 2 * y * z * psi]
    x, y = np.meshgrid(middle, middle, indexing="ij")
    fall = 2 * x * np.exp(-(x**2 + y**2 + depth**2))
    return cells, np.ascontiguousarray(np.moveaxis(np.tensordot(TO_DEVIATOR, tensor, 1), 0, 1)), fall


def test_plastic_strain_that_fits_together_leaves_no_stress_to_second_order():
    """A mechanism of flow is free of stress; of cells each uniform it is not: what is left, as a part of 2 G strain,
    is how much stiffer than the steel they are. The surface moves as the mechanism does."""
    for depth in (0.0, 2.0):
        left, off = [], []
        for per_length in (1.0, 2.0):
            cells, strain, fall = eddy(per_length, depth)
            stress = StressInfluence(cells, STEEL).deviator(strain)
            left.append(-np.vdot(strain, stress) / (2 * STEEL.shear * np.vdot(strain, strain)))
            grid = Grid(0.0, 0.0, cells.dx, cells.dy, cells.nx, cells.ny)
            off.append(np.abs(SurfaceDisplacement(grid, cells.nz, cells.dz, STEEL)(strain) - fall).max())
        assert 0 < left[1] < 0.4 * left[0] < 0.2
        assert off[1] < 0.5 * off[0] < 0.25


def test_memory_is_said_before_it_is_taken():
    with pytest.raises(ContactInputError, match="GB"):
        StressInfluence(Cells(1e-4, 1e-4, 1e-4, 400, 400, 60), STEEL)
