"""The card's kernels: which thread does what, and where the threads of a block meet.

A block of LANES elements is a warp and a block of threads; nodes are dealt out to as many threads as are launched;
contact and rigid groups are one block of threads each, whose sums fold in a fixed order. A kernel whose step is not to
be made (a search is due first, or enough were made) does nothing.
"""

from __future__ import annotations

from numba import cuda

from rail_fem.fe.card import bodies, touching
from rail_fem.fe.card.device import SIMULATED
from rail_fem.fe.card.touching import GOES, LEFT, TO_SEARCH
from rail_fem.fe.contact.pressure import MOMENTUM, SWEEPS
from rail_fem.fe.state import LANES

# a block of 512 threads has 65,536 registers between them
ONE_BLOCK = {} if SIMULATED else {"max_registers": 128}


@cuda.jit
def kick(dt, nodes, shared):
    if shared.counters[LEFT] > 0 and shared.counters[TO_SEARCH] > 0:
        for j in range(cuda.grid(1), nodes.moved.size, cuda.gridsize(1)):
            bodies.kick_node(nodes.moved[j], dt, nodes)


@cuda.jit(**ONE_BLOCK)
def groups(dt, own, nodes, shared):
    """One block."""
    if not (shared.counters[LEFT] > 0 and shared.counters[TO_SEARCH] > 0):
        return
    thread, half = cuda.threadIdx.x, cuda.blockDim.x // 2
    bodies.add_reactions(thread, cuda.blockDim.x, own, nodes.force)
    cuda.syncthreads()
    while half > 0:
        bodies.fold(thread, half, own.partial)
        cuda.syncthreads()
        half //= 2
    if thread == 0:
        bodies.advance_groups(dt, own)


@cuda.jit(**ONE_BLOCK)
def contact(dt, t, nodes, shared):
    """One block: forces of a step."""
    thread, threads = cuda.threadIdx.x, cuda.blockDim.x
    goes = shared.counters[LEFT] > 0 and shared.counters[TO_SEARCH] > 0
    cuda.syncthreads()
    if thread == 0:
        shared.counters[GOES] = 1 if goes else 0
    if not goes:
        return
    lists, given = t.lists, t.given
    touching.unpack_nodes(thread, threads, nodes.x, nodes.v, dt, t)
    cuda.syncthreads()
    touching.project_all(thread, threads, t)
    cuda.syncthreads()
    for i in range(thread, t.on_rail.slaves.size, threads):
        if t.on_rail.facets[i] >= 0:
            lists.after_rail[i] = cuda.atomic.exch(lists.head_wheel, t.on_rail.facets[i], i)
    for i in range(thread, t.on_wheel.slaves.size, threads):
        if t.on_wheel.facets[i] >= 0:
            lists.after_wheel[i] = cuda.atomic.exch(lists.head_rail, t.on_wheel.facets[i], i)
    cuda.syncthreads()
    touching.order_lists(thread, threads, lists.head_wheel, lists.after_rail)
    touching.order_lists(thread, threads, lists.head_rail, lists.after_wheel)
    cuda.syncthreads()
    touching.spread_area(thread, threads, t)
    cuda.syncthreads()
    touching.begin_pressures(thread, threads, t, dt, t.on_rail, given.rail_state)
    touching.begin_pressures(thread, threads, t, dt, t.on_wheel, given.wheel_state)
    for sweep in range(SWEEPS):
        cuda.syncthreads()
        touching.give_trials(thread, threads, t, t.on_rail, given.rail_state, given.rail_amount, given.rail_vector, 3)
        touching.give_trials(
            thread, threads, t, t.on_wheel, given.wheel_state, given.wheel_amount, given.wheel_vector, 3
        )
        cuda.syncthreads()
        touching.push_nodes(thread, threads, t)
        cuda.syncthreads()
        momentum = MOMENTUM if sweep > 0 else 0.0
        touching.sweep_pairs(thread, threads, t, dt, t.on_rail, given.rail_state, momentum)
        touching.sweep_pairs(thread, threads, t, dt, t.on_wheel, given.wheel_state, momentum)
    cuda.syncthreads()
    touching.take_pressures(thread, threads, t, t.on_rail, given.rail_state)
    touching.take_pressures(thread, threads, t, t.on_wheel, given.wheel_state)
    touching.give_trials(thread, threads, t, t.on_rail, given.rail_state, given.rail_amount, given.rail_vector, 2)
    touching.give_trials(thread, threads, t, t.on_wheel, given.wheel_state, given.wheel_amount, given.wheel_vector, 2)
    cuda.syncthreads()
    touching.press_nodes(thread, threads, t)
    cuda.syncthreads()
    if t.law.friction > 0.0:
        touching.choose_rubbing(thread, threads, t)
        cuda.syncthreads()
        touching.spread_area(thread, threads, t)
        cuda.syncthreads()
        touching.rub_pairs(thread, threads, t, dt)
        cuda.syncthreads()
        touching.drag_nodes(thread, threads, t)
        cuda.syncthreads()
        touching.settle_slips(thread, threads, t, dt)
    touching.add_up(thread, threads, t)
    cuda.syncthreads()
    half = threads // 2
    while half > 0:
        bodies.fold(thread, half, t.sums)
        cuda.syncthreads()
        half //= 2
    if thread == 0:
        touching.close_step(t, dt, shared.counters)


@cuda.jit
def impose(own, nodes, shared):
    if shared.counters[GOES] > 0:
        for m in range(cuda.grid(1), own.members.size, cuda.gridsize(1)):
            bodies.impose_group(m, own, nodes.v)


@cuda.jit
def push(dt, t, nodes, shared):
    if shared.counters[GOES] > 0:
        for j in range(cuda.grid(1), t.watched.size, cuda.gridsize(1)):
            a = t.watched[j]
            bodies.push_node(t.local[a], a, dt, nodes, t.found.force, t.nodes.inverse_mass)


@cuda.jit
def drift(dt, damping, nodes, shared):
    if shared.counters[GOES] > 0:
        for j in range(cuda.grid(1), nodes.moved.size, cuda.gridsize(1)):
            bodies.drift_node(nodes.moved[j], dt, damping, nodes)


@cuda.jit
def elements(dt, nodes, own, steels, shared):
    """A block of threads is a block of elements."""
    if shared.counters[GOES] > 0:
        for lane in range(cuda.threadIdx.x, LANES, cuda.blockDim.x):
            bodies.advance_element(own.computed[cuda.blockIdx.x], lane, dt, nodes, own, steels, shared.finite_forces)


@cuda.jit
def small_elements(nodes, own, steels, shared):
    if shared.counters[GOES] > 0:
        for lane in range(cuda.threadIdx.x, LANES, cuda.blockDim.x):
            bodies.force_small(cuda.blockIdx.x, lane, nodes, own, steels, shared.small_forces)


@cuda.jit
def gather(nodes, shared):
    if shared.counters[GOES] > 0:
        for j in range(cuda.grid(1), nodes.moved.size, cuda.gridsize(1)):
            bodies.gather_force(nodes.moved[j], nodes, shared.forces)


@cuda.jit
def collect(nodes, t):
    """Positions and velocities of surface nodes, for a search."""
    for n in range(cuda.grid(1), t.local.size, cuda.gridsize(1)):
        touching.collect_motion(n, nodes.x, nodes.v, t)
