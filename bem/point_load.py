"""A force and a couple at a point inside a body: Kelvin's solution and the rotlet, in the infinite plane."""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bem.kelvin import point_force_displacement, point_force_resultant, point_force_stress
from bem.material import Elastic
from bem.mesh import BoundaryMesh


@dataclass(frozen=True)
class PointLoad:
    """Force (fx, fy) [N/m] and anticlockwise couple [N] per unit thickness at a point [m]."""

    at: tuple[float, float]
    force: tuple[float, float] = (0.0, 0.0)
    moment: float = 0.0

    @property
    def _at(self) -> complex:
        return complex(*self.at)

    @property
    def _force(self) -> complex:
        return complex(*self.force)

    def displacement(self, points: np.ndarray, material: Elastic) -> np.ndarray:
        """Displacement (m, 2) [m] at points (m, 2), up to a constant."""
        z = points[:, 0] + 1j * points[:, 1]
        u = point_force_displacement(z, self._at, self._force, material.kolosov) + 1j * self.moment / (2 * np.pi * np.conj(z - self._at))
        return np.column_stack([u.real, u.imag]) / (2 * material.shear)

    def path_force(self, begin: np.ndarray, end: np.ndarray, material: Elastic) -> np.ndarray:
        """Force (2, h) [N/m] of the field's traction over straight paths between complex points, outward on the right."""
        force = point_force_resultant(begin, end, self._at, self._force, material.kolosov)
        force = force - self.moment / (2 * np.pi) * (1 / np.conj(end - self._at) - 1 / np.conj(begin - self._at))
        return np.vstack([force.real, force.imag])

    def resultants(self, mesh: BoundaryMesh, material: Elastic) -> np.ndarray:
        """Force (2n,) [N/m], all x then all y, of the field's traction on each cell."""
        points, begin, end, cell = mesh.paths()
        x, y = self.path_force(points[begin], points[end], material)
        return np.r_[np.bincount(cell, x, mesh.densities), np.bincount(cell, y, mesh.densities)]

    def stress(self, points: np.ndarray, material: Elastic) -> np.ndarray:
        """Stress (m, 3) xx, yy, xy [Pa] at points (m, 2)."""
        z = points[:, 0] + 1j * points[:, 1]
        stress = point_force_stress(z, self._at, self._force, material.kolosov)
        turn = 2 * (-1j * self.moment / (2 * np.pi)) / (z - self._at) ** 2   # yy - xx + 2 i xy = 2 psi'
        return stress + np.column_stack([-turn.real / 2, turn.real / 2, turn.imag / 2])
