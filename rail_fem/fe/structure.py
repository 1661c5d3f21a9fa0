"""Bodies ready to move: nodes with mass, position and velocity, and elements of both kernels on one distributed
mesh."""

from __future__ import annotations

import numpy as np

from geometry.meshing.cell_measures import eigen_length
from geometry.meshing.quality import over_cells
from rail_fem.fe.blocks import AT_A_TIME, ElementBlocks, ElementSettings, material_table
from rail_fem.fe.domain import Domain, raise_together
from rail_fem.fe.elastic import elastic_stress, fixed_geometry
from rail_fem.fe.hexahedron import stored_energy, update_elements, volumes
from rail_fem.fe.hexahedron_full import stored_energy_full, update_full_elements
from rail_fem.fe.rings import find_line_forces, find_rings, give_lines, take_energy
from rail_fem.fe.state import LANES, LAW, LINEAR_VISCOSITY, N_WORK, POINTS, QUADRATIC_VISCOSITY
from rail_fem.scene.steel import Steel


def cell_masses(points: np.ndarray, cells: np.ndarray, region: np.ndarray, steels: list[Steel], least_step: float):
    """Mass of each cell (m,) [kg]: of steel, and of those with a critical step below `least_step` [s] so much that
    they have it.

    points (n, 3) [m];  cells (m, 8);  region (m,) index into `steels`
    """
    mass = np.array([steel.density for steel in steels])[region] * volumes(points.ravel(), cells)
    return heavier(mass, critical_steps(points, cells, region, steels), least_step) if least_step > 0 else mass


def heavier(mass: np.ndarray, step: np.ndarray, least_step: float) -> np.ndarray:
    """Masses (m,) with which no cell has a critical step below `least_step` [s]; step : of each, of steel (m,) [s]."""
    return mass * np.maximum(1.0, least_step / step) ** 2


def critical_steps(points: np.ndarray, cells: np.ndarray, region: np.ndarray, steels: list[Steel]) -> np.ndarray:
    """2 / omega_max of each cell by itself, of steel (m,) [s]. Arguments as those of `cell_masses`."""
    speed = np.array([steel.wave_speed for steel in steels])[region]
    return over_cells(eigen_length, points, cells) / speed


