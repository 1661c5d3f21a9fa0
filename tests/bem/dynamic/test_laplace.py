"""Kernels in Laplace's domain against SciPy, the wave equation and a cavity; convolution quadrature against bars."""

import numpy as np
import pytest
from scipy.special import kv

from bem.dynamic.body import DynamicsError
from bem.dynamic.convolution import RULES, Conditions, LaplaceBody, convolve, transfer
from bem.dynamic.laplace_kernel import bessel
from bem.plane.mesh import Sizing, mesh_outline
from bem.verification.bar import HEIGHT, LENGTH, MATERIAL, box, edge_pattern, pulse, tip_displacement
from bem.verification.waves import cavity, cavity_pressure, cavity_transform
from tests.order import assert_order


@pytest.mark.parametrize("angle", [0.0, 0.7, 1.5, -1.2])
def test_bessel_functions_are_scipys(angle):
    z = np.logspace(-3, 1.6, 60) * np.exp(1j * angle)
    ours = np.array([bessel(each) for each in z])
    assert np.abs(ours[:, 0] / kv(0, z) - 1).max() < 1e-12
    near = np.abs(z) < 0.5  # where 1 / z must not be subtracted from K1: the series' second term instead
    assert np.abs(ours[:, 1] - (kv(1, z) - 1 / z))[~near].max() < 1e-13
    second = z / 2 * (np.log(z / 2) + np.euler_gamma - 0.5)
    assert np.abs(ours[near, 1] / second[near] - 1).max() < 0.1 and abs(ours[0, 1] / second[0] - 1) < 1e-5


@pytest.mark.parametrize("s", [0.05, 0.5 + 1j, 0.3 + 4j, 3 - 6j])
def test_a_cavity_under_pressure_answers_as_the_exact_transform(s):
    """Second order in the element, at slow and at fast s."""
    points = np.array([[1.5, 0.0], [0.0, 3.0]])
    errors = []
    for elements in (24, 48):
        moved = transfer(cavity(elements), cavity_pressure(cavity(elements)), s, points)[:, 0]
        exact = np.array([cavity_transform(s, 1.5), cavity_transform(s, 3.0)])
        errors.append(np.abs(np.array([moved[0], moved[3]]) - exact).max() / np.abs(exact).max())
    assert errors[1] < 0.01
    assert_order([1 / 24, 1 / 48], errors, 2, 0.6)


def bar_body(cells: int) -> tuple[LaplaceBody, Conditions]:
    mesh = mesh_outline(box(LENGTH, HEIGHT), Sizing(HEIGHT / cells))
    held = np.zeros((mesh.densities, 2), bool)
    held[mesh.of_edge("held")] = True
    return LaplaceBody(mesh, MATERIAL, 1.0), Conditions(held, edge_pattern(mesh, "face", (1.0, 0.0)))


@pytest.mark.parametrize(
    ("rule", "bound"), [("trapezoidal", 0.1), pytest.param("BDF2", 0.2, marks=pytest.mark.validate)]
)
def test_a_bar_by_convolution_quadrature_is_dalemberts(rule, bound):
    """A smooth pulse over four transits, without any cell. Two elements over the height keep an error of 0.05 (0.03
    with four); with omega = 2 pi of the pulse the rules add (omega h)^2 / 12 and / 3 of the phase, 0.008 and 0.03 a
    transit."""
    body, conditions = bar_body(2)
    pull, impulse = pulse(1.0)
    point, step = np.array([[LENGTH - 1e-9, HEIGHT / 2]]), 0.05
    time = step * np.arange(1, round(4 / step) + 1)
    answer = convolve(lambda s: transfer(body, conditions, s, point), pull(time)[:, None], step, rule)[:, 0]
    exact = tip_displacement(time, impulse)
    assert np.abs(answer - exact).max() < bound * exact.max()  # to the very end: nothing wraps around


@pytest.mark.parametrize("rule", list(RULES))
def test_convolution_quadrature_integrates(rule):
    """The transfer 1 / s of a constant load is time itself, to the rule's order: exact but for the transform."""
    answer = convolve(lambda s: np.array([[1 / s]]), np.ones((50, 1)), 0.1, rule)[:, 0]
    time = 0.1 * np.arange(1, 51)
    late = {"trapezoidal": 0.05, "BDF2": 0.0, "backward Euler": 0.0}[rule]
    assert np.abs(answer[10:] - (time - late)[10:]).max() < 0.06


@pytest.mark.parametrize(
    ("loads", "step", "rule", "words"),
    [
        (np.ones((5, 1)), 0.0, "BDF2", "step"),
        (np.ones((5, 1)), 0.1, "BDF3", "there are"),
        (np.ones(5), 0.1, "BDF2", "loads"),
        (np.full((5, 1), np.nan), 0.1, "BDF2", "finite"),
    ],
)
def test_what_cannot_be_convolved_is_refused(loads, step, rule, words):
    with pytest.raises(DynamicsError, match=words):
        convolve(lambda s: np.eye(1), loads, step, rule)
