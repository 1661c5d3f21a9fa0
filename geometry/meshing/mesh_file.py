"""A user's own hexahedra from a file with groups, checked before anything is computed with them: .msh of Gmsh, or what
meshio reads (geometry.meshing.meshio_file).

Volumes: "wing", "nose" (one of them at least) and "wheel". Faces: "wing contact", "wing base" and so on, or "contact
surface" and "base" for all bodies. `rail-fem export RUN --to mesh.msh` writes such a file.
"""

import shutil
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from geometry.meshing.conforming import check_conforming, position
from geometry.meshing.gmsh_fill import gmsh_session
from geometry.meshing.gmsh_process import in_gmsh_process, reading
from geometry.meshing.hexmesh import HexMesh, MeshError, boundary_faces, find_rows
from geometry.meshing.meshio_file import LINEAR_TETRAHEDRON, SUFFIXES, Group, read_by_meshio
from geometry.meshing.quality import check_shapes
from geometry.profiles.formats.raw import LARGEST_MESH, open_file
from geometry.surfaces.bodies import CROSSING, REGIONS

CONTACT, BASE = ("contact surface", "contact"), ("base",)
FARTHEST_SURFACE = 250e-3  # of a crossing's contact surface from rail level, its sides down to the base [m]
HEXAHEDRON, QUADRILATERAL = 5, 3  # Gmsh's element types
MSH = (b"$MeshFormat", b"$Comments")  # whatever else a file begins with Gmsh runs as a script, which may call commands
LOCKING = "linear tetrahedra lock under plastic flow, which keeps its volume"
NO_KERNEL = "the element kernels are for 8-node hexahedra alone"


def read_mesh_file(path: Path, unit: float = 1.0) -> HexMesh:
    """The mesh of a .msh file or one of another program. unit : of its lengths [m]

    Errors: MeshError that says what is missing or wrong, where, and the remedy; OSError.
    """
    path = Path(path)
    if path.suffix.lower() not in (".msh", *SUFFIXES):
        raise MeshError(
            f'{path}: a mesh with groups is a .msh of Gmsh, or {", ".join(SUFFIXES)}; "{path.suffix}" is none'
        )
    with open_file(path, LARGEST_MESH, lambda why: MeshError(f"{path}: {why}")) as file, TemporaryDirectory() as alone:
        if path.suffix.lower() == ".msh":
            if not file.read(len(MSH[0])).startswith(MSH):
                raise MeshError(f"{path}: Gmsh cannot read it as a mesh: it does not begin with $MeshFormat")
            copy = Path(alone) / "mesh.msh"  # beside the user's file Gmsh would read options from FILE.opt
            file.seek(0)
            with copy.open("wb") as stream:
                shutil.copyfileobj(file, stream)
            found = in_gmsh_process(_read, str(path), str(copy))
        else:
            found = in_gmsh_process(_read_by_meshio, path)
    points, volumes, faces, count = found
    cells, region = _cells(path, volumes, count)
    used, cells = np.unique(cells, return_inverse=True)
    number = np.full(len(points), -1)
    number[used] = np.arange(len(used))
    sides = [(name, number[nodes]) for name, nodes in faces]
    return checked_mesh(str(path), np.ascontiguousarray(points[used] * unit), cells.reshape(-1, 8), region, sides)


def _read_by_meshio(path: Path) -> tuple[np.ndarray, list[Group], list[Group], int]:
    """In a process of its own, as `_read`: a file that takes for ever must not take this one with it."""
    with reading():
        return read_by_meshio(path, {LINEAR_TETRAHEDRON: LOCKING, "": NO_KERNEL})


