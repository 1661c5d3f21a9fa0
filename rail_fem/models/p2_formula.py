"""Model p2_formula: the standard's force at the nose, from the dip angle of the rigid wheel path.

Resolves the sustained peak P2 and the high-frequency peak P1. Blind to the history, the patch, plastic flow, and
impacts elsewhere.
"""

from pathlib import Path

import numpy as np

from bem.exact.hertz import tangent_stiffness
from kernel_cache import working_time
from rail_fem.contact.contact_table import ContactTable, contact_table
from rail_fem.contact.rigid import BEYOND_PATH
from rail_fem.passes.p2 import P2_LIMITS, p1_force, p2_force, p2_increment, unsprung_mass
from rail_fem.passes.validity import Flag, flag, flag_warnings, p2_flags
from rail_fem.result.result import NAN, Cost, PassResult, Peak
from rail_fem.scene.crossing import CAST, JOINT
from rail_fem.scene.scene import Scene
from rail_fem.settings.light import P2Settings

# where a transfer is looked for on a 1:10.75 crossing [m]; slimmer noses lie farther
LOOKED_AT, LOOKED_AT_RATIO = (0.0, 0.9), 10.75
JOINT_LOOKED_AT = (-0.05, 0.05)  # about a joint's bend [m]
SPACING = 2.5e-3
JOINT_SPACING = 0.1e-3  # the path over a gap turns within millimetres [m]
BESIDE = 10e-3  # stretch on both sides of the transfer over which the path's slope is taken [m]


def solve(
    scene: Scene, settings: P2Settings, folder: Path | None = None, restart: bool = False, progress=None
) -> PassResult:
    """P2 by both readings, P1, and the limits of the standard. Error: not claimed; the formula's assumptions are
    flagged.

    The formula takes microseconds; the dip angle of the rigid path, unless given, a second.
    Errors: ValueError when a rigid wheel never changes body and no dip angle is given.
    """
    dip, transfer, constant = settings.dip_angle, NAN, NAN
    started, search_time = working_time(), 0.0
    if dip is None:
        table = dip_table(scene)
        started, search_time = working_time(), table.search_time
        dip, transfer, constant = rigid_dip(table)
    load, mass = scene.static_wheel_load, unsprung_mass(scene, settings.unsprung)
    foundation = scene.foundation
    increment_of = lambda mass: p2_increment(dip, scene.speed, mass, foundation.track_mass, foundation.stiffness)
    increment = increment_of(mass)
    chosen = p2_force(load, increment, settings.reading)
    peaks = {
        "p2": Peak(chosen, "N", x=transfer),
        "p2_increment_times_1.2": Peak(p2_force(load, increment), "N", x=transfer),
        "p2_all_times_1.2": Peak(p2_force(load, increment, "all"), "N", x=transfer),
        "force_foundation": Peak(load + increment, "N", x=transfer),
    }
    flags = [*p2_flags(scene, dip), *limit_flags(chosen)]
    if constant > 0:
        linear, wheel = tangent_stiffness(constant, load), scene.vehicle.wheel_unsprung_mass
        p1_of = lambda moved: p1_force(load, dip, scene.speed, linear, wheel, moved)
        peaks["p1"] = Peak(p1_of(foundation.track_mass), "N", x=transfer)
        tenth = f"with a tenth, P1 is {p1_of(foundation.track_mass / 10) / 1e3:.1f} kN"
        reason = f"{foundation.track_mass:g} kg, the whole track's; Jenkins' is the rail's own, which no key tells"
        flags.append(flag("P1 mass", f"{reason}: {tenth}"))
    if settings.unsprung == "wheelset":
        one = increment_of(scene.vehicle.wheel_unsprung_mass)
        reason = f"{mass:g} kg, a whole wheelset's on one rail, as table 7-5 takes it: with one wheel's, half, P2 is"
        flags.append(flag("unsprung mass", f"{reason} {p2_force(load, one, settings.reading) / 1e3:.1f} kN"))
    return PassResult(
        model="p2_formula",
        scene=scene,
        settings=settings.model_dump(mode="json"),
        history={"time": np.empty(0), "x": np.empty(0)},
        peaks=peaks,
        transfer_x=transfer,
        cost=Cost(search_time + working_time() - started, 0, 1, search_time=search_time),
        error_estimate={"force": NAN},
        trust={"validity": flags, "dip_angle": dip, "unsprung_mass": mass},
        warnings=flag_warnings(flags),
    )


def dip_table(scene: Scene) -> ContactTable:
    """The contacts along the path in whose bend the dip angle is; kept, so that who looks beforehand costs nothing."""
    spacing = JOINT_SPACING if scene.crossing.family == JOINT else SPACING
    return contact_table(scene, *looked_at(scene), spacing)


def looked_at(scene: Scene) -> tuple[float, float]:
    """Low and high x of the stretch on which the path's bend is looked for, within the crossing [m]."""
    if scene.crossing.family == JOINT:
        return JOINT_LOOKED_AT
    slim = max(1.0, scene.crossing.ratio / LOOKED_AT_RATIO) if scene.crossing.family == CAST else 1.0
    first, last = scene.crossing.surface.x_range
    return max(LOOKED_AT[0], first + BEYOND_PATH), min(LOOKED_AT[1] * slim, last - BEYOND_PATH)


def rigid_dip(table: ContactTable) -> tuple[float, float, float]:
    """Dip angle [rad] of the rigid path at the transfer, its x [m], and the nose's Hertz constant there.

    Where there is one body only, a joint, the angle between its steepest fall and rise. On crossings
    the angle between the steepest fall and the steepest rise within BESIDE of the position where the path bends (the
    standard's "acute angle between the tangents to the wheel trajectory at the point where it abruptly changes
    direction").
    """
    if not np.isfinite(table.height[1]).any():
        bend = int(np.argmin(table.height[0]))
        return float(table.slope[0].max() - table.slope[0].min()), float(table.x[bend]), float(table.stiffness[0, bend])
    if not len(table.transfers):
        raise ValueError(
            f"a rigid wheel never changes body between x = {table.x[0] * 1e3:.0f} and {table.x[-1] * 1e3:.0f} mm: give"
            " dip_angle"
        )
    transfer = float(table.transfers[0])
    before, after = (
        (table.x > transfer - BESIDE) & (table.x < transfer),
        (table.x > transfer) & (table.x < transfer + BESIDE),
    )
    dip = float(table.slope[1, after].max() - table.slope[0, before].min())
    return dip, transfer, float(table.stiffness[1, table.nearest([transfer])[0]])


def limit_flags(force: float) -> list[Flag]:
    """Limits of the standard that the force exceeds."""
    return [
        flag("P2 limit", f"{force / 1e3:.1f} kN is above the standard's {limit / 1e3:.0f} kN for a {vehicle}")
        for vehicle, limit in P2_LIMITS.items()
        if force > limit
    ]
