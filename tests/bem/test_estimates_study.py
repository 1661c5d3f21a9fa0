"""Error estimates hold: the true error is within them, and they are not far above it."""

import numpy as np
import pytest

from bem.verification import estimates_study
from bem.verification.estimates_study import COVERED, MEDIAN, PARTS, rows_of, summary

SEED = 100  # not among those with which the estimates' constants were chosen


@pytest.mark.parametrize(
    "part, cases", [("half-space", 12), ("rolling", 2), ("shift", 2), ("FASTSIM", 6), ("plane", 1)]
)
def test_few_cases_are_within_their_estimates(part, cases):
    """One row in ten may lie outside; an estimate is never NaN."""
    rows = rows_of(part, SEED, cases)
    ratios = np.array([row.estimate / row.error for row in rows])
    assert np.isfinite(ratios).all() and ratios.min() > 0.2 and (ratios >= 1).mean() >= 0.9


def test_a_wrong_estimate_is_seen():
    outside = summary(
        [estimates_study.EstimateRow("force", 0.1, error) for error in (0.2, 0.05, 0.01)]
        + [estimates_study.EstimateRow("force", np.nan, 0.1)]
    )
    assert outside["force"][:2] == (4, 0.5)


SHORT = {
    "shift": "18 of 20 within",
    "slices": "the approach's estimate is ten times its error in the median, which is 1e-4",
}


@pytest.mark.validate
@pytest.mark.parametrize(
    "part", [pytest.param(part, marks=pytest.mark.xfail(part in SHORT, reason=SHORT.get(part, ""))) for part in PARTS]
)
def test_two_hundred_cases_are_within_their_estimates(part):
    """95 % within, half of the estimates below five times the error; plane contact: the accuracy asked for is no
    estimate, but kept."""
    for quantity, (_, covered, ratio, _) in summary(rows_of(part, SEED, PARTS[part][0])).items():
        assert covered >= COVERED, quantity
        assert ratio < (MEDIAN if part != "plane" else np.inf), quantity
