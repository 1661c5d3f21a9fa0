"""`rail-fem contact` and `rail-fem patch`: where a wheel touches a rail, and the patch under a load."""

import csv
import io
import json
import warnings
from pathlib import Path
from typing import Annotated

import numpy as np
import typer

from bem.halfspace.normal import normal_contact
from bem.material import STEEL
from geometry.axes import tread_datum_y
from geometry.contact.prismatic_search import ContactSearch
from geometry.profiles.profile import Profile, ProfileError
from geometry.profiles.rail import ALSO_CALLED, HEADS, rail_head
from geometry.profiles.reading import read_profile
from geometry.profiles.wheel import WHEEL_NAMES, wheel_profile
from geometry.wheelset import SIDES, Track, Wheelset
from rail_fem.atomic import write_text_atomically
from rail_fem.commands.ending import stop
from rail_fem.light.contact_pairs import bring_together, plain_rail
from rail_fem.scene.series import read_series
from rail_fem.scene.units import QuantityError, parse

WheelArgument = Annotated[str, typer.Argument(metavar="WHEEL", help=f"{', '.join(WHEEL_NAMES)}, or a profile file")]
RailArgument = Annotated[
    str, typer.Argument(metavar="RAIL", help=f"{', '.join(HEADS)}, or the profile file of a rail as it lies")
]
Inclination = Annotated[str, typer.Option(help="of a rail known by name: 1:20, 1:40, 0")]
Length = Annotated[str, typer.Option(help="with its unit")]
COLUMNS = (
    "shift [mm]", "yaw [mrad]", "side", "height [mm]", "roll [mrad]", "lateral position [mm]",
    "on the wheel from its flange back [mm]", "on the rail [mm]", "contact angle [mrad]", "rolling radius [mm]",
    "ahead of the axle [mm]",
)  # fmt: skip


def length(text: str, unit: str = "mm") -> float:
    """A quantity as it is typed, in SI; ends the program where it is none."""
    try:
        return parse(text, unit)[0]
    except QuantityError as error:
        stop(str(error))


def slope(text: str) -> float:
    """1:20, 0.05 or 0."""
    try:
        first, _, second = text.partition(":")
        return float(first) / float(second) if second else float(first)
    except (ValueError, ZeroDivisionError):
        stop(f"inclination {text!r} is none: write e.g. 1:20, 1:40 or 0")


def profile_of(text: str, kind: str, inclination: float = 0.0) -> Profile:
    """A profile by name or from a file; what was repaired or calls for a warning is printed."""
    try:
        if kind == "wheel" and text in WHEEL_NAMES:
            return wheel_profile(text)
        if kind == "rail" and (text in HEADS or text in ALSO_CALLED):
            return rail_head(text, inclination)
        if not Path(text).suffix:
            known = (*WHEEL_NAMES,) if kind == "wheel" else (*HEADS, *ALSO_CALLED)
            stop(f"no {kind} {text!r}: give one of {', '.join(known)}, or a profile file")
        with warnings.catch_warnings(record=True) as said:
            warnings.simplefilter("always")
            profile = read_profile(text, kind)
        for warning in said:
            typer.echo(str(warning.message), err=True)
        return profile
    except (ProfileError, OSError) as error:
        stop(str(error))


def series(text: str, unit: str) -> np.ndarray:
    """ "3 mm", or "-6 mm:6 mm:13", in SI; ends the program where it is none."""
    try:
        return read_series(text, unit).values
    except QuantityError as error:
        stop(str(error))


