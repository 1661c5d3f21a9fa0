"""Where the fine block of a section lies on its outline: the running band, widened round a corner where it ends on one.

Beside the block two transition rings need outline that does not bend away. An end of the band on or near a convex
corner is therefore moved past that corner (`wrapped`: tied to the feature of the section there); an end on nearly
straight outline stays where it is (`open`). Columns between a wrapped end and the band may be wider than the fine size.
"""

from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq

from geometry.mesh import MeshError
from geometry.mesh_axis import growing_steps
from geometry.mesh_curve import SectionCurve

OPEN_BEND = np.radians(50)
WRAPPED_BEND = np.radians(20)
WIDEST = 1.7
STEEPEST = 1.8
COLUMN_GROWTH = 1.15


@dataclass(frozen=True)
class BandLayout:
    """How one fine block follows the outline from section to section.

    left_index, right_index : section index of a wrapped end, None for an open one (the end of the band itself)
    counts : columns left of, in and right of the band;  size : fine size [m]
    tied : None, or (room, width) [m]: with one end wrapped, the band keeps this distance from it and this width on all
           sections; otherwise it keeps its own place and the columns beside it stretch
    """

    left_index: float | None
    right_index: float | None
    counts: tuple[int, int, int]
    size: float
    tied: tuple[float, float] | None = None

    def columns(self, curve: SectionCurve, start: float, end: float) -> np.ndarray:
        """Arc lengths (sum(counts) + 1,) [m] of the block's columns on an outline whose band is [start, end] (arc length)."""
        left = start if self.left_index is None else curve.arc_of_index(self.left_index)
        right = end if self.right_index is None else curve.arc_of_index(self.right_index)
        if self.tied and self.right_index is None:
            start, end = left + self.tied[0], left + sum(self.tied)
        elif self.tied:
            start, end = right - sum(self.tied), right - self.tied[0]
        else:
            start, end = self._between(left, right, start, end)
        before = start - growing_columns(self.counts[0], start - left, self.size)[::-1] if self.counts[0] else []
        after = end + growing_columns(self.counts[2], right - end, self.size) if self.counts[2] else []
        return np.concatenate([before, lateral_columns(curve, start, end, self.counts[1]), after])

    def _between(self, left, right, start, end):
        """The band between the two ends; where the section is too narrow for it all columns share the width."""
        least = min((right - left) / sum(self.counts), self.size)
        start = max(start, left + self.counts[0] * least) if self.counts[0] else left
        end = min(end, right - self.counts[2] * least) if self.counts[2] else right
        if end - start < 0.8 * self.counts[1] * least:
            return left + self.counts[0] * least, right - self.counts[2] * least
        return start, end


def lateral_columns(curve: SectionCurve, start: float, end: float, count: int) -> np.ndarray:
    """Arc lengths (count + 1,) [m] that cut the band at equal lateral steps, up to STEEPEST times longer where the outline is steep."""
    along = np.linspace(start, end, 20 * count + 1)
    share = lateral_length(curve, along)
    return np.interp(np.linspace(0, share[-1], count + 1), share, along)


def lateral_length(curve: SectionCurve, along: np.ndarray) -> np.ndarray:
    """Lateral extent [m] of the outline from along[0] to each arc length in `along` (k,), no step counted below its arc / STEEPEST."""
    share = np.maximum(np.cos(curve.normal_angle(along)), 1 / STEEPEST)
    return np.append(0.0, np.cumsum(np.diff(along) * 0.5 * (share[1:] + share[:-1])))


def growing_columns(count: int, length: float, size: float) -> np.ndarray:
    """Distances (count,) [m] from the band of `count` columns over `length`, growing geometrically from `size` where there is room."""
    powers = np.arange(1, count + 1)
    ratio = 1.0
    if length > count * size:
        ratio = brentq(lambda r: size * (r**powers).sum() - length, 1.0, 1.0 + length / size)
    widths = ratio**powers
    return length * np.cumsum(widths) / widths.sum()


