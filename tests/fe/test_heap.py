"""Memory of freed arrays."""

from pathlib import Path

import numpy as np
import pytest

from rail_fem.fe import compat  # noqa: F401
from rail_fem.fe.heap import give_back_free_memory

STATUS = Path("/proc/self/statm")  # size and resident size of the process [pages]


@pytest.mark.skipif(not STATUS.is_file(), reason="only Linux tells")
def test_freed_array_leaves_the_process():
    """PETSc's libraries have the C library keep it: a run's peaks would add up."""
    resident = lambda: 4096 * int(STATUS.read_text().split()[1])
    give_back_free_memory()  # of tests before: an array that lies in it shows nothing
    arrays = [np.ones(20_000_000) for _ in range(2)]
    held = resident()
    arrays.clear()
    assert held - resident() > 300e6
