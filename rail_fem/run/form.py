"""The bar of form: what a result moves by when a simplification of its model is replaced by the next better one.

Each simplification is a row of SIMPLIFICATIONS. What a light model can see is measured on the scene itself, by a pass
of `rigid_hertz` with it and one without, a second each; what none of them sees is kept from passes of `fe_full`
(cases/rows/form.toml). A light model has a row besides, on a crossing: within what all of its forces are of those of
`fe_full` in the sixteen cases of docs/sixteen_cases.md, over the nose. The bar is the root of the sum of the squares:
the simplifications are not each other's.
Plastic strain, which no light model resolves well enough, has what is kept alone.
"""

import contextlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

from scipy.optimize import brentq

from geometry.axes import RAIL_DEPTH
from rail_fem.hierarchy import MODELS, load
from rail_fem.passes.track_beam import track_beam
from rail_fem.processes.launcher import dealt_out, on_root
from rail_fem.result.events import stated_peaks
from rail_fem.result.quantities import FORCES, REPORTED
from rail_fem.result.result import PassResult
from rail_fem.scene.base import InputError
from rail_fem.scene.bearers import Bearers, CastingSection
from rail_fem.scene.crossing import CAST, JOINT
from rail_fem.scene.scene import Scene
from rail_fem.scene.wheel_body import WheelBody
from rail_fem.settings.light import RigidHertzSettings

ASIDE = 1e-3  # lateral position of the wheelset that nobody knows [m]
HEIGHT = 0.5e-3  # to which a casting's running surfaces are made and kept; an assumption [m]
SPACING = 5e-3  # between searches of the surfaces, alike in all of these passes [m]
# A common panel; none of a published crossing. Halves of bearers under one rail
PANEL = Bearers(pad_stiffness=200e6, pad_damping=30e3, mass=150.0, ballast_stiffness=100e6, ballast_damping=60e3)
CASTING = CastingSection(second_moment=7000e-8, mass=200.0, foot_depth=80e-3, start=-0.8, end=2.2)
BALLAST = 1e6, 1e10  # between which a ballast as stiff as the foundation is looked for [N/m]


@dataclass(frozen=True)
class Simplification:
    """words : what is left out, and what takes its place;  better : scene, x where the wheel changes body [m] -> scenes
    without it, of which the one that moves a quantity most counts; none where the scene has it already"""

    words: str
    better: Callable[[Scene, float], list[Scene]]


def on_bearers(scene: Scene, x: float) -> list[Scene]:
    """The scene on bearers, the transfer between two of them, the track as stiff there as the foundation; none where no
    ballast makes it so."""
    if scene.bearers is not None:
        return []
    panel = PANEL.replace_si(position=(x - PANEL.spacing / 2) % PANEL.spacing)
    if scene.crossing.family == CAST:
        panel = panel.replace_si(casting=CASTING)

    beam = track_beam(panel, x - 1, x + 1, 0.1, 9.0)
    share, own = beam.force_at(x), [bearer.own for bearer in beam.bearers]

    def excess(ballast: float) -> float:
        stiffness = beam.stiffness.copy()
        stiffness[own, 0] = panel.pad_stiffness + ballast
        return 1 / float(share @ replace(beam, stiffness=stiffness).static(share)) - scene.foundation.stiffness

    if not excess(BALLAST[0]) < 0 < excess(BALLAST[1]):
        return []
    return [scene.replace_si(bearers=panel.replace_si(ballast_stiffness=brentq(excess, *BALLAST, rtol=1e-4)))]


def within_range(scene: Scene, *changes: dict[str, Any]) -> list[Scene]:
    """The scene with each of these changes that its keys' ranges allow."""
    found = []
    for change in changes:
        with contextlib.suppress(InputError):
            found.append(scene.replace_si(**change))
    return found


def other_wings(scene: Scene, x: float) -> list[Scene]:
    """The scene with its wing rail HEIGHT lower and higher; none of a crossing without such a key."""
    if scene.crossing.family != CAST:
        return []
    raised = scene.crossing.wing_raise
    return within_range(scene, *({"crossing": {"wing_raise": raised + change}} for change in (-HEIGHT, HEIGHT)))


SIMPLIFICATIONS = (
    Simplification("one mass in place of a casting on bearers", on_bearers),
    Simplification(
        "a rigid wheel in place of one that vibrates",
        lambda scene, x: [] if scene.wheel_body else [scene.replace_si(wheel_body=WheelBody())],
    ),
    Simplification(
        f"a wheelset in the middle in place of {ASIDE * 1e3:g} mm aside",
        lambda scene, x: within_range(scene, *({"gauge": scene.gauge + 2 * side} for side in (-ASIDE, ASIDE))),
    ),
    Simplification(f"a wing rail as drawn in place of {HEIGHT * 1e3:g} mm higher or lower", other_wings),
)
ISOTROPIC = "isotropic"
SEEN = "impact_on_wheel", "first_impact_on_nose", "largest_force", "largest_force_wing", "largest_force_nose"
STRAINS = "block_nose", "integral_nose", "block_wing", "integral_wing"
KNOWN = *SEEN, *STRAINS


@dataclass(frozen=True)
class KeptShare:
    """words : as of a Simplification;  holds : whether it is one of a result;  shares : quantity -> what it moves by,
    relative, by passes of fe_full over the nose on 2 mm (cases/rows/form.toml; depths: the same without a window;
    bearers: cases/rows/bearers.toml, the casting between bearers)"""

    words: str
    holds: Callable[[PassResult], bool]
    shares: Mapping[str, float]


def _may_have_flowed(result: PassResult) -> bool:
    """Whether steel has yielded; of a model that does not resolve it, whether it can have."""
    return not result.metal or any(part["maximum"] > 0 for part in result.metal.values())


