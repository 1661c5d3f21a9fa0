"""A wheelset's contact: curves over lateral shift on plain line (thesis Figs. 3-7 to 3-9) with conicity, and the time
of a loaded state there and on a crossing against its error, as search and sections are refined.

    rail-fem study wheelset --out wheelset [--wheel P1 --rail 60E1 --inclination 0.025]

A state is both sides, all points, load shared to equilibrium. Errors on the crossing are taken against sections 1 mm
apart, searched every 0.1 mm.
"""

from collections.abc import Sequence
from typing import Annotated

import numpy as np
import typer

from geometry.contact.conicity import ShiftCurves, equivalent_conicity, shift_curves
from geometry.contact.lofted_search import SurfaceSearch
from geometry.contact.prismatic_search import ContactSearch
from geometry.profiles.wheel import wheel_profile
from geometry.surfaces.crossing import CastCrossing
from geometry.surfaces.lofted_rail import RailSurface
from geometry.wheelset import SIDES, Track, Wheelset
from rail_fem.contact.load_sharing import LoadedWheelset, static_equilibrium
from rail_fem.files.atomic import write_text_atomically
from rail_fem.show.panels import Panel
from rail_fem.show.table_and_figure import Table, publish
from rail_fem.studies.harness import OUT, QUICK, least

MM = 1e-3
AXLE_LOAD = 98.15e3  # thesis Table 3-1 [N]
AMPLITUDES = np.array([1, 2, 3, 4, 5, 6, 7, 8]) * MM
RANGE = -0.7, 0.5  # of the axle on the crossing [m]
BEYOND = 0.12  # of the surface over that range [m]
REFINED = (1 * MM, 0.1 * MM)  # sections, stations
SETTINGS = ((16, 0.5), (8, 0.5), (4, 0.5), (2, 0.5), (4, 4), (4, 2), (4, 1), (4, 0.25))  # the same [mm]
ERRORS = ["position, median [mm]", "95 % [mm]", "largest [mm]", "force, median", "largest"]


def curve_table(curves: ShiftCurves, loaded: Sequence[LoadedWheelset]) -> Table:
    """One row a shift: lengths in mm, angles in degrees, forces in kN."""
    columns = {
        "shift": curves.shift / MM, "radius difference": curves.radius_difference / MM,
        "angle difference": np.degrees(curves.angle_difference), "rail, left": curves.rail_station[0] / MM,
        "rail, right": curves.rail_station[1] / MM, "wheel, left": curves.station[0] / MM,
        "wheel, right": curves.station[1] / MM, "roll [mrad]": curves.roll / MM,
        "lateral force": np.array([l.lateral_force / 1e3 for l in loaded]),
        "points on the left": np.array([float(len(l.left.normal_force)) for l in loaded]),
    }  # fmt: skip
    return Table(list(columns), np.column_stack(list(columns.values())).tolist())


def panels(curves: ShiftCurves, loaded: Sequence[LoadedWheelset], conicity: Sequence[float]) -> list[Panel]:
    """Six against the shift, conicity against its amplitude."""
    shift, points = curves.shift / MM, {}
    for side in SIDES:
        own = [getattr(one, side).contacts.rail_station / MM for one in loaded]
        points[f"{side} rail"] = (np.repeat(shift, [len(at) for at in own]), np.concatenate(own), ".")
    first = {f"{side} rail": (shift, station / MM, ".") for side, station in zip(SIDES, curves.rail_station)}
    asked: dict[str, dict] = {
        "rolling radius difference [mm]": {"left - right": (shift, curves.radius_difference / MM)},
        "contact angle difference [degrees]": {"left - right": (shift, np.degrees(curves.angle_difference))},
        "first point, from the rail's middle [mm]": first,
        f"carrying points under {AXLE_LOAD / 1e3:g} kN [mm]": points,
        "lateral force of the contacts [kN]": {"of both": (shift, [one.lateral_force / 1e3 for one in loaded])},
    }
    found = [Panel("lateral shift, + to the left [mm]", words, lines) for words, lines in asked.items()]
    return [*found, Panel("amplitude [mm]", "equivalent conicity", {"EN 15302": (AMPLITUDES / MM, conicity, "o-")})]


def random_states(count: int, seed: int = 1) -> np.ndarray:
    """(count, 5)  x of the axle, lateral shift [m], yaw [rad], loads [N]."""
    random = np.random.default_rng(seed)
    x, shift, yaw = (random.uniform(*ends, count) for ends in (RANGE, (-8 * MM, 8 * MM), (-0.01, 0.01)))
    return np.column_stack([x, shift, yaw, random.uniform(20e3, 120e3, (count, 2))])


