"""The boundary of a body: closed loops of named edges, checked before anything is computed."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from bem.checks import point_text
from bem.plane.curve import Curve, split_at_corners
from kernel_cache import njit

CORNER = np.radians(20.0)


class OutlineError(ValueError):
    """A boundary that encloses no body: open, crossing itself, or without area."""


@dataclass(frozen=True)
class Edge:
    """A named piece of boundary through points (n, 2) [m]; corners inside it are found where it turns by over 20
    degrees."""

    points: np.ndarray
    name: str = "free"


@njit(cache=True)
def _first_crossing(a, b, loop, position):
    """Indices of the first two segments a[i]-b[i] that cross or touch without being neighbours, or (-1, -1)."""
    n = a.shape[0]
    for i in range(n):
        dx, dy = b[i, 0] - a[i, 0], b[i, 1] - a[i, 1]
        low_x, high_x = min(a[i, 0], b[i, 0]), max(a[i, 0], b[i, 0])
        low_y, high_y = min(a[i, 1], b[i, 1]), max(a[i, 1], b[i, 1])
        for j in range(i + 1, n):
            if (
                min(a[j, 0], b[j, 0]) > high_x
                or max(a[j, 0], b[j, 0]) < low_x
                or min(a[j, 1], b[j, 1]) > high_y
                or max(a[j, 1], b[j, 1]) < low_y
            ):
                continue
            if loop[i] == loop[j] and (
                position[j] - position[i] == 1
                or (position[i] == 0 and j + 1 < n and loop[j + 1] != loop[j])
                or (position[i] == 0 and j + 1 == n)
            ):
                continue  # neighbours share an end
            ex, ey = b[j, 0] - a[j, 0], b[j, 1] - a[j, 1]
            side_1 = dx * (a[j, 1] - a[i, 1]) - dy * (a[j, 0] - a[i, 0])
            side_2 = dx * (b[j, 1] - a[i, 1]) - dy * (b[j, 0] - a[i, 0])
            side_3 = ex * (a[i, 1] - a[j, 1]) - ey * (a[i, 0] - a[j, 0])
            side_4 = ex * (b[i, 1] - a[j, 1]) - ey * (b[i, 0] - a[j, 0])
            if side_1 * side_2 <= 0 and side_3 * side_4 <= 0:
                return i, j
    return -1, -1


def _crossing_point(a: np.ndarray, b: np.ndarray, c: np.ndarray, d: np.ndarray) -> np.ndarray:
    """Where segments a-b and c-d (2,) [m] that meet do so; of segments on one line, an end that lies on the other."""
    along, other = b - a, d - c
    turn = along[0] * other[1] - along[1] * other[0]
    if abs(turn) > 1e-12 * np.hypot(*along) * np.hypot(*other):
        return a + along * ((c - a)[0] * other[1] - (c - a)[1] * other[0]) / turn
    shares = np.clip([(c - a) @ along / (along @ along), (d - a) @ along / (along @ along)], 0, 1)
    return a + along * shares.mean()


def encloses(polygon: np.ndarray, point: np.ndarray) -> bool:
    """Whether a point (2,) lies within a polygon (n, 2): a ray to the right leaves it an odd number of times."""
    (x, y), (next_x, next_y) = polygon.T, np.roll(polygon, -1, axis=0).T
    passed = (y > point[1]) != (next_y > point[1])
    with np.errstate(divide="ignore", invalid="ignore"):
        right = x + (point[1] - y) / (next_y - y) * (next_x - x) > point[0]
    return bool(np.count_nonzero(passed & right) % 2)


def polygon_moments(start: np.ndarray, end: np.ndarray) -> tuple[float, complex]:
    """Area [m^2], positive anticlockwise, and centroid [m] of closed polygons given by directed edges, complex."""
    origin = start[0]
    a, b = start - origin, end - origin
    double = (a.conj() * b).imag
    area = double.sum() / 2
    if area == 0:
        return 0.0, origin
    return float(area), origin + ((a + b) * double).sum() / (6 * area)


def _close(edges: list[Edge], number: int) -> np.ndarray:
    """Polygon (n, 2) of a loop without its repeated points; refuses a loop that does not close."""
    everything = np.vstack([edge.points for edge in edges])
    size = np.ptp(everything, axis=0).max()
    for edge, following in zip(edges, edges[1:] + edges[:1]):
        gap = float(np.hypot(*(np.asarray(edge.points[-1]) - np.asarray(following.points[0]))))
        if gap > 1e-9 * size:
            raise OutlineError(
                f"loop {number} is open: edge {edge.name!r} ends at {point_text(edge.points[-1])} m and the next, "
                f"{following.name!r}, begins {gap:.3g} m away; let edges share their end points"
            )
    return np.vstack([np.asarray(edge.points, float)[:-1] for edge in edges])


def _turn_round(edges: list[Edge]) -> list[Edge]:
    return [Edge(np.asarray(edge.points)[::-1], edge.name) for edge in reversed(edges)]


@dataclass(frozen=True)
class Outline:
    """Closed loops of edges with the material on their left.

    loops    : each a list of Edge that share end points; either sense, it is turned as needed: the loop of the largest
        area
               encloses the body, the others are holes
    infinite : the body is the whole plane around the loops
    """

    loops: list[list[Edge]]
    infinite: bool = False

    def __post_init__(self) -> None:
        if not self.loops or not all(
            isinstance(loop, list) and loop and all(isinstance(e, Edge) for e in loop) for loop in self.loops
        ):
            raise OutlineError(
                "an outline needs at least one loop of at least one edge: give a list of loops, each a list of Edge"
            )
        checked = [[Edge(Curve.through(edge.points).points, edge.name) for edge in loop] for loop in self.loops]
        polygons = [_close(loop, number) for number, loop in enumerate(checked)]
        corners = [polygon[:, 0] + 1j * polygon[:, 1] for polygon in polygons]
        areas = np.array([polygon_moments(z, np.roll(z, -1))[0] for z in corners])
        for number, (polygon, area) in enumerate(zip(polygons, areas)):
            if len(polygon) < 3 or abs(area) < 1e-9 * np.ptp(polygon, axis=0).max() ** 2:
                raise OutlineError(f"loop {number} encloses no area ({area:.3g} m^2 from {len(polygon)} points)")
        outer = -1 if self.infinite else int(np.argmax(np.abs(areas)))
        wanted = np.where(np.arange(len(areas)) == outer, 1, -1)
        turned = [loop if area * sign > 0 else _turn_round(loop) for loop, area, sign in zip(checked, areas, wanted)]
        polygons = [_close(loop, number) for number, loop in enumerate(turned)]
        self._refuse_crossing(polygons)
        self._refuse_nesting(polygons, outer)
        object.__setattr__(self, "loops", turned)

    def _refuse_crossing(self, polygons: list[np.ndarray]) -> None:
        begin = np.vstack(polygons)
        end = np.vstack([np.roll(polygon, -1, axis=0) for polygon in polygons])
        loop = np.concatenate([np.full(len(polygon), k) for k, polygon in enumerate(polygons)])
        position = np.concatenate([np.arange(len(polygon)) for polygon in polygons])
        i, j = _first_crossing(begin, end, loop, position)
        if i >= 0:
            position_met = point_text(_crossing_point(begin[i], end[i], begin[j], end[j]))
            raise OutlineError(
                f"the outline crosses or touches itself near {position_met} m (segment {position[i]} of loop {loop[i]}"
                f" and segment {position[j]} of loop {loop[j]}): repair the profile or remove its loop"
            )

    def _refuse_nesting(self, polygons: list[np.ndarray], outer: int) -> None:
        """Loops that do not cross must be holes side by side within the outer loop (of an infinite body: side by
        side)."""
        for number, polygon in enumerate(polygons):
            within = [k for k, other in enumerate(polygons) if k != number and encloses(other, polygon[0])]
            wanted = [] if number == outer or self.infinite else [outer]
            if within != wanted:
                where = f"lies within loops {within}" if within else f"lies outside loop {outer}, the largest"
                raise OutlineError(
                    f"loop {number}, which begins at {point_text(polygon[0])} m, {where}: holes lie side by side within"
                    " the body; give separate bodies separate outlines"
                )

    def moved(self, by: np.ndarray) -> Outline:
        """The outline translated by (2,) [m]."""
        return Outline(
            [[Edge(edge.points + np.asarray(by), edge.name) for edge in loop] for loop in self.loops], self.infinite
        )

    @property
    def size(self) -> float:
        """Largest extent [m]."""
        return float(np.ptp(np.vstack([edge.points for loop in self.loops for edge in loop]), axis=0).max())

    @cached_property
    def curves(self) -> list[list[tuple[Curve, str]]]:
        """Smooth curves of each loop in order, each with its edge's name."""
        return [
            [(Curve.through(piece), edge.name) for edge in loop for piece in split_at_corners(edge.points, CORNER)]
            for loop in self.loops
        ]

    def edge_curves(self, name: str) -> list[Curve]:
        """Smooth curves of the edges called `name`, in the outline's order."""
        found = [curve for loop in self.curves for curve, label in loop if label == name]
        if not found:
            names = sorted({label for loop in self.curves for _, label in loop})
            raise OutlineError(f"no edge is called {name!r}: there are {names}")
        return found


def block_behind(profile: np.ndarray, level: float) -> Outline:
    """Body between an open profile and a straight held edge at the height `level` [m].

    profile : (n, 2) points [m] from one side to the other; the body lies above it when level is above it, else below
    Edges: "face" (the profile), "side" (two), "held" (straight).
    """
    profile = Curve.through(profile).points
    if profile[0, 0] > profile[-1, 0]:
        profile = profile[::-1]
    low, high = profile[:, 1].min(), profile[:, 1].max()
    if low <= level <= high:
        raise OutlineError(
            f"held edge at {level:g} m lies within the profile's heights {low:g} to {high:g} m: move it away"
        )
    first, last = (profile[0, 0], level), (profile[-1, 0], level)
    corners = [("side", profile[-1], last), ("held", last, first), ("side", first, profile[0])]
    return Outline([[Edge(profile, "face"), *(Edge(np.array([a, b]), name) for name, a, b in corners)]])
