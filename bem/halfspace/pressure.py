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
            self.residual = np.where(inside, known - self.displacement - self.gap, 0.0)
            steepest = operator.precondition(self.residual) * inside
            if free:  # the multiplier of the load
                self.approach = -steepest.sum() / response_sum
                self.residual += self.approach * inside
                steepest += self.approach * response
            error = np.sqrt(np.vdot(self.residual, self.residual) / np.count_nonzero(inside)) / abs(self.approach)
            first = error if first is None else first
            if error <= tolerance or error < _INNER_DROP * first or count == _INNER_STEPS:
                return error
            keep = max(0.0, -step * np.vdot(product, steepest) / previous) if count else 0.0
            direction = steepest + keep * direction
            product = operator.displacement(direction)
            curvature = np.vdot(direction, product)
            step = np.vdot(direction, self.residual) / curvature if curvature > 0 else 0.0
            self.pressure += step * direction
            self.displacement += step * product
            previous = np.vdot(self.residual, steepest)
            self.iterations += 1
        return error

    def correct(self, tolerance: float) -> int:
        """Cells of negative pressure leave the set, overlapping cells join; returns how many did."""
        negative = self.inside & (self.pressure < 0.0)
        negative.flat[self.pressure.argmax()] = False  # the largest always stays, so that the set never empties
        overlap = self.displacement + self.gap - self.approach < -tolerance * abs(self.approach)
        joined = overlap & ~self.inside
        self.inside ^= negative | joined
        if negative.any():
            self.pressure[negative] = 0.0
            if self.total is not None:
                self.pressure *= self.total / self.pressure.sum()
            self.displacement = self.operator.displacement(self.pressure)
        return np.count_nonzero(negative | joined)


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
