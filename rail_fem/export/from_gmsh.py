"""Meshes of Gmsh into dolfinx (dolfinx.io.gmshio), and hexahedra of dolfinx into the explicit solver."""

from __future__ import annotations

import contextlib
from pathlib import Path
from typing import Any

import numpy as np
from mpi4py import MPI

from geometry.meshing.hexmesh import HexMesh, MeshError, orient
from rail_fem.fe.compat import facet_nodes, geometry_dofmap, gmsh_mesh
from rail_fem.fe.domain import VTK_TO_DOLFINX


@contextlib.contextmanager
def opened(path: Path, comm: MPI.Comm):
    """The model of a Gmsh file (.msh, .geo) on root, None on the others. Errors: MeshError on every rank."""
    fault = None
    if comm.rank == 0:
        import gmsh

        gmsh.initialize(interruptible=False)
        gmsh.option.setNumber("General.Terminal", 0)
        try:
            gmsh.open(str(path))
        except Exception as error:  # gmsh raises plain Exceptions
            fault = f"{path}: Gmsh cannot open it ({error})"
            gmsh.finalize()
    fault = comm.bcast(fault, root=0)
    if fault:
        raise MeshError(fault)
    try:
        yield gmsh.model if comm.rank == 0 else None
    finally:
        if comm.rank == 0:
            gmsh.finalize()


def read_gmsh(path: Path | str, comm: MPI.Comm = MPI.COMM_WORLD) -> tuple[Any, Any, Any]:
    """Mesh, cell tags and facet tags of a Gmsh file through dolfinx.io.gmshio; its physical groups are the tags.
    Collective. Errors: MeshError."""
    with opened(Path(path), comm) as model:
        return gmsh_mesh(model, comm)


def hex_mesh(mesh, cell_tags, names: tuple[str, ...], facet_tags=None, contact=(), base=()) -> HexMesh:
    """Hexahedra of dolfinx on one rank as the explicit solver takes them.

    cell_tags : MeshTags of all cells, the bodies counted 1, 2, ... in the order of `names`
    facet_tags : MeshTags of faces;  contact, base : the tags that are the contact surfaces and the held faces
    Errors: MeshError for other cells than hexahedra of degree 1, several ranks, or tags that are no body's.
    """
    if mesh.comm.size > 1:
        raise MeshError(f"the mesh lies on {mesh.comm.size} ranks: read it on MPI.COMM_SELF, the solver distributes it")
    cell = str(mesh.topology.cell_type).lower()
    dofs = mesh.geometry.dofmap
    if "hexahedron" not in cell or np.asarray(getattr(dofs, "array", dofs)).size != 8 * len(cell_tags.values):
        raise MeshError(f"cells are {cell}, or not all tagged: the explicit solver takes 8-node hexahedra alone")
    region = np.empty(len(cell_tags.values), np.int64)
    region[cell_tags.indices] = cell_tags.values - 1
    if region.min() < 0 or region.max() >= len(names):
        raise MeshError(f"cell tags {np.unique(region + 1).tolist()}: want 1 to {len(names)}, for {', '.join(names)}")
    points = np.array(mesh.geometry.x)
    cells = orient(points, geometry_dofmap(mesh)[:, VTK_TO_DOLFINX].astype(np.int64))
    faces, values = _outward_faces(mesh, points, facet_tags)
    is_contact, is_base = np.isin(values, list(contact)), np.isin(values, list(base))
    body = np.zeros(len(points), np.int64)
    body[cells.ravel()] = np.repeat(region, 8)
    return HexMesh(
        points,
        cells,
        region.astype(np.int8),
        names,
        faces[is_contact],
        body[faces[is_contact][:, 0]].astype(np.int8),
        np.unique(faces[is_base]),
    )


def _outward_faces(mesh, points: np.ndarray, facet_tags) -> tuple[np.ndarray, np.ndarray]:
    """Tagged outer faces (k, 4), corners in turn with an outward normal, and their tags (k,)."""
    if facet_tags is None or not len(facet_tags.values):
        return np.empty((0, 4), np.int64), np.empty(0, np.int64)
    faces = facet_nodes(mesh, facet_tags.indices)[:, [0, 1, 3, 2]].astype(np.int64)
    mesh.topology.create_connectivity(2, 3)
    owner = np.array([mesh.topology.connectivity(2, 3).links(int(facet))[0] for facet in facet_tags.indices])
    inside = points[geometry_dofmap(mesh)[owner]].mean(axis=1)
    corner = points[faces]
    normal = np.cross(corner[:, 2] - corner[:, 0], corner[:, 3] - corner[:, 1])
    inward = ((corner.mean(axis=1) - inside) * normal).sum(axis=1) < 0
    faces[inward] = faces[inward][:, ::-1]
    return faces, np.asarray(facet_tags.values)
