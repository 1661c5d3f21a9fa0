"""Influence of plastic strain in layers of equal cuboids on stress and surface: exact kernels, products by FFT.

Along the surface offsets repeat: a convolution (padded FFT, no periodicity). In depth every pair of layers has its own
kernel. Mirror symmetry makes each kernel's spectrum real up to a factor i per odd direction, and a quadrant of the
wave numbers enough; what is multiplied per wave number is one real matrix over all layers and components.
Stress is the mean over a cell (exact in depth, Gauss points along the surface), so that the elastic energy of any
plastic strain is positive, as it must be: stress at the cells' centres would gain energy from strains that alternate
from cell to cell, and a steel that hardens little would take to them. Displacement is at the centres of the surface's
cells.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import fft

from bem.material import Elastic
from bem.patch import ContactInputError
from bem.plastic.corners import COUNT, MONOMIALS, corner_planes
from bem.plastic.symbols import PAIRS, coefficient_tables, depth_parity, facing_layers
from bem.steel.deviator import FROM_DEVIATOR, MEAN, ODD_X, ODD_Y, TO_DEVIATOR
from kernel_cache import njit

MOST_MEMORY = 4e9  # of a kernel [B]
_GAUSS = 3  # points each way of a cell's mean stress


@dataclass(frozen=True)
class Cells:
    """Cuboids of sides dx, dy, dz [m], nx by ny along the surface, nz layers from the surface down."""

    dx: float
    dy: float
    dz: float
    nx: int
    ny: int
    nz: int

    @property
    def shape(self) -> tuple[int, int, int, int]:
        """Of a field of deviators: (nz, 5, nx, ny)."""
        return self.nz, 5, self.nx, self.ny

    @property
    def depths(self) -> np.ndarray:
        """(nz,) depths of the centres [m]."""
        return (np.arange(self.nz) + 0.5) * self.dz

    @property
    def period(self) -> tuple[int, int]:
        """Even FFT lengths that hold all offsets."""
        return tuple(2 * fft.next_fast_len(max(count, 2), real=True) for count in (self.nx, self.ny))

    @property
    def kernel_memory(self) -> int:
        """Bytes of the stress kernel."""
        px, py = self.period
        return 8 * (px // 2 + 1) * (py // 2 + 1) * (5 * self.nz) ** 2

    @property
    def window_memory(self) -> int:
        """Bytes of what a window of these cells holds before any of them yields: stress by pressure and displacement by
        strain, at all offsets and as complex spectra, and its state."""
        px, py = self.period
        return self.nz * (11 * px * (8 * py + 16 * (py // 2 + 1)) + 8 * 17 * self.nx * self.ny)

    def refuse_too_large(self, need: int | None = None) -> None:
        """Raise ContactInputError, with the numbers, for a `need` [B], by default the kernel's, beyond MOST_MEMORY,
        before anything is allocated."""
        need = self.kernel_memory if need is None else need
        if need > MOST_MEMORY:
            raise ContactInputError(
                f"{self.nx} x {self.ny} x {self.nz} cells need {need / 1e9:.3g} GB for their influence, "
                f"more than {MOST_MEMORY / 1e9:g} GB: take larger cells, fewer layers, or a shorter window"
            )


def _spectra(cells: Cells, levels: np.ndarray) -> np.ndarray:
    """(levels, 36, kx, ky) real spectra of the corner functions' differences over a cell, quadrant of wave numbers."""
    reach = cells.period[0] // 2, cells.period[1] // 2
    spectra = np.empty((len(levels), COUNT, reach[0] + 1, reach[1] + 1))
    points, weights = np.polynomial.legendre.leggauss(_GAUSS)
    for k, level in enumerate(levels):
        plane = 0.0
        for p, one in zip(points / 2, weights / 2):
            for q, two in zip(points / 2, weights / 2):
                x, y = ((np.arange(r + 2) - 0.5 + off) * h for r, off, h in zip(reach, (p, q), (cells.dx, cells.dy)))
                plane = plane + one * two * corner_planes(x, y, np.array([level]))[0]
        plane = np.diff(np.diff(plane, axis=1), axis=2)
        for f, (a, b, _) in enumerate(MONOMIALS):
            spectra[k, f] = _quadrant(plane[f], a % 2 == 0, b % 2 == 0)
    return spectra


