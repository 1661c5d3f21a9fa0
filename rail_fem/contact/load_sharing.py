"""A wheelset that stands under its loads: where it rests, all points that carry and what each carries. Axes:
geometry.wheelset."""

from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import brentq

from geometry.contact.flange_back import within_stops
from geometry.contact.gap_kernel import NO_RAIL, least_gap, ready, side_pose
from geometry.contact.prismatic_search import Contacts, ContactSearch
from geometry.wheelset import SIDES, Wheelset, WheelsetError, check_range, check_side
from rail_fem.contact.load_kernel import SideLoad, carried_by, loaded_side, settle_loaded

STEEL_MODULUS = 210e9 / (2 * (1 - 0.3**2))  # E* of steel on steel [Pa]
DEEPEST = 1e-3  # penetration along the normal beyond which no elastic contact is meant [m]
MISSED = 1e-6  # relative, of a vertical load that counts as met
JUMP = 0.05  # of a load: where a force jumps past it by more there is no equilibrium
CUT = 0.05  # of the penetration: more of it where a profile ends is said
LEFT_OVER = 1e-6  # of the depth: more of it is said
MOST_TURN = np.radians(
    30
)  # of the normal over one position: cos is 0.87, and a half-space no longer what the bodies are
LARGEST_LATERAL = 15e-3


@dataclass(frozen=True)
class LoadedSide:
    """What carries on one side; arrays over its n positions, in the order of contacts.

    contacts : at the points of deepest penetration;  normal_force (n,) [N];
    force (n, 3) on the wheel in track axes [N]
    centre_of_pressure (n, 3) : mean of the position by pressure, in track axes [m];
    pressure_station (n,) : the same on the wheel profile [m]
    patch (n, 2) : semi-axes along the rail and across it of the ellipse with the same second moments of pressure as the
    patch [m]: Hertz' ellipse where
        there is one, and about the half width of patches that are none
    warnings : what makes the answer uncertain

    Two positions that merge are told apart at the saddle of the gap between them, where pressure may run through: there
    the sum is sure, the shares are a matter of that border. A position that the others have pressed away carries
    nothing; its patch is 0 and its centre the deepest point.
    """

    contacts: Contacts
    normal_force: np.ndarray
    force: np.ndarray
    centre_of_pressure: np.ndarray
    pressure_station: np.ndarray
    patch: np.ndarray
    warnings: tuple[str, ...] = ()

    @property
    def deepest_point(self) -> np.ndarray:
        """(n, 3)  where they penetrate most, in track axes [m]."""
        return self.contacts.position


@dataclass(frozen=True)
class LoadedWheelset:
    """state : where it rests;  left, right : what carries;  imbalance : of the vertical loads, relative."""

    state: Wheelset
    left: LoadedSide
    right: LoadedSide
    imbalance: float

    @property
    def lateral_force(self) -> float:
        """Sum of the normal contacts' forces across the track, + to the left [N]."""
        return float(self.left.force[:, 1].sum() + self.right.force[:, 1].sum())