KEPT = (
    KeptShare(  # of strain: forces are those of passes
        SIMPLIFICATIONS[0].words,
        lambda result: result.scene.bearers is None,
        dict(zip(STRAINS, (-0.106, -0.144, -0.312, -0.130))),
    ),
    KeptShare(
        "a wheel that does not lean in place of one on its elastic rim and web",
        lambda result: result.scene.wheel_body is None and MODELS[result.model].off is None,
        dict(zip(SEEN, (-0.140, -0.118, -0.169, -0.006, -0.169))),
    ),
    KeptShare(
        "bodies rigid 55 and 60 mm deep in place of 110 and 120 mm",
        lambda result: result.settings.get("rail_depth") == RAIL_DEPTH and not result.settings.get("foot_depth"),
        dict(zip(KNOWN, (-0.022, 0.012, -0.006, -0.012, -0.006, 0.000, 0.009, -0.012, -0.026))),
    ),
    KeptShare(  # of P8 behind gaps of 6, 12 and 20 mm fe_full has 1.41, 1.37 and 1.31 of rigid_hertz' force
        "a rail's end as stiff as its middle in place of one that gives way",
        lambda result: result.scene.crossing.joint_gap > 0 and MODELS[result.model].off is not None,
        dict(zip(SEEN, (0.42, 0.42, 0.42, 0.04, 0.42))),
    ),
    KeptShare(
        "one coefficient of friction in place of 0.2 to 0.4",
        lambda result: 0.2 <= result.scene.friction <= 0.4,
        dict(zip(KNOWN, (0.004, -0.004, -0.003, 0.002, -0.003, -0.030, -0.012, -0.005, -0.006))),
    ),
    KeptShare(
        "isotropic hardening in place of kinematic",
        lambda result: (
            _may_have_flowed(result)
            and all(
                steel.hardening == ISOTROPIC and steel.cyclic is None and not steel.is_elastic
                for steel in result.scene.materials.steels()[:2]
            )
        ),
        dict(zip(KNOWN, (-0.090, -0.068, -0.145, -0.042, -0.145, 0.221, 0.248, 0.168, 0.208))),
    ),
)


def form(result: PassResult, by_passes: bool = True) -> dict[str, dict[str, float]]:
    """Simplification -> reported quantity -> what it moves by [SI]. A row that has nothing to say is left out, and so
    is every row of a scene or window that `rigid_hertz` cannot run.

    by_passes : also what takes passes of `rigid_hertz`, some seconds, shared by the ranks. Collective.
    """
    found = {}
    own = {name: REPORTED[name].of(result) for name in (*FORCES, "transfer_x", *STRAINS)}
    own = {name: value for name, value in own.items() if value == value}
    shares = {kept.words: kept.shares for kept in KEPT if kept.holds(result)}
    if (off := MODELS[result.model].off) and result.scene.crossing.family != JOINT:
        over = off[1]  # of fe_full's force; a model further off than all of it can only lie above
        shares[f"{result.model} in place of fe_full"] = dict.fromkeys(FORCES, over if over < 1 else -over / (1 + over))
    for words, share in shares.items():
        found[words] = {name: share[name] * value for name, value in own.items() if name in share}
    if by_passes and own and result.scene.diverging is None:
        for words, moved in _by_passes(result, own).items():
            found[words] = found.get(words, {}) | moved
    for alike in one_and_the_same(result):
        for row in found.values():
            if moves := [row[name] for name in alike if name in row]:
                row.update(dict.fromkeys(alike, max(moves, key=abs)))
    return {result.scene.crossing.told(words): moved for words, moved in found.items() if moved}


def one_and_the_same(result: PassResult) -> list[list[str]]:
    """Names of forces that are one force at one place, which has one bar: what moves it most. Kept shares go by name,
    and a wing's is that of a calm load beside the nose's impact, where it is the only rail that of the impact."""
    at: dict[tuple[float, float], list[str]] = {}
    for name, peak in stated_peaks(result).items():
        if name in FORCES and peak.x == peak.x:
            at.setdefault((peak.x, peak.value), []).append(name)
    return [names for names in at.values() if len(names) > 1]


def _by_passes(result: PassResult, own: Mapping[str, float]) -> dict[str, dict[str, float]]:
    scene, path = result.scene, result.history["x"]
    if not len(path):  # a formula
        return {}
    window, rigid_hertz = {name: result.settings[name] for name in ("start", "end")}, load("rigid_hertz")

    def run(changed: Scene) -> dict[str, float]:
        """The quantities by a pass; none where there is no pass: a wheel 1 mm aside may leave the crossing."""
        try:
            answer = rigid_hertz.solve(changed, RigidHertzSettings(**window, path_spacing=SPACING), judged=False)
        except ValueError:
            return {}
        return {name: value for name in own if (value := REPORTED[name].of(answer)) == value}

    x = result.transfer_x if result.transfer_x == result.transfer_x else float(path[0] + path[-1]) / 2
    changed = [(row.words, better) for row in SIMPLIFICATIONS for better in row.better(scene, x)]
    answers = dealt_out([partial(run, one) for one in (scene, *(better for _, better in changed))])

    def moved() -> dict[str, dict[str, float]]:
        found: dict[str, dict[str, float]] = {}
        base, *others = answers
        for (words, _), answer in zip(changed, others):
            most = found.setdefault(words, {})
            for name in (name for name in base if name in answer):
                change = answer[name] - base[name]
                if name != "transfer_x":
                    change *= own[name] / base[name]
                most[name] = max(most.get(name, 0.0), change, key=abs)
        return found

    return on_root(moved)
