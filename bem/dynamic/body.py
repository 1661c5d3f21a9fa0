"""A body with inertia: how it yields statically to the inertia forces of its cells and to its loads.

The fictitious body forces -rho a of the cells are loads like any other. With forces phi on the N cells and amplitudes t
of m load patterns on the boundary, the boundary elements give

    u = D phi + L t         mean displacement of the cells
    q = L' phi + C t        displacement that does work on the patterns

By Betti's law D and C are symmetric and the second L is the transpose of the first, so the strain energy is
(phi u + t q) / 2, never negative. The discrete D of a collocation method is symmetric only up to its error, and the
power balance of any scheme in time then leaks (the cells as the thesis prints them, section 6.3.1, have the
displacement at their centres and D as it comes); taken as the mean of itself and its transpose it is as accurate and
keeps the balance.
"""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from scipy.linalg import LinAlgError, cho_factor, eigh

from bem.checks import refuse_unless_positive
from bem.dynamic.body_force import CellForces, cell_tractions, displacement_of_cells
from bem.dynamic.cells import Cells
from bem.plane.body import Body, CondensedBody
from bem.plane.boundary import MEMORY_LIMIT, BoundarySolution, TooLargeError, displacement_matrix
from bem.plane.mesh import BoundaryMesh

_ROWS = 1000  # points whose displacement matrix is held at once


WORST_REPAIR = 1e-5  # of all flexibility, above which a negative eigenvalue is more than round-off of the integrals


class DiscretisationWarning(UserWarning):
    """Cells and boundary elements that do not resolve each other."""


class DynamicsError(ValueError):
    """A problem in time that cannot be set up: no mass, no step, a body that nothing holds."""


@dataclass(frozen=True)
class Waves:
    """Speeds [m/s] of an isotropic solid, of dilatational and of shear waves."""

    dilatational: float
    shear: float

    @classmethod
    def of(cls, material, density: float) -> Waves:
        """Of a bem.material.Elastic and a density [kg/m^3]."""
        refuse_unless_positive(DynamicsError, **{"density [kg/m^3]": density})
        shear, poisson = material.shear, material.poisson
        return cls(
            float(np.sqrt(2 * shear * (1 - poisson) / (1 - 2 * poisson) / density)), float(np.sqrt(shear / density))
        )


class Inertial(NamedTuple):
    """A plane body laid out for waves: its boundary mesh, the cells that carry its inertia, density [kg/m^3]."""

    body: Body
    mesh: BoundaryMesh
    cells: Cells
    density: float


