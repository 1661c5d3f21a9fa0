"""Convergence, speed against error, and scaling of the boundary elements: the numbers, and with --out their figures.

    python -m bem.verification.plane_study                              all studies, tables on the screen
    python -m bem.verification.plane_study --out study                  the same, with a CSV and a PNG each (needs
    matplotlib) python -m bem.verification.plane_study --profiles LOWER.csv UPPER.csv --load 4e6
                                                     the case study for two profiles of one's own: y, z in metres, with
                                                     a comma between, in one frame; the lower is fixed, the upper is
                                                     pressed down [N/m]
    RAIL_FEM_SMOKE=1                                 three sizes each: the same paths in seconds

Times are processor time, the least of three runs. The thesis' counterparts: Figs. 5-10, 5-12, 5-14, 5-20 and Table 5-4.
"""

from __future__ import annotations

import argparse
import os
import time
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path

import numpy as np

from bem.material import STEEL
from bem.plane.body import Body
from bem.plane.boundary import Condition, solve_boundary
from bem.plane.contact import Settings, solve_contact
from bem.plane.contact_result import ContactResult
from bem.plane.coulomb import Control
from bem.plane.internal import Field, field_at, grid_below, stress_at
from bem.plane.mesh import Sizing, mesh_outline
from bem.plane.outline import block_behind
from bem.verification.cases import CASES, LOAD
from bem.verification.exact_problems import hertz_errors, pin_errors, ring

MM = 1e-3
Table = tuple[list[str], np.ndarray]
Case = tuple[Body, Body, Control]


def _sizes(*values: float) -> list[float]:
    """Element sizes [mm], coarse to fine; the first three in a smoke run."""
    return list(values[:3]) if os.environ.get("RAIL_FEM_SMOKE") else list(values)


def _timed(call: Callable, runs: int = 3):
    """Answer and least processor time [s] of some runs: on one core, with one BLAS thread, what a clock shows when
    nothing else runs."""
    best = np.inf
    for _ in range(1 if os.environ.get("RAIL_FEM_SMOKE") else runs):
        tick = time.process_time()
        answer = call()
        best = min(best, time.process_time() - tick)
    return answer, best


def solve_case(fixed: Body, moving: Body, control: Control, size: float) -> ContactResult:
    """Contact of a case at an element size [m]."""
    return solve_contact(fixed, moving, control, settings=Settings(size=size))


def field_below(result: ContactResult, size: float) -> Field:
    """The thesis' internal domain in the fixed body below the contact: 20 mm wide, 15 mm deep, at a grid size [m]."""
    touched = result.interface.points[result.last.pressure > 0]
    middle = (touched[0] + touched[-1]) / 2
    grid = grid_below(result.fixed.body.outline, result.fixed.body.face, middle, 10 * MM, 15 * MM, size)
    return field_at(result.solution("fixed"), grid)


def boundary_convergence(fixed: Body, moving: Body, control: Control) -> Table:
    """Largest pressure and displacement against the boundary mesh; error against the finest, change against the one
    before."""
    rows = []
    for size in _sizes(1.0, 0.7, 0.5, 0.35, 0.25, 0.2, 0.14, 0.1, 0.07, 0.05):
        result, seconds = _timed(lambda: solve_case(fixed, moving, control, size * MM))
        field = field_below(result, 0.5 * MM)
        rows.append(
            [
                size,
                result.fixed.mesh.elements + result.moving.mesh.elements,
                result.last.pressure.max() / 1e6,
                np.nanmin(field.displacement[..., 1]) / MM,
                seconds,
            ]
        )
    return _with_errors(["size_mm", "elements", "pressure_MPa", "displacement_mm", "seconds"], np.array(rows), (2, 3))


