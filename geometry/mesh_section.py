"""Quadrilaterals of one section: fine blocks under the running bands, transition strips around them, Gmsh in the rest.

The sweep along x (mesh_sweep) has three slabs in the fine part for one in the coarse part. So a section has three kinds
of quads: `fine`, swept slab by slab; `strip`, one ring around each block, swept by a 3:1 template; `coarse`, swept three
slabs at a time. A second ring of coarse quads triples the element size within the section as well.

      surface ___F_F_F_F_F_F___       F fine block following the surface, depth growing a little
             \ S |F_F_F_F| S /        S strip: 3:1 along x
              \S__S__S__S__S/         T ring: 3:1 along the ring
            T   T    T    T   C       C Gmsh, graded to the coarse size
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from geometry.mesh import MeshError
from geometry.mesh_curve import SectionCurve
from geometry.mesh_gmsh import badness, fill_with_quads, inner_angles
from geometry.mesh_smooth import Smoother, corner_targets

Outline = Callable[[np.ndarray], np.ndarray]
# Thickness of the ring that triples sizes along the outline, in fine sizes, and the depth of its template's inner nodes:
# V / A_max of its hexahedra is 0.8 of the fine size.
RING_THICKNESS = 3.0
RING_MIDDLE = 0.6
# The same for the strip in which three slabs become one; thicker where its cells are already three sizes wide.
STRIP_THICKNESS = 3.0
WIDE_STRIP_THICKNESS = 4.0
STRIP_MIDDLE = 0.55
# Share of their thickness with which the rings are first laid; smoothing then lets them grow, so that they never fold.
START_SHARE = 0.3
# The triple ring is left out where three fine sizes are more than this many coarse ones.
TRIPLE_LIMIT = 0.85
# Weight of size against shape when fine cells, ring and strip are smoothed, and for the coarse rest.
SIZE_WEIGHT = 1.5
COARSE_SIZE_WEIGHT = 0.1
# Divisions of the outline beside the blocks that are tried, as factors on the sizes.
OUTLINE_FACTORS = (1.0, 0.9, 1.1, 0.8)
# Badness of connections from which on some corner is flat, or nearly.
FLAT_CORNER = 6.0


@dataclass(frozen=True)
class SectionSizes:
    """Sizes of a section's mesh: fine size, depth of the fine block, largest size far away [m], growth between them."""

    fine: float
    depth: float
    coarse: float
    growth: float = 1.3
    depth_growth: float = 1.15
    triple_ring: bool = True


@dataclass(frozen=True)
class QuadSection:
    """The mesh of one section; nodes are shared by all its arrays.

    points : (n, 2) y, height [m];  fine (f, 4), coarse (c, 4): quads, anticlockwise
    strip : (t, 6) a, b, middle_a, middle_b, c, d: a-b on the fine side, c-d on the coarse side, middles on the rungs a-c, b-d
    on_curve : (k,) nodes on the outline, in its order;  curve_arc : (k,) their arc lengths [m]
    base : (b,) nodes on the base, both ends included;  smoother : the shapes that its plane quads should have
    badness : of the coarse quads' connections, over all sections (mesh_gmsh.badness); above FLAT_CORNER some corner is flat
    """

    points: np.ndarray
    fine: np.ndarray
    strip: np.ndarray
    coarse: np.ndarray
    on_curve: np.ndarray
    curve_arc: np.ndarray
    base: np.ndarray
    smoother: Smoother
    badness: float

    def plane_quads(self) -> np.ndarray:
        """All quads (k, 4) anticlockwise, each strip cell as one quad without its middle nodes."""
        return np.concatenate([self.fine, self.strip[:, [0, 4, 5, 1]], self.coarse])

    def slab_cells(self) -> float:
        """Mean number of hexahedra in a slab of the fine size."""
        return len(self.fine) + (4 * len(self.strip) + len(self.coarse)) / 3


class _Nodes:
    """Collects nodes and what is known of them while the section is built."""

    def __init__(self):
        self.points, self.arc = [], {}

    def add(self, points, arcs=None):
        """Numbers of new nodes at points (k, 2), with arc lengths (k,) where they lie on the outline."""
        first = len(self.points)
        self.points += list(np.atleast_2d(points))
        numbers = np.arange(first, len(self.points))
        if arcs is not None:
            self.arc |= dict(zip(numbers.tolist(), np.atleast_1d(arcs).tolist()))
        return numbers


