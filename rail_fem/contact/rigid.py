"""The rigid wheel's path over a scene's crossing: what geometry alone says before any model runs."""

from typing import TypeVar

import numpy as np

from geometry.axes import tread_datum_y
from geometry.path.wheel_path import WheelPath, rolling_radius, wheel_path
from geometry.surfaces.crossing import CastCrossing, CrossingError
from rail_fem.scene.crossing import JOINT
from rail_fem.scene.scene import Frozen, Scene
from rail_fem.settings.explicit import COMMON_WINDOW, FeSettings

SPACING = 5e-3  # between the axle positions that are looked at [m]
ANCHORED_SPACING = 1e-3  # between those of `anchored_path`, counted from x = 0
AROUND = 0.02  # of the path beyond the window [m]
PLAIN_BEFORE_LEG = 0.2  # plain rail before the leg's transition that is still of the same stretch [m]
FULL_NOSE = 0.69  # where the nose of the 1:9.25 crossing has long been a full rail; stretches with the ratio [m]
LAST_NOSE = 1.5  # of any crossing: behind it a design stretch ends where the run does [m]
BEYOND_PATH = 0.11  # of the modelled crossing that a wheel needs ahead of its last position [m]
CLEAR = 20e-3  # at least between the end of settling and a transfer: a patch's length [m]
# of a window around the transfer: released before the transfer, and run on behind the first impact [m]
LEAD, FOLLOW = 35e-3, 160e-3


Settings = TypeVar("Settings", bound=Frozen)


def rigid_path(scene: Scene, x: np.ndarray) -> WheelPath:
    """Path of the scene's wheel at axle positions x (n,) [m]. Errors: CrossingError where the crossing ends."""
    shift = scene.wheel_datum_y - tread_datum_y()
    return wheel_path(scene.wheel.shape, scene.crossing.surface, x, scene.wheel.radius, shift)


def anchored_path(scene: Scene, low: float, high: float) -> WheelPath:
    """The path around the stretch from `low` to `high` [m], over a stretch that does not hang on where exactly the path
    ends. Errors: CrossingError.

    The stretch ends at positions on the crossing: the last before `low` of the theoretical intersection, the end of the
    leg and the plain rail before it; the first behind `high` of where the nose is a full rail and as far as the
    crossing goes.
    """
    crossing = scene.crossing.surface
    low, high, leg = low - AROUND, high + AROUND, crossing.leg_range
    full_nose = FULL_NOSE * (crossing.stretch if isinstance(crossing, CastCrossing) else 1.0)
    begin = next(x for x in (0.0, leg[1], leg[0] - PLAIN_BEFORE_LEG, low) if x <= low)
    end = next(x for x in (full_nose, min(crossing.x_range[1] - BEYOND_PATH, LAST_NOSE), high) if x >= high)
    return rigid_path(
        scene, np.arange(np.floor(begin / ANCHORED_SPACING), np.ceil(end / ANCHORED_SPACING) + 1) * ANCHORED_SPACING
    )


def meshed_stretch(scene: Scene, settings: FeSettings) -> tuple[float, float]:
    """Low and high x of the axle that is meshed for [m]: from start to end, and on as far as a travelling window holds
    steel there, so that no step sees where the mesh ends; but not to where the crossing itself does."""
    start, end = scene.in_order_of_travel(settings.start, settings.end)
    first, last = scene.crossing.surface.x_range
    left = (last - end if end > start else end - first) - BEYOND_PATH - AROUND - ANCHORED_SPACING
    low, high = sorted((start, end + scene.direction_sign * min(settings.beyond_end, max(left, 0.0))))
    return low, high


def ends_with_path(scene: Scene, settings: FeSettings) -> bool:
    """Whether no steel is meshed ahead of the path's end for what a wheel there would hold: without a travelling
    window, or where the crossing ends. Not known of a mesh from a file."""
    low, high = meshed_stretch(scene, settings)
    on = high - low - abs(settings.end - settings.start)
    return not settings.mesh and not (settings.beyond_end > 0 and on > settings.beyond_end - ANCHORED_SPACING)


def datum_height(scene: Scene, path: WheelPath, x: float) -> float:
    """Height of the wheel's D0 where the rigid wheel stands at x [m]: through its contact point."""
    i = int(np.argmin(np.abs(path.x - x)))
    at, y, z = path.contact_point[i]
    radius = scene.wheel.radius
    rolling = rolling_radius(scene.wheel.shape, radius, np.array([y - scene.wheel_datum_y]))[0]
    return float(z - radius + np.sqrt(rolling**2 - (at - path.x[i]) ** 2))


