"""What the next block needs is asked for ahead: no number changes, and nothing is asked for beyond an array's end."""

import numpy as np
import pytest

from kernel_cache import njit
from rail_fem.fe.prefetch import INDICES, NUMBERS, fetch


@njit
def total_with_fetches(values, nodes, first, count):
    fetch(values, first, count, NUMBERS)
    fetch(nodes, first, count, INDICES)
    total = 0.0
    for value in values:
        total += value
    return total


@pytest.mark.parametrize("first, count", [(0, 10), (40, 1000), (50, 8), (0, 0)])
@pytest.mark.parametrize("size", [0, 50])
def test_no_number_changes_wherever_it_is_asked_for(first, count, size):
    values, nodes = np.arange(size, dtype=float), np.arange(size, dtype=np.uint32)
    assert total_with_fetches(values, nodes, first, count) == np.arange(size).sum()
    assert (values == np.arange(size)).all() and (nodes == np.arange(size)).all()


def test_the_compiler_is_told():
    total_with_fetches(np.zeros(1), np.zeros(1, np.uint32), 0, 1)
    assert all("llvm.prefetch" in code for code in total_with_fetches.inspect_llvm().values())
