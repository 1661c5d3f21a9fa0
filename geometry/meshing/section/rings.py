"""The structured part of a section: the fine block under a running band and the two rings around it in which sizes
triple.

The fan of the block's depth lines is held narrow, so that a block round a corner keeps its cells' width. Rings are laid
thin and valid, and then grow as they are smoothed.
"""

import numpy as np

from geometry.meshing.section.curve import SectionCurve
from geometry.meshing.section.parts import DEPTH_GROWTH, SectionParts, SectionSizes, rectangle

# Thickness of the ring that triples sizes along the outline, in fine sizes, and where its template's inner nodes lie in
# it: V / A_max of its hexahedra is 0.8 of the fine size.
RING_THICKNESS = 3.0
RING_MIDDLE = 0.6
# The same for the strip in which three slabs become one; thicker where its cells are already three sizes wide.
STRIP_THICKNESS = 3.0
WIDE_STRIP_THICKNESS = 4.0
STRIP_MIDDLE = 0.55
# Slabs beyond the fine ones, in fine sizes. The strip's thickness does not grow with them: above the first its cells in
# the middle of three slabs are flat, so slabs end at the second (scaled Jacobian 0.16 on the wing at 0.125 mm)
FLAT_SLAB, LONGEST_SLAB = 11.0, 7.0
START_SHARE = 0.3  # of their thickness with which the rings are first laid
NARROWING = 0.25  # of the block's width at its depth, at most
SIZE_WEIGHT = 1.5  # of size against shape in smoothing
TEMPLATE = np.array([[0, 6, 4, 1], [1, 4, 5, 2], [2, 5, 7, 3], [4, 6, 7, 5]])


def ring_width(sizes: SectionSizes) -> float:
    """Length [m] that the rings take on the outline at each side of a block."""
    return sizes.fine * (RING_THICKNESS + WIDE_STRIP_THICKNESS if sizes.triple_ring else STRIP_THICKNESS)


def longest_slab(fine: float, coarse: float, far: float = 1.0) -> float:
    """Length along x [m] up to which slabs grow beyond the fine ones: a third of the coarse size, unless the strip
    would be too thin for that; `far` times as long where nothing touches and the strip is thick enough."""
    third = coarse / 3 if coarse / 3 <= FLAT_SLAB * fine else LONGEST_SLAB * fine
    return max(third, min(far * coarse / 3, LONGEST_SLAB * fine))


def depth_steps(sizes: SectionSizes) -> np.ndarray:
    """Thicknesses [m] of the fine block's layers from the surface down, at least two.

    Below them the cells of the next ring are still fine along the outline down to its middle: the layers and that part
    together come nearest to the depth asked for.
    """
    steps = sizes.fine * DEPTH_GROWTH ** np.arange(200)
    below = RING_MIDDLE * RING_THICKNESS * sizes.fine
    return steps[: max(2, 1 + np.abs(np.cumsum(steps) + below - sizes.depth).argmin())]


def add_block(parts: SectionParts, columns: np.ndarray) -> np.ndarray:
    """Add structured quads below the outline's arc lengths columns (k,) [m]; returns the numbers of the block's left
    side, bottom and right side in a chain."""
    steps = depth_steps(parts.sizes)
    down = depth_directions(parts.curve, columns, steps.sum(), ring_width(parts.sizes))
    surface = parts.curve.at(columns)
    number = np.stack(
        [parts.add_on_outline(columns)] + [parts.add_nodes(surface + depth * down) for depth in np.cumsum(steps)]
    )
    quads = np.stack([number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]], axis=-1).reshape(-1, 4)
    ideal = np.stack([rectangle(width, step) for step in steps for width in np.diff(columns)])
    parts.add_cells("fine", quads, ideal, SIZE_WEIGHT)
    return np.concatenate([number[:-1, 0], number[-1], number[-2::-1, -1]])


def depth_directions(curve: SectionCurve, columns: np.ndarray, depth: float, reach: float) -> np.ndarray:
    """Unit vectors (k, 2) into the body at arc lengths (k,): their angle is a straight line in arc length fitted to the
    normals of the band and `reach` [m] beside it, of a slope that narrows the block by no more than NARROWING at
    `depth` [m]."""
    near = np.linspace(max(columns[0] - reach, 0.0), min(columns[-1] + reach, curve.length), 400)
    slope, level = np.polyfit(near - near.mean(), curve.normal_angle(near), 1)
    angle = level + np.clip(slope, -NARROWING / depth, NARROWING / depth) * (columns - near.mean())
    return np.stack([np.sin(angle), -np.cos(angle)], axis=1)


