"""Frictionless contact of two elastic blocks by static finite elements in three dimensions: the reference solution for
the patch solvers of `bem`.

Nodes of both faces stand opposite each other. With N = (-dh/dx, -dh/ds, 1) of the mean of both faces, a pair is open by

    gap + (displacement of the upper node - displacement of the lower node) . N - approach,

which is zero where the pair presses and positive elsewhere. The set of pressing pairs is changed until none pulls and
none overlaps (primal-dual active set). Each set is one linear problem for displacements and approach under the load,
solved by conjugate gradients in the space of its constraints. The lower block's base is held; the upper block hangs at
a rigid plate that neither shifts nor turns. Small displacements; the faces' slopes are kept.
Sources: P. Wriggers, Computational Contact Mechanics (2006), chapters 5 and 10 (node pairs, active set); N. Gould, M.
Hribar, J. Nocedal, SIAM J. Sci. Comput. 23 (2001) 1376 (projected conjugate gradients).
Error: second order in the element for pressure and area (tests/versus/test_solid_contact.py).
"""

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy import sparse
from scipy.linalg import cho_factor, cho_solve

from bem.patch import ContactInputError, Cost, Grid, Patch
from rail_fem.static_fe.box_inverse import BoxInverse
from rail_fem.static_fe.small_strain import solid
from rail_fem.static_fe.solid_blocks import BlockPair, FineZone, LinedBlock, facing_blocks

TOLERANCE = 1e-6  # of the preconditioned residual, to that of the unloaded start
MOST_STEPS = 2000
MOST_SETS = 40


@dataclass
class FinitePatch(Patch):
    """Cells about the pairs of nodes of the fine zone; extent and area as every patch of `bem` (bem/patch_edge.py).

    nodes : of both blocks together;  size, width : of the elements along x and along s [m];  overlap : largest left [m]
    sets : active sets tried
    """

    nodes: int = 0
    size: float = np.nan
    width: float = np.nan
    overlap: float = np.nan
    sets: int = 0


class NodePairs:
    """Opposite nodes of both faces, c = a b of them, x slowest.

    x (a,), s (b,) [m];  lower, upper (c,) : nodes of each block;  gap (c,) [m];  area (c,) [m^2] seen along h;  normal
    (c, 3) : N
    """

    def __init__(self, lower: LinedBlock, upper: LinedBlock, s: np.ndarray) -> None:
        self.x, self.s = lower.x, s
        self.i, self.j = (index.ravel() for index in np.indices((len(self.x), len(s))))
        self.lower, self.upper = lower.face(self.i, self.j), upper.face(self.i, self.j)
        below, above = (
            block.mesh.points[nodes, 2].reshape(len(self.x), len(s))
            for block, nodes in ((lower, self.lower), (upper, self.upper))
        )
        self.gap = (above - below).ravel()
        self.area = np.outer(_shares(self.x), _shares(s)).ravel()
        along, across = np.gradient((above + below) / 2, self.x, s, edge_order=2)
        along[0] = 0.0  # symmetry
        self.normal = np.stack([-along, -across, np.ones_like(along)], axis=-1).reshape(-1, 3)


def _shares(line: np.ndarray) -> np.ndarray:
    """Length that belongs to each node of a line."""
    step = np.diff(line)
    return (np.r_[step, 0.0] + np.r_[0.0, step]) / 2


