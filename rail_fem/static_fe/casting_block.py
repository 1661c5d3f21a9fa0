"""What the meshes of a casting stand on, condensed: a block from the plane on which they end to a rigid foot, as wide
as wing and nose together, bridged where these are parted; where one is not, that goes on from its end.

The bodies on it move it by plane sections, linear in x between stations: a load at that depth is smooth.
Error: from above in stiffness, by what the functions lack.
Cost, 100 mm deep: 5, 11, 33 core seconds and 0.7, 1.1, 1.9 GB for 0.5, 1, 2 m of wing and nose; 345 mm: 70 and 3.9 for
1.7 m.
"""

from dataclasses import replace

import numpy as np

from bem.material import Elastic
from geometry.meshing.axis import graded_line
from geometry.meshing.blocks import mesh_grid
from geometry.meshing.hexmesh import HexMesh
from rail_fem.fe.condensed_body import SECTION, CondensedBlock
from rail_fem.fe.elastic_kernels import Riding, add_sections
from rail_fem.static_fe.condensed import Factor, Solid

ELEMENT, STATION = 20e-3, 20e-3  # of the block at its top, quadratic; between stations, at most [m]
BEYOND = 1.0  # length of the block beyond the meshes, over its depth
AT_ONCE = 64  # motions solved for together
# first frequency of a rod on its foot: of half its mass at its end 2^0.5 c / L, of a share of that half pi / 2 c / L
SHARE = 8 / np.pi**2
SAME = 1e-9  # [m]


def footprint(mesh: HexMesh, body: int) -> np.ndarray:
    """x, lowest and highest y (s, 3) [m] of the planes of nodes on which a body of the mesh is clamped."""
    nodes = np.intersect1d(mesh.clamp, mesh.cells[mesh.region == body])
    x, y = mesh.points[nodes, :2].T
    planes, which = np.unique(np.round(x, 9), return_inverse=True)
    low, high = np.full((2, len(planes)), np.inf) * np.array([[1.0], [-1.0]])
    np.minimum.at(low, which, y), np.maximum.at(high, which, y)
    return np.column_stack([planes, low, high])


def casting_block(
    prints: tuple[np.ndarray, ...],
    regions: tuple[int, ...],
    top: float,
    foot: float,
    steel: Elastic,
    density: float,
    element: float = ELEMENT,
    beyond: float = BEYOND,
) -> CondensedBlock:
    """The block under bodies, regions of the mesh, of which each has a `footprint`, from z = top down to z = foot [m].

    element : of the block, quadratic, and between stations where STATION is less [m];  beyond : length beyond the
        bodies at both ends, over the depth
    """
    solid, on, held = _block(prints, top, foot, steel, density, element, beyond)
    first, last = np.array([(own[0, 0], own[-1, 0]) for own in prints]).T
    count = np.maximum(np.ceil((last - first) / max(STATION, element) - SAME).astype(np.int64), 1) + 1
    at = [own[0, 0] + np.linspace(0, 1, stations) * np.ptp(own[:, 0]) for own, stations in zip(prints, count)]
    middle = np.concatenate([side_middle(own, x) for own, x in zip(prints, at)])
    axis = np.column_stack([middle, np.full(len(middle), top)])
    apart, none = (last - first) / (count - 1), np.zeros(0)
    block = CondensedBlock(first, apart, count, np.array(regions), axis, none.reshape(0, 0), none, 0.0)
    nodes, body = np.concatenate(on), np.repeat(np.arange(len(on)), [len(own) for own in on])
    values = _motions(block, solid.nodes[nodes], body)
    stiffness, mass, weight = _condensed(solid, held, nodes, values)
    width = np.repeat([(own[:, 2] - own[:, 1]).mean() for own in prints], count)
    mass[3::SECTION] = mass[2::SECTION] * width**2 / 12
    return replace(block, stiffness=stiffness, mass=SHARE * mass, weight=weight)


