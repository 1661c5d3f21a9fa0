"""How far a run may be trusted: the rows of the trust report, each with its number, its rule and a verdict.

The rules are those of the project's verification plan: energies balance against the impact's work (the train's rigid
kinetic energy would hide everything), hourglass energy, penalty, overclosures, step, chatter.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass, replace

import numpy as np

GOOD, WARN, BAD = "good", "warning", "bad"


@dataclass(frozen=True)
class Row:
    """One row: what was looked at, the number in words, the rule it is held to, the verdict."""

    name: str
    value: float
    shown: str
    rule: str
    verdict: str

    def plain(self) -> dict:
        return asdict(self)


def judged(name: str, value: float, shown: str, rule: str, warn: float, bad: float) -> Row:
    verdict = BAD if not value <= bad else WARN if not value <= warn else GOOD
    return Row(name, float(value), shown, rule, verdict)


def impact_work(contact_work: np.ndarray) -> float:
    """The work of the impact [J]: the range of the work that the contact forces do on the bodies, after settling.

    contact_work : (n,) work so far, in frames that travel with each body, so the train's kinetic energy has no part in it.
    """
    return float(np.ptp(contact_work)) if len(contact_work) > 2 else float("nan")


def chatter(history: dict[str, np.ndarray], speed: float, element_size: float, settled: float) -> tuple[float, float]:
    """What the contact force does above half the frequency at which elements pass under the wheel: its share of the force's variance,
    and its root mean square over the mean force. The share alone would condemn steady running, where there is no other variance.
    NaN, NaN when not sampled so finely."""
    after = history["time"] > settled
    if after.sum() < 16:
        return float("nan"), float("nan")
    time, force = history["time"][after], history["force"][after]
    step = float(np.median(np.diff(time)))
    limit = 0.5 * abs(speed) / element_size
    if limit >= 0.5 / step:
        return float("nan"), float("nan")
    window = np.hanning(len(force))
    power = np.abs(np.fft.rfft((force - force.mean()) * window)) ** 2
    high = power[np.fft.rfftfreq(len(force), step) > limit].sum()
    mean_square = 2 * high / len(force) / (window**2).sum()
    return float(high / max(power[1:].sum(), 1e-300)), float(np.sqrt(mean_square) / max(abs(force.mean()), 1e-300))


def mesh_noise(history: dict[str, np.ndarray], speed: float, element_size: float, settled: float) -> float:
    """How far the largest force stands above its mean over the passage of one element, relative; NaN when not sampled so finely.

    That mean takes out exactly what repeats with the mesh as the wheel rolls from element to element, and of a smooth peak of
    duration T only (h / V T)^2. It says nothing about what the mesh gets wrong steadily: a patch too stiff, a blunted peak.
    """
    after = history["time"] > settled
    time, force = history["time"][after], history["force"][after]
    period = element_size / abs(speed)
    if len(time) < 4 or 2 * np.diff(time).max() > period or time[-1] - time[0] < 2 * period or not force.max() > 0:
        return float("nan")
    work = np.append(0.0, np.cumsum(np.diff(time) * (force[1:] + force[:-1]) / 2))
    ends = time[(time - time[0]) >= period]
    mean = (np.interp(ends, time, work) - np.interp(ends - period, time, work)) / period
    return float(abs(force.max() - mean.max()) / force.max())


def report_rows(facts: dict) -> list[Row]:
    """The trust report from the facts of a run (see rail_fem.fe.findings.trust_facts)."""
    work = facts["impact_work"]
    internal = max(facts["internal_energy"], 1e-12)
    balance, loss = abs(facts["balance"]) / work, abs(facts["contact_loss"]) / work
    return [
        judged("energy balance of the bodies", balance, f"{facts['balance']:.3g} J, {balance:.2%} of the impact's work {work:.4g} J", "< 1 %, stop at 10 %", 0.02, 0.10),
        judged("energy balance of the contact", loss, f"{facts['contact_loss']:.3g} J, {loss:.2%} of the impact's work", "< 2 %", 0.02, 0.10),
        judged("hourglass energy, all bodies", facts["hourglass"] / internal, f"{facts['hourglass']:.3g} J of {internal:.4g} J internal, {facts['hourglass'] / internal:.2%}", "< 5 %", 0.05, 0.15),
        judged("hourglass energy where it yielded", facts["hourglass_zone"], f"{facts['hourglass_zone']:.2%} of the internal energy there", "< 5 %", 0.05, 0.15),
        judged("penalty energy", facts["penalty"] / internal, f"{facts['penalty']:.3g} J at most, {facts['penalty'] / internal:.2%} of the internal energy", "< 2 %", 0.02, 0.10),
        judged("largest penetration", facts["penetration"] / facts["approach"], f"{facts['penetration'] * 1e6:.2f} um, {facts['penetration'] / facts['approach']:.2%} of the approach {facts['approach'] * 1e6:.0f} um under the static load", "< 5 %", 0.05, 0.25),
        Row("gap at the start", facts["first_gap"], f"meshes were {facts['first_gap'] * 1e6:+.1f} um apart on the rigid path; the wheel was moved by that much onto first touch", "reported", GOOD),
        _static_row(facts["static_error"], facts["resting"]),
        Row("time step", facts["step"], f"{facts['step'] * 1e9:.1f} ns, {facts['step_ratio']:.2f} of the limit by Lanczos ({facts['limit'] * 1e9:.1f} ns); smallest element bound {facts['element_limit'] * 1e9:.1f} ns; re-checked {facts['rechecks']} times", "below the limit", GOOD),
        Row("share of a step outside the element kernels", facts["outside"], f"{facts['outside']:.1%} (contact, supports, exchange, records, waiting for other ranks)", "reported", GOOD),
        Row("added mass", 0.0, "0 %: no mass scaling", "0 by default", GOOD),
        _chatter_row(*facts["chatter"], facts["penalty_factor"]),
    ]  # fmt: skip


def _static_row(error: float, resting: bool) -> Row:
    """A pass that begins in motion has no stretch under the static load."""
    name, rule = "static load before the nose", "< 2 %"
    if not resting:
        return Row(name, float("nan"), "the pass begins in motion, as rigid_hertz found it: its start is as wrong as that rung", rule, GOOD)
    return judged(name, abs(error), f"mean force before the first transfer is {error:+.2%} off the static load", rule, 0.02, 0.10)


def _chatter_row(share: float, force: float, penalty: float) -> Row:
    """Judged by the lesser of both: what is small against the force, or against its changes, does no harm."""
    worst = float(np.fmin(share, force)) if np.isfinite(share) else 0.0
    shown = f"{share:.2%} of the force's variance above half the mesh frequency, {force:.2%} of its mean"
    row = judged("chatter", worst, shown, "either < 1 %", 0.01, 0.10)
    return row if row.verdict == GOOD else replace(row, shown=f"{shown}; try penalty = {penalty / 3:.2g}")


def show_rows(rows: list[Row], slowest: list[str]) -> str:
    """The report as text."""
    width = max(len(row.name) for row in rows)
    lines = ["how far to trust this run"] + [f"  {row.verdict:8s} {row.name:{width}s}  {row.shown}  (rule: {row.rule})" for row in rows]
    if slowest:
        lines += ["  elements with the smallest stable step:"] + [f"    {text}" for text in slowest]
    return "\n".join(lines) + "\n"
