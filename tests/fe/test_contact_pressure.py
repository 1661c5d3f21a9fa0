"""Pressures of a step are found together: what is left between the surfaces is little more than the penalty allows."""

import pytest
from mpi4py import MPI

from rail_fem.studies.impact import indent


@pytest.mark.parametrize("ratio, beyond", [(1.0, 0.15), (0.8, 0.75)])
def test_at_rest_the_surfaces_overlap_by_the_penalty(ratio, beyond):
    """Largest pressure over penalty stiffness. Where nodes meet nodes, six sweeps leave a tenth of it undone; where
    meshes do not match, the constraints of both surfaces contradict each other, and their differences close slowly."""
    found = indent(4, wheel_to_rail=ratio, comm=MPI.COMM_SELF)
    assert -0.15 < found.overlap / found.allowed - 1 < beyond and 0.005 < found.overlap < 0.02
