"""`rail-fem contact` and `rail-fem patch`: where a wheel touches a rail, what carries, and the patch under a load."""

from pathlib import Path
from typing import Annotated

import typer

from rail_fem.commands.ending import emit, say, stop
from rail_fem.commands.options import JsonOption, not_a_runs

WheelArgument = Annotated[str, typer.Argument(metavar="WHEEL", help="a name, see 'rail-fem list', or a profile file")]
RailArgument = Annotated[
    str, typer.Argument(metavar="RAIL", help="a name, see 'rail-fem list', or the profile file of a rail as it lies")
]
Inclination = Annotated[str, typer.Option(help="of a rail known by name: 1:20, 1:40, 0")]
Length = Annotated[str, typer.Option(help="with its unit")]
Radius = Annotated[str, typer.Option(help="rolling radius at the tread datum")]


def contact(
    wheel: WheelArgument,
    rail: RailArgument,
    shift: Annotated[
        str, typer.Option(help='lateral shift of the wheelset, "3 mm", or a series "-6 mm:6 mm:13"')
    ] = "0 mm",
    yaw: Annotated[str, typer.Option(help='"2 mrad", or a series')] = "0 mrad",
    lower: Annotated[
        str | None,
        typer.Option(
            help='press the wheelset down below where it just touches, e.g. "0 um:150 um:7": what carries then'
        ),
    ] = None,
    load: Annotated[
        str | None, typer.Option(help='one wheel alone under this vertical force, "80 kN" or a series: what carries')
    ] = None,
    inclination: Inclination = "1:20",
    gauge: Length = "1435 mm",
    back_to_back: Length = "1360 mm",
    radius: Radius = "425 mm",
    table: Annotated[
        Path | None, typer.Option(callback=not_a_runs, help="write the rows as CSV, e.g. for a multibody program")
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Contact points of a wheelset with this wheel on both sides, on plain line of this rail.

    Unloaded it touches at one point a side. With --lower all points that carry when the wheelset is pressed down, with
    their forces and patches: a table over shift, yaw and height. With --load the left wheel alone stands under a
    vertical force.
    """
    from rail_fem.commands.pair import force, rows_of, rows_under, search_of, series, write_rows

    if lower is not None and load is not None:
        stop("give --lower (a wheelset pressed down) or --load (one wheel under a force), not both")
    search = search_of(wheel, rail, inclination, gauge, back_to_back, radius)
    positions = series(shift, "mm"), series(yaw, "mrad")
    if load is not None:
        for value in load.split(":")[:2]:
            force(value)
        rows = list(rows_under(search, *positions, series(load, "kN")))
    else:
        rows = list(rows_of(search, *positions, None if lower is None else series(lower, "um")))
    if table is not None:
        write_rows(table, rows)
        say(f"{table}: {len(rows)} contact points")
    else:
        say(columns(rows))
    emit({"wheel": wheel, "rail": rail, "points": rows, **({} if table is None else {"table": table})})


def columns(rows: list[dict]) -> str:
    """The rows in columns, for a terminal."""
    if not rows:
        return "no contact"
    shown = lambda name, value: f"{value:{len(name)}.4f}" if isinstance(value, float) else f"{value:>{len(name)}}"
    return "\n".join(
        ["  ".join(rows[0]), *("  ".join(shown(name, value) for name, value in row.items()) for row in rows)]
    )


def patch(
    wheel: WheelArgument,
    rail: RailArgument,
    load: Annotated[str, typer.Option(help="vertical force of the wheel on the rail")],
    shift: Annotated[str, typer.Option(help="of the wheel towards its field side")] = "0 mm",
    inclination: Inclination = "1:20",
    gauge: Length = "1435 mm",
    back_to_back: Length = "1360 mm",
    radius: Radius = "425 mm",
    cells: Annotated[int, typer.Option(min=16, max=1024, help="cells across the patch, each way")] = 88,
    figure: Annotated[Path | None, typer.Option(callback=not_a_runs, help="draw the patch into this PNG")] = None,
    as_json: JsonOption = False,
) -> None:
    """The patch of one wheel pressed on a rail by a vertical force: two elastic half-spaces on the true gap of the
    profiles."""
    from rail_fem.commands.pair import patch_of

    found, values = patch_of(wheel, rail, load, shift, inclination, gauge, back_to_back, radius, cells)
    if figure is not None:
        from bem.halfspace.figures import patch_figure
        from rail_fem.files.atomic import write_atomically

        try:
            write_atomically(figure, lambda temporary: patch_figure(found, str(temporary)))
        except (ValueError, OSError) as error:  # a suffix that is no picture's
            stop(f"--figure {figure}: cannot be drawn: {getattr(error, 'strerror', None) or error}")
    emit(values | {"warnings": list(found.warnings)})
    say("\n".join(f"  {name:43s} {value:10.3f}" for name, value in values.items()))
    for text in found.warnings:
        say(f"  warning: {text}")