def lay_out_band(curves: list[SectionCurve], arcs: list[tuple[float, float]], size: float, reach: float, sides: int, multiple: int, what: str) -> BandLayout:
    """Decide how the fine block lies on all sections of a body.

    curves : sections over the fine range;  arcs : the band's arc lengths [m] on each;  size : fine size [m]
    reach : outline [m] that the rings take beside the block;  sides : edges of both block sides together
    multiple : columns plus sides are made a multiple of this;  what : name of the band for messages
    Raises MeshError where an end finds no nearly straight outline before the section ends.
    """
    band = np.array(arcs)
    if (band[:, 1] - band[:, 0]).min() < 2 * size:
        raise MeshError(f"{what} is {(band[:, 1] - band[:, 0]).min() * 1e3:.2f} mm wide (arc length), under two elements of {size * 1e3:.2f} mm; widen it or take smaller elements")
    left = _wrapped_end(curves, band[:, 0], -1, reach, what)
    right = _wrapped_end(curves, band[:, 1], 1, reach, what)
    at_left = band[:, 0] if left is None else np.array([curve.arc_of_index(left) for curve in curves])
    at_right = band[:, 1] if right is None else np.array([curve.arc_of_index(right) for curve in curves])
    rooms = np.maximum(band[:, 0] - at_left, 0), np.maximum(at_right - band[:, 1], 0)
    outer = [_outer_count(room, size) for room in rooms]
    width = float((np.where(outer[1], band[:, 1], at_right) - np.where(outer[0], band[:, 0], at_left)).mean())
    tied = _tie(band, left, at_left, right, at_right, size)
    if tied and sum(tied) / size < width / size + sum(outer) + 2:
        outer, width = [_outer_count(tied[0], size) if end is not None else 0 for end in (left, right)], tied[1]
    else:
        tied = None
    lateral = np.mean([lateral_length(curve, np.linspace(*ends, 200))[-1] for curve, ends in zip(curves, _band_spans(band, at_left, at_right, left, right, outer, tied))])
    count = max(2, round(lateral / size))
    excess = (count + sum(outer) + sides) % multiple
    count += -excess if excess == 1 and count >= 8 else -excess % multiple
    return BandLayout(left, right, (outer[0], count, outer[1]), size, tied)


def _band_spans(band, at_left, at_right, left, right, outer, tied):
    """The band's own part (k, 2) [m] of each outline, as BandLayout.columns will place it."""
    if tied and right is None:
        return np.stack([at_left + tied[0], at_left + sum(tied)], axis=1)
    if tied:
        return np.stack([at_right - sum(tied), at_right - tied[0]], axis=1)
    return np.stack([band[:, 0] if outer[0] else at_left, band[:, 1] if outer[1] else at_right], axis=1)


def _tie(band, left, at_left, right, at_right, size):
    """Distance from the one wrapped end and width [m] that hold the band on all sections; None unless one end only is wrapped."""
    if (left is None) == (right is None):
        return None
    distance = band - at_left[:, None] if right is None else at_right[:, None] - band[:, ::-1]
    room = float(distance[:, 0].min())
    room = room if room > 1.5 * size else 0.0
    return room, float(distance[:, 1].max()) - room


def _outer_count(rooms, size):
    """Columns between a wrapped end and the band: as few as the narrowest section allows, enough for the widest, none under 1.5 sizes."""
    least, most = float(np.min(rooms)), float(np.max(rooms))
    if least <= 1.5 * size:
        return 0
    return max(len(growing_steps(size, least, COLUMN_GROWTH, WIDEST * size)), min(int(most / (4 * size)), int(least / (0.7 * size))))


def _wrapped_end(curves, ends, side, reach, what):
    """Section index of the outermost place where the end must lie to have straight outline beside it; None if it may stay."""
    places = [_straight_place(curve, end, side, reach, what) for curve, end in zip(curves, ends)]
    if all(place == end for place, end in zip(places, ends)):
        return None
    indices = [curve.index_of_arc(place) for curve, place in zip(curves, places)]
    return min(indices) if side < 0 else max(indices)


def _straight_place(curve, end, side, reach, what):
    """First arc length from `end` outwards beside which the outline does not bend away: by no more than OPEN_BEND at the end itself, than WRAPPED_BEND beyond it."""
    step, place = reach / 40, end
    if bend(curve, end, side, 1.3 * reach) <= OPEN_BEND:
        return end
    while bend(curve, place, side, 1.3 * reach) > WRAPPED_BEND:
        place += side * step
        if not 0.6 * reach < place < curve.length - 0.6 * reach:
            raise MeshError(f"{what} ends at arc length {end * 1e3:.1f} mm of {curve.length * 1e3:.1f} mm, and no {reach * 1e3:.1f} mm of nearly straight outline "
                            "follow it for the transition of sizes; move or narrow the band, or take smaller elements")
    return place


def bend(curve: SectionCurve, place: float, side: int, distance: float) -> float:
    """Largest angle [rad] by which the outline bends towards the body within `distance` [m] of an arc length, to side -1 or +1."""
    along = np.clip(place + side * np.linspace(0, distance, 60), 0, curve.length)
    angle = curve.normal_angle(along)
    return float((side * (angle[0] - angle)).max())
