"""Which point of the slave faces which of the master: gaps, and the transfer of tractions from one mesh to the other.

The slave's normals decide: the gap at a point is the distance along the slave's outward normal to the master's face,
measured between the smooth profiles and not between the meshes. Tractions live on the slave's hats; the master
receives, cell by cell, the very force that the slave gives off, so action equals reaction to round-off on any two
meshes.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bem.plane.curve import Curve, curve_position
from bem.plane.mesh import BoundaryMesh
from bem.plane.outline import Outline
from kernel_cache import njit

# deepest overlap over the reach: farther behind a point of the slave, a master's face is beyond the slave's own body
BEHIND = 0.1


class PairingError(ValueError):
    """Two faces that do not face each other anywhere."""


@dataclass(frozen=True)
class Feet:
    """Where rays from (m,) points along their normals meet a polyline: found (m,), segment (m,), fraction (m,), gap
    (m,) [m]."""

    found: np.ndarray
    segment: np.ndarray
    fraction: np.ndarray
    gap: np.ndarray


def intersect(
    points: np.ndarray, normals: np.ndarray, begin: np.ndarray, end: np.ndarray, reach: float, behind: float = 1.0
) -> Feet:
    """Nearest intersection, ahead or behind, of lines through points (m, 2) along unit normals with segments (k, 2)
    that face them.

    A segment faces a normal when its own outward side (the right of begin to end) looks against it.
    Intersections farther than `reach` [m] ahead, or `behind` times that behind, do not count.
    """
    arrays = (np.ascontiguousarray(array, dtype=float) for array in (points, normals, begin, end))
    return Feet(*_intersect(*arrays, reach, behind))


_SLACK = 1e-9  # of a segment's length, by which an intersection may lie beyond its ends
NEWTON = 4  # steps along a curve


@njit(cache=True, nogil=True)
def _intersect(points, normals, begin, end, reach, behind):
    count = len(points)
    found, segment = np.zeros(count, np.bool_), np.zeros(count, np.int64)
    fraction, gap = np.zeros(count), np.full(count, np.inf)
    for i in range(count):
        x, y, nx, ny = points[i, 0], points[i, 1], normals[i, 0], normals[i, 1]
        nearest = np.inf
        for k in range(len(begin)):
            step_x, step_y = end[k, 0] - begin[k, 0], end[k, 1] - begin[k, 1]
            travel = step_x * ny - step_y * nx
            if nx * step_y - ny * step_x >= 0.0 or travel == 0.0:  # looks away, or along the normal
                continue
            away_x, away_y = begin[k, 0] - x, begin[k, 1] - y
            share = -(away_x * ny - away_y * nx) / travel
            if not -_SLACK <= share <= 1 + _SLACK:
                continue
            far = (away_x + share * step_x) * nx + (away_y + share * step_y) * ny
            if -behind * reach <= far <= reach and abs(far) < nearest:
                nearest = abs(far)
                found[i], segment[i], fraction[i], gap[i] = True, k, min(max(share, 0.0), 1.0), far
    return found, segment, fraction, gap


@njit(cache=True, nogil=True)
def _feet_on_curve(start, points, normals, knots, through, tangents):
    """Gap (m,) and the curve's outward normal (m, 2) where lines through points (m, 2) along normals meet a curve
    (bem.plane.curve.Curve), from parameters near by: Newton along the curve, whose distance across the normal must
    vanish."""
    gap, outward = np.empty(len(start)), np.empty((len(start), 2))
    for k in range(len(start)):
        s, nx, ny = start[k], normals[k, 0], normals[k, 1]
        for count in range(NEWTON + 1):
            x, y, dx, dy = curve_position(s, knots, through, tangents)
            x, y = x - points[k, 0], y - points[k, 1]
            if count < NEWTON:
                s = min(max(s - (y * nx - x * ny) / (dy * nx - dx * ny), 0.0), knots[-1])
        gap[k], outward[k, 0], outward[k, 1] = x * nx + y * ny, dy, -dx
    return gap, outward


def smooth_gap(
    points: np.ndarray, normals: np.ndarray, curves: list[Curve], reach: float, behind: float = 1.0
) -> np.ndarray:
    """Gap (m,) [m] along the normals to smooth curves; inf where none is met within `reach` [m]."""
    return smooth_feet(points, normals, curves, reach, behind)[0]


def smooth_feet(
    points: np.ndarray, normals: np.ndarray, curves: list[Curve], reach: float, behind: float = 1.0
) -> tuple[np.ndarray, np.ndarray]:
    """Gap (m,) [m] along the normals to smooth curves, inf where none is met, and the curves' outward normals there (m,
    2)."""
    parameter = [np.unique(np.r_[c.knots, np.linspace(0, c.length, 65)]) for c in curves]
    samples = [c.at(s) for c, s in zip(curves, parameter)]
    owner = np.concatenate([np.full(len(s) - 1, k) for k, s in enumerate(parameter)])
    feet = intersect(
        points, normals, np.vstack([s[:-1] for s in samples]), np.vstack([s[1:] for s in samples]), reach, behind
    )
    low, high = np.concatenate([s[:-1] for s in parameter]), np.concatenate([s[1:] for s in parameter])
    s = low[feet.segment] + feet.fraction * (high - low)[feet.segment]
    gap, outward = feet.gap.copy(), -normals
    for k, curve in enumerate(curves):
        mine = np.flatnonzero(feet.found & (owner[feet.segment] == k))
        gap[mine], outward[mine] = _feet_on_curve(
            s[mine], points[mine], normals[mine], curve.knots, curve.points, curve.tangents
        )
    return gap, outward


@dataclass(frozen=True)
class Interface:
    """n contact nodes: densities of the slave's mesh, with what they face.

    nodes (n,) ; points (n, 2) [m] of the slave; normals (n, 2) from slave to master; mass (n,) [m] integral of each hat
    gap (n,) [m]; feet (n, 2) : opposite points on the master's mesh
    on_slave (2Ns, 2n), on_master (2Nm, 2n) : cell forces per unit traction of each node on the slave, x then y
    """

    nodes: np.ndarray
    points: np.ndarray
    normals: np.ndarray
    mass: np.ndarray
    gap: np.ndarray
    feet: np.ndarray
    on_slave: np.ndarray
    on_master: np.ndarray


def _two_axes(matrix: np.ndarray) -> np.ndarray:
    zero = np.zeros_like(matrix)
    return np.block([[matrix, zero], [zero, matrix]])


def own_cells(mesh: BoundaryMesh, nodes: np.ndarray) -> np.ndarray:
    """Cell forces (N, n) of unit tractions at nodes on their own mesh."""
    column = mesh.places(nodes)
    matrix = np.zeros((mesh.densities, len(nodes)))
    for cell, near, far in ((mesh.first, mesh.first, mesh.last), (mesh.last, mesh.last, mesh.first)):
        for hat, share in ((near, 0.375), (far, 0.125)):
            used = column[hat] >= 0
            np.add.at(matrix, (cell[used], column[hat[used]]), share * mesh.lengths[used])
    return matrix


class _Chain:
    """The master's face as one running coordinate: elements in order, `ends` (k + 1,) [m]; separate pieces stay
    apart."""

    def __init__(self, mesh: BoundaryMesh, face: str) -> None:
        self.mesh, self.elements = mesh, np.flatnonzero(mesh.names == face)
        lengths = mesh.lengths[self.elements]
        broken = np.r_[False, mesh.following[self.elements[:-1]] != self.elements[1:]]
        self.begin = np.r_[0.0, np.cumsum(lengths)[:-1]] + np.cumsum(broken) * 1e3 * mesh.lengths.sum()
        self.middle, self.end = self.begin + lengths / 2, self.begin + lengths
        self.cuts = np.unique(np.r_[self.begin, self.middle, self.end])

    def vertices(self) -> tuple[np.ndarray, np.ndarray]:
        a = self.mesh.vertices[self.elements]
        return a, self.mesh.vertices[self.mesh.following[self.elements]]

    def cell(self, position: np.ndarray) -> np.ndarray:
        """Density whose cell holds the coordinate."""
        k = np.clip(np.searchsorted(self.begin, position, side="right") - 1, 0, len(self.begin) - 1)
        element = self.elements[k]
        return np.where(position < self.middle[k], self.mesh.first[element], self.mesh.last[element])


def _transfer(slave: BoundaryMesh, nodes: np.ndarray, chain: _Chain, position: np.ndarray) -> np.ndarray:
    """Forces (Nm, n) on the master's cells of unit tractions at the slave's nodes; position (k, 2) : feet of element
    ends, nan if none."""
    column = slave.places(nodes)
    matrix = np.zeros((chain.mesh.densities, len(nodes)))
    used = np.flatnonzero((column[slave.first] >= 0) | (column[slave.last] >= 0))
    for e in used:
        a, b = position[e]
        torn = not abs(b - a) < 3 * slave.lengths[e]  # also when an end has no foot
        a, b = (b if np.isnan(a) else a), (a if np.isnan(b) else b)
        if torn or a == b:
            cuts, targets = np.array([0.0, 0.5, 1.0]), np.array([a, b])
        else:
            between = chain.cuts[(chain.cuts > min(a, b)) & (chain.cuts < max(a, b))]
            cuts = np.sort(np.r_[0.0, (between - a) / (b - a), 1.0])
            targets = a + (b - a) * (cuts[1:] + cuts[:-1]) / 2
        cells = chain.cell(targets)
        rise = slave.lengths[e] * np.diff(cuts**2) / 2
        fall = slave.lengths[e] * np.diff(cuts) - rise
        for hat, share in ((slave.first[e], fall), (slave.last[e], rise)):
            if column[hat] >= 0:
                np.add.at(matrix, (cells, column[hat]), share)
    return matrix


def pair(
    slave: BoundaryMesh,
    slave_face: str,
    master: BoundaryMesh,
    master_face: str,
    master_outline: Outline,
    reach: float,
    share: float = 1.0,
) -> Interface:
    """Pair the slave's densities on its face with the master's face, where their normals meet it within `reach` [m].

    share : weight of the slave's own normal in the interface's; the rest is the master's. The deformed interface lies
        nearer the
            shape of the stiffer body, and a wrong slope x/R turns an approach into a spurious slip of approach * x/R.
    """
    chain = _Chain(master, master_face)
    begin, end = chain.vertices()
    candidates = slave.of_edge(slave_face)
    feet = intersect(slave.middles[candidates], slave.normals[candidates], begin, end, reach, BEHIND)
    gap, facing = smooth_feet(
        slave.middles[candidates], slave.normals[candidates], master_outline.edge_curves(master_face), reach, BEHIND
    )
    normals = share * slave.normals[candidates] - (1 - share) * facing
    normals /= np.hypot(*normals.T)[:, None]
    chosen = feet.found & np.isfinite(gap)
    if not chosen.any():
        raise PairingError(
            f"no point of the slave's face {slave_face!r} meets the master's {master_face!r} within {reach:g} m along"
            " its normal: check positions, and that the faces look at each other"
        )
    nodes = candidates[chosen]
    opposite = begin[feet.segment] + feet.fraction[:, None] * (end - begin)[feet.segment]
    on_slave = own_cells(slave, nodes)
    on_master = _transfer(slave, nodes, chain, _element_feet(slave, nodes, chain, begin, end, reach))
    facing = normals[chosen], on_slave.sum(axis=0), gap[chosen], opposite[chosen]
    return Interface(nodes, slave.middles[nodes], *facing, _two_axes(on_slave), _two_axes(on_master))


def _element_feet(
    slave: BoundaryMesh, nodes: np.ndarray, chain: _Chain, begin: np.ndarray, end: np.ndarray, reach: float
) -> np.ndarray:
    """Chain coordinate (k, 2) of the feet of both ends of each slave element that carries a node; nan where there is
    none."""
    position = np.full((slave.elements, 2), np.nan)
    carries = np.zeros(slave.densities, bool)
    carries[nodes] = True
    used = np.flatnonzero(carries[slave.first] | carries[slave.last])
    for side, vertex, density in ((0, used, slave.first[used]), (1, slave.following[used], slave.last[used])):
        feet = intersect(slave.vertices[vertex], slave.normals[density], begin, end, reach, BEHIND)
        along = chain.begin[feet.segment] + feet.fraction * (chain.end - chain.begin)[feet.segment]
        position[used, side] = np.where(feet.found, along, np.nan)
    # a node met the master though neither end of its element did
    inner = np.isnan(position[used]).all(axis=1)
    for e in used[inner]:
        both = [slave.first[e], slave.last[e]]
        feet = intersect(slave.middles[both], slave.normals[both], begin, end, reach, BEHIND)
        along = chain.begin[feet.segment] + feet.fraction * (chain.end - chain.begin)[feet.segment]
        position[e] = along[feet.found].mean() if feet.found.any() else np.nan
    return position
