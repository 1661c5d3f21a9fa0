"""How far a run may be trusted: the rows of the trust report, each with its number, its rule and a verdict.

The rules are those of the project's verification plan: energies balance against the impact's work (the train's rigid
kinetic energy would hide everything), hourglass energy, penalty, overclosures, step, chatter.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass, replace
from typing import NamedTuple

import numpy as np

from rail_fem.fe.mass_scaling import MassScaling
from rail_fem.result.trust import OF_IMPACT, last_known

GOOD, WARN, BAD = "good", "warning", "bad"


class Threshold(NamedTuple):
    """A row is good up to `warn`, bad above `bad`; the rule in words is made from these numbers."""

    warn: float
    bad: float

    @property
    def rule(self) -> str:
        """In words."""
        return f"< {self.warn * 100:g} %, bad above {self.bad * 100:g} %"


DEFORMING = "kinetic energy of deformation"
LIMITS = {
    "energy balance of the bodies": Threshold(0.02, 0.10),
    "energy balance of the contact": Threshold(0.02, 0.10),
    "hourglass energy, all bodies": Threshold(0.05, 0.15),
    "hourglass energy where it yielded": Threshold(0.05, 0.15),
    "penalty energy": Threshold(0.02, 0.10),
    "largest penetration": Threshold(0.05, 0.25),
    "mean penetration": Threshold(0.05, 0.25),
    "static load before the transfer": Threshold(0.02, 0.10),
    DEFORMING: Threshold(0.02, 0.10),
    "chatter": Threshold(0.01, 0.10),
    "ends of the travelling window": Threshold(0.01, 0.05),
}
DENT = 40e-3  # over which a wheel let go from rest comes to the depth of the groove that it rolls [m]
DRAG = 0.01  # of the load's work along the path: what a loss is held against at least; 2 % of it is a drag of 0.02 %
STOP_BALANCE = LIMITS["energy balance of the bodies"].bad  # of the impact's work: a run that loses more is stopped


@dataclass(frozen=True)
class TrustRow:
    """One row: what was looked at, the number, the number in words, the rule it is held to, the verdict, the number for
    a table, the limit up to which it is good."""

    name: str
    value: float
    shown: str
    rule: str
    verdict: str
    short: str = ""
    limit: float = float("nan")

    def plain(self) -> dict:
        return asdict(self)


def judged(name: str, value: float, shown: str) -> TrustRow:
    """A row of LIMITS; what is not known is bad."""
    limit = LIMITS[name]
    verdict = BAD if not value <= limit.bad else WARN if not value <= limit.warn else GOOD
    digits = _digits(value, limit)
    shown = shown.replace(f"{value:.2%}", f"{value:.{max(2, digits)}%}")
    return TrustRow(name, float(value), shown, limit.rule, verdict, f"{value:.{digits}%}", limit.warn)


def _digits(value: float, limit: Threshold) -> int:
    """Behind the point of a percentage, in as many as show on which side of both limits it lies."""
    side = lambda number: [np.sign(number - one) for one in limit]
    return next((n for n in range(1, 9) if side(round(value, n + 2)) == side(value)), 1)


def impact_work(contact_work: np.ndarray) -> float:
    """The work of the impact [J]: the range of the work that the contact forces do on the bodies, after settling.

    contact_work : (n,) work so far, in frames that travel with each body, so the train's kinetic energy has no part in
        it.
    """
    return float(np.ptp(contact_work)) if len(contact_work) > 2 else float("nan")


def balance_scale(work: float, load: float, path: float) -> float:
    """What the balances are held against [J]: the impact's work, or a hundredth of the work of the static load [N] as
    a force along the path [m] where that is more. Energy is lost along all of the path: over a small impact alone
    the same loss would count for more the better the shape. A drag of 0.1 %, where it is bad, is the least rolling
    resistance of wheels (0.1 to 0.2 %, recalled)."""
    return float(np.fmax(work, DRAG * load * abs(path)))


def chatter(history: dict[str, np.ndarray], element_time: float, settled: float) -> tuple[float, float]:
    """What the contact force does above half the frequency at which elements pass under the wheel: its share of the
    force's variance, and its root mean square over the mean force. The share alone would condemn steady running, where
    there is no other variance. NaN, NaN when not sampled so finely.

    element_time : in which the wheel passes an element [s];  settled : time from which rows count [s]
    """
    after = history["time"] > settled
    if after.sum() < 16:
        return float("nan"), float("nan")
    time, force = history["time"][after], history["force"][after]
    step = float(np.median(np.diff(time)))
    limit = 0.5 / element_time
    if limit >= 0.5 / step:
        return float("nan"), float("nan")
    window = np.hanning(len(force))
    power = np.abs(np.fft.rfft((force - force.mean()) * window)) ** 2
    high = power[np.fft.rfftfreq(len(force), step) > limit].sum()
    mean_square = 2 * high / len(force) / (window**2).sum()
    return float(high / max(power[1:].sum(), 1e-300)), float(np.sqrt(mean_square) / max(abs(force.mean()), 1e-300))


def mesh_noise(history: dict[str, np.ndarray], element_time: float, settled: float) -> float:
    """How far the largest force stands above its mean over the passage of one element, relative; NaN when not sampled
    so finely.

    That mean takes out exactly what repeats with the mesh as the wheel rolls from element to element, and of a smooth
    peak of duration T only (h / V T)^2. It says nothing about what the mesh gets wrong steadily: a patch too stiff, a
    blunted peak.
    """
    after = history["time"] > settled
    time, force = history["time"][after], history["force"][after]
    if (
        len(time) < 4
        or 2 * np.diff(time).max() > element_time
        or time[-1] - time[0] < 2 * element_time
        or not force.max() > 0
    ):
        return float("nan")
    work = np.append(0.0, np.cumsum(np.diff(time) * (force[1:] + force[:-1]) / 2))
    ends = time[(time - time[0]) >= element_time]
    mean = (np.interp(ends, time, work) - np.interp(ends - element_time, time, work)) / element_time
    return float(abs(force.max() - mean.max()) / force.max())


def report_rows(facts: dict) -> list[TrustRow]:
    """The trust report from the facts of a run (see rail_fem.fe.diagnostics.trust_facts)."""
    shares, work, internal, approach = (
        facts["shares"],
        facts["balance_scale"],
        facts["internal_energy"],
        facts["approach"],
    )
    against = f"the impact's work {work:.4g} J"
    if work > facts["impact_work"]:
        against = f"{work:.4g} J, a hundredth of the load along the path (the impact's work is less)"
    hourglass, penalty = last_known(shares["energy_hourglass"]), float(np.nanmax(shares["energy_contact"], initial=0.0))
    balance, loss = (last_known(shares[name]) for name in OF_IMPACT)
    largest, mean = facts["penetration"]
    share, force = facts["chatter"]
    return [
        judged("energy balance of the bodies", abs(balance), f"{balance * work:.3g} J, {balance:.2%} of {against}"),
        judged("energy balance of the contact", abs(loss), f"{loss * work:.3g} J, {loss:.2%} of {against}"),
        judged(
            "hourglass energy, all bodies",
            hourglass,
            f"{hourglass:.2%} of the largest internal energy {internal:.4g} J",
        ),
        judged(
            "hourglass energy where it yielded",
            facts["hourglass_zone"],
            f"{facts['hourglass_zone']:.2%} of the plastic work there",
        ),
        judged("penalty energy", penalty, f"at most {penalty:.2%} of the largest internal energy up to that moment"),
        judged(
            "largest penetration",
            largest / approach,
            f"overlap after a step {largest * 1e6:.2f} um at worst, {largest / approach:.2%} of the approach"
            f" {approach * 1e6:.0f} um under the static load",
        ),
        judged(
            "mean penetration",
            mean / approach,
            f"force-weighted mean of the overlap {mean * 1e6:.2f} um, {mean / approach:.2%} of the approach",
        ),
        TrustRow(
            "gap at the start",
            facts["initial_clearance"],
            f"meshes were {facts['initial_clearance'] * 1e6:+.1f} um apart on the rigid path; the wheel was moved by"
            " that much onto initial contact",
            "reported",
            GOOD,
        ),
        _static_row(facts["static_error"], facts["resting"], facts["transfers"]),
        TrustRow(
            "time step",
            facts["step"],
            f"{facts['step'] * 1e9:.1f} ns, {facts['step_ratio']:.2f} of the limit by Lanczos"
            f" ({facts['limit'] * 1e9:.1f} ns); smallest element bound {facts['element_limit'] * 1e9:.1f} ns;"
            f" re-checked {facts['rechecks']} times",
            "below the limit",
            GOOD,
        ),
        TrustRow(
            "share of a step outside the element kernels",
            facts["outside"],
            f"{facts['outside']:.1%} (contact, supports, exchange, records, waiting for other ranks)",
            "reported",
            GOOD,
        ),
        *_scaling_rows(facts["scaling"], *facts["deforming"]),
        _chatter_row(share, force, facts["penalty_factor"]),
        *_window_rows(facts["window"], work),
    ]


def worst_rows(passes: list[list[dict]]) -> list[dict]:
    """Of each row of the reports of several passes, as `plain` gives them, that of the pass where it is worst, with its
    number; rows that are good in all of them are the last one's."""
    worst = []
    for rows in zip(*passes, strict=True):
        rank = [((GOOD, WARN, BAD).index(row["verdict"]), row["value"]) for row in rows]
        k = max(range(len(rows)), key=lambda i: (rank[i][0], np.nan_to_num(rank[i][1], nan=np.inf)))
        bad = rank[k][0] > 0
        worst.append({**rows[k], "shown": f"pass {k + 1} of {len(rows)}: {rows[k]['shown']}"} if bad else rows[-1])
    return worst


