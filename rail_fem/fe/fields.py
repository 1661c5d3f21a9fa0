"""Fields of a run as VTU files: plastic strain, von Mises stress, stress, region and displacement on the hexahedra.

Root gathers in the numbering of the input mesh and writes through meshio; a ParaView collection (.pvd) lists the
frames. Six components mean XX YY ZZ XY YZ XZ to VTK, which is not the order of geometry.axes: they are written in
VTK's, and named in the file.
"""

from __future__ import annotations

from pathlib import Path

import meshio
import numpy as np

from bem.exact.subsurface import von_mises
from geometry.meshing.hexmesh import HexMesh
from rail_fem.atomic import write_atomically, write_text_atomically
from rail_fem.fe.checkpoint import gather_nodes, gather_rows
from rail_fem.fe.dynamics import Dynamics
from rail_fem.output.fields import VTK_COMPONENTS, VTK_ORDER

TIME_VALUE = (
    '<FieldData><DataArray type="Float64" Name="TimeValue" NumberOfTuples="1"'
    ' format="ascii">{!r}</DataArray></FieldData>'
)


def gather_cells(dynamics: Dynamics) -> np.ndarray | None:
    """Stress (6), plastic strain of every cell (m_global, 7) in input order. Root only. Collective."""
    s, domain = dynamics.structure, dynamics.domain
    rows = np.zeros((len(domain.cells), 7))
    if s.finite.n_cells:
        rows[s.finite_cells] = np.column_stack([s.finite.stress(), s.finite.plastic_strain()])
    if s.small.n_cells:
        rows[s.small_cells, :6] = s.small_stress()
    return gather_rows(domain.comm, domain.cell_input, rows, domain.m_global)


def write_frame(path: Path, dynamics: Dynamics, mesh: HexMesh | None, wheel_offset: float) -> None:
    """One VTU file [SI]. mesh : the input mesh, root only. Collective. Errors: OSError on root."""
    domain = dynamics.domain
    dynamics.bring_up()
    state, x = gather_cells(dynamics), gather_nodes(domain, dynamics.structure.x)
    if mesh is None or state is None or x is None:
        return
    placed = mesh.points.copy()
    placed[np.unique(mesh.cells[mesh.region == 2]), 0] += wheel_offset
    frame = meshio.Mesh(
        placed,
        [("hexahedron", mesh.cells)],
        point_data={"displacement": x - mesh.points},
        cell_data={
            "region": [mesh.region.astype(np.int32)],
            "plastic_strain": [state[:, 6]],
            "von_mises": [von_mises(state[:, :6])],
            "stress": [state[:, VTK_ORDER]],
        },
    )
    path.parent.mkdir(parents=True, exist_ok=True)
    write_atomically(path, lambda temporary: _write_vtu(temporary, frame, dynamics.time))


def _write_vtu(path: Path, frame: meshio.Mesh, time: float) -> None:
    """The file by meshio, and what meshio does not write: names of the stress components, and the time [s]. (Texts it
    could not read back.)"""
    meshio.write(path, frame, file_format="vtu", compression="zlib")
    names = "".join(f' ComponentName{i}="{name}"' for i, name in enumerate(VTK_COMPONENTS))
    text = path.read_bytes()
    for mark, more in (('Name="stress"', names), ("<UnstructuredGrid>", TIME_VALUE.format(float(time)))):
        if text.count(mark.encode()) != 1:
            raise RuntimeError(
                f"{path}: meshio has written {mark} {text.count(mark.encode())} times, once was expected: this version"
                " of it is not known"
            )
        text = text.replace(mark.encode(), (mark + more).encode())
    path.write_bytes(text)


def write_collection(path: Path, frames: list[list]) -> None:
    """The .pvd list of frames (time [s], file name). Root only."""
    rows = "\n".join(f'<DataSet timestep="{time:.9g}" file="{name}"/>' for time, name in frames)
    write_text_atomically(
        path,
        '<?xml version="1.0"?>\n<VTKFile type="Collection"'
        f' version="0.1">\n<Collection>\n{rows}\n</Collection>\n</VTKFile>\n',
    )