def _block(
    prints: tuple[np.ndarray, ...],
    top: float,
    foot: float,
    steel: Elastic,
    density: float,
    element: float,
    beyond: float,
) -> tuple[Solid, list[np.ndarray], np.ndarray]:
    """The block, its nodes under each body, and those on the foot."""
    depth = top - foot
    low_x, high_x = min(own[0, 0] for own in prints), max(own[-1, 0] for own in prints)
    ends = low_x - beyond * depth, high_x + beyond * depth
    side = lambda x, column, of: of([np.interp(x, own[:, 0], own[:, column]) for own in prints], axis=0)
    cells = lambda length: int(np.ceil(length / element - SAME)) + 1
    x = np.linspace(*ends, cells(ends[1] - ends[0]))
    widest = (side(x, 2, np.max) - side(x, 1, np.min)).max()
    z = graded_line(foot, top, (top - min(element, depth), top), element)
    mesh = mesh_grid(x, np.linspace(0, 1, cells(widest)), z)
    low, high = side(mesh.points[:, 0], 1, np.min), side(mesh.points[:, 0], 2, np.max)
    mesh.points[:, 1] = low + mesh.points[:, 1] * (high - low)
    solid = Solid(mesh, steel, density)
    x, y, z = solid.nodes.T
    on: list[np.ndarray] = []
    for own in prints:
        under = (x > own[0, 0] - SAME) & (x < own[-1, 0] + SAME) & (z > top - SAME)
        half = np.interp(x, own[:, 0], own[:, 2] - own[:, 1]) / 2 + element / 8
        # of nodes element / 2 apart one is always near
        near = np.abs(y - side_middle(own, x)) < np.maximum(half, element / 4 + SAME)
        on.append(np.setdiff1d(np.flatnonzero(under & near), np.concatenate([[], *on])))
    return solid, on, np.flatnonzero(z < foot + SAME)


def side_middle(own: np.ndarray, x: np.ndarray) -> np.ndarray:
    """y of the middle of a footprint at x (n,) [m]."""
    return np.interp(x, own[:, 0], (own[:, 1] + own[:, 2]) / 2)


def _motions(block: CondensedBlock, positions: np.ndarray, body: np.ndarray) -> np.ndarray:
    """Displacements (3 k, n) of positions (k, 3) on bodies (k,) by each motion of the sections."""
    riding, all_of = Riding(*block.place(positions, body)), np.arange(len(positions))
    motions = np.eye(SECTION * int(block.count.sum()))
    values = np.zeros((len(motions), 3 * len(positions)))
    for one, out in zip(motions, values):
        add_sections(all_of, riding, one, out)
    return values.T


def _condensed(
    solid: Solid, held: np.ndarray, nodes: np.ndarray, values: np.ndarray
) -> tuple[np.ndarray, np.ndarray, float]:
    """Stiffness (n, n) of motions `values` (3 k, n) of nodes (k,), the steel's momentum per rate of each along its own
    direction (n,) [kg], and its mass [kg]; a static field in between."""
    unknowns = lambda of: (3 * of[:, None] + np.arange(3)).ravel()
    given = unknowns(nodes)
    free = np.setdiff1d(np.arange(solid.stiffness.shape[0]), np.r_[given, unknowns(held)])
    factor, of_given = Factor(solid.stiffness[free][:, free]), solid.stiffness[given]
    coupling = solid.stiffness[free][:, given]
    weights = np.asarray(solid.mass.sum(axis=1)).ravel()  # of each unknown: rows of one direction hold that alone
    direction = np.tile([0, 1, 2, 2], values.shape[1] // SECTION)
    stiffness, mass = np.zeros((values.shape[1],) * 2), np.zeros(values.shape[1])
    for start in range(0, values.shape[1], AT_ONCE):
        own = slice(start, start + AT_ONCE)
        field = np.zeros((solid.stiffness.shape[0], values[:, own].shape[1]))
        field[given] = values[:, own]
        field[free] = factor(-(coupling @ values[:, own]))
        stiffness[:, own] = values.T @ (of_given @ field)
        momentum = np.stack([weights[c::3] @ field[c::3] for c in range(3)])
        mass[own] = momentum[direction[own], np.arange(field.shape[1])]
    factor.give_back()
    return (stiffness + stiffness.T) / 2, mass, float(weights[0::3].sum())
