"""Where the wheels of a wheelset touch two prismatic rails: all points, with angle, radii, penetration and creepages.

The wheels are bodies of revolution, yawed and rolled as they stand, so that contact may lie ahead of or behind the
axle. Against a prismatic rail the search is one of plane curves (geometry.contact.gap_kernel) and its answers are exact
to what the profiles' interpolation holds: 1e-9 m (tests/geometry/test_contact_points.py). Axes: geometry.wheelset.
"""

from dataclasses import dataclass, fields, replace

import numpy as np
from scipy.interpolate import CubicHermiteSpline

from geometry.axes import FLANGE_BACK
from geometry.contact.flange_back import within_stops
from geometry.contact.gap_kernel import (
    GAP,
    NO_RAIL,
    STATION,
    ContactRow,
    Side,
    contact_row,
    nearest_positions,
    ready,
    roll_and_height,
    side_pose,
)
from geometry.contact.wheel_outline import Pose, cubic
from geometry.wheelset import SIDES, Track, Wheelset, WheelsetError, check_range, check_side, wheel_table

RESOLUTION = 0.5e-3
# of a profile from a cubic over one spacing: more of it may hide a minimum [m]
ROUGH = 0.1e-6
CORNERS = 0.3  # of a rail's points lie at its sides and corners, which are no roughness (0.15 on the built-in ones)
# of a contact over the tip of the flange; the steep flank, where a wheel is still guided, begins some 5 mm above it [m]
FLANGE_TOP = 2e-3
TOUCH = 1e-12  # what settling leaves between the gaps of both sides [m]


def evenly(table: np.ndarray, spacing: float) -> np.ndarray:
    """Positions over a profile's table (4, n), at most `spacing` apart [m]."""
    return np.linspace(table[0, 0], table[0, -1], max(int(np.ceil(np.ptp(table[0]) / spacing)), 4) + 1)


def unresolved(table: np.ndarray, positions: np.ndarray) -> np.ndarray:
    """(n,) of the points of a profile's table (4, n) the largest distance between two positions, of a point there from
    the cubic that heights and slopes at both make [m]."""
    height, slope, _ = np.array([cubic(at, table) for at in positions]).T
    away = np.abs(CubicHermiteSpline(positions, height, slope)(table[0]) - table[1])
    between, most = np.clip(np.searchsorted(positions, table[0]), 1, len(positions) - 1), np.zeros(len(positions))
    np.maximum.at(most, between, away)
    return most[between]


@dataclass(frozen=True)
class Contacts:
    """Points of one side, in order from the flange to the field side; arrays over n points.

    side : "left" or "right"
    position : (n, 3)  of the least gap or deepest penetration (`deepest_point`), in track axes, on the wheel [m];
        normal : (n, 3)  into the wheel
    ahead : (n,)  how far ahead of the wheel's middle plane through the axle, along the wheel's heading [m]
    station : (n,)  on the wheel profile, from its tread datum [m];
    rail_station : (n,)  y on the unmoved rail profile [m]
    angle : (n,)  contact angle, positive where the rail rises towards the field side [rad]
    rolling_radius : (n,)  [m];  gap : (n,)  along the normal, negative where they penetrate [m]
    curvature : (n, 2)  principal relative curvatures, the smaller first [1/m]; tensor : (n, 3)  A_xx, A_xt, A_tt they
        come from
    derailed : the wheel stands on the tip of its flange (the lowest point lies less than FLANGE_TOP above it)

    Where pressure has its mean, which may be millimetres away: LoadedSide.centre_of_pressure of
    rail_fem.contact.load_sharing.
    """

    side: str
    position: np.ndarray
    normal: np.ndarray
    ahead: np.ndarray
    station: np.ndarray
    rail_station: np.ndarray
    angle: np.ndarray
    rolling_radius: np.ndarray
    gap: np.ndarray
    curvature: np.ndarray
    tensor: np.ndarray
    derailed: bool = False

    def __len__(self) -> int:
        return len(self.gap)

    @property
    def from_flange_back(self) -> np.ndarray:
        """(n,)  position on the wheel from its flange back [m]."""
        return FLANGE_BACK + self.station

    @property
    def deepest_point(self) -> np.ndarray:
        """(n, 3)  where the gap is least or the penetration deepest, in track axes [m]."""
        return self.position

    @property
    def vertical_gap(self) -> np.ndarray:
        """(n,)  by how much the wheel may be lowered until it touches there, or is too low [m]."""
        return self.gap / self.normal[:, 2]

    def lowest(self) -> "Contacts":
        """The one point with the least vertical gap: of a wheel in the air the one that touches first when it is
        lowered."""
        return self.where(np.arange(len(self)) == np.argmin(self.vertical_gap))

    def where(self, keep: np.ndarray) -> "Contacts":
        """The points that keep (n,) selects."""
        return replace(
            self, **{f.name: getattr(self, f.name)[keep] for f in fields(self) if f.name not in ("side", "derailed")}
        )


