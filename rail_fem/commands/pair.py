"""What `rail-fem contact` and `rail-fem patch` compute with: a wheel and a rail as they are typed, rows of contact
points, the numbers of a patch."""

import warnings
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

from bem.material import STEEL
from bem.patch import Patch, PatchCutError
from geometry.axes import GAUGE_FACE_Y, tread_datum_y
from geometry.contact.prismatic_search import Contacts, ContactSearch
from geometry.profiles.formats.by_suffix import read_raw
from geometry.profiles.profile import Profile, ProfileError
from geometry.profiles.rail import ALSO_CALLED, HEADS, rail_head
from geometry.profiles.reading import read_profile
from geometry.profiles.shape import guess_kind
from geometry.profiles.wheel import WHEEL_NAMES, wheel_profile
from geometry.wheelset import SIDES, Track, Wheelset
from rail_fem.commands.ending import refusing, stop, warn
from rail_fem.contact.contact_pairs import bring_together, plain_rail
from rail_fem.contact.load_sharing import LoadedSide, side_held, wheel_equilibrium
from rail_fem.files.atomic import csv_text, write_text_atomically
from rail_fem.scene.series import read_series
from rail_fem.scene.units import QuantityError, parse

COLUMNS = (
    "shift [mm]", "yaw [mrad]", "side", "height [mm]", "roll [mrad]", "lateral position [mm]",
    "on the wheel from its flange back [mm]", "on the rail [mm]", "contact angle [mrad]", "rolling radius [mm]",
    "ahead of the axle [mm]",
)  # fmt: skip
PRESSED = (
    "lowered [um]", "point", "penetration [um]", "normal force [kN]", "vertical force on the wheel [kN]",
    "lateral force on the wheel [kN]", "half length [mm]", "half width [mm]",
)  # fmt: skip
LARGEST_FORCE = 1e7  # [N]
WIDE_WINDOW = 0.04, 0.03  # half its length and width [m]


def length(text: str, unit: str = "mm") -> float:
    """A quantity as it is typed, in SI; ends the program where it is none."""
    with refusing(QuantityError):
        return parse(text, unit)[0]


def series(text: str, unit: str) -> np.ndarray:
    """ "3 mm", or "-6 mm:6 mm:13", in SI; ends the program where it is none."""
    with refusing(QuantityError):
        return read_series(text, unit).values


def slope(text: str) -> float:
    """1:20, 0.05 or 0."""
    try:
        first, _, second = text.partition(":")
        return float(first) / float(second) if second else float(first)
    except (ValueError, ZeroDivisionError):
        stop(f"inclination {text!r} is none: write e.g. 1:20, 1:40 or 0")


def force(text: str) -> float:
    """A vertical force [N]; ends the program where it is none."""
    value = length(text, "kN")
    if not 0 < value < LARGEST_FORCE:
        stop(f"load {text}: give a vertical force between 0 and 10 MN")
    return value


def profile_of(text: str, kind: str, inclination: float = 0.0) -> Profile:
    """A profile by name or from a file; what was repaired or is doubtful is said on standard error."""
    with refusing(ProfileError, OSError):
        if kind == "wheel" and text in WHEEL_NAMES:
            return wheel_profile(text)
        if kind == "rail" and (text in HEADS or text in ALSO_CALLED):
            return rail_head(text, inclination)
        if not Path(text).suffix:
            known = (*WHEEL_NAMES,) if kind == "wheel" else (*HEADS, *ALSO_CALLED)
            stop(f"no {kind} {text!r}: give one of {', '.join(known)}, or a profile file")
        refuse_other(text, kind)
        with warnings.catch_warnings(record=True) as said:
            warnings.simplefilter("always")
            profile = read_profile(text, kind)
        for warning in said:
            warn(str(warning.message))
        return profile


def refuse_other(file: str, kind: str) -> None:
    """Ends the program where a profile file says or, where it is silent, its shape shows that it is of the other
    kind. Errors: ProfileError, OSError."""
    raw = read_raw(file)
    try:
        found = raw.kind or guess_kind(raw)
    except ProfileError:  # a part of one: the doctor judges it
        return
    if found != kind:
        stop(f"{file}: a {found} {'as it says' if raw.kind else 'by its shape'}; a {kind} is asked for here")


def search_of(wheel: str, rail: str, inclination: str, gauge: str, back_to_back: str, radius: str) -> ContactSearch:
    """A wheelset of this wheel on plain line of this rail; ends the program where they cannot be."""
    profiles = profile_of(wheel, "wheel"), profile_of(rail, "rail", slope(inclination))
    with refusing(ValueError):
        return ContactSearch(
            Wheelset(profiles[0], radius=length(radius), back_to_back=length(back_to_back)),
            Track(profiles[1], gauge=length(gauge)),
        )


def rows_of(search: ContactSearch, shifts: np.ndarray, yaws: np.ndarray, lowered: np.ndarray | None) -> Iterator[dict]:
    """Rows of an unloaded wheelset; lowered : (n,) [m] below where it just touches: what carries then; None: where it
    touches first, on each side."""
    for shift, yaw in ((float(y), float(psi)) for y in shifts for psi in yaws):
        try:
            state = search.settle(shift, yaw)
            for down in (None,) if lowered is None else lowered:
                for side in SIDES:
                    if down is None:
                        yield from _points(shift, state, search.contacts(state, side).lowest())
                    else:
                        yield from _pressed_down(search, shift, state, side, float(down))
        except ValueError as error:
            down_ = "" if lowered is None else ", lowered"
            stop(f"shift {shift * 1e3:g} mm, yaw {yaw * 1e3:g} mrad{down_}: {error}")


