"""What a wheel's fine sector stands on: the rest of the rim, web and hub on a rigid bore, condensed to the sector's
boundary.

The functions of that boundary are what the whole wheel makes of it: its displacements there under forces on the tread
about the contact, as polynomials of position, with those of a rigid body; of all of them as many as leave less than
LEAST. They stand on the whole wheel's mesh, the condensed body is that without the sector. In the frame of a wheel mesh
x = 0 at the axle, y from the tread datum, z above its lowest point.
"""

from dataclasses import replace
from itertools import product
from math import comb

import numpy as np
from scipy.spatial import cKDTree

from bem.material import Elastic
from geometry.meshing.hexmesh import HexMesh, boundary_faces, orient
from geometry.meshing.quality import cell_centres
from rail_fem.fe.condensed_body import RIGID, Condensed, terms_at
from rail_fem.passes.fourier_section import RingSection
from rail_fem.passes.wheel_modes import wheel_section
from rail_fem.scene.wheel_body import WheelBody
from rail_fem.static_fe.condensed import Factor, Solid, condense

ELEMENT = 25e-3  # of the section [m], quadratic
SECTOR, REST = np.radians(5), np.radians(7.5)  # angles of a layer of elements, at most
DEGREE, ROOM = 5, 2  # of the polynomials, at most; nodes to a term, at least
LOADS_X = -20e-3, 0.0, 20e-3  # positions on the tread of the forces that give the functions [m]
LOADS_Y = -40e-3, -20e-3, 0.0, 20e-3, 40e-3, 60e-3
SHARE_ACROSS = 0.3  # of the force along x and y, over the vertical
LEAST = 1e-4  # of the largest function's size; smaller ones are left out
CORNERS = np.array([0, 2, 8, 6])  # of a section's nine-node cell


def wheel_mesh(
    body: WheelBody, radius: float, depth: float, half_angle: float, element: float = ELEMENT
) -> tuple[HexMesh, np.ndarray]:
    """Hub, web and rim about the axle, and which cells (m,) bool are the sector's: within +-half_angle [rad] of the
    lowest point and less than `depth` [m] below the tread datum. clamp : the bore's nodes."""
    section = wheel_section(body, radius, body.web_position, element, depth)
    inside, outside = (
        np.linspace(low, high, int(np.ceil((high - low) / step - 1e-9)) + 1)[:-1]
        for low, high, step in ((-half_angle, half_angle, SECTOR), (half_angle, 2 * np.pi - half_angle, REST))
    )
    mesh = revolved(section, np.r_[inside, outside], radius)
    in_sector = sector_of(mesh, radius, depth, half_angle)
    bore = np.hypot(mesh.points[:, 0], mesh.points[:, 2] - radius) < body.bore_radius + 1e-9
    return replace(mesh, clamp=np.flatnonzero(bore)), in_sector


def revolved(section: RingSection, angle: np.ndarray, radius: float, closed: bool = True) -> HexMesh:
    """Hexahedra between the planes at angles (n,) [rad] about an axle at height `radius` [m], from the lowest point;
    closed : the last meets the first. Nothing is clamped."""
    used, quads = np.unique(section.cells[:, CORNERS], return_inverse=True)
    quads = quads.reshape(-1, 4)
    r, y = section.points[used].T
    turned = angle[:, None]
    points = np.stack([r * np.sin(turned), y + 0 * turned, radius - r * np.cos(turned)], axis=-1).reshape(-1, 3)
    slab = np.arange(len(angle) - (not closed))[:, None, None]
    cells = np.concatenate([quads + slab * len(r), quads + (slab + 1) % len(angle) * len(r)], axis=2).reshape(-1, 8)
    no_faces, none = np.empty((0, 4), int), np.empty(0, np.int8)
    return HexMesh(
        points, orient(points, cells), np.zeros(len(cells), np.int8), ("wheel",), no_faces, none, np.empty(0, int)
    )


def sector_of(mesh: HexMesh, radius: float, depth: float, half_angle: float) -> np.ndarray:
    """Cells (m,) bool of a wheel less than `depth` [m] below the tread datum and within +-half_angle [rad]."""
    x, _, z = cell_centres(mesh.points, mesh.cells).T
    return (np.hypot(x, z - radius) > radius - depth) & (np.abs(np.arctan2(x, radius - z)) < half_angle)


def faces_among(cells: np.ndarray, nodes: np.ndarray) -> np.ndarray:
    """Boundary faces (k, 4) of cells (m, 8) whose nodes are all among `nodes`."""
    faces, _ = boundary_faces(cells)
    return faces[np.isin(faces, nodes).all(axis=1)]


def condensed_wheel(
    body: WheelBody,
    radius: float,
    depth: float,
    half_angle: float,
    steel: Elastic,
    density: float,
    highest: float,
    element: float = ELEMENT,
    degree: int = 2,
) -> Condensed:
    """The wheel without its sector (`wheel_mesh`), with modes up to `highest` [Hz].

    element : of the section [m], of displacements of a degree. Errors: ValueError for a rim that is not deeper than the
    sector, and as wheel_section.
    """
    if not depth < body.rim_depth:
        raise ValueError(
            f"scene.wheel_body: the rim is {body.rim_depth * 1e3:g} mm deep, the wheel's mesh {depth * 1e3:g} mm: give"
            " a smaller wheel_depth"
        )
    mesh, in_sector = wheel_mesh(body, radius, depth, half_angle, element)
    return condensed_behind(mesh, in_sector, radius, radius * half_angle, steel, density, highest, degree)