def contact(
    wheel: WheelArgument,
    rail: RailArgument,
    shift: Annotated[
        str, typer.Option(help='lateral shift of the wheelset, "3 mm", or a series "-6 mm:6 mm:13"')
    ] = "0 mm",
    yaw: Annotated[str, typer.Option(help='"2 mrad", or a series')] = "0 mrad",
    inclination: Inclination = "1:20",
    gauge: Length = "1435 mm",
    back_to_back: Length = "1360 mm",
    radius: Annotated[str, typer.Option(help="rolling radius at the tread datum")] = "425 mm",
    table: Annotated[Path | None, typer.Option(help="write the points as CSV, e.g. for a multibody program")] = None,
    as_json: Annotated[bool, typer.Option("--json", help="print JSON")] = False,
) -> None:
    """Contact points of an unloaded wheelset with this wheel on both sides, on plain line of this rail: every local
    minimum of the gap that touches."""
    search = ContactSearch(
        Wheelset(profile_of(wheel, "wheel"), radius=length(radius), back_to_back=length(back_to_back)),
        Track(profile_of(rail, "rail", slope(inclination)), gauge=length(gauge)),
    )  # fmt: skip
    rows = [
        row
        for y in series(shift, "mm")
        for psi in series(yaw, "mrad")
        for row in contact_rows(search, float(y), float(psi))
    ]
    if table is not None:
        text = io.StringIO()
        csv.writer(text, lineterminator="\n").writerows([COLUMNS, *rows])
        write_text_atomically(table, text.getvalue())
        typer.echo(f"{table}: {len(rows)} contact points")
    elif as_json:
        typer.echo(json.dumps([dict(zip(COLUMNS, row, strict=True)) for row in rows], indent=1))
    else:
        typer.echo("  ".join(COLUMNS))
        for row in rows:
            typer.echo(
                "  ".join(
                    f"{value:>{len(name)}}" if isinstance(value, str) else f"{value:{len(name)}.4f}"
                    for name, value in zip(COLUMNS, row, strict=True)
                )
            )


def contact_rows(search: ContactSearch, shift: float, yaw: float) -> list[tuple]:
    """Values of COLUMNS for each touching point of both sides; the deepest of each side where the wheelset only just
    rests."""
    try:
        state = search.settle(shift, yaw)
        found = [(side, search.contacts(state, side).lowest()) for side in SIDES]
    except ValueError as error:
        stop(f"shift {shift * 1e3:g} mm, yaw {yaw * 1e3:g} mrad: {error}")
    return [
        (shift * 1e3, yaw * 1e3, side, state.z * 1e3, state.roll * 1e3, p.position[0, 1] * 1e3,
         p.from_flange_back[0] * 1e3, p.rail_station[0] * 1e3, p.angle[0] * 1e3, p.rolling_radius[0] * 1e3,
         p.ahead[0] * 1e3)
        for side, p in found
    ]  # fmt: skip


def patch(
    wheel: WheelArgument,
    rail: RailArgument,
    load: Annotated[str, typer.Option(help="vertical force of the wheel on the rail")],
    shift: Annotated[str, typer.Option(help="of the wheel towards its field side")] = "0 mm",
    inclination: Inclination = "1:20",
    gauge: Length = "1435 mm",
    back_to_back: Length = "1360 mm",
    radius: Annotated[str, typer.Option(help="rolling radius at the tread datum")] = "425 mm",
    cells: Annotated[int, typer.Option(min=16, max=1024, help="cells across the patch, each way")] = 88,
    figure: Annotated[Path | None, typer.Option(help="draw the patch into this PNG")] = None,
    as_json: Annotated[bool, typer.Option("--json", help="print JSON")] = False,
) -> None:
    """The patch of one wheel pressed on a rail by a vertical force: two elastic half-spaces on the true gap of the
    profiles."""
    force, y = length(load, "kN"), length(shift)
    if not 0 < force < 1e7:
        stop(f"load {load}: give a vertical force between 0 and 10 MN")
    profiles = profile_of(wheel, "wheel"), profile_of(rail, "rail", slope(inclination))
    try:
        datum = 0.0, tread_datum_y(length(gauge), length(back_to_back)) + y
        pair = bring_together(
            profiles[0], plain_rail(profiles[1]), datum, length(radius), (STEEL, STEEL), label=f"{wheel} on {rail}"
        )
        found = normal_contact(pair.gap, STEEL, STEEL, load=pair.normal_force(force), window=pair.window(), cells=cells)
    except ValueError as error:
        stop(str(error))
    centre = pair.point + pair.frame.T @ [*found.centre_of_pressure, 0.0]
    values = {
        "first point of contact y [mm]": pair.point[1] * 1e3,
        "centre of pressure y [mm]": centre[1] * 1e3,
        "normal force [kN]": found.normal_force / 1e3,
        "largest pressure [MPa]": found.max_pressure / 1e6,
        "contact area [mm2]": found.contact_area * 1e6,
        "length [mm]": found.extent[0] * 1e3,
        "width [mm]": found.extent[1] * 1e3,
        "approach [um]": found.approach * 1e6,
    }
    if figure is not None:
        from bem.halfspace.figures import patch_figure

        patch_figure(found, str(figure))
    if as_json:
        typer.echo(json.dumps(values | {"warnings": list(found.warnings)}, indent=1))
        return
    for name, value in values.items():
        typer.echo(f"  {name:28s} {value:10.3f}")
    for text in found.warnings:
        typer.echo(f"  warning: {text}")