def static_equilibrium(
    search: ContactSearch,
    loads: tuple[float, float],
    lateral: float = 0.0,
    yaw: float = 0.0,
    held_at: str = "rail",
    modulus: float = STEEL_MODULUS,
    thorough: bool = True,
) -> LoadedWheelset:
    """Where the wheelset rests, with its middle held at `lateral` [m], when each side carries its load (left, right)
    [N], at right angles to the track plane.

    held_at, check rails : as in ContactSearch.settle;  modulus : E* of wheel and rail [Pa]
    thorough : where the quick search does not meet the loads, look on by bounds, a hundred times more expensive
    A load of 0 lets that wheel just touch. Forces are normal ones; friction carries nothing.
    Error: vertical loads are met to 1e-6, mostly 1e-7; forces against Hertz and the half-space:
    tests/rail_fem/test_load_sharing.py, test_load_merge.py. Where a force jumps past its load by up to 5 %, as on
    profiles that end or are rough within the contact, the nearest state is returned, with its imbalance and a warning.
    Raises WheelsetError for larger jumps, and for loads that are negative, not finite or so large that bodies would
    penetrate by more than 1 mm along the normal.
    """
    search.check_position(lateral, yaw, held_at)
    _check(loads, modulus)
    lateral = within_stops(search, lateral, yaw, held_at)
    lever = search.wheelset.radius if held_at == "rail" else 0.0
    settled = settle_loaded(
        *search.sides.values(), lateral, yaw, lever, search.wheelset.datum_arm, np.array(loads, float), modulus
    )
    roll, height, worst, *_ = settled
    if worst >= NO_RAIL:
        raise WheelsetError(
            f"lateral {lateral:g} m, yaw {yaw:g} rad: a wheel stands over no rail; check gauge and back_to_back"
        )
    if not worst <= MISSED and thorough:
        bounded = _between_bounds(search, loads, lateral, yaw, lever, roll, modulus)
        roll, height, worst = min((roll, height, worst), bounded, key=lambda state: state[2])
    if not worst <= (JUMP if thorough else MISSED):
        held = 'hold the wheelset at its axle (held_at="axle"), ' if held_at == "rail" else ""
        raise WheelsetError(
            f"loads {loads[0]:g} and {loads[1]:g} N at lateral {lateral:g} m, yaw {yaw:g} rad: no equilibrium. A"
            f" wheel's force jumps past its load at roll {roll:.9g} rad, by {worst:.2g} of it or more; {held}smooth"
            " profiles that are rough on the scale of the patch, search finer, or give more of profiles that end in"
            " the contact"
        )
    x, y = search.wheelset.x + lever * np.sin(roll) * np.sin(yaw), lateral - lever * np.sin(roll) * np.cos(yaw)
    state = replace(search.wheelset, x=x, y=y, z=height + lever * np.cos(roll), yaw=yaw, roll=roll)
    found = [settled.left, settled.right]
    if roll != settled.roll or height != settled.height:
        found = [_loads_of(search, side, (lateral, yaw, roll, lever, height), modulus) for side in SIDES]
    pivot = search.wheelset.x, height
    left, right = (_described(search, state, side, loaded, pivot) for side, loaded in zip(SIDES, found))
    if worst > MISSED:
        said = (
            f"vertical loads are met to {worst:.1g} only: between two neighbouring states a force jumps past its load"
        )
        left, right = (replace(side, warnings=(*side.warnings, said)) for side in (left, right))
    return LoadedWheelset(state, left, right, float(worst))


def _between_bounds(
    search: ContactSearch,
    loads: tuple[float, float],
    lateral: float,
    yaw: float,
    lever: float,
    roll: float,
    modulus: float,
) -> tuple[float, float, float]:
    """Roll, height of the pivot and worst relative imbalance, by bounds that close: for every roll the height at which
    the left wheel carries its load, and the roll at which the right one then does. A hundred times more expensive than
    load_kernel.settle_loaded, and never led astray."""
    arm, sides = search.wheelset.datum_arm, search.sides
    carried = lambda side, roll, height: carried_by(
        sides[side], SIDES[side], lateral, yaw, roll, lever, arm, height, modulus
    )

    def excess(roll: float) -> tuple[float, float]:
        height = height_under("left", roll, loads[0])
        if loads[1] == 0:  # then the right wheel just touches
            return height, -least_gap(sides["right"], -1.0, lateral, yaw, roll, lever, arm)[0] - height
        return height, carried("right", roll, height) / loads[1] - 1

    def height_under(side: str, roll: float, load: float) -> float:
        in_contact = -least_gap(sides[side], SIDES[side], lateral, yaw, roll, lever, arm)[0]
        if load == 0:
            return in_contact
        short = lambda height: carried(side, roll, height) / load - 1
        deep = lift = (load / (0.7 * modulus)) ** (2 / 3)
        while short(in_contact - deep) < 0:
            deep *= 2
        while short(in_contact - deep + lift) > 0:  # a rough wheel touches beside its least gap, too
            lift *= 2
        return brentq(short, in_contact - deep, in_contact - deep + lift, xtol=1e-17, rtol=1e-15)

    low, high, reach = roll, roll, 1e-4
    while excess(low)[1] > 0 and reach < 0.2:
        low, reach = roll - reach, 2 * reach
    reach = 1e-4
    while excess(high)[1] < 0 and reach < 0.2:
        high, reach = roll + reach, 2 * reach
    if not excess(low)[1] <= 0 <= excess(high)[1]:
        return roll, excess(roll)[0], np.inf
    roll = brentq(lambda roll: excess(roll)[1], low, high, xtol=1e-17, rtol=1e-15)
    height, left_over = excess(roll)
    before = abs(carried("left", roll, height) / loads[0] - 1) if loads[0] > 0 else 0.0
    return roll, height, max(before, abs(left_over))


