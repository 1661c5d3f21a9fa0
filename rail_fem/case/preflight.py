"""Everything that forbids a run and can be known before anything is meshed or written."""

from geometry.surfaces.crossing import CrossingError
from rail_fem.case.estimate import impossible
from rail_fem.light.fine_zone import mesh_faults
from rail_fem.light.rigid import placed, placement_faults
from rail_fem.scene.scene import Frozen, Scene
from rail_fem.settings.explicit import FeSettings


def run_faults(scene: Scene, settings: Frozen, ranks: int, model: str) -> list[str]:
    """Too little memory, more ranks than cells, a window that leaves the crossing or settles across a transfer,
    elements too large for it; one line each with the remedy."""
    if not isinstance(settings, FeSettings):
        return []
    try:
        settings = placed(scene, settings)
    except (CrossingError, ValueError) as error:
        return [f"run.{model}.start, end: {error}"]
    faults = impossible(scene, settings, ranks, model) + placement_faults(scene, settings, model)
    return faults or mesh_faults(scene, settings, model)
