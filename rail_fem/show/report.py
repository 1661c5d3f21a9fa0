"""What the terminal shows: a result, or how far the run in a folder is."""

import os
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from rail_fem.processes.progress import duration, read_status
from rail_fem.result.events import flights, stated_peaks, way_over
from rail_fem.result.history import COLUMNS
from rail_fem.result.low_pass import CUTOFFS, filtered_peak, overshoot
from rail_fem.result.quantities import FORCES, REPORTED, impact_pressure
from rail_fem.result.result import Cost, PassResult, load
from rail_fem.scene.crossing import JOINT
from rail_fem.scene.units import engineering, show
from rail_fem.show.metal import MOST_DIGITS, Headline, metal_rows, told
from rail_fem.show.passes import passes_rows

MOST_FLIGHTS = 5  # that are told
BEARER_HEADS = ("bearer", "x [mm]", "pad [kN]", "uplift [kN]", "ballast [kN]", "down [mm]", "")


def listed(what: str, texts: Sequence[str]) -> list[str]:
    """How many there are, and each in a line of its own."""
    return ["", f"{len(texts)} {what}", *(f"  {text}" for text in texts)]


def row(name: str, value: str, text: str = "") -> str:
    return f"  {name:<33} {value:<17} {text}".rstrip()


def headlines(result: PassResult) -> list[Headline]:
    """Impacts, largest forces and other peaks; forces low-passed; transfer; mean pressure at the first impact."""
    shown, found = COLUMNS["x"].unit, []
    for name, peak in stated_peaks(result).items():
        where = (
            f"at x = {show(peak.x, shown, 4)}" if np.isfinite(peak.x) else "",
            f"y = {show(peak.y, shown, 4)}" if np.isfinite(peak.y) else "",
            f"t = {show(peak.time, COLUMNS['time'].unit, 4)}" if np.isfinite(peak.time) else "",
            f"in an element of {show(peak.size, shown, 2)}" if np.isfinite(peak.size) else "",
        )
        place = ", ".join(filter(None, where)) if peak.value else ""  # nothing has flowed nowhere
        found.append(told(result, name, name, peak.value, peak.unit, place))
    for cutoff in CUTOFFS:
        if (low := filtered_peak(result, cutoff)) is not None:
            force, at = engineering(low.value, "N", MOST_DIGITS), f"at x = {show(low.x, shown, 4)}"
            found.append(Headline(f"force low-passed at {cutoff:g} Hz", force, "", "", at + overshoot(result, low)))
    crossing = result.scene.crossing
    if crossing.family != JOINT:
        words = crossing.told(f"transfer from {way_over(result.scene.direction_sign)}")
        transfer = told(result, words, "transfer_x", result.transfer_x, "m")
        missing = "none" if np.isfinite(result.history["force_nose"]).any() else "not resolved"
        found.append(transfer._replace(value=missing if np.isnan(result.transfer_x) else f"x = {transfer.value}"))
    if not np.isnan(pressure := impact_pressure(result)):
        words, where_it_is = "mean pressure at the first impact", "of contact, weighted by force"
        found.append(told(result, words, "impact_pressure", pressure, "Pa", where_it_is))
    return found


def _headline(one: Headline) -> str:
    """As a line of the terminal."""
    return row(one.name, one.with_bar, (f"form +- {one.form} " if one.form else "") + one.where)


def state(result: PassResult) -> str:
    if result.fault:
        return f"FAILED: {result.fault}"
    return f"CUT OFF: {result.cut_off}" if result.cut_off else "finished"


def flight_rows(result: PassResult) -> list[tuple[str, str, str]]:
    """Where the wheel leaves the crossing, the longest first; nothing for a model that has no history."""
    found = sorted(flights(result), key=lambda flight: -flight.length) if len(result.history["x"]) else []
    rows = [
        (
            f"{show(flight.x_start, 'mm', 5)} to {show(flight.x_end, 'mm', 5)}",
            f"{flight.length * 1e3:.1f} mm",
            f"{flight.duration * 1e3:.2f} ms, launched at {abs(flight.launch_speed):.2f} m/s"
            f" {'downwards' if flight.launch_speed < 0 else 'upwards'}",
        )
        for flight in found[:MOST_FLIGHTS]
    ]
    return rows + ([("shorter ones", str(len(found) - MOST_FLIGHTS), "")] if len(found) > MOST_FLIGHTS else [])


def bearer_rows(result: PassResult) -> list[str]:
    """A line for each bearer near the window: largest forces, static load included; nothing on a rigid mass."""
    if not result.bearers:
        return []
    lines = ["".join(f"{head:>14}" for head in BEARER_HEADS[:-1])]
    for one in result.bearers:
        numbers = (1e3 * one.x, one.pad_force / 1e3, one.uplift / 1e3, one.ballast_force / 1e3, 1e3 * one.deflection)
        lines.append(f"{one.number:>14}" + "".join(f"{value:>14.5g}" for value in numbers) + f"  {one.state}".rstrip())
    return lines


