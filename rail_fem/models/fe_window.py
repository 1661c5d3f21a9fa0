"""Model fe_window: the explicit FE of fe_full over the nose alone, begun in the middle of the pass as rigid_hertz has
found it.

rigid_hertz runs from the approach to where the FE's settling ends: its contact force, spring compressions and
velocities of wheel, sprung mass and crossing are the FE's there. Resolves what fe_full does, in the window. Blind to
plastic strain and waves from before it, and as wrong at its start as rigid_hertz is.
"""

from functools import partial
from pathlib import Path

from rail_fem.contact.rigid import release_position, with_path
from rail_fem.fe.start_state import from_rigid_hertz
from rail_fem.models.fe_full import solve_from
from rail_fem.processes.launcher import on_root
from rail_fem.result.result import PassResult
from rail_fem.scene.scene import Scene
from rail_fem.settings.explicit import FeWindowSettings
from rail_fem.settings.light import RigidHertzSettings


def solve(
    scene: Scene, settings: FeWindowSettings, folder: Path | None = None, restart: bool = False, progress=None
) -> PassResult:
    """One window. Collective on MPI.COMM_WORLD. Errors: as fe_full, and ValueError where rigid_hertz finds the wheel in
    the air at the start."""
    settings = on_root(partial(with_path, scene, settings))
    released = release_position(scene, settings)
    start = on_root(lambda: from_rigid_hertz(scene, approach_of(settings), released))
    return solve_from(scene, settings, start, "fe_window", folder, restart, progress)


def approach_of(settings: FeWindowSettings) -> RigidHertzSettings:
    """Numerics of the light pass that hands over."""
    kept = ("end", "indentation_law", "beam_element", "beam_reach")
    return RigidHertzSettings(start=settings.approach_start, **{name: getattr(settings, name) for name in kept})
