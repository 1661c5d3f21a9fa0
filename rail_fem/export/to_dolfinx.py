"""From a run folder to dolfinx: mesh, tags of bodies and faces, and Functions, ready for one's own UFL forms; and into
the files that dolfinx and ParaView read: XDMF with tags, VTX where dolfinx has ADIOS2."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from mpi4py import MPI

from geometry.axes import as_tensor
from geometry.meshing.hexmesh import find_rows
from rail_fem.export.files import ExportError
from rail_fem.export.tagged import CELL_TAGS, FACET_TAGS, TaggedFields
from rail_fem.fe.compat import (
    cell_dofs,
    create_shared_mesh,
    discontinuous,
    dmesh,
    facet_nodes,
    fem,
    geometry_dofmap,
    io,
    lagrange_vectors,
    original_cells,
    vtx_writer,
    write_tags,
)
from rail_fem.fe.domain import VTK_TO_DOLFINX


@dataclass(frozen=True)
class DolfinxFields:
    """Fields of a run at one moment as dolfinx knows them [SI].

    mesh : hexahedra, ghost cells across shared facets;  cell_tags, facet_tags : MeshTags, numbers in CELL_TAGS and
        FACET_TAGS of rail_fem.export.tagged, e.g. 2 nose, 12 nose contact, 22 nose base
    displacement : Function, continuous vectors of degree 1 [m]
    stress : Function, a symmetric 3x3 tensor in each cell, Cauchy's [Pa];  plastic_strain : Function, a number in each
        cell, PEEQ
    time : [s];  source : name of the file
    """

    mesh: Any
    cell_tags: Any
    facet_tags: Any
    displacement: Any
    stress: Any
    plastic_strain: Any
    time: float
    source: str

    def cell(self, body: str) -> int:
        """Number of a body among the cell tags: wing, nose, wheel. Errors: KeyError."""
        return CELL_TAGS[body]

    def facet(self, name: str) -> int:
        """Number of a surface among the facet tags, e.g. "nose contact", "wing base". Errors: KeyError."""
        return FACET_TAGS[name]


def to_dolfinx(run: TaggedFields, comm: MPI.Comm, deformed: bool) -> DolfinxFields:
    """Tagged fields, which every rank holds, on the ranks of `comm`. Collective."""
    fields = run.fields
    points = fields.points + fields.displacement if deformed else fields.points
    if comm.rank == 0:
        cells, points = fields.cells[:, VTK_TO_DOLFINX].astype(np.int64), np.ascontiguousarray(points)
    else:
        cells, points = np.empty((0, 8), np.int64), np.empty((0, 3))
    mesh = create_shared_mesh(comm, cells, points)
    owned = mesh.topology.index_map(3).size_local
    source = original_cells(mesh)[:owned]
    cell_tags = dmesh.meshtags(mesh, 3, np.arange(owned, dtype=np.int32), run.cell_tags[source])
    facet_tags = tag_facets(mesh, run.facets, run.facet_tags)
    cell_tags.name, facet_tags.name = "bodies", "surfaces"
    return DolfinxFields(
        mesh,
        cell_tags,
        facet_tags,
        displacement_function(mesh, fields.displacement),
        cell_function(mesh, source, as_tensor(fields.stress), "stress"),
        cell_function(mesh, source, fields.plastic_strain, "plastic_strain"),
        fields.time,
        fields.source,
    )


def tag_facets(mesh, facets: np.ndarray, tags: np.ndarray):
    """MeshTags of the outer faces whose corners are `facets` (k, 4), nodes of the mesh's input. Collective."""
    mesh.topology.create_entities(2)
    mesh.topology.create_connectivity(2, 3)
    outer = np.sort(dmesh.exterior_facet_indices(mesh.topology)).astype(np.int32)
    corners = np.asarray(mesh.geometry.input_global_indices)[facet_nodes(mesh, outer)].astype(np.int64)
    row = find_rows(corners, facets)
    return dmesh.meshtags(mesh, 2, outer[row >= 0], tags[row[row >= 0]])


def displacement_function(mesh, values: np.ndarray):
    """A continuous vector Function of degree 1 from values (n, 3) at the nodes of the mesh's input. Collective."""
    function = fem.Function(lagrange_vectors(mesh, 1), name="displacement")
    dofs, nodes = cell_dofs(function.function_space).ravel(), geometry_dofmap(mesh).ravel()
    source = np.asarray(mesh.geometry.input_global_indices)[nodes]
    function.x.array.reshape(-1, 3)[dofs] = values[source]
    return function


def cell_function(mesh, source: np.ndarray, values: np.ndarray, name: str):
    """A Function that is constant in each cell, from values (m, ...) of the input's cells; source (m_owned,) their
    index of each owned cell. Collective."""
    function = fem.Function(discontinuous(mesh, 0, values.shape[1:]), name=name)
    dofs = cell_dofs(function.function_space)[: len(source), 0]
    function.x.array.reshape(-1, int(np.prod(values.shape[1:])))[dofs] = values[source].reshape(len(source), -1)
    function.x.scatter_forward()
    return function


def write_by_dolfinx(path: Path, fields: DolfinxFields) -> list[Path]:
    """Write the fields in the format of the suffix, .xdmf or .bp; what was written. Collective.

    .xdmf (with a .h5 beside it): mesh, tags and all three Functions; `XDMFFile.read_mesh` and `read_meshtags` read mesh
        and tags back
    .bp: displacement; beside it NAME_plastic_strain.bp and NAME_stress.bp, discontinuous Functions of degree 1, equal
        at the corners of a cell: VTX takes none of degree 0 in dolfinx 0.9, and one element a file
    Errors: ExportError where dolfinx was built without ADIOS2, or HDF5 cannot write.
    """
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    return _write_xdmf(path, fields) if path.suffix == ".xdmf" else _write_vtx(path, fields)


def _write_xdmf(path: Path, fields: DolfinxFields) -> list[Path]:
    try:
        with io.XDMFFile(fields.mesh.comm, str(path), "w") as file:
            file.write_mesh(fields.mesh)
            write_tags(file, fields.mesh, fields.cell_tags)
            write_tags(file, fields.mesh, fields.facet_tags)
            for function in (fields.displacement, fields.plastic_strain, fields.stress):
                file.write_function(function, fields.time)
    except RuntimeError as error:  # HDF5's, of a disk that is full or read-only
        raise ExportError(f"--to {path}: cannot be written: {str(error).strip()}") from error
    return [path, path.with_suffix(".h5")]


def _write_vtx(path: Path, fields: DolfinxFields) -> list[Path]:
    writer = vtx_writer()
    if writer is None:
        raise ExportError(f"--to {path}: this dolfinx was built without ADIOS2 and writes no .bp: use .xdmf or .vtu")
    written = {path: fields.displacement}
    for function in (fields.plastic_strain, fields.stress):
        raised = fem.Function(discontinuous(fields.mesh, 1, function.ufl_shape), name=function.name)
        raised.interpolate(function)
        written[path.with_name(f"{path.stem}_{function.name}.bp")] = raised
    for name, function in written.items():
        with writer(fields.mesh.comm, str(name), [function], engine="BP4") as file:
            file.write(fields.time)
    return list(written)