def _pressed_down(search: ContactSearch, shift: float, free: Wheelset, side: str, lowered: float) -> Iterator[dict]:
    """What carries on a side; where nothing does, the nearest point as number 0."""
    state = replace(free, z=free.z - lowered)
    found = side_held(search, state, side)
    if len(found.contacts):
        yield from _carrying(shift, state, found, lowered)
    else:
        nearest = search.contacts(state, side).lowest()
        nothing = (lowered * 1e6, 0, -float(nearest.gap[0]) * 1e6, *[0.0] * (len(PRESSED) - 3))
        yield from (row | dict(zip(PRESSED, nothing, strict=True)) for row in _points(shift, state, nearest))


def rows_under(search: ContactSearch, shifts: np.ndarray, yaws: np.ndarray, loads: np.ndarray) -> Iterator[dict]:
    """Rows of the left wheel alone under vertical forces (n,) [N] on it, without roll; the other wheel is left out."""
    for shift, yaw, load in ((float(y), float(psi), float(p)) for y in shifts for psi in yaws for p in loads):
        held = replace(search.wheelset, y=shift, yaw=yaw, roll=0.0)
        try:
            free = held.z - float(search.contacts(held, "left").vertical_gap.min())
            state, found = wheel_equilibrium(search, "left", load, held)
        except ValueError as error:
            stop(f"shift {shift * 1e3:g} mm, yaw {yaw * 1e3:g} mrad, load {load / 1e3:g} kN: {error}")
        for text in found.warnings:
            warn(f"shift {shift * 1e3:g} mm, yaw {yaw * 1e3:g} mrad, load {load / 1e3:g} kN: {text}")
        yield from _carrying(shift, state, found, free - state.z)


def _points(shift: float, state: Wheelset, p: Contacts) -> Iterator[dict]:
    for i in range(len(p)):
        values = (shift * 1e3, state.yaw * 1e3, p.side, state.z * 1e3, state.roll * 1e3, p.position[i, 1] * 1e3,
                  p.from_flange_back[i] * 1e3, p.rail_station[i] * 1e3, p.angle[i] * 1e3, p.rolling_radius[i] * 1e3,
                  p.ahead[i] * 1e3)  # fmt: skip
        yield dict(zip(COLUMNS, (v if isinstance(v, str) else float(v) for v in values), strict=True))


def _carrying(shift: float, state: Wheelset, found: LoadedSide, lowered: float) -> Iterator[dict]:
    for i, row in enumerate(_points(shift, state, found.contacts)):
        values = (lowered * 1e6, i + 1, -found.contacts.gap[i] * 1e6, found.normal_force[i] / 1e3,
                  found.force[i, 2] / 1e3, found.force[i, 1] / 1e3, found.patch[i, 0] * 1e3,
                  found.patch[i, 1] * 1e3)  # fmt: skip
        yield row | dict(zip(PRESSED, (v if isinstance(v, int) else float(v) for v in values), strict=True))


def write_rows(path: Path, rows: list[dict]) -> None:
    """As CSV, whole or not at all; ends the program where nothing can be written."""
    try:
        write_text_atomically(path, csv_text([rows[0] if rows else COLUMNS, *(row.values() for row in rows)]))
    except OSError as error:
        stop(f"{path}: cannot be written: {error.strerror}")


def patch_of(
    wheel: str, rail: str, load: str, shift: str, inclination: str, gauge: str, back_to_back: str, radius: str,
    cells: int,
) -> tuple[Patch, dict[str, float]]:  # fmt: skip
    """The patch of one wheel under a vertical force, and its numbers by name; ends the program where there is none. The
    rail lies where `contact` has it: its gauge face half a gauge from the middle."""
    vertical, y = force(load), length(shift)
    search = search_of(wheel, rail, inclination, gauge, back_to_back, radius)
    wheelset, track = search.wheelset, search.track
    with refusing(ValueError):
        datum = 0.0, tread_datum_y(track.gauge, wheelset.back_to_back) + y
        head = plain_rail(track.placed("left").shifted(GAUGE_FACE_Y - track.gauge / 2, 0.0))
        pair = bring_together(
            wheelset.left, head, datum, wheelset.radius_of("left"), (STEEL, STEEL), label=f"{wheel} on {rail}"
        )
        try:
            found = pair.patch(vertical, cells)
        except PatchCutError:  # of a flange, or of an impact
            found = pair.patch(vertical, cells, pair.window(*WIDE_WINDOW))
    centre = pair.point + pair.frame.T @ [*found.centre_of_pressure, 0.0]
    return found, {
        "first contact from the gauge face [mm]": (pair.point[1] - GAUGE_FACE_Y) * 1e3,
        "centre of pressure from the gauge face [mm]": (centre[1] - GAUGE_FACE_Y) * 1e3,
        "normal force [kN]": found.normal_force / 1e3,
        "largest elastic pressure [MPa]": found.max_pressure / 1e6,
        "contact area [mm2]": found.contact_area * 1e6,
        "length [mm]": found.extent[0] * 1e3,
        "width [mm]": found.extent[1] * 1e3,
        "approach [um]": found.approach * 1e6,
    }
