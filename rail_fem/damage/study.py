"""A damage study from a checked case to its folder: blocks of passes, restart files, results, figures, the asset page.

What a folder holds: case.json (which study), state.npz (restart file), damage.json and
damage.npz (results, SI), profile_before.txt and profile_after.txt of a section (mm), report.md, figures/.
"""

from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import fields, replace
from pathlib import Path
from typing import Any, cast

import numpy as np

from geometry.profiles.formats.by_suffix import write_profile
from rail_fem.case.casefile import Case
from rail_fem.damage.drivers import sensitivities, wheel_ratios
from rail_fem.damage.evolution import Evolution, Site, begin, evolve
from rail_fem.damage.figures import study_figures
from rail_fem.damage.fleet_life import fleet_life
from rail_fem.damage.flow import MODEL, SAME, ExplicitStops, flow_digest, read_flow
from rail_fem.damage.report import study_report
from rail_fem.damage.sites import crossing_site, stepping_of, switch_section, tonnage_of, wheels_of
from rail_fem.damage.summary import summary
from rail_fem.damage.worn_profile import WornOutError
from rail_fem.damage.worn_surface import WornSurface
from rail_fem.files.atomic import write_atomically, write_text_atomically
from rail_fem.files.sealed import read_sealed, write_sealed
from rail_fem.files.strict_json import dumps
from rail_fem.processes.pool import Pool, Workers
from rail_fem.processes.progress import Progress
from rail_fem.result.runfolder import digest, held, prepare_folder
from rail_fem.scene.scene import Wheel
from rail_fem.settings.damage import WHEEL, DamageSettings
from rail_fem.settings.explicit import FeSettings
from rail_fem.settings.light import RigidHertzSettings
from rail_fem.show.style import in_lines

STATE, RESULT, ARRAYS, REPORT = "state.npz", "damage.json", "damage.npz", "report.md"
VERSION = 9  # 9: grooves go on along their line; steel is indented by what is still to flow, and along 4 mm
DEFINITION = (
    "Archard's k is its mean over a cell that a border of the map crosses"  # what a state of before does not hold
)
PLAIN = [f.name for f in fields(Evolution) if f.name not in ("worn", "first", "by_law")]  # numbers of a state


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


def study_mark(case: Case, settings: DamageSettings) -> dict[str, Any]:
    """What must agree for a restart: scene, study, numerics of the passes, also where the case leaves them out."""
    own = {"rigid_hertz": RigidHertzSettings()} if settings.site == "crossing" else {}
    runs = {name: run.model_dump(mode="json") for name, run in (own | dict(case.runs)).items()}
    damage, flow = settings.model_dump(mode="json"), flow_file(case, settings)
    for kind in damage["traffic"]:
        kind["wheel"] = kind["wheel"] and _content(kind["wheel"])
    if damage["fleet"] and (wheels := damage["fleet"]["draw"].get(WHEEL)):
        wheels["of"] = [_content(wheel) for wheel in wheels["of"]]
    if damage["turning"] and damage["turning"]["worn"]:
        damage["turning"]["worn"] = _content(damage["turning"]["worn"])
    mark = {"study": "damage", "version": VERSION, "definition": DEFINITION}
    mark |= {"scene": case.scene.plain(), "damage": damage, "run": runs}
    return mark | ({} if flow is None else {"flow": flow_digest(flow)})


def _content(wheel: str) -> str:
    """A wheel by its name, or by what its file holds."""
    digest = Wheel(profile=wheel).digest
    return f"file of content {digest}" if digest else wheel


def flow_file(case: Case, settings: DamageSettings) -> Path | None:
    """Folder of the run whose plastic flow comes first, relative to the case file."""
    return case.path.parent / settings.flow if settings.flow else None


def run_study(
    case: Case,
    passes: str | float | None,
    folder: Path,
    restart: bool,
    overwrite: bool,
    say: Callable[[str], None],
    workers: Workers = Workers(),
) -> str:
    """Do the study of a case in `folder`; returns what ended it before its last pass, told with all that had worn by
    then, or "". Errors: StudyError, RunFolderError, WearError, OSError, WornOutError in the first block."""
    if case.damage is None:
        raise StudyError('has no table [damage]; write one, e.g.\n[damage]\nhardness = "2.8 GPa"')
    settings = case.damage if passes is None else case.damage.replace(passes=passes)
    if settings.explicit and MODEL not in case.runs:
        raise StudyError(f"damage.explicit: no table [run.{MODEL}] for its passes; write one")
    mark = study_mark(case, settings)
    with held(folder):
        goes_on = prepare_folder(folder, mark, restart, overwrite)
        case.scene.keep_files(folder)
        if goes_on and (folder / REPORT).is_file():
            say(f"{folder}: finished already; --overwrite begins again")
            return ""
        with PassProgress(folder, title=case.title) as progress:
            ended = _study(case, settings, folder, goes_on, digest(mark), progress, say, workers)
    say((folder / REPORT).read_text(encoding="utf-8"))
    return ended


def state_arrays(state: Evolution) -> dict[str, np.ndarray]:
    """Everything that a state holds, by name, for restarts and for who reads results."""
    arrays = _shape_arrays(state) | {f"by_law_{name}": depth for name, depth in state.by_law.items()}
    return arrays | {name: np.asarray(getattr(state, name)) for name in PLAIN}


