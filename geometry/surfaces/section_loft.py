"""Sections between sections: lines of unlike shape joined feature by feature, and the upper line of two bodies side by
side.

Two sections are matched where their tangents pass the same angles (gauge face, gauge corner, crown, field corner) and
by length between such positions. Points that match move on straight lines. A corner of 12.7 mm radius beside one of 5
mm then becomes one of 9 mm, where interpolation at equal y would lay two half corners over each other (zig-zag).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq

from geometry.hermite import cubic_between
from geometry.profiles.profile import APART, Piece, Profile, ProfileError
from geometry.surfaces.lofted_rail import LoftedBody

ANGLES = np.radians([75.0, 60.0, 30.0, 5.0, -5.0, -30.0, -60.0, -75.0])  # tangents at which convex sections are matched
POINTS = 240  # a feature interval


def marks(profile: Profile, angles: np.ndarray = ANGLES) -> np.ndarray:
    """(len(angles) + 2,)  lengths along the profile of its start, of the first positions where the tangent has turned
    down to each angle, of its end [m].

    The tangent's least value so far is what is looked at, so that a hollow does not count as a feature twice.
    """
    s, n = profile.arc_length, len(profile.points)
    before, after = np.minimum.accumulate(profile.angle_before), np.minimum.accumulate(profile.angle_after)
    found = []
    for angle in angles:
        k = int(np.argmax(after <= angle)) if (after <= angle).any() else n - 1
        if k > 0 and before[k] <= angle < after[k - 1]:  # within the interval that ends at k, not in its kink
            share = (after[k - 1] - angle) / (after[k - 1] - before[k])
            found.append(s[k - 1] + share * (s[k] - s[k - 1]))
        else:
            found.append(s[k])
    return np.maximum.accumulate([0.0, *found, s[-1]])


def curve_at(profile: Profile, length: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Points (m, 2) and unit tangents (m, 2) at growing lengths (m,) along a profile: cubic between its points, third
    order in tangent.

    At a kink the tangent is the one on leaving it; at the last length the one on reaching it.
    """
    s = profile.arc_length
    last = np.column_stack([np.cos(profile.angle_before), np.sin(profile.angle_before)])
    k = np.searchsorted(s, length, side="right") - 1
    k[-1] = np.searchsorted(s, length[-1] - APART) - 1
    k = np.clip(k, 0, len(s) - 2)
    h = (s[k + 1] - s[k])[:, None]
    t = ((length - s[k])[:, None]) / h
    found = cubic_between(t, h, profile.points[k], profile.points[k + 1], profile.tangent[k], last[k + 1])
    return found.value, found.slope / np.linalg.norm(found.slope, axis=1)[:, None]


def between(first: Profile, second: Profile, share: float, count: int = POINTS) -> Profile:
    """The section at `share` of the distance from first (0) to second (1).

    Exact at both ends' feature points; for arcs over the same angle an arc whose radius and centre are linear in the
    share. Where a feature has no length in one of both (a kink) it opens into a rounding. Raises ProfileError for a
    share outside [0, 1].
    """
    if not 0 <= share <= 1:
        raise ProfileError(f"between {first.label} and {second.label}: share {share:g} is outside [0, 1]")
    ends = marks(first), marks(second)
    pieces = []
    for k in range(len(ends[0]) - 1):
        spans = [e[k + 1] - e[k] for e in ends]
        if (1 - share) * spans[0] + share * spans[1] < 1e-9:
            continue
        steps = np.linspace(0, 1, count)
        (a, along_a), (b, along_b) = (
            curve_at(p, e[k] + steps * span) for p, e, span in zip((first, second), ends, spans)
        )
        rate = (1 - share) * spans[0] * along_a + share * spans[1] * along_b
        angle = np.unwrap(np.arctan2(rate[:, 1], rate[:, 0]))
        pieces.append(Piece((1 - share) * a + share * b, angle, np.full(count, np.nan)))
    return Profile.from_pieces(
        pieces, f"{first.label} to {second.label}, {share:.3g}", "interpolated between sections by features"
    )


@dataclass(frozen=True, eq=False)
class SectionLoft:
    """One rail given by sections at stations x (m,), growing [m]; each runs from its gauge side to its field side."""

    x: np.ndarray
    sections: tuple[Profile, ...]

    def section(self, x: float) -> Profile:
        """The section at x [m]. Error: second order in the stations' distance (tests/geometry/test_section_loft.py)."""
        if not self.x[0] <= x <= self.x[-1]:
            raise ProfileError(f"loft: x = {x:g} m is outside its stations, {self.x[0]:g} to {self.x[-1]:g} m")
        k = int(np.clip(np.searchsorted(self.x, x, side="right") - 1, 0, len(self.x) - 2))
        return between(self.sections[k], self.sections[k + 1], float((x - self.x[k]) / (self.x[k + 1] - self.x[k])))


