"""Jumps over passes of a rolling line contact against every pass computed, and against a constant rate."""

import numpy as np
import pytest

from bem.cycle_jumps import JumpRule
from bem.plastic.rolling_line import rolling_line_contact
from bem.steel.cyclic_law import cyclic_law
from rail_fem.studies.ratchetting import pass_table, roll

YOUNG, POISSON, YIELD, HALF_WIDTH = 210e9, 0.3, 300e6, 5e-3
SHEAR_YIELD = YIELD / np.sqrt(3)
CHABOCHE = {"modulus": [100e9, 20e9, 3e9], "recovery": [2000.0, 300.0, 20.0]}


def both(law, ratio, traction, depth, passes, tolerance=0.01):
    load = law, HALF_WIDTH, ratio * SHEAR_YIELD, traction, [depth * HALF_WIDTH], passes, 60
    return rolling_line_contact(*load), rolling_line_contact(*load, JumpRule(tolerance))


CASES = {
    "constant": (cyclic_law(YOUNG, POISSON, YIELD, [30e9], [150.0]), 5.0, 0.2, 0.5),
    "decaying": (cyclic_law(YOUNG, POISSON, YIELD, **CHABOCHE, mixing=0.1), 4.1, 0.3, 0.45),
    "hardens slowly": (
        cyclic_law(YOUNG, POISSON, YIELD, [30e9], [150.0], hardening=150e6, hardening_rate=1.0), 4.8, 0.2, 0.5
    ),
    "softens": (cyclic_law(YOUNG, POISSON, YIELD, **CHABOCHE, hardening=-60e6, hardening_rate=2.0), 4.3, 0.1, 0.5),
    "closes": (cyclic_law(YOUNG, POISSON, YIELD, **CHABOCHE, mixing=0.0), 4.6, 0.1, 0.5),
    "comes to rest": (cyclic_law(YOUNG, POISSON, YIELD, **CHABOCHE), 3.95, 0.0, 0.5),
}  # fmt: skip


@pytest.mark.parametrize("case", CASES)
def test_jumps_stay_within_their_estimate_and_the_tolerance(case):
    computed, jumped = both(*CASES[case], 300)
    top = computed.plastic_strain.max()
    for name in ("plastic_strain", "shear"):
        off = np.abs(getattr(jumped, name) - getattr(computed, name))[-1, 0]
        estimate = getattr(jumped, f"{name}_error")[-1, 0]
        assert off <= estimate + 1e-9 * top
        assert estimate <= 0.01 * max(np.abs(getattr(computed, name)).max(), 1e-3 * top)
    assert jumped.verdict() == computed.verdict()
    assert jumped.computed[0] < 250


def test_the_residual_stresses_after_jumps_are_those_of_all_passes():
    computed, jumped = both(*CASES["constant"], 300)
    for name in ("residual_xx", "residual_yy"):
        assert np.abs(getattr(jumped, name) - getattr(computed, name))[-1, 0] < 1e-6 * YIELD


def test_a_rate_of_one_back_stress_is_constant_and_jumped_over_to_round_off():
    """Armstrong and Frederick's law forgets where it came from: 100,000 passes are as many times the last pass."""
    law, ratio, traction, depth = CASES["constant"]
    load = law, HALF_WIDTH, ratio * SHEAR_YIELD, traction, [depth * HALF_WIDTH]
    short, long = rolling_line_contact(*load, 60, 60), rolling_line_contact(*load, 100_000, 60, JumpRule())
    rate = short.shear[-1, 0] - short.shear[-2, 0]
    assert long.shear[-1, 0] == pytest.approx(short.shear[-1, 0] + rate * 99_940, rel=1e-6)
    assert long.computed[0] < 200 and long.exponent() == pytest.approx(0, abs=1e-6)


def test_a_little_that_stays_of_each_of_many_passes_is_ratchetting():
    """Three back stresses of which none forgets wholly: of 1.8e-3 that flow in a pass 1e-5 stay, for ever: the forward
    strain of 2,000 passes is 4 %, and of the half of them 57 %. Where jumps end, round-off decides: 2.17e-5 and 2.21e-5
    of two compilers."""
    law = cyclic_law(YOUNG, POISSON, YIELD, [60e9, 8e9, 2e9], [600.0, 60.0, 3.0], mixing=0.1)
    depth = HALF_WIDTH * np.array([0.5])
    history = rolling_line_contact(law, HALF_WIDTH, 4.3 * SHEAR_YIELD, 0.15, depth, 2000, 60, JumpRule())
    rate = history.shear[-1, 0] - history.shear[-2, 0]
    assert rate == pytest.approx(2.19e-5, rel=0.02) and history.shear[-1, 0] > 1000 * rate
    assert history.verdict() == "ratchetting" and "in 10,000 at that rate" in history.verdict_words()


def test_a_steel_that_has_hardened_carries_what_it_carried_before():
    """Newton's method went to and fro at pass 816 between an elastic and a plastic step, and was taken for a load that
    the steel cannot carry (271 MPa in shear; it carries at least 327)."""
    law = cyclic_law(YOUNG, POISSON, YIELD, **CHABOCHE, hardening=80e6, hardening_rate=2.0)
    history = rolling_line_contact(law, HALF_WIDTH, 4.6 * SHEAR_YIELD, 0.3, [0.5 * HALF_WIDTH], 830, 100)
    assert np.diff(history.plastic_strain[-30:, 0]).min() > 0


def test_the_table_of_a_long_run_says_cost_verdict_and_what_is_refused():
    law, depths = CASES["constant"][0], HALF_WIDTH * np.array([0.4, 0.5])
    runs = [roll(law, ratio, depths, 150, 60, 0.01) for ratio in (2.0, 4.6, 8.0)]
    elastic, ratchets, beyond = pass_table(runs).markdown().splitlines()[2:]
    assert "| elastic (" in elastic and "no equilibrium" in beyond
    assert "| ratchetting (" in ratchets and "in 10,000" in ratchets and "), constant growth" in ratchets
    computed, jumped = runs[1].computed, runs[1].jumped
    assert len(computed.shear) == 150 and f"{jumped.computed.sum()} of 300" in ratchets
    assert computed.shear[-1, 0] == pytest.approx(jumped.shear[-1, jumped.worst], rel=1e-3)
