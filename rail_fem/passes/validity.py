"""Where a light model leaves the ground it stands on: flags with the reason and the number, from what the model itself
found.

A flag is {"what", "reason", "where"}: plain values, so that a result file carries them.
"""

from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from geometry.surfaces.bodies import BODIES
from rail_fem.contact.contact_table import ContactTable
from rail_fem.passes.p2 import DIP_LIMIT
from rail_fem.passes.vertical_pass import LightPass
from rail_fem.result.events import lost_contact, way_over
from rail_fem.result.result import PatchSummary
from rail_fem.scene.crossing import JOINT
from rail_fem.scene.scene import Scene

# largest Hertz pressure over yield stress at first yield below a point contact (Johnson 1985, section 6.1)
FIRST_YIELD = 1.6
# middle of the intersection off the contact point, over its half-width, beyond which Hertz' patch is a guess
MOST_ASYMMETRY = 0.25
LOADED = 0.1  # of the static load, from which a contact's patch is judged
LARGEST_SHARE = 0.3  # of a patch's semi-axis in the smallest radius, beyond which a half-space is none
SUDDEN = 0.5  # share of the lumped constant that the true one may differ by
MOST_ERROR = 0.05  # of the force history by one setting
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


def flag(what: str, reason: str, x: float | None = None) -> Flag:
    """What is doubtful, why and with which numbers, where along the path [m]."""
    return {"what": what, "reason": reason, "where": "" if x is None else f"x = {x * 1e3:.0f} mm"}


def flag_warnings(flags: Sequence[Flag]) -> tuple[str, ...]:
    """Flags as sentences, for a result's warnings."""
    return tuple(f"{f['what']}: {f['reason']}" + (f" ({f['where']})" if f["where"] else "") for f in flags)


def step_flags(errors: Mapping[str, float]) -> Iterator[Flag]:
    """Settings that are too coarse, by the relative errors that a pass claims."""
    for name in ("time_step", "path_spacing", "beam_element"):
        if (error := errors.get(name, 0.0)) > MOST_ERROR:
            yield flag(name, f"moves forces by some {error:.0%}, more than {MOST_ERROR:.0%}: take a smaller one")


def p2_flags(scene: Scene, dip: float) -> Iterator[Flag]:
    """What the standard's formula leaves out in this scene."""
    told = f"dip angle {dip * 1e3:.3g} mrad"
    joint = scene.crossing.family == JOINT  # the formula's own scene, the same in both directions
    if scene.direction == "trailing" and not joint:
        yield flag("trailing", "the formula is for the wheel that meets the nose; it knows no direction of travel")
    if not dip > 0:
        yield flag("no dip", f"{told}: the path does not rise at the transfer, the formula has no impact there")
    if dip > DIP_LIMIT * 1.001:  # read off a path, to less than a thousandth
        yield flag("dip limit", f"{told} is above the standard's {DIP_LIMIT * 1e3:g} mrad for a P8 wheel")
    if not joint:
        yield flag(
            "one impact",
            "the formula sees the transfer only: not, on a crossing, the leg, where the thesis' FE has its largest"
            " force",
        )


def lift_flags(history: Mapping[str, np.ndarray], static_load: float) -> Iterator[Flag]:
    """Of a wheel that leaves the rail: how often, and for how long in all, as tables and figures of its history say."""
    lost = lost_contact(history["time"], history["x"], history["force"], static_load)
    duration = sum(loss.end - loss.start for loss in lost)
    if lost:
        yield flag(
            "lift-off",
            f"the wheel lifts off {len(lost)} time(s), {duration * 1e3:.3g} ms in all: where it lands depends on all"
            " that went before",
        )


def window_flags(scene: Scene, run: LightPass, changes: bool) -> Iterator[Flag]:
    """Of a pass over wing and nose on whose path the wheel does not change body (`changes`)."""
    if scene.crossing.family != JOINT and not changes:
        yield flag(
            "no transfer",
            f"between x = {run.x[0] * 1e3:.0f} and {run.x[-1] * 1e3:.0f} mm the wheel does not go over from"
            f" {way_over(scene.direction_sign)}: no impact of a transfer is in this pass, see start and end",
        )


