"""The card's kernels: which threads do what, and where those of a block meet.

Elements' lanes and nodes are dealt out to as many threads as are launched, so that a block of LANES elements is a warp;
contact and rigid groups are one block of threads each, whose sums fold in a fixed order. A kernel whose step is not to
be made (a search is due first, or enough were made) does nothing.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any

from numba import cuda, float64

from kernel_cache import njit
from rail_fem.fe.card import arrays, bodies, touching
from rail_fem.fe.card.device import SIMULATED
from rail_fem.fe.contact.pressure import MOMENTUM, SWEEPS
from rail_fem.fe.plasticity import PointBuffers
from rail_fem.fe.state import LANES

THREADS = 4 if SIMULATED else 64  # of a block
# a block of 512 threads has 65,536 registers between them
ONE_BLOCK = {} if SIMULATED else {"max_registers": 128}
# where threads meet: no part of it is the processor's, not even of a simulated card
_joint = (lambda function: function) if SIMULATED else njit(forceinline=True, error_model="numpy")


def of_all(work: Callable) -> Any:
    """Kernel of as many blocks as there is work for."""

    def kernel(a):
        if a.counters[arrays.GOES] > 0:
            work(cuda.grid(1), cuda.gridsize(1), a)

    kernel.__name__ = work.__name__
    return cuda.jit(kernel)


@cache
def of_elements(full: bool, back_stresses: int | None) -> Any:
    """Kernel of finite-strain elements, of eight points or of one. back_stresses : the most of a law over cycles, None
    where no steel has one"""
    advance, rows = (bodies.advance_full_element, bodies.FULL_ROOM) if full else (bodies.advance_element, 0)
    size, backs, cycles = max(rows * max(THREADS, LANES), 1), max(back_stresses or 0, 1), back_stresses is not None

    @_joint
    def advance_all(room, point, a):
        for j in range(cuda.grid(1), a.elements.computed.size * LANES, cuda.gridsize(1)):
            advance(a.elements.computed[j // LANES], j % LANES, room, point, a)

    def kernel(a):
        if a.counters[arrays.GOES] > 0:
            first = cuda.threadIdx.x // LANES * LANES * rows
            room = cuda.shared.array(size, float64)[first : first + LANES * rows]
            if cycles:
                trial, direction = cuda.local.array(6, float64), cuda.local.array(6, float64)
                back, factor = cuda.local.array((backs, 6), float64), cuda.local.array(backs, float64)
                advance_all(room, PointBuffers(trial, back, direction, factor, factor), a)
            else:
                advance_all(room, None, a)

    kernel.__name__ = advance.__name__ + "_cyclic" * cycles
    return cuda.jit(kernel)


def in_turn(work: Callable, *more: Callable) -> Callable:
    """What one block does after another, all its threads meeting after each."""

    @_joint
    def alone(thread, threads, a):
        work(thread, threads, a)
        cuda.syncthreads()

    if not more:
        return alone
    rest = in_turn(*more)

    @_joint
    def with_rest(thread, threads, a):
        alone(thread, threads, a)
        rest(thread, threads, a)

    return with_rest


@_joint
def add_rows(thread, threads, partial):
    """The sum of all rows of partial (threads, k) -> the first."""
    half = threads // 2
    while half > 0:
        bodies.fold(thread, half, partial)
        cuda.syncthreads()
        half //= 2


@_joint
def link_pairs(thread, threads, a):
    """Lists of the pairs over each facet, in whatever order."""
    facets = a.contact.pairs.facets
    for i in range(thread, facets.size, threads):
        if facets[i] >= 0:
            a.contact.after[i] = cuda.atomic.exch(a.contact.head, facets[i], i)


find_pairs = in_turn(
    touching.unpack_nodes,
    touching.project_pairs,
    link_pairs,
    touching.order_lists,
    touching.spread_area,
    touching.begin_pressures,
)
try_pressures = in_turn(touching.give_trials, touching.push_surface)
press = in_turn(touching.take_pressures, touching.give_trials, touching.load_nodes)
slide = in_turn(
    touching.choose_rubbing, touching.spread_area, touching.rub_pairs, touching.load_nodes, touching.settle_slips
)
record = in_turn(touching.add_up)
react = in_turn(bodies.add_reactions)


@cuda.jit(**ONE_BLOCK)
def groups(a):
    thread, threads = cuda.threadIdx.x, cuda.blockDim.x
    react(thread, threads, a)
    if a.counters[arrays.GOES] > 0:
        add_rows(thread, threads, a.groups.partial)
        if thread == 0:
            bodies.advance_groups(a.dt, a.groups)


@cuda.jit(**ONE_BLOCK)
def contact(a):
    """Forces of a step."""
    thread, threads = cuda.threadIdx.x, cuda.blockDim.x
    if a.counters[arrays.GOES] > 0:
        find_pairs(thread, threads, a)
        for sweep in range(SWEEPS):
            try_pressures(thread, threads, a)
            touching.sweep_pairs(thread, threads, a, MOMENTUM if sweep > 0 else 0.0)
            cuda.syncthreads()
        press(thread, threads, a)
        if a.contact.law.friction > 0.0:
            slide(thread, threads, a)
        record(thread, threads, a)
        add_rows(thread, threads, a.contact.sums)
        if thread == 0:
            touching.close_step(a)


# kernels in turn, each with how many items its threads share, None: one block
MOVE = (
    (groups, None),
    (of_all(bodies.kick_nodes), lambda a: len(a.nodes.moved)),
    (contact, None),
    (of_all(bodies.impose_groups), lambda a: len(a.groups.members)),
    (of_all(bodies.push_nodes), lambda a: len(a.contact.watched)),
    (of_all(bodies.drift_nodes), lambda a: len(a.nodes.moved)),
)
FORCE = (  # after the finite-strain elements
    (of_all(bodies.force_small_elements), lambda a: LANES * len(a.small.material_of)),
    (of_all(bodies.gather_forces), lambda a: len(a.nodes.moved)),
)
COLLECT = ((of_all(touching.collect_motion), lambda a: len(a.contact.local)),)
