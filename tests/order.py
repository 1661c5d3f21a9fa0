"""Observed order of convergence, checked the same way in every test."""

import numpy as np

ROUND_OFF = 1e-13


def assert_order(sizes, errors, expected: float, slack: float = 0.15) -> None:
    """The finest pair shows the expected order within +-slack; prints sizes, errors and orders when it does not.

    sizes, errors : (n,), n >= 2, coarse to fine. Errors at round-off are refused: they show no order.
    """
    sizes, errors = np.asarray(sizes, float), np.abs(np.asarray(errors, float))
    orders = np.diff(np.log(errors)) / np.diff(np.log(sizes))
    table = "\n".join(f"  {h:.4g}  {e:.4g}  {o:.3f}" for h, e, o in zip(sizes, errors, [np.nan, *orders]))
    assert errors.min() > ROUND_OFF, f"errors at round-off show no order:\n{table}"
    assert abs(orders[-1] - expected) <= slack, (
        f"order {orders[-1]:.3f}, expected {expected} +- {slack}\n  size  error  order\n{table}"
    )