def internal_convergence(fixed: Body, moving: Body, control: Control) -> Table:
    """Largest von Mises stress and displacement against the internal grid, at a boundary mesh of 0.2 mm."""
    result, rows = solve_case(fixed, moving, control, 0.2 * MM), []
    for size in _sizes(1.0, 0.7, 0.5, 0.35, 0.25, 0.2, 0.14, 0.1, 0.07, 0.05):
        field, seconds = _timed(lambda: field_below(result, size * MM))
        rows.append(
            [
                size,
                field.von_mises.size,
                np.nanmax(field.von_mises) / 1e6,
                np.nanmin(field.displacement[..., 1]) / MM,
                seconds,
            ]
        )
    return _with_errors(["size_mm", "points", "von_mises_MPa", "displacement_mm", "seconds"], np.array(rows), (2, 3))


def _with_errors(names: list[str], rows: np.ndarray, columns: tuple[int, ...]) -> Table:
    """Append change (against the row before) and error (against the last row) of columns, in per cent."""
    for column in columns:
        values = rows[:, column]
        change = np.r_[np.nan, np.abs(np.diff(values) / values[:-1])] * 100
        error = np.abs(values / values[-1] - 1) * 100
        error[-1] = np.nan
        names = names + [
            f"change_{names[column].rsplit('_', 1)[0]}_pct",
            f"error_{names[column].rsplit('_', 1)[0]}_pct",
        ]
        rows = np.column_stack([rows, change, error])
    return names, rows


def speed_against_error(errors: Callable[[float], tuple[float, float]]) -> Table:
    """Time against the error of an exact solution, by elements to the half contact; errors: of the largest pressure and
    of the profile."""
    rows = []
    for cells in _sizes(3, 6, 12, 24, 48, 96):
        (peak, profile), seconds = _timed(lambda: errors(cells))
        rows.append([cells, 100 * profile, 100 * peak, seconds])
    return ["cells_to_half_contact", "error_L2_pct", "error_peak_pct", "seconds"], np.array(rows)


def _resident_peak() -> float:
    """Highest resident memory of this process [bytes] since the last call; nan where the system does not tell (all but
    Linux)."""
    try:
        highest = next(line for line in Path("/proc/self/status").read_text().splitlines() if line.startswith("VmHWM"))
        Path("/proc/self/clear_refs").write_text("5")
    except (OSError, StopIteration):
        return np.nan
    return 1024.0 * int(highest.split()[1])


def ring_cost(size: float) -> list[float]:
    """Densities, processor time [s], peak memory [MB] and error of the hoop stress at mid-wall [%] of a ring under
    pressure."""
    load = {"inner": Condition(traction=(-1e6, None), local=True)}
    solve_boundary(mesh_outline(ring(), Sizing(0.5)), STEEL, load)  # compiles outside the measurement
    mesh = mesh_outline(ring(), Sizing(size))
    _resident_peak()
    before = _resident_peak()
    solution, seconds = _timed(lambda: solve_boundary(mesh, STEEL, load), runs=1)
    taken = _resident_peak() - before
    hoop = stress_at(solution, np.array([[1.5, 0.0]]))[0, 1]
    return [mesh.densities, seconds, taken / 1e6, abs(hoop / (1e6 / 3 * (1 + 4 / 2.25)) - 1) * 100]


def scaling() -> Table:
    """Time and peak memory of one boundary value problem against its densities, each in a process of its own, so that
    no memory freed before hides what it takes."""
    rows = []
    for size in _sizes(0.1, 0.05, 0.025, 0.0125, 0.00625):
        with ProcessPoolExecutor(1, get_context("spawn")) as alone:
            rows.append(alone.submit(ring_cost, size).result())
    return ["densities", "seconds", "peak_MB", "error_hoop_pct"], np.array(rows)


def one_case(fixed: Body, moving: Body, control: Control) -> Table:
    """The whole of one case at the thesis' 0.2 mm: zone, meshes, contact and internal field (the thesis: 404 to 640
    s)."""

    def whole():
        result = solve_case(fixed, moving, control, 0.2 * MM)
        return result, field_below(result, 0.2 * MM)

    whole()
    (result, field), total = _timed(whole, runs=5)
    _, contact = _timed(lambda: solve_case(fixed, moving, control, 0.2 * MM), runs=5)
    row = [
        contact,
        total,
        result.last.pressure.max() / 1e6,
        np.nanmax(field.von_mises) / 1e6,
        np.nanmin(field.displacement[..., 1]) / MM,
        field.von_mises.size,
    ]
    return ["contact_s", "with_field_s", "pressure_MPa", "von_mises_MPa", "displacement_mm", "points"], np.array([row])


