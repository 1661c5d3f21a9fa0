"""J2 plasticity for many cycles: a sum of back stresses with dynamic recovery, and isotropic hardening that saturates.

Each back stress follows Abdel-Karim and Ohno,
    d alpha = 2/3 C d eps_p - mu gamma alpha dp   within   |alpha| <= C / gamma,
the bound held by radial projection: mu = 1 is Armstrong and Frederick (a sum of them Chaboche's), which ratchets for
ever; mu = 0 is the first model of Ohno and Wang, which stops; between them lies what steels do. Yield stress:
    Y(p) = yield_stress + hardening (1 - exp(-hardening_rate p)).
Norms are von Mises': |a| = sqrt(3/2 a:a), p the equivalent plastic strain.

Sources: Armstrong & Frederick, CEGB report RD/B/N731 (1966); Chaboche, Int. J. Plasticity 5 (1989) 247; Ohno & Wang,
Int. J. Plasticity 9 (1993) 375; Abdel-Karim & Ohno, Int. J. Plasticity 16 (2000) 225; implicit integration: Kobayashi &
Ohno, Int. J. Numer. Meth. Eng. 53 (2002) 2217. The papers were not opened. Read were public implementations:
Armstrong and Frederick's rule with the saturating yield stress (docs.rs, oxiphysics-materials, `Chaboche`) is this one;
one of Abdel-Karim and Ohno has the same growth and bound, but lets the part with mu act only while the flow goes along
the back stress, so that it recovers less on reversal. What is coded is what stands above, held to closed forms and to
an independent integration (tests/rail_fem/test_cyclic_law.py).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from bem.material import back_stress_constants, refuse_outside
from kernel_cache import njit

_TOLERANCE, _MOST = 1e-14, 100  # of the plastic strain increment against the elastic one; iterations


class CyclicLaw(NamedTuple):
    """A steel's constants. Make one by `cyclic_law`, which checks them.

    shear, bulk [Pa];  yield_stress, hardening [Pa], hardening_rate [1];
    modulus : (k,) C of each back stress [Pa];  recovery : (k,) gamma [1];  mixing : (k,) mu, 0 to 1
    """

    shear: float
    bulk: float
    yield_stress: float
    hardening: float
    hardening_rate: float
    modulus: np.ndarray
    recovery: np.ndarray
    mixing: np.ndarray


def cyclic_law(
    youngs_modulus: float,
    poisson: float,
    yield_stress: float,
    modulus: np.ndarray = (),
    recovery: np.ndarray = (),
    mixing: np.ndarray | float = 1.0,
    hardening: float = 0.0,
    hardening_rate: float = 0.0,
) -> CyclicLaw:
    """A steel's law over many cycles; with no back stress and no hardening it is perfectly plastic.

    Parameters
    ----------
    youngs_modulus, poisson : float
        Young's modulus [Pa], Poisson's ratio.
    yield_stress : float
        First [Pa].
    modulus, recovery : (k,) array, optional
        C [Pa] and gamma of each back stress.
    mixing : (k,) array or float
        mu, 0 to 1.
    hardening, hardening_rate : float
        What the yield stress gains [Pa], and how fast; negative is cyclic softening, the yield stress stays positive.

    Returns
    -------
    CyclicLaw

    Raises
    ------
    MaterialError
        A ValueError that names the constant, its value and its limit.

    Examples
    --------
    >>> bem.cyclic_law(210e9, 0.3, 300e6, modulus=[20e9], recovery=[100.0]).recovery
    array([100.])
    """
    refuse_outside("youngs_modulus", youngs_modulus, 0, np.inf)
    refuse_outside("poisson", poisson, -1, 0.5)
    constants = back_stress_constants(yield_stress, modulus, recovery, mixing, hardening, hardening_rate)
    shear = youngs_modulus / (2 * (1 + poisson))
    bulk = youngs_modulus / (3 * (1 - 2 * poisson))
    return CyclicLaw(shear, bulk, float(yield_stress), float(hardening), float(hardening_rate), *constants)


# One copy inside each caller, of the point as of the element: what two kernels call is the same to the last bit.
_part = njit(forceinline=True)


@njit(cache=True, forceinline=True)
def equivalent(a: np.ndarray) -> float:
    """sqrt(3/2 a:a) of a deviator (6,), order VOIGT, tensor shears."""
    return math.sqrt(1.5 * (a[0] ** 2 + a[1] ** 2 + a[2] ** 2) + 3.0 * (a[3] ** 2 + a[4] ** 2 + a[5] ** 2))


@njit(cache=True, forceinline=True)
def yield_stress_at(law: CyclicLaw, p: float) -> float:
    return law.yield_stress - law.hardening * math.expm1(-law.hardening_rate * p)


@njit(cache=True, forceinline=True)
def plastic_return(law, trial, back, p, direction, factor):
    """Bring a point back to the yield surface, where it is beyond: the law itself, which points and elements call.

    trial : (6,) trial deviator [Pa];  back : (k, 6) back stresses [Pa], both changed in place;  p : plastic strain
    direction : (6,) becomes the flow's, |direction| = 1, so that the plastic strain grows by 3/2 dp direction;
    factor : (k,) buffer
    Returns dp, 0 within the surface. No memory is taken.
    """
    for j in range(6):
        direction[j] = trial[j]
        for i in range(law.modulus.size):
            direction[j] -= back[i, j]
    if not equivalent(direction) > yield_stress_at(law, p):
        return 0.0
    dp = plastic_increment(law, trial, back, p, direction, factor)
    for j in range(6):
        for i in range(law.modulus.size):
            back[i, j] = factor[i] * (back[i, j] + law.modulus[i] * dp * direction[j])
        trial[j] -= 3.0 * law.shear * dp * direction[j]
    return dp


@_part
def plastic_increment(law, trial, back, p, direction, factor):
    """dp of the step from the trial deviator; leaves the flow direction (6,), |direction| = 1, and factor (k,), by
    which back stress k is multiplied after it has grown by C dp direction.

    Solves |trial - sum factor back| = Y(p + dp) + (3 G + sum factor C) dp: Newton's method with the recovery part of
    the factors in the derivative, the projected part by substitution; safeguarded by a bracket.
    """
    low, dp, k = 0.0, 0.0, law.modulus.size
    high = equivalent(trial)
    for i in range(k):
        high += equivalent(back[i])
    high /= 3.0 * law.shear
    largest, factor[:] = high, 1.0
    for _ in range(_MOST):
        stiffness, slope = 3.0 * law.shear, 0.0
        for j in range(6):  # an array laid into another would count references
            direction[j] = trial[j]
        for i in range(k):
            stiffness += factor[i] * law.modulus[i]
            for j in range(6):
                direction[j] -= factor[i] * back[i, j]
        size = equivalent(direction)
        for j in range(6):
            direction[j] /= size
        for i in range(k):
            recovery = law.mixing[i] * law.recovery[i]
            fall = recovery * factor[i] ** 2
            slope += fall * (1.5 * _double_dot(direction, back[i]) + law.modulus[i] * dp)
        decay = law.hardening * math.exp(-law.hardening_rate * (p + dp))
        residual = size - yield_stress_at(law, p + dp) - stiffness * dp
        if residual > 0.0:
            low = dp
        else:
            high = dp
        step = residual / max(stiffness + law.hardening_rate * decay - slope, 0.1 * stiffness)
        new = dp + step
        if not low <= new <= high:
            new = 0.5 * (low + high)
        done = abs(new - dp) <= _TOLERANCE * largest
        moved = _update_factors(law, back, new, direction, factor)
        dp = new
        if done and moved <= _TOLERANCE * 10:
            break
        if moved > 0.0 and high - low <= 1e-3 * largest:
            low, high = 0.0, largest  # the projected factors moved the root: the bracket is that of another equation
    return dp


@_part
def slope_of(law, back, p, dp, direction, factor):
    """By how much the stress that a step leaves over falls with dp, at its root dp > 0, the direction held [Pa]."""
    slope = 3.0 * law.shear + law.hardening_rate * law.hardening * math.exp(-law.hardening_rate * (p + dp))
    for i in range(law.modulus.size):
        c, along = law.modulus[i], _double_dot(direction, back[i])
        free = 1.0 / (1.0 + law.mixing[i] * law.recovery[i] * dp)
        fall = law.mixing[i] * law.recovery[i] * free**2
        if factor[i] < free:  # held to its bound: C / gamma over the norm of the back stress after its growth
            size = math.sqrt(1.5 * _double_dot(back[i], back[i]) + 3.0 * c * dp * along + (c * dp) ** 2)
            fall = factor[i] * (1.5 * c * along + c * c * dp) / size**2
        slope += factor[i] * c - fall * (1.5 * along + c * dp)
    return slope


@_part
def _update_factors(law, back, dp, direction, factor):
    """Factors of the back stresses for dp along direction; returns their largest change where one is projected."""
    moved = 0.0
    for i in range(law.modulus.size):
        new = 1.0 / (1.0 + law.mixing[i] * law.recovery[i] * dp)
        if law.recovery[i] > 0.0 and law.mixing[i] < 1.0:
            grown = law.modulus[i] * dp
            square = _double_dot(back[i], back[i]) + 2.0 * grown * _double_dot(back[i], direction)
            size = math.sqrt(max(1.5 * square + grown * grown, 0.0))  # |back + grown direction|, |direction| = 1
            if size * new * law.recovery[i] > law.modulus[i]:
                new = law.modulus[i] / (law.recovery[i] * size)
                moved = max(moved, abs(new - factor[i]))
        factor[i] = new
    return moved


@_part
def _double_dot(a, b):
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + 2.0 * (a[3] * b[3] + a[4] * b[4] + a[5] * b[5])


@njit(cache=True)
def update(law: CyclicLaw, strain_increment: np.ndarray, stress: np.ndarray, back: np.ndarray, p: float) -> float:
    """One backward Euler step of a point: stress (6,) and back stresses (k, 6) are changed in place.

    strain_increment : (6,), order VOIGT, tensor shears [1];  stress, back [Pa];  p : equivalent plastic strain
    Returns the plastic strain after the step. Exact at rest and for one back stress without recovery under
    proportional loading; else first order in the increment (tests/rail_fem/test_cyclic_law.py).
    """
    volume = (strain_increment[0] + strain_increment[1] + strain_increment[2]) / 3.0
    pressure = (stress[0] + stress[1] + stress[2]) / 3.0
    for j in range(6):
        diagonal = 1.0 if j < 3 else 0.0
        stress[j] += 2.0 * law.shear * (strain_increment[j] - diagonal * volume) - diagonal * pressure
    dp = plastic_return(law, stress, back, p, np.empty(6), np.empty(law.modulus.size))
    pressure += 3.0 * law.bulk * volume
    for j in range(3):
        stress[j] += pressure
    return p + dp
