"""Transient rolling: an exact start, the steady state of fastsim, energy, loads that grow."""

import numpy as np
import pytest

from bem.halfspace.fastsim import flexibilities
from bem.halfspace.rolled_ellipses import rolled_ellipses
from bem.halfspace.transient_fastsim import EllipseHistory, SlipLaw, transient
from bem.material import STEEL, Pair
from bem.patch import ContactInputError
from tests.order import assert_order

PAIR = Pair.of(STEEL, STEEL)
LAW = SlipLaw(np.array([0.8]), np.array([0.2, 0.7]), np.full((2, 3), 1e-3), 2.8e9, 20.0)
SEMI, LOAD = (5e-3, 4e-3), 60e3


def held(creepage, steps, step, semi=SEMI, load=LOAD):
    """A patch that does not change, rolled on from x = 0."""
    centre = np.stack([step * np.arange(steps), np.zeros(steps)], axis=1)
    return EllipseHistory(centre, np.tile(semi, (steps, 1)), np.full(steps, load), np.tile(creepage, (steps, 1)))


def rolled(creepage, parts, friction=0.3, lengths=2.0, **change):
    """`parts` steps in a semi-axis."""
    step = SEMI[0] / parts
    history = held(creepage, round(lengths * parts) + 1, step, **change)
    return transient(history, PAIR, friction, step, (step, SEMI[1] / parts), LAW)


def test_a_start_from_nothing_has_its_exact_force():
    """Without slip a point that has been under the patch for a length s has the traction c s / L. Of a length s rolled
    from nothing the force is c / L times the area's integral of min(s, distance to the leading edge)."""
    creepage, length = 1e-3, SEMI[0]
    across = (np.arange(4000) + 0.5) / 4000 * 2 - 1
    chord = 2 * SEMI[0] * np.sqrt(1 - across**2)
    full = np.minimum(length, chord)
    exact = (full * chord - full**2 / 2).mean() * 2 * SEMI[1] * creepage / flexibilities(*SEMI, PAIR)[0]
    errors = []
    for parts in (20, 80):
        step = length / parts
        history = held((creepage, 0, 0), parts, step)
        force = transient(history, PAIR, 1e6, step, (step, SEMI[1] / parts), LAW).force[-1, 0]
        errors.append(abs(-force / exact - 1))
    assert errors[1] < 0.01 and errors[1] < 0.4 * errors[0]


@pytest.mark.parametrize("creepage", [(1e-3, 2e-3, 0.2), (3e-4, 0.0, 0.0), (0.0, 1e-4, 0.5), (0.01, 0.0, 0.0)])
def test_a_patch_that_does_not_change_comes_to_fastsims_steady_state(creepage):
    """After its own length: forces within 0.5 % of the bound, friction work within 2.5 % of 200 cells each way."""
    steady = rolled_ellipses(np.array([SEMI]), np.array([LOAD]), STEEL, STEEL, 0.3, np.array([creepage]), (200, 200))
    found = rolled(creepage, 60, lengths=2.2)
    largest = 0.3 * LOAD
    assert np.abs(found.force[-1] - steady.tangential_force[0]).max() < 0.005 * largest
    assert found.power[-1] == pytest.approx(steady.frictional_power[0], rel=0.025)


def test_work_of_the_steady_state_is_what_the_creepage_puts_in():
    """Without spin, power is force times creepage: to second order in the step."""
    creepage, errors = 3e-4, []
    for parts in (30, 60, 120):
        found = rolled((creepage, 0.0, 0.0), parts, lengths=2.2)
        errors.append(abs(found.power[-1] / (-found.force[-1, 0] * creepage) - 1))
    assert_order([1 / 30, 1 / 60, 1 / 120], errors, expected=2, slack=0.4)


def test_in_full_sliding_wear_goes_with_the_friction_work():
    """Where all slides in one direction, Archard's volume over friction work is k p / (mu H bound): with the pressure's
    mean over the parabolic bound's, 1 and 1, it is k / (mu H) within the 0.6 % by which slip varies over the patch."""
    found = rolled((0.05, 0.0, 0.0), 40, lengths=2.2)
    assert found.volume[-1] / found.power[-1] == pytest.approx(1e-3 / (0.3 * 2.8e9), rel=0.02)


def test_a_patch_whose_load_grows_slowly_is_always_steady_and_a_fast_one_lags():
    """Load from a tenth to all within 40 and within 1 lengths of the patch: the last step against the steady one."""
    creepage, step = (5e-4, 0.0, 0.0), SEMI[0] / 30
    off = []
    for lengths in (40, 1):
        n = round(2 * lengths * 30)
        share = np.linspace(0.1, 1, n)
        plain = held(creepage, n, step)
        grown = plain._replace(load=LOAD * share, semi=plain.semi * np.cbrt(share)[:, None])
        last = transient(grown, PAIR, 0.3, step, (step, step), LAW).force[-1, 0]
        still = transient(grown.held(n - 1, 70, step), PAIR, 0.3, step, (step, step), LAW).force[-1, 0]
        off.append(last / still - 1)
    assert abs(off[0]) < 0.02 and -0.5 < off[1] < -0.03


def test_nothing_slips_without_creepage_and_wrong_numbers_are_refused():
    assert not rolled((0.0, 0.0, 0.0), 20).power.any()
    assert not rolled((1e-3, 0.0, 0.0), 20, friction=0.0).force.any()
    good = held((1e-3, 0, 0), 3, 1e-4)
    for bad, said in (
        (good._replace(load=-good.load), "3 of them"),
        (good._replace(semi=0 * good.semi), "axes above 0"),
    ):
        with pytest.raises(ContactInputError, match=said):
            transient(bad, PAIR, 0.3, 1e-4, (1e-4, 1e-4), LAW)
    with pytest.raises(ContactInputError, match="carry"):
        transient(good, PAIR, 0.3, 1e-4, (1e-4, 1e-4), LAW, carry="all")