def matched_body(x: np.ndarray, sections: Sequence[Profile], count: int = 24, label: str = "body") -> LoftedBody:
    """Body lofted through sections at x (m,) [m] with `count` nodes between each two of their marks: what SectionLoft
    is, with cubics in x.

    Features that have no length in any section are left out; one that has in some only is refused, as its nodes would
    coincide.
    """
    lines = [
        [curve_at(p, np.linspace(a, b, count)) for a, b in zip(ends[:-1], ends[1:])]
        for p, ends in ((p, marks(p)) for p in sections)
    ]
    spans = np.array([[np.abs(points[-1] - points[0]).max() for points, _ in line] for line in lines])
    kept = [k for k in range(spans.shape[1]) if spans[:, k].max() > 1e-6]
    for k in kept:
        if spans[:, k].min() <= 1e-6:
            raise ProfileError(
                f"{label}: section at x = {x[int(np.argmin(spans[:, k]))]:g} m has no length in feature {k}, others"
                " have: give it a rounding"
            )
    bodies = []
    for line in lines:
        points = np.vstack([line[k][0][min(i, 1) :] for i, k in enumerate(kept)])
        slope = [line[k][1][:, 1] / line[k][1][:, 0] for k in kept]
        after = np.concatenate([v[:-1] for v in slope] + [slope[-1][-1:]])
        before = np.concatenate([slope[0][:1]] + [v[1:] for v in slope])
        bodies.append((points[:, 0], points[:, 1], after, before))
    y, z, after, before = (np.array(rows) for rows in zip(*bodies))
    return LoftedBody(np.asarray(x, float), y, z, after, before, label)


def upper_line(first: Profile, second: Profile, label: str = "") -> Profile:
    """The higher of two lines z(y) at each y, with a kink where they cross: what a wheel meets of two bodies side by
    side.

    Where only one of them is, that one; a step from one to the other becomes a line over 1e-9 m.
    Raises ProfileError where one of them turns back in y or they lie apart.
    """
    ends = first.points[[0, -1], 0], second.points[[0, -1], 0]
    if max(low for low, _ in ends) > min(high for _, high in ends):
        raise ProfileError(f"{first.label} and {second.label} lie apart: no y in common")
    y = np.unique(np.concatenate([first.points[:, 0], second.points[:, 0]]))
    y = y[np.append(True, np.diff(y) > APART)]
    value = np.nan_to_num([first.height(y), second.height(y)], nan=-np.inf)
    upper = np.argmax(value, axis=0)
    changes = np.flatnonzero(np.diff(upper))
    edges = [y[0], *(_crossing(first, second, y[k : k + 2], value[:, k : k + 2]) for k in changes), y[-1]]
    pieces = []
    for a, b, which in zip(edges[:-1], edges[1:], upper[[*changes, -1]]):
        inner = y[(y > a + APART) & (y < b - APART)]
        if b - a > APART:
            pieces.append((np.concatenate([[a], inner, [b]]), (first, second)[which]))
    return _joined(pieces, label or f"{first.label} and {second.label}")


def _crossing(first: Profile, second: Profile, y: np.ndarray, value: np.ndarray) -> float:
    """Where the higher line changes between two y; at the end of a line where it begins or ends there."""
    if np.isinf(value[:, 0]).any():
        return y[1]
    if np.isinf(value[:, 1]).any():
        return y[0]
    return brentq(lambda at: float(first.height(at) - second.height(at)), *y, xtol=1e-13)


def _joined(pieces, label: str) -> Profile:
    """Profile of graph pieces (y, line); where two do not meet, a line over APART joins them."""
    points, before, after = np.empty((0, 2)), np.empty(0), np.empty(0)
    for y, line in pieces:
        ends = np.concatenate([y[:-1], [y[-1] - 1e-12]])  # the slope on reaching the last point
        new, angle = np.column_stack([y, line.height(y)]), np.arctan(line.slope(ends))
        reached = angle.copy()
        if len(points) and abs(new[0, 1] - points[-1, 1]) < APART:
            after[-1], new, angle, reached = angle[0], new[1:], angle[1:], reached[1:]
        elif len(points):
            new[0, 0] = points[-1, 0] + APART
            after[-1] = reached[0] = np.arctan2(new[0, 1] - points[-1, 1], APART)
        points, before, after = np.vstack([points, new]), np.append(before, reached), np.append(after, angle)
    return Profile(points, before, after, np.full(len(points), np.nan), label, "upper line of two sections")
