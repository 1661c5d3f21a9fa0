"""A crossing whose running surfaces have been worn, with all that searches and meshes ask of a crossing."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from geometry.surfaces.bodies import NO_METAL, TwoBodies
from geometry.surfaces.crossing import CastCrossing
from geometry.surfaces.depth_field import DepthField, depths_at
from geometry.surfaces.measured_crossing import MeasuredCrossing
from geometry.surfaces.surface_height import WornShape

UnwornCrossing = CastCrossing | MeasuredCrossing


@dataclass(frozen=True, eq=False)
class WornCrossing(TwoBodies):
    """Wing and nose of `base` less the depths of two fields; heights stay functions of x and y, so that no line of it
    can cross itself. Depths beside the metal change nothing.

    Error: that of `base`, and the fields' spread (geometry.surfaces.depth_field).
    """

    base: UnwornCrossing
    wing: DepthField
    nose: DepthField

    @cached_property
    def tables(self) -> tuple[WornShape, np.ndarray]:
        """What the compiled search takes (geometry.surfaces.surface_height)."""
        shape, loft = self.base.tables
        return WornShape(shape, self.wing, self.nose), loft

    def __getattr__(self, name: str) -> Any:
        """What wear does not change is the base's: its ranges, positions and features."""
        if name.startswith("_"):
            raise AttributeError(name)
        return getattr(self.base, name)

    def depth(self, x: np.ndarray, y: np.ndarray, body: str) -> np.ndarray:
        """Depths (n,) [m] worn off "wing" or "nose" at x, y (n,)."""
        return depths_at(x, y, self.nose if body == "nose" else self.wing)

    def heights(self, x: np.ndarray, y: np.ndarray, body: str) -> np.ndarray:
        """Heights (n,) [m] of "wing" or "nose" at x, y (n,); NO_METAL where the body is not."""
        base = self.base.heights(x, y, body)
        return np.where(base > 0.5 * NO_METAL, base - self.depth(x, y, body), base)

    def wing_section(self, x: float) -> np.ndarray | None:
        """(n, 2)  y, z [m] of the wing at x; None where it has ended."""
        return self._lowered(self.base.wing_section(x), x, "wing")

    def nose_section(self, x: float) -> np.ndarray | None:
        """The same of the nose; None where it is not."""
        return self._lowered(self.base.nose_section(x), x, "nose")

    def _lowered(self, section: np.ndarray | None, x: float, body: str) -> np.ndarray | None:
        if section is None:
            return None
        y = np.ascontiguousarray(section[:, 0])
        return np.column_stack([y, section[:, 1] - self.depth(np.full(len(y), float(x)), y, body)])
