"""Central differences: their order, the stable step, and what happens just above it."""

from types import SimpleNamespace

import numpy as np
import pytest

from geometry.meshing.blocks import mesh_box
from rail_fem.fe.blocks import ElementSettings
from rail_fem.fe.dynamics import Dynamics
from rail_fem.fe.hexahedron import volumes
from rail_fem.fe.run import Run
from rail_fem.fe.stable_step import damped_limit, largest_frequency, round_down
from rail_fem.fe.supports import Link, RigidGroup, Supports
from rail_fem.scene.steel import Steel
from tests.fe.bodies import NO_VISCOSITY, STEEL, dense_stiffness, distort, plastic, structure_of
from tests.order import assert_order


def test_a_spring_and_mass_converge_with_second_order():
    """x'' = -w^2 x; exact x = cos(w t). The velocity that a step starts from lies half a step back."""
    mass, stiffness, start, periods = 2.0, 1e6, 1e-3, 1.3
    frequency, errors, steps = np.sqrt(stiffness / mass), [], np.array([40, 80, 160, 320])
    for count in steps:
        structure = structure_of(mesh_box((0.01, 0.01, 0.01), (1, 1, 1)))
        dt = periods * 2 * np.pi / frequency / count
        body = RigidGroup("mass", np.arange(8), free=(False, False, True), displacement=np.array([0.0, 0.0, start]))
        dynamics = Dynamics(structure, Supports([body], [Link("spring", body, None, stiffness, 0.0)]))
        body.added_mass = mass - body.node_mass
        body.velocity[2] = frequency * start * np.sin(frequency * dt / 2)
        for _ in range(count):
            dynamics.step(dt)
        errors.append(body.displacement[2] / start - np.cos(periods * 2 * np.pi))
    assert_order(1 / steps, errors, expected=2)


@pytest.mark.parametrize("dt", [1e-5, 1e-3])
def test_a_damper_books_what_the_masses_lose(dt):
    """Two masses in flight and a damper between them, steps of 0.1 and 10 % of its time: kinetic energy and loss add up
    to round-off, momentum stays."""
    left, right = (
        RigidGroup(name, np.empty(0, int), mass, (False, False, True), velocity=np.array([0.0, 0.0, v]))
        for name, mass, v in (("left", 2.0, 3.0), ("right", 5.0, -1.0))
    )
    link = Link("damper", left, right, 0.0, 100.0)
    supports = Supports([left, right], [link])
    start = supports.energies()["lumped_kinetic"]
    for _ in range(20):
        supports.advance(np.zeros((2, 3)), dt)
        energies = supports.energies()
        assert energies["lumped_kinetic"] + energies["dampers"] == pytest.approx(start, rel=1e-14)
    assert 2.0 * left.velocity[2] + 5.0 * right.velocity[2] == pytest.approx(1.0, rel=1e-13)
    assert energies["dampers"] > 1e-2


def test_an_elastic_body_converges_with_second_order():
    """A standing wave that is an eigenvector of the mesh: exact u = cos(w t), w from its Rayleigh quotient."""
    errors, steps = [], np.array([20, 40, 80])
    for count in steps:
        structure = structure_of(mesh_box((1.0, 0.1, 0.1), (10, 1, 1)), settings=NO_VISCOSITY, small=(0,))
        shape = np.cos(np.pi * structure.x.reshape(-1, 3)) * [1.0, 0.0, 0.0]
        fixed = np.ones(shape.shape, bool)
        fixed[:, 0] = False
        shape, weight = shape.ravel(), np.repeat(structure.mass, 3)
        frequency = np.sqrt(shape @ structure.stiffness_times(shape) / (shape @ (weight * shape)))
        dynamics = Dynamics(structure, fixed=fixed)
        dt = 1.3 * 2 * np.pi / frequency / count
        structure.x += 1e-6 * shape
        structure.v[:] = 1e-6 * frequency * np.sin(frequency * dt / 2) * shape
        structure.add_internal_force(dt)
        for _ in range(count):
            dynamics.step(dt)
        amplitude = (structure.x - structure.domain.reference) @ (weight * shape) / (shape @ (weight * shape)) / 1e-6
        errors.append(amplitude - np.cos(1.3 * 2 * np.pi))
    assert_order(1 / steps, errors, expected=2)


def dense_frequency(structure, free):
    """Root of the largest eigenvalue of M^-1 K [rad/s]."""
    stiffness, root = dense_stiffness(structure, free), np.sqrt(np.repeat(structure.mass, 3)[free])
    return np.sqrt(np.linalg.eigvalsh((stiffness + stiffness.T) / 2 / root[:, None] / root)[-1])