def _static_row(error: float, resting: bool, transfers: bool) -> TrustRow:
    """A pass that begins in motion has no stretch under the static load, nor has one whose path bends right behind the
    settling."""
    name = "static load before the transfer"
    absent = "" if transfers else "; there is no transfer in this window"
    rule = LIMITS[name].rule
    if not resting:
        return TrustRow(
            name,
            float("nan"),
            f"the pass begins in motion, as rigid_hertz found it: its start is as wrong as that model{absent}",
            rule,
            GOOD,
        )
    if np.isnan(error):
        return TrustRow(
            name,
            error,
            f"not known: the rigid path bends within a patch's reach of where the wheel is let go{absent}",
            rule,
            WARN,
            "not known",
        )
    shown = f"mean force up to the first bend of the rigid path is {error:+.2%} off the static load{absent}"
    return judged(name, abs(error), shown if abs(error) <= LIMITS[name].warn else shown + _shallow_dent(error))


def _shallow_dent(error: float) -> str:
    """Why a pass from rest begins with too little force, and what to do; nothing where it has too much."""
    return (
        "; a wheel let go from rest stands in a dent shallower than the groove that it rolls: it sinks and loses up to"
        f" a fifth of its load, which is back after some {DENT * 1e3:.0f} mm: begin {DENT * 1e3:.0f} mm or more before"
        " what counts"
        if error < 0
        else ""
    )


