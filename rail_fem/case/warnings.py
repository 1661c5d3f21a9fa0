"""What is allowed in a case but calls for a warning: one warning each, with both numbers. `check` says it, and every
result and trust report repeats it."""

from pathlib import Path

import numpy as np

from geometry.path.wheel_path import rolling_radius
from geometry.profiles.wheel import flange_thickness
from geometry.surfaces.bodies import REGIONS
from rail_fem.contact.rigid import settling_distance, window_warnings
from rail_fem.fe.plan.mass_scaling import static_patch
from rail_fem.scene.crossing import CAST, JOINT
from rail_fem.scene.diverging import HEAD_WIDTH
from rail_fem.scene.scene import GRAVITY, Frozen, Scene
from rail_fem.scene.steel import FROM_MEMORY
from rail_fem.scene.units import show
from rail_fem.settings.explicit import FeSettings
from rail_fem.settings.light import BemPlasticSettings, LightSettings, PassSettings

COMPARED_RATIOS = 9.25, 10.75  # between which the parametric crossing was held against anything
FASTEST_COMPARED = 44.704  # 100 mph, of the sixteen cases, by which light models were held against fe_full [m/s]
ELEMENTS_ACROSS_PATCH = 6
CENTRE_HEIGHT, MOVED_LOAD = 1.5, 0.2  # of a vehicle [m], of a wheel's load: 1 m/s^2 across, cant short of 150 mm
LEAST_TRACK_MASS = 50.0  # [kg]
MANY_FRAMES = 500
# of a wheel's height between sections [m]: 0.05 mm moved the impact by up to 16 %
LARGEST_MISSED = 0.05e-3
STILL_MISSED = 1 / 3  # of what a wheel misses without every second section: a quarter, at an edge along x half of it
TREAD = -60e-3, 60e-3, 0.5e-3  # of a wheel, about its tread datum, that may touch [m]
SHORT_INTERVAL = 1e-6  # of a history [s]
# stiffness from which on hourglass modes are held: with none a rail's surface fell 0.53 for 0.06 mm (4 mm elements)
LEAST_HOURGLASS = 3e-4
SURROGATES = {
    "P8-worn": "nominal P8 with 0.8 mm of assumed tread wear",
    "P8-hollow": "nominal P8 with 3 mm of assumed hollow wear",
    "P1": "a 1:20 cone built from recalled dimensions",
}


def case_warnings(scene: Scene, settings: Frozen) -> list[str]:
    """All warnings about a case run by one model. settings : of the model, with start and end. Errors: as
    rail_fem.contact.rigid.window_path."""
    warnings = scene_warnings(scene) + _off_the_sections(scene, settings) + _beyond_the_track(scene, settings)
    if isinstance(settings, BemPlasticSettings) and scene.crossing.family != JOINT:
        warnings.append(
            "a half-space has no free side: at the corners of wing and nose bem_plastic is 28 to 39 % low in plastic"
            " strain; fe_full at 1.4 mm costs no more and is 1 to 9 % off (docs/speed.md)"
        )
    if isinstance(settings, FeSettings):
        return warnings + fe_warnings(scene, settings) + window_warnings(scene, settings.start, settings.end)
    of_cases = isinstance(settings, LightSettings) and scene.crossing.family != JOINT  # whose bar of form is theirs
    if of_cases and scene.speed > FASTEST_COMPARED * (1 + 1e-9):
        warnings.append(
            f"speed {show(scene.speed, 'mph', 4)} > {show(FASTEST_COMPARED, 'mph')}: how far light models are off"
            " fe_full was measured up to there (docs/sixteen_cases.md), their bar of form holds no more: run fe_full"
        )
    cyclic = [part for part in ("wing", "nose") if getattr(scene.materials, part).cyclic is not None]
    if cyclic and isinstance(settings, BemPlasticSettings):
        warnings.append(
            f"steel of the {' and '.join(cyclic)}: plastic strain follows its law over cycles, the indentation that the"
            " forces feel its first loading as an isotropic curve"
        )
    elif cyclic:
        warnings.append(
            f"steel of the {' and '.join(cyclic)}: only bem_plastic and the explicit models follow its law over cycles,"
            " this one takes its first loading as an isotropic curve"
        )
    return warnings


