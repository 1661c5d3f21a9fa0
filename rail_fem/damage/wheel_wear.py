"""Wear of the wheel by its passes over a crossing: mean depth around its circumference, over its profile.

While a wheel goes on by dX, a length dX of its circumference passes the patch, each point of it the whole patch: it
loses the strips' depth there. Where on the circumference a wheel meets the crossing is chance, so that over many passes
the mean loss at the profile's coordinate y is sum over X of strip(X, y) dX / (2 pi r(y)).
Laws are those of the rail by the wheel's hardness; those that know no hardness take as much from the wheel as from the
rail. The passes of one kind wear that kind's profile: its shape stands for a population and does not change.
"""

from collections.abc import Mapping

import numpy as np

from geometry.path.wheel_path import rolling_radius
from geometry.surfaces.bodies import BODIES
from rail_fem.damage.crossing import PassContacts
from rail_fem.damage.deposit import add_across
from rail_fem.damage.wear import WearLaw
from rail_fem.scene.scene import Scene

REACH = 0.08  # of the profile's coordinate on both sides of the tread datum [m]


def wheel_lines(spacing: float) -> np.ndarray:
    """(n,) coordinates of wheel profiles from their tread datum, + to the field side [m]."""
    half = int(np.ceil(REACH / spacing))
    return np.arange(-half, half + 1) * spacing


def wheel_wear(
    contacts: PassContacts,
    scene: Scene,
    datum: float,
    laws: Mapping[str, WearLaw],
    factor: float,
    spacing: float,
    y: np.ndarray,
) -> np.ndarray:
    """(laws, 2, n) mean depth [m] around the circumference that one pass takes off the wheel at coordinates y (n,) of
    its profile [m] on wing and nose, downwards on the profile (its lost section is the sum times the lines' distance).

    datum : y of the wheel's tread datum in the track [m];  factor : on all laws;  spacing : between the patches [m]
    Error: volume, depth times circumference, is that of the strips to round-off (tests/damage/test_wheel_wear.py).
    """
    grid, angle = contacts.patches.grid, contacts.angle
    centre, width = contacts.position[:, 1] - datum, grid.dy * np.cos(angle)
    out, only = np.zeros((len(laws), len(BODIES), 1, len(y))), np.zeros(len(centre), int)
    for own, law in zip(out, laws.values(), strict=True):
        strips = law.depth(contacts.patches, contacts.speed) * (factor * spacing * grid.dy)[:, None]
        add_across(contacts.body, only, centre, width, strips[:, None], y, own)
    return out[:, :, 0] / circumference(scene, y)


def circumference(scene: Scene, y: np.ndarray) -> np.ndarray:
    """(n,) of the wheel at coordinates y of its profile [m]; beyond the profile that of the tread datum."""
    radius = rolling_radius(scene.wheel.shape, scene.wheel.radius, y)
    return 2 * np.pi * np.where(np.isfinite(radius), radius, scene.wheel.radius)