class Structure:
    """Elements, masses and nodal state of a rank.

    steels : one for each region of the domain;  small : regions on the small-displacement elastic kernel (the others:
        finite strain, J2)
    damping : beta of the small-displacement kernel [s], set by Dynamics.stable_step
    least_step : elements whose own critical step is less are heavier than steel, each so that it has this step [s]
    slab : (m,) slab of each cell of the rank, where some of the body may be inactive (rail_fem.fe.window)
    axis : x and z of the line along y about which the small-displacement bodies are swept: their elements in rings
        (rail_fem.fe.rings) cost less

    Attributes (rank-local): x, v, force (3 n_nodes,);  anchor (3 n_nodes,) with slabs only: position relative to the
    rigid base of nodes outside the window;  mass (n_nodes,) of whole nodes also on ghosts;
    block_work (n_blocks, N_WORK) plastic, hourglass and viscous work of each finite-strain block so far [J];
    on_small (n_nodes,) int8: 1 on the small-displacement bodies;  works (3,) internal work of finite-strain and of
    small-displacement nodes, work of the mass damping so far [J].
    """

    STATE = ("damping",)
    SUMMED = ("works",)  # each rank's part of a sum
    NODAL: tuple[str, ...] = (
        "x",
        "v",
        "force",
    )  # (3 n_nodes,), and the elements' state and works: rail_fem.fe.checkpoint
    SCRATCH = ("smallest_volume",)

    def __init__(
        self,
        domain: Domain,
        steels: list[Steel],
        small: tuple[int, ...] = (),
        settings: ElementSettings = ElementSettings(),
        slab: np.ndarray | None = None,
        least_step: float = 0.0,
        axis: tuple[float, float] = (0.0, 0.0),
    ):
        self.domain, self.settings, self.steels, self.least_step = domain, settings, steels, least_step
        self.table = material_table(steels, settings, least_step)
        is_small = np.isin(domain.region, small)
        self.finite_cells, self.small_cells = (np.flatnonzero(f).astype(np.int32) for f in (~is_small, is_small))
        full = settings.element == "full"
        self.update_elements = update_full_elements if full else update_elements
        self.stored_energy = stored_energy_full if full else stored_energy
        self.finite = ElementBlocks(
            domain.cells[self.finite_cells],
            domain.region[self.finite_cells],
            self.table,
            points=POINTS if full else 1,
            slab=None if slab is None else slab[self.finite_cells],
        )
        cells, region = domain.cells[self.small_cells], domain.region[self.small_cells]
        self.rings, in_ring = find_rings(domain.reference.reshape(-1, 3), cells, region, self.table.rows, axis)
        beside = ElementBlocks(cells[~in_ring], region[~in_ring], self.table, stateless=True)
        self.small = ElementBlocks(self.rings.outside, region[~in_ring], self.table, stateless=True)
        self.x, self.v, self.force = domain.reference.copy(), domain.nodal_vector(), domain.nodal_vector()
        if slab is not None:
            self.anchor = domain.reference.copy()
            self.NODAL = (*self.NODAL, "anchor")
        self.geometry, smallest = fixed_geometry(
            domain.reference, beside.nodes, beside.filled, beside.material_of, self.table.rows
        )
        self.damping = 0.0
        self.block_work, self.works = np.zeros((len(self.finite.filled), N_WORK)), np.zeros(3)
        self.compute([(0, len(self.finite.filled))])
        self.on_small = np.zeros(domain.n_nodes, np.int8)
        self.on_small[domain.cells[self.small_cells].ravel()] = 1
        self.smallest_volume = smallest
        raise_together(domain.comm, self._inversion_message(volumes(domain.reference, domain.cells)))
        self.mass = self.lumped_mass()

    def compute(self, active: list[tuple[int, int]]) -> None:
        """From now on a step computes these ranges of the finite-strain blocks. Rank-local."""
        self.active = active
        self.blocks = np.concatenate([np.empty(0, np.int64), *(np.arange(*blocks) for blocks in active)])

    @property
    def work(self) -> np.ndarray:
        """Plastic, hourglass and viscous work of all finite-strain elements so far (N_WORK,) [J]. Rank-local."""
        return self.block_work.sum(axis=0)

    def _inversion_message(self, volumes: np.ndarray) -> str | None:
        bad = np.flatnonzero(~(volumes > 0))
        if not len(bad):
            return None
        at = 1e3 * self.domain.reference.reshape(-1, 3)[self.domain.cells[bad[0]]].mean(axis=0)
        return (
            f"{len(bad)} element(s) turned inside out, the first is element {self.domain.cell_input[bad[0]]} at "
            f"({at[0]:.2f}, {at[1]:.2f}, {at[2]:.2f}) mm, volume {volumes[bad[0]] * 1e9:.3g} mm3: repair the mesh there"
        )

    def _cell_mass(self) -> np.ndarray:
        """(m,) [kg]. Rank-local."""
        return cell_masses(
            self.domain.reference.reshape(-1, 3), self.domain.cells, self.domain.region, self.steels, self.least_step
        )

    def region_masses(self) -> np.ndarray:
        """Mass of each region, in the order of the steels [kg]; replicated. Collective."""
        return self.domain.comm.allreduce(
            np.bincount(self.domain.region, self._cell_mass(), minlength=len(self.steels))
        )

    def lumped_mass(self, factor: np.ndarray | float = 1.0) -> np.ndarray:
        """Masses of the nodes (n_nodes,) [kg], those of the cells times `factor` (m,). Collective."""
        vector = self.domain.nodal_vector()
        share = np.repeat(factor * self._cell_mass() / 8, 8)
        np.add.at(vector, 3 * self.domain.cells.ravel(), share)
        self.domain.sum_up(vector)
        return vector[::3].copy()

    def add_internal_force(self, dt: float, blocks: np.ndarray | None = None) -> None:
        """Minus the internal force at the present x and v, added to `force` of owned and ghost nodes; updates stresses.
        blocks : (k,) of the finite-strain ones, None: all that a step computes. Rank-local."""
        self.add_finite_force(dt, self.blocks if blocks is None else blocks)
        self._add_small_force(self.x, self.domain.reference, self.v, self.damping, self.force)

    def add_finite_force(self, dt: float, blocks: np.ndarray) -> None:
        """The part of these finite-strain blocks (k,); `smallest_volume` of them and of those before. Rank-local."""
        b, work = self.finite, self.block_work.reshape(-1)
        own = blocks, b.nodes, b.filled, b.material_of, self.table, b.state, b.back
        smallest = self.update_elements(self.x, self.v, dt, *own, self.force, work)
        if smallest < self.smallest_volume or smallest != smallest:  # keeps what is not a number
            self.smallest_volume = smallest

    def _add_small_force(
        self, x: np.ndarray, reference: np.ndarray, v: np.ndarray, damping: float, force: np.ndarray
    ) -> None:
        """Minus the internal force of the small-displacement elements at x - reference + damping v, added to `force`.
        Rank-local."""
        if len(self.small_cells):
            self._find_line_forces(x, reference, v, damping)
            give_lines(self.rings, force)

    def _find_line_forces(self, x: np.ndarray, reference: np.ndarray, v: np.ndarray, damping: float) -> None:
        b = self.small
        own = b.nodes, b.filled, b.material_of, self.table.rows, self.geometry
        find_line_forces(x, reference, v, damping, self.rings, *own)

    def count_active(self) -> int:
        """Cells that a step computes, of all ranks. Collective."""
        finite = sum(int(self.finite.filled[first:last].sum()) for first, last in self.active)
        return int(self.domain.comm.allreduce(finite + len(self.small_cells)))

    def elastic_energy(self) -> tuple[float, float]:
        """Elastic energy of the active finite-strain and of the small-displacement elements [J]. Rank-local."""
        finite = sum(self.energy_of_blocks(*blocks) for blocks in self.active)
        self._find_line_forces(self.x, self.domain.reference, self.v, 0.0)
        return finite, take_energy(self.rings)

    def energy_of_blocks(self, first: int, last: int) -> float:
        """Elastic energy of the finite-strain blocks first..last-1 [J]. Rank-local."""
        part = self.finite.part(first, last)
        return self.stored_energy(self.x, part.nodes, part.filled, part.material_of, self.table.rows, part.state)

    def small_stress(self) -> np.ndarray:
        """Stress of the small-displacement elements (m, 6), order VOIGT [Pa], without damping. Rank-local."""
        out, reference = np.empty((len(self.small_cells), 6)), self.domain.reference
        moved = self.x - reference
        for first in range(0, len(out), LANES * AT_A_TIME):
            part = self.small_cells[first : first + LANES * AT_A_TIME]
            b = ElementBlocks(self.domain.cells[part], self.domain.region[part], self.table, stateless=True)
            blocks = b.nodes, b.filled, b.material_of, self.table.rows
            stress = elastic_stress(moved, *blocks, fixed_geometry(reference, *blocks)[0])
            out[first : first + len(part)] = b.in_cells(stress)
        return out

    def kinetic_energy(self) -> float:
        """Of the owned nodes [J]. Rank-local."""
        n = self.domain.n_owned
        return 0.5 * float(np.repeat(self.mass[:n], 3) @ self.v[: 3 * n] ** 2)

    def stiffness_times(self, direction: np.ndarray) -> np.ndarray:
        """Elastic stiffness (with hourglass stiffness, on the present geometry) times a nodal vector (3 n_nodes,).
        Collective."""
        out, b = self.domain.nodal_vector(), self.finite
        rows, scale = self.table.rows.copy(), 1e-9
        rows[:, [LINEAR_VISCOSITY, QUADRATIC_VISCOSITY, LAW]] = 0.0
        for first in range(0, len(b.filled), AT_A_TIME):
            part = slice(first, first + AT_A_TIME)
            filled = b.filled[part]
            state = b.unstressed(len(filled))
            nodes, work = b.nodes.reshape(-1, 8 * LANES)[part].ravel(), np.zeros(N_WORK * len(filled))
            own = filled, b.material_of[part], self.table._replace(rows=rows), state.ravel(), np.empty(0), out, work
            self.update_elements(self.x, direction, scale, np.arange(len(filled)), nodes, *own)
        out /= scale
        self._add_small_force(direction, self.domain.nodal_vector(), direction, 0.0, out)
        np.negative(out, out=out)
        self.domain.sum_up(out)
        return out

    def inversion_message(self) -> str | None:
        """A sentence on the elements that are inside out now, or None. Rank-local."""
        return self._inversion_message(volumes(self.x, self.domain.cells))
