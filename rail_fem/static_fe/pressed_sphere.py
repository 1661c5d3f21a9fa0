"""A rigid sphere pressed into a yielding half-space, by axisymmetric finite elements: the judge of bem/plastic.

The contact grows by one node of the surface at a time: each load is the one at which the next node just touches and
carries nothing, so the contact's radius is known without interpolation and load and approach are what is asked. Nodes
within lie on the sphere; that their pressures are positive and the others lie below it is checked. Displacements are
small and the sphere's surface moves straight down: the same problem as the half-space's, by other means.
The mesh ends far away, where it moves as the half-space does under a force at a point.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from bem.material import Elastic
from rail_fem.static_fe.axisymmetric import (
    AxisymmetricBody,
    AxisymmetricError,
    BalancedState,
    HeldMotions,
    YieldingSteel,
)

FAR = 25.0  # radius and depth of the mesh over the largest radius of contact
FINE = 1.25  # of that radius: the region of equal elements
PARTS = 1, 4, 16  # in which the gap of the next node is closed: one, or more where that finds no equilibrium
GROWTH = 1.1  # from one element to the next beyond


@dataclass(frozen=True)
class Pressed:
    """After each node (k,): radius of contact [m], load [N], approach [m], largest pressure [Pa], largest equivalent
    plastic strain, steps of Newton's method; pressure (n,) [Pa] at surface radii r (n,) [m] at the end."""

    radius: np.ndarray
    load: np.ndarray
    approach: np.ndarray
    max_pressure: np.ndarray
    max_strain: np.ndarray
    steps: np.ndarray
    r: np.ndarray
    pressure: np.ndarray

    @property
    def area(self) -> np.ndarray:
        """Area of contact (k,) [m^2], out to the node that just touches."""
        return np.pi * self.radius**2

    @property
    def carrying(self) -> np.ndarray:
        """Area (k,) [m^2] out to midway between that node and the last that carries: as `area` of first order, with a
        smaller factor where pressure ends in a step, as it does where all flows."""
        return np.pi * (self.radius - self.r[1] / 2) ** 2

    def at(self, approach: float, names: tuple[str, str] = ("load", "area")) -> tuple[float, float]:
        """Load [N] and area [m^2], or others of its columns, at an approach [m]; powers of it between two nodes. NaN
        beyond what was pressed."""
        if not self.approach[0] <= approach <= self.approach[-1]:
            return np.nan, np.nan
        one, two = (
            float(np.exp(np.interp(np.log(approach), np.log(self.approach), np.log(getattr(self, name)))))
            for name in names
        )
        return one, two


def point_force(nodes: np.ndarray, elastic: Elastic) -> np.ndarray:
    """Displacement (m, 2) r, z [m/N] of a half-space z < 0 at r, z under a unit force down at its origin (Boussinesq;
    Johnson, Contact Mechanics, 1985, eq. 3.19, from memory; tests hold the approach of Hertz to it)."""
    r, depth = nodes[:, 0], -nodes[:, 1]
    rho, nu = np.hypot(r, depth), elastic.poisson
    outward = r * depth / rho**3 - (1 - 2 * nu) * r / (rho * (rho + depth))
    down = depth**2 / rho**3 + 2 * (1 - nu) / rho
    return np.column_stack([outward, -down]) / (4 * np.pi * elastic.shear)


def graded(size: float, fine: float, far: float, growth: float = GROWTH) -> np.ndarray:
    """Positions from 0: equal steps of `size` up to `fine`, growing ones up to `far` [m]."""
    equal = size * np.arange(int(np.ceil(fine / size)) + 1)
    count = int(np.ceil(np.log1p((far - equal[-1]) / size * (growth - 1)) / np.log(growth)))
    steps = size * growth ** np.arange(1, count + 1)
    return np.r_[equal, equal[-1] + np.cumsum(steps)]


def tributary_area(r: np.ndarray) -> np.ndarray:
    """Area (n,) [m^2] by which a pressure acts on each node of a surface of linear elements at radii r (n,)."""
    steps, area = np.diff(r), np.zeros(len(r))
    area[:-1] += steps * (2 * r[:-1] + r[1:]) / 6
    area[1:] += steps * (r[:-1] + 2 * r[1:]) / 6
    return 2 * np.pi * area