def lumped_flags(scene: Scene, table: ContactTable, run: LightPass, constant: float) -> Iterator[Flag]:
    """One contact of one stiffness for a passage over two bodies."""
    near = table.nearest(run.x)
    carrier = np.argmax(table.height[:, near], axis=0)
    true = table.stiffness[carrier, near]
    loaded = run.force.sum(axis=0) > LOADED * scene.static_wheel_load
    off = np.where(loaded, np.abs(true / constant - 1), 0.0)
    if off.max() > SUDDEN:
        i = int(np.argmax(off))
        words = f"Hertz constant {true[i]:.3g} N/m^1.5 of the true surfaces against {constant:.3g} taken"
        yield flag("contact stiffness", words, run.x[i])
    if len(table.transfers):
        yield flag("two bodies", "wing and nose are one path here: no sharing of the load", table.transfers[0])


def hertz_flags(scene: Scene, table: ContactTable, run: LightPass, patches: tuple[PatchSummary, ...]) -> Iterator[Flag]:
    """Plastic flow, edges and conforming patches where a contact carries."""
    near = table.nearest(run.x)
    for b, body in enumerate(BODIES):
        loaded = run.force[b] > LOADED * scene.static_wheel_load
        if not loaded.any():
            continue
        asymmetry = np.where(loaded, table.asymmetry[b, near], 0.0)
        if asymmetry.max() > MOST_ASYMMETRY:
            i = int(np.argmax(asymmetry))
            share = float((asymmetry > MOST_ASYMMETRY).sum() / loaded.sum())
            yield flag(
                "edge",
                f"{body}: the contact lies beside the middle of its patch on {share:.0%} of the loaded path, by up to"
                f" {asymmetry[i]:.0%} of the half-width: Hertz' patch and pressure are a guess",
                run.x[i],
            )
        yield from _plastic(scene, body, patches)
        yield from _conformal(body, table, patches)


def bem_flags(scene: Scene, patches: tuple[PatchSummary, ...]) -> Iterator[Flag]:
    """Plastic flow, and that a half-space knows no edge."""
    for body in BODIES:
        if any(p.region == body for p in patches):
            yield from _plastic(scene, body, patches)
    yield flag(
        "edges",
        "the half-space goes on beyond the running edges of wing and nose: near them true contacts are softer and"
        " pressures higher",
    )


def law_flags(contacts: Sequence[SolvedContact], load: float) -> Iterator[Flag]:
    """Bodies on which the law, solved under `load` [N], is not that of the gap under the pass' own forces: one flag a
    body, of its largest force that is so."""
    off = [c for c in contacts if c.force > load and abs(c.of_law / c.solved - 1) > MOST_APPROACH]
    for c in (max(mine, key=lambda c: c.force) for body in BODIES if (mine := [c for c in off if c.body == body])):
        yield flag(
            "contact law",
            f"{c.body}: under {c.force / 1e3:.0f} kN the gap gives way by {c.solved * 1e6:.0f} um, the law through"
            f" {load / 1e3:.0f} kN by {c.of_law * 1e6:.0f} um: the force is too"
            f" {'large' if c.of_law < c.solved else 'small'}",
            c.x,
        )


def _plastic(scene: Scene, body: str, patches: tuple[PatchSummary, ...]) -> Iterator[Flag]:
    worst = max((p for p in patches if p.region == body), key=lambda p: p.max_pressure)
    limit = FIRST_YIELD * float(getattr(scene.materials, body).steel().yield_stress(np.array(0.0)))
    if worst.max_pressure > limit:
        yield flag(
            "plastic",
            f"{body}: elastic pressure {worst.max_pressure / 1e6:.0f} MPa is {worst.max_pressure / limit:.2g} times"
            " that of first yield: true pressure is less, true patch larger, the contact softer",
            worst.x,
        )


def _conformal(body: str, table: ContactTable, patches: tuple[PatchSummary, ...]) -> Iterator[Flag]:
    b = BODIES.index(body)
    shares = [
        (max(p.length / 2 / table.radii[b, i, 0], p.width / 2 / table.radii[b, i, 1]), p)
        for p in patches
        if p.region == body
        for i in table.nearest([p.x])
    ]
    share, patch = max(shares, key=lambda pair: pair[0])
    if share > LARGEST_SHARE:
        yield flag(
            "not a half-space",
            f"{body}: the patch's semi-axis is {share:.0%} of the relative radius: its surroundings are no half-space",
            patch.x,
        )
