"""Kelvin's solution over hat-weighted elements against quadrature, and the sums that equilibrium demands."""

import numpy as np
import pytest
from scipy.integrate import quad

from bem.plane.kelvin import (
    displacement_integrals,
    displacement_sums,
    point_force_displacement,
    point_force_resultant,
    point_force_stress,
    resultant_integrals,
    stress_sums,
)

START, END = np.array([0.1 + 0.2j]), np.array([0.5 + 0.45j])
LENGTH = abs(END - START)[0]
ALONG = (END - START)[0] / LENGTH
KAPPA = 1.8
# near, behind, ahead, on the line ahead, both sides of the switch to the series (|eta| = 5), far, and 1e-3 off an end
POINTS = np.array(
    [
        0.3 + 0.4j,
        0.31 + 0.33j,
        -0.3 + 0.1j,
        0.9 + 0.7j,
        0.3 + 0.325j + 4.99 * LENGTH / 2,
        0.3 + 0.325j + 5.01j * LENGTH / 2,
        2 + 3j,
        -5 - 2j,
        100 + 30j,
        1e4 - 1e4j,
        0.1 + 0.201j,
    ]
)


def integral(function):
    return quad(function, 0, LENGTH, limit=2000, epsabs=1e-14, epsrel=1e-13)[0]


def weight(kind, t):
    return t / LENGTH if kind else 1 - t / LENGTH


@pytest.mark.parametrize("kind", [0, 1])
@pytest.mark.parametrize("z", POINTS)
def test_displacement_integrals_are_the_quadrature(z, kind):
    first, last = np.array([0]), np.array([1])
    log_r, twist = displacement_integrals(np.array([z]), START, END, first, last, 2)

    def ratio(t):
        away = z - START[0] - ALONG * t
        return away / np.conj(away)

    assert log_r[0, kind] == pytest.approx(
        integral(lambda t: weight(kind, t) * np.log(abs(z - START[0] - ALONG * t))), rel=1e-12, abs=1e-14
    )
    assert twist[0, kind].real == pytest.approx(
        integral(lambda t: weight(kind, t) * ratio(t).real), rel=1e-12, abs=1e-14
    )
    assert twist[0, kind].imag == pytest.approx(
        integral(lambda t: weight(kind, t) * ratio(t).imag), rel=1e-12, abs=1e-14
    )


@pytest.mark.parametrize("z", POINTS)
def test_stress_and_displacement_sums_are_the_quadrature(z):
    begin, end = np.array([1.3 - 0.4j]), np.array([-0.2 + 0.9j])
    stress = stress_sums(np.array([z]), START, END, begin, end, KAPPA)[0]
    force = lambda t: begin[0] * weight(0, t) + end[0] * weight(1, t)
    size = np.abs(stress).max()
    for component in range(3):
        expected = integral(
            lambda t: point_force_stress(np.array([z]), START[0] + ALONG * t, force(t), KAPPA)[0, component]
        )
        # eps times the distance in elements, 5e4
        assert stress[component] == pytest.approx(expected, rel=1e-11, abs=1e-11 * size)
    moved = displacement_sums(np.array([z]), START, END, begin, end, KAPPA)[0]
    part = lambda t: point_force_displacement(np.array([z]), START[0] + ALONG * t, force(t), KAPPA)[0]
    assert moved.real == pytest.approx(integral(lambda t: part(t).real), rel=1e-12, abs=1e-13)
    assert moved.imag == pytest.approx(integral(lambda t: part(t).imag), rel=1e-12, abs=1e-13)


def test_point_force_is_balanced_by_the_traction_around_it():
    angle = np.linspace(0, 2 * np.pi, 8)
    circle = 0.3 - 0.1j + 2 * np.exp(1j * angle)
    total = point_force_resultant(circle[:-1], circle[1:], 0.5 + 0.2j, 3.0 - 2.0j, KAPPA).sum()
    assert total == pytest.approx(-(3.0 - 2.0j), rel=1e-14)


def test_point_force_resultant_is_the_stress_summed_along_the_path():
    a, b, at, force = 0.7 - 0.3j, 1.9 + 0.4j, 0.2 + 0.5j, 1.1 + 0.6j
    step = b - a
    normal = -1j * step / abs(step)
    position, share = np.polynomial.legendre.leggauss(60)
    xx, yy, xy = point_force_stress(a + step * (1 + position) / 2, at, force, KAPPA).T
    expected = (
        np.sum(share * (xx * normal.real + xy * normal.imag + 1j * (xy * normal.real + yy * normal.imag)))
        * abs(step)
        / 2
    )
    assert point_force_resultant(np.array([a]), np.array([b]), at, force, KAPPA)[0] == pytest.approx(
        expected, rel=1e-13
    )


def _closed_integrals(vertices):
    k = len(vertices)
    this, following = np.arange(k), (np.arange(k) + 1) % k
    end = vertices[following]
    points = np.r_[vertices, (vertices + end) / 2]
    return resultant_integrals(
        points,
        np.r_[this, k + this],
        np.r_[k + this, following],
        np.r_[this, following],
        k,
        vertices,
        end,
        this,
        following,
        k,
    )


@pytest.mark.parametrize("shape", ["circle", "square", "graded", "notch"])
def test_resultants_over_a_closed_boundary_vanish_inside(shape):
    """The angle under which a source on the boundary sees the boundary from inside returns to itself; collinear and
    reentrant neighbours are where a branch of the logarithm would be lost."""
    if shape == "circle":
        vertices = np.exp(1j * np.linspace(0, 2 * np.pi, 40)[:-1])
    else:
        corners = np.array([0, 2, 2 + 1j, 1j] if shape != "notch" else [0, 2, 2 + 2j, 1 + 2j, 1 + 1j, 1j])
        fraction = (
            np.linspace(0, 1, 8)[:-1]
            if shape != "graded"
            else np.sort(0.5 * (1 - np.cos(np.linspace(0, np.pi, 24)[:-1])))
        )
        vertices = np.concatenate([a + (b - a) * fraction for a, b in zip(corners, np.roll(corners, -1))])
    for part in _closed_integrals(vertices):
        np.testing.assert_allclose(part.sum(axis=0), 0, atol=1e-13)


def test_smooth_boundary_jumps_by_half_the_force():
    """On a straight piece the cell of a node takes half the force density there: 3/8 of its element, 1/8 of the
    neighbours'."""
    vertices = np.concatenate(
        [np.linspace(0, 7, 8), np.linspace(8, 8 + 8j, 9), np.linspace(7 + 8j, 8j, 8), np.linspace(7j, 1j, 7)]
    )
    _, angle, _ = _closed_integrals(vertices)
    np.testing.assert_allclose(-angle[4, 3:6] / (2 * np.pi), np.array([0.125, 0.75, 0.125]) / 2, atol=1e-14)
