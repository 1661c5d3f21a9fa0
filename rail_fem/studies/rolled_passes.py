"""Thousands of passes of a line contact, most of them jumped over: strain with its error, verdict, cost, by pressure.

    rail-fem study ratchetting --passes 10000 --out ratchetting

The steel is `ratchetting.py`'s, by Abdel-Karim and Ohno's law with a mixing of 0.1. Beside the jumps the first thousand
passes are computed one by one at the depth that fares worst.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from bem.cycle_jumps import LEAST_FLOW, JumpRule
from bem.plastic.rolling_line import NoEquilibriumError, RollingHistory, rolling_line_contact
from bem.steel.cyclic_law import CyclicLaw
from rail_fem.show.panels import Panel
from rail_fem.show.table_and_figure import Table

TRACTION = 0.1
RATIOS = (3.2, 3.8, 4.2, 4.6, 5.0, 5.6)  # largest pressure over the shear yield stress
ALL_COMPUTED = 1000  # passes that are computed one by one, to compare
CONSTANT = 0.05  # exponent of the growth per pass below which it is called constant


class LongRun(NamedTuple):
    """jumped : all depths;  seconds : of the processor for it;  computed : the worst depth again, every pass computed,
    as far as ALL_COMPUTED;  computed_seconds"""

    ratio: float
    jumped: RollingHistory
    seconds: float
    computed: RollingHistory
    computed_seconds: float


class RefusedLoad(NamedTuple):
    """A load without equilibrium, and the sentence that says so."""

    ratio: float
    reason: str


def roll(
    law: CyclicLaw,
    ratio: float,
    shear_yield: float,
    half_width: float,
    depths: np.ndarray,
    passes: int,
    steps: int,
    tolerance: float,
) -> LongRun | RefusedLoad:
    """One pressure: passes with jumps at all depths, and all of the first ones at the worst depth."""
    load = (half_width, ratio * shear_yield, TRACTION)
    started = time.process_time()
    try:
        jumped = rolling_line_contact(law, *load, depths, passes, steps, JumpRule(tolerance))
    except NoEquilibriumError as reason:
        return RefusedLoad(ratio, str(reason))
    middle = time.process_time()
    computed = rolling_line_contact(
        law, *load, depths[jumped.worst : jumped.worst + 1], min(passes, ALL_COMPUTED), steps
    )
    return LongRun(ratio, jumped, middle - started, computed, time.process_time() - middle)


def roll_all(
    law, shear_yield, half_width, depths, passes, steps, tolerance, tell: Callable[[str], None]
) -> list[LongRun | RefusedLoad]:
    """All RATIOS; `tell` is called with a line after each."""
    found: list[LongRun | RefusedLoad] = []
    for number, ratio in enumerate(RATIOS, 1):
        found.append(roll(law, ratio, shear_yield, half_width, depths, passes, steps, tolerance))
        tell(f"[{number}/{len(RATIOS)}] p0 = {ratio:g} k: " + _said(found[-1]))
    return found


def _said(run: LongRun | RefusedLoad) -> str:
    return run.reason if isinstance(run, RefusedLoad) else in_words(run.jumped)


def in_words(history: RollingHistory) -> str:
    """Verdict, and how its growth goes on."""
    exponent = history.exponent()
    if np.isnan(exponent):
        return history.verdict_words()
    if abs(exponent) < CONSTANT:
        return f"{history.verdict_words()}, constant growth per pass"
    return f"{history.verdict_words()}, growth per pass goes with the passes to the power of {exponent:.2f}"


def table(found: list[LongRun | RefusedLoad]) -> Table:
    """A row for each pressure."""
    rows = []
    for run in found:
        if isinstance(run, RefusedLoad):
            rows.append([f"{run.ratio:g}", run.reason] + ["-"] * 7)
            continue
        h, w = run.jumped, run.jumped.worst
        passes = len(h.plastic_strain)
        apart = np.abs(h.plastic_strain[: len(run.computed.plastic_strain), w] - run.computed.plastic_strain[:, 0])
        bound = h.plastic_strain_error[: len(apart), w]
        top = max(float(run.computed.plastic_strain[-1, 0]), 1e-300)
        rows.append(
            [
                f"{run.ratio:g}",
                in_words(h),
                f"{h.depth[w] * 1e3:.2f}",
                f"{h.plastic_strain[-1, w]:.4g} +- {h.plastic_strain_error[-1, w]:.1g}",
                f"{h.shear[-1, w]:.4g} +- {h.shear_error[-1, w]:.1g}",
                f"{h.computed.sum()} of {passes * len(h.depth)}",
                f"{h.jumps.sum()}",
                f"{100 * apart.max() / top:.1g} %, {100 * bound.max() / top:.1g} %",
                f"{run.seconds:.1f}, {run.computed_seconds * passes / len(apart) * len(h.depth):.0f}",
            ]
        )
    head = ["p0 / k", "verdict", "worst depth [mm]", "plastic strain, cumulated", "forward shear strain"]
    first = max((len(run.computed.plastic_strain) for run in found if isinstance(run, LongRun)), default=0)
    head += ["passes computed at all depths", "jumps", f"error in the first {first}: true, estimated"]
    return Table(head + ["CPU s: with jumps, without (scaled)"], rows)


def panels(found: list[LongRun | RefusedLoad]) -> list[Panel]:
    """Cumulated plastic strain, forward shear, and the estimated error of the first, over the passes, at the depth that
    fares worst."""
    lines: list[dict[str, tuple]] = [{}, {}, {}]
    for run in found:
        if isinstance(run, LongRun) and run.jumped.plastic_strain[-1].max() > LEAST_FLOW:
            h, w = run.jumped, run.jumped.worst
            number, flow = np.arange(1, len(h.plastic_strain) + 1), h.plastic_strain[:, w]
            for own, value in zip(lines, (flow, np.abs(h.shear[:, w]), h.plastic_strain_error[:, w] / flow)):
                own[f"{run.ratio:g} k, {h.verdict()}"] = (number, value)
    words = "plastic strain, cumulated [1]", "forward shear strain [1]", "error of the jumps over the strain [1]"
    return [Panel("pass", label, own, log="xy") for label, own in zip(words, lines)]
