"""Pressure between two half-spaces for a given gap: bound-constrained conjugate gradients with FFT products.

Find p >= 0 with e = gap + u(p) - approach >= 0 and e p = 0 in every cell, for a given load or a given approach.
On a fixed contact set the equations are solved by conjugate gradients, preconditioned with the inverse of the
periodic influence matrix (unpadded FFT); the set is then corrected (negative pressure out, overlap in) until it stays.
A load is one linear condition: the search directions carry none, and the approach is its multiplier.
Source: Polonsky and Keer, Wear 231 (1999) 206; Vollebregt, J. Comput. Phys. 257 (2014) 333 (deflation, FFT-based
preconditioner). Error: max pressure and approach of second order in the cell, pressure in the mean square of first
order because the edge falls between cells (tests/bem/test_halfspace_normal.py).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import fft

from bem.halfspace.influence import backward, forward, kernel_spectrum, padded_shape
from bem.material import Pair
from bem.patch import ContactInputError, Grid, NoContactError
from kernel_cache import njit

_INNER_STEPS = 6  # conjugate-gradient steps before the contact set is looked at again
_INNER_DROP = 0.2  # or sooner, once the residual fell to this part
_PENETRATION_SHARE = 0.5  # edge of the first guess: gap = half the approach (Hertz circle: exactly half)


class NormalOperator:
    """Displacement under pressure on one grid, and the inverse of its periodic neighbour."""

    def __init__(self, grid: Grid, pair: Pair) -> None:
        self.grid, self.size, self.products = grid, padded_shape(*grid.shape), 0
        scale = 1 / (np.pi * pair.modulus)
        self.spectrum = scale * kernel_spectrum("1/r", grid, self.size)
        self.inverse = 1 / (scale * kernel_spectrum("1/r", grid, grid.shape))

    def displacement(self, pressure: np.ndarray) -> np.ndarray:
        """(nx, ny) normal displacement difference [m] under pressure (nx, ny) [Pa]."""
        self.products += 1
        spectrum = forward(pressure, self.size)
        spectrum *= self.spectrum
        return backward(spectrum, self.grid.shape, self.size)

    def precondition(self, residual: np.ndarray) -> np.ndarray:
        """(nx, ny) pressure whose periodic displacement is the residual."""
        spectrum = fft.rfft2(residual)
        spectrum *= self.inverse
        return fft.irfft2(spectrum, s=self.grid.shape, overwrite_x=True)


@dataclass
class PressureSolution:
    """pressure (nx, ny) [Pa], approach [m], iterations, residual (rms of e in the contact, per approach)."""

    pressure: np.ndarray
    approach: float
    iterations: int
    residual: float
    converged: bool

    @property
    def notes(self) -> tuple[str, ...]:
        """A warning where it has not converged."""
        words = f"residual {self.residual:.1e} of the approach after {self.iterations} iterations"
        return () if self.converged else (f"pressure not converged: {words}",)


def solve_pressure(
    operator: NormalOperator,
    gap: np.ndarray,
    load: float | None = None,
    approach: float | None = None,
    start: np.ndarray | None = None,
    tolerance: float = 1e-6,
    max_rounds: int = 200,
) -> PressureSolution:
    """Pressure for a load [N] > 0 or an approach [m] above the least gap.

    gap : (nx, ny) [m], open positive, any constant in it shifts the approach; np.inf where a body has no surface
    """
    area = operator.grid.cell_area
    total = None if load is None else load / area
    lowest = float(gap.min())
    if total is None:
        if approach is None:
            raise ContactInputError("neither load nor approach: give one of them")
        if approach <= lowest:
            raise NoContactError(
                f"approach {approach:g} m does not close the least gap {lowest:g} m: no contact; "
                f"raise the approach above it"
            )
    gap = gap - lowest  # a small approach on a large gap would drown in its digits
    approach = None if approach is None else approach - lowest
    pressure = None if start is None else np.where(np.isfinite(gap), start, 0.0)
    if pressure is None or not pressure.any():
        pressure = first_guess(operator, gap, total, approach)
    if total is not None:
        pressure *= total / pressure.sum()
    state = _State(operator, gap, pressure, total, approach)
    for _ in range(max_rounds):
        residual = state.relax(tolerance)
        if not state.correct(tolerance) and residual <= tolerance:
            return PressureSolution(state.pressure, state.approach + lowest, state.iterations, residual, True)
    return PressureSolution(state.pressure, state.approach + lowest, state.iterations, residual, False)


class _State:
    """Pressure, displacement and contact set of an iteration; the least gap is 0."""

    def __init__(self, operator, gap, pressure, total, approach) -> None:
        self.operator, self.gap, self.total = operator, gap, total
        self.pressure, self.approach = pressure, approach
        self.inside = pressure > 0
        self.displacement = operator.displacement(pressure)
        self.residual = np.zeros_like(gap)
        self.iterations = 0

    def relax(self, tolerance: float) -> float:
        """Conjugate gradients on the present contact set; returns the residual."""
        operator, inside = self.operator, self.inside
        free = self.total is not None
        response = operator.precondition(inside.astype(float)) * inside if free else np.zeros_like(self.gap)
        response_sum = response.sum()
        direction, product = np.zeros_like(self.gap), np.zeros_like(self.gap)
        previous, step, first = 1.0, 0.0, None
        for count in range(_INNER_STEPS + 1):
            known = 0.0 if free else self.approach
            _fill_residual(self.displacement, self.gap, inside, known, self.residual)
            steepest = operator.precondition(self.residual)
            shift = -_masked_sum(steepest, inside) / response_sum if free else 0.0
            square, weighted, overlap = _finish_residual(self.residual, steepest, inside, response, shift, product)
            if free:
                self.approach = shift
            error = np.sqrt(square / np.count_nonzero(inside)) / abs(self.approach)
            first = error if first is None else first
            if error <= tolerance or error < _INNER_DROP * first or count == _INNER_STEPS:
                return error
            keep = max(0.0, -step * overlap / previous) if count else 0.0
            _turn(direction, steepest, keep)
            product = operator.displacement(direction)
            step = _curvature_step(direction, self.residual, product)
            _advance(self.pressure, self.displacement, direction, product, step)
            previous = weighted
            self.iterations += 1
        return error

    def correct(self, tolerance: float) -> int:
        """Cells of negative pressure leave the set, overlapping cells join; returns how many did."""
        slack = tolerance * abs(self.approach)
        out, joined = _correct(self.pressure, self.displacement, self.gap, self.inside, self.approach, slack)
        if out:
            if self.total is not None:
                self.pressure *= self.total / self.pressure.sum()
            self.displacement = self.operator.displacement(self.pressure)
        return out + joined


def first_guess(operator: NormalOperator, gap: np.ndarray, total: float | None, approach: float | None) -> np.ndarray:
    """Pressure ~ sqrt(cut - gap), the cut at half the approach, which a few products find where the load is given."""
    depth = gap - gap.min()
    if total is None:
        cut = _PENETRATION_SHARE * (approach - gap.min())
        shape = _shape(depth, cut)
        inside = shape > 0
        return shape * ((approach - gap[inside]).mean() / operator.displacement(shape)[inside].mean())
    finite = depth[np.isfinite(depth)]
    rank = min(finite.size - 1, max(8, depth.size // 3))
    cut = float(np.partition(finite, rank)[rank])
    for _ in range(6):
        shape = _shape(depth, cut)
        shape *= total / shape.sum()
        inside = shape > 0
        wanted = _PENETRATION_SHARE * float((operator.displacement(shape) + depth)[inside].mean())
        if abs(wanted - cut) < 0.05 * wanted:
            break
        cut = wanted
    return shape


def _shape(depth: np.ndarray, cut: float) -> np.ndarray:
    shape = np.sqrt(np.maximum(cut - depth, 0.0))
    return shape if shape.any() else (depth <= cut).astype(float)


@njit(cache=True)
def _fill_residual(displacement, gap, inside, approach, out):
    for i in range(gap.shape[0]):
        for j in range(gap.shape[1]):
            out[i, j] = approach - displacement[i, j] - gap[i, j] if inside[i, j] else 0.0


@njit(cache=True)
def _masked_sum(field, inside):
    total = 0.0
    for i in range(field.shape[0]):
        for j in range(field.shape[1]):
            if inside[i, j]:
                total += field[i, j]
    return total


@njit(cache=True)
def _finish_residual(residual, steepest, inside, response, shift, product):
    """Adds the multiplier of the load to the residual and to its preconditioned form; returns the inner products."""
    square, weighted, overlap = 0.0, 0.0, 0.0
    for i in range(residual.shape[0]):
        for j in range(residual.shape[1]):
            if inside[i, j]:
                residual[i, j] += shift
                steepest[i, j] += shift * response[i, j]
                square += residual[i, j] ** 2
                weighted += residual[i, j] * steepest[i, j]
                overlap += product[i, j] * steepest[i, j]
            else:
                steepest[i, j] = 0.0
    return square, weighted, overlap


@njit(cache=True)
def _turn(direction, steepest, keep):
    for i in range(direction.shape[0]):
        for j in range(direction.shape[1]):
            direction[i, j] = steepest[i, j] + keep * direction[i, j]


@njit(cache=True)
def _curvature_step(direction, residual, product):
    top, bottom = 0.0, 0.0
    for i in range(direction.shape[0]):
        for j in range(direction.shape[1]):
            top += direction[i, j] * residual[i, j]
            bottom += direction[i, j] * product[i, j]
    return top / bottom if bottom > 0.0 else 0.0


@njit(cache=True)
def _advance(pressure, displacement, direction, product, step):
    for i in range(pressure.shape[0]):
        for j in range(pressure.shape[1]):
            pressure[i, j] += step * direction[i, j]
            displacement[i, j] += step * product[i, j]


@njit(cache=True)
def _correct(pressure, displacement, gap, inside, approach, slack):
    """The largest pressure always stays, so that the set never empties."""
    keep = np.argmax(pressure)
    out, joined = 0, 0
    for i in range(gap.shape[0]):
        for j in range(gap.shape[1]):
            if inside[i, j]:
                if pressure[i, j] < 0.0 and i * gap.shape[1] + j != keep:
                    pressure[i, j] = 0.0
                    inside[i, j] = False
                    out += 1
            elif displacement[i, j] + gap[i, j] - approach < -slack:
                inside[i, j] = True
                joined += 1
    return out, joined
