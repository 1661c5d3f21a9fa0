"""What an elastic body is to the nodes on its boundary: few displacement functions, and modes behind them. Made by
rail_fem.static_fe; here it is by itself, so that what is kept of it outlives edits of the time loop.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

RIGID = 6  # functions that are motions of a rigid body, the first ones


def terms_at(powers: np.ndarray, length: float, positions: np.ndarray) -> np.ndarray:
    """Terms (n, k) of powers (k, 3) of positions (n, 3) over a length [m]."""
    return np.prod((positions[:, None] / length) ** powers, axis=2)


@dataclass(frozen=True)
class Condensed:
    """An elastic body behind an interface, relative to what holds it.

    powers (k, 3), length [m], functions (k, 3, f) : displacement functions of the interface, component c of function j
        at position r from the body's origin the sum over k of functions[k, c, j] prod((r / length) ** powers[k])
    stiffness, mass (m, m) : of m coordinates, the first f those of the functions [N/m, kg]
    momentum (3, m) : per rate of each [kg];  weight : mass of the body [kg]
    """

    powers: np.ndarray
    length: float
    functions: np.ndarray
    stiffness: np.ndarray
    mass: np.ndarray
    momentum: np.ndarray
    weight: float

    def at(self, positions: np.ndarray) -> np.ndarray:
        """Functions (3 n, f) at positions (n, 3) from the origin [m]."""
        terms = terms_at(self.powers, self.length, positions)
        return np.einsum("nk,kcf->ncf", terms, self.functions).reshape(3 * len(positions), -1)

    def for_relaxation(self, frequency: float) -> Condensed:
        """The same body, whose coordinates all have a frequency [rad/s] and no share in the rigid motion's momentum."""
        return replace(self, mass=self.stiffness / frequency**2, momentum=0.0 * self.momentum, weight=0.0)


SECTION = 4  # motions of a plane section: along x, y, z [m], and a turn about x [rad]


@dataclass(frozen=True)
class CondensedBlock:
    """The steel between the meshes of a crossing and a rigid foot, by what plane sections of the bodies on it feel.

    Between stations the motion of a body's sections is linear, outside them that of the nearest one.

    first, apart, count (b,) : x of the first station of each body, distance between them [m], how many;
    regions (b,) : of the mesh;  axis (sum(count), 2) : y, z about which the section at each station turns [m]
    stiffness (n, n) : of n = SECTION * sum(count) motions relative to the foot, body after body, station after station
    mass (n,) : lumped [kg; kg m2];  weight : of the block [kg]
    """

    first: np.ndarray
    apart: np.ndarray
    count: np.ndarray
    regions: np.ndarray
    axis: np.ndarray
    stiffness: np.ndarray
    mass: np.ndarray
    weight: float

    def place(self, positions: np.ndarray, body: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Of positions (n, 3) [m] on bodies (n,): number (n,) of the first motion of the station behind each, how far
        it is towards the next one (n,), 0 to 1, and its place (n, 2) about the axis [m]."""
        along = np.clip((positions[:, 0] - self.first[body]) / self.apart[body], 0.0, self.count[body] - 1.0)
        station = np.minimum(along.astype(np.int64), self.count[body] - 2)
        share, first = along - station, np.cumsum([0, *self.count])[body] + station
        axis = (1 - share)[:, None] * self.axis[first] + share[:, None] * self.axis[first + 1]
        return SECTION * first, share, positions[:, 1:] - axis

    @property
    def along_z(self) -> np.ndarray:
        """The motions (n,) of a foot that rises by 1: all sections along z."""
        return np.tile(np.eye(SECTION)[2], int(self.count.sum()))
