"""A rigid sphere pressed into a yielding half-space, by axisymmetric finite elements: the judge of bem/plastic.

The contact grows by one node of the surface at a time (`press_by_nodes`): its radius is known, load and approach are
what is asked. Nodes within lie on the sphere; that their forces are positive and the others lie below it is checked.
Displacements are small and the sphere's surface moves straight down: the same problem as the half-space's, by other
means. The mesh ends far away, where it moves as the half-space does under a force at a point.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from bem.material import Elastic
from bem.steel.hardening import Hardening
from rail_fem.static_fe.pressed_nodes import graded, lined_block, press_by_nodes, quadrilaterals
from rail_fem.static_fe.small_strain import SmallStrainError

FAR = 25.0  # radius and depth of the mesh over the largest radius of contact
FINE = 1.25  # of that radius: the region of equal elements
GROWTH = 1.1  # from one element to the next beyond


@dataclass(frozen=True)
class Pressed:
    """After each node (k,): radius of contact [m], load [N], approach [m], largest pressure [Pa]; pressure
    (n,) [Pa] at surface radii r (n,) [m] at the end."""

    radius: np.ndarray
    load: np.ndarray
    approach: np.ndarray
    max_pressure: np.ndarray
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


def tributary_area(r: np.ndarray) -> np.ndarray:
    """Area (n,) [m^2] by which a pressure acts on each node of a surface of linear elements at radii r (n,)."""
    steps, area = np.diff(r), np.zeros(len(r))
    area[:-1] += steps * (2 * r[:-1] + r[1:]) / 6
    area[1:] += steps * (r[:-1] + 2 * r[1:]) / 6
    return 2 * np.pi * area


def press_sphere(
    gap: Callable[[np.ndarray], np.ndarray], radius: float, across: int, elastic: Elastic, hardening: Hardening
) -> Pressed:
    """Press until the contact has a radius [m], by `across` elements over it, one node after the other.

    gap : radii (n,) [m] -> height (n,) of the sphere above its lowest point [m]
    Raises SmallStrainError where nodes pull, overlap, or no equilibrium is found.
    """
    line = graded(radius / across, FINE * radius, FAR * radius, GROWTH)
    r, depth, at, quads = lined_block(line)
    body = quadrilaterals(np.column_stack([r, -depth]), quads, elastic, hardening, revolved=True)
    edge = np.unique(np.r_[at[-1], at[:, -1]])
    far = point_force(body.nodes[edge], elastic)
    far[r[edge] == 0, 0] = 0.0
    outer, surface = (2 * edge[:, None] + [0, 1]).ravel(), 2 * at[:, 0] + 1
    height, carried = np.asarray(gap(line), float), tributary_area(line)
    pressure, rows = np.zeros(len(line)), []
    axis = np.setdiff1d(2 * at[0], outer)
    for k, state in enumerate(press_by_nodes(body, surface, height, axis, across, (outer, far.ravel())), 1):
        approach, load = state.amplitudes
        pressure = np.zeros(len(line))
        pressure[:k] = -state.force[surface[:k]] / carried[:k]
        above = state.displacement[surface[k + 1 :]] - (height[k + 1 :] - approach)
        if above.max() > 1e-6 * approach:
            raise SmallStrainError(f"radius {line[k]:.4g} m: a node beyond lies {above.max():.3g} m above the sphere")
        rows.append((line[k], load, approach, pressure.max()))
    radii, loads, approaches, largest = np.array(rows).T
    return Pressed(radii, loads, approaches, largest, line, pressure)
