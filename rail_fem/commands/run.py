"""`rail-fem check` and `rail-fem run`: what a case means, and its run."""

from pathlib import Path
from typing import Annotated

import typer

from rail_fem.commands.ending import aside, emit, explain, refusing, say, stop, stop_run, tell
from rail_fem.commands.options import CaseArgument, JsonOption, ModelOption, SetOption, not_a_runs, read_case


def check(
    case: CaseArgument,
    model: ModelOption = None,
    settings: SetOption = None,
    ranks: Annotated[int, typer.Option(help="ranks to estimate for, as many as mpirun starts", min=1)] = 1,
    every_key: Annotated[
        bool, typer.Option("--all", help="also keys that are not set, or of other families of crossings")
    ] = False,
    draw: Annotated[
        Path | None, typer.Option(callback=not_a_runs, help="draw the crossing of the case into this PNG file")
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Read a case file and say what it means, what it will cost, and what calls for a warning; nothing is meshed, and
    nothing written but a drawing that is asked for."""
    from rail_fem.show.case_facts import case_facts, case_report

    loaded, name = read_case(case, model, settings)
    if draw is not None:
        _draw_crossing(loaded.scene, draw)
    if as_json:
        facts = case_facts(loaded, name, ranks)
        emit(facts)
        raise typer.Exit(2 if facts["errors"] else 0)
    report, errors = case_report(loaded, name, ranks, every_key)
    say(report)
    if errors:
        stop("\n  ".join([f"{case}: {len(errors)} input error(s)", *errors]))


def _draw_crossing(scene, path: Path) -> None:
    """Plan, long section and cross-sections; ends the program where that cannot be done."""
    from rail_fem.show.crossing_figure import crossing_figure
    from rail_fem.show.table_and_figure import write_figure

    try:
        say(f"drawn {write_figure(path, lambda: crossing_figure(scene))}")
    except (ValueError, OSError) as error:
        stop(f"--draw {path}: {error}")


def run(
    case: CaseArgument,
    out: Annotated[Path, typer.Option("--out", help="folder for everything the run writes")],
    model: ModelOption = None,
    settings: SetOption = None,
    restart: Annotated[bool, typer.Option("--restart", help="go on with the run in the folder")] = False,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="remove the run in the folder first")] = False,
    expected: Annotated[
        str | None, typer.Option("--digest", hidden=True, help="refuse a case of another digest")
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Run a case; with mpirun in front, on several ranks. The folder must be empty, or see --restart and
    --overwrite."""
    from rail_fem.result.runfolder import digest, fingerprint
    from rail_fem.result.versions import versions
    from rail_fem.run.job import JobError, run_case

    loaded, name = read_case(case, model, settings)
    mark = digest(fingerprint(name, loaded.scene, loaded.runs[name]))
    explain("\n".join([f"case {mark}", *(f"{key} {value}" for key, value in versions().items())]))
    if expected and expected != mark:
        stop(f"{case}: the case or its profile file has changed since it was read for this run: start again")
    with refusing(JobError), aside():
        fault = run_case(loaded, name, out, restart, overwrite, tell)
    emit({"folder": str(out), **_saved(out, fault)})
    if fault:
        explain(_trace(out))
        stop_run(f"{case}: the run failed: {fault}")


def _saved(out: Path, fault: str) -> dict:
    """The result that lies in the folder; the fault alone where none does."""
    from rail_fem.commands.ending import MANNER
    from rail_fem.result.result import load

    if not MANNER.as_json:
        return {}
    return load(out).summary() if (out / "result.json").is_file() else {"fault": fault}


def _trace(out: Path) -> str:
    return "\n".join(path.read_text(encoding="utf-8") for path in sorted(out.glob("traceback.*.txt")))