class ElasticPair:
    """Stiffness and approximate inverse of both blocks, one after the other; unknowns (3n + 1,) are displacements [m]
    and the approach [m]."""

    def __init__(self, pair: BlockPair, lower: LinedBlock, upper: LinedBlock, pairs: NodePairs) -> None:
        self.pairs, self.first = pairs, 3 * len(lower.mesh.points)
        sides = (lower, pair.lower_steel), (upper, pair.upper_steel)
        self.matrices = [solid(block.mesh, steel).stiffness() for block, steel in sides]
        self.inverses = [BoxInverse(block.x, block.s, block.z, steel) for block, steel in sides]
        self.offsets = lower.first, upper.first
        self.size = self.first + 3 * len(upper.mesh.points) + 1
        self.held = np.concatenate([_held(block) for block in (lower, upper)])
        rows = np.repeat(np.arange(len(pairs.gap)), 3)
        ends = [3 * nodes[:, None] + np.arange(3) for nodes in (pairs.lower, pairs.upper)]
        columns = np.concatenate(
            [ends[0].ravel(), ends[1].ravel() + self.first, np.full(len(pairs.gap), self.size - 1)]
        )
        values = np.concatenate([-pairs.normal.ravel(), pairs.normal.ravel(), np.full(len(pairs.gap), -1.0)])
        self.opening = sparse.csr_matrix(
            (values, (np.concatenate([rows, rows, np.arange(len(pairs.gap))]), columns)),
            shape=(len(pairs.gap), self.size),
        )
        self.opening = (self.opening @ sparse.diags(np.r_[~self.held, True].astype(float))).tocsr()
        # the approach's own share in the approximate inverse [m/N]
        self.ease = float(self._between(np.array([0]))[0, 0])

    def force(self, unknowns: np.ndarray) -> np.ndarray:
        """Elastic forces (3n + 1,) [N], none on what is held and none on the approach."""
        parts = [matrix @ part for matrix, part in zip(self.matrices, np.split(unknowns[:-1], [self.first]))]
        return np.r_[np.where(self.held, 0.0, np.concatenate(parts)), 0.0]

    def approximate(self, force: np.ndarray) -> np.ndarray:
        """Approximate inverse, (3n + 1,) to (3n + 1,)."""
        parts = [inverse(part) for inverse, part in zip(self.inverses, np.split(force[:-1], [self.first]))]
        return np.concatenate([*parts, [self.ease * force[-1]]])

    def _between(self, active: np.ndarray) -> np.ndarray:
        """Openings (m, m) of active pairs by the approximate inverse under unit forces that open them, displacements
        only [m/N]."""
        i, j, normal = self.pairs.i[active], self.pairs.j[active], self.pairs.normal[active]
        total = np.zeros((len(active), len(active)))
        for component in range(3):
            weight = normal[:, component]
            if weight.any():
                total += np.outer(weight, weight) * sum(
                    inverse.between_face_nodes(component, i, j + first)
                    for inverse, first in zip(self.inverses, self.offsets)
                )
        return total

    def projection(self, active: np.ndarray) -> Callable[[np.ndarray], np.ndarray]:
        """Function that takes openings (m,) of active pairs to the unknowns that the approximate inverse opens them
        with."""
        rows = self.opening[active]
        factor = cho_factor(self._between(active) + self.ease)
        return lambda opening: self.approximate(rows.T @ cho_solve(factor, opening))


def _held(block: LinedBlock) -> np.ndarray:
    """(3n,) bool: the plane behind, and along x on the mirror."""
    held = np.zeros((len(block.mesh.points), 3), bool)
    held[block.mesh.clamp] = True
    held[block.mesh.points[:, 0] < 1e-12, 0] = True
    return held.ravel()


def solve_set(
    pair: ElasticPair, active: np.ndarray, load: float, start: np.ndarray
) -> tuple[np.ndarray, np.ndarray, int]:
    """Unknowns, forces (m,) [N] of the active pairs that are held closed under a load [N], and the steps taken."""
    rows, open_by = pair.opening[active], pair.projection(active)
    push = np.zeros(pair.size)
    push[-1] = load

    def project(residual: np.ndarray) -> np.ndarray:
        move = pair.approximate(residual)
        return move - open_by(rows @ move)

    unknowns = start - open_by(pair.pairs.gap[active] + rows @ start)
    residual = push - pair.force(unknowns)
    move = project(residual)
    direction, rate = move.copy(), residual @ move
    scale = push @ project(push)
    for step in range(MOST_STEPS):
        if abs(rate) <= TOLERANCE**2 * scale:
            return unknowns, _pressing(pair, active, residual), step
        product = pair.force(direction)
        length = rate / (direction @ product)
        unknowns += length * direction
        residual -= length * product
        move = project(residual)
        before, rate = rate, residual @ move
        direction = move + rate / before * direction
    raise ArithmeticError(
        f"finite elements: the linear problem did not converge in {MOST_STEPS} steps (residual"
        f" {np.sqrt(rate / scale):.1e}): take shallower slopes or elements of less unequal sides"
    )


def _pressing(pair: ElasticPair, active: np.ndarray, residual: np.ndarray) -> np.ndarray:
    """Forces (m,) [N] with which the constraints hold what is left of the balance, residual = -opening.T @ force: from
    both faces."""
    normal, pressing = pair.pairs.normal[active], np.zeros(len(active))
    for sign, first, nodes in ((1, 0, pair.pairs.lower), (-1, pair.first, pair.pairs.upper)):
        at = first + 3 * nodes[active][:, None] + np.arange(3)
        pressing += sign * (normal * residual[at]).sum(axis=1) / (normal**2 * ~pair.held[at]).sum(axis=1)
    return pressing / 2


