"""The load step on small systems whose answer is known by hand or by exhaustive search."""

import itertools

import numpy as np
import pytest

from bem.plane.coulomb import BACKWARD, FORWARD, OPEN, STICK, ContactSystem, Control, solve_step


def springs(gaps, normal=1.0, shear=2.0):
    """Independent springs of compliance `normal` and `shear`; the slave above moves by (x, y), normals point down."""
    n = len(gaps)
    motion = np.zeros((2 * n, 3))
    motion[:n, 1] = 1.0  # moving up opens the gap
    motion[n:, 0] = -1.0  # the slave's tangent points along -x
    forces = np.zeros((3, 2 * n))
    forces[1, :n] = 1.0
    forces[0, n:] = -1.0
    return ContactSystem(np.asarray(gaps, float), np.diag(np.r_[np.full(n, normal), np.full(n, shear)]), motion, forces)


def test_springs_share_a_load():
    """Gaps 0, 1, 5; load 3: two springs close, p = 2 and 1."""
    state = solve_step(springs([0.0, 1.0, 5.0]), Control.of(force=(None, -3.0)), 0.0)
    np.testing.assert_allclose(state.pressure, [2, 1, 0])
    np.testing.assert_allclose(state.gap, [0, 0, 3], atol=1e-15)
    assert state.motion[1] == pytest.approx(-2.0)


def test_springs_stick_then_slip():
    """p = 2 and 1, mu = 0.5, compliance 2: pulled by x the shear is x/2 each until 0.5 on the weaker."""
    system, friction = springs([0.0, 1.0]), 0.5
    stuck = solve_step(system, Control.of(force=(0.8, -3.0)), friction)
    np.testing.assert_array_equal(stuck.state, [STICK, STICK])
    np.testing.assert_allclose(np.abs(stuck.shear), 0.4)
    partly = solve_step(system, Control.of(force=(1.2, -3.0)), friction)
    np.testing.assert_array_equal(np.abs(partly.state), [STICK, FORWARD])
    np.testing.assert_allclose(np.abs(partly.shear), [0.7, 0.5])
    assert system.forces[0] @ np.r_[partly.pressure, partly.shear] == pytest.approx(-1.2)


def test_slip_is_remembered():
    """Pushed to slip and let go, the springs keep a shear."""
    system = springs([0.0, 1.0])
    pushed = solve_step(system, Control.of(force=(1.4, -3.0)), 0.5)
    released = solve_step(system, Control.of(force=(0.0, -3.0)), 0.5, pushed.slip, pushed.state)
    assert np.abs(released.shear).max() > 0.1
    assert released.shear.sum() == pytest.approx(0, abs=1e-14)


def _random_system(seed, n=5):
    random = np.random.default_rng(seed)
    factor = random.normal(size=(2 * n, 2 * n))
    system = springs(random.uniform(0, 1, n))
    return ContactSystem(system.gap, factor @ factor.T / n + np.eye(2 * n), system.motion, system.forces)


@pytest.mark.parametrize("seed", range(8))
def test_coupled_system_without_friction_is_the_only_consistent_one(seed):
    """All 2^5 sets of open and closed nodes are tried; exactly one is consistent, and it is the one found."""
    system, n, down = _random_system(seed), 5, -0.7
    found = solve_step(system, Control.of(motion=(None, down)), 0.0)
    consistent = []
    for closed in itertools.product([False, True], repeat=n):
        closed = np.array(closed)
        pressure = np.zeros(n)
        part = np.flatnonzero(closed)
        pressure[part] = (
            np.linalg.solve(system.compliance[np.ix_(part, part)], -(system.gap + down)[part]) if len(part) else []
        )
        gap = system.gap + down + system.compliance[:n, :n] @ pressure
        if np.all(pressure >= -1e-12) and np.all(gap >= -1e-12):
            consistent.append(pressure)
    assert len(consistent) == 1
    np.testing.assert_allclose(found.pressure, consistent[0], atol=1e-12)


@pytest.mark.parametrize("seed", range(8))
@pytest.mark.parametrize("friction", [0.05, 0.3])
def test_coupled_system_with_friction_meets_every_condition(seed, friction):
    system = _random_system(seed)
    state = solve_step(system, Control.of(motion=(0.4, -0.7)), friction)
    assert np.all(state.pressure >= 0) and np.all(state.gap >= -1e-12)
    np.testing.assert_allclose(state.pressure * state.gap, 0, atol=1e-12)
    assert np.all(np.abs(state.shear) <= friction * state.pressure + 1e-12)
    slips = np.abs(state.slip) > 1e-12
    touching = slips & (state.state != OPEN)
    np.testing.assert_allclose(
        state.shear[touching], -friction * (np.sign(state.slip) * state.pressure)[touching], atol=1e-12
    )
    assert set(state.state) <= {OPEN, STICK, FORWARD, BACKWARD}


def test_motion_driven_body_far_away_is_free():
    state = solve_step(springs([1.0, 2.0]), Control.of(motion=(None, -0.5)), 0.3)
    assert not state.pressure.any()
    np.testing.assert_allclose(state.gap, [0.5, 1.5])
