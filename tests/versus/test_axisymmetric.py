"""Axisymmetric finite elements that yield: exact solutions, and the half-space of cuboids beside them."""

import numpy as np
import pytest

from bem.exact.yielding_sphere import first_yield
from bem.material import STEEL, Elastic, contact_modulus
from bem.steel.hardening import Hardening
from rail_fem.static_fe.pressed_nodes import quadrilaterals
from rail_fem.static_fe.pressed_sphere import press_sphere, tributary_area
from rail_fem.static_fe.small_strain import HeldMotions, SmallStrainError
from rail_fem.studies.pressed_sphere import (
    RIGID,
    Indented,
    Judged,
    indent,
    judge,
    mean_pressure,
    press,
    table,
    vanishing,
)
from tests.order import assert_order

YOUNG, NU, YIELD = 210e9, 0.3, 300e6
RADIUS = 0.1
MODULUS = contact_modulus(RIGID, STEEL)


def hollow_sphere(inner: float, outer: float, across: int, around: int, elastic: Elastic, limit: float):
    """A quarter: the body, degrees of freedom on axis and equator, nodal forces of unit pressure inside, radii."""
    radius = np.geomspace(inner, outer, across + 1)
    angle = np.linspace(0, np.pi / 2, around + 1)  # from the axis above
    rho, theta = (values.ravel() for values in np.meshgrid(radius, angle, indexing="ij"))
    at = np.arange(len(rho)).reshape(across + 1, around + 1)
    quads = np.stack([at[:-1, 1:], at[1:, 1:], at[1:, :-1], at[:-1, :-1]], axis=-1).reshape(-1, 4)
    nodes = np.column_stack([rho * np.sin(theta), rho * np.cos(theta)])
    nodes[at[:, 0], 0], nodes[at[:, -1], 1] = 0.0, 0.0
    body = quadrilaterals(nodes, quads, elastic, Hardening.linear(limit), revolved=True)
    push = np.zeros(body.count)
    for a, b in zip(at[0, :-1], at[0, 1:]):
        (ra, za), (rb, zb) = nodes[a], nodes[b]
        for node, share in ((a, (2 * ra + rb) / 6), (b, (ra + 2 * rb) / 6)):
            push[2 * node : 2 * node + 2] += 2 * np.pi * share * np.array([za - zb, rb - ra])
    fixed = np.r_[2 * at[:, 0], 2 * at[:, -1] + 1]
    return body, fixed, push, 2 * at[:, -1], radius


def exact_sphere(c: float, inner: float, outer: float) -> tuple[float, float, float]:
    """Pressure [Pa], displacement inside and outside [m] when a perfectly plastic hollow sphere has yielded to the
    radius c; Hill, Plasticity (1950), ch. V.2 (from memory: both displacements meet at c)."""
    ratio = (c / outer) ** 3
    pressure = 2 * YIELD * np.log(c / inner) + 2 / 3 * YIELD * (1 - ratio)
    inside = (1 - NU) * c**3 / inner**2 - 2 / 3 * (1 - 2 * NU) * (1 + 3 * np.log(c / inner) - ratio) * inner
    outside = ratio * outer * (1 - NU)
    return pressure, YIELD / YOUNG * inside, YIELD / YOUNG * outside


@pytest.mark.parametrize("nu", [0.3, 0.4999])
def test_a_hollow_sphere_is_elastic_to_second_order(nu):
    """Lame: u(a) = p a / E [a^3 (1 - 2 nu) + b^3 (1 + nu) / 2] / (b^3 - a^3); no locking near nu = 0.5."""
    exact = 1e6 / YOUNG * ((1 - 2 * nu) + 8 * (1 + nu) / 2) / 7
    sizes, errors = (4, 8, 16), []
    for n in sizes:
        body, fixed, push, equator, _ = hollow_sphere(1.0, 2.0, n, 2 * n, Elastic(YOUNG, nu), 1e12)
        found = body.equilibrium(HeldMotions.still(fixed, body.count), body.at_rest(), 1e6 * push)
        errors.append(found.displacement[equator[0]] / exact - 1)
    assert_order(1 / np.array(sizes), errors, 2, slack=0.2)
    assert abs(errors[-1]) < 3e-3


def test_a_hollow_sphere_that_yields_half_way_is_the_exact_one():
    """Displacement of both faces against Hill's solution, of second order; Newton's method ends quadratically."""
    errors = []
    for n in (8, 16, 32):
        body, fixed, push, equator, _ = hollow_sphere(1.0, 2.0, n, n, Elastic(YOUNG, NU), YIELD)
        pressure, inside, outside = exact_sphere(1.5, 1.0, 2.0)
        found, held = body.at_rest(), HeldMotions.still(fixed, body.count)
        for part in (0.5, 0.8, 1.0):
            found = body.equilibrium(held, found, part * pressure * push)
        u = found.displacement
        errors.append((u[equator[0]] / inside - 1, u[equator[-1]] / outside - 1))
    assert_order([4, 2, 1], [one for one, _ in errors], 2, slack=0.5)
    assert np.abs(errors[-1]).max() < 2e-3
    last = found.mismatch[-3:]
    assert last[1] < 0.1 * last[0] and last[2] < 0.05 * last[1]