class ContactSearch:
    """Contacts of one wheelset on one track in any position; tables are made once.

    Parameters
    ----------
    wheelset : Wheelset
        Two wheels on an axle.
    track : Track
        Two rails.
    resolution : float
        Spacing of the first search along the wheel profile [m]. Points found are exact whatever it is; what it decides
        is whether two points nearer to each other than this are told apart. Where the wheel's own points lie off a
        cubic over that spacing these are stations too; a rail that is rough all over halves it, down to half its own
        points' spacing. A single dent of a rail, shorter than the spacing, is told apart by a finer one only.

    Examples
    --------
    >>> wheel, rail = geometry.wheel_profile("P8"), geometry.rail_head("56E1", inclination=1 / 20)
    >>> search = geometry.ContactSearch(geometry.Wheelset(wheel), geometry.Track(rail))
    >>> centred = search.settle()
    >>> bool(abs(search.contacts(centred, "left").gap).max() < 1e-6)  # [m]
    True
    """

    def __init__(self, wheelset: Wheelset, track: Track, resolution: float = RESOLUTION):
        check_range("search", (("resolution", resolution, 1e-6, 5e-3),))
        self.wheelset, self.track, self.resolution = wheelset, track, resolution
        self.sides = {side: self._side(side) for side in SIDES}
        self.offsets = {side: track.gauge_offset(side) for side in SIDES}

    def _side(self, side: str) -> Side:
        """A side on its prismatic rail."""
        wheel, rail = wheel_table(self.wheelset, side), np.array(self.track.placed(side).hermite_table())
        spacing, finest = self.resolution, np.median(np.diff(rail[0])) / 2
        while spacing > finest and np.quantile(unresolved(rail, evenly(rail, spacing)), 1 - CORNERS) > ROUGH:
            spacing /= 2
        positions = evenly(wheel, spacing)
        tip = float(wheel[0, np.argmin(wheel[1])])
        own = (unresolved(wheel, positions) > ROUGH) & (wheel[0] > tip)  # between its own points it turns once at most
        positions = np.unique(np.concatenate([positions, wheel[0][own]]))
        stations = np.array([(s, *cubic(s, wheel)) for s in positions]).T.copy()
        return Side(stations, wheel, rail, tip, self.wheelset.radius_of(side))

    def pose(self, state: Wheelset, side: str) -> Pose:
        """Pose of one side with the axle's middle as pivot, for geometry.contact.gap_kernel."""
        return side_pose(
            SIDES[side], state.y, state.yaw, state.roll, 0.0, self.wheelset.datum_arm, self.wheelset.radius_of(side)
        )

    def settle(self, lateral: float = 0.0, yaw: float = 0.0, held_at: str = "rail", roll: float = 0.0) -> Wheelset:
        """The wheelset in its initial position on both rails: both wheels just touch.

        Parameters
        ----------
        lateral : float
            Of its middle, + to the left [m]. Where the track has check rails the shift ends where a flange back meets
            one.
        yaw : float
            [rad]
        held_at : {"rail", "axle"}
            The level at which `lateral` is meant: the wheel's tread, or the axle. The wheelset rolls about that point;
            a wheel that climbs on its flange rolls, and its axle then moves by roll times radius.
        roll : float
            First guess [rad].

        Returns
        -------
        Wheelset
            Shifted far enough, a wheel climbs and stands with its flange on the rail: an answer, of which `derailed`
            speaks.

        Raises
        ------
        WheelsetError
            Where a wheel stands over no rail, or the roll is not found, or the flange backs do not fit.
        """
        self.check_position(lateral, yaw, held_at)
        return self.touching(within_stops(self, lateral, yaw, held_at), yaw, held_at, roll)

    @staticmethod
    def check_position(lateral: float, yaw: float, held_at: str) -> None:
        """Raise WheelsetError for a position that no wheelset on a track has."""
        if held_at not in ("rail", "axle"):
            raise WheelsetError(f'held_at = {held_at!r} is neither "rail" nor "axle"')
        check_range("wheelset", (("lateral", lateral, -0.5, 0.5), ("yaw", yaw, -0.1, 0.1)))

    def touching(self, lateral: float, yaw: float, held_at: str, roll: float = 0.0) -> Wheelset:
        """As `settle`, blind to check rails."""
        lever = self.wheelset.radius if held_at == "rail" else 0.0
        roll, height, left = roll_and_height(*self.sides.values(), lateral, yaw, roll, lever, self.wheelset.datum_arm)
        if left >= NO_RAIL:
            raise WheelsetError(
                f"lateral {lateral:g} m, yaw {yaw:g} rad: a wheel stands over no rail; check gauge, back_to_back and"
                " the sides of the profiles"
            )
        if abs(left) > TOUCH:
            raise WheelsetError(
                f"lateral {lateral:g} m, yaw {yaw:g} rad: no roll brings both wheels down, {left:.3g} m are left at"
                f' roll {roll:g} rad; hold the wheelset at the level of the rail (held_at="rail") or shift it less'
            )
        x, y = self.wheelset.x + lever * np.sin(roll) * np.sin(yaw), lateral - lever * np.sin(roll) * np.cos(yaw)
        return replace(self.wheelset, x=x, y=y, z=height + lever * np.cos(roll), yaw=yaw, roll=roll)

    def contacts(self, state: Wheelset, side: str, reach: float = 0.0) -> Contacts:
        """Points of a side where the vertical gap is least, and all that touch or penetrate.

        Parameters
        ----------
        state : Wheelset
            Where it is.
        side : {"left", "right"}
            Of the track.
        reach : float
            Points whose gap is at most this above the least [m].

        Returns
        -------
        Contacts
            Arrays over the points: position, gap, angle and so on.
        """
        check_side(side)
        pose, of = self.pose(state, side), self.rail_under(state, side)
        ready(of.stations, of.rail, pose)
        found = nearest_positions(of, pose, max(reach, 0.0) - state.z)
        if found.shape[1] == 0:
            raise WheelsetError(f"{side} wheel stands over no rail at y = {state.y:g} m")
        gaps = found[GAP] + state.z
        near = gaps <= max(gaps.min() + max(reach, 1e-12), 0.0)
        return self.described(state, side, found[:, near])

    def described(self, state: Wheelset, side: str, found: np.ndarray) -> Contacts:
        """Contacts at positions (POSITION, n) that geometry.contact.gap_kernel.nearest_positions found."""
        pose, sign, over = self.pose(state, side), SIDES[side], self.rail_under(state, side)
        rows = [contact_row(minimum, over.wheel, over.rail, pose) for minimum in found.T.copy()]
        of = ContactRow(*np.array(rows).reshape(-1, len(ContactRow._fields)).T)
        position = np.column_stack([of.x + state.x, sign * of.y, of.z + state.z])
        size = np.sqrt(1 + of.slope_x**2 + of.slope_y**2)
        normal = np.column_stack([-of.slope_x / size, -sign * of.slope_y / size, 1 / size])
        heading = np.array([np.cos(state.yaw), np.sin(state.yaw), 0.0])
        middle, spread = (of.a_xx + of.a_tt) / 2, np.hypot((of.a_xx - of.a_tt) / 2, of.a_xt)
        ahead = (position - [state.x, state.y, state.z]) @ heading
        stations = found[STATION].copy(), self.rail_station(side, of.y, of.z - of.gap)
        angle, gap = np.arctan(of.slope_y / np.sqrt(1 + of.slope_x**2)), (of.gap + state.z) / size
        bends = np.column_stack([middle - spread, middle + spread]), np.column_stack([of.a_xx, of.a_xt, of.a_tt])
        on_tip = len(of.z) and of.z[np.argmin(of.gap)] + state.z - self.flange_tip(state, side) < FLANGE_TOP
        return Contacts(side, position, normal, ahead, *stations, angle, of.radius, gap, *bends, bool(on_tip))

    def flange_tip(self, state: Wheelset, side: str) -> float:
        """Height of the lowest point of the flange in track axes [m]."""
        of = self.sides[side]
        return (
            state.z
            + (self.wheelset.datum_arm + of.tip) * np.sin(SIDES[side] * state.roll)
            - (of.radius - of.wheel[1].min()) * np.cos(state.roll)
        )

    def derailed(self, state: Wheelset) -> tuple[str, ...]:
        """The sides whose wheel stands, or would when lowered, on the tip of its flange: on top of the rail, or on what
        lies in the flangeway."""
        return tuple(side for side in SIDES if self.contacts(state, side).derailed)

    def rail_under(self, state: Wheelset, side: str) -> Side:
        """A side for a state: prismatic rails are the same everywhere."""
        return self.sides[side]

    def rail_station(self, side: str, y: np.ndarray, z: np.ndarray) -> np.ndarray:
        """y (n,) [m] on the unmoved rail profile of points y, z (n,) in side axes."""
        offset, sign = getattr(self.track, f"{side}_position"), SIDES[side]
        return np.cos(offset.roll) * (y - self.offsets[side] - sign * offset.lateral) + sign * np.sin(offset.roll) * (
            z - offset.vertical
        )


