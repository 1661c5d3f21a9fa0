"""`rail-fem sweep`: many cases, or one with some of its values varied, by every model that they name; and the page of
runs or of a sweep, `rail-fem report`."""

import functools
import math
from pathlib import Path
from typing import Annotated

import typer

from rail_fem.commands.ending import MANNER, RUN_FAILED, aside, emit, refusing, say, stop, tell
from rail_fem.commands.options import JsonOption, PoolOption, SetOption, by_model, not_a_runs
from rail_fem.files.atomic import write_text_atomically
from rail_fem.processes import launcher


def sweep(
    context: typer.Context,
    cases: Annotated[
        list[Path], typer.Argument(metavar="CASE...", help="case files, or one list of changes: cases/rows/leg.toml")
    ],
    out: Annotated[Path, typer.Option("--out", help="folder of all results: OUT/CASE/MODEL")],
    vary: Annotated[
        list[str] | None,
        typer.Option(
            help=(
                'a key and its values: "scene.speed=30mph:100mph:8" for eight evenly from one to the other, or'
                ' "scene.wheel.profile=P8,P1"; several make a grid'
            )
        ),
    ] = None,
    settings: SetOption = None,
    groups: Annotated[
        Path | None,
        typer.Option(
            help="file of groups and trends, e.g. cases/thesis/whole_crossing.toml: the cases are changed as it says"
        ),
    ] = None,
    model: Annotated[
        list[str] | None,
        typer.Option(
            "--model",
            help="only this model, by its defaults where a case has no [run.MODEL]; may be given several times",
        ),
    ] = None,
    ranks: Annotated[int, typer.Option(help="for parallel models", min=1)] = 2,
    workers: Annotated[int, typer.Option(help="runs at a time", min=1, max=1024)] = 1,
    pool: PoolOption = "processes",
    time_limit: Annotated[
        str | None, typer.Option(help='of a run: "2 h"; it fails, and goes on when asked again')
    ] = None,
    tries: Annotated[int, typer.Option(help="of a run whose process is ended from outside", min=1, max=100)] = 3,
    array: Annotated[
        str | None, typer.Option(help="slurm or pbs: run nothing, write OUT/array.sh, a job array with a task a case")
    ] = None,
    only: Annotated[
        int | None, typer.Option(help="only the case of this number, from 1: for job arrays", min=1)
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Run many cases with every model that they name, or with those of --model; started again, it goes on. Do not put
    mpirun in front.

    All results come into one folder, with sweep.md and sweep.csv: a row a run, what varies as columns. 'rail-fem show
    OUT --quantity "impact on the wheel" --against speed' draws one against the other.
    """
    from rail_fem.case.casetext import located
    from rail_fem.case.variations import read_settings, read_variation
    from rail_fem.hierarchy import MODELS
    from rail_fem.processes.pool import MPI, PoolError, Workers
    from rail_fem.processes.stopping import AGAIN, last_words
    from rail_fem.scene.units import parse
    from rail_fem.sweeps.array import QUEUES, write_array, write_tasks
    from rail_fem.sweeps.rows import cases_of, is_rows, read_rows, to_prove, write_rows
    from rail_fem.sweeps.sweep import FAILED, cannot_start, jobs_of, read_cases, run_sweep
    from rail_fem.sweeps.sweep_report import failures, sweep_report
    from rail_fem.sweeps.trends import load_source

    one = only is not None
    try:
        limit = math.inf if time_limit is None else parse(time_limit, "s")[0]
    except ValueError as error:
        stop(f"--time-limit {time_limit}: {error}")
    if array is not None and array not in QUEUES:
        stop(f"--array {array}: choose among {', '.join(QUEUES)}")
    if pool == MPI:
        launcher.work_alone()
    if launcher.rank_count() > 1:
        stop("sweep starts mpirun itself, case by case: leave mpirun out and give --ranks")
    with refusing(ValueError):
        cases = [located(case) for case in cases]
        variations = [read_variation(text) for text in vary or ()]
        rows = read_rows(cases[0]) if len(cases) == 1 and is_rows(cases[0]) else None
        if only is not None and not vary and rows is None:
            cases, only = chosen(cases, only), None
        changes = None if groups is None else load_source(groups)
        if rows is None:
            found, faults = read_cases(cases, read_settings(settings or ()), variations, changes)
        elif vary or groups:
            stop(f"{cases[0]} is a list of changes: leave --vary and --groups out")
        else:
            found, faults = cases_of(cases[0], rows, read_settings(settings or ()))
    for fault in faults:
        typer.echo(f"left out: {fault}", err=True)
    if faults and (vary or settings or groups or array):
        stop("nothing was run: --vary, --set, --groups and --array must give cases without an input error")
    if not found:
        stop("nothing was run: no case file without an input error")
    found = found if only is None else chosen(found, only)
    asked = model or (() if rows is None else rows.models)
    by_each = functools.partial(by_model, told=set())
    found = [functools.reduce(by_each, asked, case) for case in found]
    jobs = jobs_of(found, out, asked or concerned(variations))
    if not jobs:
        stop(f"nothing was run: no case has a table [run.MODEL]: name models with --model, of {', '.join(MODELS)}")
    for fault in cannot_start(jobs, ranks):
        typer.echo(f"will not start: {fault}", err=True)
    make_folder(out)
    by = Workers(workers, pool, tries, limit)
    with refusing(OSError):
        if not one:
            write_tasks(jobs, out)
        if array is not None:
            say(str(write_array(jobs, out, array, ranks, limit, own_words(context))))
            return
    with aside(), last_words(lambda: AGAIN), refusing(PoolError, OSError):
        outcomes = run_sweep(jobs, ranks, tell, by)
        better, proofs = ("", []) if rows is None or one else to_prove(rows, found, outcomes)
        proofs = [by_each(case, better) for case in proofs]
        outcomes += run_sweep(jobs_of(proofs, out, [better]), ranks, tell, by) if proofs else []
    told = report = sweep_report(outcomes, faults)
    with refusing(OSError):
        if rows is not None:
            table = write_rows(rows, outcomes, out)
            told = report = table + "\n" + report
            if rows.fleet is not None:  # nobody reads a table of all its passes in a terminal
                told = table + "\n".join(failures(outcomes, faults))
        if not one:
            write_tables(out, report, bool(vary), outcomes)
    say("\n" + told)
    if MANNER.as_json:
        emit(sweep_facts(out, outcomes, faults))
    if faults or any(outcome.state == FAILED for outcome in outcomes):
        raise typer.Exit(RUN_FAILED)


def own_words(context: typer.Context) -> list[str]:
    """Arguments of this call, but for those of a job array."""
    words: list[str] = []
    for option in context.command.params:
        given = context.params.get(option.name or "")
        if option.name in ("array", "only", "workers", "pool") or given == option.default or given in (None, False, []):
            continue
        many = given if isinstance(given, (list, tuple)) else [given]
        flag = [] if option.param_type_name == "argument" else [option.opts[0]]
        words += [word for one in many for word in (*flag, str(one))]
    return words


def make_folder(out: Path) -> None:
    """Make it if need be; ends the program where it cannot be."""
    try:
        out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        stop(f"--out {out}: {error.strerror}, choose a folder that can be written")


def chosen(cases: list, only: int) -> list:
    """The case of this number alone; ends the program where there is none."""
    if only > len(cases):
        stop(f"--only {only}: there are {len(cases)} case(s)")
    return cases[only - 1 : only]


def concerned(variations: list[tuple[str, list]]) -> tuple[str, ...]:
    """Models whose answers the variations change; () for all."""
    models = {key.split(".")[1] for key, _ in variations if key.startswith("run.")}
    return tuple(models) if all(key.startswith("run.") for key, _ in variations) else ()


def write_tables(out: Path, report: str, varied: bool, outcomes: list) -> None:
    """sweep.md and sweep.csv of all results in the folder, also those of earlier sweeps."""
    from rail_fem.sweeps.results import sweep_below

    try:
        sweep_ = sweep_below(out, {o.job.folder: o.result for o in outcomes if o.has_result})
    except FileNotFoundError:
        write_text_atomically(out / "sweep.md", report)
        return
    write_text_atomically(out / "sweep.md", report + ("\n## What varies\n\n" + sweep_.to_markdown() if varied else ""))
    write_text_atomically(out / "sweep.csv", sweep_.to_csv())


def sweep_facts(out: Path, outcomes: list, faults: list[str]) -> dict:
    """What became of each job, and the rows of all results in the folder."""
    from rail_fem.sweeps.results import load_sweep

    jobs = [
        {"case": o.job.case.name, "model": o.job.model, "folder": o.job.folder, "state": o.state, "reason": o.reason}
        for o in outcomes
    ]
    there = any(out.glob("*/*/result.json"))
    return {"folder": out, "jobs": jobs, "left_out": faults, "rows": load_sweep(out).rows() if there else []}


def report(
    folders: Annotated[
        list[Path],
        typer.Argument(
            metavar="DIR...", help="folder of a run, or of several, or of a sweep, a damage study, a design"
        ),
    ],
    html: Annotated[
        Path | None,
        typer.Option(
            "--html", callback=not_a_runs, help="one file for a browser, without a network: curves, surfaces, tables"
        ),
    ] = None,
    groups: Annotated[
        Path | None,
        typer.Option(help="of a sweep: TOML file of groups of cases and trends, e.g. cases/thesis/trends.toml"),
    ] = None,
    out: Annotated[
        Path | None, typer.Option("--out", help="folder for report.md and its figures; default: DIR/report")
    ] = None,
    digest: Annotated[
        Path | None,
        typer.Option(help="instead: this one Markdown file, with the figures named by --show beside it, small"),
    ] = None,
    beside: Annotated[
        Path | None, typer.Option(help="another sweep of these cases, changed or not: its scene, trends and forces")
    ] = None,
    settings: SetOption = None,
    show: Annotated[
        list[str] | None,
        typer.Option("--show", help="figure of the digest, by its name in the report; may be given several times"),
    ] = None,
) -> None:
    """The page of a run, of several beside each other, of a sweep, a damage study or a design: --html. With --groups
    that of a sweep in Markdown: tables, trends in words checked on every model with reasons and controls, figures of
    each group. --set : what the sweep was given."""
    if html is not None:
        return write_html(folders, html)
    if groups is None or len(folders) > 1:
        stop("give --html FILE for the page of runs or of a sweep, or --groups FILE for that of one sweep's trends")
    from rail_fem.case.variations import read_settings
    from rail_fem.sweeps.sweep_page import read_sweep, write_digest, write_page

    folder = folders[0]
    with refusing():
        found = read_sweep(folder, groups, beside, read_settings(settings or ()))
        if digest is None:
            say(str(write_page(found, out or folder / "report")))
        else:
            say(str(write_digest(found, digest, tuple(show or ()))))


def write_html(folders: list[Path], path: Path) -> None:
    """Write the page of these runs, or of this sweep, damage study or design; ends the program where that cannot be."""
    from rail_fem.commands.show import is_sweep
    from rail_fem.show.page import reports, write_page, write_report_page
    from rail_fem.sweeps.chooser import write_sweep_page
    from rail_fem.sweeps.compare import result_folders, short_names

    with refusing(ValueError, OSError, ModuleNotFoundError):
        if len(folders) == 1 and is_sweep(folders[0]):
            say(str(write_sweep_page(folders[0], path)))
        elif len(folders) == 1 and reports(folders[0]):
            say(str(write_report_page(folders[0], path)))
        else:
            runs = result_folders(folders)
            say(str(write_page(runs, path, short_names(runs))))
