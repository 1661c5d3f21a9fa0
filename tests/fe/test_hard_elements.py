"""Elements under what they dislike: hourglass modes, twist, slivers, cells inside out."""

import dataclasses

import numpy as np
import pytest

from geometry.meshing.blocks import mesh_box, mesh_grid
from rail_fem.fe.blocks import ElementSettings
from rail_fem.fe.dynamics import Dynamics
from rail_fem.scene.steel import Steel
from tests.fe.bodies import NO_VISCOSITY, STEEL, at, distort, momentum, plastic, structure_of

HOURGLASS = ["eta zeta", "zeta xi", "xi eta", "xi eta zeta"]


def hourglass_field(structure, mode):
    """Nodal signs of a mesh-wide hourglass mode on a box of unit cells, (n,)."""
    xi, eta, zeta = 1 - 2 * (np.round(structure.x.reshape(-1, 3)).astype(int).T % 2)
    return {"eta zeta": eta * zeta, "zeta xi": zeta * xi, "xi eta": xi * eta, "xi eta zeta": xi * eta * zeta}[mode]


@pytest.mark.parametrize("mode", HOURGLASS)
@pytest.mark.parametrize("small", [(), (0,)], ids=["finite strain", "small displacement"])
def test_a_seeded_hourglass_mode_does_not_grow(mode, small):
    """Its nodes swing back and forth: displacements stay below v / w of a mode with the control's stiffness, over 30
    periods."""
    structure = structure_of(mesh_box((4.0, 4.0, 4.0), (4, 4, 4)), small=small)
    structure.v.reshape(-1, 3)[:, 0] = 1.0 * hourglass_field(structure, mode)
    stiffness = structure.v @ structure.stiffness_times(structure.v) / (np.repeat(structure.mass, 3) @ structure.v**2)
    assert stiffness > 0
    dynamics, energy = Dynamics(structure), structure.kinetic_energy()
    dt, largest = dynamics.stable_step(), 0.0
    while dynamics.time < 30 * 2 * np.pi / np.sqrt(stiffness):
        dynamics.step(dt)
        largest = max(largest, np.abs(structure.x - structure.domain.reference).max())
    # free faces make the field a mix of modes: twice the single one's amplitude
    assert largest < 2.0 / np.sqrt(stiffness)
    assert structure.kinetic_energy() + sum(structure.elastic_energy()) <= energy * (1 + 1e-3)


@pytest.mark.parametrize("mode", HOURGLASS)
def test_without_control_the_same_hourglass_mode_runs_away(mode):
    """The control is what the test above sees: at a coefficient of zero nothing pulls the nodes back."""
    structure = structure_of(mesh_box((4.0, 4.0, 4.0), (4, 4, 4)), settings=ElementSettings(hourglass=0.0))
    velocity = structure.v.reshape(-1, 3)
    velocity[:, 0] = 1.0 * hourglass_field(structure, mode)
    dynamics = Dynamics(structure)
    for _ in range(50):
        dynamics.step(1e-5)
    assert structure.x - structure.domain.reference == pytest.approx(
        50e-5 * hourglass_field(structure, mode).repeat(3) * np.tile([1, 0, 0], len(velocity)), abs=1e-9
    )


@pytest.mark.parametrize(
    "steel", [Steel(1e6, 0.3, 1000.0), Steel(1e6, 0.3, 1000.0, [0.0, 10.0], [2e4, 1e5])], ids=["elastic", "plastic"]
)
def test_a_bar_twists_by_more_than_90_degrees_and_keeps_momentum_and_energy(steel):
    """A soft bar whose ends spin against each other; shear strain 0.1, so the stored energy is known to 1 %."""
    length = 0.1
    structure = structure_of(mesh_box((length, 0.01, 0.01), (40, 4, 4)), steel)
    x = structure.x.reshape(-1, 3)
    spin = 900.0 * (2 * x[:, 0] / length - 1)
    structure.v.reshape(-1, 3)[:, 1:] = np.stack([-spin * (x[:, 2] - 0.005), spin * (x[:, 1] - 0.005)], axis=1)
    dynamics = Dynamics(structure)
    angular, size = momentum(structure)[1], structure.kinetic_energy()
    scale = np.linalg.norm(structure.mass[:, None] * structure.v.reshape(-1, 3)) * length
    before, most = dynamics.energies()["balance"], 0.0
    while dynamics.time < 5e-3:
        dt = dynamics.stable_step(0.8)
        for _ in range(20):
            dynamics.step(dt)
        dynamics.check()
        ends = [structure.x.reshape(-1, 3)[at(structure, 0, end)] for end in (0.0, length)]
        angles = [np.arctan2(*(e[-1] - e[0])[[2, 1]]) for e in ends]
        most = max(most, abs((angles[1] - angles[0] + np.pi) % (2 * np.pi) - np.pi))
    assert most > np.pi / 2
    assert np.abs(momentum(structure)[1] - angular).max() < 1e-10 * scale
    assert abs(dynamics.energies()["balance"] - before) < 0.02 * size


