"""Wheels at all ages between two turnings, for a life study: how they look when they are turned is given, or comes of
straight line by the law of the study.

What a wheel loses over one crossing is nothing beside its way between two passes: its wear is that of its line, of
curves and brakes. At constant wear a mile, wheels that come past at any moment are
of all depths between new and turned, each as frequent (renewal: Cox, Renewal Theory (1962), chapter 5, recalled), and
the crossing sees the same mixture at all times, however many miles lie between two turnings.

On straight line the wheelset rolls freely at lateral positions of a normal law, as they follow one another there, over
new 56E1 rails at 1:20; those at which a flange would carry are cut off. A point of the profile loses what
the patches of one turn take there, by each position's share. The shape goes on by steps of its deepest wear until it is
one at which wheels are turned. Curves, brakes and rails that wear are not in it: a flange keeps its thickness, and the
way is that of the law and its factor.
"""

import hashlib
import itertools
from dataclasses import replace
from functools import cache
from typing import NamedTuple

import numpy as np
from scipy.ndimage import gaussian_filter1d

from geometry.contact.prismatic_search import ContactSearch
from geometry.profiles.profile import Profile
from geometry.wheelset import Track, Wheelset
from rail_fem.damage.deposit import add_across
from rail_fem.damage.rolling import Rolling, equilibrium_near, roll
from rail_fem.damage.wear import WearLaw
from rail_fem.damage.wheel_wear import circumference, wheel_lines
from rail_fem.scene.scene import Scene, Wheel
from rail_fem.scene.wheel_profile import MeasuredWheel
from rail_fem.settings.damage import LineWear

STEP = 25e-6  # deepest wear between two shapes [m]
POSITIONS, REACH = 33, 3.0  # lateral positions, evenly over so many deviations to each side
FLANGE = np.radians(35)  # angle of a contact from which on a flange carries: straight line does not come there
SPREAD = 0.5e-3  # standard deviation by which wear is spread over the profile [m]
LINES, CELLS = 0.25e-3, 24  # between the profile's points that wear [m]; cells of a patch, each way
TREAD = -30e-3  # from where to the field side the tread lies [m]
DEEPEST = 10e-3  # wear at which no limit has been met [m]


class LineWorn(NamedTuple):
    """A wheel's way between two turnings. distance (k,) [m] and lost (k, n) [m], what its profile has lost by then at
    y (n,) [m];  limit : why it is turned at the end"""

    distance: np.ndarray
    lost: np.ndarray
    y: np.ndarray
    limit: str

    def after(self, share: float) -> np.ndarray:
        """(n,) lost after a share of the way [m]."""
        at = share * self.distance[-1]
        k = int(np.clip(np.searchsorted(self.distance, at), 1, len(self.distance) - 1))
        part = (at - self.distance[k - 1]) / (self.distance[k] - self.distance[k - 1])
        return (1 - part) * self.lost[k - 1] + part * self.lost[k]


def lowered(new: Profile, y: np.ndarray, lost: np.ndarray) -> Profile:
    """A wheel's profile that has lost heights (n,) at y (n,) [m]."""
    moved = new.points + np.column_stack([np.zeros(len(new.points)), np.interp(new.points[:, 0], y, lost)])
    return Profile.from_points(moved, new.label)


def hollow(wheel: Profile) -> float:
    """Depth of the tread below what lies farther to its field side [m], the largest anywhere."""
    y, z = wheel.points[wheel.points[:, 0] >= TREAD].T
    return float((np.maximum.accumulate(z) - z).max())


def flange_height(wheel: Profile) -> float:
    """Of the flange's tip from the tread at its datum [m]: Sh of EN 15313, recalled."""
    return float(wheel.height(np.zeros(1))[0] - wheel.points[:, 1].min())


def beyond(wheel: Profile, line: LineWear) -> tuple[float, str]:
    """By how much a wheel is beyond its limits [m], negative within them, and the one that says so."""
    measures = {"hollow": (hollow(wheel), line.hollow), "flange height": (flange_height(wheel), line.flange_height)}
    return max((value - most, f"{name} {1e3 * most:.3g} mm") for name, (value, most) in measures.items())


def lost_in_a_turn(wheel: Profile, scene: Scene, law: WearLaw, line: LineWear, y: np.ndarray) -> np.ndarray:
    """(n,) mean depth [m] that a turn of the wheel takes off its profile at y (n,) [m]."""
    search = ContactSearch(Wheelset(wheel, radius=scene.wheel.radius), Track.plain_line(gauge=scene.gauge))
    away, out, total = np.linspace(-REACH, REACH, POSITIONS), np.zeros((1, 1, len(y))), 0.0
    load, only = scene.static_wheel_load, np.zeros(1, int)
    rolling = Rolling(scene.speed, scene.friction, cells=CELLS)
    turns = [
        roll(search, equilibrium_near(search, (load, load), float(shift), 0.0), rolling)
        for shift in away * line.deviation
    ]
    flange = np.array([max(abs(point.angle) for point in points) > FLANGE for points in turns])
    middle, since = POSITIONS // 2, np.maximum.accumulate  # behind its face a flange rides on its tip, and is flat
    cut = np.concatenate([since(flange[middle::-1])[:0:-1], since(flange[middle:])])
    for share, points in zip(np.exp(-(away[~cut] ** 2) / 2), itertools.compress(turns, ~cut), strict=True):
        total += share
        for point in points:
            if point.side == "left":  # the right wheel is its mirror image, at the opposite position
                strips = share * law.depth(point.patch, scene.speed) * point.patch.grid.dy
                width = point.patch.grid.dy * np.cos(point.angle)
                add_across(only, only, np.array([point.station]), np.array([width]), strips[None, None], y, out)
    return gaussian_filter1d(out[0, 0] / max(total, 1e-30), SPREAD / (y[1] - y[0]), mode="nearest")


