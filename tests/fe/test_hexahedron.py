"""The element kernels against quadrature, closed forms and each other."""

import numpy as np
import pytest

from geometry.meshing.blocks import mesh_box
from rail_fem.fe.blocks import ElementSettings
from rail_fem.fe.elastic import N_FIXED
from rail_fem.fe.hexahedron import volumes
from rail_fem.fe.state import LANES, VISCOUS_WORK
from tests.fe.bodies import NO_VISCOSITY, STEEL, distort, lame, place, plastic, structure_of
from tests.order import assert_order

CORNERS = np.array([[-1, -1, -1], [1, -1, -1], [1, 1, -1], [-1, 1, -1], [-1, -1, 1], [1, -1, 1], [1, 1, 1], [-1, 1, 1]])


def quadrature(corners):
    """Integral of the shape functions' gradient (8, 3) and of 1, by 2x2x2 Gauss points: exact, the integrands are
    quadratic in each variable."""
    gradient, volume = np.zeros((8, 3)), 0.0
    for point in CORNERS / np.sqrt(3):
        factors = 1 + CORNERS * point
        local = np.stack([CORNERS[:, k] * np.delete(factors, k, axis=1).prod(axis=1) / 8 for k in range(3)], axis=1)
        jacobian = corners.T @ local
        gradient += np.linalg.det(jacobian) * local @ np.linalg.inv(jacobian)
        volume += np.linalg.det(jacobian)
    return gradient, volume


@pytest.mark.parametrize("seed", range(3))
def test_mean_gradient_and_volume_are_those_of_gauss_quadrature(seed):
    mesh = distort(mesh_box((3.0, 2.0, 2.0), (3, 2, 2)), 0.25, seed)
    structure = structure_of(mesh, small=(0,))
    fixed = structure.geometry.reshape(-1, N_FIXED, LANES)
    found = volumes(structure.x, structure.domain.cells)
    for lane, cell in enumerate(structure.small.cell_of[: structure.small.n_cells]):
        gradient, volume = quadrature(structure.x.reshape(-1, 3)[structure.domain.cells[cell]])
        xi, eta, zeta = CORNERS.T
        mode = np.stack([xi, eta, zeta, eta * zeta, zeta * xi, xi * eta])
        assert np.abs(mode.T @ fixed[0, :18, lane].reshape(6, 3) - gradient).max() < 1e-13
        assert abs(found[cell] / volume - 1) < 1e-13


@pytest.mark.parametrize("cells", [1, LANES - 1, LANES, LANES + 1, 3 * LANES])
def test_forces_do_not_depend_on_how_elements_fill_the_blocks(cells):
    """A row of equal cells under one affine motion: every cell gives the stress of a single one."""
    structure = structure_of(mesh_box((float(cells), 1.0, 1.0), (cells, 1, 1)), plastic(STEEL, 300e6))
    motion = np.array([[1.001, 0.002, 0.0], [0.0, 0.998, 0.001], [0.003, 0.0, 1.002]])
    place(structure, structure.x.reshape(-1, 3) @ motion.T, 1e-7)
    alone = structure_of(mesh_box((1.0, 1.0, 1.0), (1, 1, 1)), plastic(STEEL, 300e6))
    place(alone, alone.x.reshape(-1, 3) @ motion.T, 1e-7)
    # stresses of 1e9 Pa from differences of coordinates of up to `cells`
    assert np.abs(structure.finite.stress() - alone.finite.stress()).max() < 1e-15 * cells * 1e3 * 1e9
    assert np.abs(structure.force.reshape(-1, 3).sum(axis=0)).max() < 1e-13 * np.abs(structure.force).max() * cells


def stored_energy(structure):
    """By Hooke's law from stresses and volumes, independently of the kernel's own."""
    stress, young, poisson = structure.finite.stress(), STEEL.youngs_modulus, STEEL.poisson
    density = (
        (1 + poisson) * ((stress[:, :3] ** 2).sum(axis=1) + 2 * (stress[:, 3:] ** 2).sum(axis=1))
        - poisson * stress[:, :3].sum(axis=1) ** 2
    ) / (2 * young)
    energy = density @ volumes(structure.x, structure.domain.cells)
    assert structure.elastic_energy()[0] == pytest.approx(energy, rel=1e-12)
    return energy


