"""The card's kernels: which threads do what, and where those of a block meet.

Elements' lanes and nodes are dealt out to as many threads as are launched, so that a block of LANES elements is a warp;
contact and rigid groups are one block of threads each, whose sums fold in a fixed order. A kernel whose step is not to
be made (a search is due first, or enough were made) does nothing.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any, NamedTuple

from numba import cuda, float64

from kernel_cache import njit
from rail_fem.fe.card import arrays, bodies, touching
from rail_fem.fe.card.device import SIMULATED
from rail_fem.fe.contact.pressure import MOMENTUM, SWEEPS
from rail_fem.fe.plasticity import PointBuffers
from rail_fem.fe.state import LANES

THREADS, BLOCKS = (4, 1) if SIMULATED else (64, 16384)  # of a block, of a kernel at most
THREADS_OF_ONE = 4 if SIMULATED else 512  # of a kernel that is one block
# a block of 512 threads has 65,536 registers between them
ONE_BLOCK = {} if SIMULATED else {"max_registers": 128}
# where threads meet: no part of it is the processor's, not even of a simulated card
_joint = (lambda function: function) if SIMULATED else njit(forceinline=True, error_model="numpy")


class Launched(NamedTuple):
    """A kernel and, of what its argument holds, how many items its threads share; None: it is one block."""

    kernel: Any
    items: Callable[[Any], int] | None

    def __call__(self, here: Any, there: Any, stream: Any = None) -> None:
        """Launch it on what is `there`, with as many threads as what is `here` asks for."""
        blocks = 1 if self.items is None else min(BLOCKS, -(-self.items(here) // THREADS))
        grid = blocks, THREADS_OF_ONE if self.items is None else THREADS
        if blocks:
            self.kernel[grid if stream is None else (*grid, stream)](there)


def of_all(items: Callable[[Any], int], work: Callable) -> Launched:
    """`work` on each of the items."""
    count = _joint(items)

    def kernel(a):
        if a.counters[arrays.GOES] > 0:
            for i in range(cuda.grid(1), count(a), cuda.gridsize(1)):
                work(i, a)

    kernel.__name__ = work.__name__
    return Launched(cuda.jit(kernel), items)


@cache
def of_elements(full: bool, back_stresses: int | None) -> Launched:
    """Finite-strain elements, of eight points or of one. back_stresses : the most of a law over cycles, None where no
    steel has one"""
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
    return Launched(cuda.jit(kernel), lambda a: LANES * a.elements.computed.size)


def in_turn(step: tuple[Callable, Callable], *more: tuple[Callable, Callable]) -> Callable:
    """Steps, each a count of items and the work on one of them: what one block does, its threads meeting after each."""
    count, work = _joint(step[0]), step[1]

    @_joint
    def alone(thread, threads, a):
        for i in range(thread, count(a), threads):
            work(i, thread, a)
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
def link_pair(i, _, a):
    """A pair into the list of those over its facet, in whatever order."""
    facet = a.contact.pairs.facets[i]
    if facet >= 0:
        a.contact.after[i] = cuda.atomic.exch(a.contact.head, facet, i)


# how many items steps are made of
shares, rows = lambda a: a.groups.partial.shape[0], lambda a: a.contact.sums.shape[0]  # a thread each
pairs, rails_pairs = lambda a: a.contact.pairs.slaves.size, lambda a: a.contact.split
watched, facets = lambda a: a.contact.watched.size, lambda a: a.contact.head.size
moved = lambda a: a.nodes.moved.size

react = in_turn((shares, bodies.add_reactions))
find_pairs = in_turn(
    (rows, touching.clear_sums),
    (facets, touching.clear_list),
    (watched, touching.unpack_node),
    (pairs, touching.find_pair),
    (pairs, link_pair),
    (facets, touching.order_list),
    (watched, touching.spread_area),
    (pairs, touching.begin_pressure),
)
try_pressures = in_turn((pairs, touching.give_trial), (watched, touching.push_node))
press = in_turn((pairs, touching.take_pressure), (pairs, touching.give_trial), (watched, touching.load_node))
slide = in_turn(
    (pairs, touching.choose_rubbing),
    (watched, touching.spread_area),
    (rails_pairs, touching.rub_pair),
    (watched, touching.load_node),
    (rails_pairs, touching.settle_pair),
)
record = in_turn((watched, touching.add_node))


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
            for i in range(thread, a.contact.pairs.slaves.size, threads):
                touching.sweep_pair(i, MOMENTUM if sweep > 0 else 0.0, a)
            cuda.syncthreads()
        press(thread, threads, a)
        if a.contact.law.friction > 0.0:
            slide(thread, threads, a)
        record(thread, threads, a)
        add_rows(thread, threads, a.contact.sums)
        if thread == 0:
            touching.close_step(a)


MOVE = (
    Launched(groups, None),
    of_all(moved, bodies.kick_node),
    Launched(contact, None),
    of_all(lambda a: a.groups.members.size, bodies.impose_group),
    of_all(watched, bodies.push_node),
    of_all(moved, bodies.drift_node),
)
FORCE = (  # after the finite-strain elements
    of_all(lambda a: LANES * a.small.material_of.size, bodies.force_small_element),
    of_all(moved, bodies.gather_forces),
)
COLLECT = (of_all(lambda a: a.contact.local.size, touching.collect_motion),)
