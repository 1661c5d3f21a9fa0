"""How far to trust a run: the report as text, from what a result holds, and the numerical energies of an explicit run
against what they are measured by, once for the report and the figure."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

GOOD = "good"
OF_INTERNAL = ("energy_hourglass", "energy_contact", "energy_viscosity")
OF_IMPACT = ("balance_bodies", "balance_contact")


def largest_internal(history: Mapping[str, np.ndarray]) -> np.ndarray:
    """The largest elastic and plastic energy so far (n,) [J]; NaN until the first is known. So far, because what a
    wheel presses elastically it also lets go."""
    known = [history[name] for name in ("energy_elastic", "energy_plastic") if np.isfinite(history[name]).any()]
    return np.fmax.accumulate(np.sum(known, axis=0)) if known else np.full(len(history["time"]), np.nan)


def numerical_shares(history: Mapping[str, np.ndarray], settled: float, scale: float) -> dict[str, np.ndarray]:
    """Shares (n,) after the settling, which ends at `settled` [s]; NaN before it and where an energy is not resolved.

    OF_INTERNAL : energy over the largest internal energy so far
    OF_IMPACT   : what the balance of the bodies, and of the contact, has changed by since the first row after the
        settling, over `scale` [J], rail_fem.fe.trust.balance_scale
    """
    after = history["time"] > settled
    with np.errstate(divide="ignore", invalid="ignore"):
        internal = np.where(after & (largest_internal(history) > 0), largest_internal(history), np.nan)
        shares = {name: history[name] / internal for name in OF_INTERNAL}
    loss = history["energy_contact_loss"]
    for name, values in zip(OF_IMPACT, (history["energy_balance"] + loss, loss)):
        first = values[after][0] if after.any() else np.nan
        shares[name] = np.where(after, values - first, np.nan) / scale
    return shares


def last_known(values: np.ndarray) -> float:
    """The last finite of values (n,); NaN where there is none."""
    known = values[np.isfinite(values)]
    return float(known[-1]) if len(known) else float("nan")


def trust_text(trust: Mapping[str, Any], warnings: Sequence[str]) -> str:
    """The report. trust : "rows" of name, value, shown, rule, verdict, and "slowest" elements in words, both by
    choice"""
    lines, rows = ["how far to trust this run"], trust.get("rows", ())
    width = max((len(row["name"]) for row in rows), default=0)
    lines += [f"  {row['verdict']:8s} {row['name']:{width}s}  {row['shown']}  (rule: {row['rule']})" for row in rows]
    lines += [f"  {len(warnings)} warning(s)", *(f"    {warning}" for warning in warnings)]
    if trust.get("slowest"):
        lines += ["  elements with the smallest stable step:", *(f"    {text}" for text in trust["slowest"])]
    return "\n".join(lines) + "\n"


def verdict_words(trust: Mapping[str, Any]) -> str:
    """The rows that are not good, in a line: "good" where all are, "" for a model without rows."""
    rows = trust.get("rows", ())
    short = [f"{row['name']} {row['short']}" for row in rows if row["verdict"] != GOOD]
    return f"{len(short)} of {len(rows)} rows fail: {'; '.join(short)}" if short else GOOD if rows else ""
