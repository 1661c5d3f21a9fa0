"""Wing and nose of a crossing that wear: depths below the unworn surfaces in plan, d(x, y).

Depths are counted vertically per plan area, so that their sum times the cell is the volume that the patches took
(geometry.surfaces.depth_field keeps it in the surface). Heights stay functions of x and y: nothing can cross itself; on
faces steeper than that field's STEEPEST the plan is too coarse to say where on the face metal was lost.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy import ndimage

from geometry.surfaces.bodies import BODIES, NO_METAL
from geometry.surfaces.depth_field import SPREAD, DepthField
from geometry.surfaces.worn_crossing import UnwornCrossing, WornCrossing
from rail_fem.damage.flowed_surface import flow_in_passes, spread_along, with_heaps
from rail_fem.damage.worn_profile import WornOutError

LARGEST_STEP = 0.2e-3  # that one step may take off [m]


@dataclass(frozen=True, eq=False)
class WornSurface:
    """x (m,), y (n,) of an even grid [m];  depth (2, m, n) worn off wing and nose [m];  label : what it is
    flow (2, m, n) : by which plastic flow under the passes has lowered them, negative where it heaped metal up [m];
    strain (2, m, n) : that hardens the steel. None: it does not flow."""

    x: np.ndarray
    y: np.ndarray
    depth: np.ndarray
    label: str = "crossing"
    flow: np.ndarray | None = None
    strain: np.ndarray | None = None

    @classmethod
    def unworn(cls, x: np.ndarray, y: np.ndarray, label: str = "crossing", flows: bool = False) -> WornSurface:
        """Before any pass. flows : whether its steel will flow"""
        zero = np.zeros((2, len(x), len(y)))
        return cls(x, y, zero, label, *((zero, zero) if flows else ()))

    parts = BODIES

    @property
    def along(self) -> tuple[np.ndarray, str]:
        """(m,) positions of its depths [m], and what they are."""
        return self.x, "x along the crossing"

    def part(self, values: np.ndarray, b: int) -> np.ndarray:
        """(m, n) of values (2, m, n) on wing or nose."""
        return values[b]

    def place(self, flat: int) -> list[float]:
        """x, y of a place on wing or nose [m]."""
        i, j = np.unravel_index(flat, self.shape[1:])
        return [float(self.x[i]), float(self.y[j])]

    def amount(self, depth: np.ndarray) -> float:
        """Volume of depths (..., m, n) [m3]."""
        return float(depth.sum()) * self.cell

    @property
    def lowered(self) -> np.ndarray:
        """(2, m, n) by wear and flow [m]."""
        return self.depth if self.flow is None else self.depth + self.flow

    @property
    def flow_depth(self) -> float:
        """Deepest flow [m]."""
        return 0.0 if self.flow is None else float(self.flow.max())

    def flowed(
        self, wanted: np.ndarray, shares: list[float], passes: float, rate: float, heights: np.ndarray
    ) -> WornSurface:
        """After passes of kinds whose grooves still want depths and squares of strain (k, 2, 2, m, n):
        rail_fem.damage.flowed_surface. heights (2, m, n) : of the first surfaces [m]"""
        metal = heights > 0.5 * NO_METAL
        spread = np.where(metal, spread_along(wanted, self.x[1] - self.x[0]), 0.0)
        depth, square = np.moveaxis(spread, 1, 0)
        groove = flow_in_passes(depth, shares, passes, rate)
        weights = np.reshape(shares, (-1, 1, 1, 1))
        total = (weights * depth).sum(axis=0)
        per_depth = np.where(total > 0, (weights * square).sum(axis=0) / np.maximum(total, 1e-30), 0.0)
        now = np.maximum(heights, NO_METAL) - self.lowered
        flow, hardened = self.known_flow + with_heaps(groove, now, metal), self.known_strain**2 + groove * per_depth
        return replace(self, flow=flow, strain=np.sqrt(hardened))

    @property
    def known_flow(self) -> np.ndarray:
        """(2, m, n) [m]; zero where nothing flows."""
        return np.zeros(self.shape) if self.flow is None else self.flow

    @property
    def known_strain(self) -> np.ndarray:
        """(2, m, n); zero where nothing flows."""
        return np.zeros(self.shape) if self.strain is None else self.strain

    @property
    def shape(self) -> tuple[int, ...]:
        """Of its depths."""
        return self.depth.shape

    @property
    def cell(self) -> float:
        """Plan area that belongs to a depth [m2]."""
        return float((self.x[1] - self.x[0]) * (self.y[1] - self.y[0]))

    @property
    def spread(self) -> tuple[float, float]:
        """Standard deviations along and across by which the surface spreads a depth [m]."""
        return float(SPREAD * (self.x[1] - self.x[0])), float(SPREAD * (self.y[1] - self.y[0]))

    def worn(self, depth: np.ndarray) -> tuple[WornSurface, float]:
        """After further depths (2, m, n) [m]; 0: the volume is kept as it is. Raises WornOutError."""
        if not (np.isfinite(depth).all() and (depth >= 0).all()):
            raise WornOutError(f"{self.label}: depths to wear off must be finite and 0 or more")
        if depth.max() > LARGEST_STEP:
            _, i, j = np.unravel_index(int(np.argmax(depth)), depth.shape)
            raise WornOutError(
                f"{self.label}: a step of {depth.max():.3g} m at x = {self.x[i]:.4f}, y = {self.y[j]:.4f} m; one step"
                f" may take {LARGEST_STEP:g} m: wear off less at once"
            )
        return replace(self, depth=self.depth + depth), 0.0

    def smoothed(self, depth: np.ndarray, width: float) -> np.ndarray:
        """Depths (2, m, n) spread by a Gauss curve of standard deviation `width` [m] in plan."""
        sigma = (0.0, width / (self.x[1] - self.x[0]), width / (self.y[1] - self.y[0]))
        return ndimage.gaussian_filter(depth, sigma, mode="nearest") if width > 0 else depth

    def deepest_from(self, first: WornSurface) -> float:
        """Largest depth that it has lost, by wear and flow [m]."""
        return float((self.lowered - first.lowered).max())

    def crossing(self, base: UnwornCrossing, flow: np.ndarray | None = None) -> WornCrossing:
        """The crossing itself, for searches. flow : (2, m, n) depths by which plastic flow has lowered it first, + into
        the metal [m]"""
        at = float(self.x[0]), float(self.x[1] - self.x[0]), float(self.y[0]), float(self.y[1] - self.y[0])
        depth = self.lowered if flow is None else self.lowered + flow
        return WornCrossing(base, *(DepthField(*at, np.ascontiguousarray(own)) for own in depth))
