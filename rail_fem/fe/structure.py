"""Bodies ready to move: nodes with mass, position and velocity, and elements of both kernels on one distributed mesh."""

from __future__ import annotations

import numpy as np
from mpi4py import MPI

from rail_fem.fe.blocks import ElementBlocks, ElementSettings, material_table, strain_energy_density
from rail_fem.fe.domain import Domain, raise_together
from rail_fem.fe.elastic import fixed_geometry, update_elastic_elements
from rail_fem.fe.hexahedron import update_elements
from rail_fem.fe.state import HOURGLASS, LANES, N_WORK, YIELD
from rail_fem.steel import Steel


class Structure:
    """Elements, masses and nodal state of a rank.

    steels : one for each region of the domain;  small : regions on the small-displacement elastic kernel (the others: finite strain, J2)
    damping : beta of the small-displacement kernel [s], set by Dynamics.stable_step

    Attributes (rank-local): x, v, force (3 n_nodes,);  mass (n_nodes,) of whole nodes also on ghosts;
    block_work (n_blocks, N_WORK) plastic, hourglass and viscous work of each finite-strain block so far [J].
    """

    def __init__(self, domain: Domain, steels: list[Steel], small: tuple[int, ...] = (), settings: ElementSettings = ElementSettings()):
        self.domain, self.settings, self.steels = domain, settings, steels
        self.table = material_table(steels, settings)
        is_small = np.isin(domain.region, small)
        self.finite_cells, self.small_cells = np.flatnonzero(~is_small), np.flatnonzero(is_small)
        self.finite = ElementBlocks(domain.cells[self.finite_cells], domain.region[self.finite_cells], self.table)
        self.small = ElementBlocks(domain.cells[self.small_cells], domain.region[self.small_cells], self.table)
        self.x, self.v, self.force = domain.reference.copy(), domain.nodal_vector(), domain.nodal_vector()
        self.u = domain.nodal_vector()
        self.geometry, smallest = fixed_geometry(domain.reference, self.small.nodes, self.small.filled, self.small.material_of, self.table.rows)
        self.damping = 0.0
        self.block_work = np.zeros((len(self.finite.filled), N_WORK))
        self.smallest_volume = smallest
        self.initial_volume = element_volumes(domain.reference, domain.cells)
        raise_together(domain.comm, self._inverted_fault(self.initial_volume))
        self.mass = self._lumped_mass()

    @property
    def work(self) -> np.ndarray:
        """Plastic, hourglass and viscous work of all finite-strain elements so far (N_WORK,) [J]. Rank-local."""
        return self.block_work.sum(axis=0)

    def _inverted_fault(self, volumes: np.ndarray) -> str | None:
        bad = np.flatnonzero(~(volumes > 0))
        if not len(bad):
            return None
        at = 1e3 * self.domain.reference.reshape(-1, 3)[self.domain.cells[bad[0]]].mean(axis=0)
        return (
            f"{len(bad)} element(s) turned inside out, the first is element {self.domain.cell_input[bad[0]]} at "
            f"({at[0]:.2f}, {at[1]:.2f}, {at[2]:.2f}) mm, volume {volumes[bad[0]] * 1e9:.3g} mm3: mend the mesh there"
        )

    def _lumped_mass(self) -> np.ndarray:
        density = np.array([s.density for s in self.steels])[self.domain.region]
        vector = self.domain.nodal_vector()
        share = np.repeat(density * self.initial_volume / 8, 8)
        np.add.at(vector, 3 * self.domain.cells.ravel(), share)
        self.domain.sum_to_owner(vector)
        self.domain.copy_to_ghosts(vector)
        return vector[::3].copy()

    def add_internal_force(self, dt: float) -> None:
        """Minus the internal force at the present x and v, added to `force` of owned and ghost nodes; updates stresses. Rank-local."""
        t = self.table
        b = self.finite
        self.smallest_volume = update_elements(
            self.x, self.v, dt, b.nodes, b.filled, b.material_of, t.rows, t.curve_start, t.curve_strain, t.curve_stress, b.state, self.force, self.block_work.ravel()
        )
        b = self.small
        if b.n_cells:
            np.subtract(self.x, self.domain.reference, out=self.u)
            update_elastic_elements(self.u, self.v, self.damping, b.nodes, b.filled, b.material_of, t.rows, self.geometry, b.state, self.force)

    def elastic_energy(self) -> tuple[float, float]:
        """Elastic energy of the finite-strain and of the small-displacement elements [J]. Rank-local."""
        finite = self._stored_energy(self.finite, self.finite_cells, element_volumes(self.x, self.domain.cells[self.finite_cells]))
        if not self.small.n_cells:
            return finite, 0.0
        state, unused = self.small.state.copy(), self.domain.nodal_vector()
        np.subtract(self.x, self.domain.reference, out=self.u)
        b = self.small
        update_elastic_elements(self.u, self.v, 0.0, b.nodes, b.filled, b.material_of, self.table.rows, self.geometry, b.state, unused)
        small = -0.5 * float(unused @ self.u)
        b.state[:] = state
        return finite, small

    def _stored_energy(self, blocks: ElementBlocks, cells: np.ndarray, volumes: np.ndarray) -> float:
        modulus = np.array([s.youngs_modulus for s in self.steels])[self.domain.region[cells]]
        poisson = np.array([s.poisson for s in self.steels])[self.domain.region[cells]]
        return float((strain_energy_density(blocks.stress(), modulus, poisson) * volumes).sum())

    def kinetic_energy(self) -> float:
        """Of the owned nodes [J]. Rank-local."""
        n = self.domain.n_owned
        return 0.5 * float(np.repeat(self.mass[:n], 3) @ self.v[: 3 * n] ** 2)

    def stiffness_times(self, direction: np.ndarray) -> np.ndarray:
        """Elastic stiffness (with hourglass stiffness, on the present geometry) times a nodal vector (3 n_nodes,). Collective."""
        out, t, b = self.domain.nodal_vector(), self.table, self.finite
        rows = t.rows.copy()
        rows[:, 4:6] = 0.0
        scale = 1e-9
        state = np.zeros_like(b.state)
        state.reshape(b.entries.shape)[:, YIELD, :] = np.inf
        update_elements(self.x, direction, scale, b.nodes, b.filled, b.material_of, rows, t.curve_start, t.curve_strain, t.curve_stress, state, out, np.zeros(N_WORK * len(b.filled)))
        out /= -scale
        b = self.small
        if b.n_cells:
            small = self.domain.nodal_vector()
            update_elastic_elements(direction, direction, 0.0, b.nodes, b.filled, b.material_of, rows, self.geometry, b.state.copy(), small)
            out -= small
        self.domain.sum_to_owner(out)
        return out

    def inverted_fault(self) -> str | None:
        """A sentence on the elements that are inside out now, or None. Rank-local."""
        return self._inverted_fault(element_volumes(self.x, self.domain.cells))


def element_volumes(x: np.ndarray, cells: np.ndarray) -> np.ndarray:
    """Exact volumes (m,) [m3] of trilinear hexahedra, coordinates x (3 n,), cells (m, 8) in VTK order."""
    blocks = ElementBlocks(cells, np.zeros(len(cells), int), material_table([Steel(1.0, 0.0, 1.0)], ElementSettings()))
    kept, _ = fixed_geometry(x, blocks.nodes, blocks.filled, blocks.material_of, np.zeros((1, 7)))
    volumes = np.empty(len(cells))
    real = blocks.cell_of >= 0
    volumes[blocks.cell_of[real]] = kept.reshape(-1, 35, LANES)[:, 30, :].ravel()[real]
    return volumes
