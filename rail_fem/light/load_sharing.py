"""A wheelset that stands under its loads: where it rests, all points that carry and what each carries. Axes: geometry.wheelset."""

import functools
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import brentq

from geometry.contact.gap_kernel import NO_RAIL, ready, side_pose
from geometry.contact.prismatic_search import Contacts, ContactSearch
from geometry.contact.flange_back import within_stops
from geometry.wheelset import SIDES, Wheelset, WheelsetError, check_range
from rail_fem.light.contact_table import hertz_constants, patch_sizes
from rail_fem.light.load_kernel import CLOSE, loaded_side, settle_loaded

STEEL_MODULUS = 210e9 / (2 * (1 - 0.3**2))  # E* of steel on steel [Pa]
SPAN = np.log(1e5)
DEEPEST = 1e-3  # penetration beyond which no elastic contact is meant [m]
LARGEST_LATERAL = 15e-3


@dataclass(frozen=True)
class LoadedSide:
    """Points of one side that carry: contacts; normal_force (n,) [N]; force (n, 3) on the wheel in track axes [N];
    patch (n, 2) semi-axes along and across of Hertz' ellipse with the curvatures at the point [m]."""

    contacts: Contacts
    normal_force: np.ndarray
    force: np.ndarray
    patch: np.ndarray


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


@functools.lru_cache(maxsize=1)
def unit_constants(count: int = 2001) -> np.ndarray:
    """(count,)  Hertz' K for E* = 1 and mean radius 1 over the logarithm of the radii's ratio, 0 to SPAN."""
    ratio = np.linspace(0, SPAN, count)
    return hertz_constants(np.column_stack([np.exp(ratio / 2), np.exp(-ratio / 2)]), 1.0)


def rest(search: ContactSearch, loads: tuple[float, float], lateral: float = 0.0, yaw: float = 0.0, held_at: str = "rail",
         modulus: float = STEEL_MODULUS) -> LoadedWheelset:
    """Where the wheelset rests, with its middle held at `lateral` [m], when each side carries its load (left, right) [N], at right
    angles to the track plane.

    held_at, check rails : as in ContactSearch.settle;  modulus : E* of wheel and rail [Pa]
    A load of 0 lets that wheel just touch. Forces are normal ones; friction carries nothing.
    Error: vertical loads are met to 1e-8; against Hertz where one point carries see tests/rail_fem/test_load_sharing.py.
    Raises WheelsetError for loads that are negative, not finite or so large that bodies would penetrate by more than 1 mm.
    """
    search.check_place(lateral, yaw, held_at)
    _check(loads, modulus)
    lateral = within_stops(search, lateral, yaw, held_at)
    lever = search.wheelset.radius if held_at == "rail" else 0.0
    roll, height, worst, rounds = settle_loaded(*search.sides.values(), lateral, yaw, lever, search.wheelset.datum_arm, np.array(loads, float), modulus,
                                                unit_constants(), SPAN)
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

    Continuous in the state but for jumps of up to 3 % at edges that run aslant: tests/rail_fem/test_load_continuity.py. Raises WheelsetError where it penetrates by more than 1 mm.
    """
    pose, (stations, wheel, rail, tip, _) = search.pose(state, side), search.rail_under(state, side)
    ready(stations, rail, pose)
    found, force = loaded_side(stations, wheel, rail, tip, pose, state.z, modulus, unit_constants(), SPAN)
    if found.shape[1] and -(found[1] + state.z).min() > DEEPEST:
        raise WheelsetError(f"{side} wheel penetrates its rail by {-(found[1] + state.z).min():.3g} m: no elastic contact is meant beyond {DEEPEST:g} m; lift it")
    return _described(search, state, side, found, force, modulus)


def _side(search: ContactSearch, state: Wheelset, side: str, pivot: tuple, modulus: float) -> LoadedSide:
    """What a side carries, found with the pivot that was settled with: another one rounds otherwise, and rough profiles feel that."""
    (stations, wheel, rail, tip, radius), sign = search.sides[side], SIDES[side]
    lateral, yaw, roll, lever, height = pivot
    pose = side_pose(sign, lateral, yaw, roll, lever, search.wheelset.datum_arm, radius)
    found, force = loaded_side(stations, wheel, rail, tip, pose, height, modulus, unit_constants(), SPAN)
    return _described(search, state, side, found, force, modulus)


def _described(search: ContactSearch, state: Wheelset, side: str, found: np.ndarray, force: np.ndarray, modulus: float) -> LoadedSide:
    contacts = search.described(state, side, found)
    vector = np.column_stack([force[3], SIDES[side] * force[1], force[2]])
    radii = 1 / np.maximum(contacts.tensor[:, [0, 2]], 1e-4)
    return LoadedSide(contacts, force[0], vector, patch_sizes(force[0], radii, modulus))


def _check(loads: tuple[float, float], modulus: float) -> None:
    most = 0.7 * modulus * 0.3**0.5 * DEEPEST**1.5  # a point contact of 0.3 m radius that penetrates by DEEPEST
    limits = [(f"load {side} [N]", load, 0.0, most) for side, load in zip(SIDES, loads)]
    check_range("rest", (*limits, ("modulus", modulus, 1e6, 1e13)))
