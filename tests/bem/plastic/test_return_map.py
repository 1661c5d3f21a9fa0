"""Radial return: closed forms on a line, the tangent against differences, refused curves."""

import numpy as np
import pytest

from bem.material import MaterialError
from bem.steel.hardening import Hardening
from bem.steel.nonlinear_kinematic import NonlinearKinematic
from bem.steel.return_map import PlasticState, advanced, radial_return

SHEAR = 80e9
CURVE = Hardening(np.array([0, 0.002, 0.01, 0.05]), 1e6 * np.array([300, 400, 450, 500]))
SHAPE = (1, 5, 3, 2)


def random_trial(seed, size=800e6):
    return size * np.random.default_rng(seed).normal(size=SHAPE)


@pytest.mark.parametrize("kinematic", [False, True])
def test_returned_stress_lies_on_the_yield_surface(kinematic):
    curve = Hardening(CURVE.strain, CURVE.stress, kinematic)
    trial, state = random_trial(0), PlasticState.virgin(SHAPE)
    found = radial_return(trial, state, curve, SHEAR)
    after = advanced(state, found, curve)
    xi = trial - 2 * SHEAR * found.increment - after.back
    size = np.sqrt(1.5 * (xi**2).sum(axis=1))
    limit = np.full(size.shape, curve.first_yield) if kinematic else curve.at(after.peeq)
    assert (found.along > 0).all()
    assert np.abs(size - limit).max() < 1e-9 * limit.max()


@pytest.mark.parametrize("kinematic", [False, True])
def test_tangent_is_the_derivative_of_the_return(kinematic):
    curve = Hardening(CURVE.strain, CURVE.stress, kinematic)
    state = PlasticState.virgin(SHAPE)
    state = advanced(state, radial_return(random_trial(1), state, curve, SHEAR), curve)
    trial, change = random_trial(2), 1e3 * random_trial(3, 1.0)
    found = radial_return(trial, state, curve, SHEAR)
    ahead, behind = (radial_return(trial + s * change, state, curve, SHEAR).increment for s in (1, -1))
    tangent = found.root(found.root(change))
    assert np.abs(2 * SHEAR * (ahead - behind) / 2 - tangent).max() < 1e-6 * np.abs(tangent).max()


def test_kinematic_hardening_yields_early_when_the_load_turns_round():
    """Bauschinger: forward to 400 MPa, back at 400 - 2 x 300 = -200 MPa; isotropic at -400 MPa."""
    one = np.zeros((1, 5, 1, 1))
    one[0, 1] = np.sqrt(2 / 3)  # deviator of a unit tension along z
    for kinematic, limit in ((True, 200e6), (False, 400e6)):
        curve = Hardening.linear(300e6, 1e10, kinematic)
        state = PlasticState.virgin(one.shape)
        growth = 100e6 / 1e10
        state = advanced(state, radial_return((400e6 + 3 * SHEAR * growth) * one, state, curve, SHEAR), curve)
        assert state.peeq[0, 0, 0] == pytest.approx(growth)
        for share, yields in ((0.999, False), (1.001, True)):
            assert (radial_return(-share * limit * one, state, curve, SHEAR).along > 0).any() == yields


def test_the_tangent_of_a_cyclic_law_is_the_derivative_along_the_flow():
    """Recovery across the flow is left out of the tangent, so that along it alone can be met."""
    law = NonlinearKinematic(300e6, [100e9, 20e9], [2000.0, 300.0], [1.0, 0.2], 80e6, 20.0)
    state = PlasticState.virgin(SHAPE, law.back_stresses)
    for seed in (1, 2):
        state = advanced(state, radial_return(random_trial(seed), state, law, SHEAR), law)
    trial = random_trial(3)
    found = radial_return(trial, state, law, SHEAR)
    change = 1e3 * found.direction
    ahead, behind = (radial_return(trial + s * change, state, law, SHEAR).increment for s in (1, -1))
    rate = np.einsum("kc...,kc...->k...", 2 * SHEAR * (ahead - behind) / 2, found.direction)
    assert (found.along > 0).all()
    assert np.abs(rate / (1e3 * found.along) - 1).max() < 0.01  # the normal turns a little with the recovery


@pytest.mark.parametrize(
    ("changed", "words"),
    [
        ({"yield_stress": 0.0}, "yield_stress is 0.0"),
        ({"modulus": [1e9]}, "1 moduli and 2 recoveries"),
        ({"recovery": [-1.0, 2.0]}, "recovery 1 is -1.0"),
        ({"mixing": [0.5, 1.5]}, "mixing 2 is 1.5"),
        ({"modulus": [np.nan, 1e9]}, "modulus 1 is nan"),
        ({"hardening": -250e6, "hardening_rate": 300.0}, "first loading falls"),
    ],
)
def test_impossible_cyclic_laws_are_refused_with_a_reason(changed, words):
    right = {"yield_stress": 300e6, "modulus": [20e9, 3e9], "recovery": [300.0, 20.0]}
    with pytest.raises(MaterialError, match=words):
        NonlinearKinematic(**right | changed)


@pytest.mark.parametrize(
    ("strain", "stress", "words"),
    [
        ([0, 0.1], [300e6, 250e6], "softening"),
        ([0.01, 0.1], [300e6, 350e6], "start at 0"),
        ([0, 0.1], [0.0, 350e6], "positive"),
        ([0, np.nan], [300e6, 350e6], "finite"),
        ([0, 0.1], [300e6], "equal"),
    ],
)
def test_impossible_curves_are_refused_with_a_reason(strain, stress, words):
    with pytest.raises(MaterialError, match=words):
        Hardening(np.array(strain), np.array(stress))