def speed_against_error(
    crossing: CastCrossing, wheel: str, count: int, settings=SETTINGS, refined=REFINED
) -> list[list[float]]:
    """Rows: sections, stations [mm], time of a state [ms], then ERRORS. Position: mean of a side's points, weighted by
    force, so that it does not jump; force: vector sum over the load."""
    states, rows = random_states(count), []
    exact, _ = answers(search_of(crossing, wheel, *refined), states, 1)
    for spacing, resolution in settings:
        found, seconds = answers(search_of(crossing, wheel, spacing * MM, resolution * MM), states, 3)
        distance = np.linalg.norm(found[..., :3] - exact[..., :3], axis=2).max(axis=1) / MM
        force = (np.linalg.norm(found[..., 3:] - exact[..., 3:], axis=2) / states[:, 3:]).max(axis=1)
        places = [np.median(distance), np.percentile(distance, 95), distance.max()]
        rows.append([spacing, resolution, seconds * 1e3, *map(float, [*places, np.median(force), force.max()])])
    return rows


def search_of(crossing: CastCrossing, wheel: str, spacing: float, resolution: float) -> SurfaceSearch:
    surface = RailSurface.of_crossing(crossing, RANGE[0] - BEYOND, RANGE[1] + BEYOND, spacing)
    return SurfaceSearch(Wheelset(wheel_profile(wheel)), Track.plain_line(), left=surface, resolution=resolution)


def answers(search: SurfaceSearch, states: np.ndarray, repeats: int) -> tuple[np.ndarray, float]:
    """(count, 2, 6)  mean position and total force of left and right; mean processor time of a state [s], the least of
    several rounds."""
    solve = lambda s: static_equilibrium(search.at(s[0]), (s[3], s[4]), s[1], s[2])
    solve(states[0])
    seconds, found = least(lambda: [solve(s) for s in states], repeats)
    place = lambda side: side.normal_force @ side.contacts.position / side.normal_force.sum()
    mean = lambda side: np.concatenate([place(side), side.force.sum(axis=0)])
    return np.array([[mean(getattr(f, side)) for side in SIDES] for f in found]), seconds / len(states)


def main(
    wheel: Annotated[str, typer.Option(help="its name")] = "P8",
    rail: Annotated[str, typer.Option(help="56E1 (BS113A), 60E1 or 60E2")] = "56E1",
    inclination: Annotated[float, typer.Option(help="slope of the rails' lean, e.g. 0.05")] = 1 / 20,
    ratio: Annotated[float, typer.Option(help="N of the crossing 1:N")] = 9.25,
    count: Annotated[int, typer.Option(help="random states on it", min=1)] = 200,
    quick: QUICK = False,
    out: OUT = None,
) -> None:
    """Contact curves of a wheelset on plain line; time against error of its states on a crossing."""
    search = ContactSearch(Wheelset(wheel_profile(wheel)), Track.plain_line(rail, inclination))
    shift = np.linspace(-12, 12, 25 if quick else 241) * MM
    curves = shift_curves(search, shift)
    loaded = [static_equilibrium(search, (AXLE_LOAD / 2, AXLE_LOAD / 2), y) for y in shift]
    conicity = [equivalent_conicity(curves, a) for a in AMPLITUDES]
    title = f"{wheel} on {rail}, 1:{1 / inclination:g}, gauge 1435 mm"
    jumps = np.array2string(curves.jumps() / MM, precision=2)
    told = [[f"{a / MM:g}", f"{c:.4f}"] for a, c in zip(AMPLITUDES, conicity)]
    settings = SETTINGS[:2] if quick else SETTINGS
    count = 10 if quick else count
    states = speed_against_error(CastCrossing(ratio), wheel, count, settings)
    _, plain = answers(SurfaceSearch(search.wheelset, search.track), random_states(count), 3)
    times = f"Loaded states on 1:{ratio:g}; on plain line {plain * 1e3:.2g} ms"
    tables = [
        Table(["amplitude [mm]", "equivalent conicity"], told, f"Jumps of the contact at {jumps} mm"),
        Table(["sections [mm]", "stations [mm]", "ms a state", *ERRORS], states, times),
    ]
    publish("wheelset", out, tables, panels(curves, loaded, conicity), title, title)
    if out is not None:
        write_text_atomically(out / "wheelset_curves.csv", curve_table(curves, loaded).csv())
