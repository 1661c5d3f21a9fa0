"""Meshes of other programs (Abaqus .inp, VTK .vtu, MED, XDMF) by meshio, with what each of them calls a group.

A group of volumes or faces is a set of cells of its name (Abaqus), a family (MED), or an array of its name at the cells
that is not 0 in it (.vtu, .xdmf). A group of faces may also be a set of nodes, or such an array at the nodes: it holds
the outer faces that have all their nodes in it.
"""

import contextlib
import io
from pathlib import Path
from typing import Any

import numpy as np

from geometry.meshing.hexmesh import MeshError, boundary_faces
from geometry.meshing.vtu_file import read_vtu

SUFFIXES = (".inp", ".vtu", ".med", ".xdmf")
HEXAHEDRON, QUADRILATERAL = "hexahedron", "quad"
FLAT = ("vertex", "line", "triangle", QUADRILATERAL)  # cells without volume; triangles bound no hexahedron
TAGS = "cell_tags", "point_tags"  # of MED's families
LINEAR_TETRAHEDRON = "tetra"
Group = tuple[str, np.ndarray]  # name, and nodes (m, 8) or (m, 4) of its hexahedra or quadrilaterals


def read_by_meshio(path: Path, refused: dict[str, str]) -> tuple[np.ndarray, list[Group], list[Group], int]:
    """Points (n, 3), groups of hexahedra and of quadrilaterals, and the number of all hexahedra.

    refused : why a kind of cell is not taken, by meshio's name, "" for all others
    Errors: MeshError.
    """
    try:
        import meshio
    except ImportError:
        raise MeshError(f"{path}: meshio reads such files and is not installed; give a .msh of Gmsh") from None
    try:
        with contextlib.redirect_stdout(io.StringIO()):  # it prints what it raises
            mesh = read_vtu(path) if path.suffix.lower() == ".vtu" else meshio.read(path)
    except MeshError:
        raise
    except (Exception, SystemExit) as error:  # whatever its readers die of
        words = " ".join(str(error).split()) or type(error).__name__
        raise MeshError(f"{path}: meshio cannot read it ({words})") from None
    blocks = [(block.type, np.asarray(block.data, np.int64)) for block in mesh.cells]
    for kind, cells in blocks:
        if kind not in (HEXAHEDRON, *FLAT) and len(cells):
            why = refused.get(kind, refused[""])
            raise MeshError(f"{path}: holds {len(cells)} cells of type {kind}: {why}. Give 8-node hexahedra alone")
    points = np.asarray(mesh.points, float)
    if points.ndim != 2 or points.shape[1] != 3 or not len(points):
        raise MeshError(f"{path}: holds no nodes in three dimensions")
    hexahedra = [np.empty((0, 8), np.int64), *(cells for kind, cells in blocks if kind == HEXAHEDRON)]
    groups = _cell_groups(mesh, len(blocks))
    volumes, faces = (_of_kind(groups, blocks, *of) for of in ((HEXAHEDRON, 8), (QUADRILATERAL, 4)))
    cells = np.vstack(hexahedra)
    named = _node_groups(mesh)
    if named and len(cells):
        outer, _ = boundary_faces(cells)
        for name, inside in named.items():
            faces.append((name, outer[inside[outer].all(axis=1)]))
    return points, volumes, faces, len(cells)


def _cell_groups(mesh: Any, count: int) -> dict[str, list[np.ndarray]]:
    """Name -> for each of `count` blocks which cells (m,) belong to it."""
    sizes = [len(block.data) for block in mesh.cells]
    found: dict[str, list[np.ndarray]] = {}
    members = lambda name: found.setdefault(name, [np.zeros(size, bool) for size in sizes])
    for name, blocks in mesh.cell_sets.items():
        for k, cells in enumerate(blocks[:count]):
            if cells is not None and len(cells):
                members(name)[k][np.asarray(cells, np.int64)] = True
    families = getattr(mesh, TAGS[0], {})
    for name, blocks in mesh.cell_data.items():
        for k, values in enumerate(np.asarray(block) for block in blocks):
            if name == TAGS[0]:
                for tag, names in families.items():
                    for own in names:
                        members(own)[k] |= values == tag
            elif values.ndim == 1 and np.issubdtype(values.dtype, np.number):
                members(name)[k] |= values != 0
    return found


def _node_groups(mesh: Any) -> dict[str, np.ndarray]:
    """Name -> which nodes (n,) belong to it."""
    found: dict[str, np.ndarray] = {}
    members = lambda name: found.setdefault(name, np.zeros(len(mesh.points), bool))
    for name, nodes in mesh.point_sets.items():
        members(name)[np.asarray(nodes, np.int64)] = True
    families = getattr(mesh, TAGS[1], {})
    for name, values in mesh.point_data.items():
        if name == TAGS[1]:
            for tag, names in families.items():
                for own in names:
                    members(own)[np.asarray(values) == tag] = True
        elif np.ndim(values) == 1 and np.issubdtype(np.asarray(values).dtype, np.number):
            members(name)[np.asarray(values) != 0] = True
    return found


def _of_kind(groups: dict[str, list[np.ndarray]], blocks: list, kind: str, corners: int) -> list[Group]:
    """The groups that hold cells of a kind."""
    found = []
    for name, members in groups.items():
        own = [cells[inside] for (of, cells), inside in zip(blocks, members) if of == kind and inside.any()]
        if own:
            found.append((name, np.vstack([np.empty((0, corners), np.int64), *own])))
    return found
