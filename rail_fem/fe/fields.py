"""Fields of a run as VTU files: plastic strain, von Mises stress, stress, region and displacement on the hexahedra.

All ranks write, each its block of the rows in the numbering of the input mesh (rail_fem.fe.global_rows): what a file
holds does not depend on the number of ranks, and none has more of the mesh than its share. A ParaView collection
(.pvd) lists the frames. Six components mean XX YY ZZ XY YZ XZ to VTK, which is not the order of geometry.axes: they are
written in VTK's, and named in the file.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from bem.exact.subsurface import von_mises
from geometry.surfaces.bodies import PassBody
from rail_fem.fe.domain import Domain
from rail_fem.fe.dynamics import Dynamics
from rail_fem.fe.global_rows import block_starts, to_blocks
from rail_fem.fe.shared_file import as_bytes, write_pieces
from rail_fem.files.atomic import write_text_atomically
from rail_fem.files.vtu_layout import HEXAHEDRON, VtuArray, compressed, lay_out
from rail_fem.result.fields import VTK_COMPONENTS, VTK_ORDER


def cell_rows(dynamics: Dynamics) -> np.ndarray:
    """Stress (6), plastic strain of the rank's cells (m_local, 7). Rank-local."""
    s, domain = dynamics.structure, dynamics.domain
    rows = np.zeros((len(domain.cells), 7))
    if s.finite.n_cells:
        rows[s.finite_cells] = np.column_stack([s.finite.stress(), s.finite.plastic_strain()])
    if len(s.small_cells):
        rows[s.small_cells, :6] = s.small_stress()
    return rows


def write_frame(path: Path, dynamics: Dynamics, wheel_offset: float, dtype: str = "f8") -> None:
    """One VTU file [SI]. wheel_offset : how far the wheel has moved along x [m];  dtype : of fields and points, "f4"
    takes half the time and size. Collective. Errors: ValueError on all ranks where it cannot be written."""
    domain, comm = dynamics.domain, dynamics.domain.comm
    dynamics.bring_up()
    if comm.rank == 0:
        path.parent.mkdir(parents=True, exist_ok=True)
    raised = 0.0 if dynamics.contact is None else dynamics.contact.search.raised
    blocks = _node_blocks(domain, dynamics.structure.x, wheel_offset, raised) + _cell_blocks(dynamics)
    blocks = [(column._replace(dtype=dtype if column.dtype == "f8" else column.dtype), rows) for column, rows in blocks]
    chunks = [compressed(column, rows) for column, rows in blocks]
    every = comm.allgather([[len(chunk) for chunk in mine] for mine in chunks])
    columns = [column for column, _ in blocks]
    sizes = [[size for told in every for size in told[k]] for k in range(len(columns))]
    layout = lay_out(columns, sizes, dynamics.time)
    pieces = []
    for k, mine in enumerate(chunks):
        before = sum(len(told[k]) for told in every[: comm.rank])
        if mine:
            pieces.append((int(layout.data[k][before]), as_bytes(b"".join(mine))))
    if comm.rank == 0:
        pieces += [(0, as_bytes(layout.head)), (layout.end, as_bytes(layout.tail))]
        pieces += [(at, as_bytes(header)) for at, header in layout.headers]
    write_pieces(comm, path, pieces)


def _node_blocks(
    domain: Domain, x: np.ndarray, wheel_offset: float, raised: float
) -> list[tuple[VtuArray, np.ndarray]]:
    """The arrays of the nodes, each with the rank's block of its rows. raised : of the rail's frame [m]. Collective."""
    owned, total = domain.n_owned, domain.n_global
    reference, now = (field.reshape(-1, 3)[:owned] for field in (domain.reference, x))
    placed = reference.copy()
    wheel = np.unique(domain.cells[domain.region == PassBody.WHEEL])
    placed[wheel[wheel < owned], 0] += wheel_offset
    moved = now - reference
    moved[np.setdiff1d(np.arange(owned), wheel), 2] += raised
    rows = np.concatenate([placed, moved], axis=1)
    rows = to_blocks(domain.comm, domain.node_input[:owned], rows, total)
    return [
        (VtuArray("Points", "Points", "f8", 3, total), rows[:, :3]),
        (VtuArray("PointData", "displacement", "f8", 3, total), rows[:, 3:]),
    ]


def _cell_blocks(dynamics: Dynamics) -> list[tuple[VtuArray, np.ndarray]]:
    """The arrays of the cells, each with the rank's block of its rows. Collective."""
    domain = dynamics.domain
    comm, total = domain.comm, domain.m_global
    corners = np.column_stack([domain.node_input[domain.cells], domain.region])
    corners = to_blocks(comm, domain.cell_input, corners, total)
    state = to_blocks(comm, domain.cell_input, cell_rows(dynamics), total)
    numbers = np.arange(*block_starts(total, comm.size)[comm.rank : comm.rank + 2])[:, None]
    return [
        (VtuArray("Cells", "connectivity", "i8", 8, total), corners[:, :8]),
        (VtuArray("Cells", "offsets", "i8", 1, total), 8 * (numbers + 1)),
        (VtuArray("Cells", "types", "u1", 1, total), np.full_like(numbers, HEXAHEDRON)),
        (VtuArray("CellData", "region", "i4", 1, total), corners[:, 8:]),
        (VtuArray("CellData", "plastic_strain", "f8", 1, total), state[:, 6:]),
        (VtuArray("CellData", "von_mises", "f8", 1, total), von_mises(state[:, :6])[:, None]),
        (VtuArray("CellData", "stress", "f8", 6, total, VTK_COMPONENTS), state[:, VTK_ORDER]),
    ]


def write_collection(path: Path, frames: list[list]) -> None:
    """The .pvd list of frames (time [s], file name). Root only."""
    rows = "\n".join(f'<DataSet timestep="{time:.9g}" file="{name}"/>' for time, name in frames)
    write_text_atomically(
        path,
        '<?xml version="1.0"?>\n<VTKFile type="Collection"'
        f' version="0.1">\n<Collection>\n{rows}\n</Collection>\n</VTKFile>\n',
    )
