"""Many equal cycles of a load for the price of some: cycles are computed, others are jumped over.

A window of cycles is computed. Its end says how fast the state grows per cycle, r, and how fast that changes, d. What
may grow for ever (strains) is extrapolated over the next m cycles by second order,
    y(N + m) = y(N) + m r + m (m + 1) / 2 d;
what must settle (stresses) as if each cycle of the window had made its growth from that of the one before by a linear
map that shrinks: geometric series, which stay finite however long the jump (by second order a mode that has settled
would grow from jump to jump). Another window is computed from there. Its growth makes another d: m (m + 1) / 2 times
the difference of the two is what the jump missed, twice that its error: what settles slowly lags behind a jump and
takes the growth found there with it, more so by shorter windows (of 4 cycles: errors of up to twice this). A
jump with too large an error is taken back and made shorter. Extrapolation keeps what is linear in the state
(equilibrium, compatibility, a trace of zero); what is not (yield surface, bounds of back stresses) `admit` puts right,
and what that changes is error, too.

Sources: jumps by the change of the slope from cycle to cycle are those of Cojocaru and Karlsson, Int. J. Fatigue 28
(2006) 1677, second-order ones those of Lesne and Savalle (1989): both recalled, not opened. Read was how a public
manual describes the first (Ansys, Advanced Analysis Guide, "Cycle-Jump Analysis"): three equal points of the last
cycles, two slopes, no jump over which the slope would change by more than a given part, `steepest` here. Treatment of
what settles, error and taking back are own. Held: tests/bem/test_cycle_jumps.py, tests/rail_fem/test_rolling_jumps.py.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

VERDICTS = ("elastic", "elastic shakedown", "plastic shakedown", "ratchetting", "not told by so few cycles")
LEAST_CYCLES = 4  # that flow, for a verdict: what stays of the first is no measure of the others
LEAST_FLOW = 1e-7  # plastic strain of a cycle below which a body has come to rest
CELL_ERROR = 0.005  # over the flow, of what cells of a half-space leave of a cycle that closes; found 0.002
_STILL = 1e-13  # growth in a cycle that is round-off
_SURE = 2.0  # error over what a jump is found to have missed
_BARELY = 1e-6  # of the largest: a direction that is noise
_SMALL = 1e-3  # of the largest measure: below it a measure is judged as if it were so large


def verdict(flow: np.ndarray, stays: np.ndarray, least: float = LEAST_FLOW, error: float = 0.0) -> str:
    """What a cycle that is repeated does to a body: the one rule for points and half-spaces.

    flow : (n,) growth of the equivalent plastic strain in each cycle, where it is largest in the last;  stays : (n,)
    equivalent plastic strain that each leaves there when it has closed;  error : of that, over the flow
    At rest where the last flows by at most `least`. Else it ratchets where what stays is above `least` and the error,
    and has not fallen to half of what it was half as many cycles ago: what falls no faster than 1 / n has no finite
    sum, whatever flows to and fro beside it; what a closing cycle leaves falls geometrically. Fewer than LEAST_CYCLES
    that flow tell neither.
    """
    if flow[-1] <= least:
        return VERDICTS[1] if np.sum(flow) > least else VERDICTS[0]
    if len(flow) < LEAST_CYCLES:
        return VERDICTS[4]
    return VERDICTS[3 if stays[-1] > max(least, error * flow[-1], _half(stays)) else 2]


def verdict_words(flow: np.ndarray, stays: np.ndarray, least: float = LEAST_FLOW, error: float = 0.0) -> str:
    """The verdict with the growth on which it stands, or the threshold that made it."""
    word, many, known = verdict(flow, stays, least, error), 10_000, max(least, error * flow[-1])
    if flow[-1] <= least:
        return f"{word} (a cycle flows at most {least:g})"
    if word == VERDICTS[4]:
        last = f"{stays[-1]:.2g} of plastic strain stays of the last, {flow[-1]:.2g} flows"
        return f"shakedown or ratchetting is {word} ({last})"
    grows = f"{stays[-1]:.2g} of plastic strain stays a cycle, {many * stays[-1]:.2g} in {many:,} at that rate"
    if word == VERDICTS[2]:
        grows += ", and it falls away" if stays[-1] <= _half(stays) else f": below {known:.1g} it is not told from none"
    return f"{word} ({grows}; {flow[-1]:.2g} flows)"


def _half(stays: np.ndarray) -> float:
    """Half of what stayed half as many cycles ago."""
    return float(stays[max(len(stays) // 2, 1) - 1]) / 2


class JumpRule(NamedTuple):
    """tolerance : error of all jumps together over the growth of each measure, of which a jump may take its part;
    window : cycles computed at least between two jumps;  steepest : largest change of the growth per cycle over a jump,
    as part of it;  longest : cycles of a jump over the cycles before it, 0 for no jumps"""

    tolerance: float = 0.01
    window: int = 6
    steepest: float = 0.5
    longest: float = 1.0


NO_JUMPS = JumpRule(longest=0.0)


class Jump(NamedTuple):
    """after : cycles before it;  cycles : jumped;  rate, change : (g, w) growth per cycle of the measures before it and
    its change;  landed : (g, w) measures behind it"""

    after: int
    cycles: int
    rate: np.ndarray
    change: np.ndarray
    landed: np.ndarray


class CycleHistory(NamedTuple):
    """number : (c,) cycles computed, from 0, the start;  measures : (c, g, w) after each;  error : (c, j) of those
    that are judged, all jumps so far together;  state : (n,) at the end;  jumps;  computed : cycles computed in all,
    also behind jumps that were taken back"""

    number: np.ndarray
    measures: np.ndarray
    error: np.ndarray
    state: np.ndarray
    jumps: tuple[Jump, ...]
    computed: int

    def after_each(self) -> tuple[np.ndarray, np.ndarray]:
        """(cycles, g, w) measures and (cycles, j) errors after each cycle, jumps filled by what extrapolated them."""
        count = int(self.number[-1]) + 1
        measures = np.empty((count, *self.measures.shape[1:]))
        measures[self.number] = self.measures
        error = np.stack([np.interp(np.arange(count), self.number, e) for e in self.error.T], axis=1)
        for jump in self.jumps:
            step = np.arange(1, jump.cycles + 1)[:, None, None]
            there = measures[jump.after] + step * jump.rate + step * (step + 1) / 2 * jump.change
            there = there + (jump.landed - there[-1]) * step / jump.cycles
            measures[jump.after + 1 : jump.after + jump.cycles + 1] = there
        return measures[1:], error[1:]


def run_cycles(
    cycle: Callable[[np.ndarray, int], np.ndarray],
    state: np.ndarray,
    cycles: int,
    measure: Callable[[np.ndarray], np.ndarray],
    drifts: int,
    rule: JumpRule = JumpRule(),
    judged: int | None = None,
    admit: Callable[[np.ndarray], np.ndarray] | None = None,
    cannot: type[Exception] = ArithmeticError,
) -> CycleHistory:
    """`cycles` of a load on a state.

    cycle   : state (n,) and number, from 1, to the state after it; inputs are not modified
    drifts  : the first so many of the state may grow for ever, the others settle and are of one unit
    measure : (g, w), linear in the state: g measures at w places, of each the largest place counts; the first `judged`
        (all) are strains that drift, by which jumps are judged, the others are followed
    admit   : brings an extrapolated state within what the body can bear
    cannot  : raised by `cycle` or `admit` where no state follows: a jump that leads there is taken back
    Ends early, with nothing left to change, where a cycle changes no measure. Otherwise the last window is computed.
    Errors: what `cycle` raises where no jump led there; ValueError for bad numbers.
    """
    if cycles < 1 or not (0 < rule.tolerance < 1 and rule.window >= 3 and rule.steepest > 0 and rule.longest >= 0):
        raise ValueError(f"{cycles} cycles by {rule}: at least 1, tolerance within 0 and 1, a window of 3 or more")
    run = _Run(cycle, state, cycles, measure, drifts, rule, judged, admit or (lambda state: state))
    while run.last.end < cycles and not run.still():
        length = run.length()
        if length >= rule.window:
            run.jump(length, cannot)
        else:
            run.keep(run.window(run.last.state, run.last.end))
            run.bound = 2 * max(run.bound, rule.window)
    return run.history()


class _Window(NamedTuple):
    """A window of computed cycles: its end, the state there, its growth in the last cycle and the change of that since
    the cycle before; growth (k, n) of what settles and measures (k, g, w) in and after each cycle"""

    end: int
    state: np.ndarray
    rate: np.ndarray
    local: np.ndarray
    settling: np.ndarray
    measures: np.ndarray


class _Run:
    """The cycles so far."""

    def __init__(self, cycle, state, cycles, measure, drifts, rule, judged, admit) -> None:
        self._cycle, self.cycles, self._measure, self.drifts = cycle, cycles, measure, drifts
        self.rule, self.judged, self._admit = rule, judged, admit
        self.jumps: list[Jump] = []
        self.computed = 0
        self.bound = np.inf  # on the next jump, by what the last one missed
        first = measure(state)
        none = np.zeros_like(state)
        self.number, self.measures, self.error = [0], [first], [0 * self._size(first)]
        self.total = self.error[0]  # largest growth of each measure so far
        self.last = _Window(0, state, none, none, none[None], first[None])
        self.keep(self.window(state, 0))

    def window(self, state: np.ndarray, begin: int) -> _Window:
        """A window of cycles from a state, shorter where the end is near."""
        rate, before, measures, settling = np.zeros_like(state), np.zeros_like(state), [], []
        for number in range(begin + 1, min(begin + self.rule.window, self.cycles) + 1):
            new = self._cycle(state, number)
            self.computed += 1
            state, before, rate = new, rate, new - state
            measures.append(self._measure(state))
            settling.append(rate[self.drifts :])
        end = begin + len(measures)
        return _Window(end, state, rate, rate - before, np.array(settling), np.array(measures))

    def keep(self, window: _Window, error: np.ndarray | float = 0.0) -> None:
        self.number += range(window.end - len(window.measures) + 1, window.end + 1)
        self.measures += list(window.measures)
        self.error += [self.error[-1] + error] * len(window.measures)
        self.total = np.maximum(self.total, self._size(window.measures - self.measures[0]).max(axis=0))
        self.gap = window.end - self.last.end
        self.change = (window.rate - self.last.rate) / self.gap
        self.last = window

    def still(self) -> bool:
        return bool(self._size(self._measure(self.last.rate)).max() <= _STILL)

    def length(self) -> int:
        """The next jump: the longest that the rules allow, 0 for none."""
        rule, end = self.rule, self.last.end
        longest = min(self.cycles - end - rule.window, rule.longest * end, self.bound)
        rate, change = self._size(self._measure(self.last.rate)), self._size(self._measure(self.last.local))
        matters = rate * self.cycles > rule.tolerance * self._total()  # else it may vanish or turn as it will
        if change[matters].any():
            longest = min(longest, rule.steepest * (rate[matters] / np.maximum(change[matters], 1e-300)).min())
        length = max(int(longest), 0)
        bent = self._size(self._measure(self.last.local - self.change)) / self.gap
        while length >= rule.window:
            missed = length * (length + 1) / 2 * (length + rule.window) * bent
            if (missed <= self._allowed(length, rate)).all():
                return length
            length = 4 * length // 5
        return 0

    def jump(self, length: int, cannot: type[Exception]) -> None:
        """Jump, compute a window, keep it if the error is small enough."""
        last, drifts = self.last, self.drifts
        landed = last.state + length * last.rate + length * (length + 1) / 2 * last.local
        landed[drifts:] = last.state[drifts:] + _settling(last.settling, length)
        try:
            state = self._admit(landed)
            window = self.window(state, last.end + length)
        except cannot:
            self.bound = length / 3
            return
        found = (window.rate - last.rate) / (window.end - last.end)
        error = _SURE * length * (length + 1) / 2 * self._size(self._measure(found - last.local))
        error = error + self._size(self._measure(state - landed))
        rate, change = self._measure(last.rate), self._measure(last.local)
        share = float((error / self._allowed(length, self._size(rate))).max())
        self.bound = length * min(max(0.8 / np.sqrt(max(share, 1e-300)), 0.3), 3.0)
        if not share <= 1.0:
            return
        self.jumps.append(Jump(last.end, length, rate, change, self._measure(state)))
        self.keep(window, error)

    def _total(self) -> np.ndarray:
        return np.maximum(self.total, _SMALL * self.total.max())

    def _allowed(self, length: int, rate: np.ndarray) -> np.ndarray:
        """(j,) error that a jump may have: a half by what grows in it, a half by its part of all cycles."""
        return self.rule.tolerance / 2 * length * (rate + self._total() / self.cycles) + _STILL * length

    def _size(self, measures: np.ndarray) -> np.ndarray:
        """(..., j) largest of (..., g, w)."""
        return np.abs(measures[..., : self.judged, :]).max(axis=-1)

    def history(self) -> CycleHistory:
        left = self.cycles - self.number[-1]
        if left > 0:  # at rest: nothing changes any more
            here, zero = self.measures[-1], 0 * self.measures[-1]
            self.jumps.append(Jump(self.number[-1], left, zero, zero, here))
            self.keep(self.last._replace(end=self.cycles, measures=here[None]))
        made = np.array(self.number), np.array(self.measures), np.array(self.error)
        return CycleHistory(*made, self.last.state, tuple(self.jumps), self.computed)


def _settling(rates: np.ndarray, length: int) -> np.ndarray:
    """What is still to come in `length` cycles of what settles, from its growth (k, n) in k cycles in a row: a linear
    map makes each from the one before, in the space of all but the last; a mode that does not shrink goes on as it is.
    """
    base, size, turn = np.linalg.svd(rates[:-1].T, full_matrices=False)
    kept = size > _BARELY * size.max(initial=0.0)
    if not kept.any():
        return np.zeros(rates.shape[1])
    base, size, turn = base[:, kept], size[kept], turn[kept]
    factor, mode = np.linalg.eig(base.T @ rates[1:].T @ (turn.T / size))
    factor = factor / np.maximum(np.abs(factor), 1.0)
    stays = np.abs(1 - factor) < 1e-9
    series = np.where(stays, length, factor * (1 - factor**length) / np.where(stays, 1.0, 1 - factor))
    return base @ (mode @ (series * np.linalg.solve(mode, base.T @ rates[-1]))).real
