"""Model bem_passage: as rigid_hertz, but stiffness and patches of the contacts come from the half-space solver of `bem`
on the true gaps.

At positions along the path, on each body that the wheel can reach there, the gap of the true surfaces is solved under
the static load; its approach takes the place of the fitted paraboloid's in the contact's law. At the moments that
matter (start, largest forces and Hertz pressures, most even sharing, end) patches are solved under the forces found.
Resolves what rigid_hertz does, and the shape and pressure of patches that are no ellipses. Blind to edges (the
half-space goes on beyond them, and is too stiff under a cone beside the rail's end), plastic flow within a patch and
waves, which it flags. The patches solved under the forces of the pass say how far the law is off there
(rail_fem.passes.validity.law_flags): under the static load F = K d^1.5 is exact, and a force far above it is found too
large where a wheel touches along a line.
"""

import functools
from dataclasses import replace
from pathlib import Path

import numpy as np

from bem.patch import Patch, PatchCutError
from geometry.surfaces.bodies import BODIES
from kernel_cache import working_time
from rail_fem.contact.contact_pairs import ContactPair, crossing_surface, pair_at
from rail_fem.contact.contact_table import HIDDEN, ContactTable, TableKey, every_second, table_key, table_of
from rail_fem.passes.pass_result import light_result, patch_steps
from rail_fem.passes.plastic_indentation import as_seen, contacts_of, elastic_law
from rail_fem.passes.validity import SolvedContact, bem_flags, law_flags
from rail_fem.passes.vertical_pass import LightPass, run_with_errors
from rail_fem.result.result import PassResult, PatchSummary
from rail_fem.scene.scene import Scene
from rail_fem.settings.light import BemPassageSettings

WINDOW = 0.025, 0.025  # half length and half width in which a patch is looked for at first [m]
WIDEST = 0.1  # half width at most: wider than wing and tread together [m]


def solve(
    scene: Scene, settings: BemPassageSettings, folder: Path | None = None, restart: bool = False, progress=None
) -> PassResult:
    """One pass. Error: second order in the step, by twice the step; of the patches, by twice the cells' sides.

    Errors: CrossingError where the window leaves the crossing, bem.patch.ContactInputError for a gap that cannot be
    solved.
    """
    key = table_key(scene, *settings.window(scene), settings.path_spacing)
    load = scene.static_wheel_load
    table = as_seen(solved_table(key, settings.patch_spacing, settings.cells), settings)
    started = working_time()
    contacts, sparse = (contacts_of(scene, settings, one) for one in (table, every_second(table)))
    run, errors = run_with_errors(scene, settings, contacts, sparse)
    solved = solved_patches(key, settings, table, run, patch_steps(table, run, load))
    patches = tuple(patch for patch, _, _ in solved)
    errors["pressure"] = max(p.error.max_pressure for _, p, _ in solved)
    flags = *bem_flags(scene, patches), *law_flags([contact for _, _, contact in solved], load)
    return light_result("bem_passage", scene, settings, table, run, errors, flags, started, patches)


@functools.lru_cache(maxsize=32)
def solved_table(key: TableKey, patch_spacing: float, cells: int) -> ContactTable:
    """The table with stiffness from gaps solved every `patch_spacing` under the static load, carried on between them as
    a factor on the Hertz constant.

    Kept, as the table itself, for scenes that differ in speed, foundation or yield curve only; search_time holds what
    solving took.
    """
    hertz, started = table_of(key), working_time()
    stiffness = hertz.stiffness.copy()
    every = max(1, int(round(patch_spacing / (hertz.x[1] - hertz.x[0]))))
    for b in range(len(BODIES)):
        reached = np.flatnonzero((hertz.stiffness[b] > 0) & (hertz.height[b] > hertz.height.max(axis=0) - HIDDEN))
        chosen = np.unique(np.r_[reached[::every], reached[-1:]])
        solved = [approach_stiffness(pair_of(key, hertz, b, i), key.load, cells) for i in chosen]
        if len(chosen):
            stiffness[b] *= np.interp(hertz.x, hertz.x[chosen], solved / hertz.stiffness[b, chosen])
    return replace(hertz, stiffness=stiffness, search_time=hertz.search_time + working_time() - started)


def pair_of(key: TableKey, table: ContactTable, body: int, index: int, x: float | None = None) -> ContactPair:
    """Wheel and body touching at the table's contact point, shifted with the wheel to x [m]."""
    x = float(table.x[index]) if x is None else x
    point = table.point[body, index, :2] + [x - table.x[index], 0.0]
    return pair_at(
        key.wheel,
        crossing_surface(key.crossing, BODIES[body]),
        (x, key.datum),
        point,
        key.radius,
        wheel_steel=key.steels[2],
        rail_steel=key.steels[body],
        label=BODIES[body],
    )


def solved_patch(pair: ContactPair, load: float, cells: int, estimate: bool) -> Patch:
    """Patch under a vertical load [N]. A cone on the wing's plane touches over its whole width: where a window cuts the
    patch, it is widened."""
    length, width = WINDOW
    while True:
        try:
            return pair.patch(load, cells, pair.window(length, width), estimate)
        except PatchCutError:
            if width >= WIDEST:
                raise
            width = min(1.6 * width, WIDEST)


def approach_stiffness(pair: ContactPair, load: float, cells: int) -> float:
    """K of F = K d^1.5 [N/m^1.5], F and d vertical, that meets the solved approach at this load."""
    return load / (solved_patch(pair, load, cells, estimate=False).approach / pair.frame[2, 2]) ** 1.5


def solved_patches(
    key: TableKey, settings: BemPassageSettings, table: ContactTable, run: LightPass, steps: list[int]
) -> list[tuple[PatchSummary, Patch, SolvedContact]]:
    """Patches of the bodies that carry at these steps, each with its solution and its stiffness beside the law's."""
    found, law = [], elastic_law(table, key.load)
    for i in steps:
        for b, body in enumerate(BODIES):
            if run.force[b, i] <= 0:
                continue
            x, force = float(run.x[i]), float(run.force[b, i])
            near = table.touching(b, x)
            pair = pair_of(key, table, b, near, x)
            patch = solved_patch(pair, force, settings.cells, estimate=True)
            approach, exponent = (values[b, near] for values in law)
            length, width = (
                float(np.ptp(np.flatnonzero((patch.pressure > 0).any(axis=1 - k))) + 1) * side
                for k, side in enumerate((patch.grid.dx, patch.grid.dy))
            )
            at = float(run.time[i]), float(pair.point[0]), float(pair.point[1])
            loaded = patch.contact_area, patch.normal_force, patch.max_pressure
            by_law = float(approach * (force / key.load) ** (1 / exponent))
            contact = SolvedContact(body, x, force, by_law, float(patch.approach / pair.frame[2, 2]))
            found.append((PatchSummary(*at, body, length, width, *loaded), patch, contact))
    return found
