"""One load increment: plastic strain, return map and elastic interaction brought to agree by Newton's method.

Unknown is the increment d of plastic strain. The trial deviator in every cell is
    s(d) = load + K (strain + d) + 2 G d,       d = radial_return(s(d))
with K the influence of plastic strain. With M the consistent tangent of the return map and E = I + K / 2 G the change
of total strain, a Newton step solves (I - M E) step = -(d - return(s(d))); in w, step = M^1/2 w - residual, that is
symmetric and positive definite and goes by conjugate gradients. E is a contraction, so that a step costs few products
even without hardening. Only yielding cells take part.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bem.plastic.influence import StressInfluence
from bem.steel.hardening import YieldLaw
from bem.steel.return_map import PlasticState, Returned, radial_return

_MOST_NEWTON = 40
_MOST_GRADIENTS = 60
_HALVINGS = 6


class NoEquilibriumError(RuntimeError):
    """A load that the yielding body cannot carry; the message says which load was reached."""


@dataclass
class Increment:
    """returned : plastic strain of the increment and tangent; deviator : (nz, 5, nx, ny) stress [Pa]; interaction : its
    part K d by the increment; residuals : largest mismatch of stress over yield stress, per Newton step; products with
    K."""

    returned: Returned
    deviator: np.ndarray
    interaction: np.ndarray
    residuals: list[float]
    products: int


def solve_increment(
    influence: StressInfluence,
    held: np.ndarray,
    state: PlasticState,
    hardening: YieldLaw,
    start: np.ndarray | None = None,
    tolerance: float = 1e-6,
) -> Increment:
    """held : (nz, 5, nx, ny) deviator by the load and by the plastic strain so far [Pa]; start : first guess of d.

    tolerance : largest mismatch of stress over the first yield stress
    Errors: NoEquilibriumError.
    """
    shear, before = influence.elastic.shear, influence.products
    scale = np.sqrt(1.5) * 2 * shear / hardening.first_yield
    d = np.zeros_like(held) if start is None else start
    interaction = influence.deviator(d) if d.any() else np.zeros_like(held)

    def mismatch(d: np.ndarray, interaction: np.ndarray) -> tuple[Returned, np.ndarray, float]:
        returned = radial_return(held + interaction + 2 * shear * d, state, hardening, shear)
        residual = d - returned.increment
        return returned, residual, scale * float(np.sqrt(np.einsum("kc...,kc...->k...", residual, residual).max()))

    returned, residual, error = mismatch(d, interaction)
    residuals = [error]
    for _ in range(_MOST_NEWTON):
        if error <= tolerance:
            deviator = held + interaction
            return Increment(returned, deviator, interaction, residuals, influence.products - before)
        step = _newton_step(influence, returned, residual, shear, error)
        change = influence.deviator(step)
        share = 1.0
        for _ in range(_HALVINGS):
            new = mismatch(d + share * step, interaction + share * change)
            if new[2] < error:
                break
            share /= 2
        d, interaction = d + share * step, interaction + share * change
        returned, residual, error = new
        residuals.append(error)
        if not np.isfinite(error):
            break
    raise NoEquilibriumError(
        f"plastic strain not in equilibrium after {len(residuals) - 1} Newton steps: stress still off by {error:.2g} of"
        " the yield stress; take smaller load steps"
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
