"""The outline of a section as a polyline measured by its arc length."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from geometry.meshing.hexmesh import MeshError, cross_2d


@dataclass(frozen=True)
class SectionCurve:
    """Outline of a section from base to base over the running surface; the body lies below it (right of its direction).

    points : (n, 2) y and height [m], y rising in the large, height up; first and last point on the base
    index  : (n,) position of each point in the section it was cut from: sections along x have the same feature at the
        same index
    """

    points: np.ndarray
    index: np.ndarray

    @cached_property
    def arc(self) -> np.ndarray:
        """Arc length (n,) [m] at each point."""
        return np.append(0.0, np.cumsum(np.linalg.norm(np.diff(self.points, axis=0), axis=1)))

    @property
    def length(self) -> float:
        """Length of the outline [m]."""
        return float(self.arc[-1])

    def at(self, arc: np.ndarray) -> np.ndarray:
        """Points (k, 2) at arc lengths (k,), on the polyline to round-off."""
        arc = np.asarray(arc, dtype=float)
        return np.stack(
            [np.interp(arc, self.arc, self.points[:, 0]), np.interp(arc, self.arc, self.points[:, 1])], axis=-1
        )

    def normal_angle(self, arc: np.ndarray) -> np.ndarray:
        """Angle (k,) [rad] of the outward normal from straight up, positive to the left (a left flank has +pi/2)."""
        edge = np.diff(self.points, axis=0)
        angle = np.unwrap(np.arctan2(edge[:, 1], edge[:, 0]))
        return np.interp(arc, (self.arc[1:] + self.arc[:-1]) / 2, angle)

    def band_arcs(self, band: tuple[float, float], what: str, steepest: float = np.radians(45)) -> tuple[float, float]:
        """Arc lengths [m] between which the outline is seen from above within a lateral band (y0, y1) [m].

        The part not steeper than `steepest` [rad] that lies highest in the band; where the band reaches over an edge it
        ends there. Raises MeshError where the band is empty or beside the section; `what` names it in the message.
        """
        if not band[0] < band[1]:
            raise MeshError(f"{what} {band} m is empty; give (y0, y1) with y0 < y1")
        flat = np.abs(np.arctan2(*np.diff(self.points, axis=0).T[::-1])) <= steepest
        edges = np.flatnonzero(np.diff(np.concatenate([[False], flat, [False]]).astype(int)))
        spans = []
        for first, last in zip(edges[0::2], edges[1::2]):
            y = self.points[first : last + 1, 0]
            inside = np.clip(band, y[0], y[-1])
            if inside[0] < inside[1]:
                ends = np.interp(inside, y, self.arc[first : last + 1])
                spans.append((self.at(np.linspace(*ends, 50))[:, 1].max(), float(ends[0]), float(ends[1])))
        if not spans:
            low, high = self.points[:, 0].min() * 1e3, self.points[:, 0].max() * 1e3
            raise MeshError(
                f"{what} from y = {band[0] * 1e3:.2f} to {band[1] * 1e3:.2f} mm is outside the section, which reaches"
                f" from {low:.2f} to {high:.2f} mm; move the band"
            )
        return max(spans)[1:]

    def arc_of_index(self, index: float) -> float:
        """Arc length [m] of the feature at a (fractional) index of the original section."""
        return float(np.interp(index, self.index, self.arc))

    def sharp_points(self, angle: float = np.radians(25)) -> np.ndarray:
        """Indices of inner points where the outline turns by more than `angle` [rad]."""
        edge = np.diff(self.points, axis=0)
        turn = cross_2d(edge[:-1], edge[1:]), np.einsum("ij,ij->i", edge[:-1], edge[1:])
        return 1 + np.flatnonzero(np.abs(np.arctan2(*turn)) > angle)


def cut_at_base(points: np.ndarray, base: float, where: str) -> SectionCurve:
    """The part of a section above the height `base` [m], ending exactly on it.

    points : (n, 2) outline from the left foot over the top to the right foot; feet above the base are prolonged
    straight down to it. `where` names the section in messages. Raises MeshError where nothing of
    it is above the base.
    """
    top = points[:, 1].argmax()
    if points[top, 1] <= base + 1e-6:
        raise MeshError(
            f"{where}: the section's top at z = {points[top, 1] * 1e3:.2f} mm is not above the base at {base * 1e3:.2f}"
            " mm; lower the base"
        )
    number = np.arange(len(points), dtype=float)
    left, left_index = _end_on_base(points[: top + 1][::-1], number[: top + 1][::-1], base)
    right, right_index = _end_on_base(points[top:], number[top:], base)
    outline = np.concatenate([left[::-1], right[1:]])
    index = np.concatenate([left_index[::-1], right_index[1:]])
    keep = np.append(True, np.linalg.norm(np.diff(outline, axis=0), axis=1) > 1e-9)
    return SectionCurve(outline[keep], index[keep])


def _end_on_base(points, number, base):
    """Points and their indices from the top down to the first passage through the base, or prolonged vertically to
    it."""
    below = np.flatnonzero(points[:, 1] <= base)
    if len(below) == 0:
        beyond = 2 * number[-1] - number[-2] if len(number) > 1 else number[-1]
        return np.concatenate([points, [[points[-1, 0], base]]]), np.append(number, beyond)
    last = below[0]
    fraction = (base - points[last - 1, 1]) / (points[last, 1] - points[last - 1, 1])
    end = points[last - 1] + fraction * (points[last] - points[last - 1])
    index = number[last - 1] + fraction * (number[last] - number[last - 1])
    return np.concatenate([points[:last], [[end[0], base]]]), np.append(number[:last], index)
