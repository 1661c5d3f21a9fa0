"""A wheel brought into contact with a rail or a crossing, seen from the contact patch: gaps for the contact
solvers of `bem`.

The wheel is lowered along z at a given lateral position until it comes into contact. The patch's frame stands at that
point: x' forward and s lateral lie in the common tangent plane, h along its normal into the wheel. Both surfaces become
heights h(x', s), exact on the profiles; the gap is their difference and knows nothing of rails any more. It is what the
half-space and the slices of `bem` take.

    pair = plain_rail_pair()                    # P8 on BS113A, rail 1:20, gauge 1435, back-to-back 1360
    patch = pair.patch(49505.0)                 # of the half-space under a wheel load [N]

Axes: geometry.axes. Error of the heights: 1e-12 m against the profiles (tests/rail_fem/test_contact_pairs.py).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from bem.exact.hertz import PointContact, point_contact
from bem.halfspace.normal import normal_contact
from bem.material import STEEL, Elastic, contact_modulus
from bem.patch import Patch
from geometry.axes import tread_datum_y
from geometry.profiles.profile import Profile
from geometry.profiles.rail import rail_head
from geometry.profiles.wheel import wheel_profile
from geometry.surfaces.any_crossing import AnyCrossing

Surface = Callable[[np.ndarray, np.ndarray], np.ndarray]  # z(x, y) [m], NaN where the body is not

ROLLING_RADIUS = 0.425  # of the thesis' wheel, 850 mm diameter, at the tread datum
INCLINATION = 1 / 20  # of plain rails
_EXACT = 1e-11  # heights are iterated to this [m]
_BEND = 0.5e-3  # half the chord over which curvatures are taken [m]


class ContactPairError(ValueError):
    """A wheel that cannot be brought into contact with: says what, where, what to do."""


@dataclass(frozen=True)
class WheelSurface:
    """Underside z(x, y) [m] of a wheel of revolution, its tread datum at (x, y, z) = position, axle along y."""

    profile: Profile
    rolling_radius: float = ROLLING_RADIUS
    position: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def __call__(self, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        x0, y0, z0 = self.position
        radius = self.rolling_radius - self.profile.height(np.asarray(y) - y0)
        with np.errstate(invalid="ignore"):
            return z0 + self.rolling_radius - np.sqrt(radius**2 - (np.asarray(x) - x0) ** 2)


def plain_rail(profile: Profile) -> Surface:
    """The running surface of a straight rail of this profile."""
    head = profile.graph_part()
    return lambda x, y: head.height(np.asarray(y) + 0.0 * np.asarray(x))


def crossing_surface(crossing: AnyCrossing, body: str | None = None) -> Surface:
    """The running surface of a crossing: "wing", "nose", or the higher of both."""
    if body is not None:
        return lambda x, y: crossing.top_height(x, y, body)
    return lambda x, y: np.fmax(crossing.top_height(x, y, "wing"), crossing.top_height(x, y, "nose"))


@dataclass(frozen=True)
class ContactPair:
    """point (3,) [m] : first point of contact; frame (3, 3) : rows x' forward, s lateral, normal into the wheel
    wheel, rail : surfaces in place, touching there
    """

    point: np.ndarray
    frame: np.ndarray
    wheel: WheelSurface
    rail: Surface
    wheel_steel: Elastic = STEEL
    rail_steel: Elastic = STEEL
    label: str = field(default="", compare=False)

    @property
    def angle(self) -> float:
        """Contact angle [rad]: slope of the tangent plane across the track, positive where the rail rises to the field
        side."""
        return float(np.arctan2(self.frame[1, 2], self.frame[1, 1]))

    def rail_height(self, x: np.ndarray, s: np.ndarray) -> np.ndarray:
        """h [m] of the rail over the tangent plane at (x', s) [m], NaN where there is none."""
        return _heights(self.rail, self.point, self.frame, x, s)

    def wheel_height(self, x: np.ndarray, s: np.ndarray) -> np.ndarray:
        """h [m] of the wheel over the tangent plane at (x', s) [m], NaN where there is none."""
        return _heights(self.wheel, self.point, self.frame, x, s)

    def gap(self, x: np.ndarray, s: np.ndarray) -> np.ndarray:
        """Gap [m] along the normal at (x', s) [m], 0 at the first point of contact; +inf where a body has no
        surface."""
        gap = self.wheel_height(x, s) - self.rail_height(x, s)
        return np.where(np.isfinite(gap), gap, np.inf)

    def normal_force(self, wheel_load: float) -> float:
        """Force [N] along the normal of a wheel that is free to move up and down only, without friction."""
        return wheel_load / float(self.frame[2, 2])

    def window(self, length: float = 0.012, width: float = 0.02) -> tuple[tuple[float, float], tuple[float, float]]:
        """Search window of +- length, +- width [m] about the first point of contact, as
        bem.halfspace.normal.normal_contact takes it."""
        return (-length, length), (-width, width)

    def patch(
        self,
        wheel_load: float,
        cells: int = 88,
        window: tuple[tuple[float, float], tuple[float, float]] | None = None,
        estimate: bool = True,
    ) -> Patch:
        """The half-space's patch under a vertical wheel load [N]; arguments and errors of
        bem.halfspace.normal.normal_contact."""
        load, window = self.normal_force(wheel_load), window or self.window()
        steels = self.wheel_steel, self.rail_steel
        return normal_contact(self.gap, *steels, load=load, window=window, cells=cells, estimate=estimate)

    def radii(self) -> tuple[float, float]:
        """Relative radii [m] along x' and s at the first point of contact, from a chord of 1 mm."""
        along = self.gap(np.array([-_BEND, _BEND]), np.zeros(2)).mean()
        across = self.gap(np.zeros(2), np.array([-_BEND, _BEND])).mean()
        return _BEND**2 / (2 * along), _BEND**2 / (2 * across)

    def hertz(self, wheel_load: float) -> PointContact:
        """Hertz' contact of the radii at the first point of contact; blind to all that changes within the patch."""
        return point_contact(
            self.normal_force(wheel_load), *self.radii(), contact_modulus(self.wheel_steel, self.rail_steel)
        )


def bring_together(
    profile: Profile,
    rail: Surface,
    datum: tuple[float, float],
    rolling_radius: float,
    steels: tuple[Elastic, Elastic] = (STEEL, STEEL),
    label: str = "",
) -> ContactPair:
    """Lower a wheel whose tread datum is at (x, y) [m] onto a straight rail, which it touches below its axle.

    steels : wheel, rail. Raises ContactPairError where nothing lies below the wheel.
    """
    hanging = WheelSurface(profile, rolling_radius, (*datum, 0.0))
    y = datum[1] + profile.points[:, 0]
    low, high, counts = np.array([datum[0], y.min()]), np.array([datum[0], y.max()]), [1, 1351]
    for _ in range(9):
        x, y = np.meshgrid(*(np.linspace(a, b, n) for a, b, n in zip(low, high, counts)), indexing="ij")
        opening = hanging(x, y) - rail(x, y)
        if not np.isfinite(opening).any():
            raise ContactPairError(
                f"{label or profile.label}: no rail lies below the wheel with its datum at x = {datum[0]:g}, y ="
                f" {datum[1]:g} m"
            )
        i, j = np.unravel_index(np.nanargmin(opening), opening.shape)
        best = np.array([x[i, j], y[i, j]])
        step = 2 * (high - low) / np.maximum(np.array(counts) - 1, 1)
        low, high, counts = best - step, best + step, [1, 21]
    return pair_at(profile, rail, datum, best, rolling_radius, *steels, label=label)


def pair_at(
    profile: Profile,
    rail: Surface,
    datum: tuple[float, float],
    first_point: np.ndarray,
    rolling_radius: float = ROLLING_RADIUS,
    wheel_steel: Elastic = STEEL,
    rail_steel: Elastic = STEEL,
    label: str = "",
) -> ContactPair:
    """A wheel with its tread datum at (x, y) [m] that touches the rail first at `point` (2,) x, y [m], as a search has
    found.

    Raises ContactPairError where one of the two has no surface there.
    """
    hanging, at = WheelSurface(profile, rolling_radius, (*datum, 0.0)), np.asarray(first_point, float)
    height = float(rail(at[:1], at[1:])[0])
    least = float(hanging(at[:1], at[1:])[0]) - height
    if not np.isfinite(least):
        raise ContactPairError(
            f"{label or profile.label}: wheel or rail has no surface at x = {at[0]:g}, y = {at[1]:g} m, as where it"
            " stands on a rail's end or beside a joint_gap: no half-space lies there; take rigid_hertz or fe_full, or"
            " another window"
        )
    wheel, point = WheelSurface(profile, rolling_radius, (*datum, -least)), np.array([*at, height])
    return ContactPair(point, _frame(wheel, rail, point), wheel, rail, wheel_steel, rail_steel, label)


def _frame(wheel: Surface, rail: Surface, point: np.ndarray) -> np.ndarray:
    """Rows: x' forward, s lateral, normal up, of the mean tangent plane of both surfaces; of one, where the other has
    an edge there."""
    step, slopes = 1e-6, []
    for surface in (wheel, rail):
        x, y = point[0] + step * np.array([-1, 1, 0, 0]), point[1] + step * np.array([0, 0, -1, 1])
        z, middle = surface(x, y), float(surface(point[:1], point[1:2])[0])
        kink = np.abs(z[::2] + z[1::2] - 2 * middle).max() / step
        slopes.append((kink, (z[1::2] - z[::2]) / (2 * step)))
    smooth = [slope for kink, slope in slopes if kink < 1e-3] or [slope for _, slope in slopes]
    along, across = np.mean(smooth, axis=0)
    lateral = np.array([0.0, 1.0, across]) / np.hypot(1.0, across)
    normal = np.array([-along, -across, 1.0]) / np.sqrt(1 + along**2 + across**2)
    return np.array([np.cross(lateral, normal), lateral, normal])


def _heights(surface: Surface, point: np.ndarray, frame: np.ndarray, x: np.ndarray, s: np.ndarray) -> np.ndarray:
    """h [m] where the normal through (x', s) meets a surface: Newton with one-sided slopes; NaN where it does not."""
    x, s = np.broadcast_arrays(np.asarray(x, float), np.asarray(s, float))
    foot = point + x[..., None] * frame[0] + s[..., None] * frame[1]
    height, normal, step = np.zeros(x.shape), frame[2], 1e-7
    for _ in range(30):
        at = foot + height[..., None] * normal
        z = surface(at[..., 0], at[..., 1])
        miss = at[..., 2] - z
        if not np.nanmax(np.abs(miss), initial=0.0) > _EXACT:
            break
        rise = (surface(at[..., 0] + step * normal[0], at[..., 1] + step * normal[1]) - z) / step
        rise = np.where(np.isfinite(rise), rise, 0.0)
        # beside the body it stays where it is
        height = height - np.where(np.isfinite(miss), miss, 0.0) / (normal[2] - rise)
    return np.where(np.abs(miss) <= 1e-9, height, np.nan)


def plain_rail_pair(
    rail: str = "56E1", lateral: float = 0.0, wheel_steel: Elastic = STEEL, rail_steel: Elastic = STEEL
) -> ContactPair:
    """P8 on a rail inclined 1:20, gauge 1435, back-to-back 1360 mm, the wheelset shifted by `lateral` [m] towards the
    field side."""
    datum, head = (0.0, tread_datum_y(1.435, 1.360) + lateral), plain_rail(rail_head(rail, INCLINATION))
    label = f"P8 on {rail}, lateral {lateral * 1e3:g} mm"
    return bring_together(wheel_profile("P8"), head, datum, ROLLING_RADIUS, (wheel_steel, rail_steel), label)