def test_more_than_a_hollow_sphere_carries_is_refused():
    """2 Y ln(b / a) is its limit."""
    body, fixed, push, *_ = hollow_sphere(1.0, 2.0, 6, 6, Elastic(YOUNG, NU), YIELD)
    with pytest.raises(SmallStrainError, match="smaller loads"):
        body.equilibrium(HeldMotions.still(fixed, body.count), body.at_rest(), 2.2 * YIELD * np.log(2) * push)


def test_an_elastic_sphere_is_that_of_hertz():
    """Load at an approach to second order; area to first: the edge of the contact lies inside the last node."""
    steel, loads, areas = (STEEL, Hardening.linear(1e15)), [], []
    for across in (4, 8, 16):
        found = press_sphere(lambda r: r**2 / (2 * RADIUS), 1e-3, across, *steel)
        approach = 0.95 * found.approach[-1]
        load, area = found.at(approach)
        loads.append(load / (4 / 3 * MODULUS * np.sqrt(RADIUS * approach**3)) - 1)
        areas.append(area / (np.pi * RADIUS * approach) - 1)
        assert found.pressure @ tributary_area(found.r) == pytest.approx(found.load[-1], rel=1e-9)
    assert_order([4, 2, 1], areas, 1, slack=0.15)
    assert abs(loads[-1]) < 2e-3 and abs(2 * areas[-1] - areas[-2]) < 4e-3


def test_half_space_and_finite_elements_agree_at_three_times_yield():
    """Small strain both, nothing shared: 12 cells across against 6 and 12 elements over the radius."""
    here = indent(3.0, 6)
    there = judge([press(here.approach, across) for across in (6, 12)], here.approach)
    assert here.approach == pytest.approx(3.0, rel=0.03)
    assert here.area == pytest.approx(there.area, rel=0.03)
    assert mean_pressure(here.load, here.area) == pytest.approx(mean_pressure(there.load, there.area), rel=0.03)


def test_radius_and_steel_drop_out():
    """In small strain on a flat surface w and Poisson's ratio are all there is."""
    found = []
    for radius, limit in ((0.1, 310e6), (0.7, 900e6)):
        first = first_yield(radius, MODULUS, limit)
        run = press_sphere(
            lambda r: r**2 / (2 * radius), 2.2 * np.sqrt(first.area / np.pi), 8, STEEL, Hardening.linear(limit)
        )
        found.append((run.load[-1] / first.load, run.approach[-1] / first.approach, run.radius[-1] ** 2 / first.area))
    assert np.allclose(found[0], found[1], rtol=1e-6)


@pytest.mark.parametrize("fault", ["folded", "left of the axis"])
def test_one_element_among_good_ones_that_is_none_is_refused(fault):
    steel = Elastic(YOUNG, NU), Hardening.linear(YIELD)
    nodes = np.array([[r, z] for z in (0.0, 1.0) for r in (0.0, 1.0, 2.0)])
    quads = np.array([[0, 1, 4, 3], [1, 2, 5, 4]])
    assert quadrilaterals(nodes, quads, *steel, revolved=True).count == 12
    quads, nodes = (quads[:, ::-1] if fault == "folded" else quads), nodes - [3.0 * (fault != "folded"), 0.0]
    quads[0] = [0, 1, 4, 3]
    with pytest.raises(SmallStrainError, match="elements are folded or left of the axis"):
        quadrilaterals(nodes, quads, *steel, revolved=True)


@pytest.mark.validate
@pytest.mark.parametrize("approach", [10.0, 30.0])
def test_half_space_and_finite_elements_agree_far_beyond_yield(approach):
    """16 cells across; the limit of the finite elements from 12 and 24 over the radius."""
    here = indent(approach, 8)
    there = judge([press(here.approach, across) for across in (12, 24)], here.approach)
    assert here.area == pytest.approx(there.area, rel=0.02)
    assert mean_pressure(here.load, here.area) == pytest.approx(mean_pressure(there.load, there.area), rel=0.02)


def test_the_limit_of_two_sizes_is_that_of_a_line_in_the_cell():
    """Area and approach linear in the cell: met exactly, the bar half of what the limit adds; the table says limit."""
    found = [Indented(10 + 1 / n, 16.0, 20 - 8 / n, float(n), 0.01, 1.0) for n in (6, 8)]
    limit = vanishing(found)
    assert limit.approach == pytest.approx(10) and limit.area == pytest.approx(20)
    assert limit.area_bar == pytest.approx(0.5) and limit.load == 16.0
    shown = table([(limit, Judged(16.0, 0.1, 20.0, 0.2, 1.0))]).markdown()
    assert "| 10 | limit | 20.00 +- 0.50 | 20.00 +- 0.20 | +0.0% |" in shown
