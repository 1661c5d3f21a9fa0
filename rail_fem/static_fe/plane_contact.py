"""Frictionless contact of two plane bodies by static finite elements: the reference solution for bem/plane/contact.py.

The pressure has a value, none negative, at each node of the upper face and is linear between them; the gap is closed in
the mean, weighted with the same hats (a mortar method). Points of the two faces with the same x face each other; the
pressure acts along the upper face's normal. Small displacements.
Error: second order in the element inside the patch; over the whole profile first order, since its edge, where the
pressure rises as a square root, lies anywhere between two nodes (tests/versus/test_plane_strain.py).
Source: P. Wriggers, Computational Contact Mechanics (2006), chapter 8; the active set is that of a quadratic programme.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from bem.plane.body import Body
from bem.steel.hardening import Hardening
from rail_fem.static_fe.plane_strain import Fineness, PlaneBody
from rail_fem.static_fe.small_strain import ELASTIC, SmallStrainError

GAUSS = np.polynomial.legendre.leggauss(4)


@dataclass(frozen=True)
class PlaneContact:
    """x (n,) [m] nodes of the upper face; pressure (n,) [Pa]; approach [m] of the holders; fixed, moving : PlaneBody
    fixed_displacement : (2m,) [m] of its nodes, x and y in turn
    """

    fixed: PlaneBody
    moving: PlaneBody
    x: np.ndarray
    pressure: np.ndarray
    approach: float
    fixed_displacement: np.ndarray

    @property
    def lowest(self) -> float:
        """Largest downward displacement of the fixed body's nodes [m], negative."""
        return float(self.fixed_displacement[1::2].min())

    def von_mises(self) -> tuple[np.ndarray, np.ndarray]:
        """Points (p, 2) [m] in the fixed body and von Mises stress (p,) [Pa] there."""
        return self.fixed.von_mises(self.fixed_displacement)


