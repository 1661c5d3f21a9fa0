"""Normal forces give and take what the penalty stores, and no more, where surfaces slide over each other."""

import numpy as np
from mpi4py import MPI

from tests.fe.rolling_job import rolling, run


def test_without_friction_nothing_turns_a_wheel():
    """Its surface is one of revolution; the block's, which flows, is steeper in front of the patch than behind it."""
    scene = rolling(MPI.COMM_SELF, friction=0.0)
    c = scene.dynamics.contact
    found = run(scene, 2000)
    assert found.energies[-1]["plastic"] > 0.1 and np.abs(found.force[-1]).max() > 1e3
    assert found.energies[-1]["rotation"] == 0.0 and c.wheel.spin == 100.0 / 30e-3
