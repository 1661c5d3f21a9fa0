"""Boundary mesh: straight elements between points of the outline, and the cells that carry the conditions.

A density (a hat of fictitious force) belongs to each vertex on a smooth piece of boundary; a corner, and the position
where one edge's name gives way to another's, has two, one for each side. The cell of a density is the half of each of
its elements next to it: tractions are imposed as resultants over cells, displacements at the cell's middle.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from scipy.spatial import cKDTree

from bem.checks import plane_points, refuse_unless_positive
from bem.plane.curve import divide
from bem.plane.outline import CORNER, Outline, OutlineError
from kernel_cache import njit


@dataclass(frozen=True)
class Zone:
    """Where the mesh is fine: elements of `size` [m] within `radius` [m] of the points (m, 2) [m]."""

    points: np.ndarray
    size: float
    radius: float = 0.0


@dataclass(frozen=True)
class Sizing:
    """Wanted element length: coarse far away, growing by `growth` per metre of distance from the zones.

    coarse : largest element [m]; zones : fine positions; growth : increase of size per distance
    """

    coarse: float
    zones: list[Zone] = field(default_factory=list)
    growth: float = 0.25

    def __post_init__(self) -> None:
        refuse_unless_positive(OutlineError, **{"coarse size": self.coarse, "growth": self.growth})
        for zone in self.zones:
            refuse_unless_positive(OutlineError, **{"zone size": zone.size})
            if not len(plane_points(np.atleast_2d(zone.points), OutlineError)):
                raise OutlineError("a zone has no points: leave it out or say where it is")

    def __call__(self, points: np.ndarray) -> np.ndarray:
        wanted = np.full(len(points), self.coarse)
        for zone in self.zones:
            distance = cKDTree(np.atleast_2d(zone.points)).query(points)[0]
            wanted = np.minimum(wanted, zone.size + self.growth * np.maximum(distance - zone.radius, 0))
        return wanted


@dataclass(frozen=True)
class BoundaryMesh:
    """k elements, n densities, k vertices (loops are closed).

    vertices (k, 2) [m]; element e runs from vertices[e] to vertices[following[e]]; the material is on its left
    first, last (k,) : density that falls from the element's start, that rises to its end
    names (k,)       : name of the element's edge
    normals (n, 2)   : outward unit normal at each density; cell_length (n,) [m]; middles (n, 2) : middle of the cell
    [m]
    smooth (n,)      : the density sits on a smooth piece (its cell has two halves)
    infinite         : the material is the whole plane around the loops
    """

    vertices: np.ndarray
    following: np.ndarray
    first: np.ndarray
    last: np.ndarray
    names: np.ndarray
    normals: np.ndarray
    cell_length: np.ndarray
    middles: np.ndarray
    smooth: np.ndarray
    infinite: bool

    @property
    def elements(self) -> int:
        return len(self.vertices)

    @property
    def densities(self) -> int:
        return len(self.normals)

    @property
    def loops(self) -> list[slice]:
        """The elements of each closed loop, which end where the next is not the neighbour in the list."""
        ends = np.flatnonzero(self.following != np.arange(1, self.elements + 1)) + 1
        return [slice(int(low), int(high)) for low, high in zip(np.r_[0, ends[:-1]], ends)]

    @property
    def start(self) -> np.ndarray:
        """Complex starts of the elements (k,)."""
        return self.vertices[:, 0] + 1j * self.vertices[:, 1]

    @property
    def end(self) -> np.ndarray:
        """Complex ends of the elements (k,)."""
        return self.start[self.following]

    @property
    def lengths(self) -> np.ndarray:
        return np.abs(self.end - self.start)

    def of_edge(self, name: str) -> np.ndarray:
        """Indices of the densities on edges called `name`."""
        chosen = self.names == name
        if not chosen.any():
            raise OutlineError(f"no edge is called {name!r}: there are {sorted(set(self.names))}")
        return np.unique(np.r_[self.first[chosen], self.last[chosen]])

    def places(self, nodes: np.ndarray) -> np.ndarray:
        """Where each density (n,) stands among `nodes`, densities of this mesh; -1 where it is none of them."""
        place = np.full(self.densities, -1)
        place[nodes] = np.arange(len(nodes))
        return place

    def locate(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Nearest element (m,) of points (m, 2) [m], the foot's fraction along it, and the distance [m] from it,
        positive within the body."""
        start, end = self.start, self.end
        return _nearest(points[:, 0], points[:, 1], start.real, start.imag, end.real, end.imag)

    def positions(self) -> np.ndarray:
        """Where each density sits (n, 2): its vertex [m]."""
        position = np.empty((self.densities, 2))
        position[self.first] = self.vertices
        position[self.last] = self.vertices[self.following]
        return position

    def paths(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Halves of elements: complex points (2k,), indices of both ends (2k,) each, the cell (2k,) each half belongs
        to."""
        k = self.elements
        element = np.arange(k)
        points = np.r_[self.start, (self.start + self.end) / 2]
        return (points, np.r_[element, k + element], np.r_[k + element, self.following], np.r_[self.first, self.last])


@njit(cache=True)
def _nearest(x, y, ax, ay, bx, by):
    """Nearest segment of each point: its index, the foot's fraction along it, and the signed distance (left positive)
    [m]."""
    index, fraction, distance = np.zeros(x.size, np.int64), np.zeros(x.size), np.zeros(x.size)
    for i in range(x.size):
        best, best_side = np.inf, 0.0
        for e in range(ax.size):
            dx, dy = bx[e] - ax[e], by[e] - ay[e]
            px, py = x[i] - ax[e], y[i] - ay[e]
            square = dx * dx + dy * dy
            t = min(max((px * dx + py * dy) / square, 0.0), 1.0)
            away = (px - t * dx) ** 2 + (py - t * dy) ** 2
            side = (dx * py - dy * px) / np.sqrt(square)
            # of two segments that share the nearest vertex, the one seen less from its end tells the side
            if away < best * (1 - 1e-12) - 1e-300 or (away <= best * (1 + 1e-12) and abs(side) > abs(best_side)):
                best, best_side = away, side
                index[i], fraction[i], distance[i] = e, t, np.copysign(np.sqrt(away), side)
    return index, fraction, distance


def _number_densities(double: np.ndarray, following: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Density indices (first, last) of the elements; double (k,) marks vertices that carry two densities."""
    count = np.cumsum(np.where(double, 2, 1))
    at_start = count - 1  # the later one of a pair belongs to the element that leaves the vertex
    return at_start, (at_start - double)[following]


def _loop_vertices(curves, size) -> tuple[list[np.ndarray], list[np.ndarray], list[str]]:
    """Vertices, directions (leaving, arriving) of each element of a loop and its name."""
    points, directions, names = [], [], []
    for curve, name in curves:
        s = divide(curve, size)
        points.append(curve.at(s[:-1]))
        along = curve.direction(s)
        directions.append(np.stack([along[:-1], along[1:]], axis=1))
        names += [name] * (len(s) - 1)
    return points, directions, names


def mesh_outline(outline: Outline, size: Callable[[np.ndarray], np.ndarray]) -> BoundaryMesh:
    """Divide an outline into straight elements of about the wanted size (a Sizing, or any function of points)."""
    vertices, directions, following = [], [], []
    names: list[str] = []
    for curves in outline.curves:
        points, along, labels = _loop_vertices(curves, size)
        if len(labels) < 3:
            raise OutlineError(f"a loop got {len(labels)} elements: choose a size below {outline.size / 4:g} m")
        offset = len(names)
        vertices += points
        directions += along
        names += labels
        following.append(offset + (np.arange(len(labels)) + 1) % len(labels))
    vertices, directions, names = np.vstack(vertices), np.concatenate(directions), np.array(names)
    return _build(vertices, directions, names, np.concatenate(following), outline.infinite)


def _build(vertices, directions, names, following, infinite) -> BoundaryMesh:
    k = len(vertices)
    leaving, arriving = directions[:, 0], np.empty((k, 2))
    arriving[following] = directions[:, 1]
    before = np.empty(k, int)
    before[following] = np.arange(k)
    turn = np.angle((leaving[:, 0] + 1j * leaving[:, 1]) / (arriving[:, 0] + 1j * arriving[:, 1]))
    double = (np.abs(turn) > CORNER) | (names != names[before])
    first, last = _number_densities(double, following)
    n = int(first.max() + 1)
    start, end = vertices, vertices[following]
    length = np.hypot(*(end - start).T)
    cell_length = np.bincount(first, length / 2, n) + np.bincount(last, length / 2, n)
    tangent = np.zeros((n, 2))
    np.add.at(tangent, first, leaving)
    np.add.at(tangent, last, directions[:, 1])
    tangent /= np.hypot(*tangent.T)[:, None]
    smooth = np.zeros(n, bool)
    smooth[first[~double]] = True
    middles = np.empty((n, 2))
    middles[first] = np.where(double[:, None], 0.75 * start + 0.25 * end, start)
    ends_double = double[following]
    middles[last[ends_double]] = (0.25 * start + 0.75 * end)[ends_double]
    normals = np.column_stack([tangent[:, 1], -tangent[:, 0]])
    return BoundaryMesh(vertices, following, first, last, names, normals, cell_length, middles, smooth, infinite)