def _off_the_sections(scene: Scene, settings: Frozen) -> list[str]:
    """A path that meets none of the sections of a crossing, whose ends are carried on, or not the joint."""
    crossing, read = scene.crossing, scene.crossing.read
    if not isinstance(settings, (FeSettings, PassSettings)):
        return []
    path = (settings.start, settings.end) if isinstance(settings, FeSettings) else settings.window(scene)
    low, high = min(path), max(path)
    if crossing.family == JOINT and (crossing.dip_angle or crossing.joint_gap) and not low < 0 < high:
        return [
            f"the path from x = {low * 1e3:g} to {high * 1e3:g} mm does not pass the joint, x = 0: give start and end"
        ]
    if read is None:
        return []
    first, last = min(read.x), max(read.x)
    if low <= last and first <= high:
        return _sections_apart(scene, low, high)
    return [
        f"the path from x = {low * 1e3:g} to {high * 1e3:g} mm meets none of the sections, which lie from"
        f" {first * 1e3:g} to {last * 1e3:g} mm, only what carries them on (extend): see start, end and along"
    ]


def _sections_apart(scene: Scene, low: float, high: float) -> list[str]:
    """Sections of a path from low to high [m] so far apart that a wheel's path between them is in doubt."""
    read, y = scene.crossing.read, np.arange(*TREAD)
    radius = rolling_radius(scene.wheel.shape, scene.wheel.radius, y)
    y, radius = y[np.isfinite(radius)], radius[np.isfinite(radius)]
    low, high = min(low, read.x[read.x <= high].max()), max(high, read.x[read.x >= low].min())
    x, missed = read.crossing(scene.crossing.extend).missed(low, high, y + scene.wheel_datum_y, radius)
    if not len(x) or not (most := abs(missed).max() * STILL_MISSED) > LARGEST_MISSED:
        return []
    k = int(np.searchsorted(read.x, x[abs(missed).argmax()]))
    before, at, behind = read.x[k - 1 : k + 2] * 1e3
    return [
        f"sections {Path(read.source).name}: from x = {before:.0f} to {behind:.0f} mm too far apart: without the one at"
        f" {at:.0f} mm a wheel lies {most / STILL_MISSED * 1e3:.2g} mm off it, with all of them some"
        f" {most * 1e3:.2g} mm off the crossing between them, more than {LARGEST_MISSED * 1e3:g} mm, and forces follow:"
        " give sections closer there"
    ]


def _beyond_the_track(scene: Scene, settings: Frozen) -> list[str]:
    """Bearers with a state of their own over which no track is computed."""
    if scene.bearers is None or not isinstance(settings, PassSettings | FeSettings):
        return []
    window = settings.window(scene) if isinstance(settings, PassSettings) else (settings.start, settings.end)
    track, low, high = scene.bearers, min(window) - settings.beam_reach, max(window) + settings.beam_reach
    places = {n: track.position + n * track.spacing for n in (*track.voided, *track.missing, *track.unlike)}
    return [
        f"bearer {n} at x = {x:.1f} m lies beyond the track that is computed, {low:.1f} to {high:.1f} m (beam_reach):"
        " what is told of it changes nothing"
        for n, x in places.items()
        if not low <= x <= high
    ]