def _shape_arrays(state: Evolution) -> dict[str, np.ndarray]:
    if isinstance(state.worn, WornSurface):
        surface = state.worn
        own = {"x": surface.x, "y": surface.y, "worn_depth": surface.depth, "first_depth": state.first.depth}
        return own if surface.flow is None else own | {"worn_flow": surface.flow, "worn_strain": surface.strain}
    return {"points": state.worn.points, "first_points": state.first.points, "corners": state.worn.corners}


def write_state(path: Path, state: Evolution, identity: str) -> None:
    """In a sealed file, whole or not at all. Errors: OSError."""
    write_sealed(path, state_arrays(state), {"case": identity})


def read_state(path: Path, identity: str, site: Site) -> Evolution:
    """The state of a study with this identity; the site goes on from its starts. Errors: SealError."""
    stored, _ = read_sealed(path, {"case": identity}, "begin again with --overwrite")
    site.start_from(stored["starts"])
    first = site.first()
    names = {"points": "points"} | {f"worn_{name}": name for name in ("depth", "flow", "strain")}
    worn = replace(first, **{name: stored[key] for key, name in names.items() if key in stored})
    by_law = {name: stored[f"by_law_{name}"] for name in site.laws}
    plain = {name: value if (value := stored[name]).ndim else float(value) for name in PLAIN}
    return Evolution(worn=worn, first=first, by_law=by_law, **plain)


def _wear(settings, site, explicit, folder, goes_on, identity, progress, say) -> tuple[Evolution, Any, str]:
    """Through all passes, a restart file after each block; the site as it has flowed by then; and what ended it before
    its last pass, "" where nothing did. Errors: WornOutError in the first block."""
    path = folder / STATE
    state = read_state(path, identity, site) if goes_on and path.is_file() else begin(site)
    if state.passes:
        say(f"going on after {state.passes:.6g} passes")
    blocks = len(state.log)
    for stop, end in enumerate(explicit.ends if explicit else [settings.passes]):
        if state.passes >= end * (1 - SAME) and end < settings.passes:
            continue
        if explicit and stop:  # the first has been, on the casting
            site = explicit.flowed(stop, site, state.worn, say)
        try:
            for reached in evolve(site, end, stepping_of(settings), state):
                state, blocks = reached, blocks + 1
                write_state(path, state, identity)
                progress.update(blocks, state.passes, settings.passes)
        except WornOutError as error:
            if not state.passes:
                raise
            return state, site, str(error)
    return state, site, ""


def _study(case, settings, folder, goes_on, identity, progress, say, workers: Workers) -> str:
    """What ended it before its last pass; "": nothing."""
    run, flow, flow_before = case.runs.get("rigid_hertz"), flow_file(case, settings), None
    crossing = settings.site == "crossing"
    if settings.turning and settings.turning.line:  # minutes, and kept
        progress.note("wheels wear on straight line until they are turned")
        progress.note(f"{len(wheels_of(case.scene, settings))} wheels of all ages; contacts on the first shape")
    with ExitStack() as stack:
        pool = stack.enter_context(Pool(workers, __name__)) if crossing else None
        site: Any = crossing_site(case.scene, settings, run, pool) if crossing else switch_section(case.scene, settings)
        if flow is not None:
            flowed, (low, high) = read_flow(flow, case.scene, site.grid)
            site, flow_before = replace(site, flow=flowed), {"deepest": flowed.max(), "start": low, "end": high}
        explicit = None
        if settings.explicit:
            numerics = cast(FeSettings, case.runs[MODEL])
            explicit = ExplicitStops(settings.explicit, numerics, settings.passes, folder / "explicit", identity)
            site = explicit.flowed(0, site, site.first(), say)
        before = site.rate(site.first())
        site.forget()
        state, site, ended = _wear(settings, site, explicit, folder, goes_on, identity, progress, say)
        site.start_from(state.starts)
        after = site.rate(state.worn)
    found = summary(settings, state, before, after) | {"flow_before": flow_before}
    if ended:
        found["ended"] = ended
    if explicit:
        found["explicit"] = explicit.rows(site)
    found["tonnage"] = tonnage_of(case.scene, settings)
    if settings.fleet is not None:
        found["fleet"] = fleet_life(settings, settings.fleet.kinds, state, after)
    if crossing and settings.sensitivities:
        found["sensitivities"] = sensitivities(case.scene, settings, run)
        found["wheel_ratios"] = wheel_ratios(case.scene, settings, run)
    if not crossing:
        for name, line in (("before", state.first), ("after", state.worn)):
            write_profile(folder / f"profile_{name}.txt", line.profile.points, "rail", f"{line.label}, {name} wear")
    arrays = state_arrays(state)
    write_atomically(folder / ARRAYS, lambda path: np.savez_compressed(path, **arrays))
    write_text_atomically(folder / RESULT, dumps(found) + "\n")
    study_figures(folder / "figures", in_lines(case.title), settings, site, state, before, after)
    write_text_atomically(folder / REPORT, study_report(case.title, settings, found))
    return ended
