"""Memory of freed arrays and of what PETSc was given."""

from pathlib import Path

import numpy as np
import pytest

from geometry.meshing.blocks import mesh_box
from rail_fem.fe import compat  # noqa: F401
from rail_fem.fe.heap import give_back_free_memory
from rail_fem.static_fe.condensed import Factor, modes_below
from rail_fem.static_fe.small_strain import solid
from tests.fe.bodies import STEEL

STATUS = Path("/proc/self/statm")  # size and resident size of the process [pages]
pytestmark = pytest.mark.skipif(not STATUS.is_file(), reason="only Linux tells")


def resident() -> int:
    return 4096 * int(STATUS.read_text().split()[1])


def test_matrices_and_factors_leave_the_process():
    """Of 3 x 9^3 unknowns: PETSc 3.18 keeps what nobody destroys, 15 MB a round."""
    body = solid(mesh_box((1.0,) * 3, (8,) * 3), STEEL.elastic)

    def solve_all():
        stiffness, mass = body.stiffness(), body.mass(STEEL.density)
        free = np.arange(3 * 81, stiffness.shape[0])  # 81 nodes are held
        held = stiffness[free][:, free]
        modes_below(held, mass[free][:, free], 2e4)
        factor = Factor(held)
        assert np.isfinite(factor(np.ones((len(free), 1)))).all()
        factor.give_back()

    for _ in range(2):
        solve_all()
    give_back_free_memory()
    before = resident()
    for _ in range(8):
        solve_all()
    give_back_free_memory()
    assert resident() - before < 12e6


def test_freed_array_leaves_the_process():
    """PETSc's libraries have the C library keep it: a run's peaks would add up."""
    give_back_free_memory()  # of tests before: an array that lies in it shows nothing
    arrays = [np.ones(20_000_000) for _ in range(2)]
    held = resident()
    arrays.clear()
    assert held - resident() > 300e6