def mesh_section(curve: SectionCurve, blocks: list[np.ndarray], sizes: SectionSizes, elsewhere: Sequence[Outline] = ()) -> QuadSection:
    """Mesh the body under an outline, fine below the running bands.

    curve : outline, both ends at the same height (the base)
    blocks : for each fine block, left to right, the arc lengths [m] of its columns on the outline; with the triple ring
             its columns plus twice its layers are a multiple of 3
    elsewhere : where arc lengths (k,) of this outline go, (k, 2), on other sections that the mesh will be carried to
    Raises MeshError where the blocks and their rings do not fit on the outline, or Gmsh cannot fill the rest.
    """
    nodes, parts, targets = _Nodes(), {"fine": [], "strip": [], "coarse": []}, []
    _check_room(curve, [(columns[0], columns[-1]) for columns in blocks], ring_width(sizes))
    loops = []
    for columns in blocks:
        chain = _add_block(nodes, parts, targets, curve, columns, sizes)
        if sizes.triple_ring:
            chain = _add_triple_ring(nodes, parts, targets, curve, chain, sizes)
        loops.append(_add_strip(nodes, parts, targets, curve, chain, sizes))
    _smooth(nodes, parts, targets, rounds=(1e-3,))
    base, badness_found = _fill_rest(nodes, parts, targets, curve, loops, sizes, elsewhere)
    smoother = _smooth(nodes, parts, targets, base)
    return _finish(nodes, parts, base, smoother, badness_found)


def ring_width(sizes: SectionSizes) -> float:
    """Length [m] that the transition rings take on the outline at each side of a band."""
    return sizes.fine * (RING_THICKNESS + WIDE_STRIP_THICKNESS if sizes.triple_ring else STRIP_THICKNESS)


def depth_steps(sizes: SectionSizes) -> np.ndarray:
    """Thicknesses [m] of the fine block's layers from the surface down, at least two.

    Below them the elements of the next ring are still fine along the outline down to its middle: the layers and that
    part together come nearest to the depth asked for.
    """
    steps = sizes.fine * sizes.depth_growth ** np.arange(200)
    below = RING_MIDDLE * RING_THICKNESS * sizes.fine
    return steps[:max(2, 1 + np.abs(np.cumsum(steps) + below - sizes.depth).argmin())]


def _check_room(curve, spans, reach):
    """Refuse blocks whose rings overlap or leave the outline."""
    free = [0.0] + [end + reach for _, end in spans], [start - reach for start, _ in spans] + [curve.length]
    for left, right in zip(*free):
        if right - left <= 0.2 * reach:
            raise MeshError(f"the fine blocks {[(round(a * 1e3, 2), round(b * 1e3, 2)) for a, b in spans]} mm (arc length) with {reach * 1e3:.2f} mm of transition at each side "
                            f"do not fit on an outline of {curve.length * 1e3:.2f} mm; narrow or move the bands, or take smaller elements")


def _add_block(nodes, parts, targets, curve, arcs, sizes):
    """Structured quads below the band; returns the block's sides and bottom from left to right as node numbers."""
    steps = depth_steps(sizes)
    down = _depth_directions(curve, arcs, steps.sum(), ring_width(sizes))
    layers = curve.at(arcs)[None] + np.append(0.0, np.cumsum(steps))[:, None, None] * down[None]
    number = np.stack([nodes.add(layer, arcs if i == 0 else None) for i, layer in enumerate(layers)])
    quads = np.stack([number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]], axis=-1)
    parts["fine"].append(quads.reshape(-1, 4))
    ideal = np.stack([_rectangle(width, step) for step in steps for width in np.diff(arcs)])
    targets.append((ideal, np.full(len(ideal), SIZE_WEIGHT), np.zeros(len(ideal))))
    return np.concatenate([number[:-1, 0], number[-1], number[-2::-1, -1]])


