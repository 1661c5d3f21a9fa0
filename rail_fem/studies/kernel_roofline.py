"""The two limits of a core, and what they leave to the element kernels: operations and bytes of an update beside the
rates of arithmetic and of memory (the roofline of Williams, Waterman and Patterson, Comm. ACM 52 (2009) 65).

Bytes are the least that can move: each array once, as if nothing were evicted and fetched again; for a body that does
not fit the cache.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from kernel_cache import njit
from rail_fem.fe.structure import Structure

LINE = 4096  # numbers of the arithmetic loop: in the first cache
DEEP = 8  # multiply-adds on each of its eight numbers between load and store
NODAL = 4 * 24  # x and v read, force read and written, of a node [B]
NODAL_SMALL = 5 * 24 + 2 * 24  # x, reference, v read, u written and read; force read and written [B]


@dataclass(frozen=True)
class Limits:
    """Of one core: multiply-adds in the first cache, counted as two operations each [1/s]; memory read and written by
    an update in place of arrays far larger than the caches [B/s]."""

    operations: float
    bytes: float

    def updates(self, operations: float, moved: float) -> tuple[float, float]:
        """Updates per second that each limit allows, for so many operations and bytes an update."""
        return self.operations / operations, self.bytes / moved


@njit(cache=True, fastmath=True, error_model="numpy")
def multiply_add(y, a, b, repeats):
    """Eight independent chains, DEEP multiply-adds long, over y (8 n,)."""
    n = y.size // 8
    for _ in range(repeats):
        for i in range(n):
            t0, t1, t2, t3 = y[i], y[i + n], y[i + 2 * n], y[i + 3 * n]
            t4, t5, t6, t7 = y[i + 4 * n], y[i + 5 * n], y[i + 6 * n], y[i + 7 * n]
            for _ in range(DEEP):
                t0, t1, t2, t3 = t0 * a + b, t1 * a + b, t2 * a + b, t3 * a + b
                t4, t5, t6, t7 = t4 * a + b, t5 * a + b, t6 * a + b, t7 * a + b
            y[i], y[i + n], y[i + 2 * n], y[i + 3 * n] = t0, t1, t2, t3
            y[i + 4 * n], y[i + 5 * n], y[i + 6 * n], y[i + 7 * n] = t4, t5, t6, t7


@njit(cache=True, fastmath=True, error_model="numpy")
def update_in_place(y, a, x):
    for i in range(y.size):
        y[i] = a * y[i] + x[i]


def machine_limits(least_time: Callable[[Callable[[], None]], float], numbers: int) -> Limits:
    """Measured now. least_time : seconds of a call;  numbers : of each of the two arrays that are streamed."""
    line, repeats = np.ones(LINE), 200
    arithmetic = 2.0 * DEEP * LINE * repeats / least_time(lambda: multiply_add(line, 0.999, 1e-3, repeats))
    y, x = np.ones(numbers), np.ones(numbers)
    return Limits(arithmetic, 24.0 * numbers / least_time(lambda: update_in_place(y, 0.999, x)))


def bytes_of_update(structure: Structure) -> float:
    """Least bytes that an update of an element moves, mean over the elements."""
    finite, small, nodes = structure.finite, structure.small, structure.domain.n_nodes
    moved = 2 * (finite.state.nbytes + finite.back.nbytes) + finite.nodes.nbytes
    moved += small.nodes.nbytes + structure.geometry.nbytes
    moved += NODAL_SMALL * nodes if small.n_cells else NODAL * nodes
    return moved / (finite.n_cells + small.n_cells)
