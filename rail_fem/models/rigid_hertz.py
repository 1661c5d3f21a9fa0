"""Model rigid_hertz: the wheel rolls over the true surfaces of wing and nose, each contact with the Hertz law of its
own curvatures.

Both bodies may carry at once, or none. Resolves the force on wing and nose, where it acts, and the size and pressure of
the patches as far as they are ellipses. One contact on each body (its nearest position). Blind to conformity, edges,
plastic flow and waves, which it flags. The wheel moves up and down; with `degrees_of_freedom` it is one of a wheelset
that rolls, and moves laterally and in yaw, on crossing and stock rail.
"""

from functools import partial
from pathlib import Path

from kernel_cache import working_time
from rail_fem.contact.contact_table import contact_table, every_second
from rail_fem.passes.pass_result import light_result, patch_steps, patches_at
from rail_fem.passes.plastic_indentation import contacts_of
from rail_fem.passes.validity import hertz_flags
from rail_fem.passes.vertical_pass import March, run_pass, run_with_errors
from rail_fem.result.result import PassResult
from rail_fem.scene.scene import Scene
from rail_fem.settings.light import RigidHertzSettings


def solve(
    scene: Scene,
    settings: RigidHertzSettings,
    folder: Path | None = None,
    restart: bool = False,
    progress=None,
    judged: bool = True,
) -> PassResult:
    """One pass. Error: second order in the step, measured by twice the step, and of a wheel alone by twice the spacing
    of the surface search. judged : whether these passes beside it are run

    Errors: CrossingError where the window leaves the crossing, ValueError, also where a wheelset leaves lateral_range.
    """
    if vertical := settings.degrees_of_freedom == "vertical":
        table = contact_table(scene, *settings.window(scene), settings.path_spacing)
        march: March = run_pass
    else:
        from rail_fem.passes.wheelset_pass import run_wheelset, surfaces_of

        surfaces = surfaces_of(scene, settings)
        table, march = surfaces.centred, partial(run_wheelset, surfaces)
    started = working_time()
    contacts = contacts_of(scene, settings, table)
    if judged:
        sparse = contacts_of(scene, settings, every_second(table)) if vertical else None
        run, errors = run_with_errors(scene, settings, contacts, sparse, march)
    else:
        run, errors = march(scene, settings, contacts), {}
    if not vertical:
        table = surfaces.under(run)
    patches = patches_at(table, run, patch_steps(table, run, scene.static_wheel_load))
    flags = hertz_flags(scene, table, run, patches)
    return light_result("rigid_hertz", scene, settings, table, run, errors, flags, started, patches)
