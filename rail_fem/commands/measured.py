"""`rail-fem measured`: a measured record beside a result; `rail-fem low-pass`: a history as the trade quotes it."""

import math
from pathlib import Path
from typing import Annotated

import typer

from rail_fem.commands.ending import refusing, say
from rail_fem.commands.options import not_a_runs

FEWEST_ROWS = 3  # of a history that can be filtered
CutoffOption = Annotated[
    list[str] | None, typer.Option("--low-pass", help='cut-off, e.g. "20 Hz"; may be given several times')
]


def measured(
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="folder of a run")],
    record: Annotated[
        Path, typer.Argument(metavar="RECORD", help="CSV with units in its titles: time [ms], force [kN]")
    ],
    cutoffs: CutoffOption = None,
    reach: Annotated[
        str | None, typer.Option(help='largest shift along the track, e.g. "500 mm"; "0 mm": none; default: any')
    ] = None,
    draw: Annotated[Path | None, typer.Option(callback=not_a_runs, help="draw both into this PNG file")] = None,
) -> None:
    """Hold a measured force or acceleration against a run: filter both alike, align by position, score."""
    from rail_fem.measurement.record import of_result, read_record
    from rail_fem.measurement.report import record_figure, score_table
    from rail_fem.measurement.score import align, score
    from rail_fem.result.low_pass import CUTOFFS
    from rail_fem.result.result import load
    from rail_fem.scene.units import parse
    from rail_fem.show.style import lettering, save, scene_words

    with refusing():
        result = load(folder)
        wanted = [math.inf, *([parse(text, "Hz")[0] for text in cutoffs] if cutoffs else CUTOFFS)]
        farthest = None if reach is None else parse(reach, "mm")[0]
        found = read_record(record, result.scene.velocity)
        pair = align(found, of_result(result, found.quantity), farthest)
        say(score_table(found, pair, [score(pair, cutoff) for cutoff in wanted]))
        if draw is not None:
            title = f"{record.name} against {result.model}\n{scene_words(result.scene)}"
            with lettering():
                say(f"drawn {save(record_figure(found, pair, wanted, title), draw)}")


def low_pass(
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="folder of a run")],
    out: Annotated[Path, typer.Option("--out", callback=not_a_runs, help="CSV file of the filtered history")],
    cutoff: Annotated[str, typer.Option("--cutoff", help='cut-off, e.g. "20 Hz"')] = "20 Hz",
) -> None:
    """Write a run's history with forces and heights low-passed, as P2 is quoted at 20 Hz; the run stays as it is."""
    from rail_fem.files.atomic import write_text_atomically
    from rail_fem.result.history import shown_table
    from rail_fem.result.low_pass import filtered_peak, low_passed
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
            found = f"{engineering(peak.value, 'N')} at x = {1e3 * peak.x:.1f} mm"
        say(f"largest force low-passed at {cutoff}: {found}")
        say(f"written {out}")
