"""A wheelset and the track under it: datum points and degrees of freedom of thesis section 3.2 and Table 3-1.

Track axes: x forward, y to the left, z up; origin on the track's centre line, at the level of the rail crowns. The
angles follow the right hand: yaw about z (left wheel backwards), roll about the yawed x (left wheel up), spin about the
axle (forward rolling is +). Each side is looked at in *side axes*: those of the track on the left, mirrored in y on the
right, so that both read as a left wheel on a left rail and what is mirrored gives the same answer to the last bit.
"""

from dataclasses import dataclass, field
from numbers import Real

import numpy as np

from geometry.axes import FLANGE_BACK, GAUGE_POINT_DEPTH
from geometry.profiles.profile import Profile, ProfileError
from geometry.profiles.rail import gauge_face, rail_head

OFF_CROWN = 0.1e-3  # of a rail's crown from z = 0; what is left of scatter after smoothing is less [m]
WIDEST = 1.0  # of any rail or wheel [m]
SIDES = {"left": 1.0, "right": -1.0}


class WheelsetError(ValueError):
    """A wheelset or track that cannot be, or that does not stand: says what, where, how large, what to do."""


def check_range(owner: str, limits: tuple[tuple[str, float, float, float], ...]) -> None:
    """Raise WheelsetError for the first of (name, value, least, most) that is out of range or not finite."""
    for name, value, least, most in limits:
        if not (isinstance(value, Real) and np.isfinite(value) and least <= value <= most):
            raise WheelsetError(f"{owner}: {name} = {value!r} is outside [{least:g}, {most:g}] (SI units)")


def check_fields(owner: str, thing: object, **limits: tuple[float, float]) -> None:
    """The same of fields by name: (least, most)."""
    check_range(owner, tuple((name, getattr(thing, name), *ends) for name, ends in limits.items()))


def check_side(side: str) -> None:
    """Raise WheelsetError for what is no side."""
    if side not in SIDES:
        raise WheelsetError(f'side = {side!r} is neither "left" nor "right"')


@dataclass(frozen=True, eq=False)
class Wheelset:
    """Two wheels on an axle and where it is.

    Parameters
    ----------
    left, right : Profile
        Wheel profiles, each in its own axes (geometry.axes: + towards its field side); right None: as left.
    radius, right_radius : float
        Of the wheels at their tread datum, 70 mm from the flange back [m]; None: as the left one.
    back_to_back : float
        Distance of the flange backs [m].
    x, y, z : float
        Middle of the axle in track axes [m].
    yaw, roll : float
        [rad]
    spin : float
        Angle turned about the axle [rad].

    Examples
    --------
    >>> wheelset = geometry.Wheelset(geometry.wheel_profile("S1002"), radius=0.46)
    >>> round(wheelset.datum_arm, 3)  # [m]
    0.75
    """

    left: Profile
    right: Profile | None = None
    radius: float = 0.425
    right_radius: float | None = None
    back_to_back: float = 1.360
    x: float = 0.0
    y: float = 0.0
    z: float = 0.425
    yaw: float = 0.0
    roll: float = 0.0
    spin: float = 0.0

    def __post_init__(self):
        for side in SIDES:
            check_width(f"{side} wheel", self.profile(side))
        anywhere = -np.inf, np.inf
        check_fields("wheelset", self, radius=(0.1, 1.0), back_to_back=(0.5, 2.0), yaw=(-0.1, 0.1), roll=(-0.2, 0.2))
        check_fields("wheelset", self, y=(-0.5, 0.5), z=(-2.0, 2.0), x=anywhere, spin=anywhere)
        check_range("wheelset", (("radius right", self.radius_of("right"), 0.1, 1.0),))

    def profile(self, side: str) -> Profile:
        """The wheel profile of "left" or "right"."""
        return self.right if side == "right" and self.right is not None else self.left

    def radius_of(self, side: str) -> float:
        """Radius [m] at the tread datum of "left" or "right"."""
        return self.right_radius if side == "right" and self.right_radius is not None else self.radius

    @property
    def datum_arm(self) -> float:
        """Distance [m] along the axle from its middle to each tread datum."""
        return self.back_to_back / 2 + FLANGE_BACK


@dataclass(frozen=True)
class RailPosition:
    """How far a rail has left its nominal position: lateral and vertical [m] in track axes, roll [rad] about its crown
    point."""

    lateral: float = 0.0
    vertical: float = 0.0
    roll: float = 0.0

    def __post_init__(self):
        check_fields("rail", self, lateral=(-0.1, 0.1), vertical=(-0.1, 0.1), roll=(-0.2, 0.2))


@dataclass(frozen=True)
class CheckRail:
    """A check rail or wing beside a rail.

    Parameters
    ----------
    flangeway : float
        From the gauge face to its face [m].
    top : float
        Above the rail's crown [m].

    Examples
    --------
    >>> track = geometry.Track(geometry.rail_head("56E1"), left_check=geometry.CheckRail(flangeway=0.041))
    >>> track.check_rail("left").top
    0.0
    """

    flangeway: float = 0.041
    top: float = 0.0

    def __post_init__(self):
        check_fields("check rail", self, flangeway=(0.02, 0.2), top=(-0.02, 0.1))