EXACT = {
    "Hertz line contact: speed against error": lambda: speed_against_error(hertz_errors),
    "pin in hole, 60 degrees: speed against error": lambda: speed_against_error(
        lambda cells: pin_errors(cells, np.pi / 3)
    ),
    "ring: scaling": scaling,
}


def read_profile(path: Path) -> np.ndarray:
    """Points (n, 2) [m] of a comma-separated file of y, z; lines that start with # are comments."""
    points = np.genfromtxt(path, delimiter=",", comments="#")
    points = points[np.isfinite(points).all(axis=1)] if points.ndim == 2 else points
    if points.ndim != 2 or points.shape[1] != 2 or len(points) < 2:
        raise ValueError(f"{path}: no two columns of numbers y, z [m] in it")
    if np.ptp(points[:, 0]) > 1:
        raise ValueError(f"{path}: y spans {np.ptp(points[:, 0]):g} m; are these millimetres?")
    return points


def profile_case(lower: Path, upper: Path) -> tuple[Body, Body]:
    """Blocks behind two profiles, held 60 mm from their lowest and highest points."""
    below, above = read_profile(lower), read_profile(upper)
    return (
        Body(block_behind(below, below[:, 1].min() - 0.06), STEEL),
        Body(block_behind(above, above[:, 1].max() + 0.06), STEEL),
    )


def _print(title: str, table: Table) -> None:
    names, rows = table
    print(f"\n{title}\n  " + "  ".join(f"{name:>14}" for name in names))
    for row in rows:
        print(
            "  " + "  ".join(f"{value:14.5g}".rjust(max(14, len(name))) for value, name in zip(row, names)), flush=True
        )


def study(cases: dict[str, Case], out: Path | None, others: dict[str, Callable[[], Table]]) -> None:
    """Study cases (name -> fixed body, moving body, control) and others (title -> table); print all, and write them
    into the folder `out`."""
    work = {}
    for name, case in cases.items():
        work[f"{name}: one case at 0.2 mm"] = lambda case=case: one_case(*case)
        work[f"{name}: boundary mesh"] = lambda case=case: boundary_convergence(*case)
        work[f"{name}: internal grid"] = lambda case=case: internal_convergence(*case)
    tables = {}
    for title, measure in (work | others).items():
        tables[title] = measure()
        _print(title, tables[title])
    if out:
        from bem.verification.figures import draw_fields, draw_tables, write_tables

        out.mkdir(parents=True, exist_ok=True)
        files = write_tables(out, tables) + draw_tables(out, tables)
        for name, case in cases.items():
            result = solve_case(*case, 0.2 * MM)
            files.append(draw_fields(out, name, result, field_below(result, 0.2 * MM)))
        print("\nwritten: " + ", ".join(str(file) for file in files))


def main(arguments: list[str] | None = None) -> None:
    """Run the studies; see the module's docstring."""
    parser = argparse.ArgumentParser(
        prog="python -m bem.verification.plane_study", description="convergence, speed against error, scaling"
    )
    parser.add_argument("--out", type=Path, help="folder for CSV and PNG files")
    parser.add_argument(
        "--profiles",
        type=Path,
        nargs=2,
        metavar=("LOWER", "UPPER"),
        help="two profiles (y, z in metres) instead of the three cases",
    )
    parser.add_argument("--load", type=float, default=4e6, help="load for --profiles, N per m of thickness")
    options = parser.parse_args(arguments)
    if options.profiles:
        study(
            {"profiles": (*profile_case(*options.profiles), Control.of(force=(None, -options.load)))}, options.out, {}
        )
    else:
        study({name: (*case(), LOAD) for name, case in CASES.items()}, options.out, EXACT)


if __name__ == "__main__":
    main()