def _read(path: str, copy: str) -> tuple[np.ndarray, list[Group], list[Group], int]:
    """In Gmsh's process: points (n, 3) by the file's numbers, groups of hexahedra and of quadrilaterals, and the
    number of all hexahedra. path : that errors name. Errors: MeshError."""
    with reading(), gmsh_session() as gmsh:
        try:
            gmsh.open(copy)
        except Exception as error:  # gmsh raises plain Exceptions
            raise MeshError(f"{path}: Gmsh cannot read it ({error})") from None
        mesh = gmsh.model.mesh
        tags, points, _ = mesh.getNodes()
        if not len(tags):
            raise MeshError(f"{path}: holds no mesh")
        order = np.argsort(tags)
        tags, points = tags[order], points.reshape(-1, 3)[order]
        kinds, elements, _ = mesh.getElements(3)
        for kind, found in zip(kinds, elements):
            if kind != HEXAHEDRON:
                name = mesh.getElementProperties(kind)[0]
                why = LOCKING if name.startswith("Tetrahedron 4") else NO_KERNEL
                raise MeshError(
                    f"{path}: holds {len(found)} cells of type {name}: {why}. Give 8-node hexahedra alone (in Gmsh:"
                    " transfinite or extruded volumes, recombined)"
                )
        volumes, faces = (_groups(gmsh, dim, kind, tags) for dim, kind in ((3, HEXAHEDRON), (2, QUADRILATERAL)))
        return points, volumes, faces, sum(map(len, elements))


def _groups(gmsh, dim: int, kind: int, tags: np.ndarray) -> list[Group]:
    """tags : of all nodes, ascending"""
    corners = 8 if dim == 3 else 4
    groups = []
    for _, tag in gmsh.model.getPhysicalGroups(dim):
        nodes = [np.empty((0, corners), np.int64)]
        for entity in gmsh.model.getEntitiesForPhysicalGroup(dim, tag):
            kinds, _, found = gmsh.model.mesh.getElements(dim, entity)
            nodes += [
                np.searchsorted(tags, of).reshape(-1, corners) for which, of in zip(kinds, found) if which == kind
            ]
        groups.append((gmsh.model.getPhysicalName(dim, tag), np.vstack(nodes)))
    return groups


def _cells(path: Path, volumes: list[Group], count: int) -> tuple[np.ndarray, np.ndarray]:
    """Cells (m, 8) and their numbers in REGIONS (m,)."""
    names = ", ".join(sorted(name or "unnamed" for name, _ in volumes)) or "none"
    known = [(REGIONS.index(name.lower()), nodes) for name, nodes in volumes if name.lower() in REGIONS]
    if count != sum(len(nodes) for _, nodes in known):
        loose = count - sum(len(nodes) for _, nodes in known)
        what = (
            f"{loose} hexahedra are in no group" if loose > 0 else f"{-loose} hexahedra are in more than one group of"
        )
        raise MeshError(
            f"{path}: {what} wing, nose or wheel (volume groups: {names}): put each into one, or leave it out"
        )
    there = {body for body, nodes in known if len(nodes)}
    missing = [] if there & {0, 1} else ["wing or nose"]
    missing += [] if 2 in there else ["wheel"]
    if missing:
        raise MeshError(
            f"{path}: no group {' and no group '.join(missing)} (volume groups: {names}): name the groups of volumes so"
        )
    region = np.repeat([body for body, _ in known], [len(nodes) for _, nodes in known]).astype(np.int8)
    return np.vstack([nodes for _, nodes in known]), region


def checked_mesh(what: str, points: np.ndarray, cells: np.ndarray, region: np.ndarray, faces: list[Group]) -> HexMesh:
    """Points (n, 3) [m], cells (m, 8) and their body (m,), and groups of quads, as the explicit solver takes them.
    Errors: MeshError."""
    if not np.isfinite(points).all():
        raise MeshError(
            f"{what}: {(~np.isfinite(points)).any(axis=1).sum()} node(s) have no finite position: mend them"
        )
    body = _body_of_nodes(what, points, cells, region)
    _check_doubled(what, points, cells)
    outer, owner = boundary_faces(cells)
    surface, surface_region = _contact(what, points, outer, region[owner], _named(faces, CONTACT))
    clamp = np.unique(_named(faces, BASE))
    mesh = HexMesh(points, cells, region, REGIONS, surface, surface_region, clamp)
    check_shapes(mesh, f"{what} is taken as it is: mend the cell, or turn its nodes where it is inside out")
    for number, name in enumerate(REGIONS):
        if (region == number).any():
            _check_body(what, mesh, number, name, body)
            check_conforming(f"{what}: the {name}", points, outer[region[owner] == number])
    height = np.abs(points[surface[np.isin(surface_region, CROSSING)], 2]).max()
    if height > FARTHEST_SURFACE:
        raise MeshError(
            f"{what}: the crossing's contact surface reaches {height * 1e3:.4g} mm from rail level, at most"
            f" {FARTHEST_SURFACE * 1e3:g} mm is meant: is mesh_unit right, and z up from rail level?"
        )
    return mesh


