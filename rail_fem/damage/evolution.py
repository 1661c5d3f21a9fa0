"""A section that changes while wheels pass: passes in blocks, each on the shape at its middle.

In a block the wear rate is taken where it begins, at its middle (on the shape worn by half of it) and at its end; all
of the block wears at the rate of the middle (midpoint rule, second order). A third of the difference to what it would
have worn at the mean of both ends is its error (that of the trapezoidal rule is minus twice the midpoint rule's).
Blocks are as long as this stays below the tolerance, or as long as told. The end's rate is the next block's first.
Source of the midpoint rule: Hairer, Norsett, Wanner, Solving Ordinary Differential Equations I (1993), II.1.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from geometry.wheelset import WheelsetError
from rail_fem.damage.section import Section, WearRate
from rail_fem.damage.worn_profile import WornOutError, WornProfile, depth_between, smoothed_depth

TOLERANCE = 0.01  # of the depth, that halving a block may change
LARGEST = 4.0  # times the block before
SHALLOW = 0.1e-6  # deepest wear of a first block [m]
LEAST_SHARE = 0.02  # of the passes done, that a block is long at least
MOST_BLOCKS = 5000


@dataclass(frozen=True, eq=False)
class Evolution:
    """A section after `passes`.

    worn : its shape;  first : before;  depth : (n,) worn off, per length of line, by the leading law [m];  by_law : the
    same for each law, all on the leading law's shapes;  work : (n,) friction work per area [J/m2]
    area : the strips' own sum for the leading law [m2];  beyond : what of it lay beyond the ends
    error : (n,) bound of the blocks' error [m];  smoothing : largest change of a depth by smoothing [m]
    block : next block's passes;  correction : largest |factor - 1| that met an area;  log : rows of passes, deepest
    [m], T gamma largest and mean [N], blocks' error [m];  starts : (k,) lateral positions [m] from which the state's
    own rate is found, so that a study gone on with is the same to the last bit
    """

    worn: WornProfile
    first: WornProfile
    passes: float
    depth: np.ndarray
    by_law: dict[str, np.ndarray]
    work: np.ndarray
    area: float
    beyond: float
    error: np.ndarray
    smoothing: float
    block: float
    correction: float
    log: np.ndarray
    starts: np.ndarray

    @property
    def deepest(self) -> float:
        """Largest depth [m]."""
        return float(self.depth.max())

    @property
    def block_error(self) -> float:
        """Largest error of the blocks over the largest depth."""
        return float(self.error.max() / self.depth.max()) if self.depth.max() > 0 else 0.0


def begin(section: Section) -> Evolution:
    """Before any pass."""
    first = section.first()
    zero = np.zeros(len(first.points))
    laws = dict.fromkeys(section.laws, zero)
    return Evolution(
        first, first, 0.0, zero, laws, zero, 0.0, 0.0, zero, 0.0, 0.0, 0.0, np.zeros((0, 5)), section.starts
    )


@dataclass(frozen=True)
class Stepping:
    """How passes are taken in blocks. law : that changes the shape;  block : passes, None: by tolerance;  smoothing :
    standard deviation along the line [m];  limit : depth at which the section is worn through [m]"""

    law: str = "archard"
    block: float | None = None
    tolerance: float = TOLERANCE
    smoothing: float = 0.25e-3
    limit: float = 10e-3


def evolve(
    section: Section,
    passes: float,
    stepping: Stepping,
    start: Evolution | None = None,
    said: Callable[[WearRate], None] | None = None,
) -> Iterator[Evolution]:
    """Wear the section by `passes` passes in all; yields the state after each block.

    Raises WornOutError where it is worn through, ValueError for a study that would need more than MOST_BLOCKS blocks.
    """
    state = begin(section) if start is None else start
    rate = None
    for _ in range(MOST_BLOCKS):
        left = passes - state.passes
        if left <= 1e-9 * max(passes, 1.0):
            return
        rate = section.rate(state.worn) if rate is None else rate
        if said is not None:
            said(rate)
        state, rate = _block(section, state, rate, left, stepping)
        yield state
    raise ValueError(
        f"{passes:g} passes need more than {MOST_BLOCKS} blocks, {state.passes:g} are done, {state.deepest * 1e3:.3g}"
        " mm deep: ask for fewer passes, or a larger tolerance"
    )


def _block(
    section: Section, state: Evolution, rate: WearRate, left: float, stepping: Stepping
) -> tuple[Evolution, WearRate | None]:
    """One accepted block, and the rate at its end where it is known."""
    law = stepping.law
    rough = rate.depth[law]
    # a rate that jumps, as a point comes or goes, is not met by ever shorter blocks: its error is kept instead
    least = max(1.0, LEAST_SHARE * state.passes)
    count = max(stepping.block or state.block or _first_block(rough), least)
    while True:
        count = min(count, left)
        smooth = smoothed_depth(state.worn, rough, stepping.smoothing)
        try:
            half, _ = state.worn.worn(smooth * (count / 2))
            middle = section.rate(half)
            taken = smoothed_depth(state.worn, middle.depth[law], stepping.smoothing)
            new, factor = state.worn.worn(taken * count)
            starts = section.starts
            end = section.rate(new)
        except (WornOutError, WheelsetError):  # a block far too long may leave a shape on which nothing stands
            if stepping.block or count * rough.max() < SHALLOW:
                raise
            count /= 4
            continue
        last = smoothed_depth(new, end.depth[law], stepping.smoothing)
        error = np.abs((smooth + last) / 2 - taken) * (count / 3)
        allowed = stepping.tolerance * max((taken * count).max(), 1e-30)
        if stepping.block or error.max() <= allowed or count <= least:
            break
        count = max(count * max(0.8 * (allowed / error.max()) ** 0.5, 0.2), least)
    following = count * min(0.8 * (allowed / max(error.max(), 1e-30)) ** 0.5, LARGEST)
    return _after(state, middle, new, taken, error, count, following, factor, starts, stepping), end


def _first_block(rough: np.ndarray) -> float:
    deepest = rough.max()
    return max(SHALLOW / deepest, 1.0) * 10 if deepest > 0 else np.inf


def _after(
    state: Evolution,
    middle: WearRate,
    new: WornProfile,
    taken: np.ndarray,
    error: np.ndarray,
    count: float,
    following: float,
    factor: float,
    starts: np.ndarray,
    stepping: Stepping,
) -> Evolution:
    deepest = depth_between(new, state.first).max()
    if deepest > stepping.limit:
        raise WornOutError(
            f"{new.label}: worn {deepest * 1e3:.2f} mm deep after {state.passes + count:.6g} passes, the limit is"
            f" {stepping.limit * 1e3:.2f} mm"
        )
    depth = state.depth + taken * count
    tgamma = np.array([p.tgamma for r in middle.records for p in r.points if p.side == "left"] or [0.0])
    shares = np.array([r.passing.weight for r in middle.records for p in r.points if p.side == "left"] or [1.0])
    total = state.error + error
    row = [state.passes + count, depth.max(), tgamma.max(), np.average(tgamma, weights=shares), total.max()]
    return replace(
        state,
        worn=new,
        passes=state.passes + count,
        depth=depth,
        by_law={name: state.by_law[name] + count * middle.depth[name] for name in state.by_law},
        work=state.work + count * middle.work,
        area=state.area + count * middle.area[stepping.law],
        beyond=state.beyond + count * middle.beyond[stepping.law],
        error=total,
        smoothing=state.smoothing + count * float(np.abs(taken - middle.depth[stepping.law]).max()),
        block=following,
        correction=max(state.correction, abs(factor)),
        log=np.vstack([state.log, row]),
        starts=starts,
    )
