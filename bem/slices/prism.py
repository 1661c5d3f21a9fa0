"""An elastic prism under loads that vary as a wave along it: the 2D boundary elements at a wavenumber.

A prism's response to loads cos(k x) along its axis is again a wave, and each wavenumber k is a problem in the
cross-section with three displacement components (bem/slices/prism_kernel.py). k -> 0 is plane strain. All wavenumbers
together are the prism's exact three-dimensional response: `2.5D` in the sense of wave problems. Indirect method,
densities, cells and conditions as in bem/plane/boundary.py; K0 has a level of its own, so neither shift nor constraint
is needed.
Error: second order in the element (tests/bem/test_prism.py), as long as k times the element stays below about 1.
"""

from __future__ import annotations

import numpy as np
from scipy.linalg import lu_factor, lu_solve

from bem.material import Elastic
from bem.plane.boundary import (
    MEMORY_LIMIT,
    cell_integrals,
    check_memory,
    displacement_matrix,
    hat_displacements,
    resultant_map,
)
from bem.plane.mesh import BoundaryMesh
from bem.slices.prism_kernel import add_wave_displacement, add_wave_resultants


class PrismSection:
    """A meshed cross-section: what all wavenumbers share.

    held : (n,) bool, densities whose displacement is zero; targets (m, 2) [m] : points whose displacement is wanted
    """

    def __init__(self, mesh: BoundaryMesh, material: Elastic, held: np.ndarray, targets: np.ndarray) -> None:
        check_memory(3 * mesh.densities, MEMORY_LIMIT)
        self.mesh, self.material, self.held = mesh, material, held
        self._elements = mesh.vertices, mesh.vertices[mesh.following] - mesh.vertices, mesh.first, mesh.last
        self._plane_resultants()
        points = np.vstack([mesh.middles[held], targets])
        self._plane_points = points
        self._plane_rows = displacement_matrix(points, mesh, material)
        self._plane_log = hat_displacements(points, mesh)[0]

    def _plane_resultants(self) -> None:
        mesh, (start, step, first, last) = self.mesh, self._elements
        integrals = cell_integrals(mesh)
        self._in_plane = resultant_map(integrals, self.material)
        self._along = -integrals.angle / (2 * np.pi)
        points = np.vstack([start + 0.25 * step, start + 0.75 * step])
        normal = np.column_stack([step[:, 1], -step[:, 0]]) / mesh.lengths[:, None]
        normals, widths, cells = np.vstack([normal, normal]), np.r_[mesh.lengths, mesh.lengths] / 2, np.r_[first, last]
        self._paths = points, normals, widths, cells
        log = hat_displacements(points, mesh)[0]
        self._log_cells = np.zeros((2, mesh.densities, mesh.densities))
        for into, along in zip(self._log_cells, normals.T):
            np.add.at(into, cells, log * (widths * along)[:, None])

    def _resultants(self, wavenumber: float) -> np.ndarray:
        """Resultant of the traction's amplitude over each cell (3n, 3n) [m] of the densities."""
        n, nu = self.mesh.densities, self.material.poisson
        blocks = np.zeros((3, 3, n, n))
        add_wave_resultants(*self._paths, *self._elements, wavenumber, nu, blocks)
        logs = wavenumber * (1 - 1 / (2 * (1 - nu))) * self._log_cells
        blocks[2, :2] += logs
        blocks[:2, 2] += logs
        matrix = blocks.transpose(0, 2, 1, 3).reshape(3 * n, 3 * n) / (2 * np.pi)
        matrix[: 2 * n, : 2 * n] += self._in_plane
        matrix[2 * n :, 2 * n :] += self._along
        return matrix

    def _displacements(self, wavenumber: float) -> np.ndarray:
        """Displacement amplitude (3, m, 3n) [m/Pa] of held middles and targets under the densities."""
        n, m = self.mesh.densities, len(self._plane_points)
        blocks = np.zeros((3, 3, m, n))
        add_wave_displacement(self._plane_points, *self._elements, wavenumber, self.material.poisson, blocks)
        rows = blocks.transpose(0, 2, 1, 3).reshape(3, m, 3 * n)
        rows[2, :, 2 * n :] -= self._plane_log
        rows /= 2 * np.pi * self.material.shear
        rows[:2, :, : 2 * n] += self._plane_rows.reshape(2, m, 2 * n)
        return rows

    def respond(self, wavenumber: float, forces: np.ndarray, prescribed: np.ndarray | None = None) -> np.ndarray:
        """Displacement amplitude (3, m, p) [m] of the targets under p load patterns.

        wavenumber : k > 0 [1/m]; forces (3n, p) : amplitude of the force on each cell, components one after the other
            [N/m]
        prescribed : (3, h, p) displacement of the held cells' middles [m], default zero
        """
        n, held = self.mesh.densities, self.held
        mask = np.r_[held, held, held]
        length = np.tile(self.mesh.cell_length, 3)
        stiffness = 2 * self.material.shear / np.ptp(self.mesh.vertices, axis=0).max()
        matrix = self._resultants(wavenumber) / length[:, None]
        rows = self._displacements(wavenumber)
        h = int(held.sum())
        matrix[mask] = rows[:, :h].reshape(3 * h, 3 * n) * stiffness
        right = forces / length[:, None]
        right[mask] = 0.0 if prescribed is None else prescribed.reshape(3 * h, prescribed.shape[-1]) * stiffness
        density = lu_solve(
            lu_factor(matrix, overwrite_a=True, check_finite=False), right, overwrite_b=True, check_finite=False
        )
        return np.einsum("cmq,qp->cmp", rows[:, h:], density, optimize=True)