def _depth_directions(curve, arcs, depth, reach):
    """Unit vectors (k, 2) into the body: a straight line in arc length fitted to the normals of the band and `reach` beside it,
    its fan limited to 25 % narrowing at `depth`."""
    near = np.linspace(max(arcs[0] - reach, 0.0), min(arcs[-1] + reach, curve.length), 400)
    slope, level = np.polyfit(near - near.mean(), curve.normal_angle(near), 1)
    slope = np.clip(slope, -0.25 / depth, 0.25 / depth)
    angle = level + slope * (arcs - near.mean())
    return np.stack([np.sin(angle), -np.cos(angle)], axis=1)


def _add_strip(nodes, parts, targets, curve, chain, sizes):
    """The ring where three slabs meet one; returns its outer chain."""
    thickness = sizes.fine * (WIDE_STRIP_THICKNESS if sizes.triple_ring else STRIP_THICKNESS)
    sides = max(1, round(len(depth_steps(sizes)) / (3 if sizes.triple_ring else 1)))
    outer, arcs = _offset(nodes, curve, chain, thickness, sides)
    outer_numbers = _add_chain(nodes, outer, arcs)
    inner = np.array(nodes.points)[chain]
    middle_arcs = [nodes.arc[chain[i]] + STRIP_MIDDLE * (arcs[i] - nodes.arc[chain[i]]) for i in (0, -1)]
    middle = inner + STRIP_MIDDLE * (outer - inner)
    middle[[0, -1]] = curve.at(middle_arcs)
    middle_numbers = _add_chain(nodes, middle, middle_arcs)
    parts["strip"].append(np.stack([chain[:-1], chain[1:], middle_numbers[:-1], middle_numbers[1:], outer_numbers[:-1], outer_numbers[1:]], axis=1))
    ideal = np.stack([_rectangle(width, thickness) for width in np.linalg.norm(np.diff(inner, axis=0), axis=1)])
    targets.append((ideal, np.full(len(ideal), SIZE_WEIGHT), np.ones(len(ideal))))
    return outer_numbers


