"""What a step reads and writes on a card: one NamedTuple of NamedTuples, the only argument of all kernels. Its fields
are named where it is filled (rail_fem.fe.card.on_card); here are the columns of arrays that the card alone has."""

from __future__ import annotations

from collections import namedtuple
from functools import cache
from typing import Any

from rail_fem.fe.contact.pairs import N_SUMS

TO_SEARCH, LEFT, GOES = range(3)  # counters: steps to the next search, steps asked for, whether this one is made
# columns of the threads' sums after those of a step: forces and moments of node_kernels.add_step, pairs that were lost
FORCES, MOMENT, LOST = N_SUMS, N_SUMS + 5, N_SUMS + 9
N_COLUMNS = N_SUMS + 10
OFFSET, SPIN, SPEED, INERTIA, YAW = range(5)  # of the wheel's motion [m, rad/s, m/s, kg m2, rad]; inertia inf: held
# since they were last read: forces and moments as in the sums, works of friction, of towing and driving, of rotation
FRICTION, TOWING, ROTATION = range(LOST - FORCES, LOST - FORCES + 3)
STIFFNESS, DAMPING, LENGTH, RATE, DISSIPATED, BEFORE = range(6)  # of a link, the last its rate before the step


@cache
def _kind(name: str, fields: tuple[str, ...]) -> type:
    kind = globals()[name] = namedtuple(name, fields)  # kernels that are kept are told it by name
    return kind


def together(name: str, **fields: Any) -> Any:
    """A NamedTuple of these, of the same type for the same fields: kernels are compiled once for it."""
    return _kind(name, tuple(fields))(**fields)
