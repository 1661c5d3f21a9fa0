"""Where a light model leaves the ground it stands on: flags with the reason and the number, from what the model itself
found.

A flag is {"what", "reason", "where"}: plain values, so that a result file carries them.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from geometry.surfaces.bodies import BODIES
from rail_fem.contact.contact_table import ContactTable
from rail_fem.passes.p2 import DIP_LIMIT
from rail_fem.passes.vertical_pass import LightPass
from rail_fem.result.result import PatchSummary
from rail_fem.scene.crossing import JOINT
from rail_fem.scene.scene import Scene

# largest Hertz pressure over yield stress at first yield below a point contact (Johnson 1985, section 6.1)
FIRST_YIELD = 1.6
# middle of the intersection off the contact point, over its half-width, beyond which Hertz' patch is a guess
MOST_ASYMMETRY = 0.25
LARGEST_SHARE = 0.3  # of a patch's semi-axis in the smallest radius, beyond which a half-space is none
SUDDEN = 0.5  # share of the lumped constant that the true one may differ by
MOST_APPROACH = 0.1  # share by which a law's approach may differ from that of the gap solved under a pass' force

Flag = dict[str, str]


class SolvedContact(NamedTuple):
    """A contact under a force [N] that a pass found: elastic approach [m] by the pass' law there, and of the gap solved
    under this force."""

    body: str
    x: float
    force: float
    of_law: float
    solved: float


def flag(what: str, reason: str, where: str = "") -> Flag:
    """What is doubtful, why and with which numbers, where along the path."""
    return {"what": what, "reason": reason, "where": where}


def flag_warnings(flags: list[Flag]) -> tuple[str, ...]:
    """Flags as sentences, for a result's warnings."""
    return tuple(f"{f['what']}: {f['reason']}" + (f" ({f['where']})" if f["where"] else "") for f in flags)


def p2_flags(scene: Scene, dip: float) -> list[Flag]:
    """What the standard's formula leaves out in this scene."""
    flags = []
    if scene.direction == "trailing":
        flags.append(
            flag("trailing", "the formula is for the wheel that meets the nose; it knows no direction of travel")
        )
    if not dip > 0:
        flags.append(
            flag(
                "no dip",
                f"dip angle {dip * 1e3:.3g} mrad: the path does not rise at the transfer, the formula has no impact"
                " there",
            )
        )
    if dip > DIP_LIMIT * 1.001:  # read off a path, to less than a thousandth
        flags.append(
            flag(
                "dip limit",
                f"dip angle {dip * 1e3:.3g} mrad is above the standard's {DIP_LIMIT * 1e3:g} mrad for a P8 wheel",
            )
        )
    if scene.crossing.family != JOINT:  # the formula's own scene
        flags.append(
            flag(
                "one impact",
                "the formula sees the transfer only: not, on a crossing, the leg, where the thesis' FE has its largest"
                " force",
            )
        )
    return flags


def lift_flags(lifts: tuple[int, float]) -> list[Flag]:
    """Of a wheel that leaves the rail. lifts : how often, and for how long in all [s]"""
    count, duration = lifts
    return (
        [
            flag(
                "lift-off",
                f"the wheel lifts off {count} time(s), {duration * 1e3:.3g} ms in all: where it lands depends on all"
                " that went before",
            )
        ]
        if count
        else []
    )


def lumped_flags(
    scene: Scene, table: ContactTable, run: LightPass, constant: float, lifts: tuple[int, float]
) -> list[Flag]:
    """One contact of one stiffness for a passage over two bodies."""
    flags = lift_flags(lifts)
    near = table.nearest(run.x)
    carrier = np.argmax(table.height[:, near], axis=0)
    true = table.stiffness[carrier, near]
    loaded = run.force.sum(axis=0) > 0.1 * scene.static_wheel_load
    off = np.where(loaded, np.abs(true / constant - 1), 0.0)
    if off.max() > SUDDEN:
        i = int(np.argmax(off))
        flags.append(
            flag(
                "contact stiffness",
                f"Hertz constant {true[i]:.3g} N/m^1.5 of the true surfaces against {constant:.3g} taken",
                f"x = {run.x[i] * 1e3:.0f} mm",
            )
        )
    if len(table.transfers):
        flags.append(
            flag(
                "two bodies",
                "wing and nose are one path here: no sharing of the load",
                f"x = {table.transfers[0] * 1e3:.0f} mm",
            )
        )
    return flags