def _body_of_nodes(what: str, points: np.ndarray, cells: np.ndarray, region: np.ndarray) -> np.ndarray:
    """(n,) body of each node; bodies may share none."""
    body = np.full(len(points), -1)
    for number in range(len(REGIONS)):
        nodes = np.unique(cells[region == number])
        shared = nodes[body[nodes] >= 0]
        if len(shared):
            raise MeshError(
                f"{what}: {REGIONS[body[shared[0]]]} and {REGIONS[number]} share {len(shared)} node(s), one at"
                f" {position(points[shared[0]])}: bodies meet by contact alone, give each its own nodes"
            )
        body[nodes] = number
    return body


def _check_doubled(what: str, points: np.ndarray, cells: np.ndarray) -> None:
    _, first, count = np.unique(np.sort(cells, axis=1), axis=0, return_index=True, return_counts=True)
    if (count > 1).any():
        at = points[cells[first[np.argmax(count)]]].mean(axis=0)
        raise MeshError(
            f"{what}: {(count > 1).sum()} hexahedra are there twice, one at {position(at)}: remove one of each"
        )


def _named(faces: list[Group], parts: tuple[str, ...]) -> np.ndarray:
    """(k, 4) quads of groups named as a part, of all bodies or of one."""
    wanted = {*parts, *(f"{body} {part}" for body in REGIONS for part in parts)}
    return np.vstack([np.empty((0, 4), np.int64), *(quads for name, quads in faces if name.lower() in wanted)])


def _contact(
    what: str, points: np.ndarray, outer: np.ndarray, body: np.ndarray, quads: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Contact faces (k, 4) as the cells have them, outward, and their bodies (k,)."""
    found = find_rows(quads, outer)
    if (found < 0).any():
        first = quads[np.argmin(found)]
        raise MeshError(
            f"{what}: {(found < 0).sum()} face(s) of the contact surface are no outer face of a hexahedron, one at"
            f" {position(points[first].mean(axis=0))}: leave the faces between cells out of the group"
        )
    chosen = np.unique(found)
    return outer[chosen], body[chosen].astype(np.int8)


def _check_body(what: str, mesh: HexMesh, number: int, name: str, body: np.ndarray) -> None:
    """A body in one piece, with a contact surface and a base."""
    cells = mesh.cells[mesh.region == number]
    count = len(mesh.points)
    first, other = np.repeat(cells[:, 0], 7), cells[:, 1:].ravel()
    _, label = connected_components(coo_array((np.ones(len(first)), (first, other)), shape=(count, count)), False)
    pieces, sizes = np.unique(label[cells[:, 0]], return_counts=True)
    if len(pieces) > 1:
        small = cells[label[cells[:, 0]] == pieces[np.argmin(sizes)]]
        raise MeshError(
            f"{what}: the {name} is in {len(pieces)} pieces that share no node, the smallest of {sizes.min()}"
            f" hexahedra at {position(mesh.points[small].mean(axis=(0, 1)))}: join them, or leave it out"
        )
    if not (mesh.surface_region == number).any():
        raise MeshError(f'{what}: the {name} has no contact surface: give a group of faces "{name} contact"')
    if not (body[mesh.clamp] == number).any():
        raise MeshError(f'{what}: the {name} has no base: give a group of faces "{name} base"')
