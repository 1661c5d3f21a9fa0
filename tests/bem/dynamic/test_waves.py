"""Waves against exact solutions: a bar over twenty periods, a cavity, Lamb's line load; and these solutions' own."""

import numpy as np
import pytest
from scipy.integrate import quad

from bem.verification.waves import PULSE, ROCK, LambPulse, bar_errors, cavity_errors, lamb_run


@pytest.fixture(scope="module")
def lamb():
    return LambPulse(ROCK, 1.0)


def test_lambs_solution_comes_to_rest_as_flamants(lamb):
    """Long after an impulse the surface sinks back as (1 - nu) / (pi G t): Flamant's logarithm in time; first order in
    (x / t)^2. Rayleigh's speed at nu = 1/4 is 0.9194 of the shear wave's."""
    x, moment = 0.7, 70.0
    level = (1 - ROCK.poisson) / (np.pi * ROCK.shear * moment)
    assert lamb.impulse_response(x, moment) == pytest.approx(level, rel=3 * (x / moment) ** 2)
    assert lamb.rayleigh == pytest.approx(0.9194, abs=1e-4)


def test_lambs_solution_has_the_transform_of_the_wave_equation(lamb):
    """Its Laplace transform against the integral over wave numbers of s^2 a / [(2 k^2 + s^2)^2 - 4 k^2 a b] / G, for
    c2 = 1, times the pulse's own transform."""
    x, s = 0.8, 1.7
    one = lamb.waves.dilatational**-2

    def by_wave_number(k: float) -> float:
        a, b = np.sqrt(k**2 + one * s**2), np.sqrt(k**2 + s**2)
        return s**2 * a / ((2 * k**2 + s**2) ** 2 - 4 * k**2 * a * b)

    exact = quad(by_wave_number, 0, np.inf, weight="cos", wvar=x)[0] / (np.pi * ROCK.shear)
    exact *= quad(lambda t: float(lamb.pull(t)) * np.exp(-s * t), 0, PULSE)[0]
    edges = np.r_[0.0, x / np.array([lamb.waves.dilatational, 1.0, lamb.rayleigh]), 2.4, 3.2, 5.0, 9.0]
    points, weights = np.polynomial.legendre.leggauss(16)
    found = 0.0
    for low, high in zip(edges, edges[1:]):
        t = (low + high) / 2 + (high - low) / 2 * points
        found += (high - low) / 2 * weights @ [lamb.displacement(x, each) * np.exp(-s * each) for each in t]
    assert found == pytest.approx(exact, rel=2e-3)


def test_twenty_periods_of_a_bar_are_within_two_per_cent_and_do_not_grow():
    """Two cells over the bar's height, 32 along it, steps of half a cell: root mean square over the twentieth period.
    The triangle's kinks are further off; the energy is what the load has done."""
    errors = bar_errors(2)
    assert errors.last < 0.02 and errors.largest < 0.06 and errors.energy < 1e-9


def test_a_cavity_under_a_step_pressure_follows_its_transform_inverted():
    """First order in the step at the load's jump, where the error is largest: 4.3 and 2.2 % of the displacement."""
    rough, fine = cavity_errors(24, 0.1, until=5.0), cavity_errors(24, 0.05, until=5.0)
    assert fine.ever < 0.025 and fine.later <= fine.ever
    assert rough.ever > 1.8 * fine.ever


@pytest.mark.validate
def test_lambs_line_load_is_within_two_per_cent():
    """Elements of a fifteenth of the pulse's length, steps of half an element: 1.1 %."""
    assert lamb_run(0.1, 0.05).error < 0.02


@pytest.mark.validate
def test_lambs_line_load_converges_with_second_order():
    """3.7 and 1.1 %."""
    errors = [lamb_run(size, size / 2).error for size in (0.2, 0.1)]
    assert errors[1] < 0.015 and np.log2(errors[0] / errors[1]) > 1.5