@pytest.mark.parametrize("seed", range(3))
def test_nodal_forces_do_the_work_that_the_element_books(seed):
    """Work of the internal forces = change of elastic energy + hourglass work + viscous work."""
    structure = structure_of(distort(mesh_box((1.0, 1.0, 1.0), (2, 2, 2)), 0.12, seed))
    rng, dt = np.random.default_rng(seed), 1e-6
    for _ in range(3):
        place(structure, structure.x.reshape(-1, 3) + 1e-4 * rng.standard_normal((structure.domain.n_nodes, 3)), dt)
    energy, work = stored_energy(structure), structure.work.sum()
    place(structure, structure.x.reshape(-1, 3) + 1e-9 * rng.standard_normal((structure.domain.n_nodes, 3)), dt)
    booked = stored_energy(structure) - energy + structure.work.sum() - work
    # the energy of a stress whose volume changes misses terms of the order of the strain, 3e-4
    assert -dt * structure.force @ structure.v == pytest.approx(booked, rel=1e-3)


@pytest.mark.parametrize("rate", [-50.0, 50.0], ids=["squeezed", "stretched"])
def test_quadratic_viscosity_pushes_back_where_a_cube_is_squeezed_and_is_silent_where_it_is_stretched(rate):
    """Von Neumann and Richtmyer: q = rho (c h rate)^2 against the face that comes nearer, its work q |rate| V dt lost;
    c = 1.2."""
    side, dt, factor = 0.5, 1e-6, 1.2
    faces, works = [], []
    for settings in (NO_VISCOSITY, ElementSettings(linear_viscosity=0.0, quadratic_viscosity=factor)):
        structure = structure_of(mesh_box((side, side, side), (1, 1, 1)), settings=settings)
        place(structure, structure.x.reshape(-1, 3) * [1 + rate * dt, 1.0, 1.0], dt)
        far = structure.x.reshape(-1, 3)[:, 0] > side / 2
        faces.append(structure.force.reshape(-1, 3)[far, 0].sum())
        works.append(structure.work[VISCOUS_WORK])
    q = STEEL.density * (factor * side * rate) ** 2 if rate < 0 else 0.0
    assert faces[1] - faces[0] == pytest.approx(q * side**2, rel=1e-3, abs=1e-6)  # strains of 5e-5
    assert works == pytest.approx([0.0, q * abs(rate) * side**3 * dt], rel=1e-3)


def shear_error(steps, total=1.0):
    """Largest error of the stress along a simple shear x = X + g Y in equal steps, in shear moduli."""
    structure, error = structure_of(mesh_box((1.0, 1.0, 1.0), (1, 1, 1)), settings=NO_VISCOSITY), 0.0
    start = structure.x.reshape(-1, 3).copy()
    for g in total * np.arange(1, steps + 1) / steps:
        place(structure, start + g * start[:, [1]] * [1.0, 0.0, 0.0], 1e-6)
        xx, yy, xy = structure.finite.stress()[0, [0, 1, 5]] / STEEL.elastic.shear
        error = max(error, abs(xy - np.sin(g)), abs(xx - (1 - np.cos(g))), abs(yy + 1 - np.cos(g)))
    return error


def test_simple_shear_converges_to_the_jaumann_solution_with_second_order():
    """Exact for the Jaumann rate: shear stress G sin g, normal stresses +-G (1 - cos g) (Dienes, Acta Mech. 32 (1979)
    217)."""
    steps = np.array([5, 10, 20, 40])
    assert_order(1 / steps, [shear_error(n) for n in steps], expected=2)


def test_the_small_displacement_kernel_is_the_limit_of_the_finite_one():
    """The same displacement field scaled down: the difference of the forces, over the forces, falls in proportion to
    the strain."""
    scales, errors = np.array([1e-3, 5e-4, 2.5e-4]), []
    mesh = distort(mesh_box((1.0, 1.0, 1.0), (2, 2, 2)), 0.1, 1)
    field = np.random.default_rng(2).standard_normal(mesh.points.shape)
    for scale in scales:
        forces = []
        for small in ((), (0,)):
            structure = structure_of(mesh, settings=NO_VISCOSITY, small=small)
            place(structure, structure.x.reshape(-1, 3) + scale * field[structure.domain.node_input], 1.0)
            forces.append(structure.force.copy())
        errors.append(np.linalg.norm(forces[0] - forces[1]) / np.linalg.norm(forces[1]))
    assert_order(scales, errors, expected=1)


def test_stress_of_an_elastic_step_is_hookes():
    """Uniaxial strain of 1e-9 in one step: lambda + 2 mu along, lambda across, to the strain's own size."""
    structure = structure_of(mesh_box((1.0, 1.0, 1.0), (1, 1, 1)), settings=NO_VISCOSITY)
    strain = 2.0**-20
    place(structure, structure.x.reshape(-1, 3) * [1 + strain, 1.0, 1.0], 1.0)
    lam, mu = lame(STEEL)
    exact = 2 * strain / (2 + strain) * np.array([lam + 2 * mu, lam, lam, 0, 0, 0])
    assert np.abs(structure.finite.stress()[0] - exact).max() < 1e-9 * exact[0]