def hertz_flags(
    scene: Scene, table: ContactTable, run: LightPass, patches: tuple[PatchSummary, ...], lifts: tuple[int, float]
) -> list[Flag]:
    """Plastic flow, edges and conforming patches where a contact carries."""
    flags = lift_flags(lifts)
    near = table.nearest(run.x)
    steels = {"wing": scene.materials.wing.steel(), "nose": scene.materials.nose.steel()}
    for b, body in enumerate(BODIES):
        loaded = run.force[b] > 0.1 * scene.static_wheel_load
        if not loaded.any():
            continue
        asymmetry = np.where(loaded, table.asymmetry[b, near], 0.0)
        if asymmetry.max() > MOST_ASYMMETRY:
            i = int(np.argmax(asymmetry))
            share = float((asymmetry > MOST_ASYMMETRY).sum() / loaded.sum())
            flags.append(
                flag(
                    "edge",
                    f"{body}: the contact lies beside the middle of its patch on {share:.0%} of the loaded path, by up"
                    f" to {asymmetry[i]:.0%} of the half-width: Hertz' patch and pressure are a guess",
                    f"x = {run.x[i] * 1e3:.0f} mm",
                )
            )
        flags += _plastic(body, steels[body], patches)
        flags += _conformal(body, table, patches)
    return flags


def bem_flags(scene: Scene, patches: tuple[PatchSummary, ...], lifts: tuple[int, float]) -> list[Flag]:
    """Plastic flow, and that a half-space knows no edge."""
    flags = lift_flags(lifts)
    for body, steel in (("wing", scene.materials.wing.steel()), ("nose", scene.materials.nose.steel())):
        if any(p.region == body for p in patches):
            flags += _plastic(body, steel, patches)
    flags.append(
        flag(
            "edges",
            "the half-space goes on beyond the running edges of wing and nose: near them true contacts are softer and"
            " pressures higher",
        )
    )
    return flags


def law_flags(contacts: Sequence[SolvedContact], load: float) -> list[Flag]:
    """Bodies on which the law, solved under `load` [N], is not that of the gap under the pass' own forces: one flag a
    body, of its largest force that is so."""
    off = [c for c in contacts if c.force > load and abs(c.of_law / c.solved - 1) > MOST_APPROACH]
    worst = [max(mine, key=lambda c: c.force) for body in BODIES if (mine := [c for c in off if c.body == body])]
    return [
        flag(
            "contact law",
            f"{c.body}: under {c.force / 1e3:.0f} kN the gap gives way by {c.solved * 1e6:.0f} um, the law through"
            f" {load / 1e3:.0f} kN by {c.of_law * 1e6:.0f} um: the force is too"
            f" {'large' if c.of_law < c.solved else 'small'}",
            f"x = {c.x * 1e3:.0f} mm",
        )
        for c in worst
    ]


def _plastic(body: str, steel, patches: tuple[PatchSummary, ...]) -> list[Flag]:
    mine = [p for p in patches if p.region == body]
    worst = max(mine, key=lambda p: p.max_pressure)
    limit = FIRST_YIELD * float(steel.yield_stress(np.array(0.0)))
    if worst.max_pressure <= limit:
        return []
    return [
        flag(
            "plastic",
            f"{body}: elastic pressure {worst.max_pressure / 1e6:.0f} MPa is {worst.max_pressure / limit:.2g} times"
            " that of first yield: true pressure is less, true patch larger, the contact softer",
            f"x = {worst.x * 1e3:.0f} mm",
        )
    ]


def _conformal(body: str, table: ContactTable, patches: tuple[PatchSummary, ...]) -> list[Flag]:
    b = BODIES.index(body)
    mine = [p for p in patches if p.region == body]
    shares = [
        (max(p.length / 2 / table.radii[b, i, 0], p.width / 2 / table.radii[b, i, 1]), p)
        for p in mine
        for i in table.nearest([p.x])
    ]
    share, patch = max(shares, key=lambda pair: pair[0])
    if share <= LARGEST_SHARE:
        return []
    return [
        flag(
            "not a half-space",
            f"{body}: the patch's semi-axis is {share:.0%} of the relative radius: its surroundings are no half-space",
            f"x = {patch.x * 1e3:.0f} mm",
        )
    ]