def test_a_sliver_only_costs_steps():
    """One layer of thickness d between cells of h = 1000 d: the masses at its faces are the neighbours', so the step
    falls with sqrt(d / h); a wave passes through it unharmed."""
    thin = mesh_grid(
        np.array([0.0, 1.0, 2.0, 2.001, 3.001, 4.001]) * 1e-3, np.array([0.0, 1e-3]), np.array([0.0, 1e-3])
    )
    even = mesh_box((4e-3, 1e-3, 1e-3), (4, 1, 1))
    steps = [Dynamics(structure_of(mesh)).stable_step() for mesh in (thin, even)]
    assert steps[0] / steps[1] == pytest.approx(np.sqrt(1e-3), rel=0.1)
    structure = structure_of(thin)
    structure.v.reshape(-1, 3)[:, 0] = 5.0 * np.sin(structure.x.reshape(-1, 3)[:, 0] / 4e-3 * np.pi)
    dynamics = Dynamics(structure)
    before = dynamics.energies()["balance"]
    while dynamics.time < 1e-6:
        dynamics.step(steps[0])
    dynamics.check()
    assert dynamics.energies()["balance"] == pytest.approx(before, rel=0.01)
    assert np.abs(structure.finite.stress()[:, 0]).max() < 2 * STEEL.density * STEEL.wave_speed * 5.0


def test_a_cell_inside_out_is_refused_with_its_number_and_position():
    mesh = mesh_box((0.03, 0.01, 0.01), (3, 1, 1))
    cells = mesh.cells.copy()
    cells[1] = cells[1][[4, 5, 6, 7, 0, 1, 2, 3]]
    with pytest.raises(
        ValueError, match=r"turned inside out, the first is element 1 at \(15\.00, 5\.00, 5\.00\) mm.*repair the mesh"
    ):
        structure_of(dataclasses.replace(mesh, cells=cells))


def test_a_cell_that_turns_inside_out_in_a_run_stops_it_with_step_time_and_position():
    """One node of a block is thrown through its cell."""
    structure = structure_of(mesh_box((2e-3, 2e-3, 2e-3), (2, 2, 2)), plastic(STEEL, 1e6), settings=NO_VISCOSITY)
    corner = at(structure, 0, 0.0) & at(structure, 1, 0.0) & at(structure, 2, 0.0)
    structure.v.reshape(-1, 3)[corner] = 1e5
    dynamics = Dynamics(structure)
    with pytest.raises(
        ArithmeticError,
        match=r"step \d+, t = 0\.\d+ ms: \d element\(s\) turned inside out, the first is element 0 at \(",
    ):
        for _ in range(100):
            dynamics.step(1e-9)
            dynamics.check()


def test_a_crushed_block_keeps_its_cells_upright():
    """Random cells driven to half their height by fast plastic flow: no cell turns over, no number is lost."""
    structure = structure_of(distort(mesh_box((4e-3, 4e-3, 4e-3), (4, 4, 4)), 1e-4, 8), plastic(STEEL, 300e6, 1e9))
    z = structure.x.reshape(-1, 3)[:, 2]
    structure.v.reshape(-1, 3)[:, 2] = -600.0 * (z / 2e-3 - 1)
    dynamics = Dynamics(structure)
    while dynamics.time < 5e-6:
        dt = dynamics.stable_step(0.8)
        for _ in range(10):
            dynamics.step(dt)
        dynamics.check()
    height = structure.x.reshape(-1, 3)[:, 2]
    assert np.ptp(height) < 0.7 * 4e-3
