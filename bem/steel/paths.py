"""A point led along a path: some components of stress prescribed, of the others the strain."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from bem.steel.cyclic_law import CyclicLaw, update
from kernel_cache import njit

_ITERATIONS, _TOLERANCE, _PROBE = 40, 1e-11, 1e-8  # of Newton's method; of the stress over the yield stress; strain


class PointState(NamedTuple):
    """strain, stress (6,) [1], [Pa], order VOIGT, tensor shears;  back (k, 6) [Pa];  plastic_strain (1,), cumulated"""

    strain: np.ndarray
    stress: np.ndarray
    back: np.ndarray
    plastic_strain: np.ndarray


def at_rest(law: CyclicLaw) -> PointState:
    """The virgin point."""
    return PointState(np.zeros(6), np.zeros(6), np.zeros((law.modulus.size, 6)), np.zeros(1))


@njit(cache=True)
def march(law: CyclicLaw, stress_given: np.ndarray, path: np.ndarray, state: PointState, record: np.ndarray) -> int:
    """Lead the point along `path`; the state is changed in place.

    stress_given : (6,) bool, components whose stress the path gives; of the others it gives the strain
    path   : (n, 6) targets [Pa] or [1], reached in one step of the law each
    record : (n, 13) strain, stress, plastic strain after each step

    Returns the number of steps made: fewer than n where no strain reaches the stress (a perfectly plastic point asked
    for more than it can carry). Newton's method with the tangent by differences.
    """
    free = np.flatnonzero(stress_given)
    m, scale = free.size, law.yield_stress
    increment, residual, tangent = np.zeros(6), np.empty(m), np.empty((m, m))
    stress, back = np.empty(6), np.empty_like(state.back)
    for n in range(path.shape[0]):
        converged = False
        for damped in (False, True):  # full steps first; where they go to and fro, half of a step that made it worse
            for j in range(6):  # from no strain of the free components on, so that unloading finds the elastic branch
                increment[j] = 0.0 if stress_given[j] else path[n, j] - state.strain[j]
            step, last = np.zeros(m), np.inf
            for _ in range(_ITERATIONS):
                p = _trial(law, increment, state, stress, back)
                worst = 0.0
                for a in range(m):
                    residual[a] = path[n, free[a]] - stress[free[a]]
                    worst = max(worst, abs(residual[a]) / scale)
                if worst <= _TOLERANCE:
                    converged = True
                    break
                if damped and worst > last:
                    step *= 0.5
                    for a in range(m):
                        increment[free[a]] -= step[a]
                    continue
                last = worst
                for b in range(m):
                    probe = _PROBE
                    increment[free[b]] += probe
                    base = stress.copy()
                    _trial(law, increment, state, stress, back)
                    increment[free[b]] -= probe
                    for a in range(m):
                        tangent[a, b] = (stress[free[a]] - base[free[a]]) / probe
                    stress[:] = base
                for a in range(m):  # a perfectly plastic tangent is singular: 1e-9 of the elastic one
                    tangent[a, a] += 1e-9 * law.shear
                step = np.linalg.solve(tangent, residual)
                if not np.isfinite(step).all() or np.abs(step).max() > 1.0:
                    break
                for a in range(m):
                    increment[free[a]] += step[a]
            if converged:
                break
        if not converged:
            return n
        state.strain[:] += increment
        state.stress[:], state.back[:] = stress, back
        state.plastic_strain[0] = p
        record[n, :6], record[n, 6:12], record[n, 12] = state.strain, stress, p
    return path.shape[0]


@njit(cache=True)
def _trial(law, increment, state, stress, back):
    stress[:], back[:] = state.stress, state.back
    return update(law, increment, stress, back, state.plastic_strain[0])


UNIAXIAL_STRESS = np.ones(6, bool)
UNIAXIAL_STRAIN = np.array([False, True, True, True, True, True])  # axial strain given, lateral stresses vanish


def uniaxial_cycles(
    law: CyclicLaw, extremes: tuple[float, float], cycles: int, steps: int, stress_control: bool
) -> np.ndarray:
    """Axial strain, stress and plastic strain (cycles * 2 * steps + steps, 3) between two extremes, upper first.

    extremes : (lower, upper) [Pa] or [1];  steps : of a half cycle
    Errors: ValueError where the point cannot carry the stress.
    """
    low, high = extremes
    if not (np.isfinite([low, high]).all() and low < high and cycles >= 0 and steps >= 1):
        raise ValueError(
            f"cycles between {low!r} and {high!r}, {cycles} of 2 x {steps} steps: give low < high, steps > 0"
        )
    up, down = np.linspace(low, high, steps + 1)[1:], np.linspace(high, low, steps + 1)[1:]
    axial = np.concatenate([np.linspace(0, high, steps + 1)[1:], *([down, up] * cycles)])
    path = np.zeros((axial.size, 6))
    path[:, 0] = axial
    record, state = np.empty((axial.size, 13)), at_rest(law)
    made = march(law, UNIAXIAL_STRESS if stress_control else UNIAXIAL_STRAIN, path, state, record)
    if made < len(path):
        raise ValueError(
            f"no strain reaches {axial[made] * 1e-6:.1f} MPa at step {made + 1} of {len(path)}:"
            " the law's limit is below it"
            if stress_control
            else f"no equilibrium at strain {axial[made]:g}, step {made + 1} of {len(path)}: give more steps"
        )
    return record[:, [0, 6, 12]]


def ratchet_strain(modulus: float, recovery: float, yield_stress: float, low: float, high: float) -> float:
    """Plastic strain that a cycle of stress between `low` and `high` [Pa] leaves, the same in every cycle, in
    closed form: a judge of the law's integration.

    One back stress, constant yield stress Y: with r = C / gamma and the flow's sign s, d alpha = (C s - gamma alpha)
    dp, so alpha = s r + (alpha0 - s r) exp(-gamma dp), integrated once. The loading half takes alpha from a1 = low + Y
    to a2 = high - Y, the other half back: their plastic strains differ by ln((r^2 - a1^2) / (r^2 - a2^2)) / gamma. 0
    where the range stays within 2 Y.
    Errors: ValueError where the stress is beyond what the law carries, Y + r.
    """
    bound = modulus / recovery
    if max(abs(low), abs(high)) >= yield_stress + bound:
        raise ValueError(
            f"stress {max(abs(low), abs(high)):g} Pa: the law carries less than {yield_stress + bound:g} Pa"
        )
    if high - low <= 2 * yield_stress:
        return 0.0
    first, last = low + yield_stress, high - yield_stress
    return float(np.log((bound**2 - first**2) / (bound**2 - last**2)) / recovery)