def scene_warnings(scene: Scene) -> list[str]:
    """Warnings about the physics."""
    warnings = [
        line for read in (scene.wheel.measured, scene.crossing.read) if read is not None for line in read.warnings
    ]
    if scene.wheel.profile in SURROGATES:
        warnings.append(
            f"wheel profile {scene.wheel.profile} is a surrogate ({SURROGATES[scene.wheel.profile]}), not a measured"
            " wheel"
        )
    if scene.crossing.family == CAST and not COMPARED_RATIOS[0] <= scene.crossing.ratio <= COMPARED_RATIOS[1]:
        warnings.append(
            f"crossing 1:{scene.crossing.ratio:g}: the parametric crossing was compared at 1:{COMPARED_RATIOS[0]:g} and"
            f" 1:{COMPARED_RATIOS[1]:g} only"
        )
    left, thick = (scene.gauge - scene.back_to_back) / 2, flange_thickness(scene.wheel.shape)
    if thick > left:
        warnings.append(
            f"the flange is {thick * 1e3:.1f} mm thick where the gauge is measured, gauge less back_to_back leaves it"
            f" {left * 1e3:g} mm: this wheelset does not fit between the rails"
        )
    across = scene.lateral_force / scene.axle_load
    moved = abs(across) / GRAVITY * CENTRE_HEIGHT / ((scene.gauge + HEAD_WIDTH) / 2)
    if moved > MOVED_LOAD:
        warnings.append(
            f"diverging: {across:.2f} m/s^2 across the track: with its centre of gravity {CENTRE_HEIGHT:g} m up"
            f" (assumed) the vehicle moves {100 * moved:.0f} % of a wheel's load to the other rail, more than"
            f" {100 * MOVED_LOAD:g} %{', and overturns' if moved > 1 else ''}; this is left out: are speed, radius and"
            " cant right?"
        )
    for part in REGIONS:
        material = getattr(scene.materials, part)
        if material.grade in FROM_MEMORY and material.hardening_stress is None:
            warnings.append(
                f"steel {material.grade} of the {part}: part of its curve is from memory, not verified"
                " (rail_fem/scene/steel.py): give hardening_strain and hardening_stress of a test"
            )
    if scene.friction > 0.7:
        warnings.append(f"friction {scene.friction:g} > 0.7: steel on steel, dry, has 0.2 to 0.6")
    if 0 < scene.foundation.track_mass < LEAST_TRACK_MASS:
        warnings.append(
            f"track mass {scene.foundation.track_mass:g} kg < {LEAST_TRACK_MASS:g} kg: rail and half a sleeper weigh"
            " some hundred kg; is its unit right?"
        )
    if any(not 0 <= material.steel().poisson < 0.45 for material in (scene.materials.wing, scene.materials.nose)):
        warnings.append("Poisson's ratio >= 0.45: the critical step falls with the bulk modulus")
    return warnings


def fe_warnings(scene: Scene, settings: FeSettings) -> list[str]:
    """Warnings about the numerics of an explicit FE run of this scene."""
    warnings = []
    patch = static_patch(scene)
    across, needed = 2 * min(patch.semi_x, patch.semi_y), ELEMENTS_ACROSS_PATCH * settings.element_size
    if across < needed:
        warnings.append(
            f"patch {across * 1e3:.1f} mm < {ELEMENTS_ACROSS_PATCH} elements of {settings.element_size * 1e3:g} mm:"
            " pressure and plastic strain will be coarse"
        )
    if settings.courant > 0.95:
        warnings.append(
            f"courant {settings.courant:g} > 0.95: contact stiffens the surface, the step may become unstable"
        )
    if settings.element == "one-point" and settings.hourglass < LEAST_HOURGLASS:
        warnings.append(
            f"hourglass {settings.hourglass:g} < {LEAST_HOURGLASS:g}: hardly anything holds the modes that one-point"
            " elements do not feel, and hourglass energy does not show it: plastic strain and fall come out too large"
        )
    settling, window = settling_distance(scene, settings), abs(settings.end - settings.start)
    if settling > window / 2:
        warnings.append(
            f"the wheel rolls {settling * 1e3:.4g} of {window * 1e3:.4g} mm while it settles: less than half of the"
            " window is a pass"
        )
    if settings.field_frames > MANY_FRAMES:
        warnings.append(
            f"{settings.field_frames} field outputs > {MANY_FRAMES}: they will fill the disk and take most of the time"
        )
    if settings.history_interval < SHORT_INTERVAL:
        warnings.append(
            f"history interval {settings.history_interval * 1e6:g} us < {SHORT_INTERVAL * 1e6:g} us: energies are"
            " summed nearly every step"
        )
    if not 0.1 <= settings.penalty <= 10:
        warnings.append(
            f"penalty {settings.penalty:g} is outside [0.1, 10]: soft contact overlaps, stiff contact chatters and"
            " needs a shorter step"
        )
    return warnings
