"""From a run folder to dolfinx: mesh, tags of bodies and faces, and Functions, ready for one's own UFL forms."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from mpi4py import MPI

from geometry.axes import as_tensor
from rail_fem.export.tagged import CELL_TAGS, FACET_TAGS, TaggedFields, find_rows
from rail_fem.fe.compat import (
    cell_dofs,
    create_shared_mesh,
    discontinuous,
    dmesh,
    facet_nodes,
    fem,
    geometry_dofmap,
    lagrange_vectors,
    original_cells,
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
        nodal_function(mesh, fields.displacement, "displacement"),
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


def nodal_function(mesh, values: np.ndarray, name: str):
    """A continuous vector Function of degree 1 from values (n, 3) at the nodes of the mesh's input. Collective."""
    function = fem.Function(lagrange_vectors(mesh, 1), name=name)
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
