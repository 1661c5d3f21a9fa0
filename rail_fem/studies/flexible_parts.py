"""Study: what a wheel's own modes and a beam on bearers change in the reference pass.

    rail-fem study flexible-parts --out flexible      tables, and receptances as a figure

The reference pass (worn P8, 1:10.75, 75 mph, facing) by rigid_hertz. Wheels: a rigid one, the default
[scene.wheel_body] and others, modes up to several frequencies. Track: the foundation of today (a mass on a spring and a
damper) and beams on bearers of the same static stiffness under x = 360 mm, where the wheel comes to the nose.
"""

from collections.abc import Mapping
from copy import deepcopy
from pathlib import Path
from typing import Any

import numpy as np
import typer
from matplotlib.figure import Figure
from scipy.optimize import brentq

from rail_fem.case.casefile import Case, load_case
from rail_fem.case.examples import example
from rail_fem.light.track_beam import track_beam
from rail_fem.light.wheel_modes import modes_of, receptance
from rail_fem.models import rigid_hertz
from rail_fem.output.low_pass import filtered_peak
from rail_fem.output.markdown import markdown_table
from rail_fem.output.result import PassResult
from rail_fem.scene.scene import Scene
from rail_fem.settings.light import RigidHertzSettings
from rail_fem.show.style import GREEN, GREY, NOSE, PURPLE, TOTAL, WING, new_figure
from rail_fem.show.table_and_figure import write_table_and_figure
from rail_fem.sweeps.compare import history_error

WINDOW = {"start": "95 mm", "end": "660 mm"}
IMPACT = 0.36  # where stiffnesses are made equal [m]
BODY = "scene.wheel_body"
MODES = "run.rigid_hertz.wheel_modes"
WHEELS: dict[str, dict[str, Any]] = {
    "rigid": {},
    "default body, modes to 2 kHz": {BODY: {}, MODES: "2 kHz"},
    "default body, modes to 5 kHz": {BODY: {}},
    "default body, modes to 10 kHz": {BODY: {}, MODES: "10 kHz"},
    "web of 18 mm": {BODY: {"web_thickness": "18 mm"}},
    "straight web": {BODY: {"web_offset": "0 mm"}},
    "web led 60 mm aside": {BODY: {"web_offset": "-60 mm"}},
    "damping of 2 %": {BODY: {"damping_ratio": 0.02}},
}
BEARERS = {
    "spacing": "600 mm",
    "position": "60 mm",
    "pad_stiffness": "200 kN/mm",
    "pad_damping": "30 kN s/m",
    "mass": "150 kg",
    "ballast_stiffness": "60 kN/mm",
    "ballast_damping": "60 kN s/m",
}
CASTING = {
    "start": "-800 mm",
    "end": "2200 mm",
    "second_moment": "7000 cm^4",
    "mass": "200 kg/m",
    "foot_depth": "80 mm",
}
TRACKS: dict[str, dict[str, Any]] = {
    "rail, the nose over a bearer": {"position": "360 mm"},
    "rail, the nose between bearers": {},
    "casting, the nose over a bearer": {"position": "360 mm", "casting": CASTING},
    "casting, the nose between bearers": {"casting": CASTING},
    "the same, pads of 1000 kN/mm": {"casting": CASTING, "pad_stiffness": "1000 kN/mm"},
    "the same, pads of 60 kN/mm": {"casting": CASTING, "pad_stiffness": "60 kN/mm"},
    "the same, bearers of 300 kg": {"casting": CASTING, "mass": "300 kg"},
}
HEAD = (
    "impact on the wheel [kN]",
    "largest on the wing [kN]",
    "largest force [kN]",
    "at 500 Hz [kN]",
    "P2 [kN]",
    "history, L2",
)


def case_of(changes: Mapping[str, Any]) -> Case:
    """The reference pass by rigid_hertz alone, which takes flexible parts, with changes. Errors: CaseError."""
    return load_case(example("nose_transfer"), {"run": {"rigid_hertz": dict(WINDOW)}, **deepcopy(dict(changes))})


def run(case: Case) -> PassResult:
    """The case by rigid_hertz."""
    return rigid_hertz.solve(case.scene, case.settings(RigidHertzSettings))


def cells(result: PassResult, reference: PassResult) -> list[str]:
    """Of HEAD; P2: the largest force of the track on its spring, or of all bearers on the ballast."""
    force = lambda name: f"{result.peaks[name].value / 1e3:.1f}"
    filtered = filtered_peak(result, 500.0)
    return [
        *(force(name) for name in ("impact_on_wheel", "largest_force_wing", "largest_force")),
        "-" if filtered is None else f"{filtered.value / 1e3:.1f}",
        force("force_foundation"),
        "-" if result is reference else f"{history_error(result, reference):.1%}",
    ]


def static_stiffness(scene: Scene) -> float:
    """Of the track under IMPACT [N/m]."""
    if scene.bearers is None:
        return scene.foundation.stiffness
    beam = track_beam(scene.bearers, IMPACT - 1.0, IMPACT + 1.0, 0.1, 9.0)
    share = beam.force_at(IMPACT)
    return float(1 / (share @ beam.static(share)))


def equally_stiff(changes: Mapping[str, Any], stiffness: float) -> dict[str, Any]:
    """[scene.bearers] with the ballast that makes the track as stiff as asked for [N/m]. Errors: ValueError where no
    ballast does."""
    with_ballast = lambda ballast: {**BEARERS, **changes, "ballast_stiffness": f"{ballast / 1e6:.6g} kN/mm"}
    excess = lambda log: static_stiffness(case_of({"scene.bearers": with_ballast(np.exp(log))}).scene) / stiffness - 1
    return with_ballast(float(np.exp(brentq(excess, np.log(2e6), np.log(2e10), xtol=1e-7))))