def _quadrant(quarter: np.ndarray, odd_x: bool, odd_y: bool) -> np.ndarray:
    """S of spectrum = i^(odd_x + odd_y) S, from a quarter (n + 1, m + 1) of an even or odd plane, period (2 n, 2 m)."""
    for axis, odd in ((0, odd_x), (1, odd_y)):
        if odd:
            inner = quarter[1:-1] if axis == 0 else quarter[:, 1:-1]
            padding = [(1, 1), (0, 0)] if axis == 0 else [(0, 0), (1, 1)]
            quarter = -np.pad(fft.dst(inner, type=1, axis=axis), padding)
        else:
            quarter = fft.dct(quarter, type=1, axis=axis)
    return quarter


def _tables(elastic: Elastic, name: str, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Full space and surface: (outputs, 5, 34, 2, 2) of rows (outputs, components) of a field by deviators."""
    tables = coefficient_tables(elastic.poisson)
    return tuple(
        elastic.shear * np.einsum("oi,ikfmn,kc->ocfmn", rows, tables[f"{part} {name}"], FROM_DEVIATOR)
        for part in ("full", "surface")
    )


def _order(odd_out: np.ndarray, odd_in: np.ndarray) -> np.ndarray:
    """(outputs, 5) sign that makes the spectra real: -1 for each direction that is odd in the strain alone."""
    return (-1.0) ** ((1 - odd_out)[:, None] * odd_in[None, :])


def _signs(odd_x: np.ndarray, odd_y: np.ndarray) -> np.ndarray:
    return _order(odd_x, ODD_X) * _order(odd_y, ODD_Y)


class StressInfluence:
    """Deviatoric stress by plastic strain within one box of cells.

    Errors: ContactInputError before anything is allocated where the kernel would need more than 4 GB.
    """

    def __init__(self, cells: Cells, elastic: Elastic) -> None:
        cells.refuse_too_large()
        self.cells, self.elastic, self.products = cells, elastic, 0
        self.levels = np.arange(2 * cells.nz + 1) * cells.dz
        self._corner_spectra = _spectra(cells, self.levels)
        self.matrix = self._matrix(TO_DEVIATOR, ODD_X, ODD_Y)
        self._rough = self.matrix.astype(np.float32)
        self._mean = None
        self.phase = 1j ** (ODD_X + ODD_Y)

    def deviator(self, strain: np.ndarray) -> np.ndarray:
        """(nz, 5, nx, ny) stress [Pa] by plastic strain (nz, 5, nx, ny)."""
        self.products += 1
        return self._product(self.matrix, strain, self.phase)

    def rough_deviator(self, strain: np.ndarray) -> np.ndarray:
        """The same to seven digits in half the time, for the search of a Newton step."""
        self.products += 1
        return self._product(self._rough, strain.astype(np.float32), self.phase.astype(np.complex64))

    def mean(self, strain: np.ndarray) -> np.ndarray:
        """(nz, nx, ny) mean stress [Pa] by plastic strain (nz, 5, nx, ny)."""
        if self._mean is None:
            none = np.zeros(1, int)
            self._mean = self._matrix(MEAN[None, :], none, none)
        return self._product(self._mean, strain, np.ones(1))[:, 0]

    def _product(self, matrix: np.ndarray, strain: np.ndarray, phase: np.ndarray) -> np.ndarray:
        cells, (px, py), outputs = self.cells, self.cells.period, len(phase)
        spectrum = fft.fft(fft.rfft(strain, n=py, axis=3), n=px, axis=2, overwrite_x=True)
        spectrum *= self.phase.conj().astype(spectrum.dtype)[None, :, None, None]
        columns = _gather(spectrum, ODD_X, strain.dtype.type(0))
        rows = np.empty((len(columns), 4, matrix.shape[2]), columns.dtype)
        _multiply(matrix, columns, rows)
        odd = ODD_X if outputs == 5 else np.zeros(1, int)
        answer = _scatter(rows, px, py // 2 + 1, cells.nz, outputs, odd, spectrum.dtype.type(0))
        answer *= phase[None, :, None, None]
        lines = fft.ifft(answer, axis=2, overwrite_x=True)[:, :, : cells.nx]
        return np.ascontiguousarray(fft.irfft(lines, n=py, axis=3)[..., : cells.ny])

    def _matrix(self, rows: np.ndarray, odd_x: np.ndarray, odd_y: np.ndarray) -> np.ndarray:
        """(modes, nz 5, nz outputs): one real matrix per wave number of the quadrant, transposed."""
        cells, elastic = self.cells, self.elastic
        signs = _signs(odd_x, odd_y)
        full, surface = (t * signs[..., None, None, None] for t in _tables(elastic, "layer stress", rows))
        face = _tables(elastic, "stress", rows)[0][..., 0, 0] * signs[..., None]
        above = np.array([[depth_parity(pair, k) for k in range(6)] for pair in PAIRS])
        turned = np.sign(np.einsum("oi,ik,kc->oc", np.abs(rows), above, np.abs(FROM_DEVIATOR)))
        flat = self._corner_spectra.reshape(len(self.levels), COUNT, -1)
        weigh = lambda table: np.einsum("ocf,lfk->lock", table, flat, optimize=True)
        near = weigh(full[..., 0, 0]) + self.levels[:, None, None, None] * weigh(full[..., 1, 0])
        parts = [[weigh(surface[..., m, n]) for n in (0, 1)] for m in (0, 1)]
        own = np.array([rows @ facing_layers(FROM_DEVIATOR[:, c], elastic) for c in range(5)]).T * signs
        touching = np.einsum("ocf,fk->ock", face, flat[0]) * (1 + turned)[..., None] + own[..., None]
        return _assemble(near, turned, touching, parts, cells.nz, cells.dz)


def _assemble(near, turned, touching, parts, nz, dz):
    """Means over layer i of the field of layer j: second differences over the distances of their faces."""
    _, outputs, inputs, modes = near.shape
    matrix = np.empty((modes, nz, inputs, nz, outputs))
    turned = turned[..., None]
    for i, j in np.ndindex(nz, nz):
        if i == j:
            value = touching - (1 + turned) * (near[0] - near[1]) / dz
        else:
            far = abs(i - j)
            value = (turned if i < j else 1.0) / dz * (near[far - 1] - 2 * near[far] + near[far + 1])
        for a, b in np.ndindex(2, 2):
            (plain, source), (depth, both) = (([part[i + j + a + b] for part in row]) for row in parts)
            z, behind = (i + a) * dz, (j + b) * dz
            value += (1.0 if a == b else -1.0) / dz * (plain + z * depth + behind * (source + z * both))
        matrix[:, j, :, i] = value.transpose(2, 1, 0)
    return matrix.reshape(modes, nz * inputs, nz * outputs)


@njit(cache=True)
def _gather(spectrum, odd, zero):
    """(modes, nz 5, 4) real columns: real and imaginary part at kx and at -kx, the latter mirrored."""
    nz, inputs, px, half = spectrum.shape
    out = np.full(((px // 2 + 1) * half, nz * inputs, 4), zero)
    for k in range(nz):
        for c in range(inputs):
            sign = zero - 1 if odd[c] else zero + 1
            for i in range(px // 2 + 1):
                for j in range(half):
                    one, two = spectrum[k, c, i, j], spectrum[k, c, (px - i) % px, j]
                    mode = i * half + j
                    out[mode, k * inputs + c, 0] = one.real
                    out[mode, k * inputs + c, 1] = one.imag
                    out[mode, k * inputs + c, 2] = sign * two.real
                    out[mode, k * inputs + c, 3] = sign * two.imag
    return out


@njit(cache=True)
def _multiply(matrix, columns, out):
    """out (modes, 4, rows): matrix (modes, inputs, rows), transposed, times columns (modes, inputs, 4). The matrix is
    by far the largest: it is read once and in order."""
    for k in range(len(matrix)):
        one, two, three, four = out[k, 0], out[k, 1], out[k, 2], out[k, 3]
        one[:], two[:], three[:], four[:] = 0, 0, 0, 0
        for c in range(matrix.shape[1]):
            a, b, d, e = columns[k, c, 0], columns[k, c, 1], columns[k, c, 2], columns[k, c, 3]
            row = matrix[k, c]
            for o in range(len(row)):
                value = row[o]
                one[o] += value * a
                two[o] += value * b
                three[o] += value * d
                four[o] += value * e


@njit(cache=True)
def _scatter(rows, px, half, nz, outputs, odd, zero):
    out = np.full((nz, outputs, px, half), zero)
    for k in range(nz):
        for c in range(outputs):
            sign = -1.0 if odd[c] else 1.0
            for i in range(px // 2 + 1):
                for j in range(half):
                    row = rows[i * half + j, :, k * outputs + c]
                    out[k, c, (px - i) % px, j] = sign * (row[2] + 1j * row[3])
                    out[k, c, i, j] = row[0] + 1j * row[1]
    return out