@dataclass(frozen=True, eq=False)
class Track:
    """Two rails.

    Parameters
    ----------
    left, right : Profile
        Each with its gauge side at -y, its crown at z = 0, inclined as it lies; right None: as left.
    gauge : float
        Distance of the gauge points [m], which lie on the gauge faces `gauge_point` below the crowns.
    gauge_point : float
        [m]
    cant : float
        Of the track plane, + when the left rail is the higher one [rad]; track axes lie in that plane, so that
        positions do not depend on it and weight does: `level`, and rest_under of rail_fem.contact.load_sharing.
    left_position, right_position : RailPosition
        The 3 degrees of freedom of each rail.
    left_check, right_check : CheckRail, optional
        A flange back stops there (geometry.contact.flange_back).

    Examples
    --------
    >>> track = geometry.Track.plain_line("60E1", inclination=1 / 40)
    >>> track.gauge  # [m]
    1.435
    """

    left: Profile
    right: Profile | None = None
    gauge: float = 1.435
    gauge_point: float = GAUGE_POINT_DEPTH
    cant: float = 0.0
    left_position: RailPosition = field(default_factory=RailPosition)
    right_position: RailPosition = field(default_factory=RailPosition)
    left_check: CheckRail | None = None
    right_check: CheckRail | None = None

    def __post_init__(self):
        check_fields("track", self, gauge=(0.5, 2.0), gauge_point=(0.005, 0.03), cant=(-0.2, 0.2))
        for side in ("left", "right") if self.right is not None else ("left",):
            check_crown(side, self.profile(side))

    @classmethod
    def plain_line(cls, rail: str = "56E1", inclination: float = 1 / 20, gauge: float = 1.435, **others) -> "Track":
        """Both rails of one standard head with one inclination (thesis Table 3-1: BS113A, 1:20, 1435 mm)."""
        return cls(rail_head(rail, inclination), gauge=gauge, **others)

    def level(self, vectors: np.ndarray) -> np.ndarray:
        """Vectors (..., 3) of track axes in level axes: x forward, y horizontal to the left, z vertically up."""
        cosine, sine = np.cos(self.cant), np.sin(self.cant)
        return np.asarray(vectors, float) @ np.array([[1, 0, 0], [0, cosine, sine], [0, -sine, cosine]])

    def profile(self, side: str) -> Profile:
        """The rail profile of "left" or "right"."""
        return self.right if side == "right" and self.right is not None else self.left

    def check_rail(self, side: str) -> CheckRail | None:
        """The check rail of "left" or "right", if there is one."""
        return self.left_check if side == "left" else self.right_check

    def gauge_offset(self, side: str) -> float:
        """y [m] in side axes of the rail's own origin: what puts its gauge point half a gauge from the middle."""
        points = self.profile(side).points
        if points[:, 1].max() - points[0, 1] < self.gauge_point:
            raise WheelsetError(
                f"{self.profile(side).label}: the rail profile ends {points[:, 1].max() - points[0, 1]:.4f} m below its"
                f" crown on the gauge side, above the gauge point at {self.gauge_point:g} m: give more of its gauge"
                " face or a smaller gauge_point"
            )
        return self.gauge / 2 - gauge_face(self.profile(side), self.gauge_point)

    def placed(self, side: str) -> Profile:
        """The running part of a rail in side axes, moved and rolled as its position says."""
        position, sign = getattr(self, f"{side}_position"), SIDES[side]
        rolled = self.profile(side).turned(sign * position.roll)
        return rolled.shifted(self.gauge_offset(side) + sign * position.lateral, position.vertical).from_above()


def check_width(owner: str, profile: Profile) -> None:
    """Raise WheelsetError for a profile in millimetres."""
    width = float(np.ptp(profile.points[:, 0]))
    if width > WIDEST:
        raise WheelsetError(f"{owner} {profile.label}: {width:g} m wide: lengths are in m, these look like mm")


def check_crown(side: str, rail: Profile) -> None:
    """Raise WheelsetError unless the rail's highest point has z = 0 within OFF_CROWN: roll and gauge are taken from
    there."""
    check_width(f"{side} rail", rail)
    crown = float(rail.points[:, 1].max())
    if abs(crown) > OFF_CROWN:
        raise WheelsetError(
            f"{side} rail {rail.label}: its crown lies at z = {1e3 * crown:.3f} mm, a track's crowns at 0: move it with"
            f" rail.shifted(0, {-crown:.6f}), read it by geometry.profiles.doctor, or lower the rail by"
            " RailPosition(vertical=...)"
        )


def wheel_table(wheelset: Wheelset, side: str) -> np.ndarray:
    """Table (4, n) for the compiled interpolation of a wheel profile; WheelsetError where its line turns back."""
    try:
        return np.array(wheelset.profile(side).hermite_table())
    except ProfileError as error:
        raise WheelsetError(
            f"{side} wheel: {error}; repair it with the profile doctor, or use Profile.graph_part()"
        ) from error