@pytest.mark.parametrize("small", [(), (0,)], ids=["finite strain", "small displacement"])
@pytest.mark.parametrize("amount", [0.0, 0.15, 0.3])
def test_the_largest_frequency_is_that_of_the_assembled_operator(amount, small):
    mesh = distort(mesh_box((4.0, 3.0, 3.0), (4, 3, 3)), amount, 5)
    structure = structure_of(mesh, small=small)
    free = np.ones(3 * structure.domain.n_nodes, bool)
    free[:12] = False
    exact = dense_frequency(structure, free)
    # Lanczos approaches from below
    assert 0.99 * exact <= largest_frequency(structure, free) <= exact * (1 + 1e-9)


def test_the_stable_step_of_a_cube_of_steel_is_that_of_its_dilatational_wave():
    """A row of cubes between frictionless walls: 2 / w = h / c_d exactly, at the mode whose neighbours move
    oppositely."""
    structure = structure_of(mesh_box((0.02, 1e-3, 1e-3), (20, 1, 1)))
    free = np.zeros((structure.domain.n_nodes, 3), bool)
    free[:, 0] = True
    assert 2 / largest_frequency(structure, free.ravel()) == pytest.approx(1e-3 / STEEL.wave_speed, rel=0.01)


def total_energy(dynamics, dt):
    """All energy in the body and all that it lost [J]; the kinetic part as v(-1/2) . v(+1/2), which belongs to the time
    of the positions."""
    structure = dynamics.structure
    middle = structure.kinetic_energy() + 0.5 * dt * structure.force @ structure.v
    return middle + sum(structure.elastic_energy()) + structure.work.sum()


def test_central_differences_keep_the_energy_of_a_linear_body_exactly():
    """The invariant of the scheme below its limit: M v- v+ / 2 + u K u / 2, to round-off over 2000 steps."""
    structure = structure_of(distort(mesh_box((6e-3, 5e-3, 5e-3), (6, 5, 5)), 1e-4, 6), small=(0,))
    structure.v[:] = np.random.default_rng(0).standard_normal(len(structure.v))
    dynamics = Dynamics(structure)
    dt = 0.999 * damped_limit(largest_frequency(structure, dynamics.moving, iterations=100), 0.0)
    dynamics.step(dt)
    start = total_energy(dynamics, dt)
    for _ in range(2000):
        dynamics.step(dt)
    assert total_energy(dynamics, dt) == pytest.approx(start, rel=1e-9)


def energy_growth(courant, steps, speed, steel, viscosity):
    """Largest change of the total energy over the starting one, of a shaken distorted block, for steps of `courant`
    times the critical one."""
    settings = ElementSettings(linear_viscosity=viscosity, quadratic_viscosity=20 * viscosity)
    structure = structure_of(distort(mesh_box((6e-3, 5e-3, 5e-3), (6, 5, 5)), 1e-4, 6), steel, settings=settings)
    structure.v.reshape(-1, 3)[:] = speed * np.sin(np.pi * structure.x.reshape(-1, 3)[:, ::-1] / 6e-3)
    dynamics = Dynamics(structure)
    dt = courant * damped_limit(largest_frequency(structure, dynamics.moving, iterations=100), viscosity)
    start, change = structure.kinetic_energy(), 0.0
    for _ in range(steps):
        dynamics.step(dt)
        change = max(change, abs(total_energy(dynamics, dt) / start - 1))
        if change > 10:
            break
    return change


MATERIALS = pytest.mark.parametrize("steel", [STEEL, plastic(STEEL, 310e6, 2e9)], ids=["elastic", "plastic"])
VISCOSITY = pytest.mark.parametrize("viscosity", [0.0, 0.06])


@MATERIALS
@VISCOSITY
def test_below_the_critical_step_the_energy_balance_holds(steel, viscosity):
    """Bulk viscosity takes up to 2 % more of the step than its damping ratio in one dimension: 0.97 here, and courant
    0.9 by default.

    Its work is booked with the velocity half a step back, a tenth too much for motion on the mesh's own scale.
    """
    assert energy_growth(0.97, 1000, 1.0, steel, viscosity) < (0.1 if viscosity else 1e-4)


@MATERIALS
@VISCOSITY
@pytest.mark.parametrize("speed", [1e-3, 10.0])
def test_one_percent_above_the_critical_step_breaks_the_energy_balance_within_50_steps(steel, viscosity, speed):
    """Amplification 1.3 a step: 50 of them multiply the highest mode's energy by 1e12, the smooth start holds 1e-5 of
    it or more."""
    assert energy_growth(1.01, 50, speed, steel, viscosity) > 0.1


