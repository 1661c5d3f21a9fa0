"""Centres of dilatation in the holes of a body: what fictitious forces cannot do where nothing changes its area.

The indirect method fills a hole with the body's own material. As Poisson's ratio tends to 1/2 the filling can no longer
change the hole's area: forces along the hole's normal press on the filling alone and move nothing outside, and errors
grow as 1 / (1 - 2 nu). A centre of dilatation in each hole opens it at any Poisson's ratio; in exchange the forces on
each hole have no mean along its normal. The field is that of a pressurised hole in an infinite plane,

    u = S z / (2 G |z|^2),    radial and hoop stress  -S / r^2, S / r^2

Source: Lame; derived here. Held by the thick ring at nu 0.4999 (tests/bem/test_boundary.py).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from bem.material import Elastic
from bem.plane.mesh import BoundaryMesh
from bem.plane.outline import encloses, polygon_moments
from bem.plane.point_load import InnerLoad


@dataclass(frozen=True)
class Dilatation(InnerLoad):
    """A centre at a point [m] with the strength S [N] per unit thickness."""

    at: tuple[float, float]
    strength: float = 1.0

    def scaled(self, factor: float) -> Dilatation:
        return replace(self, strength=self.strength * float(factor))

    def displacement(self, points: np.ndarray, material: Elastic) -> np.ndarray:
        """Displacement (m, 2) [m] at points (m, 2)."""
        away = points - np.array(self.at)
        return self.strength / (2 * material.shear) * away / (away**2).sum(axis=1)[:, None]

    def stress(self, points: np.ndarray, material: Elastic) -> np.ndarray:
        """Stress (m, 3) xx, yy, xy [Pa] at points (m, 2)."""
        turn = 2 * self.strength / (points[:, 0] + 1j * points[:, 1] - complex(*self.at)) ** 2  # yy - xx + 2 i xy
        return np.column_stack([-turn.real / 2, turn.real / 2, turn.imag / 2])

    def path_force(self, begin: np.ndarray, end: np.ndarray, material: Elastic) -> np.ndarray:
        """Force (2, h) [N/m] of the field's traction over straight paths between complex points, outward on the
        right."""
        at = complex(*self.at)
        force = 1j * self.strength * (1 / np.conj(end - at) - 1 / np.conj(begin - at))
        return np.vstack([force.real, force.imag])


def _point_within(polygon: np.ndarray) -> tuple[float, float]:
    """A point [m] within a polygon (n, 2) that bends around its own centroid: the middle of the widest stretch within
    it at half height."""
    (x, y), (next_x, next_y) = polygon.T, np.roll(polygon, -1, axis=0).T
    level = (y.min() + y.max()) / 2
    passed = (y > level) != (next_y > level)
    walls = np.sort((x + (level - y) / np.where(passed, next_y - y, 1.0) * (next_x - x))[passed])
    widest = 2 * int(np.argmax(walls[1::2] - walls[::2]))
    return float(walls[widest : widest + 2].mean()), float(level)


def in_holes(mesh: BoundaryMesh) -> tuple[tuple[Dilatation, ...], np.ndarray]:
    """A centre in each hole of a body, of the strength of a unit pressure, and the mean along the hole's normal (h, 2n)
    of densities, all x then all y."""
    centres, means = [], []
    for loop in mesh.loops:
        area, centre = polygon_moments(mesh.start[loop], mesh.end[loop])
        if area > 0:  # the material on its left, inside: the outer boundary
            continue
        at = float(centre.real), float(centre.imag)
        if not encloses(mesh.vertices[loop], np.array(at)):
            at = _point_within(mesh.vertices[loop])
        centres.append(Dilatation(at, -area / np.pi))
        mean = np.zeros((2, mesh.densities))
        mine = np.unique(np.r_[mesh.first[loop], mesh.last[loop]])
        mean[:, mine] = (mesh.normals[mine] * mesh.cell_length[mine, None]).T / mesh.cell_length[mine].sum()
        means.append(mean.ravel())
    return tuple(centres), np.array(means).reshape(len(centres), 2 * mesh.densities)
