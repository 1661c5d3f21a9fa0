"""The element kernels against a UFL statement of the same weak form, on distorted cells and beyond affine motion."""

import dataclasses

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from geometry.axes import as_tensor
from geometry.meshing.blocks import mesh_box
from geometry.meshing.hexmesh import HexMesh
from rail_fem.fe.blocks import ElementSettings
from tests.fe.bodies import NO_VISCOSITY, STEEL, distort, lame, place, plastic, structure_of
from tests.fe.weak_form import EXACT, Hourglass, WeakForm
from tests.order import assert_order

NO_HOURGLASS = ElementSettings(linear_viscosity=0.0, quadratic_viscosity=0.0, hourglass=0.0)
YIELD, HARDENING = 300e6, 2e9


def hourglass_modulus(steel) -> float:
    """As ElementSettings defines it: its fraction of 3.5 shear moduli [Pa]."""
    return NO_VISCOSITY.hourglass * 3.5 * steel.elastic.shear


def hooke(strain: np.ndarray) -> np.ndarray:
    lam, mu = lame(STEEL)
    return lam * np.trace(strain, axis1=-2, axis2=-1)[..., None, None] * np.eye(3) + 2 * mu * strain


def sym(matrix: np.ndarray) -> np.ndarray:
    return (matrix + np.swapaxes(matrix, -1, -2)) / 2


def swept_about_y() -> HexMesh:
    """Rings of 40 elements, more than an arc holds, about the origin; the four elements around a node that stands aside
    are in none."""
    box = mesh_box((2.0, 3.0, 20.0), (2, 3, 40))
    radius, angle = 30.0 + box.points[:, 0], (box.points[:, 2] + 0.01 * box.points[:, 2] ** 2) / 30.0
    points = np.column_stack([radius * np.sin(angle), box.points[:, 1], -radius * np.cos(angle)])
    points[np.argmin(np.abs(box.points - (1.0, 0.0, 2.5)).sum(axis=1))] += 0.1
    return dataclasses.replace(box, points=points)


@pytest.mark.parametrize(
    "mesh, in_rings",
    [(distort(mesh_box((3.0, 2.0, 2.0), (3, 2, 2)), 0.25, seed), 0) for seed in range(2)] + [(swept_about_y(), 236)],
)
def test_small_displacement_forces_are_those_of_the_weak_form_and_of_the_hourglass_part(mesh, in_rings):
    """Any displacement of any distorted cells, and of cells in rings, to round-off; and their elastic energy."""
    structure = structure_of(mesh, small=(0,), settings=NO_VISCOSITY)
    form, start = WeakForm(structure), structure.x.reshape(-1, 3).copy()
    u = 1e-3 * np.random.default_rng(0).standard_normal(start.shape)
    place(structure, start + u, 1.0)
    u = structure.x.reshape(-1, 3) - start
    stress = hooke(sym(form.mean_gradient(u)))
    hourglass = Hourglass(start, structure.domain.cells)
    q = hourglass_modulus(STEEL) * hourglass.stiffness[:, None, None] * hourglass.amplitudes(u)
    exact, size = form.forces(stress) + hourglass.forces(q), np.abs(start).max() / 3.0
    assert len(structure.small_cells) - structure.small.n_cells == in_rings
    assert np.abs(as_tensor(structure.small_stress()) - stress).max() < 1e-13 * size * np.abs(stress).max()
    assert np.abs(structure.force.reshape(-1, 3) + exact).max() < 1e-13 * size * np.abs(exact).max()
    assert abs(structure.elastic_energy()[1] / (0.5 * (exact * u).sum()) - 1) < 1e-13 * size
    assert np.abs(hourglass.forces(q)).max() > 0.01 * np.abs(exact).max()


def test_on_parallelepipeds_it_is_ufl_with_one_point_at_the_centre():
    """There the gradient at the centre is the mean one, whatever the displacement."""
    box = mesh_box((3.0, 2.0, 2.0), (3, 2, 2))
    skew = np.array([[1.0, 0.4, -0.2], [0.1, 0.9, 0.3], [-0.3, 0.2, 1.2]])
    structure = structure_of(dataclasses.replace(box, points=box.points @ skew.T), small=(0,), settings=NO_HOURGLASS)
    start = structure.x.reshape(-1, 3).copy()
    place(structure, start + 1e-3 * np.random.default_rng(3).standard_normal(start.shape), 1.0)
    exact = WeakForm(structure).elastic_forces(structure.x.reshape(-1, 3) - start, STEEL, 1)
    assert np.abs(structure.force.reshape(-1, 3) + exact).max() < 1e-12 * np.abs(exact).max()


def curved(points: np.ndarray) -> np.ndarray:
    """A smooth map of the unit cube to a body without a plane face."""
    x, y, z = points.T
    return np.column_stack([x + 0.15 * np.sin(2 * y + z), y + 0.15 * x * z, z + 0.12 * np.cos(x + 2 * y)])


def smooth(points: np.ndarray) -> np.ndarray:
    """A displacement of some 1e-4 [m] with all strains."""
    x, y, z = points.T
    return 1e-4 * np.column_stack([np.sin(x + 2 * y), np.cos(2 * z - x), x * y + z**2])


