"""Patch test: an affine motion of a distorted mesh gives one stress everywhere and no force inside."""

import numpy as np
import pytest

from geometry.axes import as_tensor
from geometry.meshing.blocks import mesh_box
from tests.fe.bodies import NO_VISCOSITY, STEEL, distort, lame, place, structure_of

MOTION = np.array([[0.010, 0.004, -0.002], [0.003, -0.006, 0.005], [-0.001, 0.002, 0.008]])


def hooke(strain):
    lam, mu = lame(STEEL)
    return lam * np.trace(strain) * np.eye(3) + 2 * mu * strain


def one_step_stress(motion):
    """Increment referred to the middle configuration, H (I + H / 2)^-1; half of its stress turns by Hughes and Winget's
    rotation."""
    increment = motion @ np.linalg.inv(np.eye(3) + motion / 2)
    stress, spin = hooke((increment + increment.T) / 2), (increment - increment.T) / 2
    turn = np.linalg.solve(np.eye(3) - spin / 2, np.eye(3) + spin / 2)
    return (stress + turn @ stress @ turn.T) / 2


@pytest.mark.parametrize("kernel", ["finite strain", "small displacement"])
@pytest.mark.parametrize("seed", range(3))
def test_affine_motion_of_distorted_cells_gives_one_stress_and_no_force_inside(kernel, seed):
    small = kernel == "small displacement"
    mesh = distort(mesh_box((1.0, 1.0, 1.0), (3, 3, 3)), 0.08, seed)
    structure = structure_of(mesh, settings=NO_VISCOSITY, small=(0,) if small else ())
    start = structure.x.reshape(-1, 3).copy()
    place(structure, start + start @ MOTION.T, 1e-7)
    stress = as_tensor(structure.small_stress() if small else structure.finite.stress())
    exact = hooke((MOTION + MOTION.T) / 2) if small else one_step_stress(MOTION)
    assert np.abs(stress - exact).max() < 1e-12 * np.abs(exact).max()
    inside = np.zeros(len(mesh.points), bool)
    inside[[21, 22, 25, 26, 37, 38, 41, 42]] = True
    force = structure.force.reshape(-1, 3)
    largest = np.abs(force).max()
    assert np.abs(force[inside[structure.domain.node_input]]).max() < 1e-12 * largest
    assert largest > 0.01 * np.abs(exact).max() / 9
