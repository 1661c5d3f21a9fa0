"""A rigid cylinder pressed along a yielding ridge, in plane strain: what a free side beside the contact changes.

The ridge is an arc about the line of contact that goes over into straight flanks and ends in a level; a flat is a ridge
of infinite radius. The gap is given relative to the ridge, so that elastic patches on two ridges differ only by what
the free sides make, not by curvature. The contact grows by one node of the surface at a time (`press_by_nodes`);
plane strain is a body of revolution far from its axis. Small strain on the undeformed ridge.
Error: second order in displacement; `rail-fem study plastic-ridge` shows two sizes.
"""

from dataclasses import dataclass

import numpy as np

from bem.material import Elastic
from bem.steel.hardening import Hardening
from rail_fem.static_fe.pressed_nodes import graded, lined_block, press_by_nodes, quadrilaterals
from rail_fem.static_fe.small_strain import SmallStrainError

FAR = 20.0  # half width and depth of the mesh over the largest half-width of contact
FINE = 1.25  # of that half-width: the region of equal elements
GROWTH = 1.15  # from one element to the next beyond


@dataclass(frozen=True)
class Ridge:
    """Symmetric about x = 0. radius [m] of its crown, inf for a flat; flank [rad] from the level; fall [m] from the
    crown to the level beside."""

    radius: float = np.inf
    flank: float = np.pi / 4
    fall: float = np.inf

    def __post_init__(self) -> None:
        if not (self.radius > 0 and 0 < self.flank < np.pi / 2 and self.fall > 0):
            raise SmallStrainError(
                f"ridge of radius {self.radius:g} m, flank {np.degrees(self.flank):g} degrees, fall {self.fall:g} m:"
                " all must be positive, the flank below 90 degrees"
            )
        if np.isfinite(self.radius) and not np.isfinite(self.fall):
            raise SmallStrainError(f"ridge of radius {self.radius:g} m: give the fall from its crown to the level [m]")

    def height(self, x: np.ndarray) -> np.ndarray:
        """(n,) [m] below 0 at distances x (n,) >= 0 [m]."""
        x = np.asarray(x, float)
        if np.isinf(self.radius):
            return np.zeros_like(x)
        end = self.radius * np.sin(self.flank)
        inside = np.minimum(x, end)
        arc = inside**2 / (self.radius + np.sqrt(self.radius**2 - inside**2))
        return -np.minimum(arc + np.maximum(x - end, 0) * np.tan(self.flank), self.fall)


@dataclass(frozen=True)
class PressedRidge:
    """After each node (k,): half-width of contact [m], load per length [N/m], largest pressure [Pa], depth of the
    plastic zone below the crown [m], plastic strain integrated over the whole section [m^2], largest plastic strain;
    at the end points (e, 2) [m] from the crown and equivalent plastic strain (e,) of the elements of the half with
    x > 0."""

    half_width: np.ndarray
    load: np.ndarray
    max_pressure: np.ndarray
    zone_depth: np.ndarray
    integral: np.ndarray
    max_strain: np.ndarray
    points: np.ndarray
    strain: np.ndarray

    def at(self, load: float, name: str) -> float:
        """One of the columns at a load [N/m], linear between two nodes; NaN beyond what was pressed."""
        if not self.load[0] <= load <= self.load[-1]:
            return float("nan")
        return float(np.interp(load, self.load, getattr(self, name)))


def press_ridge(
    ridge: Ridge, curvature: float, half_width: float, across: int, elastic: Elastic, hardening: Hardening,
    most_load: float = np.inf,
) -> PressedRidge:  # fmt: skip
    """Press until the contact has a half-width [m], by `across` elements over it, or carries `most_load` [N/m].

    curvature : of the gap, relative [1/m]
    Raises SmallStrainError where nodes pull or no equilibrium is found (a ridge that the load crushes: said with the
    load reached).
    """
    line = graded(half_width / across, FINE * half_width, FAR * half_width, GROWTH)
    x, depth, at, quads = lined_block(line)
    z = ridge.height(x) * (1 - depth / line[-1]) - depth
    body = quadrilaterals(np.column_stack([x, z]), quads, elastic, hardening)
    surface, outer = 2 * at[:, 0] + 1, (2 * np.unique(np.r_[at[-1], at[:, -1]])[:, None] + [0, 1]).ravel()
    gap = curvature * line**2 / 2
    spread = np.diff(np.r_[line[0], (line[1:] + line[:-1]) / 2, line[-1]])  # of the surface, that belongs to each node
    points = body.points.mean(axis=1)
    rows: list[tuple[float, ...]] = []
    strain = np.zeros(len(quads))
    try:
        for k, state in enumerate(press_by_nodes(body, surface, gap, np.union1d(2 * at[0], outer), across), 1):
            pressure = -state.force[surface[:k]] / spread[:k]
            strain = state.answer.plastic.peeq[0].mean(axis=1)
            flowing = strain > 0
            deep = float((ridge.height(points[flowing, 0]) - points[flowing, 1]).max(initial=0.0))
            load = -2 * float(state.force[surface[: k + 1]].sum())  # of both halves
            rows.append((line[k], load, pressure.max(), deep, 2 * float(strain @ body.volumes), float(strain.max())))
            if load >= most_load:
                break
    except SmallStrainError as fault:
        reached = rows[-1][1] if rows else 0.0
        raise SmallStrainError(f"beyond a load of {reached:.3g} N/m: {fault}") from None
    half, load_of, largest, zone, integral, most = np.array(rows).T
    return PressedRidge(half, load_of, largest, zone, integral, most, points, strain)
