"""Wheels at all ages between two turnings, for a life study: how they look when they are turned is given, or that of
rail_fem.damage.line_wear.

What a wheel loses over one crossing is nothing beside its way between two passes: its wear is that of its line, of
curves and brakes. At constant wear a mile, wheels that come past at any moment are
of all depths between new and turned, each as frequent (renewal: Cox, Renewal Theory (1962), chapter 5, recalled), and
the crossing sees the same mixture at all times, however many miles lie between two turnings.
"""

import hashlib
from dataclasses import replace

import numpy as np

from geometry.profiles.profile import Profile
from rail_fem.damage.line_wear import LineWorn, lowered
from rail_fem.scene.scene import Wheel
from rail_fem.scene.wheel_profile import MeasuredWheel


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