@MATERIALS
@pytest.mark.parametrize("speed", [1e-3, 10.0])
def test_one_percent_above_the_critical_step_stops_at_the_check_after_50_steps(steel, speed):
    structure = structure_of(
        distort(mesh_box((6e-3, 5e-3, 5e-3), (6, 5, 5)), 1e-4, 6),
        steel,
        settings=ElementSettings(linear_viscosity=0.0, quadratic_viscosity=0.0),
    )
    structure.v.reshape(-1, 3)[:] = speed * np.sin(np.pi * structure.x.reshape(-1, 3)[:, ::-1] / 6e-3)
    limit = damped_limit(largest_frequency(structure, np.ones(len(structure.v), bool), iterations=100), 0.0)
    for courant in (0.97, 1.01):
        dynamics = Dynamics(structure)
        for _ in range(50):
            dynamics.step(courant * limit)
        if courant < 1:
            dynamics.check()
    with pytest.raises(ArithmeticError, match="step 50, .*(energy balance changed|inside out|not finite)"):
        dynamics.check()


def test_a_run_that_blows_up_stops_with_step_time_and_reason():
    structure = structure_of(mesh_box((6e-3, 5e-3, 5e-3), (6, 5, 5)))
    structure.v[:] = np.random.default_rng(0).standard_normal(len(structure.v))
    dynamics = Dynamics(structure)
    dt = 2 * dynamics.stable_step(1.0)
    with pytest.raises(ArithmeticError, match=r"step \d+, t = .* ms: .*(inside out|not finite|energy balance)"):
        for _ in range(100):
            dynamics.step(dt)
            dynamics.check()


def test_what_a_damped_body_loses_is_booked_as_its_damping():
    """A shaken small-displacement body: kinetic and elastic energy and the damping's loss add up to the start, and the
    loss is most of it in the end."""
    structure = structure_of(mesh_box((6e-3, 5e-3, 5e-3), (6, 5, 5)), small=(0,))
    structure.v[:] = 1e-3 * np.random.default_rng(0).standard_normal(len(structure.v))
    dynamics = Dynamics(structure)
    dt = dynamics.stable_step()
    dynamics.step(dt)
    first = dynamics.energies()
    start = first["kinetic"] + first["elastic"] + first["wheel_damping"]
    for _ in range(400):
        dynamics.step(dt)
    last = dynamics.energies()
    assert last["kinetic"] + last["elastic"] + last["wheel_damping"] == pytest.approx(start, rel=1e-9)
    assert last["wheel_damping"] > 0.5 * start


def test_the_wheels_damping_keeps_its_promised_share_of_the_step():
    """Kelvin-Voigt damping of ratio z at the highest frequency: the damped limit is stable, 3 % beyond it is not."""
    grown = []
    for courant in (0.99, 1.03):
        structure = structure_of(mesh_box((6e-3, 5e-3, 5e-3), (6, 5, 5)), small=(0,))
        structure.v[:] = 1e-3 * np.random.default_rng(0).standard_normal(len(structure.v))
        dynamics = Dynamics(structure)
        dynamics.stable_step()
        dt = courant * damped_limit(largest_frequency(structure, dynamics.moving, iterations=60), 0.06)
        start = structure.kinetic_energy()
        for _ in range(400):
            dynamics.step(dt)
        grown.append(structure.kinetic_energy() / start)
    assert grown[0] < 1.0
    assert grown[1] > 10.0


def test_a_step_is_cut_to_few_digits_downwards():
    assert round_down(1.23456e-7) == pytest.approx(1.23e-7, rel=1e-12)
    assert round_down(1.23e-7) == pytest.approx(1.23e-7, rel=1e-12)


def test_element_volumes_add_up_to_the_body():
    mesh = distort(mesh_box((1.0, 2.0, 3.0), (3, 3, 3)), 0.1, 7, boundary=False)
    structure = structure_of(mesh, Steel(1.0, 0.0, 2.0))
    assert volumes(structure.x, structure.domain.cells).sum() == pytest.approx(6.0, rel=1e-12)
    assert structure.mass.sum() == pytest.approx(12.0, rel=1e-12)


@pytest.mark.parametrize("apart", [0.4, 7.3, 26.4, 49.0, 120.0])
def test_a_run_looks_at_itself_as_often_whatever_the_interval_of_its_rows(apart):
    """About every 50 steps, at most 75; between rows alone where these stand farther apart."""
    rows: list[int] = []
    of_run = SimpleNamespace(
        settings=SimpleNamespace(history_interval=apart),
        dt=1.0,
        recorder=SimpleNamespace(rows=rows),
        dynamics=SimpleNamespace(step_count=0),
    )
    looks, between = [0], 0
    for step in range(1, 2001):
        of_run.dynamics.step_count, row = step, step >= apart * (len(rows) + 1)
        if Run._looks(of_run, row):
            looks.append(step)
            between += not row
        if row:
            rows.append(step)
    apart_by = np.diff(looks)[1:]  # the first row may come soon
    assert 35 <= apart_by.min() and apart_by.max() <= 75 and (between == 0 or apart > 50)
