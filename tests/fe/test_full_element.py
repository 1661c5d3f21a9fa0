"""The fully integrated element against its weak form by quadrature, exact solutions and the first element."""

import numpy as np
import pytest

from geometry.meshing.blocks import mesh_box
from rail_fem.fe.blocks import ElementSettings
from rail_fem.fe.dynamics import Dynamics
from rail_fem.fe.state import HOURGLASS_WORK
from tests.fe.bodies import STEEL, dense_stiffness, distort, lame, momentum, place, plastic, structure_of
from tests.fe.test_hexahedron import CORNERS
from tests.fe.test_locking import bent, punch_load
from tests.fe.test_rigid_motion import rotation
from tests.fe.test_taylor_bar import fly, mushroom
from tests.order import assert_order

FULL = ElementSettings(element="full")
QUIET = ElementSettings(element="full", linear_viscosity=0.0, quadratic_viscosity=0.0)


def mean_dilatation_stiffness(corners):
    """(24, 24) of one cell: sum over Gauss points of Bbar^T D Bbar |J|, Bbar = B with its divergence replaced by the
    volume mean (Hughes, The Finite Element Method, 1987, section 4.5), with tensors instead of the kernel's modes."""
    lam, mu = lame(STEEL)
    gradients, volumes = [], []
    for point in CORNERS / np.sqrt(3):
        factors = 1 + CORNERS * point
        local = np.stack([CORNERS[:, k] * np.delete(factors, k, axis=1).prod(axis=1) / 8 for k in range(3)], axis=1)
        jacobian = corners.T @ local
        gradients.append(local @ np.linalg.inv(jacobian))
        volumes.append(np.linalg.det(jacobian))
    mean = np.average(gradients, axis=0, weights=volumes)
    stiffness = np.zeros((24, 24))
    for gradient, volume in zip(gradients, volumes):
        strains = []
        for node in range(8):
            for axis in range(3):
                g = np.zeros((3, 3))
                g[axis] = gradient[node]
                strains.append((g + g.T) / 2 + np.eye(3) * (mean - gradient)[node, axis] / 3)
        stresses = [lam * np.trace(s) * np.eye(3) + 2 * mu * s for s in strains]
        stiffness += volume * np.tensordot(np.array(strains), np.array(stresses), axes=((1, 2), (1, 2)))
    return stiffness


@pytest.mark.parametrize("seed", range(3))
def test_stiffness_of_a_distorted_cell_is_that_of_quadrature_and_only_rigid_motions_are_free(seed):
    structure = structure_of(distort(mesh_box((1.0, 1.0, 1.0), (1, 1, 1)), 0.2, seed), settings=QUIET)
    found = dense_stiffness(structure, np.ones(24, bool))
    cell = structure.domain.cells[0]
    order = (3 * cell[:, None] + np.arange(3)).ravel()
    exact = mean_dilatation_stiffness(structure.x.reshape(-1, 3)[cell])
    assert np.abs(found[np.ix_(order, order)] - exact).max() < 1e-6 * np.abs(exact).max()  # steps of 1e-9, quadratic
    stiff = np.linalg.eigvalsh((found + found.T) / 2) / np.abs(exact).max()
    assert (np.abs(stiff[:6]) < 1e-6).all() and stiff[6] > 1e-3


@pytest.mark.parametrize("steel", [STEEL, plastic(STEEL, 300e6, 2e9)], ids=["elastic", "plastic"])
def test_an_affine_motion_gives_the_stress_and_forces_of_the_one_point_element(steel):
    mesh, motion = distort(mesh_box((1.0, 1.0, 1.0), (2, 2, 2)), 0.1, 1), np.eye(3)
    motion += [[0.001, 0.002, 0.0], [0.0, -0.002, 0.001], [0.003, 0.0, 0.002]]
    forces = []
    for element in ("one-point", "full"):
        structure = structure_of(mesh, steel, settings=ElementSettings(element=element, quadratic_viscosity=0.0))
        for _ in range(3):
            place(structure, structure.x.reshape(-1, 3) @ motion.T, 1e-3)
        forces.append((structure.finite.stress(), structure.finite.plastic_strain(), structure.force.copy()))
    for one, full in zip(*forces):
        assert np.abs(one - full).max() <= 1e-11 * np.abs(one).max()
    assert steel.is_elastic or forces[1][1].min() > 1e-3


