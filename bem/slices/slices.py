"""Slices of two bodies along x: their sections at the patch, how the sections change along it, and the gap between
them.

In the plane of a section the first axis is lateral, the second up. The lower body's face is the line along which
everything is laid: s [m] runs along it, and the gap in a slice is measured along its normals, from the lower section to
the upper.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.interpolate import make_interp_spline

from bem.patch import ContactInputError, NoContactError
from bem.plane.body import Body
from bem.plane.curve import Curve
from bem.plane.initial_contact import nearest_positions
from bem.plane.pairing import BEHIND, smooth_gap

Section = Callable[[float], list[np.ndarray]]
_SAMPLES = 4001


@dataclass(frozen=True)
class Slices:
    """Two bodies, and their faces in any slice.

    Parameters
    ----------
    lower, upper : Body
        The sections at x = 0; both need a held edge (or be infinite).
    lower_section, upper_section : function, optional
        x [m] -> smooth pieces [(n, 2), ...] [m] of the face there; None where the body is a prism.
    direction : (float, float)
        Along which the upper body approaches, given at any length, kept as a unit vector.

    Examples
    --------
    >>> from rail_fem.bem.plane.outline import block_behind
    >>> y = np.linspace(-0.04, 0.04, 161)
    >>> crown, tread = np.column_stack([y, -(y**2) / 0.6]), np.column_stack([y, y**2 / 2.0])
    >>> rail, wheel = (bem.Body(block_behind(line, end), bem.STEEL) for line, end in ((crown, -0.1), (tread, 0.1)))
    >>> rolled = lambda x: [tread + [0.0, x**2 / 0.92]]  # of a wheel of 0.46 m
    >>> slices = bem.Slices(rail, wheel, upper_section=rolled)
    >>> slices.direction
    (0.0, -1.0)
    """

    lower: Body
    upper: Body
    lower_section: Section | None = None
    upper_section: Section | None = None
    direction: tuple[float, float] = (0.0, -1.0)

    def __post_init__(self) -> None:
        direction = np.asarray(self.direction, float)
        if direction.shape != (2,) or not np.isfinite(direction).all() or not np.hypot(*direction) > 0:
            raise ContactInputError(
                f"direction {self.direction!r}: give the direction (lateral, up) along which the upper body approaches"
            )
        object.__setattr__(self, "direction", tuple((direction / np.hypot(*direction)).tolist()))


def wheel_on_prism(
    lower: Body, upper: Body, axis_height: float, direction: tuple[float, float] = (0.0, -1.0)
) -> Slices:
    """A body of revolution over a prism.

    upper : its meridian section; the axis of revolution is lateral, at `axis_height` [m] in the upper section's frame
    """
    pieces = [curve.points for curve in upper.outline.edge_curves(upper.face)]
    highest = max(piece[:, 1].max() for piece in pieces)
    if not axis_height > highest:
        raise ContactInputError(
            f"axis of revolution at {axis_height:g} m is not above the face, which reaches up to {highest:g} m: "
            "give the height of the axis in the frame of the section"
        )

    def section(x: float) -> list[np.ndarray]:
        found = []
        for piece in pieces:
            radius = axis_height - piece[:, 1]
            reached = radius > abs(x)
            if reached.sum() >= 2:
                found.append(np.column_stack([piece[reached, 0], axis_height - np.sqrt(radius[reached] ** 2 - x**2)]))
        return found

    return Slices(lower, upper, upper_section=section, direction=direction)


def slices_of_profiles(
    lower: Body,
    upper: Body,
    x: Sequence[float],
    lower_profiles: Sequence[np.ndarray] | None = None,
    upper_profiles: Sequence[np.ndarray] | None = None,
    direction: tuple[float, float] = (0.0, -1.0),
) -> Slices:
    """Slices from measured or cut profiles (n, 2) [m] at positions x (m,) [m], cubic in between; None: the body is a
    prism.

    Profiles of one body must have the same number of points, each on its own line along x.
    """
    positions = np.asarray(x, float)
    if positions.ndim != 1 or len(positions) < 2 or not (np.diff(positions) > 0).all():
        raise ContactInputError("x of the slices: give at least two positions in rising order [m]")
    of_lower = _between(positions, lower_profiles, lower, "lower")
    return Slices(lower, upper, of_lower, _between(positions, upper_profiles, upper, "upper"), direction)


def _between(positions: np.ndarray, profiles: Sequence[np.ndarray] | None, body: Body, name: str) -> Section | None:
    if profiles is None:
        return None
    shapes = {np.shape(profile) for profile in profiles}
    if len(profiles) != len(positions) or len(shapes) != 1:
        raise ContactInputError(
            f"{name} profiles: {len(profiles)} of shapes {sorted(shapes)} for {len(positions)} positions: give one per"
            " position, all with the same number of points"
        )
    stack = np.asarray(profiles, float)
    if not np.isfinite(stack).all():
        raise ContactInputError(
            f"{name} profile at x = {positions[np.argwhere(~np.isfinite(stack))[0][0]]:g} m is not finite"
        )
    ends = body.outline.edge_curves(body.face)
    if (ends[-1].points[-1] - ends[0].points[0]) @ (stack[0, -1] - stack[0, 0]) < 0:
        stack = stack[:, ::-1]

    between = make_interp_spline(positions, stack, k=min(3, len(positions) - 1))

    def section(x: float) -> list[np.ndarray]:
        return [between(x)] if positions[0] <= x <= positions[-1] else []

    return section


@dataclass
class SliceGap:
    """Gap function over (x, s) with the upper body brought into contact at x = 0, and from there on by an approach
    along the direction.

    initial_approach : (2,) [m] by which the upper body was moved into contact; upper : Body there; reach : largest gap
        considered [m], half the upper body's size
    """

    slices: Slices
    reach: float = field(init=False)
    initial_approach: np.ndarray = field(init=False)
    upper: Body = field(init=False)

    def __post_init__(self) -> None:
        slices, direction = self.slices, np.array(self.slices.direction)
        self.reach = slices.upper.outline.size / 2
        near = nearest_positions(slices.lower, slices.upper, direction, self.reach)
        if not near:
            raise NoContactError(
                f"moved along ({direction[0]:.3g}, {direction[1]:.3g}) the sections at x = 0 never meet within"
                f" {self.reach:g} m: check their positions"
            )
        self.initial_approach = near[0][0] * direction
        self.upper = slices.upper.moved(self.initial_approach)
        self.first_point = near[0][1] + self.initial_approach
        self.curves = slices.lower.outline.edge_curves(slices.lower.face)
        self.begin = np.r_[0.0, np.cumsum([curve.length for curve in self.curves])]
        turned = self.curves[-1].points[-1][0] < self.curves[0].points[0][0]
        # s as the grid sees it grows to the left-hand side's lateral axis
        self.sense = -1.0 if turned else 1.0
        s = np.linspace(0, self.begin[-1], _SAMPLES)
        self.origin = float(s[np.hypot(*(self._along(s, "at") - self.first_point).T).argmin()])

    @property
    def window(self) -> tuple[float, float]:
        """Range of the face's coordinate [m]; it equals the lateral coordinate where the bodies touch."""
        ends = self.first_point[0] + self.sense * (np.array([0.0, self.begin[-1]]) - self.origin)
        return float(ends.min()), float(ends.max())

    def _arc(self, y: np.ndarray) -> np.ndarray:
        return self.origin + self.sense * (np.asarray(y, float) - self.first_point[0])

    def _along(self, s: np.ndarray, what: str) -> np.ndarray:
        piece = np.clip(np.searchsorted(self.begin, s, side="right") - 1, 0, len(self.curves) - 1)
        out = np.empty((len(s), 2))
        for k, curve in enumerate(self.curves):
            mine = piece == k
            out[mine] = getattr(curve, what)(np.clip(s[mine] - self.begin[k], 0, curve.length))
        return out

    def face(self, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Points and outward normals (m, 2) of the lower face at the grid's lateral coordinates (m,)."""
        s = self._arc(y)
        along = self._along(s, "direction")
        return self._along(s, "at"), np.column_stack([along[:, 1], -along[:, 0]])

    def place(self, y: np.ndarray) -> dict[str, np.ndarray]:
        """Where a patch of cells at the lateral coordinates (m,) lies: `points` and what follows of a SlicePatch."""
        points, normals = self.face(y)
        direction = np.array(self.slices.direction)
        return {"points": points, "normals": normals, "direction": direction, "initial_approach": self.initial_approach}

    def cosines(self, y: np.ndarray) -> np.ndarray:
        """(m,) share of the approach that closes the gap at the grid's lateral coordinates."""
        return -self.face(y)[1] @ np.array(self.slices.direction)

    def __call__(self, x: np.ndarray, y: np.ndarray, approach: float = 0.0) -> np.ndarray:
        """(nx, ny) gap [m] along the normals at points of a grid (nx, ny); +inf where a body has no surface.

        approach : [m] by which the undeformed upper body is pushed on after initial contact; the gap is negative where
            they overlap
        """
        position = self.initial_approach + approach * np.array(self.slices.direction)
        rows = np.asarray(y)[0]
        points, normals = self.face(rows)
        outside = (rows < self.window[0]) | (rows > self.window[1])
        values = np.array([self._slice(float(at), points, normals, position) for at in np.asarray(x)[:, 0]])
        values[:, outside] = np.inf
        return values

    def _slice(self, x: float, points: np.ndarray, normals: np.ndarray, position: np.ndarray) -> np.ndarray:
        slices = self.slices
        pieces = (
            [c.points for c in slices.upper.outline.edge_curves(slices.upper.face)]
            if slices.upper_section is None
            else slices.upper_section(x)
        )
        if not pieces:
            return np.full(len(points), np.inf)
        gap = smooth_gap(points, normals, [Curve.through(piece + position) for piece in pieces], self.reach, BEHIND)
        if slices.lower_section is not None:
            lower = slices.lower_section(x)
            if not lower:
                return np.full(len(points), np.inf)
            gap = gap - smooth_gap(points, normals, [Curve.through(piece[::-1]) for piece in lower], self.reach, 1.0)
        gap[np.isnan(gap)] = np.inf
        return np.where(gap > -np.inf, gap, np.inf)