class DynamicBody:
    """Flexibility of a held body for its cells and for load patterns.

    flexibility (2N, 2N) D [m^2/N]; reach (2N, m) L [m per unit of pattern]; compliance (m, m) C; mass (2N,) [kg/m], all
    x then all y
    """

    def __init__(self, solid: Inertial, patterns: np.ndarray, memory_limit: float = MEMORY_LIMIT) -> None:
        """patterns : (2n, m) forces on the boundary's cells, all x then all y [N/m per unit].

        Raises DynamicsError for a body without a held edge, TooLargeError beyond `memory_limit` [bytes].
        """
        body, mesh, cells, density = solid
        if body.held is None:
            raise DynamicsError("cells with inertia need a body with a held edge: give `held` the name of one")
        self.waves = Waves.of(body.material, density)
        need = 8.0 * (4 * (2 * len(cells)) ** 2 + 2 * (2 * len(cells)) * (2 * mesh.densities))
        if need > memory_limit:
            raise TooLargeError(
                f"{len(cells)} cells need {need / 1e9:.2f} GB of dense matrices and {memory_limit / 1e9:.2f} GB are"
                " allowed: take larger cells away from the loads"
            )
        self.mesh, self.cells, self.material, self.density = mesh, cells, body.material, density
        self.static = CondensedBody(body, mesh, memory_limit)
        self.static.condense(patterns)
        self._densities, self._shift = self.static.problem.solve(
            -cell_tractions(mesh, cells, body.material), -displacement_of_cells(mesh.middles, cells, body.material)
        )
        self.compliance = patterns.T @ self.static.displacement(mesh.middles, np.arange(mesh.densities))
        flexibility, layers = self._fields_in_cells()
        flexibility += layers @ self._densities + np.repeat(self._shift, len(cells), axis=0)
        reach = layers @ self.static.density + np.repeat(self.static.shift, len(cells), axis=0)
        self.flexibility = (flexibility + flexibility.T) / 2
        self.compliance = (self.compliance + self.compliance.T) / 2
        # two ways to the same numbers, by Betti's law; each alone leaves the whole less than positive
        self.reach = (reach + self._middles_under_cells().T @ patterns) / 2
        self.mass = np.tile(density * cells.area, 2)
        self._make_positive()
        self._memo: dict = {}

    def _make_positive(self) -> None:
        """Lift eigenvalues of the scaled flexibility that discretisation left below zero to those of a wave of twice
        the smallest whole cell; a mode with a negative one would grow like no wave."""
        floor = (self.cells.side.min() / (np.pi * self.waves.dilatational)) ** 2
        scaled = self.scaled_flexibility
        try:
            cho_factor(scaled, check_finite=False)
            return
        except LinAlgError:
            values, modes = eigh(scaled, subset_by_value=(-np.inf, 1e-3 * floor))
        root = np.sqrt(self.mass)
        self.flexibility += (modes * (floor - values)) @ modes.T / root / root[:, None]
        if -values[0] > WORST_REPAIR * np.trace(scaled):
            warnings.warn(
                f"{len(values)} of {len(root)} modes had a negative flexibility, down to {-values[0]:.2g} s^2 of"
                f" {np.trace(scaled):.2g} s^2 in all: refine the boundary mesh to the cells' size",
                DiscretisationWarning,
                stacklevel=3,
            )

    def _fields_in_cells(self) -> tuple[np.ndarray, np.ndarray]:
        """Mean displacement of the cells in the infinite plane: of unit forces on the cells (2N, 2N), and of the
        boundary's densities (2N, 2n)."""
        cells, material, n = self.cells, self.material, len(self.cells)
        mean = cells.averaging.tocsc()
        own = np.zeros((2 * n, 2 * n))
        layers = np.zeros((2 * n, 2 * self.mesh.densities))
        for a in range(0, len(cells.points), _ROWS):
            part = cells.points[a : a + _ROWS]
            share, m = mean[:, a : a + _ROWS], len(part)
            for out, moved in (
                (own, displacement_of_cells(part, cells, material)),
                (layers, displacement_matrix(part, self.mesh, material)),
            ):
                out[:n] += share @ moved[:m]
                out[n:] += share @ moved[m:]
        return own, layers

    def _middles_under_cells(self) -> np.ndarray:
        """Displacement (2n, 2N) at the middles of the boundary's cells of unit forces on the cells."""
        moved = displacement_of_cells(self.mesh.middles, self.cells, self.material)
        moved += self.static.problem.displacement_at_middles @ self._densities
        return moved + np.repeat(self._shift, self.mesh.densities, axis=0)

    @property
    def scaled_flexibility(self) -> np.ndarray:
        """M^1/2 D M^1/2 (2N, 2N) [s^2]: its eigenvalues are 1 / omega^2."""
        root = np.sqrt(self.mass)
        return root[:, None] * self.flexibility * root

    @cached_property
    def inverse_frequencies(self) -> np.ndarray:
        """1 / omega^2 (2N,) [s^2] of the body with its cells, the slowest first."""
        return eigh(self.scaled_flexibility, eigvals_only=True)[::-1]

    def solution(self, forces: np.ndarray, amplitude: np.ndarray) -> BoundarySolution:
        """Field under forces (2N,) on the cells and amplitudes (m,) of the patterns, for bem.plane.internal; what it
        needs of the cells at points asked for is kept until `forget_points`."""
        n = self.mesh.densities
        density = self.static.density @ amplitude + self._densities @ forces
        shift = self.static.shift @ amplitude + self._shift @ forces
        return BoundarySolution(
            self.mesh, self.material, density.reshape(2, n).T, shift, (CellForces(self.cells, forces, self._memo),)
        )

    def forget_points(self) -> None:
        """Free the memory of the points at which fields were asked for."""
        self._memo.clear()
