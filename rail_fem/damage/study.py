"""A damage study from a checked case to its folder: blocks of passes, restart files, results, figures, the asset page.

What a folder holds: case.json (which study), state.npz (restart file of a section that wears), damage.json and
damage.npz (results, SI), profile_before.txt and profile_after.txt (mm), report.md, figures/.
"""

from __future__ import annotations

import json
import time
from collections.abc import Callable
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import numpy as np

from geometry.profiles.formats.by_suffix import write_profile
from rail_fem.atomic import write_atomically, write_text_atomically
from rail_fem.case.casefile import Case
from rail_fem.damage.drivers import sensitivities
from rail_fem.damage.evolution import Evolution, begin, evolve
from rail_fem.damage.figures import crossing_figures, section_figures
from rail_fem.damage.report import crossing_report, section_report
from rail_fem.damage.sites import (
    common_grid,
    crossing_passes,
    field_of,
    laws_of,
    mean_field,
    stepping_of,
    switch_section,
    traffic_of,
)
from rail_fem.damage.summary import crossing_summary, section_summary
from rail_fem.damage.worn_profile import WornProfile
from rail_fem.output.progress import Progress
from rail_fem.output.runfolder import digest, held, prepare_folder
from rail_fem.output.sealed import read_sealed, write_sealed
from rail_fem.scene.scene import Scene
from rail_fem.settings.damage import MOST_PASSES, DamageSettings

STATE, RESULT, ARRAYS, REPORT = "state.npz", "damage.json", "damage.npz", "report.md"
VERSION = 1


class StudyError(ValueError):
    """A study that cannot be done as asked; the message says what to do."""


class PassProgress(Progress):
    """Reports of a study, which counts passes in place of seconds."""

    def line(self) -> str:
        status = self.status
        eta = "unknown" if status["eta"] is None else f"{status['eta']:.0f} s"
        return f"{status['percent']:5.1f} %  block {status['step']}  {status['time']:.6g} passes  eta {eta}"

    def _open_bar(self) -> None:  # a bar of rich speaks of energies
        self._bar = None


def study_mark(scene: Scene, settings: DamageSettings) -> dict[str, Any]:
    """What must agree for a restart."""
    return {"study": "damage", "version": VERSION, "scene": scene.plain(), "damage": settings.model_dump(mode="json")}


def run_study(
    case: Case, passes: float | None, folder: Path, restart: bool, overwrite: bool, say: Callable[[str], None]
) -> None:
    """Do the study of a case in `folder`. Errors: StudyError, RunFolderError, WearError, OSError."""
    if case.damage is None:
        raise StudyError(f'{case.path}: has no table [damage]; write one, e.g.\n[damage]\nhardness = "2.8 GPa"')
    settings = case.damage if passes is None else case.damage.replace(passes=passes)
    mark = study_mark(case.scene, settings)
    with held(folder):
        goes_on = prepare_folder(folder, mark, restart, overwrite)
        case.scene.keep_files(folder)
        if goes_on and (folder / REPORT).is_file():
            say(f"{folder}: finished already; --overwrite begins again")
            return
        with PassProgress(folder, title=case.title) as progress:
            if settings.site == "switch":
                _wear_section(case, settings, folder, goes_on, digest(mark), progress, say)
            else:
                _wear_crossing(case, settings, folder, progress, say)
    say((folder / REPORT).read_text(encoding="utf-8"))


def _wear_section(case, settings, folder, goes_on, identity, progress, say) -> None:
    section = switch_section(case.scene, settings)
    state = _read_state(folder / STATE, identity, section) if goes_on and (folder / STATE).is_file() else begin(section)
    if state.passes:
        say(f"going on after {state.passes:.6g} passes")
    before = replace(section, positions={}).rate(state.first)  # positions found here are not the study's
    blocks = len(state.log)
    for reached in evolve(section, settings.passes, stepping_of(settings), state):
        state, blocks = reached, blocks + 1
        _write_state(folder / STATE, state, identity)
        progress.update(blocks, state.passes, settings.passes)
    section.start_from(state.starts)
    after = section.rate(state.worn)
    summary = section_summary(case.scene, settings, section, state, before, after)
    for name, profile in (("before", state.first), ("after", state.worn)):
        write_profile(folder / f"profile_{name}.txt", profile.profile.points, "rail", f"{profile.label}, {name} wear")
    _write_results(folder, summary, _arrays(state))
    section_figures(folder / "figures", case.title, settings, section, state, before, after)
    write_text_atomically(folder / REPORT, section_report(case.title, settings, summary))


