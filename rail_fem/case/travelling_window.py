"""Whether a travelling window is long enough for what it has to hold, known before anything is meshed."""

from rail_fem.case.warnings import static_patch
from rail_fem.scene.scene import Scene
from rail_fem.settings.explicit import FeSettings

IMPACT = 3.0  # largest contact force over the static load that a window must be long enough for
ZONE = 1.0  # plastic flow ahead of the patch and behind it, over the patch's half length
SLAB, SLAB_ELEMENTS = 6e-3, 3  # slabs enter and leave whole: the longer of these and of so many elements [m]


def least_window(scene: Scene, settings: FeSettings) -> float:
    """Shortest window ahead of the wheel or behind it [m]: half the patch under an impact (Hertz, so with the cube root
    of the force), the plastic zone beyond it, and a slab."""
    half_patch = static_patch(scene).semi_x * IMPACT ** (1 / 3)
    return (1 + ZONE) * half_patch + max(SLAB, SLAB_ELEMENTS * settings.element_size)


def length_errors(scene: Scene, settings: FeSettings, model: str) -> list[str]:
    """Why a travelling window is too short, one line for each end; none where it is long enough or not asked for."""
    least = least_window(scene, settings)
    half_patch = static_patch(scene).semi_x * IMPACT ** (1 / 3)
    return [
        f"run.{model}.{name}: {length * 1e3:g} mm is shorter than the {least * 1e3:.0f} mm that half a patch"
        f" ({half_patch * 1e3:.1f} mm under {IMPACT:g} times the static load), the plastic zone beside it and a slab of"
        f" elements need: give {least * 1e3:.0f} mm or more"
        for name, length in zip(("window_ahead", "window_behind"), settings.window_lengths)
        if length < least
    ]