@dataclass(frozen=True)
class Motion:
    """Velocities of a wheelset: forward speed [m/s], lateral and vertical [m/s] (vertical (n,): one for each point),
    yaw, roll and spin rates [rad/s]; spin None: rolls freely on its tread datum."""

    speed: float
    lateral: float = 0.0
    vertical: float | np.ndarray = 0.0
    yaw: float = 0.0
    roll: float = 0.0
    spin: float | None = None


def creepages(state: Wheelset, contacts: Contacts, motion: Motion) -> np.ndarray:
    """(n, 3) creepages at the contacts, as `creepages_at`."""
    return creepages_at(state, contacts.position, contacts.normal, motion)


def creepages_at(state: Wheelset, position: np.ndarray, normal: np.ndarray, motion: Motion) -> np.ndarray:
    """(n, 3)  longitudinal, lateral [1] and spin creepage [1/m] at points (n, 3) [m] with normals (n, 3) into the
    wheel: the wheel's velocity relative to the rail per speed.

    Directions: along the rail and across it to the left, in the tangent plane, about the normal into the wheel
    (bem.patch has the same). Exact for rigid bodies. Raises WheelsetError for a speed of zero.
    """
    if not (np.isfinite(motion.speed) and motion.speed != 0):
        raise WheelsetError(f"motion: speed = {motion.speed!r} m/s, creepage needs a finite speed other than zero")
    forward = np.array([np.cos(state.yaw), np.sin(state.yaw), 0.0])
    left = np.array([-np.sin(state.yaw), np.cos(state.yaw), 0.0])
    axle = np.cos(state.roll) * left + np.sin(state.roll) * np.array([0.0, 0.0, 1.0])
    spin = motion.speed / state.radius if motion.spin is None else motion.spin
    turning = spin * axle + motion.yaw * np.array([0.0, 0.0, 1.0]) + motion.roll * forward
    travel = np.stack(np.broadcast_arrays(motion.speed, motion.lateral, motion.vertical), axis=-1)
    velocity = travel + np.cross(turning, position - [state.x, state.y, state.z])
    x, _, z = normal.T
    along = np.column_stack([z, 0 * z, -x]) / np.hypot(x, z)[:, None]
    across = np.cross(normal, along)
    return np.column_stack([(velocity * along).sum(axis=1), (velocity * across).sum(axis=1), normal @ turning]) / abs(
        motion.speed
    )