def wheel_table(results: Mapping[str, PassResult]) -> list[str]:
    """A row for each wheel: its first modes, what it weighs, and what the pass does."""
    rows, reference = [], results["rigid"]
    for name, result in results.items():
        modes = modes_of(result.scene, result.settings["wheel_modes"])
        own = ["-", "-", "-"]
        if modes is not None:
            soft = [f"{modes.frequency[k]:.0f} ({modes.harmonic[k]})" for k in np.argsort(modes.frequency)[:3]]
            own = [f"{modes.wheel_mass:.0f}", str(len(modes.mass)), ", ".join(soft)]
        rows.append([name, *own, *cells(result, reference)])
    head = ["wheel", "its mass [kg]", "modes", "lowest of them [Hz] (waves around)", *HEAD]
    return markdown_table(head, rows)


def track_table(results: Mapping[str, PassResult]) -> list[str]:
    """A row for each track."""
    rows, reference = [], next(iter(results.values()))
    for name, result in results.items():
        bearers = result.scene.bearers
        ballast = "-" if bearers is None else f"{bearers.ballast_stiffness / 1e6:.1f}"
        stress = result.peaks["foot_stress"].value / 1e6 if "foot_stress" in result.peaks else np.nan
        own = [name, f"{static_stiffness(result.scene) / 1e6:.1f}", ballast]
        rows.append([*own, *cells(result, reference), "-" if np.isnan(stress) else f"{stress:.0f}"])
    head = ["track", "stiffness [kN/mm]", "ballast [kN/mm]", *HEAD, "foot stress [MPa]"]
    return markdown_table(head, rows)


def figure(wheels: Mapping[str, PassResult], tracks: Mapping[str, PassResult]) -> Figure:
    """Above: receptances of wheel, track and contact; below: the force of the pass."""
    drawn = new_figure(10.5)
    above, below = drawn.subplots(2, 1)
    frequency = np.geomspace(20, 5000, 1500)
    soft, rigid = wheels["default body, modes to 5 kHz"], wheels["rigid"]
    scene, unsprung = soft.scene, soft.scene.vehicle.wheel_unsprung_mass
    damping = 1e-3 if scene.wheel_body is None else scene.wheel_body.damping_ratio
    drawn_at = (
        (0.0, TOTAL, "at the tread datum"),
        (-0.025, NOSE, "25 mm to the flange"),
        (0.03, WING, "30 mm outside"),
    )
    for contact, colour, words in drawn_at:
        own = np.abs(receptance(modes_of(scene, 1e4, contact), unsprung, damping, frequency))
        above.loglog(frequency, own * 1e9, color=colour, lw=1.6, label=f"wheel, {words}")
    above.loglog(
        frequency, np.abs(receptance(None, unsprung, damping, frequency)) * 1e9, "--", color=GREY, label="rigid"
    )
    foundation, omega = rigid.scene.foundation, 2 * np.pi * frequency
    track = 1 / (foundation.stiffness - omega**2 * foundation.track_mass + 1j * omega * foundation.damping)
    above.loglog(frequency, np.abs(track) * 1e9, color=GREEN, lw=1.6, label="track: mass, spring, damper")
    name = "casting, the nose between bearers"
    bearers = tracks[name].scene.bearers
    if bearers is not None:
        beam = track_beam(bearers, IMPACT - 1.0, IMPACT + 1.0, 0.1, 9.0)
        above.loglog(
            frequency,
            np.abs(beam.receptance(IMPACT, frequency)) * 1e9,
            color=PURPLE,
            lw=1.6,
            label="casting on bearers",
        )
    above.axhline(1e9 / 1.5e9, color=GREY, ls=":", label="contact, about 1.5 GN/m")
    above.set(xlabel="frequency [Hz]", ylabel="height per force [nm/N]", ylim=(1e-2, 1e3))
    above.legend(ncols=2, fontsize=9)
    drawn_passes = (
        ("rigid wheel, track mass", rigid, GREY),
        ("wheel with modes", soft, TOTAL),
        (name, tracks[name], PURPLE),
    )
    for words, result, colour in drawn_passes:
        below.plot(1e3 * result.history["x"], result.history["force"] / 1e3, color=colour, lw=1.4, label=words)
    below.set(xlabel="position x of the wheel [mm]", ylabel="force on the wheel [kN]", xlim=(250, 660))
    below.legend()
    drawn.suptitle("Reference pass by rigid_hertz: vibrating wheel, casting on bearers", fontsize=14)
    return drawn


def main(out: Path = typer.Option(Path("flexible_parts"), help="folder of flexible_parts.md and .png")) -> None:
    """What a wheel's modes and a beam on bearers change in the reference pass."""
    wheels = {name: run(case_of(changes)) for name, changes in WHEELS.items()}
    reference = wheels["rigid"]
    stiffness = reference.scene.foundation.stiffness
    tracks = {"mass on a spring and a damper": reference}
    for name, changes in TRACKS.items():
        tracks[name] = run(case_of({"scene.bearers": equally_stiff(changes, stiffness)}))
    both = case_of({BODY: {}, "scene.bearers": equally_stiff(TRACKS["casting, the nose between bearers"], stiffness)})
    tracks["casting between bearers and a wheel with modes"] = run(both)
    text = "\n".join([*wheel_table(wheels), "", *track_table(tracks)])
    typer.echo(text)
    write_table_and_figure(out / "flexible_parts.md", text, out / "flexible_parts.png", lambda: figure(wheels, tracks))


if __name__ == "__main__":
    typer.run(main)
