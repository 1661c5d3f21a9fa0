"""A force and a couple at a point inside a body: Kelvin's solution and the rotlet, in the infinite plane."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass

import numpy as np

from bem.checks import plane_points, refuse_unless_finite
from bem.material import Elastic
from bem.plane.kelvin import point_force_displacement, point_force_resultant, point_force_stress
from bem.plane.mesh import BoundaryMesh


class InnerLoad(ABC):
    """What acts inside a body, by its field in the infinite plane."""

    @abstractmethod
    def displacement(self, points: np.ndarray, material: Elastic) -> np.ndarray:
        """Displacement (m, 2) [m] at points (m, 2)."""

    @abstractmethod
    def stress(self, points: np.ndarray, material: Elastic) -> np.ndarray:
        """Stress (m, 3) xx, yy, xy [Pa] at points (m, 2)."""

    @abstractmethod
    def path_force(self, begin: np.ndarray, end: np.ndarray, material: Elastic) -> np.ndarray:
        """Force (2, h) [N/m] of the field's traction over straight paths between complex points, outward on the
        right."""

    def resultants(self, mesh: BoundaryMesh, material: Elastic) -> np.ndarray:
        """Force (2n,) [N/m], all x then all y, of the field's traction on each cell."""
        points, begin, end, cell = mesh.paths()
        x, y = self.path_force(points[begin], points[end], material)
        return np.r_[np.bincount(cell, x, mesh.densities), np.bincount(cell, y, mesh.densities)]


class PointLoadError(ValueError):
    """A point load that is no number, or that does not act inside the body."""


@dataclass(frozen=True)
class PointLoad(InnerLoad):
    """Force (fx, fy) [N/m] and anticlockwise couple [N] per unit thickness at a point [m]."""

    at: tuple[float, float]
    force: tuple[float, float] = (0.0, 0.0)
    moment: float = 0.0

    def __post_init__(self) -> None:
        plane_points([self.at], PointLoadError)
        plane_points([self.force], PointLoadError)
        refuse_unless_finite(PointLoadError, moment=self.moment)

    @property
    def _at(self) -> complex:
        return complex(*self.at)

    @property
    def _force(self) -> complex:
        return complex(*self.force)

    def displacement(self, points: np.ndarray, material: Elastic) -> np.ndarray:
        """Displacement (m, 2) [m] at points (m, 2), up to a constant."""
        z = points[:, 0] + 1j * points[:, 1]
        u = point_force_displacement(z, self._at, self._force, material.kolosov) + 1j * self.moment / (
            2 * np.pi * np.conj(z - self._at)
        )
        return np.column_stack([u.real, u.imag]) / (2 * material.shear)

    def refuse_outside(self, mesh: BoundaryMesh) -> None:
        """Raise PointLoadError when the load acts outside the body or within half an element of its boundary."""
        (element,), _, (inward,) = mesh.locate(np.array([self.at], float))
        position = f"the point ({self._at.real:.6g}, {self._at.imag:.6g}) m of a load or hub"
        if abs(inward) < 0.5 * mesh.lengths[element]:
            raise PointLoadError(
                f"{position} lies {abs(inward):.3g} m from the boundary, less than half its element of "
                f"{mesh.lengths[element]:.3g} m: move it inward, or refine the mesh there"
            )
        if inward < 0:
            (low_x, low_y), (high_x, high_y) = mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)
            raise PointLoadError(
                f"{position} lies outside the body, whose boundary spans x {low_x:.6g} to {high_x:.6g}, y {low_y:.6g}"
                f" to {high_y:.6g} m: move it inside"
            )

    def path_force(self, begin: np.ndarray, end: np.ndarray, material: Elastic) -> np.ndarray:
        """Force (2, h) [N/m] of the field's traction over straight paths between complex points, outward on the
        right."""
        force = point_force_resultant(begin, end, self._at, self._force, material.kolosov)
        force = force - self.moment / (2 * np.pi) * (1 / np.conj(end - self._at) - 1 / np.conj(begin - self._at))
        return np.vstack([force.real, force.imag])

    def stress(self, points: np.ndarray, material: Elastic) -> np.ndarray:
        """Stress (m, 3) xx, yy, xy [Pa] at points (m, 2)."""
        z = points[:, 0] + 1j * points[:, 1]
        stress = point_force_stress(z, self._at, self._force, material.kolosov)
        turn = 2 * (-1j * self.moment / (2 * np.pi)) / (z - self._at) ** 2  # yy - xx + 2 i xy = 2 psi'
        return stress + np.column_stack([-turn.real / 2, turn.real / 2, turn.imag / 2])