def _wear_crossing(case, settings, folder, progress, say) -> None:
    run = case.runs.get("rigid_hertz")
    kinds = len(traffic_of(case.scene, settings)) * (5 if settings.lateral_scatter else 1)
    fields_found, kept, grid, started = [], [], None, time.process_time()
    for k, (share, result, contacts) in enumerate(crossing_passes(case.scene, settings, run)):
        grid = common_grid(case.scene, result, settings) if grid is None else grid
        fields_found.append((share, field_of(contacts, settings, grid)))
        kept.append((share, result, contacts))
        progress.update(k + 1, (k + 1) / kinds * settings.passes, settings.passes)
    field = mean_field(fields_found)
    say(f"{kinds} kind(s) of pass in {time.process_time() - started:.2f} s of one core")
    summary = crossing_summary(case.scene, settings, field, kept)
    if settings.sensitivities:
        found = sensitivities(case.scene, settings, run)
        summary["sensitivities"] = [[s.name, s.base, s.elasticity, s.error] for s in found]
    arrays = {"x": field.x, "y": field.y}
    arrays |= {f"depth_{law}_{body}": v for law, parts in field.depth.items() for body, v in parts.items()}
    _write_results(folder, summary, arrays)
    crossing_figures(folder / "figures", case.title, settings, field, kept, laws_of(settings))
    write_text_atomically(folder / REPORT, crossing_report(case.title, settings, summary))


def _write_results(folder: Path, summary: dict[str, Any], arrays: dict[str, np.ndarray]) -> None:
    def write(path: Path) -> None:
        with path.open("wb") as stream:
            np.savez_compressed(stream, **arrays)

    write_atomically(folder / ARRAYS, write)
    write_text_atomically(folder / RESULT, json.dumps(_plain(summary), indent=1, allow_nan=False) + "\n")


def _plain(value: Any) -> Any:
    if isinstance(value, dict):
        return {str(k): _plain(v) for k, v in value.items()}
    if isinstance(value, (list, tuple, np.ndarray)):
        return [_plain(v) for v in value]
    if isinstance(value, (float, np.floating)):
        return float(value) if np.isfinite(value) else None
    return value.item() if isinstance(value, np.generic) else value


def _arrays(state: Evolution) -> dict[str, np.ndarray]:
    """Everything that a state holds, by name."""
    arrays = {"points": state.worn.points, "first_points": state.first.points, "corners": state.worn.corners}
    arrays |= {f"by_law_{name}": depth for name, depth in state.by_law.items()}
    plain = [f.name for f in fields(Evolution) if f.name not in ("worn", "first", "by_law")]
    return arrays | {name: np.asarray(getattr(state, name)) for name in plain}


def _write_state(path: Path, state: Evolution, identity: str) -> None:
    write_sealed(path, _arrays(state), {"case": identity})


def _read_state(path: Path, identity: str, section) -> Evolution:
    stored, _ = read_sealed(path, {"case": identity}, "begin again with --overwrite")
    section.start_from(stored["starts"])
    label, corners = section.track.left.label, stored["corners"]
    profiles = [WornProfile(stored[name], corners, label) for name in ("points", "first_points")]
    by_law = {name: stored[f"by_law_{name}"] for name in section.laws}
    plain = {f.name: stored[f.name] for f in fields(Evolution) if f.name not in ("worn", "first", "by_law")}
    plain = {name: value if value.ndim else float(value) for name, value in plain.items()}
    return Evolution(worn=profiles[0], first=profiles[1], by_law=by_law, **plain)


def passes_of(text: str) -> float:
    """--passes as a number. Errors: StudyError."""
    try:
        value = float(text.replace(" ", ""))
    except ValueError:
        raise StudyError(f"--passes {text}: not a number; write e.g. 2000 or 1e6") from None
    if not 0 <= value <= MOST_PASSES:
        raise StudyError(
            f"--passes {text}: give 0 to {MOST_PASSES:g}; more passes than that wear through every rail known: do them"
            " in studies between grindings"
        )
    return value
