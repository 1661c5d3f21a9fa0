"""Where the fine block of a section lies on its outline, from section to section: as the running band, but steady.

The block has the same number of columns on all sections. Where contact jumps sideways along x its edges must not jump,
and where the band is narrow the block may be wider than it, so that its columns stay near the fine size.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from geometry.axes import GAUGE_POINT_DEPTH
from geometry.meshing.hexmesh import MeshError
from geometry.meshing.section.curve import SectionCurve

STEEPEST = 1.8  # longest column along a steep outline, in fine sizes
# largest sideways slopes dy / dx of the block's edges: the next where cells fold with the one before. Where three slabs
# meet one, edges that move to and fro from slab to slab, by much of a cell, fold the cells between
SIDEWAYS = (0.7, 0.5, 0.3, 0.15)
WIDEST = 1.25  # widest column where the band is widest, in fine sizes


def steady_band(x: np.ndarray, band: np.ndarray, top: np.ndarray, sideways: float = SIDEWAYS[0]) -> np.ndarray:
    """Lateral ranges (n, 2) [m] of the block at stations x (n,) [m]: no narrower than the band, with edges of slope <=
    `sideways`.

    band : (n, 2) where the wheel runs;  top : (n, 2) where the section's top is not steep [m]
    Where the band is narrower than the widest over WIDEST, the range is widened to that as far as the top reaches.
    """
    away = sideways * np.abs(x[:, None] - x[None, :])
    top = np.stack([(top[:, 0] - away).max(axis=1), (top[:, 1] + away).min(axis=1)], axis=1)
    inside = np.clip(band, top[:, :1], top[:, 1:])
    low, high = (inside[:, 0] + away).min(axis=1), (inside[:, 1] - away).max(axis=1)
    lack = np.maximum((high - low).max() / WIDEST - (high - low), 0.0)
    low, high = low - lack / 2, high + lack / 2
    beyond_low, beyond_high = np.maximum(top[:, 0] - low, 0.0), np.maximum(high - top[:, 1], 0.0)
    wide = np.stack([low - beyond_high, high + beyond_low], axis=1)
    return np.clip(wide, top[:, :1], top[:, 1:])


def column_count(widths: np.ndarray, size: float, sides: int, multiple: int, what: str) -> int:
    """Columns of a block whose lateral lengths over the sections are widths (n,) [m]; with `sides` a multiple of
    `multiple`.

    Raises MeshError where the band is under two elements wide; `what` names it.
    """
    if widths.mean() < 2 * size:
        raise MeshError(
            f"{what} is {widths.mean() * 1e3:.2f} mm wide, under two elements of {size * 1e3:.2f} mm; widen it or take"
            " smaller elements"
        )
    count = round(max(widths.mean(), widths.max() / WIDEST) / size)
    excess = (count + sides) % multiple
    return count - 1 if excess == 1 and count >= 12 else count + -excess % multiple


def lateral_columns(curve: SectionCurve, start: float, end: float, count: int) -> np.ndarray:
    """Arc lengths (count + 1,) [m] that cut [start, end] at equal lateral steps, up to STEEPEST times longer where the
    outline is steep."""
    along = np.linspace(start, end, 20 * count + 1)
    share = lateral_length(curve, along)
    return np.interp(np.linspace(0, share[-1], count + 1), share, along)


def lateral_length(curve: SectionCurve, along: np.ndarray) -> np.ndarray:
    """Lateral extent [m] of the outline from along[0] to each arc length in `along` (k,), no step counted below its arc
    / STEEPEST."""
    share = np.maximum(np.cos(curve.normal_angle(along)), 1 / STEEPEST)
    return np.append(0.0, np.cumsum(np.diff(along) * 0.5 * (share[1:] + share[:-1])))


@dataclass(frozen=True, eq=False)
class HeadBand:
    """Lateral range about the contact points of a body at any x, kept on the head of its section (above the gauge
    point).

    crossing : has wing_section(x) and nose_section(x);  body : "wing" or "nose"
    x, y : (n,) of the contact points, x rising;  half_width : of the range;  edge : that it stays off the head's ends,
        all in m
    """

    crossing: Any
    body: str
    x: np.ndarray
    y: np.ndarray
    half_width: float
    edge: float

    def __call__(self, at: float) -> tuple[float, float]:
        """The range (y0, y1) at x = at [m]."""
        outline = getattr(self.crossing, f"{self.body}_section")(at)
        head = outline[outline[:, 1] > outline[:, 1].max() - GAUGE_POINT_DEPTH, 0]
        centre = float(np.interp(at, self.x, self.y))
        low, high = centre - self.half_width, centre + self.half_width
        return max(low, head.min() + self.edge), min(high, head.max() - self.edge)