def _add_triple_ring(nodes, parts, targets, curve, chain, sizes):
    """The ring where three edges of the chain meet one; returns its outer chain, a third as long."""
    thickness, sides = RING_THICKNESS * sizes.fine, len(depth_steps(sizes))
    outer, arcs = _offset(nodes, curve, chain, thickness, sides)
    inner = np.array(nodes.points)[chain]
    middle = inner + RING_MIDDLE * (outer - inner)
    outer_numbers = _add_chain(nodes, outer[::3], arcs)
    quads, ideal = [], []
    template = sizes.fine * np.array([[0, 0], [1, 0], [2, 0], [3, 0], [1, -RING_MIDDLE * RING_THICKNESS], [2, -RING_MIDDLE * RING_THICKNESS], [0, -RING_THICKNESS], [3, -RING_THICKNESS]])
    corners = np.array([[0, 6, 4, 1], [1, 4, 5, 2], [2, 5, 7, 3], [4, 6, 7, 5]])
    for group in range((len(chain) - 1) // 3):
        first = 3 * group
        members = np.concatenate([chain[first:first + 4], nodes.add(middle[first + 1:first + 3]), outer_numbers[group:group + 2]])
        quads.append(members[corners])
        ideal.append(template[corners])
    parts["fine"].append(np.concatenate(quads))
    targets.append((np.concatenate(ideal), np.full(4 * len(quads), SIZE_WEIGHT), np.zeros(4 * len(quads))))
    return outer_numbers


def _add_chain(nodes, points, arcs):
    """Add a chain of nodes whose two ends lie on the outline at arcs (2,)."""
    numbers = [nodes.add(points[0], [arcs[0]]), nodes.add(points[1:-1]), nodes.add(points[-1], [arcs[1]])]
    return np.concatenate(numbers)


def _offset(nodes, curve, chain, distance, sides):
    """Chain moved outwards (to its right) by `distance`; the two ends slide along the outline, and the block's sides turn from that
    direction to their normal over `sides` edges. Also the ends' arc lengths."""
    points = np.array(nodes.points)[chain]
    arcs = nodes.arc[chain[0]] - distance, nodes.arc[chain[-1]] + distance
    along = np.diff(points, axis=0)
    normal = np.stack([along[:, 1], -along[:, 0]], axis=1) / np.linalg.norm(along, axis=1)[:, None]
    mean = normal[:-1] + normal[1:]
    mitre = mean / (0.5 * np.einsum("ij,ij->i", mean, mean))[:, None]
    shift = np.concatenate([[curve.at(arcs[0]) - points[0]], START_SHARE * distance * mitre, [curve.at(arcs[1]) - points[-1]]])
    for side, end in ((np.arange(sides), 0), (-1 - np.arange(sides), -1)):
        share = (np.arange(sides) / sides)[:, None]
        shift[side] = (1 - share) * shift[end] + share * shift[side]
    return points + shift, arcs


def _rectangle(width, height):
    """Ideal positions (4, 2) of a quad given from its top left corner anticlockwise."""
    return np.array([[0, 0], [0, -height], [width, -height], [width, 0]])


def _fill_rest(nodes, parts, targets, curve, loops, sizes, elsewhere):
    """Fill what the blocks leave with Gmsh, the best of several divisions of the outline; returns the base nodes from left to right and the badness."""
    attempts, faults = [], []
    for factor in OUTLINE_FACTORS:
        pieces, base = _outline_division(nodes, curve, loops, sizes, factor)
        polygon = _polygon(nodes, curve, loops, pieces, base)
        angles = np.stack([inner_angles(_polygon(nodes, curve, loops, pieces, base, place)) for place in (curve.at, *elsewhere)])
        ring = _ring_corners(loops, pieces, base)
        angles[:, ring] = angles[0, ring]
        try:
            points, quads = fill_with_quads(polygon, sizes.coarse, angles)
        except MeshError as fault:
            faults.append(fault)
            continue
        attempts.append((badness(points, quads, angles), pieces, base, points, quads))
    if not attempts:
        raise faults[0]
    least, pieces, base, points, quads = min(attempts, key=lambda attempt: attempt[0])
    ring, base_nodes = _add_ring(nodes, curve, loops, pieces, base)
    number = np.concatenate([ring, nodes.add(points[len(ring):])]) if len(points) > len(ring) else ring
    parts["coarse"].append(number[quads])
    area = np.abs(np.cross(points[quads[:, 2]] - points[quads[:, 0]], points[quads[:, 3]] - points[quads[:, 1]])) / 2
    side = np.sqrt(np.maximum(area, (0.5 * sizes.fine) ** 2))
    targets.append((side[:, None, None] * _rectangle(1.0, 1.0), np.full(len(quads), COARSE_SIZE_WEIGHT), np.full(len(quads), 2)))
    return base_nodes, least


def _outline_division(nodes, curve, loops, sizes, factor):
    """Arc lengths of the nodes left of, between and right of the blocks (ends included), growing away from them, and points inside the base."""
    ends = [nodes.arc[int(loop[k])] for loop in loops for k in (0, -1)]
    start_size = sizes.fine * (3.0 if sizes.triple_ring else 1.0)
    fine = np.linspace(0.0, curve.length, 2000)
    distance = np.min([np.abs(fine - end) for end in ends], axis=0)
    size = factor * np.minimum(start_size + (sizes.growth - 1) * distance, max(sizes.coarse, start_size))
    count = np.append(0.0, np.cumsum((fine[1] - fine[0]) * 0.5 * (1 / size[1:] + 1 / size[:-1])))
    sharp, pieces = curve.arc[curve.sharp_points()], []
    for start, end in zip([0.0] + ends[1::2], ends[0::2] + [curve.length]):
        knots = [start, *sharp[(sharp > start + 0.3 * start_size) & (sharp < end - 0.3 * start_size)], end]
        pieces.append(np.concatenate([[start]] + [_divide(fine, count, a, b)[1:] for a, b in zip(knots, knots[1:])]))
    left, right = curve.points[0], curve.points[-1]
    cells = max(2, round(np.linalg.norm(right - left) / (factor * sizes.coarse)))
    cells += (cells + sum(len(piece) - 1 for piece in pieces) + sum(len(loop) - 1 for loop in loops)) % 2
    return pieces, left + np.linspace(0, 1, cells + 1)[1:-1, None] * (right - left)


def _divide(fine, count, start, end):
    """Arc lengths that cut [start, end] at equal steps of the cell count `count` given at arc lengths `fine`."""
    first, last = np.interp([start, end], fine, count)
    cells = max(1, round(last - first))
    arcs = np.interp(np.linspace(first, last, cells + 1), count, fine)
    arcs[[0, -1]] = start, end
    return arcs


def _polygon(nodes, curve, loops, pieces, base, place=None):
    """Corners (k, 2) of the region left, anticlockwise from the left foot; the same order as _add_ring.

    place : where arc lengths of the outline are, another section's if given (the base is then stretched, the blocks stay).
    """
    place = place or curve.at
    known, feet = np.array(nodes.points), place(np.array([0.0, curve.length]))
    share = (base - curve.points[0])[:, :1] / (curve.points[-1] - curve.points[0])[0]
    parts = [feet[:1], feet[:1] + share * (feet[1:] - feet[:1])]
    for i in range(len(pieces) - 1, -1, -1):
        parts.append(place(pieces[i][:0:-1] if i == len(pieces) - 1 else pieces[i][-2:0:-1]))
        if i:
            loop = loops[i - 1][::-1]
            ends = place(np.array([nodes.arc[int(loop[k])] for k in (0, -1)]))
            parts.append(np.concatenate([ends[:1], known[loop[1:-1]], ends[1:]]))
    return np.concatenate(parts)


def _ring_corners(loops, pieces, base):
    """Numbers of the polygon's corners on the blocks' rings: other sections do not tell their angles."""
    unknown, corner = [], 1 + len(base)
    for i in range(len(pieces) - 1, -1, -1):
        corner += len(pieces[i]) - (1 if i == len(pieces) - 1 else 2)
        if i:
            unknown.append(np.arange(corner, corner + len(loops[i - 1])))
            corner += len(loops[i - 1])
    return np.concatenate(unknown)


def _add_ring(nodes, curve, loops, pieces, base):
    """Add the polygon's new nodes; returns the numbers of all its corners and of the base's nodes from left to right."""
    foot, inner = nodes.add(curve.points[:1], [0.0]), nodes.add(base)
    ring = [foot, inner]
    for i in range(len(pieces) - 1, -1, -1):
        arcs = pieces[i][:0:-1] if i == len(pieces) - 1 else pieces[i][-2:0:-1]
        ring.append(nodes.add(curve.at(arcs), arcs) if len(arcs) else np.zeros(0, int))
        if i:
            ring.append(loops[i - 1][::-1])
    return np.concatenate(ring).astype(int), np.concatenate([foot, inner, ring[2][:1]])


def _smooth(nodes, parts, targets, base=(), rounds=(0.1, 1e-2, 1e-3)):
    """Move the nodes inside the body to good shapes; outline, base and the strips' middles stay. Returns the smoother."""
    points, strip = np.array(nodes.points), np.concatenate(parts["strip"])
    coarse = np.concatenate(parts["coarse"]) if parts["coarse"] else np.zeros((0, 4), int)
    quads = np.concatenate([np.concatenate(parts["fine"]), strip[:, [0, 4, 5, 1]], coarse])
    ideal, weight, kind = (np.concatenate(column) for column in zip(*targets))
    order = np.argsort(kind, kind="stable")
    free = np.zeros(len(points), dtype=bool)
    free[quads] = True
    free[list(nodes.arc)] = free[list(base)] = False
    smoother = Smoother(quads, corner_targets(ideal[order]), weight[order], free)
    nodes.points = list(smoother.smooth(points, rounds))
    return smoother


def _finish(nodes, parts, base, smoother, badness_found):
    """Put the section together."""
    points, strip = np.array(nodes.points), np.concatenate(parts["strip"])
    on_curve = np.array(sorted(nodes.arc, key=nodes.arc.get))
    place_strip_middles(points, strip, on_curve)
    arcs = np.array([nodes.arc[int(node)] for node in on_curve])
    return QuadSection(points, np.concatenate(parts["fine"]), strip, np.concatenate(parts["coarse"]), on_curve, arcs, base, smoother, badness_found)


def place_strip_middles(points: np.ndarray, strip: np.ndarray, on_curve: np.ndarray) -> None:
    """Put the strips' middle nodes on their rungs, in place: points (n, 2) or (s, n, 2); those on the outline stay."""
    rungs = np.concatenate([strip[:, [0, 2, 4]], strip[:, [1, 3, 5]]])
    rungs = rungs[~np.isin(rungs[:, 1], on_curve)]
    start, end = points[..., rungs[:, 0], :], points[..., rungs[:, 2], :]
    points[..., rungs[:, 1], :] = start + STRIP_MIDDLE * (end - start)