def _window_rows(window: dict | None, work: float) -> list[TrustRow]:
    """What was lost where slabs left a travelling window; no row without one. window : energies [J], see
    rail_fem.fe.diagnostics.window_facts;  work : that balances are held against [J]"""
    if window is None:
        return []
    lost = abs(window["left_kinetic"]) / work if work else 0.0
    late = window["late_flow"] / window["plastic"] if window["plastic"] > 0 else 0.0
    shown = (
        f"kinetic energy that ended with slabs {lost:.2%} of {work:.4g} J, as the balances; plastic work in the last"
        f" slab before it left {late:.2%} of all; {window['left_elastic']:.3g} J stay behind as residual stress;"
        f" {window['share']:.0%} of the elements computed"
    )
    return [judged("ends of the travelling window", max(lost, late), shown)]


def _scaling_rows(scaling: MassScaling, mean: float, largest: float) -> list[TrustRow]:
    """What the elements weigh beyond steel, and whether their inertia shows."""
    added = scaling.added / sum(scaling.steel.values())
    bodies = ", ".join(
        f"{name} {m:.0f} of {scaling.bodies[name]:.0f} kg"
        if scaling.bodies[name] < np.inf
        else f"{name} {m:.0f} kg, held"
        for name, m in scaling.meshes.items()
    )
    small = scaling.least_step > 0
    waves = (
        f"the wheel rolls at {scaling.slowness:.3f} of the speed of waves in the elements under it"
        if small
        else f"a wave takes {scaling.transit:.2f} of the time that the patch takes to pass"
    )
    shown = (
        f"density{' of the smallest element' if small else ''} times {scaling.factor:.4g} ({scaling.why}):"
        f" {scaling.added:.0f} kg more in the meshes, with it {bodies}; as much less in the lumped masses of what"
        f" moves; {waves}"
        if scaling.factor > 1
        else "0 %: no mass scaling"
    )
    share, limit = (
        f"{mean:.2%} of the internal energy in the mean, largest over largest {largest:.2%}",
        LIMITS[DEFORMING].warn,
    )
    if scaling.factor > 1 and mean > limit:
        share += f"; it falls with the factor: take mass_scaling = {max(1.0, scaling.factor * limit / mean):.2g}"
    return [
        TrustRow(
            "added mass", added, shown, "rigid masses are the case's; chatter and waves are not those of steel", GOOD
        )
        if scaling.factor > 1
        else TrustRow("added mass", added, shown, "0 by default", GOOD),
        judged(DEFORMING, mean, share),
    ]


def _chatter_row(share: float, force: float, penalty: float) -> TrustRow:
    """Judged by the lesser of both: what is small against the force, or against its changes, does no harm."""
    worst = float(np.fmin(share, force)) if np.isfinite(share) else 0.0
    shown = f"{share:.2%} of the force's variance above half the mesh frequency, {force:.2%} of its mean"
    row = judged("chatter", worst, shown)
    return row if row.verdict == GOOD else replace(row, shown=f"{shown}; try penalty = {penalty / 3:.2g}")