def window_path(scene: Scene, start: float, end: float) -> WheelPath:
    """The same from start to end of a run [m], every 5 mm."""
    count = max(2, int(np.ceil(abs(end - start) / SPACING)) + 1)
    return rigid_path(scene, np.linspace(start, end, count))


def with_path(scene: Scene, settings: Settings) -> Settings:
    """The settings of any model, with start and end where fe_window's leave them open: so that the wheel has settled
    LEAD before the position where a rigid wheel changes body, and runs on for FOLLOW behind it.

    Errors: CrossingError, ValueError where a rigid wheel changes body nowhere on the common path, or a given end lies
    beyond the one found.
    """
    if not isinstance(settings, FeSettings) or None not in (settings.start, settings.end):
        return settings
    transfers = scene.direction_sign * rigid_path(scene, np.arange(*COMMON_WINDOW, SPACING)).transfers
    if not len(transfers):
        raise ValueError(
            f"a rigid wheel never changes body between x = {COMMON_WINDOW[0] * 1e3:g} and {COMMON_WINDOW[1] * 1e3:g}"
            " mm: give start and end"
        )
    start = transfers.min() - LEAD - settling_distance(scene, settings)
    chosen = {"start": start, "end": transfers.max() + FOLLOW}
    chosen = {name: round(scene.direction_sign * x, 4) for name, x in chosen.items() if getattr(settings, name) is None}
    found = settings.model_copy(update=chosen)
    if scene.direction_sign * (found.end - found.start) <= 0:
        raise ValueError(f"{found.start * 1e3:g} mm lies not before {found.end * 1e3:g} mm: give both")
    return found


def window_errors(scene: Scene, settings: FeSettings, model: str) -> list[str]:
    """Why the wheel cannot run over this window, if it cannot; and where it would settle across a transfer. settings :
    with start and end"""
    try:
        path = window_path(scene, settings.start, settings.end)
    except (CrossingError, ValueError) as error:
        return [f"run.{model}.start, end: {error}"]
    start, sign, settling = running_start(scene, settings), scene.direction_sign, settling_distance(scene, settings)
    hit = [x for x in path.transfers if sign * (x - start) <= settling + CLEAR] if settling > 0 else []
    return [
        f"run.{model}.start: the wheel settles from x = {start * 1e3:.0f} to"
        f" {release_position(scene, settings) * 1e3:.0f} mm,"
        f" and a rigid wheel changes body at {x * 1e3:.0f} mm, less than {CLEAR * 1e3:g} mm behind that: begin"
        f" {'before' if sign > 0 else 'behind'} x = {(x - sign * (settling + CLEAR)) * 1e3:.0f} mm, or take a shorter"
        " settle_time"
        for x in hit[:1]
    ]


def running_start(scene: Scene, settings: FeSettings) -> float:
    """The end of the window at which the wheel begins [m]."""
    return scene.in_order_of_travel(settings.start, settings.end)[0]


def settling_distance(scene: Scene, settings: FeSettings) -> float:
    """How far the wheel rolls while it settles [m]."""
    return scene.speed * settings.settle_time


def release_position(scene: Scene, settings: FeSettings) -> float:
    """x where the wheel has settled and is let go [m]."""
    return running_start(scene, settings) + scene.direction_sign * settling_distance(scene, settings)


def window_warnings(scene: Scene, start: float, end: float) -> list[str]:
    """A window from start to end [m] in which the wheel never changes from wing to nose, or one that starts or ends
    while it does."""
    if scene.crossing.family == JOINT:
        return []
    path = window_path(scene, start, end)
    if len(path.transfers) == 0:
        carrier = "nose" if path.on_nose[0] else "wing"
        return [
            f"between start {start * 1e3:g} mm and end {end * 1e3:g} mm a rigid wheel stays on the"
            f" {carrier}: no load transfer will be seen"
        ]
    margin = 0.05
    near = [x for x in path.transfers if min(abs(x - start), abs(x - end)) < margin]
    return [
        f"a rigid wheel changes body at x = {x * 1e3:.0f} mm, less than {margin * 1e3:g} mm from an end of the window"
        for x in near
    ]
