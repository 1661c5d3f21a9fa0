"""How long a travelling window must be for what it has to hold, known before anything is meshed."""

import math

import numpy as np

from rail_fem.contact.rigid import Settings, window_path, with_path
from rail_fem.fe.plan.fine_zone import NEAR
from rail_fem.fe.plan.mass_scaling import static_patch
from rail_fem.scene.scene import Scene
from rail_fem.settings.explicit import WINDOW_ENDS, FeSettings

IMPACT = 3.0  # largest contact force over the static load that a window must be long enough for
ZONE = 1.0  # plastic flow ahead of the patch and behind it, over the patch's half length
SPARE = 12e-3  # of an automatic window beyond the shortest, at least [m]


def largest_half_patch(scene: Scene) -> float:
    """Half length of the patch under an impact [m]: Hertz, so with the cube root of the force."""
    return static_patch(scene).semi_x * IMPACT ** (1 / 3)


def contact_reach(scene: Scene, settings: FeSettings) -> tuple[float, float]:
    """How far ahead of the axle and behind it the rigid wheel is in contact somewhere on its path, or about to be [m].
    Errors: CrossingError."""
    path = window_path(scene, settings.start, settings.end)
    offsets = [0.0]
    for gap, point in ((path.wing_gap, path.wing_point), (path.nose_gap, path.nose_point)):
        near = gap < NEAR
        offsets += list(scene.direction_sign * (point[near, 0] - path.x[near]))
    known = np.array(offsets)[np.isfinite(offsets)]
    return float(known.max()), float(-known.min())


def least_window(scene: Scene, settings: FeSettings) -> tuple[float, float]:
    """Shortest window ahead of the wheel and behind it [m]: to where the rigid wheel is in contact, half a patch, the
    plastic zone beyond it, a slab and two elements. Errors: CrossingError."""
    around = (1 + ZONE) * largest_half_patch(scene) + settings.window_margin
    ahead, behind = contact_reach(scene, settings)
    return ahead + around, behind + around


def with_window(scene: Scene, settings: Settings) -> Settings:
    """The settings of any model with what its scene decides: fe_window's path, and lengths of an automatic travelling
    window, in whole millimetres. Errors: as `with_path`, CrossingError."""
    settings = with_path(scene, settings)
    if not isinstance(settings, FeSettings) or "auto" not in (settings.window_ahead, settings.window_behind):
        return settings
    lengths = {
        name: math.ceil(max(length, least + SPARE) * 1e3) / 1e3
        for name, length, least in zip(WINDOW_ENDS, settings.window_lengths, least_window(scene, settings))
        if getattr(settings, name) == "auto"
    }
    return settings.model_copy(update=lengths)


def length_errors(scene: Scene, settings: FeSettings, model: str) -> list[str]:
    """Why a travelling window is too short, one line for each end; none where it is long enough or not asked for."""
    if not settings.has_window:
        return []
    reach, least = contact_reach(scene, settings), least_window(scene, settings)
    return [
        f"run.{model}.{name}: {length * 1e3:g} mm is shorter than {enough * 1e3:.3g} mm, which contact up to"
        f" {offset * 1e3:.1f} mm from the axle, half a patch ({largest_half_patch(scene) * 1e3:.1f} mm under {IMPACT:g}"
        f" times the static load), the plastic zone beside it, a slab and two elements need: give"
        f" {math.ceil(enough * 1e3)} mm or more"
        for name, length, offset, enough in zip(WINDOW_ENDS, settings.window_lengths, reach, least)
        if length < enough
    ]
