"""Numerical energies of an explicit run against what they are measured by: one definition for the trust report and the
figure."""

from collections.abc import Mapping

import numpy as np

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