@cache
def worn_on_line(scene: Scene, law: WearLaw, factor: float, line: LineWear) -> LineWorn:
    """The way of the scene's wheel to a limit, by a law and a factor on it. Errors: ValueError where none is met.

    Error: some 10 % of the way by steps and positions (tests/damage/test_line_wear.py), beside the law's own factor.
    """
    y, new = wheel_lines(LINES), scene.wheel.shape
    around = float(circumference(scene, np.zeros(1))[0])
    distance, lost, over = [0.0], [np.zeros(len(y))], [beyond(new, line)]
    while over[-1][0] < 0:
        wheel = lowered(new, y, lost[-1])
        rate = factor * lost_in_a_turn(wheel, scene, law, line, y)
        if not rate.max() > 0:
            raise ValueError(f"damage.turning.line: {scene.wheel.name} meets no limit, for nothing wears it")
        if lost[-1].max() > DEEPEST:
            raise ValueError(
                f"damage.turning.line: {scene.wheel.name} meets no limit, {1e3 * lost[-1].max():.1f} mm are worn off:"
                " lower hollow or flange_height"
            )
        turns = STEP / rate.max()
        distance.append(distance[-1] + turns * around)
        lost.append(lost[-1] + turns * rate)
        over.append(beyond(lowered(new, y, lost[-1]), line))
    if len(distance) == 1:
        raise ValueError(f"damage.turning.line: {scene.wheel.name} is due for turning as it is: {over[0][1]}")
    (before, _), (after, limit) = over[-2:]
    part = before / (before - after)  # of the last step
    distance[-1] = distance[-2] + part * (distance[-1] - distance[-2])
    lost[-1] = lost[-2] + part * (lost[-1] - lost[-2])
    return LineWorn(np.array(distance), np.array(lost), y, limit)


def between(new: Profile, worn: Profile, part: float) -> Profile:
    """A profile that has lost a part of what lies between two, height by height at the points of the new one; where the
    worn one does not reach, the new one. Error: worn section linear in `part` to round-off (tests/damage/test_turning).
    """
    y, z = new.points.T
    lost, steeper = worn.height(y) - z, worn.slope(y) - new.slope(y)
    known = np.isfinite(lost) & np.isfinite(steeper) & (lost != 0)
    rate = part * np.where(known, steeper, 0.0)  # on both sides of a kink, which stays
    turned = lambda angle: np.where(known, np.arctan(np.tan(angle) + rate), angle)
    return Profile(
        np.column_stack([y, z + part * np.where(known, lost, 0.0)]),
        turned(new.angle_before),
        turned(new.angle_after),
        np.where(known, np.nan, new.curvature),
        f"{new.label}, {part:.1%} of the way to {worn.label}",
    )


def wheels_between(wheel: Wheel, worn: Wheel, until: float, ages: int) -> tuple[Wheel, ...]:
    """(ages,) wheels in the middles of equal parts of the wear from a wheel to a share `until` of that of `worn`."""
    return tuple(
        worn_wheel(wheel, between(wheel.shape, worn.shape, float(part)), f"{part:.1%} worn to {worn.name}")
        for part in middles(until, ages)
    )


def wheels_on_line(wheel: Wheel, way: LineWorn, until: float, ages: int) -> tuple[Wheel, ...]:
    """(ages,) wheels in the middles of equal parts of a share `until` of a wheel's way on straight line."""
    made = []
    for part in middles(until, ages):
        shape = between(wheel.shape, lowered(wheel.shape, way.y, way.after(float(part))), 1.0)
        name = f"{part:.1%} of {way.distance[-1] / 1e3:.3g} km to {way.limit}"
        made.append(worn_wheel(wheel, shape, name))
    return tuple(made)


def middles(until: float, ages: int) -> np.ndarray:
    """(ages,) of equal parts of 0 to `until`."""
    return (np.arange(ages) + 0.5) / ages * until


def worn_wheel(wheel: Wheel, line: Profile, how: str) -> Wheel:
    """A wheel that has become a line, how in words."""
    name = f"{wheel.name}, {how}"
    kept = MeasuredWheel(name, hashlib.sha256(line.points.tobytes()).hexdigest(), (), replace(line, label=name))
    return Wheel.checked({"profile": name, "radius": wheel.radius}, {"kept": kept})