def condensed_behind(
    mesh: HexMesh,
    in_sector: np.ndarray,
    radius: float,
    length: float,
    steel: Elastic,
    density: float,
    highest: float,
    degree: int = 2,
) -> Condensed:
    """A wheel's mesh, held where it is clamped, without the cells of its sector (m,) bool; the rest as
    `condensed_wheel`. length : of the sector to both sides [m]"""
    faces = faces_among(mesh.cells[~in_sector], np.intersect1d(mesh.cells[in_sector], mesh.cells[~in_sector]))
    found, at = _traces(Solid(mesh, steel, density, degree), mesh, faces, radius)
    highest_power = max(d for d in range(1, DEGREE + 1) if ROOM * comb(d + 3, 3) <= len(at))
    powers = np.array([p for p in product(range(DEGREE + 1), repeat=3) if sum(p) <= highest_power])
    functions = _functions(terms_at(powers, length, at), _rigid_terms(powers, length, at.mean(axis=0)), found)
    rest = part_of(mesh, ~in_sector)
    solid = Solid(rest, steel, density, degree)
    interface = solid.nodes_on(_renumbered(mesh, rest, faces))
    held = solid.nodes_on(faces_among(rest.cells, rest.clamp))
    values = np.einsum("nk,kcf->ncf", terms_at(powers, length, solid.nodes[interface]), functions)
    parts = condense(solid, held, interface, values, 2 * np.pi * highest)
    return Condensed(powers, length, functions, *parts)


def part_of(mesh: HexMesh, kept: np.ndarray) -> HexMesh:
    """The cells `kept` (m,) bool of a body without a running surface."""
    used, cells = np.unique(mesh.cells[kept], return_inverse=True)
    clamp = np.flatnonzero(np.isin(used, mesh.clamp))
    cells = cells.reshape(-1, 8)
    return HexMesh(
        mesh.points[used], cells, mesh.region[kept], mesh.region_names, mesh.surface, mesh.surface_region, clamp
    )


def _renumbered(mesh: HexMesh, part: HexMesh, faces: np.ndarray) -> np.ndarray:
    return cKDTree(part.points).query(mesh.points[faces])[1]


def _traces(solid: Solid, mesh: HexMesh, faces: np.ndarray, radius: float) -> tuple[np.ndarray, np.ndarray]:
    """Displacements (n, 3, l) of the sector's boundary on the whole wheel under l loads, and its nodes' positions (n,
    3) [m]."""
    at = solid.nodes_on(faces)
    held = solid.nodes_on(faces_among(mesh.cells, mesh.clamp))
    free = np.setdiff1d(np.arange(3 * len(solid.nodes)), (3 * held[:, None] + np.arange(3)).ravel())
    tree = cKDTree(solid.nodes)
    loads = []
    for x, y in product(LOADS_X, LOADS_Y):
        node = tree.query((x, y, radius - np.sqrt(radius**2 - x**2)))[1]
        for axis, share in ((0, SHARE_ACROSS), (1, SHARE_ACROSS), (2, 1.0)):
            loads.append(np.zeros(3 * len(solid.nodes)))
            loads[-1][3 * node + axis] = share
    answer = np.zeros((3 * len(solid.nodes), len(loads)))
    factor = Factor(solid.stiffness[free][:, free])
    answer[free] = factor(np.array(loads).T[free])
    factor.give_back()
    return answer.reshape(-1, 3, len(loads))[at], solid.nodes[at]


def _rigid_terms(powers: np.ndarray, length: float, centre: np.ndarray) -> np.ndarray:
    """Coefficients (k, 3, 6) of a rigid body's motions: along x, y, z and about the axes through a centre (3,) [m]."""
    row = lambda power: int(np.flatnonzero((powers == power).all(axis=1))[0])
    axes, found = np.eye(3), np.zeros((len(powers), 3, RIGID))
    found[row((0, 0, 0)), :, :3] = axes
    for k, axis in enumerate(axes):
        found[row((0, 0, 0)), :, 3 + k] = -np.cross(axis, centre)
        for along in axes:
            found[row(along), :, 3 + k] = length * np.cross(axis, along)
    return found


def _functions(table: np.ndarray, rigid: np.ndarray, traces: np.ndarray) -> np.ndarray:
    """Coefficients (k, 3, f) of functions that are orthonormal on the nodes of a table of terms (n, k): six of a rigid
    body, from its own (k, 3, 6), and of traces (n, 3, l) as many as leave less than LEAST.

    A motion of a rigid body is one off these nodes, too: terms that are others' sums on the surface are not mixed in.
    """
    terms = np.stack([np.linalg.lstsq(table, traces[:, c], rcond=1e-4)[0] for c in range(3)], axis=1)
    on_nodes = lambda coefficients: np.einsum("nk,kcf->ncf", table, coefficients).reshape(3 * len(table), -1)
    turn = np.linalg.inv(np.linalg.qr(on_nodes(rigid))[1])
    rigid, others = rigid @ turn, on_nodes(terms)
    share = on_nodes(rigid).T @ others
    _, size, mix = np.linalg.svd(others - on_nodes(rigid) @ share, full_matrices=False)
    kept = size > LEAST * size[0]
    return np.concatenate([rigid, (terms - rigid @ share) @ (mix[kept].T / size[kept])], axis=2)
