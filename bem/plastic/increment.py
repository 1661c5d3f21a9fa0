"""One load increment: plastic strain, return map and elastic interaction brought to agree by Newton's method.

Unknown is the increment d of plastic strain. The trial deviator in every cell is
    s(d) = load + K (strain + d) + 2 G d,       d = radial_return(s(d))
with K the influence of plastic strain. With M the consistent tangent of the return map and E = I + K / 2 G the change
of total strain, a Newton step solves (I - M E) step = -(d - return(s(d))); in w, step = M^1/2 w - residual, that is
symmetric and positive definite and goes by conjugate gradients. E is a contraction, so that a step costs few products
even without hardening. Only yielding cells take part.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from bem.plastic.influence import StressInfluence
from bem.steel.hardening import YieldLaw
from bem.steel.return_map import PlasticState, Returned, radial_return

_MOST_NEWTON = 40
_MOST_GRADIENTS = 60
_HALVINGS = 6


class NoEquilibriumError(RuntimeError):
    """A load that the yielding body cannot carry; the message says which load was reached."""


def solve_increment(
    influence: StressInfluence,
    held: np.ndarray,
    state: PlasticState,
    hardening: YieldLaw,
    start: np.ndarray | None = None,
    tolerance: float = 1e-6,
) -> tuple[Returned, np.ndarray]:
    """Plastic strain d of the increment with its tangent, and the stress (nz, 5, nx, ny) K d that it makes [Pa].

    held : (nz, 5, nx, ny) deviator by the load and by the plastic strain so far [Pa];  start : first guess of d
    tolerance : largest mismatch of stress over the first yield stress
    Errors: NoEquilibriumError.
    """
    shear = influence.elastic.shear
    scale = np.sqrt(1.5) * 2 * shear / hardening.first_yield
    d = np.zeros_like(held) if start is None else start

    def mismatch(d: np.ndarray, interaction: np.ndarray) -> tuple[Returned, np.ndarray, float]:
        returned = radial_return(held + interaction + 2 * shear * d, state, hardening, shear)
        residual = d - returned.increment
        return returned, residual, scale * float(np.sqrt(np.einsum("kc...,kc...->k...", residual, residual).max()))

    def change(_, found) -> tuple[np.ndarray, np.ndarray]:
        step = _newton_step(influence, found[0], found[1], shear, found[2])
        return step, influence.deviator(step)

    begin = d, influence.deviator(d) if d.any() else np.zeros_like(held)
    (_, interaction), (returned, *_), _ = damped_newton(mismatch, change, begin, tolerance, _MOST_NEWTON)
    return returned, interaction


def damped_newton(
    mismatch: Callable, change: Callable, start: tuple[np.ndarray, ...], tolerance: float, most: int
) -> tuple[tuple[np.ndarray, ...], tuple, list[float]]:
    """Unknowns, what `mismatch` says of them, and the errors of all steps, once the last is within the tolerance.

    mismatch : unknowns -> anything, its last the error;  change : unknowns, what mismatch said -> a full step, halved
    until the error falls
    Errors: NoEquilibriumError after `most` steps, or where the error is no number.
    """
    at, found = start, mismatch(*start)
    errors = [found[-1]]
    for _ in range(most):
        if errors[-1] <= tolerance:
            return at, found, errors
        if not np.isfinite(errors[-1]):
            break
        step = change(at, found)
        for halvings in range(_HALVINGS):
            trial = tuple(one + 0.5**halvings * more for one, more in zip(at, step, strict=True))
            new = mismatch(*trial)
            if new[-1] < found[-1]:
                break
        at, found = trial, new
        errors.append(found[-1])
    raise NoEquilibriumError(
        f"plastic strain not in equilibrium after {len(errors) - 1} Newton steps: stress still off by {errors[-1]:.2g}"
        " of the yield stress; take smaller load steps"
    )


def _newton_step(influence, returned: Returned, residual: np.ndarray, shear: float, error: float) -> np.ndarray:
    """Solves (I - M^1/2 E M^1/2) w = -M^1/2 E residual by conjugate gradients; the step is M^1/2 w - residual."""

    def spread(field: np.ndarray) -> np.ndarray:
        return field + influence.rough_deviator(field) / (2 * shear)

    right = -returned.root(spread(residual))
    w = np.zeros_like(right)
    remainder, direction = right.copy(), right.copy()
    square = first = float(np.vdot(remainder, remainder))
    accuracy = min(0.1, max(error, 1e-3)) ** 2
    for _ in range(_MOST_GRADIENTS):
        if square <= accuracy * first or square == 0.0:
            break
        product = direction - returned.root(spread(returned.root(direction)))
        curvature = float(np.vdot(direction, product))
        if curvature <= 0:  # round-off on a mechanism: what was found so far is the step
            break
        length = square / curvature
        w += length * direction
        remainder -= length * product
        new = float(np.vdot(remainder, remainder))
        direction = remainder + new / square * direction
        square = new
    return returned.root(w) - residual
