"""A shape that changes while wheels pass, a section's line or a crossing's surfaces: passes in blocks, each on the
shape at its middle.

In a block the wear rate is taken where it begins, at its middle (on the shape worn by half of it) and at its end; all
of the block wears at the rate of the middle (midpoint rule, second order). Two thirds of the difference to what it
would have worn at the mean of both ends bound its error: where the rate changes by itself it is a third (that of the
trapezoidal rule is minus twice the midpoint rule's), where it goes linearly with the shape two thirds, since the
middle's shape comes from the first rate: h^3 r''/24 + h^3 r''/8 = h^3 r''/6, of a difference of h^3 r''/4.
Blocks are whole passes, as long as half of the bound stays below the tolerance, or as long as told; a told one is
shortened where no shape can take it, and a section's where its error is beyond the tolerance of the deepest wear so
far, for a new corner wears in much faster than it then wears. The end's rate is the next block's first.
Plastic flow, where there is any, goes before the wear of a block, by the grooves that were still to press where it
began, in closed form; where it is deep the block ends sooner, as the contacts move with it.
Source of the midpoint rule: Hairer, Norsett, Wanner, Solving Ordinary Differential Equations I (1993), II.1.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from geometry.surfaces.bodies import CrossingError
from geometry.wheelset import WheelsetError
from rail_fem.damage.traffic import Event
from rail_fem.damage.worn_profile import WornOutError, WornProfile
from rail_fem.damage.worn_surface import WornSurface
from rail_fem.settings.damage import FLOW_STEP

TOLERANCE = 0.01  # of the depth, that halving a block may change
LARGEST = 4.0  # times the block before
SHALLOW = 0.1e-6  # deepest wear of a first block [m]
LEAST_SHARE = 0.02  # of the passes done, that a block is long at least
MOST_BLOCKS = 5000
ROUGHER = 2.0  # times the force of the first block: steel that flows so far roughens, which no groove's law holds for


@dataclass(frozen=True, eq=False)
class Rate:
    """What a mean pass wears off a shape: depth (...) [m] by law, removed [m2 or m3] by law as the strips have it, what
    of it lay beyond the shape, friction work per area (...) [J/m2], crack damage (...) of each place by the contacts on
    it;  kinds : each kind of pass, (share, what it did: `facts` of its patches, largest `force` on each part [N],
    `hardest` patch of each part)"""

    depth: dict[str, np.ndarray]
    removed: dict[str, float]
    beyond: dict[str, float]
    work: np.ndarray
    crack: np.ndarray
    kinds: tuple[tuple[float, Any], ...]

    @property
    def tgamma(self) -> tuple[np.ndarray, np.ndarray]:
        """T gamma (k,) [N] of all patches, and the shares of their passes (k,)."""
        values = [own.facts.tgamma for _, own in self.kinds]
        shares = np.repeat([share for share, _ in self.kinds], [len(v) for v in values])
        return (np.concatenate(values), shares) if len(shares) else (np.zeros(1), np.ones(1))

    @property
    def wheels(self) -> np.ndarray | float:
        """(kinds, laws, 2, n) mean depths that wheels of each kind lose in one pass of theirs [m]; 0 on a section."""
        return 0.0

    @property
    def largest_force(self) -> float:
        """On any part by any wheel [N]."""
        return float(max(max(own.force) for _, own in self.kinds))


class Site:
    """What passes; beside these methods a site has its laws by name in `laws`, `first` gives its shape before any pass,
    `rate` what a mean pass wears off a shape. Here it remembers nothing and its steel does not flow."""

    laws: Any

    @property
    def starts(self) -> np.ndarray:
        """(k,) from which it looks for its states next, part of what a restart needs."""
        return np.zeros(0)

    def start_from(self, starts: np.ndarray) -> None:
        """Look for them from there, NaN: without a first guess."""

    def forget(self) -> None:
        """Look for the next as before any pass."""
        self.start_from(np.full(self.starts.shape, np.nan))

    def first(self) -> Any:
        raise NotImplementedError

    def rate(self, shape: Any) -> Any:
        raise NotImplementedError

    def flowed(self, shape: Any, rate: Any, passes: float) -> Any:
        """The shape after the plastic flow of some passes at a rate."""
        return shape

    def flow_passes(self, rate: Any, depth: float) -> float:
        """Passes in which it flows by a depth [m]; inf where it never does."""
        return float("inf")


@dataclass(frozen=True, eq=False)
class Evolution:
    """A shape after `passes`.

    worn : the shape;  first : before;  depth : (...) worn off by the leading law [m], per length of a line or, of
    surfaces, vertically per plan area;  by_law : the same for each law, all on the leading law's shapes
    work : (...) friction work per area [J/m2];  crack : (...) crack index of each place, 1 is a visible crack, by the
    contacts on it and no other: what wears there takes away its own cracks alone, and none below 0;  removed : the
    strips' own sum for the leading law, of a line [m2], of surfaces [m3];  beyond : what of it lay beyond the shape;
    error : (...) bound of the blocks' error [m]
    smoothing : largest change of a depth by smoothing [m]
    block : next block's passes;  correction : largest |factor - 1| that met an area;  log : rows of passes, deepest
    [m], T gamma largest and mean [N], blocks' error [m], largest force [N], deepest flow [m];  starts : (k,) lateral
    positions [m] from which the state's own rate is found, so that a study gone on with is the same to the last bit
    wheels : depths (...) that a wheel of each kind would have lost, had it made all the passes [m]
    lost : height ground off before [m];  resets : grindings and weldings so far;  began : passes at the last of them,
    since which all but passes and log count
    """

    worn: Any  # a WornProfile or WornSurface, as its site's
    first: Any
    passes: float
    depth: np.ndarray
    by_law: dict[str, np.ndarray]
    work: np.ndarray
    crack: np.ndarray
    removed: float
    beyond: float
    error: np.ndarray
    smoothing: float
    block: float
    correction: float
    log: np.ndarray
    starts: np.ndarray
    wheels: np.ndarray | float = 0.0
    lost: float = 0.0
    resets: float = 0.0
    began: float = 0.0

    @property
    def deepest(self) -> float:
        """Largest depth [m]."""
        return float(self.depth.max())

    @property
    def block_error(self) -> float:
        """Largest error of the blocks over the largest depth."""
        return float(self.error.max() / self.depth.max()) if self.depth.max() > 0 else 0.0


def begin(site: Site) -> Evolution:
    """Before any pass."""
    first = site.first()
    zero = np.zeros(first.shape)
    laws = dict.fromkeys(site.laws, zero)
    return Evolution(
        first, first, 0.0, zero, laws, zero, zero, 0.0, 0.0, zero, 0.0, 0.0, 0.0, np.zeros((0, 7)), site.starts
    )


@dataclass(frozen=True)
class Stepping:
    """How passes are taken in blocks. law : that changes the shape;  block : passes, None: by tolerance;  smoothing :
    standard deviation of depths [m];  limit : depth at which the shape is worn through [m];  least_share : of the
    passes done, that a block is long at least: a rate that jumps, as a point comes or goes, is not met by ever shorter
    blocks, its error is kept instead;  deepest : that one block may wear off [m];  events : (passes, event) of
    grindings and weldings, in their order;  flow_step : deepest plastic flow of one block [m], however short it gets:
    flow is not taken back, so that what a block presses too far stays;  told_tolerance : error of a told block, of the
    deepest wear at its end, beyond which it is shortened"""

    law: str = "archard"
    block: float | None = None
    tolerance: float = TOLERANCE
    smoothing: float = 0.25e-3
    limit: float = 10e-3
    least_share: float = LEAST_SHARE
    deepest: float = np.inf
    events: tuple[tuple[float, Event], ...] = ()
    flow_step: float = FLOW_STEP
    told_tolerance: float = np.inf


def evolve(site: Site, passes: float, stepping: Stepping, start: Evolution | None = None) -> Iterator[Evolution]:
    """Wear the site by `passes` passes in all; yields the state after each block.

    Raises WornOutError where it is worn through, ValueError for a study that would need more than MOST_BLOCKS blocks.
    """
    state = begin(site) if start is None else start
    rate = None
    for _ in range(MOST_BLOCKS):
        left = passes - state.passes
        if left <= 1e-9 * max(passes, 1.0):
            return
        coming = stepping.events[int(state.resets) :]
        if coming and coming[0][0] - state.passes <= 1e-9 * max(passes, 1.0):
            state, rate = reset(site, state, coming[0][1]), None
            continue
        left = min(left, coming[0][0] - state.passes) if coming else left
        rate = site.rate(state.worn) if rate is None else rate
        state, rate = _block(site, state, rate, left, stepping)
        yield state
    raise ValueError(
        f"{passes:g} passes need more than {MOST_BLOCKS} blocks, {state.passes:g} are done, {state.deepest * 1e3:.3g}"
        " mm deep: ask for fewer passes, or a larger tolerance"
    )


def _block(site: Site, state: Evolution, rate: Rate, left: float, stepping: Stepping) -> tuple[Evolution, Rate | None]:
    """One accepted block, and the rate at its end where it is known. Raises WornOutError."""
    law = stepping.law
    rough = rate.depth[law]
    most = max(stepping.deepest / max(float(rough.max()), 1e-30), 1.0)
    least = min(max(1.0, stepping.least_share * (state.passes - state.began)), most)
    told = stepping.block
    count = min(told, state.block or told) if told else max(state.block or _first_block(rough), least)
    runs_in = site.flow_passes(rate, stepping.flow_step)
    count, least = min(count, runs_in), min(least, runs_in)
    while True:
        count = min(count, left) if told else min(count, left, most)
        count = float(np.floor(count)) if 1 < count < left else count
        smooth = state.worn.smoothed(rough, stepping.smoothing)
        try:
            half, _ = site.flowed(state.worn, rate, count / 2).worn(smooth * (count / 2))
            middle = site.rate(half)
            taken = state.worn.smoothed(middle.depth[law], stepping.smoothing)
            new, factor = site.flowed(state.worn, rate, count).worn(taken * count)
            starts = site.starts
            end = site.rate(new)
        except (WornOutError, WheelsetError, CrossingError):
            # a block far too long may cross a line with itself, or leave a shape on which nothing stands
            if count * rough.max() < SHALLOW:
                raise
            count /= 4
            continue
        last = new.smoothed(end.depth[law], stepping.smoothing)
        error = np.abs((smooth + last) / 2 - taken) * (2 * count / 3)
        share, deepest = (
            (stepping.told_tolerance, state.depth + taken * count) if told else (stepping.tolerance, taken * count)
        )
        allowed = 2 * share * max(deepest.max(), 1e-30)
        if error.max() <= allowed or count <= least:
            break
        count = max(count * max(0.8 * (allowed / error.max()) ** 0.5, 0.2), least)
    following = count * (min(0.8 * (allowed / error.max()) ** 0.5, LARGEST) if error.any() else LARGEST)
    following = min(told, following) if told else following
    return _after(state, middle, new, taken, error, count, following, factor, starts, stepping), end


def reset(site: Site, state: Evolution, event: Event) -> Evolution:
    """After grinding or welding: the first shape again, without wear and cracks. Grinding goes down to the deepest
    wear and takes off its own depth below; welding gives all height back."""
    lost = event.keeps_depth * (state.lost + state.deepest) + event.removes
    site.forget()
    done = {"passes": state.passes, "began": state.passes, "log": state.log}
    return replace(begin(site), **done, lost=lost, resets=state.resets + 1)


def _first_block(rough: np.ndarray) -> float:
    deepest = rough.max()
    return max(SHALLOW / deepest, 1.0) * 10 if deepest > 0 else np.inf


def _after(
    state: Evolution,
    middle: Rate,
    new: WornProfile | WornSurface,
    taken: np.ndarray,
    error: np.ndarray,
    count: float,
    following: float,
    factor: float,
    starts: np.ndarray,
    stepping: Stepping,
) -> Evolution:
    deepest = new.deepest_from(state.first)
    if deepest + state.lost > stepping.limit:
        raise WornOutError(
            f"{new.label}: worn {(deepest + state.lost) * 1e3:.2f} mm deep after {state.passes + count:.6g} passes, the"
            f" limit is {stepping.limit * 1e3:.2f} mm"
        )
    first_force = state.log[0, 5] if len(state.log) else middle.largest_force
    if new.flow_depth > 0 and middle.largest_force > ROUGHER * first_force:
        raise WornOutError(
            f"{new.label}: after {state.passes:.6g} passes the steel has flowed {state.worn.flow_depth * 1e3:.2f} mm"
            f" deep and the largest force has grown from {first_force / 1e3:.0f} to"
            f" {middle.largest_force / 1e3:.0f} kN: the shape roughens pass by pass, for which the groove's law was"
            " never compared with anything. What is there stands; for more passes begin from a run's surface (`flow`),"
            " or leave out plastic_flow or the kind of wheel that strikes"
        )
    depth = state.depth + taken * count
    tgamma, shares = middle.tgamma
    total = state.error + error
    row = [state.passes + count, depth.max(), tgamma.max(), np.average(tgamma, weights=shares), total.max()]
    row += [middle.largest_force, new.flow_depth]
    return replace(
        state,
        worn=new,
        passes=state.passes + count,
        depth=depth,
        by_law={name: state.by_law[name] + count * middle.depth[name] for name in state.by_law},
        work=state.work + count * middle.work,
        crack=np.maximum(state.crack + count * middle.crack, 0.0),
        wheels=state.wheels + count * middle.wheels,
        removed=state.removed + count * middle.removed[stepping.law],
        beyond=state.beyond + count * middle.beyond[stepping.law],
        error=total,
        smoothing=state.smoothing + count * float(np.abs(taken - middle.depth[stepping.law]).max()),
        block=following,
        correction=max(state.correction, abs(factor)),
        log=np.vstack([state.log, row]),
        starts=starts,
    )