def equilibrium_under(
    search: ContactSearch,
    loads: tuple[float, float],
    lateral_load: float = 0.0,
    yaw: float = 0.0,
    modulus: float = STEEL_MODULUS,
) -> LoadedWheelset:
    """Where the wheelset rests when it is free to shift and a lateral load [N], + to the left, acts on it: 1e-6 of the
    vertical loads.

    loads : weight over each side [N], along the vertical. On canted track its part along the track plane pulls towards
        the lower rail; what a
    vehicle's height moves from side to side is the caller's.
    Without friction, so that the inclined contacts alone hold it. Raises WheelsetError where they cannot hold the load
    within 15 mm.
    """
    total, cant = sum(loads), search.track.cant
    check_range("equilibrium_under", (("lateral_load", lateral_load, -10 * total, 10 * total),))
    onto = tuple(load * np.cos(cant) for load in loads)
    along = lateral_load - total * np.sin(cant)
    left_over = lambda y: (static_equilibrium(search, onto, y, yaw, modulus=modulus).lateral_force + along) / total
    low, high = -LARGEST_LATERAL, LARGEST_LATERAL
    if not left_over(low) > 0 > left_over(high):
        canted = f" and cant {cant:g} rad" if cant else ""
        raise WheelsetError(
            f"lateral load {lateral_load:g} N{canted} is not held within +-{LARGEST_LATERAL:g} m: it climbs the rail;"
            " lessen it"
        )
    return static_equilibrium(search, onto, brentq(left_over, low, high, xtol=1e-14, rtol=1e-13), yaw, modulus=modulus)


def wheel_equilibrium(
    search: ContactSearch, side: str, load: float, state: Wheelset | None = None, modulus: float = STEEL_MODULUS
) -> tuple[Wheelset, LoadedSide]:
    """One wheel under a vertical load [N] on it, the axle's position, yaw and roll held: how high the axle then is, and
    what the wheel carries.

    state : position, yaw and roll; its height does not count; None: the search's wheelset. The other wheel is left out.

        state, found = wheel_equilibrium(ContactSearch(Wheelset(wheel), Track(rail)), "left", 100e3)

    Error: the load is met to 1e-9. Raises WheelsetError for a load that is not positive or would need a penetration of
    more than 1 mm.
    """
    check_side(side)
    most = _largest_load(modulus)
    check_range("wheel_equilibrium", (("load [N]", load, most * 1e-12, most), ("modulus", modulus, 1e6, 1e13)))
    state = search.wheelset if state is None else state
    in_contact = replace(state, z=state.z - float(search.contacts(state, side).vertical_gap.min()))
    low, high = 0.0, (load / (0.7 * modulus)) ** (2 / 3)
    excess = lambda depth: (
        side_held(search, replace(in_contact, z=in_contact.z - depth), side, modulus).force[:, 2].sum() / load - 1
    )
    while excess(high) < 0:  # ends: beyond DEEPEST `side_held` refuses
        low, high = high, 2 * high
    equilibrium = replace(in_contact, z=in_contact.z - brentq(excess, low, high, xtol=1e-18, rtol=1e-10))
    return equilibrium, side_held(search, equilibrium, side, modulus)