@pytest.mark.parametrize("kind", ["elastic", "isotropic", "kinematic"])
def test_nodal_forces_do_the_work_that_the_points_book(kind):
    """Of a random motion: change of elastic energy + plastic + viscous work, and no hourglass work."""
    steel = STEEL if kind == "elastic" else plastic(STEEL, 300e6, 20e9)
    if kind == "kinematic":
        steel = type(steel)(**(steel.__dict__ | {"hardening": "kinematic"}))
    structure = structure_of(distort(mesh_box((1.0, 1.0, 1.0), (2, 2, 2)), 0.12, 3), steel, settings=QUIET)
    rng, dt = np.random.default_rng(3), 1e-6
    shape = (structure.domain.n_nodes, 3)
    towards = rng.standard_normal(shape)
    for _ in range(20):
        place(structure, structure.x.reshape(-1, 3) + 1e-4 * towards, dt)
    energy, work = structure.elastic_energy()[0], structure.work.sum()
    before = structure.force.copy()
    place(structure, structure.x.reshape(-1, 3) + 1e-7 * towards, dt)
    booked = structure.elastic_energy()[0] - energy + structure.work.sum() - work
    # trapezoidal rule; stresses whose volume changes miss terms of the order of the strain, 2e-3
    assert -dt * 0.5 * (before + structure.force) @ structure.v == pytest.approx(booked, rel=5e-3)
    assert structure.work[HOURGLASS_WORK] == 0.0 and (structure.work[0] > 0) == (kind != "elastic")


def test_turns_strain_nothing_and_a_free_body_keeps_its_momentum():
    structure = structure_of(
        distort(mesh_box((0.03, 0.02, 0.02), (3, 2, 2)), 1e-3, 4), plastic(STEEL, 300e6), settings=FULL
    )
    start, axis = structure.x.reshape(-1, 3).copy(), np.array([1.0, 2.0, -0.5])
    for n in range(1, 100):
        place(structure, start @ rotation(axis, 0.3 * n).T, 1e-7)
    assert np.abs(structure.finite.stress()).max() < 1e-10 * STEEL.youngs_modulus
    assert structure.finite.plastic_strain().max() == 0.0
    structure.v.reshape(-1, 3)[:] = 40 * np.random.default_rng(3).standard_normal((structure.domain.n_nodes, 3))
    structure.force[:] = 0.0
    dynamics = Dynamics(structure)
    dt, (linear, angular) = 0.5 * dynamics.stable_step(), momentum(structure)
    for _ in range(500):
        dynamics.step(dt)
    assert np.abs(momentum(structure)[0] - linear).max() < 1e-12 * np.abs(linear).max()
    assert np.abs(momentum(structure)[1] - angular).max() < 1e-10 * np.abs(angular).max()
    assert structure.finite.plastic_strain().max() > 0.01


@pytest.mark.parametrize("poisson", [pytest.param(0.3, marks=pytest.mark.validate), 0.4999])
def test_pure_bending_converges_with_second_order_for_any_poissons_ratio(poisson):
    """Exact curvature M (1 - nu^2) / (E I), as the one-point element is held to."""
    cells = np.array([2, 4, 8])
    errors = [bent(poisson, n, settings=QUIET) - 1 for n in cells]
    assert abs(errors[1]) < 0.04 and abs(errors[2]) < 0.01
    assert_order(1 / cells, errors, expected=2)


def test_fully_plastic_flow_under_a_punch_stops_at_prandtls_load():
    """(2 + pi) k, as the one-point element; an element that locked would go on rising."""
    before, after = punch_load(8, settings=FULL)
    assert after == pytest.approx(before, rel=0.02)
    assert 1.0 < after < 1.06


def test_a_taylor_bar_spreads_and_shortens_as_published():
    structure, before, after = fly(3, 2, 24, settings=FULL)
    radius, length = mushroom(structure)
    assert radius == pytest.approx(7.22e-3, rel=0.02)
    assert length == pytest.approx(21.43e-3, rel=0.01)
    assert after["hourglass"] == 0.0
    assert after["balance"] == pytest.approx(before["balance"], rel=0.01)
