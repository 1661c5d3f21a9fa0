"""`rail-fem profile`: what a profile file holds."""

from pathlib import Path
from typing import Annotated

import typer

from rail_fem.commands.ending import say, stop
from rail_fem.commands.options import not_a_runs


def profile(
    file: Annotated[
        Path,
        typer.Argument(
            metavar="FILE",
            help="profile: .prw .prr .whl .ban .mpt .slcs or two columns; or a built-in one's name, such as P8",
        ),
    ],
    kind: Annotated[str | None, typer.Option(help="rail or wheel, where the file does not say")] = None,
    unit: Annotated[str | None, typer.Option(help="mm, cm, m or inch, where the file does not say")] = None,
    number: Annotated[int, typer.Option(help="which profile of an .mpt file, which section of a .slcs")] = 1,
    smooth: Annotated[bool, typer.Option(help="take out scatter above 0.2 um")] = True,
    smoothing: Annotated[
        float | None, typer.Option(help="scatter to take out [um]; default: what the points show")
    ] = None,
    mirror: Annotated[
        bool | None,
        typer.Option(
            "--mirror/--no-mirror",
            help=(
                "of a rail: exchange its sides, or keep them; default: kept, with a warning where its shape speaks"
                " against it"
            ),
        ),
    ] = None,
    flange_back: Annotated[float | None, typer.Option(help="of a wheel: y of its flange back in the file [mm]")] = None,
    origin: Annotated[
        str,
        typer.Option(
            help="of a rail, what becomes (0, 0): crown (height only), file (its own zero), or y,z in the file [mm]"
        ),
    ] = "crown",
    picture: Annotated[Path | None, typer.Option(callback=not_a_runs, help="draw it into this file")] = None,
    write: Annotated[
        Path | None, typer.Option(callback=not_a_runs, help="write the repaired one: .prr (rail) .prw (wheel) .txt")
    ] = None,
) -> None:
    """Profile doctor: what a profile file holds, what was repaired, what is refused; with a picture where one is asked
    for."""
    from geometry.profiles.doctor import examine
    from geometry.profiles.formats.by_suffix import write_profile
    from geometry.profiles.formats.units import UNITS, metres_of
    from rail_fem.files.atomic import write_atomically

    if unit is not None and unit not in UNITS:
        stop(f"--unit {unit}: known are {', '.join(UNITS)}")
    try:
        found = examine(
            raw_profile(file, kind, metres_of(unit), number),
            smooth,
            smoothing=None if smoothing is None else smoothing * 1e-6,
            mirror=mirror,
            flange_back=None if flange_back is None else flange_back * 1e-3,
            origin=origin_of(origin),
        )
        say(f"{file}\n{found.report()}")
        if picture is not None:
            from rail_fem.show.profile_figure import diagnosis_figure
            from rail_fem.show.style import DOTS, lettering

            with lettering():
                write_atomically(picture, lambda temporary: diagnosis_figure(found).savefig(temporary, dpi=DOTS))
            say(f"  drawn   {picture}")
        if write is not None:
            note = f"from {file.name}"
            write_atomically(write, lambda temporary: write_profile(temporary, found.profile.points, found.kind, note))
            say(f"  written {write}")
    except OSError as error:
        stop(error)
    except ValueError as error:
        stop(f"refused: {error}")


def raw_profile(file: Path, kind: str | None, unit: float | None, number: int):
    """A file's points, or those of a built-in profile where no such file is there: `profile P8 --write my_wheel.csv`
    is a file to begin with."""
    import numpy as np

    from geometry.profiles.formats.by_suffix import read_raw
    from geometry.profiles.formats.raw import RawProfile
    from geometry.profiles.rail import HEADS, rail_head
    from geometry.profiles.wheel import WHEEL_NAMES, wheel_profile

    name, in_mm = str(file), 1e3
    if file.exists() or name not in (*WHEEL_NAMES, *HEADS):
        return read_raw(file, kind, unit, number)
    is_wheel = name in WHEEL_NAMES
    if kind not in (None, "wheel" if is_wheel else "rail") or unit is not None or number != 1:
        stop(f"{name} is a built-in {'wheel' if is_wheel else 'rail'}: --kind, --unit and --number are told of files")
    points = (wheel_profile(name) if is_wheel else rail_head(name)).points * in_mm
    what = "wheel" if is_wheel else "rail"
    return RawProfile(points, np.arange(1, len(points) + 1), file, "built-in profile", 1e-3, what, up=1)


def origin_of(text: str) -> str | tuple[float, float]:
    """--origin as geometry.profiles.doctor.examine takes it: a word, or two numbers in mm as a position in m."""
    words = text.split(",")
    if len(words) != 2:
        return text
    try:
        return float(words[0]) * 1e-3, float(words[1]) * 1e-3
    except ValueError:
        stop(f"--origin {text}: crown, file, or two numbers in mm such as 35,-14")
