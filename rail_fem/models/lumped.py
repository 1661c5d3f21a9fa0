"""Model lumped: sprung mass, wheel and track mass with one contact spring over the rigid wheel path.

Resolves the force history of one contact. Blind to how wing and nose share the load, to the patch, to plastic flow and
waves.
"""

from pathlib import Path

import numpy as np

from bem.exact.hertz import tangent_stiffness
from kernel_cache import working_time
from rail_fem.contact.contact_law import ContactLaw
from rail_fem.contact.contact_table import contact_table, every_second
from rail_fem.passes.pass_result import light_result
from rail_fem.passes.validity import lumped_flags
from rail_fem.passes.vertical_pass import Contacts, force_change, run_pass, run_with_errors
from rail_fem.result.result import PassResult
from rail_fem.scene.scene import Scene
from rail_fem.settings.light import LumpedSettings


def solve(
    scene: Scene, settings: LumpedSettings, folder: Path | None = None, restart: bool = False, progress=None
) -> PassResult:
    """One pass. Nothing is written, nothing is restarted: it takes a second, most of it for the rigid path.

    Error: second order in the step, measured by twice the step; `contact_stiffness` is the force's change when the
    contact is half as stiff. Errors: CrossingError where the window leaves the crossing, ValueError.
    """
    table = contact_table(scene, *settings.window(scene), settings.path_spacing)
    started = working_time()
    constant = settings.contact_stiffness or static_constant(table, settings.window(scene)[0])
    contacts = lambda table, constant: one_contact(table, constant, settings.contact, scene.static_wheel_load)
    run, errors = run_with_errors(scene, settings, contacts(table, constant), contacts(every_second(table), constant))
    softer = run_pass(scene, settings, contacts(table, constant / 2))
    errors["contact_stiffness"] = force_change(run, softer)
    flags = lumped_flags(scene, table, run, constant)
    trust = {"contact_constant": constant}
    return light_result("lumped", scene, settings, table, run, errors, flags, started, trust=trust)


def static_constant(table, start: float) -> float:
    """Hertz constant [N/m^1.5] of the body that carries at the start."""
    body, i = table.carrier(start)
    return float(table.stiffness[body, i])


def one_contact(table, constant: float, law: str, load: float) -> Contacts:
    """One contact on the higher of both bodies; linear: with Hertz' stiffness at the static load and the same
    static height there."""
    approach = (load / constant) ** (2 / 3)
    linear = tangent_stiffness(constant, load)
    stiffness, exponent, lowered = (constant, 1.5, 0.0) if law == "hertz" else (linear, 1.0, approach - load / linear)
    height = lambda x: table.height_at(x).max(axis=0, keepdims=True) - lowered
    return lambda x: ContactLaw(height(x), np.full((1, len(x)), stiffness), exponent=exponent)
