"""Rigid motions strain nothing; free bodies keep their momentum."""

import numpy as np
import pytest

from geometry.axes import as_tensor
from geometry.meshing.blocks import mesh_box
from rail_fem.fe.dynamics import Dynamics
from rail_fem.fe.hexahedron import volumes
from tests.fe.bodies import STEEL, distort, momentum, place, plastic, structure_of


def rotation(axis, angle):
    """Rodrigues' formula."""
    x, y, z = axis / np.linalg.norm(axis)
    k = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * k + (1 - np.cos(angle)) * k @ k


def body():
    return distort(mesh_box((0.03, 0.02, 0.02), (4, 3, 3)), 1e-3, 4)


def test_translation_leaves_the_body_without_stress_and_its_energy_constant():
    structure = structure_of(body())
    structure.v.reshape(-1, 3)[:] = 30.0, -20.0, 10.0
    dynamics = Dynamics(structure)
    start, before = momentum(structure)[0], structure.kinetic_energy()
    for _ in range(1000):
        dynamics.step(1e-7)
    # coordinates lose eps * position / cell of strain in a step
    assert np.abs(structure.finite.stress()).max() < 1e-10 * STEEL.youngs_modulus
    assert structure.kinetic_energy() == pytest.approx(before, rel=1e-10)
    assert momentum(structure)[0] == pytest.approx(start, rel=1e-10)


@pytest.mark.parametrize("step", [0.01, 0.5])
def test_twenty_turns_leave_the_body_without_stress(step):
    """Steps of 0.01 and of half a radian: Hughes and Winget's rotation is exact for any of them."""
    structure = structure_of(body(), plastic(STEEL, 1e6))
    start, axis = structure.x.reshape(-1, 3).copy(), np.array([1.0, 2.0, -0.5])
    for n in range(1, int(20 * 2 * np.pi / step)):
        place(structure, start @ rotation(axis, n * step).T, 1e-7)
    assert np.abs(structure.finite.stress()).max() < 1e-10 * STEEL.youngs_modulus
    assert structure.finite.plastic_strain().max() == 0.0
    assert (
        np.abs(structure.work).max()
        < 1e-10 * STEEL.youngs_modulus * volumes(structure.domain.reference, structure.domain.cells).sum()
    )


def test_stress_turns_with_the_body():
    """Stretch, then 20 turns and a third: the stress is the first one, turned."""
    structure = structure_of(body())
    stretched = structure.x.reshape(-1, 3) * [1.001, 1.0, 0.999]
    place(structure, stretched, 1e-7)
    before, angles = as_tensor(structure.finite.stress()), np.linspace(0, (20 + 1 / 3) * 2 * np.pi, 400)
    for angle in angles[1:]:
        place(structure, stretched @ rotation(np.array([1.0, 2.0, -0.5]), angle).T, 1e-7)
    r = rotation(np.array([1.0, 2.0, -0.5]), angles[-1])
    assert np.abs(as_tensor(structure.finite.stress()) - r @ before @ r.T).max() < 1e-10 * STEEL.youngs_modulus


@pytest.mark.parametrize("steel", [STEEL, plastic(STEEL, 300e6, 2e9)], ids=["elastic", "plastic"])
def test_a_free_deforming_body_keeps_linear_and_angular_momentum(steel):
    structure = structure_of(body(), steel)
    rng = np.random.default_rng(3)
    structure.v.reshape(-1, 3)[:] = [20.0, 5.0, -9.0] + 40 * rng.standard_normal((structure.domain.n_nodes, 3))
    dynamics = Dynamics(structure)
    dt, (linear, angular) = 0.5 * dynamics.stable_step(), momentum(structure)
    for _ in range(2000):
        dynamics.step(dt)
    assert np.abs(momentum(structure)[0] - linear).max() < 1e-12 * np.abs(linear).max()
    # the moment of a force about the origin carries eps times the position
    assert np.abs(momentum(structure)[1] - angular).max() < 1e-11 * np.abs(angular).max()
    assert steel.is_elastic or structure.finite.plastic_strain().max() > 0.01


def test_a_spinning_body_turns_many_times_at_constant_energy_and_momentum():
    """Spin with a rim speed v: it stretches by (v/c)^2 and breathes about that, so kinetic energy varies by (v/c)^2 at
    most."""
    structure = structure_of(mesh_box((0.02, 0.01, 0.02), (4, 2, 4)))
    x = structure.x.reshape(-1, 3)
    x -= x.mean(axis=0)
    rim = 60.0
    spin = np.array([0.0, rim / np.linalg.norm(x, axis=1).max(), 0.0])
    structure.v.reshape(-1, 3)[:] = np.cross(spin, x)
    dynamics = Dynamics(structure)
    dt, before, (_, angular) = dynamics.stable_step(), structure.kinetic_energy(), momentum(structure)
    turns, energies = 5, []
    while dynamics.time < turns * 2 * np.pi / spin[1]:
        dynamics.step(dt)
        energies.append(structure.kinetic_energy())
    assert np.abs(momentum(structure)[1] - angular).max() < 1e-10 * angular[1]
    ratio = (rim / np.sqrt(STEEL.youngs_modulus / STEEL.density)) ** 2
    assert np.abs(np.array(energies) / before - 1).max() < ratio
    assert np.mean(energies[-500:]) == pytest.approx(np.mean(energies[:500]), rel=ratio / 10)
