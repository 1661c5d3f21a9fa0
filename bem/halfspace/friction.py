"""Coulomb friction on a half-space: tractions, stick and slip for a given pressure, by a monotone splitting.

The slip of body 1 over body 2 is s = w + C q with the rigid slip w and the elastic part C q of the tractions q:
  shift            C q = u(q)                              (displacement difference, symmetric)
  steady rolling   C q = (u(q; x) - u(q; x + d dx)) / dx   (per metre rolled along d x, d = +-1; from cell centre to
  cell centre)
Friction asks for |q| <= g = mu p in every cell, with q = -g s/|s| where it slides: a variational inequality. C is a
periodic convolution with positive real part on the padded grid, so C is monotone, the solution is unique and the
Douglas-Rachford splitting converges to it from anywhere: one step solves (lambda + C) by FFT, the other projects onto
the discs |q| <= g (zero outside the patch). No active sets, memory O(n).
A prescribed force is one more linear condition of the first step: the rigid slip that gives it comes out.
Source: Kalker (1990), chapter 4 (the problem, its steady form); Lions and Mercier, SIAM J. Numer. Anal. 16 (1979) 964
(the splitting). Error: first order in the cell (tests/bem/test_halfspace_rolling.py).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import fft

from bem.halfspace.influence import kernel_spectrum, padded_shape
from bem.material import Pair
from bem.patch import Grid
from kernel_cache import njit

_STEP_ROLLING = 1.4
_STEP_SHIFT = 0.9
_RELAXATION = 1.5


class TangentialOperator:
    """C of the module's head for one grid: products and the resolvent (lambda + C)^-1 by FFT. direction : of rolling
    along x, 0 for a shift"""

    def __init__(self, grid: Grid, pair: Pair, direction: int) -> None:
        self.grid, self.direction = grid, direction
        self.size = padded_shape(*grid.shape)
        scale = 1 / (np.pi * pair.shear)
        both = scale * kernel_spectrum("1/r", grid, self.size)
        along = (scale * pair.poisson) * kernel_spectrum("xx/r3", grid, self.size)
        self.xx = (1 - pair.poisson) * both + along
        self.yy = both - along
        self.xy = (scale * pair.poisson) * kernel_spectrum("xy/r3", grid, self.size)
        self.step = rolled_step(self.size[0], grid.dx, direction)

    @property
    def magnitude(self) -> float:
        """Largest entry of the spectrum of C."""
        return float((np.abs(self.step[:, 0]) * np.maximum(self.xx, self.yy).max(axis=1)).max())

    def spread(self, traction: np.ndarray) -> np.ndarray:
        """(2, size x, size y) C q over the whole period, for tractions (2, nx, ny) [Pa]."""
        spectrum = fft.rfft2(traction, s=self.size, axes=(1, 2))
        first = self.step * (self.xx * spectrum[0] + self.xy * spectrum[1])
        spectrum[1] = self.step * (self.xy * spectrum[0] + self.yy * spectrum[1])
        spectrum[0] = first
        return fft.irfft2(spectrum, s=self.size, axes=(1, 2), overwrite_x=True)

    def product(self, traction: np.ndarray) -> np.ndarray:
        """(2, nx, ny) C q for tractions (2, nx, ny) [Pa]: displacement [m], or slip per metre rolled [1]."""
        return self.spread(traction)[:, : self.grid.nx, : self.grid.ny]

    def inverse(self, shift: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """xx, xy, yy entries of the spectrum of (shift + C)^-1."""
        first, second, mixed = shift + self.step * self.xx, shift + self.step * self.yy, self.step * self.xy
        determinant = first * second - mixed**2
        return second / determinant, -mixed / determinant, first / determinant


def rolled_step(size: int, dx: float, direction: int) -> np.ndarray:
    """(size, 1) spectrum by which displacement becomes slip per metre rolled, or stays itself in a shift (0)."""
    if direction == 0:
        return np.ones((size, 1))
    wave = 2 * np.pi * fft.fftfreq(size)
    return ((1 - np.exp(1j * direction * wave)) / dx)[:, None]


@dataclass
class FrictionSolution:
    """traction (2, nx, ny) [Pa]; slip (2, nx, ny) in the cells of the patch; stick (nx, ny) bool; rigid (2,) uniform
    rigid slip found for a prescribed force (0 where none was prescribed); residual relative to the tractions."""

    traction: np.ndarray
    slip: np.ndarray
    stick: np.ndarray
    rigid: np.ndarray
    iterations: int
    residual: float


def solve_friction(
    operator: TangentialOperator,
    rigid_slip: np.ndarray,
    bound: np.ndarray,
    force: tuple[float | None, float | None] = (None, None),
    start: np.ndarray | None = None,
    tolerance: float = 1e-5,
    max_iterations: int = 5000,
) -> FrictionSolution:
    """Tractions that satisfy Coulomb's law in every cell.

    rigid_slip : (2, nx, ny) w, everything but C q [m in a shift, 1 in rolling]
    bound      : (nx, ny) g = mu p >= 0 [Pa]
    force      : prescribed sums of the tractions [Pa, sum over cells], None where the rigid slip is given instead
    start      : (2, nx, ny) tractions to start from
    tolerance  : of the difference between both steps' tractions, relative to the tractions
    """
    if not (bound > 0).any():
        zero = np.zeros_like(rigid_slip)
        return FrictionSolution(zero, rigid_slip * (bound > 0), np.zeros(bound.shape, bool), np.zeros(2), 0, 0.0)
    shift = operator.magnitude * _step_factor(operator.grid, operator.direction != 0)
    state = _start(operator, rigid_slip, start, shift)
    inverse = operator.inverse(shift)
    uniform = _UniformSlip(operator, bound, force, inverse)
    traction = np.zeros_like(rigid_slip)
    stick = np.zeros(bound.shape, bool)
    work = np.empty((2, *operator.size))
    iterations, residual = 0, np.inf
    while iterations < max_iterations and not residual <= tolerance:
        iterations += 1
        np.multiply(state, shift, out=work)
        work[:, : bound.shape[0], : bound.shape[1]] -= rigid_slip
        spectrum = fft.rfft2(work, axes=(1, 2))
        _apply(spectrum, *inverse)
        elastic = fft.irfft2(spectrum, s=operator.size, axes=(1, 2), overwrite_x=True)
        uniform.enforce(elastic)
        difference, size = _update(state, elastic, bound, _RELAXATION, traction, stick)
        residual = np.sqrt(difference / size) if size > 0 else float(difference > 0)
    slip = (operator.product(traction) + rigid_slip + uniform.slip[:, None, None]) * (bound > 0)
    return FrictionSolution(traction, slip, stick, uniform.slip, iterations, float(residual))


def _step_factor(grid: Grid, rolling: bool) -> float:
    """lambda over the largest entry of the spectrum: measured least number of iterations, over creepages from pure
    stick to pure sliding, 22 to 352 cells, cells from 1:10 to 50:1."""
    aspect = grid.dx / grid.dy
    if rolling:
        return _STEP_ROLLING / grid.nx**0.25 * (2 / (1 + aspect)) ** 0.5
    return _STEP_SHIFT / grid.nx**0.5 / max(aspect, 1 / aspect) ** 0.3


class _UniformSlip:
    """Uniform rigid slip that gives the prescribed sums of tractions over the patch."""

    def __init__(self, operator: TangentialOperator, bound: np.ndarray, force, inverse) -> None:
        self.slip = np.zeros(2)
        self.axes = [axis for axis in (0, 1) if force[axis] is not None]
        self.goal = np.array([force[axis] for axis in self.axes])
        self.inside = (bound > 0).astype(float)
        self.responses = []
        for axis in self.axes:
            spectrum = np.zeros((2, operator.size[0], operator.size[1] // 2 + 1), complex)
            spectrum[axis] = fft.rfft2(self.inside, s=operator.size)
            _apply(spectrum, *inverse)
            self.responses.append(fft.irfft2(spectrum, s=operator.size, axes=(1, 2)))
        self.matrix = np.array([self._sums(response) for response in self.responses]).T

    def _sums(self, field: np.ndarray) -> np.ndarray:
        nx, ny = self.inside.shape
        return np.array([(field[axis, :nx, :ny] * self.inside).sum() for axis in self.axes])

    def enforce(self, elastic: np.ndarray) -> None:
        """Changes `elastic` so that its sums are the prescribed ones; keeps the rigid slip that does it."""
        if not self.axes:
            return
        slip = np.linalg.solve(self.matrix, self._sums(elastic) - self.goal)
        for value, response in zip(slip, self.responses):
            elastic -= value * response
        self.slip[self.axes] = slip


def _start(
    operator: TangentialOperator, rigid_slip: np.ndarray, traction: np.ndarray | None, shift: float
) -> np.ndarray:
    """State whose fixed point belongs to the given tractions: q + (C q + w) / lambda."""
    nx, ny = operator.grid.shape
    if traction is None:
        return np.zeros((2, *operator.size))
    state = operator.spread(traction)
    state[:, :nx, :ny] += rigid_slip
    state /= shift
    state[:, :nx, :ny] += traction
    return state


@njit(cache=True)
def _apply(spectrum, xx, xy, yy):
    """spectrum <- symmetric 2x2 matrix times spectrum, in place."""
    for i in range(spectrum.shape[1]):
        for j in range(spectrum.shape[2]):
            first, second = spectrum[0, i, j], spectrum[1, i, j]
            spectrum[0, i, j] = xx[i, j] * first + xy[i, j] * second
            spectrum[1, i, j] = xy[i, j] * first + yy[i, j] * second


@njit(cache=True)
def _update(state, elastic, bound, relaxation, traction, stick):
    """Projection of the reflected elastic step onto the friction discs, and the step of the state (in place).

    Returns the squared norms of the difference between both steps' tractions and of the tractions.
    """
    nx, ny = bound.shape
    difference, size = 0.0, 0.0
    for i in range(state.shape[1]):
        for j in range(state.shape[2]):
            u, v = 0.0, 0.0
            if i < nx and j < ny and bound[i, j] > 0.0:
                u = 2.0 * elastic[0, i, j] - state[0, i, j]
                v = 2.0 * elastic[1, i, j] - state[1, i, j]
                length = np.sqrt(u * u + v * v)
                stick[i, j] = length < bound[i, j]
                if length > bound[i, j]:
                    u *= bound[i, j] / length
                    v *= bound[i, j] / length
                traction[0, i, j] = u
                traction[1, i, j] = v
                size += u * u + v * v
            du, dv = u - elastic[0, i, j], v - elastic[1, i, j]
            difference += du * du + dv * dv
            state[0, i, j] += relaxation * du
            state[1, i, j] += relaxation * dv
    return difference, size