def add_triple_ring(parts: SectionParts, chain: np.ndarray) -> np.ndarray:
    """Add the ring where three edges of the chain meet one, four quads each; returns its outer chain, a third as long.

    p0 -- p1 -- p2 -- p3        p of the chain, m its middle nodes, q of the outer chain
    |     |     |     |
    |    m1 --- m2    |
    |  /          \\  |
    q0 -------------- q3
    """
    size = parts.sizes.fine
    outer, arcs = offset_chain(parts, chain, RING_THICKNESS * size, len(depth_steps(parts.sizes)))
    inner = parts.at(chain)
    middle = parts.add_nodes(inner + RING_MIDDLE * (outer - inner))
    outer_chain = parts.add_chain(outer[::3], arcs)
    group = 3 * np.arange((len(chain) - 1) // 3)[:, None]
    outer_ends = np.column_stack([outer_chain[:-1], outer_chain[1:]])
    members = np.hstack([chain[group + [0, 1, 2, 3]], middle[group + [1, 2]], outer_ends])
    deep, half = -RING_THICKNESS, -RING_MIDDLE * RING_THICKNESS
    ideal = size * np.array([[0, 0], [1, 0], [2, 0], [3, 0], [1, half], [2, half], [0, deep], [3, deep]])[TEMPLATE]
    parts.add_cells("fine", members[:, TEMPLATE].reshape(-1, 4), np.tile(ideal, (len(group), 1, 1)), SIZE_WEIGHT)
    return outer_chain


def add_strip(parts: SectionParts, chain: np.ndarray) -> np.ndarray:
    """Add the ring where three slabs meet one (see mesh_sweep); returns its outer chain, as long as the chain."""
    sizes = parts.sizes
    thickness = sizes.fine * (WIDE_STRIP_THICKNESS if sizes.triple_ring else STRIP_THICKNESS)
    outer, arcs = offset_chain(
        parts, chain, thickness, max(1, round(len(depth_steps(sizes)) / (3 if sizes.triple_ring else 1)))
    )
    inner = parts.at(chain)
    outer_chain = parts.add_chain(outer, arcs)
    begin, end = parts.arc[int(chain[0])], parts.arc[int(chain[-1])]
    middle_arcs = begin + STRIP_MIDDLE * (arcs[0] - begin), end + STRIP_MIDDLE * (arcs[-1] - end)
    middle = parts.add_chain(inner + STRIP_MIDDLE * (outer - inner), middle_arcs)
    cells = np.stack([chain[:-1], chain[1:], middle[:-1], middle[1:], outer_chain[:-1], outer_chain[1:]], axis=1)
    ideal = np.stack([rectangle(width, thickness) for width in np.linalg.norm(np.diff(inner, axis=0), axis=1)])
    parts.add_cells("strip", cells, ideal, SIZE_WEIGHT)
    return outer_chain


def offset_chain(
    parts: SectionParts, chain: np.ndarray, distance: float, sides: int
) -> tuple[np.ndarray, tuple[float, float]]:
    """Positions (k, 2) of a chain moved outwards (to its right), and the arc lengths of its ends.

    The ends slide along the outline by `distance` [m]; inner nodes move by START_SHARE of it, in directions that turn
    from the outline's to their own normal over the first and last `sides` edges.
    """
    points = parts.at(chain)
    arcs = parts.arc[int(chain[0])] - distance, parts.arc[int(chain[-1])] + distance
    along = np.diff(points, axis=0)
    normal = np.stack([along[:, 1], -along[:, 0]], axis=1) / np.linalg.norm(along, axis=1)[:, None]
    mean = normal[:-1] + normal[1:]
    mitre = mean / (0.5 * np.einsum("ij,ij->i", mean, mean))[:, None]
    ends = parts.curve.at(np.array(arcs)) - points[[0, -1]]
    shift = np.concatenate([ends[:1], START_SHARE * distance * mitre, ends[1:]])
    share = (np.arange(sides) / sides)[:, None]
    for side, end in ((np.arange(sides), 0), (-1 - np.arange(sides), -1)):
        shift[side] = (1 - share) * ends[end] + share * shift[side]
    return points + shift, arcs
