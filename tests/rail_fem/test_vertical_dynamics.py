"""The light models' time step: exact on two masses, second order, momentum and energy kept."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import trapezoid

from rail_fem.contact.contact_law import ContactLaw, contact_energy, contact_force, indentation
from rail_fem.passes.vertical_dynamics import Masses, integrate, static_distance
from tests.order import assert_order

WHEEL, TRACK, SPRING = 500.0, 750.0, 1.2e9


def free_pair(load=0.0):
    """Wheel and track mass, nothing else."""
    return Masses(
        np.array([WHEEL, TRACK]), np.zeros((2, 2)), np.zeros((2, 2)), np.array([-load, load]), np.array([1.0, -1.0])
    )


def law(steps, stiffness, exponent, height=None, **plastic_indentation):
    height = np.zeros(2 * steps + 1) if height is None else height
    fill = lambda value: np.full((1, 2 * steps + 1), value)
    return ContactLaw(
        height[None],
        fill(stiffness),
        exponent=exponent,
        **{name: fill(value) for name, value in plastic_indentation.items()},
    )


@pytest.mark.parametrize(
    "exponent, plastic_indentation",
    [
        (1.0, {}),
        (1.5, {}),
        (1.5, {"yield_load": 5e3, "plastic_compliance": 2e-9}),
        (1.3, {"plastic_compliance": 1e-9, "relief": -0.2, "lag": 3e-4}),
    ],
)
def test_second_order_on_every_contact_law(exponent, plastic_indentation):
    """One lasting contact, a load of 86 kN, started away from rest; against a hundred times finer steps."""
    duration, stiffness = 4e-3, SPRING if exponent == 1 else 4e10

    def end(steps):
        start = np.array([-1.2e-4, 0.0])
        return integrate(
            free_pair(86e3),
            start,
            np.zeros(2),
            duration / steps,
            law(steps, stiffness, exponent, **plastic_indentation),
        ).position[-1]

    steps = np.array([40, 80, 160])
    exact = end(16000)
    assert_order(duration / steps, [np.abs(end(n) - exact).max() for n in steps], expected=2)


def test_two_masses_on_a_linear_contact_follow_the_closed_form():
    """Relative motion is a cosine of frequency sqrt(k / m), 1/m = 1/500 + 1/750; implicit midpoint turns its phase by 2
    atan(wh/2) a step."""
    steps, amplitude, load = 200, 3e-5, 86e3
    omega = np.sqrt(SPRING * (1 / WHEEL + 1 / TRACK))
    step = 6e-3 / steps
    equilibrium = -load / SPRING
    start = np.array([equilibrium + amplitude, 0.0])
    motion = integrate(free_pair(load), start, np.zeros(2), step, law(steps, SPRING, 1.0))
    phase = 2 * np.arctan(omega * step / 2) * np.arange(steps + 1)
    np.testing.assert_allclose(
        motion.position @ [1, -1] - equilibrium, amplitude * np.cos(phase), atol=1e-11 * steps * amplitude
    )
    exact = amplitude * np.cos(omega * step * np.arange(steps + 1))
    assert (
        np.abs(motion.position @ [1, -1] - equilibrium - exact).max()
        < 1.01 * amplitude * omega * 6e-3 * (omega * step) ** 2 / 12
    )  # the scheme's own phase error


def test_impact_keeps_momentum_to_round_off_and_energy_to_second_order():
    """A wheel falls on a free track mass and leaves it again: all momentum, all energy."""
    loss = []
    for steps in (400, 800, 1600):
        motion = integrate(
            free_pair(), np.array([1e-5, 0.0]), np.array([-0.3, 0.0]), 8e-3 / steps, law(steps, 4e10, 1.5)
        )
        momentum = motion.velocity @ [WHEEL, TRACK]
        assert (
            np.abs(momentum / momentum[0] - 1).max() < 1e-12 and motion.force[0, -1] == 0 and motion.force.max() > 1e5
        )
        kinetic = 0.5 * motion.velocity**2 @ [WHEEL, TRACK]
        loss.append(abs(kinetic[-1] / kinetic[0] - 1))
    assert loss[-1] < 1e-4 and loss[-1] < loss[0] / 4
    relative = motion.velocity @ [1, -1]
    assert relative[-1] == pytest.approx(-relative[0], rel=1e-4)


def test_linear_system_in_lasting_contact_keeps_energy_exactly():
    steps, load = 3000, 86e3
    motion = integrate(free_pair(load), np.array([-5e-5, 0.0]), np.zeros(2), 2e-5, law(steps, SPRING, 1.0))
    assert motion.force.min() > 0
    contact = [
        contact_energy(s, np.zeros(1), np.array([[SPRING, 1.0, 0.0, 0.0, 0.0, 0.0]])) for s in motion.position @ [1, -1]
    ]
    energy = 0.5 * motion.velocity**2 @ [WHEEL, TRACK] + contact + load * (motion.position @ [1, -1])
    assert np.ptp(energy) < 1e-9 * np.ptp(contact)


def test_groove_law_is_the_sum_of_both_depths_and_its_energy_the_work():
    at = (4e10, 1.5, 5e3, 2e-9, 0.0, 0.0)
    depth = np.linspace(1e-6, 8e-4, 4001)
    force = np.array([contact_force(d, at)[0] for d in depth])
    np.testing.assert_allclose((force / 4e10) ** (2 / 3) + 2e-9 * np.maximum(force - 5e3, 0), depth, rtol=1e-12)
    work = trapezoid(force, depth)
    energy = contact_energy(-depth[-1], np.zeros(1), np.array([at])) - contact_energy(
        -depth[0], np.zeros(1), np.array([at])
    )
    assert energy == pytest.approx(work, rel=1e-6)  # trapezoidal rule, 4000 intervals


@pytest.mark.parametrize("relief", [-0.4, 0.2, 1.3])
def test_rolled_law_is_the_sum_of_elastic_approach_and_indentation(relief):
    """Of a contact that grows flatter under load (relief < 0: indented from the first), of Hertz', and of one that
    grows sharper."""
    stiffness, exponent, compliance = 4e10, 1.3, 2e-9
    at = (stiffness, exponent, 0.0, compliance, relief, 1e-4)
    depth = np.linspace(1e-6, 8e-4, 401)
    force = np.array([contact_force(d, at)[0] for d in depth])
    elastic = (force / stiffness) ** (1 / exponent)
    dent = np.maximum(compliance * force - relief * elastic, 0)
    assert dent[-1] > 0 and (relief < 1 or dent[0] == 0)
    np.testing.assert_allclose(elastic + dent, depth, rtol=1e-12)
    np.testing.assert_allclose([indentation(f, at) for f in force], dent, rtol=1e-12, atol=1e-20)
    slope = np.array([contact_force(d, at)[1] for d in depth])
    error = np.abs(np.gradient(force, depth)[1:-1] / slope[1:-1] - 1)
    assert np.median(error) < 1e-4 and (np.diff(force) > 0).all()  # a bend where the indentation begins


def test_a_dent_that_lags_follows_a_held_force_as_an_exponential():
    """A heavy wheel on a track that cannot move back: the force stays, the dent goes from 0 to what the law wants."""
    steps, lag, load, step = 200, 1e-3, 86e3, 2e-5
    at = law(steps, 4e10, 1.5, plastic_compliance=1e-9, relief=0.2, lag=lag)
    heavy = free_pair(load)._replace(mass=np.array([1e-6, 1e12]))  # no inertia: the contact carries the load
    late = replace(at, plastic_compliance=at.plastic_compliance.copy())
    late.plastic_compliance[0, 0] = 0.0  # at the first time alone, where the dent begins
    motion = integrate(heavy, np.array([static_distance(load, late), 0.0]), np.zeros(2), step, late)
    np.testing.assert_allclose(motion.force[0, 5:], load, rtol=1e-3)
    wanted = indentation(load, (4e10, 1.5, 0.0, 1e-9, 0.2, lag))
    time = step * np.arange(steps + 1)
    np.testing.assert_allclose(motion.dent[0], wanted * (1 - np.exp(-time / lag)), atol=2e-3 * wanted)


def test_a_dent_that_hardly_lags_is_that_of_the_force_at_once():
    steps, at = 400, (4e10, 1.5, 0.0, 1e-9, 0.2, 1e-9)
    motion = integrate(
        free_pair(86e3),
        np.array([-1.2e-4, 0.0]),
        np.zeros(2),
        1e-5,
        law(steps, *at[:2], plastic_compliance=at[3], relief=at[4], lag=at[5]),
    )
    middle = (motion.dent[0, 1:] + motion.dent[0, :-1]) / 2
    np.testing.assert_allclose(middle, [indentation(f, at) for f in motion.force[0]], rtol=1e-4)
    assert motion.dent[0].max() > 20e-6


def test_static_rest_carries_the_load():
    two = ContactLaw(np.array([[0.0] * 3, [2e-5] * 3]), np.full((2, 3), 4e10))
    s = static_distance(86e3, two)
    assert sum(contact_force(h - s, (4e10, 1.5, 0.0, 0.0, 0.0, 0.0))[0] for h in (0.0, 2e-5)) == pytest.approx(
        86e3, rel=1e-10
    )


def test_a_motion_that_is_no_number_is_told_with_its_step():
    law = ContactLaw(np.zeros((1, 21)), np.full((1, 21), SPRING))
    with pytest.raises(FloatingPointError, match="not finite from step 0 of 10 on"):
        integrate(free_pair(), np.array([np.nan, 0.0]), np.zeros(2), 1e-5, law)
