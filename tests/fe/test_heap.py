"""Memory of freed arrays."""

from pathlib import Path

import numpy as np
import pytest

from rail_fem.fe import compat  # noqa: F401

STATUS = Path("/proc/self/statm")  # size and resident size of the process [pages]


@pytest.mark.skipif(not STATUS.is_file(), reason="only Linux tells")
def test_freed_array_leaves_the_process():
    """PETSc's libraries have the C library keep it: a run's peaks would add up."""
    resident = lambda: 4096 * int(STATUS.read_text().split()[1])
    arrays = [np.ones(4_000_000) for _ in range(4)]
    held = resident()
    arrays.clear()
    assert held - resident() > 120e6
