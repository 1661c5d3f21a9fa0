"""Pressures of a step are found together: what is left between the surfaces is what the penalty allows."""

import pytest
from mpi4py import MPI

from rail_fem.studies.impact import indent


@pytest.mark.parametrize("ratio", [1.0, 0.8])
def test_at_rest_the_surfaces_overlap_by_the_penalty_alone(ratio):
    """Largest pressure over penalty stiffness, also where meshes do not match. At most (1 - D/A)^6 of what a step alone
    would leave remains after six sweeps: a tenth of the rest."""
    found = indent(4, wheel_to_rail=ratio, comm=MPI.COMM_SELF)
    assert found.overlap == pytest.approx(found.allowed, rel=0.15) and 0.005 < found.overlap < 0.02
