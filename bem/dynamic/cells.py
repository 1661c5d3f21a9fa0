"""Cells that fill a plane body: squares of a quadtree, fine where asked, cut off at the boundary mesh.

A cell carries one uniform body force. It need not fit its neighbours: cells of any size may lie side by side, since
the field of each is a closed form (bem.dynamic.body_force).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy import sparse

from bem.checks import refuse_unless_positive
from bem.plane.mesh import BoundaryMesh
from bem.plane.outline import polygon_moments

MOST_CELLS = 20_000  # of one body: its dense flexibility takes 13 GB
_SLIVER = 1e-9  # part of a square below which what the boundary leaves of it is round-off


class CellError(ValueError):
    """Cells that cannot be laid: too many, or a size that is none."""


@dataclass(frozen=True)
class Cells:
    """N polygons within a body, as E directed edges with the polygon on their left.

    start, end (E,) complex [m] ; owner (E,) cell of each edge ; area (N,) [m^2] ; centre (N, 2) [m]
    side (N,) [m] of the square that a cell was cut from ; whole (N,) bool : it is the square
    points (Q, 2) [m], of (Q,), weight (Q,) : quadrature over each cell, exact for squares of coordinates; the weights
    of a cell sum to 1
    """

    start: np.ndarray
    end: np.ndarray
    owner: np.ndarray
    area: np.ndarray
    centre: np.ndarray
    side: np.ndarray
    whole: np.ndarray
    points: np.ndarray
    of: np.ndarray
    weight: np.ndarray

    def __len__(self) -> int:
        return len(self.area)

    @cached_property
    def averaging(self) -> sparse.csr_matrix:
        """Means over the cells of values at the quadrature points, as a matrix (N, Q)."""
        return sparse.csr_matrix((self.weight, (self.of, np.arange(len(self.of)))), shape=(len(self), len(self.of)))


def fill_with_cells(mesh: BoundaryMesh, size: Callable[[np.ndarray], np.ndarray]) -> Cells:
    """Squares of at most the wanted side that fill a finite body.

    size : points (m, 2) -> wanted side (m,) [m] (a bem.plane.mesh.Sizing, for one)
    Raises CellError for a size that is not positive, and for more than MOST_CELLS cells.
    """
    if mesh.infinite:
        raise CellError("an infinite body cannot be filled with cells: cut it off, or go by the Laplace domain")
    corner, side = _quadtree(mesh, size)
    loops = [mesh.start[loop] for loop in mesh.loops]
    _, _, inward = mesh.locate(corner + side[:, None] / 2)
    near = np.abs(inward) < side * np.sqrt(0.5)
    edges, kept, whole = [], [], []
    for k in np.flatnonzero(near):
        pieces = [_clip(loop, corner[k], side[k]) for loop in loops]
        pieces = [piece for piece in pieces if len(piece) > 2]
        area = sum((polygon_moments(piece, np.roll(piece, -1))[0] for piece in pieces), 0.0)
        if pieces and area > _SLIVER * side[k] ** 2:
            edges.append((np.concatenate(pieces), np.concatenate([np.roll(piece, -1) for piece in pieces])))
            kept.append(k)
            whole.append(False)
    for k in np.flatnonzero(~near & (inward > 0)):
        square = complex(*corner[k]) + side[k] * np.array([0, 1, 1 + 1j, 1j])
        edges.append((square, np.roll(square, -1)))
        kept.append(k)
        whole.append(True)
    return _gather(edges, side[kept], np.array(whole))


def _gather(edges: list[tuple[np.ndarray, np.ndarray]], side: np.ndarray, whole: np.ndarray) -> Cells:
    areas, centres, points, owner_of_point, weights = [], [], [], [], []
    for k, (start, end) in enumerate(edges):
        area, centre = polygon_moments(start, end)
        areas.append(area)
        centres.append(centre)
        if whole[k]:
            place = centre + side[k] * np.sqrt(1 / 12) * np.array([-1 - 1j, 1 - 1j, 1 + 1j, -1 + 1j])
            weight = np.full(4, 0.25)
        else:  # signed triangles between the centre and each edge, each by the middles of its sides
            share = ((start - centre).conj() * (end - centre)).imag / 2 / area
            place = np.concatenate([(start + end) / 2, (start + centre) / 2, (end + centre) / 2])
            weight = np.tile(share / 3, 3)
        points.append(place)
        weights.append(weight)
        owner_of_point.append(np.full(len(place), k))
    start, end = (np.concatenate(ends) for ends in zip(*edges))
    owner = np.repeat(np.arange(len(edges)), [len(own) for own, _ in edges])
    centre, place = (np.column_stack([z.real, z.imag]) for z in (np.array(centres), np.concatenate(points)))
    quadrature = place, np.concatenate(owner_of_point), np.concatenate(weights)
    return Cells(start, end, owner, np.array(areas), centre, side, whole, *quadrature)


def _quadtree(mesh: BoundaryMesh, size: Callable[[np.ndarray], np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    """Lower left corners (m, 2) and sides (m,) of squares that meet the body, none larger than wanted at its centre
    and corners."""
    low, high = mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)
    extent = float((high - low).max())
    finest = np.asarray(size(np.vstack([mesh.vertices, (low + high)[None] / 2])), float)
    refuse_unless_positive(CellError, **{"cell size [m]": float(finest.min())})
    whole = float(finest.max())
    count = np.ceil((high - low) / min(whole, extent) - 1e-9).astype(int)
    if count.prod() > MOST_CELLS:
        raise CellError(
            f"{count.prod()} cells of {whole:.3g} m in a body of {extent:.3g} m, more than {MOST_CELLS}: choose a"
            " larger size"
        )
    side = np.full(count.prod(), (high - low)[np.argmax((high - low) / count)] / count[np.argmax((high - low) / count)])
    grid = np.stack(np.meshgrid(*map(np.arange, count), indexing="ij"), axis=-1).reshape(-1, 2)
    span = count * side[0]
    corner = (low + high - span) / 2 + grid * side[0]
    done: list[tuple[np.ndarray, np.ndarray]] = []
    around = np.array([[0.5, 0.5], [0, 0], [1, 0], [1, 1], [0, 1]])
    while len(side):
        sample = corner[:, None] + around * side[:, None, None]
        wanted = np.asarray(size(sample.reshape(-1, 2)), float).reshape(-1, 5).min(axis=1)
        refuse_unless_positive(CellError, **{"cell size [m]": float(wanted.min())})
        centre = corner + side[:, None] / 2
        _, _, inward = mesh.locate(centre)
        meets = inward > -side * np.sqrt(0.5)
        split = meets & (side > wanted * (1 + 1e-9))
        done.append((corner[meets & ~split], side[meets & ~split]))
        half = side[split] / 2
        corner = (corner[split][:, None] + half[:, None, None] * np.array([[0, 0], [1, 0], [0, 1], [1, 1]])).reshape(
            -1, 2
        )
        side = np.repeat(half, 4)
        total = sum(len(s) for _, s in done) + len(side)
        if total > 4 * MOST_CELLS:
            raise CellError(f"more than {MOST_CELLS} cells: choose a larger size, or keep the fine part smaller")
    corners, sides = np.vstack([c for c, _ in done]), np.concatenate([s for _, s in done])
    if len(sides) > MOST_CELLS:
        raise CellError(f"{len(sides)} cells, more than {MOST_CELLS}: choose a larger size")
    return corners, sides


def _clip(polygon: np.ndarray, corner: np.ndarray, side: float) -> np.ndarray:
    """A polygon (n,) complex cut to the square with the lower left corner (2,) (Sutherland and Hodgman).

    Pieces that the cut separates stay joined by edges passed twice in opposite senses, which add nothing to any
    integral over edges.
    """
    for part, low, sign in ((part, low, sign) for part, low in zip((np.real, np.imag), corner) for sign in (1, -1)):
        before, depth = np.roll(polygon, 1), part(polygon) - low if sign > 0 else low + side - part(polygon)
        last = np.roll(depth, 1)
        crosses = (last < 0) != (depth < 0)
        cut = before + (polygon - before) * np.divide(last, last - depth, out=np.zeros(len(depth)), where=crosses)
        polygon = np.stack([cut, polygon], axis=1)[np.stack([crosses, depth >= 0], axis=1)]
    # consecutive duplicates would be edges of no length
    return polygon[np.abs(polygon - np.roll(polygon, 1)) > 1e-12 * side]
