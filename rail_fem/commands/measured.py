"""`rail-fem measured`: a measured record beside a result; `rail-fem low-pass`: a history as the trade quotes it."""

import functools
import math
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from rail_fem.commands.ending import RUN_FAILED, refusing, say, stop
from rail_fem.commands.options import not_a_runs

if TYPE_CHECKING:
    from rail_fem.scene.scene import Scene

FEWEST_ROWS = 3  # of a history that can be filtered
CutoffOption = Annotated[
    list[str] | None, typer.Option("--low-pass", help='cut-off, e.g. "20 Hz"; may be given several times')
]


def measured(
    files: Annotated[
        list[Path],
        typer.Argument(
            metavar="DIR|CASE RECORD...",
            help="folder of a run, or with --find a case file; CSV with units in its titles: time [ms], force [kN]",
        ),
    ],
    cutoffs: CutoffOption = None,
    reach: Annotated[
        str | None, typer.Option(help='largest shift along the track, e.g. "500 mm"; "0 mm": none; default: any')
    ] = None,
    draw: Annotated[Path | None, typer.Option(callback=not_a_runs, help="draw both into this PNG file")] = None,
    find: Annotated[
        list[str] | None,
        typer.Option(help='KEY=LOW..HIGH: an unknown of the case, "scene.foundation.stiffness=60 kN/mm..300 kN/mm"'),
    ] = None,
    each: Annotated[
        list[str] | None,
        typer.Option(help='with --find: the same, of each record by itself: "scene.gauge=1432 mm..1438 mm"'),
    ] = None,
    bearers: Annotated[
        str | None, typer.Option(help='with --find: bearers that may hang, by their numbers: "0,1,2"')
    ] = None,
    out: Annotated[Path | None, typer.Option(help="with --find: folder of trials, report and figures")] = None,
    trials: Annotated[int, typer.Option(help="with --find: passes over other scenes", min=20)] = 128,
    workers: Annotated[int, typer.Option(help="with --find: trials at a time", min=1, max=1024)] = 2,
) -> None:
    """Hold a measured force or acceleration against a run: filter both alike, align by position, score.

    With --find and a case in place of the run: what records of sleeper, axle box or casting say of the crossing, which
    bearer to pack and which metal to grind, into OUT/inversion.md, state.png and inversion.png. Each record is a pass;
    lines before its titles may say where the accelerometer is and what else is known of that pass.
    """
    against, records = _sorted(files)
    if find or bearers:
        from rail_fem.design.inversion import invert
        from rail_fem.design.inversion_report import write_inversion
        from rail_fem.design.state import state_problem
        from rail_fem.processes.pool import Lost, Workers
        from rail_fem.result.runfolder import held

        if out is None:
            stop("--find: give --out, the folder of trials, report and figures")
        with refusing():
            problem = state_problem(against, records, find or [], each or [], bearers, trials, reach)
            try:
                with held(out):
                    found = invert(problem, out, Workers(workers), say)
                    say("\n" + write_inversion(problem, found, out).rstrip())
            except Lost as error:
                stop(f"a trial is lost: {error}: start again, it goes on where it was", RUN_FAILED)
        return
    if each or out is not None or len(records) != 1:
        stop("give a run's folder and one record; several, --each and --out are for --find")
    _beside(against, records[0], cutoffs, reach, draw)


def _sorted(files: list[Path]) -> tuple[Path, list[Path]]:
    """The run or case, and the records, in whatever order they were given."""
    against = [path for path in files if path.is_dir() or path.suffix == ".toml"] or files[:1]
    if len(against) > 1 or len(files) < 2:
        stop("give one folder of a run, or one case file with --find, and a record")
    return against[0], [path for path in files if path != against[0]]


def _beside(folder: Path, record: Path, cutoffs: list[str] | None, reach: str | None, draw: Path | None) -> None:
    from rail_fem.measurement.record import of_result, read_record
    from rail_fem.measurement.score import align, record_figure, score, score_table
    from rail_fem.result.low_pass import CUTOFFS
    from rail_fem.result.result import load
    from rail_fem.scene.units import parse
    from rail_fem.show.style import scene_words
    from rail_fem.show.table_and_figure import write_figure

    with refusing():
        result = load(folder)
        wanted = [math.inf, *([parse(text, "Hz")[0] for text in cutoffs] if cutoffs else CUTOFFS)]
        farthest = None if reach is None else parse(reach, "mm")[0]
        found = read_record(record, result.scene.velocity)
        for key, value in found.notes.items():
            if key.startswith("scene.") and (held := _other_value(result.scene, key, value)):
                stop(f"{record}: # {key}: {value}, but the run has {held}: hold it against a run of its own pass")
        pair = align(found, of_result(result, found.quantity), farthest)
        say(score_table(found, pair, [score(pair, cutoff) for cutoff in wanted]))
        if draw is not None:
            title = f"{record.name} against {result.model}\n{scene_words(result.scene)}"
            say(f"drawn {write_figure(draw, lambda: record_figure(found, pair, wanted, title))}")


def _other_value(scene: "Scene", key: str, value: str) -> str:
    """What a scene has under this key, "" where it is this value. Errors: VariationError, QuantityError."""
    from rail_fem.case.variations import quantity_at
    from rail_fem.scene.units import QuantityError, in_digits, si_factor

    quantity, held = quantity_at(key), functools.reduce(getattr, key.split(".")[1:], scene)
    if quantity is None or not isinstance(held, float):
        raise QuantityError(f"{key}: is no physical quantity of this run, no note: leave it out")
    same = math.isclose(quantity.read(value), held, rel_tol=1e-6)
    return "" if same else f"{in_digits(held / si_factor(quantity.unit), 5)} {quantity.unit}"


def low_pass(
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="folder of a run")],
    out: Annotated[Path, typer.Option("--out", callback=not_a_runs, help="CSV file of the filtered history")],
    cutoff: Annotated[str, typer.Option("--cutoff", help='cut-off, e.g. "20 Hz"')] = "20 Hz",
) -> None:
    """Write a run's history with forces and heights low-passed, as P2 is quoted at 20 Hz; the run stays as it is."""
    from rail_fem.files.atomic import write_text_atomically
    from rail_fem.result.history import shown_table
    from rail_fem.result.low_pass import filtered_peak, is_left, low_passed, overshoot
    from rail_fem.result.result import load
    from rail_fem.scene.units import engineering, parse

    with refusing():
        result, frequency = load(folder), parse(cutoff, "Hz")[0]
        if len(result.history["time"]) < FEWEST_ROWS:
            raise ValueError(f"{folder}: {result.model} leaves no history, there is nothing to filter")
        header, table = shown_table(low_passed(result.history, frequency))
        rows = [",".join(f"{value:.9g}" for value in row) for row in table]
        write_text_atomically(out, "\n".join([f"# low-passed at {cutoff}", ",".join(header), *rows]) + "\n")
        peak = filtered_peak(result, frequency)
        found = "none on this record: it is shorter than two periods, or highest within one of an end"
        if peak is not None:
            found = f"{engineering(peak.value, 'N')} at x = {1e3 * peak.x:.1f} mm{overshoot(result, peak)}"
        say(f"largest force low-passed at {cutoff}: {found}")
        if is_left(rate := 1 / float(min(b - a for a, b in pairwise(result.history["time"]))), frequency):
            say(f"the record has {rate:.3g} rows a second, too few for {cutoff}: it is written as it is")
        say(f"written {out}")
