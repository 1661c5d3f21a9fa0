"""Speed of a pass on a graphics card beside a core: measured where there is one, said where there is none."""

import time
from collections.abc import Callable
from typing import Any

import numpy as np

from rail_fem.fe.card.device import card_facts, missing, up
from rail_fem.fe.run import Run
from rail_fem.show.table_and_figure import Table
from rail_fem.studies.benchmark_kernels import OPERATIONS, Limits

# that an update moves at least: state read and written 320, nodes 32, forces written and read 384, their places 64,
# works and volume 56, nodal vectors once 150 [B]
BYTES = 1006.0


NUMBERS, CHAINS, DEEP = 1 << 26, 1 << 20, 1 << 14  # that are streamed; threads of the arithmetic, multiply-adds of each


def card_limits() -> Limits:
    """Multiply-adds and streamed bytes a second of the card, measured now."""
    from numba import cuda

    @cuda.jit
    def stream(y, x):
        i = cuda.grid(1)
        if i < y.size:
            y[i] = 0.999 * y[i] + x[i]

    @cuda.jit
    def multiply_add(y):
        i = cuda.grid(1)
        a, b = y[i], y[i] + 1.0
        for _ in range(DEEP // 2):
            a, b = a * 0.999 + 1e-3, b * 0.999 + 1e-3
        y[i] = a + b

    def least(action: Callable[[], None]) -> float:
        best = np.inf
        for _ in range(5):  # the first compiles
            start = time.perf_counter()
            action()
            cuda.synchronize()
            best = min(best, time.perf_counter() - start)
        return best

    y, x = up(np.ones(NUMBERS)), up(np.ones(NUMBERS))
    moved = 24.0 * NUMBERS / least(lambda: stream[NUMBERS // 256, 256](y, x))
    return Limits(2.0 * DEEP * CHAINS / least(lambda: multiply_add[CHAINS // 256, 256](y)), moved)


def card_table(begin: Callable[[], Run], steps: int) -> Table:
    """A step of a pass on card and core, and the shares of the card's limits that its updates come to.

    begin : makes the Run at rest in front of its first step
    """
    head = ["what", "core", "card", ""]
    if why := missing():
        return Table(head, [], f"Not measured: {why}")
    from rail_fem.fe.card.on_card import OnCard

    run = begin()
    d, dt = run.dynamics, run.dt
    start = time.process_time()
    for _ in range(steps):
        d.step(dt)
    core, again = (time.process_time() - start) / steps, begin()
    card = OnCard(again.dynamics, again.passage.rail_region)
    card.advance(dt, steps, again.recorder)  # compiled, recorded, warm
    start, before = time.perf_counter(), again.dynamics.updates
    card.advance(dt, steps, again.recorder)
    took = time.perf_counter() - start
    rate, bound = (again.dynamics.updates - before) / took, card_limits()
    of_pass = run.passage.running.duration / dt
    rows: list[list[Any]] = [
        ["a step [us]", 1e6 * core, 1e6 * took / steps, f"{d.updated_cells} elements, searches and looks within"],
        ["updates a second [million]", 1e-6 * d.updated_cells / core, 1e-6 * rate, ""],
        ["steps of the pass [s]", core * of_pass, took / steps * of_pass, f"{of_pass:.0f} steps at this rate"],
        ["of the limit by memory", "-", f"{rate * BYTES / bound.bytes:.0%}", f"{1e-9 * bound.bytes:.0f} GB/s"],
        [
            "of the limit by arithmetic",
            "-",
            f"{rate * OPERATIONS['one-point'] / bound.operations:.0%}",
            f"{1e-12 * bound.operations:.1f} 10^12 operations/s in double precision",
        ],
    ]
    facts = card_facts()
    return Table(head, rows, f"{facts.name}, {facts.double_words}")
