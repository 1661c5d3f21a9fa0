"""Jumps over cycles: laws of growth whose value after any number of cycles is known in closed form."""

import numpy as np
import pytest

from bem.cycle_jumps import NO_JUMPS, VERDICTS, JumpRule, run_cycles, verdict, verdict_words

CYCLES = 2000


def first(state):
    return state[None, :1]


def saturating(state, number):
    """dp such that exp(b p) grows by one each cycle: p = ln(1 + b n) / b with b = 5, growth that falls as 1 / n."""
    return np.array([np.log(np.exp(5 * state[0]) + 1) / 5])


def settling(state, number):
    """p grows by 1e-3 (1 + x + y); x, y shrink by 0.95 and 0.3 each cycle."""
    x, y = 0.95 * state[1], 0.3 * state[2]
    return np.array([state[0] + 1e-3 * (1 + x + y), x, y])


def settled_sum(n):
    return 1e-3 * (n + 0.95 * (1 - 0.95**n) / 0.05 + 0.3 * (1 - 0.3**n) / 0.7)


def test_a_constant_growth_is_jumped_over_without_error():
    found = run_cycles(lambda y, n: y + 1e-3, np.zeros(1), CYCLES, first, 1)
    assert found.measures[-1, 0, 0] == pytest.approx(1e-3 * CYCLES, rel=1e-9)
    assert found.computed < 80 and len(found.jumps) > 3 and found.error[-1, 0] < 1e-6


def test_what_settles_is_summed_as_the_series_that_it_is():
    """A linear map with modes of 0.95 and 0.3: no jump, however long, may wake the fast one."""
    found = run_cycles(settling, np.array([0.0, 1.0, 1.0]), CYCLES, first, 1)
    assert found.measures[-1, 0, 0] == pytest.approx(settled_sum(CYCLES), rel=1e-3)
    assert found.computed < 200 and abs(found.state[2]) < 1e-9
    assert abs(found.measures[-1, 0, 0] - settled_sum(CYCLES)) < found.error[-1, 0]


def test_a_growth_that_saturates_stays_within_its_estimate_and_a_smaller_tolerance_makes_it_smaller():
    errors = []
    for tolerance in (0.04, 0.01, 0.0025):
        found = run_cycles(saturating, np.zeros(1), CYCLES, first, 1, JumpRule(tolerance))
        values, estimates = found.after_each()
        exact = np.log(1 + np.arange(1, CYCLES + 1)) / 5
        errors.append(np.abs(values[:, 0, 0] - exact).max())
        assert errors[-1] < estimates[-1, 0] < tolerance * exact[-1]
        assert found.number[-1] == CYCLES and found.computed < CYCLES / 2
    assert errors[0] > 2 * errors[1] > 4 * errors[2]


def test_no_jumps_compute_every_cycle():
    found = run_cycles(saturating, np.zeros(1), 50, first, 1, NO_JUMPS)
    assert found.computed == 50 and not found.jumps and (found.error == 0).all()
    assert found.state[0] == pytest.approx(np.log(51) / 5, rel=1e-12)


def test_a_body_at_rest_is_left_alone():
    found = run_cycles(lambda y, n: np.maximum(y, 1.0), np.zeros(1), CYCLES, first, 1)
    assert found.computed == 6 and found.after_each()[0].shape == (CYCLES, 1, 1)
    assert found.state[0] == 1.0 and found.error[-1, 0] == 0


def test_a_state_that_goes_to_and_fro_is_not_jumped_over():
    """Growth that changes its size every other cycle, by ever new amounts: no extrapolation knows it."""
    kicks = np.random.default_rng(3).uniform(0, 1, 400)
    found = run_cycles(lambda y, n: y + kicks[n - 1], np.zeros(1), 400, first, 1)
    assert found.computed >= 380 and found.state[0] == pytest.approx(kicks.sum(), rel=0.01)


def test_a_jump_into_what_cannot_be_is_taken_back():
    """The cycle ends the run from p = 1.5 on; the last cycles before it have to be computed."""

    def cycle(state, number):
        if state[0] > 1.5:
            raise ArithmeticError(f"cycle {number}")
        return state + 1e-3

    with pytest.raises(ArithmeticError, match="cycle 150[12]"):
        run_cycles(cycle, np.zeros(1), CYCLES, first, 1)


def test_an_extrapolated_state_is_put_right_and_that_counts_as_error():
    found = run_cycles(
        lambda y, n: y + 1e-3, np.zeros(1), 100, first, 1, JumpRule(0.5), admit=lambda y: y + 1e-4
    )  # fmt: skip
    off = found.state[0] - 0.1
    assert len(found.jumps) * 1e-4 == pytest.approx(off, rel=1e-6) and found.error[-1, 0] == pytest.approx(
        off, rel=0.01
    )


def test_what_stays_of_a_cycle_ratchets_where_it_has_no_finite_sum():
    """However much flows to and fro beside it: constant or as n^-0.5 it runs away; as n^-1.5 or 0.9^n it ends."""
    n, flow = np.arange(1.0, 201), np.full(200, 1e-2)
    for stays, named in ((1e-5 + 0 * n, 3), (1e-3 * n**-0.5, 3), (1e-3 * n**-1.5, 2), (1e-3 * 0.9**n, 2)):
        assert verdict(flow, stays) == VERDICTS[named]
    assert (
        verdict(flow, 2e-5 + 0 * n, error=0.005) == VERDICTS[2]
        and verdict(flow, 9e-5 + 0 * n, error=0.005) == VERDICTS[3]
    )
    # beside the first cycle's all that stays is small: one alone was called ratchetting, two and three a shakedown
    for stays in ([5e-3], [5e-3, 2e-5], [5e-3, 2e-5, 2e-5]):
        assert verdict(flow[: len(stays)], np.array(stays)) == VERDICTS[4]
        assert "not told by so few" in verdict_words(flow[: len(stays)], np.array(stays))
    assert verdict(flow[:4], np.array([5e-3, 2e-5, 2e-5, 2e-5])) == VERDICTS[3]
    assert verdict(0 * n, 0 * n) == VERDICTS[0] and verdict(np.array([1e-3, 1e-8]), np.array([1e-3, 0])) == VERDICTS[1]
    words = verdict_words(flow, 2.7e-5 + 0 * n)
    assert words.startswith("ratchetting") and "2.7e-05" in words and "0.27 in 10,000" in words
    assert "at most 1e-07" in verdict_words(0 * n, 0 * n)
    assert "in 10,000 at that rate, and it falls away" in verdict_words(flow, 1e-3 * 0.9**n)


def test_bad_numbers_are_refused():
    for cycles, rule in ((0, JumpRule()), (5, JumpRule(tolerance=0.0)), (5, JumpRule(window=2))):
        with pytest.raises(ValueError, match="at least 1"):
            run_cycles(lambda y, n: y, np.zeros(1), cycles, first, 1, rule)