def curved_structure(count: int, settings: ElementSettings):
    box = mesh_box((1.0, 1.0, 1.0), (count,) * 3)
    return structure_of(dataclasses.replace(box, points=curved(box.points)), small=(0,), settings=settings)


def test_one_point_at_the_centre_by_ufl_and_the_mean_gradient_agree_to_second_order_on_curved_cells():
    """Their difference is a matter of the cells' shape, which straightens as h falls: h^2 in the energy."""
    counts, errors = np.array([4, 8, 16]), []
    for count in counts:
        structure = curved_structure(count, NO_HOURGLASS)
        start = structure.x.reshape(-1, 3).copy()
        place(structure, start + smooth(start), 1.0)
        u = structure.x.reshape(-1, 3) - start
        centre = WeakForm(structure).elastic_forces(u, STEEL, 1)
        energy = -(structure.force.reshape(-1, 3) * u).sum()
        errors.append((centre * u).sum() / energy - 1)
    assert_order(1 / counts, errors, expected=2)


def test_the_hourglass_part_of_a_smooth_field_vanishes_with_second_order():
    counts, shares = np.array([4, 8, 16]), []
    for count in counts:
        energies = []
        for settings in (NO_VISCOSITY, NO_HOURGLASS):
            structure = curved_structure(count, settings)
            start = structure.x.reshape(-1, 3).copy()
            place(structure, start + smooth(start), 1.0)
            energies.append(-(structure.force @ (structure.x - start.ravel())))
        shares.append(energies[0] / energies[1] - 1)
    assert_order(1 / counts, shares, expected=2)


def test_a_curved_body_at_rest_converges_to_the_fully_integrated_weak_form():
    """All of its surface displaced by a smooth field: what the inside does by the one-point element, hourglass control
    and all, against UFL with three points along each edge on the same meshes; the difference falls with h^2."""
    counts, errors = np.array([3, 6, 12]), []
    for count in counts:
        structure = curved_structure(count, NO_VISCOSITY)
        form, start = WeakForm(structure), structure.x.reshape(-1, 3).copy()
        number = np.stack(np.unravel_index(structure.domain.node_input, (count + 1,) * 3), axis=1)
        inside = np.repeat(((number > 0) & (number < count)).all(axis=1), 3)
        force = form.elastic_force_form(STEEL, EXACT)
        answers = [
            solved(multiply, smooth(start).ravel(), inside)
            for multiply in (
                structure.stiffness_times,
                lambda vector, form=form, force=force: form.assembled(force, vector.reshape(-1, 3)).ravel(),
            )
        ]
        errors.append(np.linalg.norm(answers[0] - answers[1]) / np.linalg.norm(answers[1]))
    assert_order(1 / counts, errors, expected=2)


def solved(multiply, displacement: np.ndarray, free: np.ndarray) -> np.ndarray:
    """What a given displacement (3 n,) changes by at its free entries where no force is left there, by conjugate
    gradients."""
    change, residual = np.zeros(len(free)), np.where(free, -multiply(displacement), 0.0)
    direction, square = residual.copy(), residual @ residual
    first = square
    while square > 1e-20 * first:
        product = np.where(free, multiply(direction), 0.0)
        length = square / (direction @ product)
        change, residual = change + length * direction, residual - length * product
        before, square = square, residual @ residual
        direction = residual + square / before * direction
    return change


def twist(points: np.ndarray, t: float) -> np.ndarray:
    """A path of nodes, t from 0 to 1: turned by 1 rad, sheared, squeezed by 20 %, and bent as no affine map does."""
    x, y, z = points.T
    c, s = np.cos(t), np.sin(t)
    bent = np.column_stack(
        [x * (1 + 0.1 * t * y * z), y * (1 - 0.2 * t) + 0.15 * t * x * z, z + 0.2 * t * x + 0.1 * t * y * x]
    )
    return bent @ np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]).T


def plastic_block(seed: int, hourglass: ElementSettings = NO_VISCOSITY):
    mesh = distort(mesh_box((2.0, 2.0, 1.0), (2, 2, 1)), 0.15, seed)
    return structure_of(mesh, plastic(STEEL, YIELD, HARDENING), settings=hourglass)


def hughes_winget(spin: np.ndarray, dt: float) -> np.ndarray:
    return np.linalg.solve(np.eye(3) - dt / 2 * spin, np.eye(3) + dt / 2 * spin)


