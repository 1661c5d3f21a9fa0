"""Nothing locks: nearly incompressible elasticity and fully plastic flow against exact solutions."""

import numpy as np
import pytest

from geometry.meshing.axis import graded_line
from geometry.meshing.blocks import mesh_box, mesh_grid
from rail_fem.fe.dynamics import Dynamics
from rail_fem.fe.supports import RigidGroup, Supports
from rail_fem.scene.steel import Steel
from tests.fe.bodies import STEEL, at, dense_stiffness, plastic, structure_of
from tests.order import assert_order


def bent(poisson, cells, **options):
    """Curvature of a plane-strain beam in pure bending, over the exact one: M (1 - nu^2) / (E I).

    Length 4, height 1; the left end held in symmetry, the right one loaded by the exact linear traction.
    """
    steel = Steel(1.0, poisson, 1.0)
    structure = structure_of(mesh_box((4.0, 1.0 / cells, 1.0), (4 * cells, 1, cells)), steel, **options)
    x = structure.x.reshape(-1, 3)
    free = np.ones(x.shape, bool)
    free[:, 1] = False
    free[at(structure, 0, 0.0), 0] = False
    free[at(structure, 0, 0.0) & at(structure, 2, 0.0), 2] = False
    load = np.zeros(x.shape)
    heights = np.linspace(0, 1, cells + 1)
    for low, high in zip(heights[:-1], heights[1:]):
        a, b = low - 0.5, high - 0.5
        for z, share in ((low, 2 * a + b), (high, a + 2 * b)):
            load[at(structure, 0, 4.0) & at(structure, 2, z), 0] += (high - low) / 6 * share / cells / 2
    columns, stiffness = np.flatnonzero(free), dense_stiffness(structure, free.ravel())
    u = np.zeros(x.size)
    u[columns] = np.linalg.solve(stiffness, load.ravel()[columns])
    end = u.reshape(-1, 3)[at(structure, 0, 4.0)]
    slope = np.polyfit(x[at(structure, 0, 4.0), 2] - 0.5, end[:, 0], 1)[0]
    return slope / 4 / (1 - poisson**2)


@pytest.mark.parametrize(
    "poisson",
    [0.3, 0.4999, pytest.param(0.0, marks=pytest.mark.validate), pytest.param(0.49, marks=pytest.mark.validate)],
)
def test_pure_bending_does_not_lock_as_the_body_becomes_incompressible(poisson):
    """Exact curvature M (1 - nu^2) / (E I); the error with 4 cells over the height is the same few percent for any
    Poisson's ratio."""
    cells = np.array([2, 4, 8])
    errors = [bent(poisson, n, small=(0,)) - 1 for n in cells]
    assert abs(errors[1]) < 0.04 and abs(errors[2]) < 0.01
    assert_order(1 / cells, errors, expected=2)


def punch_load(cells, **options):
    """Load over the punch's width (counted to the middle of the next cell) and over (2 + pi) k, at two depths.

    A rigid plane-strain punch of half-width 10 mm, `cells` across it, on an elastic, perfectly plastic block; E / Y is
    5000 so that the flow is complete before the shape changes. Half of it is modelled.
    """
    half, yield_stress, speed = 10e-3, 400e6, 1.0
    size = half / cells
    x = graded_line(0.0, 4 * half, (0.0, 1.5 * half), size, 1.15)
    z = -graded_line(0.0, 4 * half, (0.0, half), size, 1.15)[::-1]
    structure = structure_of(
        mesh_grid(x, np.array([0.0, size]), z), plastic(Steel(2e12, 0.3, STEEL.density), yield_stress), **options
    )
    fixed = np.zeros((structure.domain.n_nodes, 3), bool)
    fixed[:, 1] = True
    fixed[at(structure, 0, 0.0) | at(structure, 0, x[-1]), 0] = True
    fixed[at(structure, 2, z[0]), 2] = True
    under = at(structure, 2, 0.0) & (structure.x[::3] < half * (1 + 1e-9))
    punch = RigidGroup("punch", structure.domain.node_input[under], velocity=np.array([0.0, 0.0, -speed]))
    dynamics = Dynamics(structure, Supports([punch]), fixed=fixed, mass_damping=1e4)
    dt, depth, load = dynamics.stable_step(), [], []
    while -punch.displacement[2] < 0.02 * half:
        dynamics.step(dt)
        depth.append(-punch.displacement[2] / half)
        load.append(punch.reaction[2] / (size * (half + size / 2)) / ((2 + np.pi) * yield_stress / np.sqrt(3)))
    depth, load = np.array(depth), np.array(load)
    return load[(depth > 0.008) & (depth < 0.010)].mean(), load[depth > 0.018].mean()


@pytest.mark.parametrize("cells", [8, 16])
def test_fully_plastic_flow_under_a_punch_stops_at_prandtls_load(cells):
    """(2 + pi) k (Prandtl 1920; Hill, Plasticity, 1950, IX.5). Elements that lock never stop: their load goes on
    rising."""
    before, after = punch_load(cells)
    assert after == pytest.approx(before, rel=0.02)
    assert 1.0 < after < 1.05
