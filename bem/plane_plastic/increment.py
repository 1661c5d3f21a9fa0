"""One load increment of a plane section: plastic strain, return map and elastic answer agree, by Newton's method.

Unknown is the increment d of plastic stress 2 G e^p in the cells that take part. The trial deviator is
    s(d) = load(P + d) + A (P + d) - P,        R(d) = d - 2 G return(s(d)),
with P the plastic stress so far, A the body's influence, and `load` what external forces do; it depends on the plastic
stress where contact does. Newton's step solves (I - M (A + load')) step = -R with M the consistent tangent of the
return map (bem.steel.return_map). Where nothing flows M is zero and the step is known, so only flowing cells are
unknowns.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.linalg import LinAlgError
from scipy.sparse.linalg import LinearOperator, gmres

from bem.plane_plastic.section import PlasticSection, flat, unflat
from bem.plastic.increment import NoEquilibriumError, damped_newton
from bem.steel.return_map import Returned, radial_return

MOST_NEWTON = 30
COLLAPSED = 0.05  # plastic strain at which a load counts as not carried
_DIRECT = 900  # unknowns up to which the linear system is factorised

Tangent = tuple[np.ndarray, np.ndarray]  # (3 a, r) and (r, 3 a), whose product is the load's derivative
Load = Callable[[np.ndarray, bool], tuple[np.ndarray, Tangent | None]]


@dataclass
class Increment:
    """returned : plastic strain of the increment and its tangent; plastic : (3 a,) 2 G e^p at its end [Pa], as
    deviators; residuals : largest mismatch of stress over yield stress, per step."""

    returned: Returned
    plastic: np.ndarray
    residuals: list[float]


def solve_increment(
    section: PlasticSection, load: Load, start: np.ndarray | None = None, tolerance: float = 1e-8
) -> Increment:
    """load : plastic stress (3 a,), whether its tangent is wanted -> 2 G strain as deviators (3 a,) by the load, and
    its derivative as a Tangent, or None; start : first guess of the increment (3 a,)

    tolerance : largest mismatch of stress over the first yield stress
    Errors: NoEquilibriumError.
    """
    shear, before, state = section.elastic.shear, section.plastic_stress(), section.part()
    scale = np.sqrt(1.5) / section.hardening.first_yield

    def mismatch(d: np.ndarray) -> tuple[Returned, np.ndarray, float]:
        strain = load(before + d, False)[0] + section.matrix @ (before + d)
        returned = radial_return(unflat(strain - before), state, section.hardening, shear)
        residual = d - 2 * shear * flat(returned.increment)
        worst = float(np.sqrt((residual.reshape(3, -1) ** 2).sum(axis=0).max(initial=0.0)))
        return returned, residual, scale * worst

    def change(at, found) -> tuple[np.ndarray]:
        return (_newton_step(section.matrix, load(before + at[0], True)[1], *found),)

    begin = np.zeros(len(before)) if start is None else start.copy()
    (d,), (returned, residual, _), residuals = damped_newton(mismatch, change, (begin,), tolerance, MOST_NEWTON)
    _refuse_collapse(section, returned)
    return Increment(returned, before + d - residual, residuals)


def _refuse_collapse(section: PlasticSection, returned: Returned) -> None:
    """Cells are stiffer than the steel, so that a collapsing body goes on carrying a little more at ever larger
    strain."""
    worst = float((section.state.peeq[section.active] + returned.growth).max(initial=0.0))
    if worst > COLLAPSED:
        raise NoEquilibriumError(
            f"plastic strain of {worst:.1%}, beyond {COLLAPSED:.0%}: the body collapses, or strain is no longer small"
        )


def _newton_step(matrix, tangent, returned: Returned, residual: np.ndarray, error: float) -> np.ndarray:
    """Solves (I - M (A + load')) step = -residual."""
    cells = len(residual) // 3
    flowing = np.flatnonzero(returned.along[:, 0, 0] > 0)
    if not len(flowing):
        return -residual
    index = (np.arange(3)[:, None] * cells + flowing).ravel()
    direction = returned.direction[flowing, :, 0, 0]
    along, across = returned.along[flowing, 0, 0], returned.across[flowing, 0, 0]

    def by_tangent(field: np.ndarray) -> np.ndarray:  # M times a field (3 y, ...)
        parts = field.reshape(3, len(flowing), -1)
        normal = np.einsum("kc,ckj->kj", direction, parts) * (along - across)[:, None]
        return (across[:, None] * parts + direction.T[:, :, None] * normal).reshape(field.shape)

    step = -residual
    step[index] = 0.0
    answer, square = matrix[index] @ step, matrix[np.ix_(index, index)]
    if tangent is not None:
        answer += tangent[0][index] @ (tangent[1] @ step)
        square += tangent[0][index] @ tangent[1][:, index]
    step[index] = _solved(by_tangent, square, -residual[index] + by_tangent(answer), error)
    return step


def _solved(by_tangent, square: np.ndarray, right: np.ndarray, error: float) -> np.ndarray:
    """Solution x of x - M square x = right."""
    size = len(right)
    if size > _DIRECT:
        operator = LinearOperator((size, size), matvec=lambda x: x - by_tangent(square @ x))
        answer, left = gmres(operator, right, restart=60, maxiter=4, **_tolerance(min(1e-2, 0.1 * error)))
        if left == 0:
            return answer
    try:
        return np.linalg.solve(np.eye(size) - by_tangent(square), right)
    except LinAlgError:
        return right


def _tolerance(value: float) -> dict[str, float]:
    """SciPy calls gmres' relative tolerance tol before 1.12, rtol after."""
    import scipy

    major, minor = (int(part) for part in scipy.__version__.split(".")[:2])
    return {"rtol" if (major, minor) >= (1, 12) else "tol": max(value, 1e-12), "atol": 0.0}