def result_report(result: PassResult) -> str:
    """What a run found, in engineers' units."""
    away = [row(*one) for one in flight_rows(result)]
    lines = [
        f"{result.model}: " + state(result),
        "",
        "peaks",
        *map(_headline, headlines(result)),
        *(["", "flights without contact", *away] if away else []),
        *(["", "passes"] if result.passes else []),
        *passes_rows(result),
        *(["", "bearers, largest forces and movement"] if result.bearers else []),
        *bearer_rows(result),
        *(["", "metal"] if result.metal else []),
        *(f"  {name:<58}{value:<21} {text}".rstrip() for name, value, text in metal_rows(result)),
        *_form(result),
        "",
        "error estimate",
    ]
    lines += [
        row(name, "not known" if np.isnan(error) else f"{100 * error:.2g} %")
        for name, error in result.error_estimate.items()
    ] or ["  none claimed"]
    lines += ["", "cost", *(row(*one) for one in cost_rows(result.cost))]
    return "\n".join(
        [*lines, *listed("warning(s)", result.warnings), *(listed("note(s)", result.notes) if result.notes else [])]
    )


def cost_rows(cost: Cost) -> list[tuple[str, str, str]]:
    """What the answer cost: name, value, remark."""
    wall = f"{cost.wall_time:.2g} s" if cost.wall_time < 10 else duration(cost.wall_time)
    rows = [
        ("wall time", wall, f"{cost.ranks} rank(s)"),
        ("  the model itself", f"{cost.solve_time:.3g} s", ""),
        ("  contacts searched, or meshed", f"{cost.search_time:.3g} s", "kept for scenes of the same surfaces"),
        ("  kernels compiled", f"{cost.compile_time:.3g} s", "once on a machine"),
        *([("elements", str(cost.elements), "")] if cost.elements else []),
        ("steps", str(cost.steps), ""),
    ]
    if np.isfinite(cost.updates_per_second):
        rows.append(("element updates", f"{cost.updates_per_second / 1e6:.3g} million/s", ""))
    return rows


def form_table(result: PassResult) -> tuple[list[str], list[tuple[str, list[str]]]]:
    """What each simplification of the model moves the forces by: these in words, and a row a force, in percent of it,
    the root of the sum of the squares last. No rows where nothing is claimed."""
    share = lambda moved, name: f"{100 * moved / REPORTED[name].of(result):.1f}"
    signed = lambda row, name: f"{100 * row[name] / REPORTED[name].of(result):+.1f}" if name in row else "-"
    rows = [
        (
            result.scene.crossing.told(FORCES[name]),
            [signed(row, name) for row in result.form.values()] + [share(result.form_bar(name), name)],
        )
        for name in FORCES
        if np.isfinite(result.form_bar(name))
    ]
    return list(result.form), rows


def _form(result: PassResult) -> list[str]:
    """The same in lines of the terminal."""
    causes, rows = form_table(result)
    if not rows:
        return []
    lines = [f"  {name:<34}" + "".join(f"{one:>9}" for one in cells[:-1]) + f"{cells[-1]:>12}" for name, cells in rows]
    head = "".join(f"{f'({number})':>9}" for number in range(1, len(causes) + 1))
    legend = [f"  ({number}) {words}" for number, words in enumerate(causes, 1)]
    return ["", "form: what is left out moves a force by [%]", f"{'':36}{head}{'together':>12}", *lines, *legend]


def folder_report(folder: Path) -> str:
    """The result in a folder, or else how far its run is, or which runs lie below. Errors: FileNotFoundError when it
    holds none of them."""
    folder = Path(folder)
    if (folder / "result.json").is_file():
        figures = [f"  {path}" for path in sorted((folder / "figures").glob("*.png"))]
        return "\n".join([result_report(load(folder)), *(["", "figures", *figures] if figures else [])])
    below = sorted({path.parent for name in ("result.json", "status.json") for path in folder.glob(f"*/{name}")})
    if not (folder / "status.json").is_file() and below:
        return "\n".join([f"{folder}: {len(below)} run(s) below", *(f"  {_one_line(path)}" for path in below)])
    if not (folder / "status.json").is_file():
        raise FileNotFoundError(f"{folder}: holds neither a result nor a run; give the folder that run --out named")
    status = read_status(folder)
    left = where = ""
    if status["state"] == "running":
        left = f", eta {'unknown' if status['eta'] is None else duration(status['eta'])}"
        where = f", process {status['pid']} on {status['host']}" if "pid" in status else ""
    return (
        f"{folder}: {status['state']}, {status['percent']:.1f} %, step {status['step']}{left}, written"
        f" {status['updated']}{where}\n{status['message']}".rstrip()
    )


def _one_line(folder: Path) -> str:
    """The first line of a folder's report, or what is wrong with it."""
    try:
        first = folder_report(folder).partition("\n")[0]
    except ValueError as error:
        first = str(error)
    named = (f"{folder}:", f"{folder}{os.sep}")
    return first if first.startswith(named) else f"{folder}: {first}"
