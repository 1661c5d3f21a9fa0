"""Cyclic plasticity at a point: closed forms, an independent integration, shakedown limits, input that cannot be."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from bem.cycle_jumps import VERDICTS
from bem.material import first_loading
from bem.plastic.rolling_line import rolling_line_contact
from bem.steel.cyclic_law import cyclic_law, equivalent
from bem.steel.paths import UNIAXIAL_STRAIN, at_rest, march, ratchet_strain, uniaxial_cycles
from tests.order import assert_order

YOUNG, POISSON, YIELD = 210e9, 0.3, 300e6
SHEAR_YIELD = YIELD / np.sqrt(3)
CHABOCHE = {"modulus": [100e9, 20e9, 3e9], "recovery": [2000.0, 300.0, 20.0]}


def back_stress(modulus: float, recovery: float, start: float, sign: float, plastic: np.ndarray) -> np.ndarray:
    """Back stress [Pa] after the cumulated plastic strain `plastic` of one direction from `start` [Pa]."""
    bound = sign * modulus / recovery
    return bound + (start - bound) * np.exp(-recovery * np.asarray(plastic))


def stress_amplitude(plastic: np.ndarray, yield_stress: float, modulus: np.ndarray, recovery: np.ndarray) -> np.ndarray:
    """Of closed symmetric loops of plastic strain amplitude `plastic`: Y + sum C / gamma tanh(gamma plastic) [Pa].

    From alpha running between -a and a along the law of `back_stress`.
    """
    plastic = np.asarray(plastic, float)[..., None]
    return yield_stress + (np.asarray(modulus) / recovery * np.tanh(np.asarray(recovery) * plastic)).sum(axis=-1)


@pytest.mark.validate
def test_ratchetting_of_one_back_stress_is_the_closed_forms_with_first_order():
    steps, exact = np.array([50, 100, 200, 400]), ratchet_strain(50e9, 200.0, YIELD, -320e6, 450e6)
    law, errors = cyclic_law(YOUNG, POISSON, YIELD, [50e9], [200.0]), []
    for n in steps:
        ends = uniaxial_cycles(law, (-320e6, 450e6), 3, int(n), True)[n - 1 :: 2 * n, 0]
        growth = np.diff(ends)
        assert np.ptp(growth) < 1e-8 * growth[0]  # every cycle the same
        errors.append(growth[0] / exact - 1)
    assert_order(1 / steps, errors, expected=1)
    extrapolated = errors[-1] * 2 - errors[-2]
    assert abs(extrapolated) < 2e-4


def test_a_loop_of_three_back_stresses_and_saturating_hardening_follows_its_closed_form():
    """Under uniaxial stress each back stress is a function of the plastic strain alone; extrapolated to no step."""
    law = cyclic_law(YOUNG, POISSON, YIELD, **CHABOCHE, hardening=80e6, hardening_rate=30.0)
    errors = []
    for n in (200, 400, 800):
        strain, stress, p = uniaxial_cycles(law, (-0.01, 0.012), 1, n, False)[n - 1 :: n].T
        exact, done = [], 0.0
        start = np.zeros(3)
        for k, sign in enumerate((1.0, -1.0, 1.0)):
            backs = [
                back_stress(c, g, a, sign, p[k] - done)
                for c, g, a in zip(law.modulus, law.recovery, start, strict=True)
            ]
            start, done = np.array(backs), p[k]
            exact.append(start.sum() + sign * (YIELD + 80e6 * (1 - np.exp(-30.0 * p[k]))))
        errors.append(stress - exact)
    romberg = (8 * errors[2] - 6 * errors[1] + errors[0]) / 3
    assert np.abs(errors[2]).max() < 0.01 * YIELD and np.abs(romberg).max() < 3e-4 * YIELD


@pytest.mark.parametrize("mixing", [1.0, 0.3, 0.0])
def test_the_first_loading_is_its_closed_form_with_first_order(mixing):
    law = cyclic_law(YOUNG, POISSON, YIELD, **CHABOCHE, mixing=mixing, hardening=80e6, hardening_rate=30.0)
    errors = []
    for n in (200, 400, 800):
        _, stress, p = uniaxial_cycles(law, (0.0, 0.03), 0, n, False).T
        errors.append((stress - first_loading(law, p))[-1])
    assert max(np.abs(errors)) < 1e-3 * YIELD
    if mixing == 1.0:
        assert_order(1 / np.array([200, 400, 800]), errors, expected=1)


def tension_torsion(law, path):
    """Stress at the end of a strain path (2, n) of axial strain and shear eps_xy by an adaptive Runge-Kutta of the rate
    equations, which has nothing in common with the return mapping: flow all the way, lateral strain given."""

    def deviator(t):
        return t - np.array([1, 1, 1, 0, 0, 0]) * t[:3].sum() / 3

    def dot(a, b):
        return a[:3] @ b[:3] + 2 * a[3:] @ b[3:]

    k = law.modulus.size
    start, stop = path

    def rates(_, y):
        stress, back = deviator(y[:6]), y[6:].reshape(k, 6)
        rate = deviator(stop - start)
        normal = stress - back.sum(axis=0)
        normal = 1.5 * normal / np.sqrt(1.5 * dot(normal, normal))
        hardening = law.modulus.sum() - sum(g * dot(normal, b) for g, b in zip(law.recovery, back, strict=True))
        dp = 2 * law.shear * dot(normal, rate) / (3 * law.shear + hardening)
        d_back = 2 / 3 * law.modulus[:, None] * normal * dp - law.recovery[:, None] * back * dp
        return np.concatenate([2 * law.shear * (rate - normal * dp), d_back.ravel()])

    # the yield surface is met at a known strain: elastic until there
    elastic = deviator(2 * law.shear * stop)
    reached = law.yield_stress / equivalent(elastic)
    y = np.concatenate([reached * elastic, np.zeros(6 * k)])
    start = reached * stop
    return solve_ivp(rates, (0, 1), y, method="DOP853", rtol=1e-13, atol=1e-3).y[:6, -1]


def test_a_turning_strain_path_agrees_with_an_independent_integration():
    """Tension with torsion, then the corner to another direction is left out: proportional strain, back stresses that
    grow at different rates; extrapolated from 4 numbers of steps to 1e-8 of the stress."""
    law = cyclic_law(YOUNG, POISSON, YIELD, **CHABOCHE)
    target = np.array([0.01, -0.004, -0.003, 0.002, 0.001, 0.006])
    exact, found = tension_torsion(law, (np.zeros(6), target)), []
    for n in (400, 800, 1600, 3200):
        path = target * np.linspace(0, 1, n + 1)[1:, None]
        record = np.empty((n, 13))
        march(law, np.zeros(6, bool), path, at_rest(law), record)
        stress = record[-1, 6:12]
        found.append(stress - np.array([1, 1, 1, 0, 0, 0]) * stress[:3].sum() / 3)
    errors = [np.abs(f - exact).max() for f in found]
    assert_order(1 / np.array([400, 800, 1600, 3200]), errors, expected=1)
    table = list(found)
    for level in range(1, 4):
        table = [(2**level * b - a) / (2**level - 1) for a, b in zip(table, table[1:], strict=False)]
    assert np.abs(table[0] - exact).max() < 1e-6 * np.abs(exact).max()


@pytest.mark.parametrize("mixing", [0.0, 0.1, 1.0])
def test_the_more_recovery_the_more_it_ratchets_and_ohno_wangs_first_model_stops(mixing):
    law = cyclic_law(YOUNG, POISSON, YIELD, **CHABOCHE, mixing=mixing)
    ends = uniaxial_cycles(law, (-300e6, 420e6), 20, 100, True)[99::200, 0]
    growth = np.diff(ends)
    assert (growth[1:] > -1e-12).all()
    if mixing == 0.0:
        assert abs(growth[-1]) < 1e-9
    else:
        assert growth[-1] > 3e-5 * mixing


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("mixing", [0.0, 0.3, 1.0])
def test_no_step_of_any_size_leaves_the_yield_surface_or_a_back_stress_beyond_its_bound(seed, mixing):
    law = cyclic_law(YOUNG, POISSON, YIELD, **CHABOCHE, mixing=mixing, hardening=-100e6, hardening_rate=50.0)
    rng, state = np.random.default_rng(seed), at_rest(law)
    for size in 10.0 ** rng.uniform(-6, -1, 200):
        record = np.empty((1, 13))
        path = state.strain + size * rng.standard_normal((1, 6))
        before = state.plastic_strain[0]
        assert march(law, np.zeros(6, bool), path, state, record) == 1
        relative = state.stress - np.array([1, 1, 1, 0, 0, 0]) * state.stress[:3].sum() / 3 - state.back.sum(axis=0)
        yields = YIELD - 100e6 * (1 - np.exp(-50.0 * state.plastic_strain[0]))
        assert equivalent(relative) <= yields * (1 + 1e-9) and state.plastic_strain[0] >= before
        for b, c, g in zip(state.back, law.modulus, law.recovery, strict=True):
            assert equivalent(b) <= c / g * (1 + 1e-9)


@pytest.mark.parametrize(
    "ratio, verdict", [(3.05, VERDICTS[0]), (3.2, VERDICTS[1]), (3.98, VERDICTS[1])], ids=["elastic", "low", "limit"]
)
def test_a_rolling_line_contact_yields_at_1_79_yield_stresses_and_shakes_down_to_4_k(ratio, verdict):
    """Exact for perfect plasticity: first yield at 1.79 Y = 3.10 k (Poisson's ratio 0.3), shakedown to 4.00 k, where
    the shear under the edge of the contact, p0 / 4 at half the half-width's depth, is k (Johnson 1985, section 9.2)."""
    law, depth = cyclic_law(YOUNG, POISSON, YIELD), 5e-3 * np.array([0.5, 0.6, 0.7, 0.8])
    history = rolling_line_contact(law, 5e-3, ratio * SHEAR_YIELD, 0.0, depth, 12, 200)
    assert history.verdict() == verdict


def test_beyond_the_shakedown_limit_a_steel_ratchets_or_closes_by_its_law():
    """At 4.8 k Armstrong and Frederick's law flows forward in every pass; linear hardening closes on itself."""
    depth = 5e-3 * np.array([0.4, 0.5, 0.6])
    for recovery, verdict in ((300.0, VERDICTS[3]), (0.0, VERDICTS[2])):
        law = cyclic_law(YOUNG, POISSON, YIELD, [60e9], [recovery])
        history = rolling_line_contact(law, 5e-3, 4.8 * SHEAR_YIELD, 0.05, depth, 40, 200)
        assert history.verdict() == verdict


def test_perfect_plasticity_beyond_the_limit_has_no_equilibrium_and_says_so():
    with pytest.raises(ValueError, match=r"depth 2\.5 mm, pass 1: no equilibrium .* more than the steel carries"):
        rolling_line_contact(cyclic_law(YOUNG, POISSON, YIELD), 5e-3, 4.1 * SHEAR_YIELD, 0.0, [2.5e-3], 3, 400)


def test_the_amplitude_of_a_closed_loop_is_that_of_the_law_led_through_it():
    law = cyclic_law(YOUNG, POISSON, YIELD, **CHABOCHE)
    path = uniaxial_cycles(law, (-0.006, 0.006), 12, 400, False)
    strain, stress = path[-1, :2]
    plastic = strain - stress / YOUNG
    exact = stress_amplitude(plastic, YIELD, law.modulus, law.recovery)
    assert stress == pytest.approx(float(exact), rel=3e-3)  # first order in the step


@pytest.mark.parametrize(
    "given, words",
    [
        ({"depth": [1e-3, np.nan]}, "depth = "),  # was told as elastic
        ({"depth": []}, "depth = "),
        ({"depth": [[1e-3, 2e-3]]}, "depth = "),
        ({"passes": 2.5}, "2.5 passes of 50"),
        ({"steps": np.nan}, "passes of nan"),
        ({"half_width": np.nan}, "half-width nan m.*: give finite"),
    ],
)
def test_a_rolling_load_that_is_none_is_refused_in_words(given, words):
    law, load = cyclic_law(YOUNG, POISSON, YIELD), {"half_width": 5e-3, "max_pressure": 1e9, "traction_ratio": 0.0}
    with pytest.raises(ValueError, match=words):
        rolling_line_contact(law, **load | {"depth": [1e-3], "passes": 2, "steps": 50} | given)


@pytest.mark.parametrize(
    "constants, words",
    [
        ({"yield_stress": 0.0}, "yield_stress is 0.0"),
        ({"modulus": [1e9], "recovery": [1.0, 2.0]}, "1 moduli and 2 recoveries"),
        ({"modulus": [-1e9], "recovery": [1.0]}, "modulus 1 is"),
        ({"modulus": [1e9], "recovery": [1.0], "mixing": 1.5}, "mixing 1 is"),
        ({"hardening": -300e6}, "hardening is -300000000.0"),
        ({"poisson": 0.5}, "poisson is 0.5"),
        ({"youngs_modulus": np.nan}, "youngs_modulus is nan"),
    ],
)
def test_constants_that_no_steel_has_are_refused_by_name(constants, words):
    given = {"youngs_modulus": YOUNG, "poisson": POISSON, "yield_stress": YIELD} | constants
    with pytest.raises(ValueError, match=words):
        cyclic_law(**given)


def test_a_stress_that_the_law_cannot_carry_is_refused():
    law = cyclic_law(YOUNG, POISSON, YIELD, [50e9], [500.0])
    with pytest.raises(ValueError, match="the law's limit is below it"):
        uniaxial_cycles(law, (-100e6, 450e6), 1, 50, True)
    assert UNIAXIAL_STRAIN.sum() == 5