def finite_patch(pair: BlockPair, load: float, zone: FineZone, start: Patch | None = None) -> FinitePatch:
    """The patch under a load [N] along h.

    start : a patch whose contact begins the search for the pressing pairs (of coarser elements); without it the overlap
        of the faces
    Raises ContactInputError where load is not positive or the patch leaves the fine zone, ArithmeticError where the set
    does not settle.
    """
    if not (np.isfinite(load) and load > 0):
        raise ContactInputError(f"load {load!r} N: give a positive one")
    began = time.perf_counter()
    lower, upper, s = facing_blocks(pair, zone)
    pairs = NodePairs(lower, upper, s)
    elastic = ElasticPair(pair, lower, upper, pairs)
    first = _set_like(start, pairs) if start is not None else _overlapping(pairs, load, pair)
    settled = _settle(elastic, first, load / 2, began)
    pressure = (settled.force / pairs.area).reshape(len(pairs.x), len(s))
    grid, half = _fine_part(pairs, zone, pair.common, pressure)
    return FinitePatch(
        grid,
        pair.gap(*grid.points()),
        np.vstack([half[:0:-1], half]),
        settled.approach,
        f"finite elements, {zone.size * 1e3:.3g} x {zone.width * 1e3:.3g} mm",
        cost=settled.cost,
        nodes=(elastic.size - 1) // 3,
        size=zone.size,
        width=zone.width,
        overlap=float(max(-settled.opening.min(), 0.0)),
        sets=settled.sets,
    )


def _set_like(start: Patch, pairs: NodePairs) -> np.ndarray:
    i = np.clip(np.round((pairs.x - start.grid.x_first) / start.grid.dx).astype(int), 0, start.grid.nx - 1)
    j = np.clip(np.round((pairs.s - start.grid.y_first) / start.grid.dy).astype(int), 0, start.grid.ny - 1)
    near = (np.abs(pairs.x - start.grid.x[i]) < start.grid.dx)[:, None] & (
        np.abs(pairs.s - start.grid.y[j]) < start.grid.dy
    )
    return (start.contact[np.ix_(i, j)] & near).ravel()


def _overlapping(pairs: NodePairs, load: float, pair: BlockPair) -> np.ndarray:
    """Pairs whose gap is below the depth d at which a flat punch of their area A needs the load, 2 E* d sqrt(A /
    pi)."""
    modulus = 1 / (1 / pair.lower_steel.plane_modulus + 1 / pair.upper_steel.plane_modulus)
    order = np.argsort(pairs.gap)
    area, depth = 2 * np.cumsum(pairs.area[order]), pairs.gap[order] - pairs.gap.min()
    enough = int(np.searchsorted(2 * modulus * depth * np.sqrt(area / np.pi), load))
    active = np.zeros(len(order), bool)
    active[order[: max(enough, 4)]] = True
    return active


class Settled(NamedTuple):
    """The set of pairs that holds: forces (c,) [N], openings (c,) [m], approach [m], cost, number of sets tried."""

    force: np.ndarray
    opening: np.ndarray
    approach: float
    cost: Cost
    sets: int


def _settle(elastic: ElasticPair, active: np.ndarray, load: float, began: float) -> Settled:
    """The set of pairs that presses, from a first guess `active` (c,)."""
    unknowns, total = np.zeros(elastic.size), 0
    for count in range(1, MOST_SETS + 1):
        unknowns, pressing, steps = solve_set(elastic, np.flatnonzero(active), load, unknowns)
        total += steps
        force = np.zeros(len(active))
        force[active] = pressing
        opening = elastic.pairs.gap + elastic.opening @ unknowns
        wanted = np.where(active, force > 0, opening < -1e-5 * abs(unknowns[-1]))
        changed = int(np.count_nonzero(wanted != active))
        if not changed:
            if not abs(force.sum() / load - 1) < 1e-3:
                raise ArithmeticError(
                    f"finite elements: the pairs press with {2 * force.sum():.6g} N for a load of {2 * load:.6g} N:"
                    " lower TOLERANCE"
                )
            cost = Cost(time.perf_counter() - began, total, total)
            return Settled(force, opening, float(unknowns[-1]), cost, count)
        active = wanted
    raise ArithmeticError(
        f"finite elements: the pressing pairs did not settle in {MOST_SETS} rounds, {changed} still change: take"
        " another element size"
    )


def _fine_part(
    pairs: NodePairs, zone: FineZone, common: tuple[float, float], pressure: np.ndarray
) -> tuple[Grid, np.ndarray]:
    """Grid of the even part of the face, mirrored, and the pressure of its half; refuses pressure outside it."""
    x, s = pairs.x, pairs.s
    rows = int(np.searchsorted(x, min(zone.along, x[-1]) + 1e-9))
    first = int(np.searchsorted(s, max(zone.across[0], common[0]) - 1e-9))
    last = int(np.searchsorted(s, min(zone.across[1], common[1]) + 1e-9))
    outside = pressure.copy()
    outside[:rows, first:last] = 0.0
    if outside.any():
        raise ContactInputError(
            f"the patch leaves the fine zone (x to {zone.along:g} m, s {zone.across} m), {np.count_nonzero(outside)}"
            " nodes outside it press: widen it"
        )
    grid = Grid(
        -(rows - 1) * x[1], float(s[first]), float(x[1]), float(s[first + 1] - s[first]), 2 * rows - 1, last - first
    )
    return grid, pressure[:rows, first:last]
