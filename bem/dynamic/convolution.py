"""Loads that vary in time by convolution quadrature: problems in Laplace's domain, and back.

The second route to waves: no cells, only the boundary, also of an infinite body. Of a multistep rule with the symbol
delta(zeta) every instant's answer is a convolution of the loads before it, whose transform is the solution at

    s_l = delta(R zeta_l) / h,    zeta_l = exp(-2 pi i l / N),    R^N = 1e-4

Lubich's theory gives stability for all steps h: of the trapezoidal rule without dissipation, of BDF2 with it. Here all
loads are known beforehand, so the N / 2 + 1 problems are independent (the decoupled form).

Sources: Lubich, Numer. Math. 52 (1988) 129 and 413; Banjai and Schanz (2010): from memory, held by tests against exact
solutions.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.linalg import lu_factor, lu_solve

from bem.checks import refuse_unless_positive
from bem.dynamic.body import DynamicsError, Waves
from bem.dynamic.laplace_kernel import add_excess
from bem.material import Elastic
from bem.plane.boundary import displacement_matrix, resultant_matrix
from bem.plane.mesh import BoundaryMesh

RULES: dict[str, Callable[[np.ndarray], np.ndarray]] = {
    "trapezoidal": lambda zeta: 2 * (1 - zeta) / (1 + zeta),
    "BDF2": lambda zeta: (1 - zeta) + (1 - zeta) ** 2 / 2,
    "backward Euler": lambda zeta: 1 - zeta,
}
# part of what would come after the end that is added at the beginning; its inverse enlarges the quadrature's noise of
# 1e-8, whose panels change with s, towards the end
_ALIAS = 1e-4
_GAUSS, _WEIGHT = np.polynomial.legendre.leggauss(4)
_NODES, _SHARES = (1 + _GAUSS) / 2, _WEIGHT / 2
_CELL, _CELL_SHARE = np.polynomial.legendre.leggauss(2)


class LaplaceBody:
    """Matrices of a body's boundary mesh at any s: what densities give in displacement and in traction."""

    def __init__(self, mesh: BoundaryMesh, material: Elastic, density: float) -> None:
        self.mesh, self.material, self.waves = mesh, material, Waves.of(material, density)
        self._static_displacement = displacement_matrix(mesh.middles, mesh, material)
        self._static_resultant = resultant_matrix(mesh, material)
        points, begin, end, cell = mesh.paths()
        step = (points[end] - points[begin])[:, None]
        self._sample = (points[begin][:, None] + step * (1 + _CELL) / 2).ravel()
        self._outward = np.broadcast_to(-1j * step, (len(begin), len(_CELL))).ravel()  # normal times length
        self._share = np.tile(_CELL_SHARE / 2, len(begin))
        self._cell = np.repeat(cell, len(_CELL))

    def _excess(self, s: complex, points: np.ndarray, normals: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        mesh, waves = self.mesh, self.waves
        m, n = len(points), mesh.densities
        moved, pulled = np.zeros((2 * m, 2 * n), complex), np.zeros((2 * len(normals), 2 * n), complex)
        add_excess(
            np.ascontiguousarray(points), np.ascontiguousarray(normals), mesh.start, mesh.end, mesh.first, mesh.last,
            _NODES, _SHARES, s / waves.dilatational, s / waves.shear, waves.shear / waves.dilatational, moved, pulled,
        )  # fmt: skip
        return moved / (2 * np.pi * self.material.shear), pulled / (2 * np.pi)

    def displacement(self, s: complex, points: np.ndarray | None = None) -> np.ndarray:
        """Displacement (2m, 2n) [m/Pa] of densities at points (m, 2), or at the middles of the boundary's cells."""
        none = np.zeros(0, complex)
        if points is None:
            middles = self.mesh.middles[:, 0] + 1j * self.mesh.middles[:, 1]
            return self._static_displacement + self._excess(s, middles, none)[0]
        z = points[:, 0] + 1j * points[:, 1]
        return displacement_matrix(points, self.mesh, self.material) + self._excess(s, z, none)[0]

    def resultant(self, s: complex) -> np.ndarray:
        """Force (2n, 2n) [m] of the traction on each cell of the boundary, of densities."""
        n, q = self.mesh.densities, len(self._cell)
        pulled = self._excess(s, self._sample, self._outward)[1]
        out = self._static_resultant.astype(complex)
        np.add.at(out, self._cell, pulled[:q] * self._share[:, None])
        np.add.at(out, n + self._cell, pulled[q:] * self._share[:, None])
        return out


@dataclass(frozen=True)
class Conditions:
    """held (n, 2) bool : components whose displacement is zero; forces (2n, p) : patterns of force on the other cells,
    all x then all y [N/m per unit]."""

    held: np.ndarray
    forces: np.ndarray


def transfer(body: LaplaceBody, conditions: Conditions, s: complex, points: np.ndarray) -> np.ndarray:
    """Displacement (2m, p) at points (m, 2) of unit patterns, all x then all y, at one s."""
    held = np.r_[conditions.held[:, 0], conditions.held[:, 1]]
    stiffness = 2 * body.material.shear / body.mesh.lengths.sum()
    length = np.tile(body.mesh.cell_length, 2)
    matrix = body.resultant(s) / length[:, None]
    if held.any():
        matrix[held] = body.displacement(s)[held] * stiffness
    right = np.where(held[:, None], 0.0, conditions.forces / length[:, None])
    density = lu_solve(lu_factor(matrix, check_finite=False), right.astype(complex), check_finite=False)
    return body.displacement(s, points) @ density


def convolve(
    transfer_at: Callable[[complex], np.ndarray], loads: np.ndarray, step: float, rule: str = "trapezoidal"
) -> np.ndarray:
    """Answers (k, m) at the instants h, 2h, .. of loads (k, p) at the same instants, of a transfer s -> (m, p).

    Raises DynamicsError for a step or rule that is none. Error: 1e-4 of the largest answer by the transform,
    and the rule's own, of second order.
    """
    refuse_unless_positive(DynamicsError, **{"step [s]": step})
    if rule not in RULES:
        raise DynamicsError(f"rule {rule!r}: there are {', '.join(RULES)}")
    loads = np.asarray(loads, float)
    if loads.ndim != 2 or len(loads) < 2 or not np.isfinite(loads).all():
        raise DynamicsError("loads: give finite numbers (k, p), p loads at each of k > 1 instants")
    count = len(loads) + 1
    padded = np.vstack([np.zeros((1, loads.shape[1])), loads])
    radius = _ALIAS ** (1 / count)
    scale = radius ** np.arange(count)
    spectrum = np.fft.fft(padded * scale[:, None], axis=0)
    answer = None
    for k in range(count // 2 + 1):
        s = RULES[rule](radius * np.exp(-2j * np.pi * k / count)) / step
        value = transfer_at(s) @ spectrum[k]
        if answer is None:
            answer = np.zeros((count, len(value)), complex)
        answer[k] = value
        if k:
            answer[count - k] = value.conj()
    return (np.fft.ifft(answer, axis=0).real / scale[:, None])[1:]