def shapes(t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Quadratic shapes (..., 3) of first, middle and last node at t in (0, 1), and their derivatives."""
    t = np.asarray(t)[..., None]
    values = np.concatenate([(1 - t) * (1 - 2 * t), 4 * t * (1 - t), t * (2 * t - 1)], axis=-1)
    return values, np.concatenate([4 * t - 3, 4 - 8 * t, 4 * t - 1], axis=-1)


def place_on(nodes: np.ndarray, x: np.ndarray) -> np.ndarray:
    """t where quadratic edges with nodes (n, 3) of one coordinate pass x (n,): Newton from the chord."""
    t = (x - nodes[:, 0]) / (nodes[:, 2] - nodes[:, 0])
    for _ in range(4):
        value, slope = shapes(t)
        t = t - ((value * nodes).sum(axis=1) - x) / (slope * nodes).sum(axis=1)
    return t


def face_within(body: PlaneBody, window: tuple[float, float]) -> np.ndarray:
    """The face's edges (e, 3), by growing x, that lie in window (x_min, x_max) [m]; refuses a face that is no function
    of x there."""
    x = body.nodes[:, 0]
    edges = body.edges[(x[body.edges].min(axis=1) >= window[0]) & (x[body.edges].max(axis=1) <= window[1])]
    if not len(edges):
        raise SmallStrainError(f"no edge of the face lies in the window {window} m: move or widen it")
    if x[edges[0, 0]] > x[edges[0, 2]]:
        edges = edges[::-1, ::-1]
    along = x[edges]
    if (along[:, 2] <= along[:, 0]).any() or (edges[1:, 0] != edges[:-1, 2]).any():
        raise SmallStrainError(f"the face is no function of x in the window {window} m: narrow it")
    return edges


@dataclass(frozen=True)
class Mortar:
    """Coupling of c pressure hats: on_moving, on_fixed (2m, c) nodal forces of unit pressures [m]; gap (c,) [m^2]
    weighted; push (c,) [m] of the upward force on the moving body."""

    on_moving: np.ndarray
    on_fixed: np.ndarray
    gap: np.ndarray
    push: np.ndarray


def couple(moving: PlaneBody, fixed: PlaneBody, upper: np.ndarray, lower: np.ndarray) -> Mortar:
    """Integrate over the upper edges (e, 3), cut at their middles and where corners of the lower edges (f, 3) lie."""
    count = 2 * len(upper) + 1
    on_moving, on_fixed = (np.zeros((2 * len(body.nodes), count)) for body in (moving, fixed))
    mortar = Mortar(on_moving, on_fixed, np.zeros(count), np.zeros(count))
    cuts = fixed.nodes[np.r_[lower[:, 0], lower[-1, 2]], 0]
    for e, edge in enumerate(upper):
        nodes = moving.nodes[edge]
        if nodes[0, 0] < cuts[0] or nodes[2, 0] > cuts[-1]:
            continue  # nothing lies below
        t, weight = _integration_points(nodes[:, 0], cuts)
        shape, slope = shapes(t)
        point, along = shape @ nodes, slope @ nodes
        facing = lower[np.clip(np.searchsorted(cuts, point[:, 0], side="right") - 1, 0, len(lower) - 1)]
        other, _ = shapes(place_on(fixed.nodes[facing, 0], point[:, 0]))
        opening = point[:, 1] - (other * fixed.nodes[facing, 1]).sum(axis=1)
        # outward normal of the upper body times length
        area = np.column_stack([along[:, 1], -along[:, 0]]) * weight[:, None]
        hats = np.maximum(1 - 2 * t, 0), 1 - np.abs(2 * t - 1), np.maximum(2 * t - 1, 0)
        for column, hat in enumerate(hats, 2 * e):
            force = hat[:, None] * area
            for axis in (0, 1):
                np.add.at(mortar.on_moving[:, column], 2 * edge + axis, -shape.T @ force[:, axis])
                np.add.at(mortar.on_fixed[:, column], 2 * facing + axis, other * force[:, axis, None])
            mortar.gap[column] -= (opening * force[:, 1]).sum()
            mortar.push[column] -= force[:, 1].sum()
    return mortar


def _integration_points(x: np.ndarray, cuts: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """t and weights of an edge with nodes at x (3,), Gauss points between its ends, its middle and the cuts inside."""
    inside = cuts[(cuts > x[0]) & (cuts < x[2])]
    ends = np.unique(np.r_[0.0, 0.5, 1.0, place_on(np.broadcast_to(x, (len(inside), 3)), inside)])
    step = np.diff(ends)[:, None]
    return (ends[:-1, None] + step * (GAUSS[0] + 1) / 2).ravel(), (step * GAUSS[1] / 2).ravel()


def solve_active_set(
    compliance: np.ndarray, gap: np.ndarray, push: np.ndarray, load: float, start: np.ndarray
) -> tuple[np.ndarray, float]:
    """Pressures (n,) >= 0 and approach so that gaps gap + compliance p - push * approach >= 0, p gap = 0, push p =
    load."""
    active = start.copy()
    for _ in range(200):
        a = np.flatnonzero(active)
        system = np.block([[compliance[np.ix_(a, a)], -push[a, None]], [push[None, a], np.zeros((1, 1))]])
        scale = compliance[a, a].mean() / push[a].mean()
        system[-1] *= scale
        answer = np.linalg.solve(system, np.r_[-gap[a], load * scale])
        pressure = np.zeros(len(gap))
        pressure[a] = answer[:-1]
        left = gap + compliance @ pressure - push * answer[-1]
        wanted = np.where(active, pressure > 0, left < -1e-12 * np.abs(push * answer[-1]))
        if (wanted == active).all():
            return pressure, float(answer[-1])
        active = wanted
    raise ArithmeticError("the active set did not settle in 200 rounds: take another element size")


@dataclass(frozen=True)
class PressedBodies:
    """Two bodies, factorised, and the coupling of their faces; c pressures.

    x (c,) [m] nodes of the upper face; moved, yielded (2m, c) [m/Pa] displacements of the moving and the fixed body by
    unit pressures, the holders at rest
    """

    below: PlaneBody
    above: PlaneBody
    mortar: Mortar
    x: np.ndarray
    moved: np.ndarray
    yielded: np.ndarray

    @classmethod
    def build(
        cls, fixed: Body, moving: Body, fineness: Fineness, window: tuple[float, float],
        hardening: Hardening = ELASTIC,
    ) -> PressedBodies:  # fmt: skip
        """Arguments as of solve_plane_contact; hardening : of the fixed body."""
        below, above = PlaneBody(fixed, fineness, hardening), PlaneBody(moving, fineness)
        upper = face_within(above, window)
        # the lower face is taken a little wider than the window, so that it lies below all of the upper one
        margin = 3 * fineness.coarse
        lower = face_within(below, (window[0] - margin, window[1] + margin))
        mortar = couple(above, below, upper, lower)
        live = mortar.push > 0
        mortar = Mortar(mortar.on_moving[:, live], mortar.on_fixed[:, live], mortar.gap[live], mortar.push[live])
        x = above.nodes[np.r_[upper[:, :2].ravel(), upper[-1, 2]], 0][live]
        return cls(below, above, mortar, x, above.displacement(mortar.on_moving), below.displacement(mortar.on_fixed))

    @cached_property
    def compliance(self) -> np.ndarray:
        """(c, c) by how much unit pressures close the mortar's gaps."""
        return self.mortar.on_moving.T @ self.moved + self.mortar.on_fixed.T @ self.yielded

    def solve(self, load: float, displaced: np.ndarray | None = None) -> tuple[np.ndarray, float]:
        """Pressures (c,) [Pa] and approach [m] under a load [N/m]; displaced : (2m,) [m] of the fixed body's nodes by
        something else than the pressures."""
        gap = self.mortar.gap if displaced is None else self.mortar.gap + self.mortar.on_fixed.T @ displaced
        mean_gap = gap / self.mortar.push
        start = mean_gap <= np.partition(mean_gap, 4)[4]
        return solve_active_set(self.compliance, gap, self.mortar.push, load, start)


def solve_plane_contact(
    fixed: Body, moving: Body, load: float, fineness: Fineness, window: tuple[float, float]
) -> PlaneContact:
    """Two bodies with held edges, the upper pressed down by load [N/m], its holder neither shifting sideways nor
    turning.

    window : (x_min, x_max) [m] where they may touch; the bodies may be apart or overlap there, the approach takes it up
    """
    pressed = PressedBodies.build(fixed, moving, fineness, window)
    pressure, approach = pressed.solve(load)
    return PlaneContact(pressed.below, pressed.above, pressed.x, pressure, approach, pressed.yielded @ pressure)
