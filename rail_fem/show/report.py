"""What the terminal shows: a result, or how far the run in a folder is."""

import os
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from rail_fem.output.events import flights, stated_peaks
from rail_fem.output.history import COLUMNS
from rail_fem.output.low_pass import CUTOFFS, filtered_peak
from rail_fem.output.progress import duration, read_status
from rail_fem.output.quantities import FORCES, REPORTED, impact_pressure
from rail_fem.output.result import PassResult, load
from rail_fem.scene.units import engineering, show
from rail_fem.show.metal import amount, metal_rows, with_bar
from rail_fem.show.passes import passes_rows

MOST_FLIGHTS = 5  # that are told
BEARER_HEADS = ("bearer", "x [mm]", "pad [kN]", "uplift [kN]", "ballast [kN]", "down [mm]", "")


def listed(what: str, texts: Sequence[str]) -> list[str]:
    """How many there are, and each in a line of its own."""
    return ["", f"{len(texts)} {what}", *(f"  {text}" for text in texts)]


def row(name: str, value: str, text: str = "") -> str:
    return f"  {name:<34}{value:<17} {text}".rstrip()


def _state(result: PassResult) -> str:
    if result.fault:
        return f"FAILED: {result.fault}"
    return f"CUT OFF: {result.cut_off}" if result.cut_off else "finished"


def _flights(result: PassResult) -> list[str]:
    """Where the wheel leaves the crossing, the longest first; nothing for a model that has no history."""
    found = sorted(flights(result), key=lambda flight: -flight.length) if len(result.history["x"]) else []
    rows = [
        row(
            f"{show(flight.x_start, 'mm', 5)} to {show(flight.x_end, 'mm', 5)}",
            f"{flight.length * 1e3:.1f} mm",
            f"{flight.duration * 1e3:.2f} ms, launched at {flight.launch_speed:.2f} m/s upwards",
        )
        for flight in found[:MOST_FLIGHTS]
    ]
    more = [row("shorter ones", str(len(found) - MOST_FLIGHTS))] if len(found) > MOST_FLIGHTS else []
    return ["", "flights without contact", *rows, *more] if found else []


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
    shown = COLUMNS["x"].unit
    pressure = "" if np.isnan(impact_pressure(result)) else with_bar(result, "impact_pressure")
    lines = [f"{result.model}: " + _state(result), "", "peaks"]
    for name, peak in stated_peaks(result).items():
        lines.append(
            row(
                name,
                with_bar(result, name, 5) if name in FORCES else engineering(peak.value, peak.unit),
                (f"form +- {amount(form, peak.unit, 2)} " if np.isfinite(form := result.form_bar(name)) else "")
                + (f"at x = {show(peak.x, shown, 5)}" if np.isfinite(peak.x) else "")
                + (f", y = {show(peak.y, shown, 4)}" if np.isfinite(peak.y) else "")
                + (f", in an element of {show(peak.size, shown, 2)}" if np.isfinite(peak.size) else ""),
            )
        )
    lines += [
        row(f"force low-passed at {cutoff:g} Hz", engineering(low.value, "N"), f"at x = {show(low.x, shown, 5)}")
        for cutoff in CUTOFFS
        if (low := filtered_peak(result, cutoff)) is not None
    ]
    lines += _flights(result) + [
        "",
        row(
            "transfer from wing to nose",
            "none" if np.isnan(result.transfer_x) else f"x = {with_bar(result, 'transfer_x', 5)}",
        ),
        *(["", "passes"] if result.passes else []),
        *passes_rows(result),
        *([row("mean pressure at the first impact", pressure, "of contact, weighted by force")] if pressure else []),
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
    cost = result.cost
    lines += [
        "",
        "cost",
        row("wall time", duration(cost.wall_time), f"{cost.ranks} rank(s)"),
        row("  the model itself", f"{cost.solve_time:.3g} s"),
        row("  contacts searched, or meshed", f"{cost.search_time:.3g} s", "kept for scenes of the same surfaces"),
        row("  kernels compiled", f"{cost.compile_time:.3g} s", "once on a machine"),
        *([row("elements", str(cost.elements))] if cost.elements else []),
        row("steps", str(cost.steps)),
    ]
    if np.isfinite(cost.updates_per_second):
        lines.append(row("element updates", f"{cost.updates_per_second / 1e6:.3g} million/s"))
    return "\n".join(
        [*lines, *listed("warning(s)", result.warnings), *(listed("note(s)", result.notes) if result.notes else [])]
    )


def _form(result: PassResult) -> list[str]:
    """What each simplification of the model moves the forces by, and the root of the sum of the squares."""
    shown = [name for name in FORCES if np.isfinite(result.form_bar(name))]
    if not shown:
        return []
    cell = lambda moved, name: f"{100 * moved / REPORTED[name].of(result):+9.1f}"
    lines = [
        f"  {FORCES[name]:<34}"
        + "".join(cell(row[name], name) if name in row else f"{'-':>9}" for row in result.form.values())
        + f"{100 * result.form_bar(name) / REPORTED[name].of(result):12.1f}"
        for name in shown
    ]
    head = "".join(f"{f'({number})':>9}" for number in range(1, len(result.form) + 1))
    legend = [f"  ({number}) {words}" for number, words in enumerate(result.form, 1)]
    return ["", "form: what is left out moves a force by [%]", f"{'':36}{head}{'together':>12}", *lines, *legend]


def folder_report(folder: Path) -> str:
    """The result in a folder, or else how far its run is, or which runs lie below. Errors: FileNotFoundError when it
    holds none of them."""
    folder = Path(folder)
    if (folder / "result.json").is_file():
        figures = sorted(path for path in (folder / "figures").glob("*.png")) if (folder / "figures").is_dir() else []
        return "\n".join(
            [result_report(load(folder)), *(["", "figures", *(f"  {path}" for path in figures)] if figures else [])]
        )
    below = sorted({path.parent for name in ("result.json", "status.json") for path in folder.glob(f"*/{name}")})
    if not (folder / "status.json").is_file() and below:
        return "\n".join([f"{folder}: {len(below)} run(s) below", *(f"  {_one_line(path)}" for path in below)])
    if not (folder / "status.json").is_file():
        raise FileNotFoundError(f"{folder}: holds neither a result nor a run; give the folder that run --out named")
    status = read_status(folder)
    left = (
        ""
        if status["state"] != "running"
        else f", eta {'unknown' if status['eta'] is None else duration(status['eta'])}"
    )
    where = f", process {status['pid']} on {status['host']}" if status["state"] == "running" and "pid" in status else ""
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