def side_held(search: ContactSearch, state: Wheelset, side: str, modulus: float = STEEL_MODULUS) -> LoadedSide:
    """What a side carries with the wheelset held where it is, wherever that is; no points where it penetrates nowhere.

    Continuous in the state: tests/rail_fem/test_load_merge.py on prismatic rails, test_load_continuity.py on others.
    Raises WheelsetError where it penetrates by more than 1 mm along the normal.
    """
    check_side(side)
    pose, of = search.pose(state, side), search.rail_under(state, side)
    ready(of.stations, of.rail, pose)
    loaded = loaded_side(of, pose, state.z, modulus)
    return _described(search, state, side, loaded, (state.x, state.z))


def _loads_of(search: ContactSearch, side: str, pivot: tuple, modulus: float) -> SideLoad:
    """What a side carries, found with the pivot that was settled with: another one rounds otherwise, and rough profiles
    feel that."""
    of, (lateral, yaw, roll, lever, height) = search.sides[side], pivot
    pose = side_pose(SIDES[side], lateral, yaw, roll, lever, search.wheelset.datum_arm, of.radius)
    return loaded_side(of, pose, height, modulus)


def _described(
    search: ContactSearch, state: Wheelset, side: str, loaded: SideLoad, pivot: tuple[float, float]
) -> LoadedSide:
    """What load_kernel.loaded_side found, in track axes; pivot : its x and z [m]."""
    found, carried, left_over, _ = loaded
    contacts = search.described(state, side, found)
    if len(contacts) and -contacts.gap.min() > DEEPEST:
        raise WheelsetError(
            f"{side} wheel penetrates its rail by {-contacts.gap.min():.3g} m along the normal: no elastic contact is"
            f" meant beyond {DEEPEST:g} m; lift it or lessen the load"
        )
    force, bears = carried[0], carried[0] > 0
    x, y, z, station, xx, across = carried[4:10] / np.where(bears, force, 1.0)
    centre = np.where(bears[:, None], np.column_stack([x + pivot[0], SIDES[side] * y, z + pivot[1]]), contacts.position)
    # of a semi-ellipsoid the mean square is a fifth
    patch = np.sqrt(5 * np.maximum(np.where(bears, [xx - x * x, across - y * y - z * z], 0.0), 0.0)).T
    vector = np.column_stack([carried[3], SIDES[side] * carried[1], carried[2]])
    station, said = np.where(bears, station, contacts.station), _warnings(contacts, carried, left_over)
    return LoadedSide(contacts, force, vector, centre, station, patch, said)


def _warnings(contacts: Contacts, carried: np.ndarray, left_over: float) -> tuple[str, ...]:
    """Where the forces are not the half-space's, the half-space not what the bodies are, or the wheel not on its
    rail."""
    side, warnings = contacts.side, []
    if contacts.derailed:
        warnings.append(f"{side}: derailed, the wheel stands on the tip of its flange")
    if left_over > LEFT_OVER:
        warnings.append(f"{side}: the pressure is not converged, {left_over:.1g} of the depth is left")
    if (carried[12] > CUT * -contacts.gap)[carried[0] > 0].any():
        warnings.append(
            f"{side}: a profile ends within the contact, {carried[12].max():.2g} m under the other body's surface; give"
            " more of it"
        )
    turn = (carried[10] - carried[11]).max(initial=0.0)
    if turn > MOST_TURN:
        warnings.append(
            f"{side}: the contact angle changes by {np.degrees(turn):.0f} degrees over one patch, which is no"
            " half-space any more"
        )
    return tuple(warnings)


def _largest_load(modulus: float) -> float:
    """Of a point contact of 0.3 m radius that penetrates by DEEPEST [N]."""
    return 0.7 * modulus * 0.3**0.5 * DEEPEST**1.5


def _check(loads: tuple[float, float], modulus: float) -> None:
    limits = [(f"load {side} [N]", load, 0.0, _largest_load(modulus)) for side, load in zip(SIDES, loads)]
    check_range("static equilibrium", (*limits, ("modulus", modulus, 1e6, 1e13)))