class J2ByTensors:
    """The law of rail_fem.fe.hexahedron with matrices, its gradients and forces by UFL on the deformed body."""

    def __init__(self, structure):
        cells = structure.domain.m_global
        self.form, self.cells, self.x = WeakForm(structure), structure.domain.cells, structure.x.reshape(-1, 3).copy()
        self.stress, self.p = np.zeros((cells, 3, 3)), np.zeros(cells)
        self.q = np.zeros((cells, 3, 4))

    def step(self, x: np.ndarray, dt: float) -> np.ndarray:
        """Move the nodes to x (n, 3) in dt; internal forces (n, 3)."""
        v, self.x = (x - self.x) / dt, x
        self.form.move_to(x)
        end = self.form.mean_gradient(v)
        middle = end @ np.linalg.inv(np.eye(3) - dt / 2 * end)
        rate, spin = sym(middle), middle - sym(middle)
        turn = hughes_winget(spin, dt)
        back = np.swapaxes(turn, 1, 2)
        half = dt / 2 * hooke(rate)
        trial = turn @ (self.stress + half) @ back + half
        pressure = np.trace(trial, axis1=1, axis2=2)[:, None, None] / 3 * np.eye(3)
        von_mises = np.sqrt(1.5 * ((trial - pressure) ** 2).sum(axis=(1, 2)))
        shear = STEEL.elastic.shear
        dp = np.maximum(von_mises - YIELD - HARDENING * self.p, 0) / (3 * shear + HARDENING)
        kept = (1 - 3 * shear * dp / von_mises)[:, None, None]
        hourglass = Hourglass(x, self.cells)
        grown = dt * hourglass_modulus(STEEL) * hourglass.stiffness[:, None, None] * hourglass.amplitudes(v)
        self.stress, self.p, self.q = kept * (trial - pressure) + pressure, self.p + dp, kept * (turn @ self.q + grown)
        return self.form.forces(self.stress) + hourglass.forces(self.q)


@pytest.mark.parametrize("seed", range(2))
def test_finite_strain_and_j2_are_those_of_tensors_and_the_weak_form_on_the_deformed_body(seed):
    """40 steps to a rotation of 1 rad and plastic strains of 20 %: stress, plastic strain, forces to round-off."""
    structure = plastic_block(seed)
    exact, start, dt = J2ByTensors(structure), structure.x.reshape(-1, 3).copy(), 1e-5
    for t in np.arange(1, 41) / 40:
        place(structure, twist(start, t), dt)
        force = exact.step(twist(start, t), dt)
    assert 0.1 < exact.p.min() and exact.p.max() < 0.6
    assert np.abs(as_tensor(structure.finite.stress()) - exact.stress).max() < 1e-10 * np.abs(exact.stress).max()
    assert np.abs(structure.finite.plastic_strain() - exact.p).max() < 1e-11 * exact.p.max()
    assert np.abs(structure.force.reshape(-1, 3) + force).max() < 1e-10 * np.abs(force).max()


def continuous_j2(structure, start: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Stress (m, 3, 3) and plastic strain (m,) at the end of the path by the law's differential equations (Jaumann's
    rate, associated flow), each cell elastic until its von Mises stress reaches yield; UFL gives the gradients."""
    form, eps, shear = WeakForm(structure), 1e-6, STEEL.elastic.shear
    cells = structure.domain.m_global

    def gradient(t):
        form.move_to(twist(start, t))
        return form.mean_gradient((twist(start, t + eps) - twist(start, t - eps)) / (2 * eps))

    def rates(t, state, plastic_cell, cell):
        stress, l = state[:9].reshape(3, 3), gradient(t)[cell]
        rate, spin = sym(l), l - sym(l)
        flow, dp = np.zeros((3, 3)), 0.0
        if plastic_cell:
            deviator = stress - np.trace(stress) / 3 * np.eye(3)
            von_mises = np.sqrt(1.5 * (deviator**2).sum())
            dp = 3 * shear * (deviator * rate).sum() / von_mises / (3 * shear + HARDENING)
            flow = 1.5 * dp * deviator / von_mises
        return np.append((hooke(rate - flow) + spin @ stress - stress @ spin).ravel(), dp)

    def excess(t, state, plastic_cell, cell):
        s = state[:9].reshape(3, 3)
        deviator = s - np.trace(s) / 3 * np.eye(3)
        return np.sqrt(1.5 * (deviator**2).sum()) - YIELD

    excess.terminal, excess.direction = True, 1
    stress, p = np.empty((cells, 3, 3)), np.empty(cells)
    exact = {"rtol": 1e-9, "atol": 1.0}
    for cell in range(cells):
        elastic = solve_ivp(rates, (0, 1), np.zeros(10), events=excess, args=(False, cell), **exact)
        assert elastic.status == 1
        found = solve_ivp(rates, (elastic.t[-1], 1), elastic.y[:, -1], args=(True, cell), **exact)
        stress[cell], p[cell] = found.y[:9, -1].reshape(3, 3), found.y[9, -1]
    return stress, p


def test_finite_strain_j2_converges_to_the_law_s_differential_equations():
    """Radial return takes the direction of flow at the end of the step: first order in it, stress and plastic strain
    (which is by far the nearer)."""
    structure = plastic_block(5)
    start = structure.x.reshape(-1, 3).copy()
    stress, p = continuous_j2(structure, start)
    steps, errors = np.array([50, 100, 200, 400]), []
    for count in steps:
        body = plastic_block(5)
        for t in np.arange(1, count + 1) / count:
            place(body, twist(start, t), 1e-3 / count)
        errors.append(np.abs(as_tensor(body.finite.stress()) - stress).max() / YIELD)
    assert_order(1 / steps, errors, expected=1)
