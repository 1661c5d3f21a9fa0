"""Elements of a rank sorted into blocks of one material, the material table, and what is read out of the blocks."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np

from rail_fem.fe.plan.mass_scaling import CUBE
from rail_fem.fe.plasticity import MaterialTable
from rail_fem.fe.state import (
    CYCLIC,
    ISOTROPIC,
    KINEMATIC,
    LANES,
    N_MATERIAL,
    N_STATE,
    PLASTIC_STRAIN,
    POINT_STATE,
    STRESS,
    YIELD,
)
from rail_fem.scene.steel import Steel

AT_A_TIME = 64  # blocks that are read or written at a time: copies of all would be peaks of memory


@dataclass(frozen=True)
class ElementSettings:
    """Numerics of the element: "one-point" with hourglass control or "full", of eight points; hourglass stiffness as a
    fraction of 3.5 shear moduli, bulk viscosity coefficients [1].

    3.5 shear moduli are lame + 2 shear at a Poisson's ratio of 0.3. That modulus itself would make the hourglass modes
    of a nearly incompressible body as stiff as its volume, and lock it in bending (tests/fe/test_locking.py).
    """

    element: Literal["one-point", "full"] = "one-point"
    hourglass: float = 0.06
    linear_viscosity: float = 0.06
    quadratic_viscosity: float = 1.2


def material_table(steels: list[Steel], settings: ElementSettings, least_step: float = 0.0) -> MaterialTable:
    """One row for each steel; an elastic steel gets an infinite yield stress.

    least_step : critical step that small elements are made heavy for [s] (Structure). The bulk viscosity of such an
        element, with its own density and wave speed, is that of a cube of steel with this step.
    """
    rows, strain, stress, start, backs = np.zeros((len(steels), N_MATERIAL)), [], [], [0], []
    for i, steel in enumerate(steels):
        shear = steel.youngs_modulus / (2 * (1 + steel.poisson))
        lame = 2 * shear * steel.poisson / (1 - 2 * steel.poisson)
        wave = lame + 2 * shear
        law = steel.cyclic
        kind = CYCLIC if law is not None else KINEMATIC if steel.hardening == "kinematic" else ISOTROPIC
        rows[i] = (
            lame,
            shear,
            steel.density,
            np.sqrt(wave / steel.density),
            settings.linear_viscosity,
            settings.quadratic_viscosity,
            settings.hourglass * 3.5 * shear,
            kind,
            np.sqrt(wave / steel.density) * least_step / CUBE,
            *((0.0, 0.0, 0.0) if law is None else (law.yield_stress, law.hardening, law.hardening_rate)),
        )
        own = np.zeros((3, int(kind == KINEMATIC))) if law is None else (law.modulus, law.recovery, law.mixing)
        backs.append(np.reshape(own, (3, -1)))
        strain.append([0.0] if steel.is_elastic else steel.hardening_strain)
        stress.append([np.inf] if steel.is_elastic else steel.hardening_stress)
        start.append(start[-1] + len(strain[-1]))
    ends = np.cumsum([0, *(own.shape[1] for own in backs)])
    curves = np.array(start, np.int64), np.concatenate(strain), np.concatenate(stress)
    return MaterialTable(rows, *curves, ends, *np.hstack(backs).astype(float))


class BlockViews(NamedTuple):
    """Views of a run of blocks: nodes, lanes filled, material of each block, state, back stress."""

    nodes: np.ndarray
    filled: np.ndarray
    material_of: np.ndarray
    state: np.ndarray
    back: np.ndarray


class ElementBlocks:
    """Blocks of LANES elements.

    cells : (m, 8) local nodes, VTK order;  material : (m,) row of the table;
    cell_of : (n_blocks*LANES,) index into `cells`, -1 in padding
    slab : (m,) slab of each cell, or None: all in one; slab_of : (n_blocks,) a block holds cells of one slab, and
        blocks of a material stand in the order of their slabs
    nodes, filled, material_of, state, back : as `hexahedron.update_elements` wants them; no state is kept when
        `stateless`. Rank-local.
    """

    def __init__(
        self,
        cells: np.ndarray,
        material: np.ndarray,
        table: MaterialTable,
        stateless: bool = False,
        points: int = 1,
        slab: np.ndarray | None = None,
    ):
        order, filled, kinds = [], [], []
        slab = np.zeros(len(material), np.int64) if slab is None else slab
        alike = np.lexsort((slab, material))
        changes = np.flatnonzero(np.diff(material[alike]) | np.diff(slab[alike])) + 1
        for mine in np.split(alike, changes) if len(alike) else ():
            for first in range(0, len(mine), LANES):
                lanes = mine[first : first + LANES]
                filled.append(len(lanes))
                kinds.append((material[mine[0]], slab[mine[0]]))
                order.append(np.concatenate([lanes, np.full(LANES - len(lanes), -1)]))
        self.filled = np.array(filled, np.int64)
        self.material_of, self.slab_of = (np.array([k[c] for k in kinds], np.int64) for c in (0, 1))
        self.cell_of = (np.concatenate(order) if order else np.empty(0)).astype(np.int32)
        self.n_cells = len(cells)
        padded = self.cell_of.reshape(-1, LANES).copy()
        if len(order):
            # padding repeats an element of the block: finite numbers, never scattered
            padded = np.where(padded < 0, padded[:, :1], padded)
        self.nodes = np.ascontiguousarray(cells[padded].transpose(0, 2, 1), dtype=np.uint32).ravel()
        self.points, self.rows = points, N_STATE if points == 1 else points * POINT_STATE
        self.state = np.zeros(0 if stateless else len(order) * self.rows * LANES)
        self.entries = self.state.reshape(-1, self.rows, LANES)
        self.back_rows = 6 * points * table.back_stresses
        self.back = np.zeros(self.state.size // self.rows * self.back_rows)
        if not stateless:
            first = table.curve_stress[table.curve_start[self.material_of]]
            for point in range(points):
                self.entries[:, point * POINT_STATE + YIELD, :] = first[:, None]

    def unstressed(self, n_blocks: int) -> np.ndarray:
        """State of that many blocks without stress that never yield (n_blocks, rows, LANES)."""
        state = np.zeros((n_blocks, self.rows, LANES))
        state[:, [point * POINT_STATE + YIELD for point in range(self.points)], :] = np.inf
        return state

    def part(self, first: int, last: int) -> BlockViews:
        """Views of the blocks first..last-1."""
        return BlockViews(
            self.nodes[8 * LANES * first : 8 * LANES * last],
            self.filled[first:last],
            self.material_of[first:last],
            self.state[self.rows * LANES * first : self.rows * LANES * last],
            self.back[self.back_rows * LANES * first : self.back_rows * LANES * last],
        )

    def in_cells(self, entries: np.ndarray) -> np.ndarray:
        """Entries (n_blocks, count, LANES) of blocks -> rows (m, count) in the order of `cells`."""
        out = np.empty((self.n_cells, entries.shape[1]))
        for first in range(0, len(entries), AT_A_TIME):
            part = entries[first : first + AT_A_TIME].transpose(0, 2, 1).reshape(-1, entries.shape[1])
            cell = self.cell_of[LANES * first :][: len(part)]
            out[cell[cell >= 0]] = part[cell >= 0]
        return out

    def in_blocks(self, rows: np.ndarray) -> np.ndarray:
        """The reverse: rows (m, count) -> (n_blocks, count, LANES), 0 in padding."""
        flat = np.zeros((len(self.cell_of), rows.shape[1]))
        real = self.cell_of >= 0
        flat[real] = rows[self.cell_of[real]]
        return np.ascontiguousarray(flat.reshape(-1, LANES, rows.shape[1]).transpose(0, 2, 1))

    def read(self, first: int, count: int) -> np.ndarray:
        """Entries first..first+count-1 of the state of each cell (m, count), in the order of `cells`."""
        return self.in_cells(self.entries[:, first : first + count, :])

    def mean(self, first: int, count: int) -> np.ndarray:
        """The same of the mean over each cell's points, of which each stands for an eighth of the reference cube."""
        return sum(self.read(point * POINT_STATE + first, count) for point in range(self.points)) / self.points

    def stress(self) -> np.ndarray:
        """Cauchy stress (m, 6), order VOIGT, mean over each cell [Pa]."""
        return self.mean(STRESS, 6)

    def plastic_strain(self) -> np.ndarray:
        """Cumulated equivalent plastic strain, PEEQ (m,), mean over each cell."""
        return self.mean(PLASTIC_STRAIN, 1)[:, 0]
