"""What blocks and rings leave of a section: its boundary divided from the rings' size to the coarse one, filled by
Gmsh."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from geometry.meshing.gmsh_fill import badness, fill_with_quads, inner_angles
from geometry.meshing.hexmesh import MeshError, cross_2d
from geometry.meshing.section.parts import GROWTH, SectionParts, rectangle

Outline = Callable[[np.ndarray], np.ndarray]
FACTORS = (1.0, 0.9, 1.1, 0.8)  # on the sizes along the boundary, each tried
SIZE_WEIGHT = 0.1  # of size against shape in smoothing


@dataclass(frozen=True)
class Remainder:
    """Boundary of the region left, in parts.

    loops : outer chains (node numbers) of the blocks' rings, left to right
    pieces : arc lengths [m] of the outline's nodes left of, between and right of the loops, their ends included
    base : (b, 2) positions inside the base, left to right [m]
    """

    parts: SectionParts
    loops: list[np.ndarray]
    pieces: list[np.ndarray]
    base: np.ndarray

    def walk(self) -> list[tuple[str, np.ndarray]]:
        """The boundary anticlockwise from the left foot: ("outline", arc lengths), ("base", positions) or ("ring", node
        numbers)."""
        steps = [("outline", self.pieces[0][:1]), ("base", self.base), ("outline", self.pieces[-1][:0:-1])]
        for loop, piece in zip(self.loops[::-1], self.pieces[-2::-1]):
            steps += [("ring", loop[::-1]), ("outline", piece[-2:0:-1])]
        return steps

    def polygon(self, position: Outline) -> np.ndarray:
        """Corners (k, 2) where the outline's arc lengths are at `place`; the base stretches, inner ring nodes stay."""
        curve, corners = self.parts.curve, []
        feet = position(np.array([0.0, curve.length]))
        for kind, part in self.walk():
            if kind == "outline":
                corners.append(position(part))
            elif kind == "base":
                share = (part - curve.points[0])[:, :1] / (curve.points[-1] - curve.points[0])[0]
                corners.append(feet[:1] + share * (feet[1:] - feet[:1]))
            else:
                ends = position(np.array([self.parts.arc[int(part[end])] for end in (0, -1)]))
                corners.append(np.concatenate([ends[:1], self.parts.at(part)[1:-1], ends[1:]]))
        return np.concatenate(corners)

    def angles(self, elsewhere: Sequence[Outline]) -> np.ndarray:
        """Inner angles (s, k) [rad] at the corners on this section and elsewhere; at ring nodes this section's
        everywhere."""
        angles = np.stack([inner_angles(self.polygon(position)) for position in (self.parts.curve.at, *elsewhere)])
        ring = np.concatenate([np.full(len(part), kind == "ring") for kind, part in self.walk()])
        angles[:, ring] = angles[0, ring]
        return angles

    def add_nodes(self) -> tuple[np.ndarray, np.ndarray]:
        """Add the boundary's new nodes: numbers (k,) of all its corners, and of the base's nodes from left to right."""
        numbers = []
        for kind, part in self.walk():
            adding = {"outline": self.parts.add_on_outline, "base": self.parts.add_nodes, "ring": lambda known: known}[
                kind
            ]
            numbers.append(adding(part) if len(part) else np.zeros(0, dtype=int))
        return np.concatenate(numbers), np.concatenate([numbers[0], numbers[1], numbers[2][:1]])


def fill_remainder(
    parts: SectionParts, loops: list[np.ndarray], elsewhere: Sequence[Outline]
) -> tuple[np.ndarray, float]:
    """Add the coarse quads, the best of several divisions of the boundary; returns the base's nodes from left to right
    and the badness.

    loops : outer chains of the rings;  elsewhere : the outline's arc lengths on other sections
    Raises MeshError where no division can be filled.
    """
    largest = float(parts.sizes.largest(np.ptp(parts.curve.points[:, 1])))
    found, errors = [], []
    for factor in FACTORS:
        divided = divide_boundary(parts, loops, factor)
        angles = divided.angles(elsewhere)
        try:
            points, quads = fill_with_quads(divided.polygon(parts.curve.at), largest, angles)
            found.append((badness(points, quads, angles), divided, points, quads))
        except MeshError as error:
            errors.append(error)
    if not found:
        raise errors[0]
    least, divided, points, quads = min(found, key=lambda attempt: attempt[0])
    ring, base = divided.add_nodes()
    number = np.concatenate([ring, parts.add_nodes(points[len(ring) :])])
    area = np.abs(cross_2d(points[quads[:, 2]] - points[quads[:, 0]], points[quads[:, 3]] - points[quads[:, 1]])) / 2
    side = np.sqrt(np.maximum(area, (0.5 * parts.sizes.fine) ** 2))
    parts.add_cells("coarse", number[quads], side[:, None, None] * rectangle(1.0, 1.0), SIZE_WEIGHT)
    return base, least


def divide_boundary(parts: SectionParts, loops: list[np.ndarray], factor: float) -> Remainder:
    """Divide outline and base: from the rings' size, growing with the distance along the outline, to the coarse size,
    times `factor`.

    Sharp corners of the outline get a node; the number of all edges is even.
    """
    curve, sizes = parts.curve, parts.sizes
    ends = [parts.arc[int(loop[end])] for loop in loops for end in (0, -1)]
    first = sizes.fine * (3.0 if sizes.triple_ring else 1.0)
    along = np.linspace(0.0, curve.length, 2000)
    distance = np.min([np.abs(along - end) for end in ends], axis=0)
    top = curve.points[:, 1].max()
    largest = np.maximum(sizes.largest(top - curve.at(along)[:, 1]), first)
    size = factor * np.minimum(first + (GROWTH - 1) * distance, largest)
    count = np.append(0.0, np.cumsum((along[1] - along[0]) * 0.5 * (1 / size[1:] + 1 / size[:-1])))
    sharp, pieces = curve.arc[curve.sharp_points()], []
    for start, end in zip([0.0] + ends[1::2], ends[0::2] + [curve.length]):
        knots = [start, *sharp[(sharp > start + 0.3 * first) & (sharp < end - 0.3 * first)], end]
        pieces.append(np.concatenate([[start]] + [_divide(along, count, a, b)[1:] for a, b in zip(knots, knots[1:])]))
    left, right = curve.points[0], curve.points[-1]
    cells = max(2, round(np.linalg.norm(right - left) / (factor * float(sizes.largest(top - left[1])))))
    cells += (cells + sum(len(part) - 1 for part in pieces + loops)) % 2
    return Remainder(parts, loops, pieces, left + np.linspace(0, 1, cells + 1)[1:-1, None] * (right - left))


def _divide(along, count, start, end):
    """Arc lengths that cut [start, end] at equal steps of the cell count `count` given at arc lengths `along`."""
    first, last = np.interp([start, end], along, count)
    cells = max(1, round(last - first))
    arcs = np.interp(np.linspace(first, last, cells + 1), count, along)
    arcs[[0, -1]] = start, end
    return arcs