@dataclass(frozen=True)
class _Model:
    """Mesh of a pressed half-space: the body, radii of the surface's nodes (n,) [m] and their degrees of freedom along
    z, those held on the axis and outside, displacement of the outer ones per newton of load."""

    body: AxisymmetricBody
    line: np.ndarray
    surface: np.ndarray
    axis: np.ndarray
    outer: np.ndarray
    far: np.ndarray

    @classmethod
    def of(cls, radius: float, across: int, steel: YieldingSteel) -> _Model:
        line = graded(radius / across, FINE * radius, FAR * radius)
        n = len(line)
        r, z = (values.ravel() for values in np.meshgrid(line, -line, indexing="ij"))
        at = np.arange(n * n).reshape(n, n)
        quads = np.stack([at[:-1, 1:], at[1:, 1:], at[1:, :-1], at[:-1, :-1]], axis=-1).reshape(-1, 4)
        body = AxisymmetricBody(np.column_stack([r, z]), quads, steel)
        nodes = np.unique(np.r_[at[-1], at[:, -1]])
        far = point_force(body.nodes[nodes], steel.elastic)
        far[r[nodes] == 0, 0] = 0.0
        outer = (2 * nodes[:, None] + [0, 1]).ravel()
        return cls(body, line, 2 * at[:, 0] + 1, np.setdiff1d(2 * at[0], outer), outer, far.ravel())

    def held(self, k: int, height: np.ndarray) -> HeldMotions:
        """Nodes 0 to k of the surface at a height (k + 1,) [m] over the approach; amplitudes: approach, load."""
        inside = self.surface[: k + 1]
        dofs = np.r_[self.axis, self.outer, inside]
        motions, target = np.zeros((len(dofs), 2)), np.zeros(len(dofs))
        motions[-(k + 1) :, 0], target[-(k + 1) :] = -1.0, height
        motions[len(self.axis) : len(self.axis) + len(self.outer), 1] = self.far
        on_force = np.zeros((2, self.body.count))
        on_force[0, inside[-1]] = 1.0  # the last node carries nothing
        on_force[1, inside] = 1.0
        return HeldMotions(dofs, target, motions, on_force, np.array([[0.0, 0.0], [0.0, 1.0]]))

    def take_in(self, k: int, height: np.ndarray, before: BalancedState, parts: int) -> BalancedState:
        """On to the load at which node k just touches, its gap closed in equal parts.

        Raises AxisymmetricError when there is no equilibrium."""
        opening = height[k] - before.amplitudes[0] - before.displacement[self.surface[k]]
        for part in range(1, parts + 1):
            target = height[: k + 1].copy()
            target[k] -= (1 - part / parts) * opening
            before = self.body.equilibrium(self.held(k, target), before.displacement, before.answer.plastic)
        return before


def press_sphere(gap: Callable[[np.ndarray], np.ndarray], radius: float, across: int, steel: YieldingSteel) -> Pressed:
    """Press until the contact has a radius [m], by `across` elements over it, one node after the other.

    gap : radii (n,) [m] -> height (n,) of the sphere above its lowest point [m]
    Raises AxisymmetricError where nodes pull, overlap, or no equilibrium is found.
    """
    model = _Model.of(radius, across, steel)
    line, surface, height = model.line, model.surface, np.asarray(gap(model.line), float)
    carried, pressure, rows = tributary_area(line), np.zeros(len(line)), []
    none = np.zeros(model.body.count)
    state = BalancedState(none, none, model.body.respond(none, model.body.virgin()), np.zeros(2), [])
    for k in range(1, across + 1):
        for parts in PARTS:
            try:
                found = model.take_in(k, height, state, parts)
                break
            except AxisymmetricError:
                if parts == PARTS[-1]:
                    raise
        state = found
        approach, load = state.amplitudes
        pressure = np.zeros(len(line))
        pressure[:k] = -state.force[surface[:k]] / carried[:k]
        above = state.displacement[surface[k + 1 :]] - (height[k + 1 :] - approach)
        if pressure.min() < -1e-6 * pressure.max() or above.max() > 1e-6 * approach:
            raise AxisymmetricError(
                f"radius {line[k]:.4g} m: a node within pulls ({pressure.min():.3g} Pa), or one beyond lies"
                f" {above.max():.3g} m above the sphere"
            )
        strain = state.answer.plastic.equivalent.max()
        rows.append((line[k], load, approach, pressure.max(), strain, len(state.mismatch) - 1))
    radii, loads, approaches, largest, strains, steps = np.array(rows).T
    return Pressed(radii, loads, approaches, largest, strains, steps, line, pressure)
