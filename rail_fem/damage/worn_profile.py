"""A rail section that wears: nodes moved along their normals by the depth worn off, the area kept to round-off.

Depth belongs to the line's length, so that what a patch removes is depth times width of its strips. Moved inwards along
normals, a curved line loses d - kappa d^2 / 2 per length instead of d: the step is corrected for the curvature, and one
factor on all of it then meets the area exactly; how far it is from 1 is kept as the error of the step.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from geometry.profiles.doctor import with_corners
from geometry.profiles.profile import KINK, Profile, ProfileError, lengths

SPACING = 0.1e-3  # of the nodes [m]
STEEPEST_STEP = 0.1  # of the least radius of curvature where it wears, that one step may be deep
CLOSE = 1e-13  # relative, of an area that counts as met
ROUNDS = 50
PLAIN = 0.05e-3  # nodes nearer than this to a corner are left out beside it [m]


class WornOutError(ValueError):
    """A step that no profile can take, or a profile that is worn through: where, how deep, what to do."""


@dataclass(frozen=True, eq=False)
class WornProfile:
    """points : (n, 2) nodes [m], from the gauge side over the crown;  corners : indices of kinks that stay kinks;
    label : what it is."""

    points: np.ndarray
    corners: np.ndarray
    label: str = ""

    @classmethod
    def of(cls, profile: Profile, spacing: float = SPACING) -> WornProfile:
        """Nodes evenly along what can be seen from above of a profile, its kinks among them."""
        line = profile.from_above()
        s = line.arc_length
        # a switch rail's wall between two bodies is 1e-9 m wide: its two ends are one corner
        turn = np.abs(line.angle_after - line.angle_before)
        turn[[0, -1]] = 0.0
        at = s[turn > KINK]
        at = at[np.append(True, np.diff(at) > PLAIN)] if len(at) else at
        ends = np.concatenate([[s[0]], at, [s[-1]]])
        ends = ends[np.append(True, np.diff(ends) > PLAIN)]
        parts = [np.linspace(a, b, max(int(round((b - a) / spacing)), 1) + 1) for a, b in zip(ends[:-1], ends[1:])]
        wanted = np.concatenate([parts[0], *(part[1:] for part in parts[1:])])
        corners = np.cumsum([len(part) - 1 for part in parts[:-1]]).astype(int)
        return cls(_on_line(line, s, wanted), corners, profile.label)

    parts = ("section",)
    flow_depth = 0.0  # a section's steel does not flow

    @property
    def along(self) -> tuple[np.ndarray, str]:
        """(n,) positions of its depths [m], and what they are."""
        return self.arc_length, "along the line, from its gauge side"

    def part(self, values: np.ndarray, b: int) -> np.ndarray:
        """Values (n,): it has one part."""
        return values

    def place(self, flat: int) -> list[float]:
        """y, z of a node [m]."""
        return [float(v) for v in self.points[flat]]

    def amount(self, depth: np.ndarray) -> float:
        """Area of depths (n,) [m2]."""
        return float((depth * self.widths).sum())

    @property
    def shape(self) -> tuple[int]:
        """Of its depths."""
        return (len(self.points),)

    def smoothed(self, depth: np.ndarray, width: float) -> np.ndarray:
        """Depths (n,) spread by a Gauss curve of standard deviation `width` [m] along the line, mirrored at its ends;
        the area is kept.

        Solved as diffusion over a time of width^2 / 2 in implicit steps, which never makes a depth negative.
        """
        if width == 0 or not depth.any():
            return depth
        from scipy.linalg import solveh_banded

        steps, w, gap = 8, self.widths, np.diff(self.arc_length)
        flow = width**2 / 2 / steps / gap
        main = w + np.concatenate([[0.0], flow]) + np.concatenate([flow, [0.0]])
        band = np.vstack([np.concatenate([[0.0], -flow]), main])
        for _ in range(steps):
            depth = solveh_banded(band, w * depth)
        return np.maximum(depth, 0.0)

    def deepest_from(self, first: WornProfile) -> float:
        """Largest distance of its nodes from where they began [m]."""
        return float(depth_between(self, first).max())

    @property
    def profile(self) -> Profile:
        """Splines between the corners."""
        return with_corners(self.points, self.corners, self.label)

    @property
    def arc_length(self) -> np.ndarray:
        """(n,) along the line from its first node [m]."""
        return lengths(self.points)

    @property
    def borders(self) -> np.ndarray:
        """(n + 1,) arc lengths between which lies what belongs to a node [m]."""
        s = self.arc_length
        return np.concatenate([s[:1], (s[1:] + s[:-1]) / 2, s[-1:]])

    @property
    def widths(self) -> np.ndarray:
        """(n,) length of the line that belongs to each node [m]."""
        return np.diff(self.borders)

    @property
    def normals(self) -> np.ndarray:
        """(n, 2) outward unit normals; at a corner the bisector."""
        step = np.diff(self.points, axis=0)
        step /= np.hypot(*step.T)[:, None]
        tangent = np.concatenate([step[:1], step[1:] + step[:-1], step[-1:]])
        tangent /= np.hypot(*tangent.T)[:, None]
        return np.column_stack([-tangent[:, 1], tangent[:, 0]])

    @property
    def curvature(self) -> np.ndarray:
        """(n,) + where the metal is convex [1/m], 0 at corners and ends."""
        step = np.diff(self.points, axis=0)
        turn = np.diff(np.unwrap(np.arctan2(step[:, 1], step[:, 0])))
        bend = np.concatenate([[0.0], -turn / self.widths[1:-1], [0.0]])
        bend[self.corners] = 0.0
        return bend

    def position(self, y: float, z: float) -> float:
        """Arc length [m] of the point of the line nearest to (y, z)."""
        step, s = np.diff(self.points, axis=0), self.arc_length
        length = np.hypot(*step.T)
        away = np.array([y, z]) - self.points[:-1]
        along = np.clip((away * step).sum(axis=1) / length**2, 0, 1)
        k = int(np.argmin(np.hypot(*(away - along[:, None] * step).T)))
        return float(s[k] + along[k] * length[k])

    def deposit(self, centre: float, offsets: np.ndarray, depths: np.ndarray, width: float) -> tuple[np.ndarray, float]:
        """Depths (n,) [m] at the nodes of strips `width` wide whose middles lie at arc length centre + offsets, and the
        area [m2] that lay beyond the line's ends. The area is kept: sum of depth times width over nodes and strips."""
        left = centre + offsets - width / 2
        order = np.argsort(left)
        edges = np.append(left[order], left[order][-1] + width)
        worn = np.concatenate([[0.0], np.cumsum(depths[order]) * width])
        area = np.interp(self.borders, edges, worn)
        return np.diff(area) / self.widths, float(worn[-1] - (area[-1] - area[0]))

    def worn(self, depth: np.ndarray, keep_area: bool = True) -> tuple[WornProfile, float]:
        """The profile after `depth` (n,) [m] has been worn off along the normals, and the factor less 1 that met the
        area.

        Raises WornOutError for depths that are negative or not finite, deeper than a tenth of the least radius of
        curvature, or that would cross the line with itself or make it turn back.
        """
        self._refuse(depth)
        if not depth.any():
            return self, 0.0
        wanted = float((depth * self.widths).sum())
        # d = n - kappa n^2 / 2, solved for n
        bent = np.maximum(1 - 2 * self.curvature * depth, 0.0)
        step = np.where(
            np.abs(self.curvature) * depth > 1e-9,
            (1 - np.sqrt(bent)) / np.where(self.curvature == 0, 1.0, self.curvature),
            depth,
        )
        factor, normals = 1.0, self.normals
        moved = self.points - step[:, None] * normals
        for _ in range(ROUNDS if keep_area else 0):
            lost = area_between(self.points, moved)
            if abs(lost / wanted - 1) < CLOSE:
                break
            factor *= wanted / lost
            moved = self.points - factor * step[:, None] * normals
        return WornProfile(self._uncrossed(moved), self.corners, self.label), factor - 1.0

    def _refuse(self, depth: np.ndarray) -> None:
        if not (np.isfinite(depth).all() and (depth >= 0).all()):
            raise WornOutError(f"{self.label}: depths to wear off must be finite and 0 or more")
        tight = np.abs(self.curvature) * depth
        if tight.max() > STEEPEST_STEP:
            k = int(np.argmax(tight))
            raise WornOutError(
                f"{self.label}: a step of {depth[k]:.3g} m at y = {self.points[k, 0]:.4f} m, where the radius is"
                f" {1 / abs(self.curvature[k]):.3g} m; one step may take {STEEPEST_STEP:g} of it: wear off less at once"
            )

    def _uncrossed(self, moved: np.ndarray) -> np.ndarray:
        old, new = np.diff(self.points, axis=0), np.diff(moved, axis=0)
        turned = (old * new).sum(axis=1) <= 0
        back = new[:, 0] <= 0
        if turned.any() or back.any():
            k = int(np.argmax(turned | back))
            raise WornOutError(
                f"{self.label}: worn through at y = {moved[k, 0]:.4f} m, z = {moved[k, 1]:.4f} m: the line would cross"
                " itself or overhang; end the study earlier, or grind before"
            )
        return moved


def area_between(before: np.ndarray, after: np.ndarray) -> float:
    """Area that a line of nodes (n, 2) has swept in moving to (n, 2) [m2], + where metal was lost."""
    y, z = np.concatenate([before, after[::-1]]).T
    return float((np.roll(y, -1) * z - y * np.roll(z, -1)).sum() / 2)


def _on_line(line: Profile, s: np.ndarray, wanted: np.ndarray) -> np.ndarray:
    """Points of a profile at arc lengths `wanted`: on its own curve where that is a function of y, on its chords where
    it is steep."""
    y, z = np.interp(wanted, s, line.points[:, 0]), np.interp(wanted, s, line.points[:, 1])
    height, slope = line.height(y), line.slope(y)
    return np.column_stack([y, np.where(np.abs(slope) < 10, height, z)])


def depth_between(worn: WornProfile, first: WornProfile) -> np.ndarray:
    """(n,) distance of a worn line's nodes from where they began [m]."""
    if worn.points.shape != first.points.shape:
        raise ProfileError(f"{worn.label}: has {len(worn.points)} nodes, began with {len(first.points)}")
    return np.hypot(*(worn.points - first.points).T)
