"""A wheelset that stands under its loads: where it rests, all points that carry and what each carries. Axes: geometry.wheelset."""

from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import brentq

from geometry.contact.gap_kernel import NO_RAIL, ready, side_pose
from geometry.contact.prismatic_search import Contacts, ContactSearch
from geometry.contact.flange_back import within_stops
from geometry.wheelset import SIDES, Wheelset, WheelsetError, check_range
from rail_fem.light.load_kernel import CLOSE, loaded_side, settle_loaded

STEEL_MODULUS = 210e9 / (2 * (1 - 0.3**2))  # E* of steel on steel [Pa]
DEEPEST = 1e-3  # penetration along the normal beyond which no elastic contact is meant [m]
LEFT_OVER = 1e-6  # of the depth: more of it is said
MOST_TURN = np.radians(30)  # of the normal over one place: cos is 0.87, and a half-space no longer what the bodies are
LARGEST_LATERAL = 15e-3


@dataclass(frozen=True)
class LoadedSide:
    """What carries on one side; arrays over its n places, in the order of contacts.

    contacts : at the points of deepest penetration;  normal_force (n,) [N];  force (n, 3) on the wheel in track axes [N]
    centre_of_pressure (n, 3) : mean of the place by pressure, in track axes [m];  pressure_station (n,) : the same on the wheel profile [m]
    patch (n, 2) : semi-axes along the rail and across it of the ellipse with the same second moments of pressure as the patch [m]: Hertz' ellipse where
        there is one, and about the half width of patches that are none
    warnings : what is doubtful

    Two places that merge are told apart at the saddle of the gap between them, where pressure may run through: there the sum is sure, the shares are
    a matter of that border. A place that the others have pressed away carries nothing; its patch is 0 and its centre the deepest point.
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


def rest(search: ContactSearch, loads: tuple[float, float], lateral: float = 0.0, yaw: float = 0.0, held_at: str = "rail",
         modulus: float = STEEL_MODULUS) -> LoadedWheelset:
    """Where the wheelset rests, with its middle held at `lateral` [m], when each side carries its load (left, right) [N], at right
    angles to the track plane.

    held_at, check rails : as in ContactSearch.settle;  modulus : E* of wheel and rail [Pa]
    A load of 0 lets that wheel just touch. Forces are normal ones; friction carries nothing.
    Error: vertical loads are met to 1e-6, mostly 1e-7; forces against Hertz and the half-space: tests/rail_fem/test_load_sharing.py, test_load_merge.py.
    Raises WheelsetError for loads that are negative, not finite or so large that bodies would penetrate by more than 1 mm along the normal.
    """
    search.check_place(lateral, yaw, held_at)
    _check(loads, modulus)
    lateral = within_stops(search, lateral, yaw, held_at)
    lever = search.wheelset.radius if held_at == "rail" else 0.0
    roll, height, worst, rounds = settle_loaded(*search.sides.values(), lateral, yaw, lever, search.wheelset.datum_arm, np.array(loads, float), modulus)
    if worst >= NO_RAIL:
        raise WheelsetError(f"lateral {lateral:g} m, yaw {yaw:g} rad: a wheel stands over no rail; check gauge and back_to_back")
    if not worst <= 100 * CLOSE:
        raise WheelsetError(f"loads {loads[0]:g} and {loads[1]:g} N at lateral {lateral:g} m: no equilibrium after {rounds} rounds, {worst:.2g} of a load is left; "
                            'hold the wheelset at the level of the rail (held_at="rail"); smooth profiles that are rough on the scale of the patch, or search finer')
    x, y = search.wheelset.x + lever * np.sin(roll) * np.sin(yaw), lateral - lever * np.sin(roll) * np.cos(yaw)
    state = replace(search.wheelset, x=x, y=y, z=height + lever * np.cos(roll), yaw=yaw, roll=roll)
    pivot = lateral, yaw, roll, lever, height
    left, right = (_side(search, state, side, pivot, modulus) for side in SIDES)
    return LoadedWheelset(state, left, right, float(worst))


def rest_under(search: ContactSearch, loads: tuple[float, float], lateral_load: float = 0.0, yaw: float = 0.0, modulus: float = STEEL_MODULUS) -> LoadedWheelset:
    """Where the wheelset rests when it is free to shift and a lateral load [N], + to the left, acts on it: 1e-6 of the vertical loads.

    loads : weight over each side [N], along the vertical. On canted track its part along the track plane pulls towards the lower rail; what a
    vehicle's height moves from side to side is the caller's.
    Without friction, so that the inclined contacts alone hold it. Raises WheelsetError where they cannot hold the load within 15 mm.
    """
    total, cant = sum(loads), search.track.cant
    check_range("rest_under", (("lateral_load", lateral_load, -10 * total, 10 * total),))
    onto = tuple(load * np.cos(cant) for load in loads)
    along = lateral_load - total * np.sin(cant)
    left_over = lambda y: (rest(search, onto, y, yaw, modulus=modulus).lateral_force + along) / total
    low, high = -LARGEST_LATERAL, LARGEST_LATERAL
    if not left_over(low) > 0 > left_over(high):
        canted = f" and cant {cant:g} rad" if cant else ""
        raise WheelsetError(f"lateral load {lateral_load:g} N{canted} is not held within +-{LARGEST_LATERAL:g} m: it climbs the rail; lessen it")
    return rest(search, onto, brentq(left_over, low, high, xtol=1e-14, rtol=1e-13), yaw, modulus=modulus)


def pressed(search: ContactSearch, state: Wheelset, side: str, modulus: float = STEEL_MODULUS) -> LoadedSide:
    """What a side carries with the wheelset held where it is, wherever that is; no points where it penetrates nowhere.

    Continuous in the state: tests/rail_fem/test_load_merge.py on prismatic rails, test_load_continuity.py on others. Raises WheelsetError where it
    penetrates by more than 1 mm along the normal.
    """
    pose, (stations, wheel, rail, tip, _) = search.pose(state, side), search.rail_under(state, side)
    ready(stations, rail, pose)
    return _described(search, state, side, loaded_side(stations, wheel, rail, tip, pose, state.z, modulus), (state.x, state.z))


def _side(search: ContactSearch, state: Wheelset, side: str, pivot: tuple, modulus: float) -> LoadedSide:
    """What a side carries, found with the pivot that was settled with: another one rounds otherwise, and rough profiles feel that."""
    (stations, wheel, rail, tip, radius), sign = search.sides[side], SIDES[side]
    lateral, yaw, roll, lever, height = pivot
    pose = side_pose(sign, lateral, yaw, roll, lever, search.wheelset.datum_arm, radius)
    return _described(search, state, side, loaded_side(stations, wheel, rail, tip, pose, height, modulus), (search.wheelset.x, height))


def _described(search: ContactSearch, state: Wheelset, side: str, loaded: tuple, pivot: tuple[float, float]) -> LoadedSide:
    """What load_kernel.loaded_side found, in track axes; pivot : its x and z [m]."""
    found, carried, left_over = loaded
    contacts = search.described(state, side, found)
    if len(contacts) and -contacts.gap.min() > DEEPEST:
        raise WheelsetError(f"{side} wheel penetrates its rail by {-contacts.gap.min():.3g} m along the normal: no elastic contact is meant beyond "
                            f"{DEEPEST:g} m; lift it or lessen the load")
    force, bears = carried[0], carried[0] > 0
    x, y, z, station, xx, across = carried[4:10] / np.where(bears, force, 1.0)
    centre = np.where(bears[:, None], np.column_stack([x + pivot[0], SIDES[side] * y, z + pivot[1]]), contacts.position)
    patch = np.sqrt(5 * np.maximum(np.where(bears, [xx - x * x, across - y * y - z * z], 0.0), 0.0)).T  # of a semi-ellipsoid the mean square is a fifth
    vector = np.column_stack([carried[3], SIDES[side] * carried[1], carried[2]])
    return LoadedSide(contacts, force, vector, centre, np.where(bears, station, contacts.station), patch, _doubts(side, carried, left_over))


def _doubts(side: str, carried: np.ndarray, left_over: float) -> tuple[str, ...]:
    """Where the forces are not the half-space's, or the half-space not what the bodies are."""
    doubts = []
    if left_over > LEFT_OVER:
        doubts.append(f"{side}: the pressure is not converged, {left_over:.1g} of the depth is left")
    turn = (carried[10] - carried[11]).max(initial=0.0)
    if turn > MOST_TURN:
        doubts.append(f"{side}: the contact angle changes by {np.degrees(turn):.0f} degrees over one patch, which is no half-space any more")
    return tuple(doubts)


def _check(loads: tuple[float, float], modulus: float) -> None:
    most = 0.7 * modulus * 0.3**0.5 * DEEPEST**1.5  # a point contact of 0.3 m radius that penetrates by DEEPEST
    limits = [(f"load {side} [N]", load, 0.0, most) for side, load in zip(SIDES, loads)]
    check_range("rest", (*limits, ("modulus", modulus, 1e6, 1e13)))
