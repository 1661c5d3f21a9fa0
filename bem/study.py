"""Convergence, speed against error, and scaling of the boundary elements: the numbers, and with --out their figures.

    python -m bem.study                              all studies, tables on the screen
    python -m bem.study --out study                  the same, with a CSV and a PNG each (needs matplotlib)
    python -m bem.study --profiles LOWER.csv UPPER.csv --load 4e6
                                                     the case study for two profiles of one's own: y, z in metres, with a comma
                                                     between, in one frame; the lower is fixed, the upper is pressed down [N/m]
    RAIL_FEM_SMOKE=1                                 three sizes each: the same paths in seconds

Times are processor time, the least of three runs. The thesis' counterparts: Figs. 5-10, 5-12, 5-14, 5-20 and Table 5-4.
"""
from __future__ import annotations

import argparse
import os
import time
import tracemalloc
from collections.abc import Callable
from pathlib import Path

import numpy as np

from bem.body import Body
from bem.boundary import solve_boundary
from bem.cases import CASES, LOAD
from bem.conformal import pin_clearance, pin_pressure
from bem.contact import Settings, solve_contact
from bem.contact_result import ContactResult
from bem.coulomb import Drive
from bem.curve import arc
from bem.hertz import line_contact
from bem.internal import Field, field_at, grid_below
from bem.material import STEEL, contact_modulus
from bem.mesh import Sizing, mesh_outline
from bem.outline import Edge, Outline, block_behind

MM = 1e-3
Table = tuple[list[str], np.ndarray]


def _sizes(*values: float) -> list[float]:
    """Element sizes [mm], coarse to fine; the first three in a smoke run."""
    return list(values[:3]) if os.environ.get("RAIL_FEM_SMOKE") else list(values)


def _timed(call: Callable, runs: int = 3):
    """Answer and least processor time [s] of some runs: on one core, with one BLAS thread, what a clock shows when nothing else runs."""
    best = np.inf
    for _ in range(1 if os.environ.get("RAIL_FEM_SMOKE") else runs):
        tick = time.process_time()
        answer = call()
        best = min(best, time.process_time() - tick)
    return answer, best


def solve_case(fixed: Body, moving: Body, drive: Drive, size: float) -> ContactResult:
    """Contact of a case at an element size [m]."""
    return solve_contact(fixed, moving, drive, settings=Settings(size=size))


def field_below(result: ContactResult, size: float) -> Field:
    """The thesis' internal domain in the fixed body below the contact: 20 mm wide, 15 mm deep, at a grid size [m]."""
    touched = result.interface.points[result.last.pressure > 0]
    middle = (touched[0] + touched[-1]) / 2
    grid = grid_below(result.fixed.body.outline, result.fixed.body.face, middle, 10 * MM, 15 * MM, size)
    return field_at(result.solution("fixed"), grid)


def boundary_convergence(fixed: Body, moving: Body, drive: Drive) -> Table:
    """Largest pressure and displacement against the boundary mesh; error against the finest, change against the one before."""
    rows = []
    for size in _sizes(1.0, 0.7, 0.5, 0.35, 0.25, 0.2, 0.14, 0.1, 0.07, 0.05):
        result, seconds = _timed(lambda: solve_case(fixed, moving, drive, size * MM))
        field = field_below(result, 0.5 * MM)
        rows.append([size, result.fixed.mesh.elements + result.moving.mesh.elements, result.last.pressure.max() / 1e6,
                     np.nanmin(field.displacement[..., 1]) / MM, seconds])
    return _with_errors(["size_mm", "elements", "pressure_MPa", "displacement_mm", "seconds"], np.array(rows), (2, 3))


def internal_convergence(fixed: Body, moving: Body, drive: Drive) -> Table:
    """Largest von Mises stress and displacement against the internal grid, at a boundary mesh of 0.2 mm."""
    result, rows = solve_case(fixed, moving, drive, 0.2 * MM), []
    for size in _sizes(1.0, 0.7, 0.5, 0.35, 0.25, 0.2, 0.14, 0.1, 0.07, 0.05):
        field, seconds = _timed(lambda: field_below(result, size * MM))
        rows.append([size, field.von_mises.size, np.nanmax(field.von_mises) / 1e6, np.nanmin(field.displacement[..., 1]) / MM, seconds])
    return _with_errors(["size_mm", "points", "von_mises_MPa", "displacement_mm", "seconds"], np.array(rows), (2, 3))


def _with_errors(names: list[str], rows: np.ndarray, columns: tuple[int, ...]) -> Table:
    """Append change (against the row before) and error (against the last row) of columns, in per cent."""
    for column in columns:
        values = rows[:, column]
        change = np.r_[np.nan, np.abs(np.diff(values) / values[:-1])] * 100
        error = np.abs(values / values[-1] - 1) * 100
        error[-1] = np.nan
        change[change == 0], error[error == 0] = np.nan, np.nan  # the same grid point: nothing to learn, and nothing for a log scale
        names = names + [f"change_{names[column].rsplit('_', 1)[0]}_pct", f"error_{names[column].rsplit('_', 1)[0]}_pct"]
        rows = np.column_stack([rows, change, error])
    return names, rows


def _disc(center: tuple[float, float], radius: float, top: bool) -> Body:
    begin = np.pi / 2 if top else -np.pi / 2
    return Body(Outline([[Edge(arc(center, radius, begin, begin + 2 * np.pi, 1441), "face")]]), STEEL, hub=center)


def _hertz_row(cells: float) -> tuple[float, float, float]:
    hertz = line_contact(178.9e3, 0.5, contact_modulus(STEEL, STEEL))
    lower, upper = _disc((0.0, -1.0), 1.0, False), _disc((0.0, 1.0), 1.0, True)
    result, seconds = _timed(lambda: solve_case(lower, upper, Drive.of(force=(None, -hertz.force)), hertz.half_width / cells))
    x, mass = result.interface.points[:, 0], result.interface.mass
    exact = hertz.pressure(x)
    miss = np.sqrt(np.sum(mass * (result.last.pressure - exact) ** 2) / np.sum(mass * exact**2))
    return miss, abs(result.last.pressure.max() / hertz.max_pressure - 1), seconds


def _pin_row(cells: float) -> tuple[float, float, float]:
    radius, clearance, angle = 0.05, 2e-5, np.pi / 3
    load = contact_modulus(STEEL, STEEL) * clearance / pin_clearance(angle)
    hole = Body(Outline([[Edge(arc((0, 0), radius, np.pi / 2, 2.5 * np.pi, 721), "face")]], infinite=True), STEEL)
    pin = _disc((0.0, 0.0), radius - clearance, True)
    result, seconds = _timed(lambda: solve_case(hole, pin, Drive.of(force=(None, -load)), radius * angle / cells))
    points, mass = result.interface.points, result.interface.mass
    exact = pin_pressure(np.arctan2(points[:, 0], -points[:, 1]), angle) * load / radius
    miss = np.sqrt(np.sum(mass * (result.last.pressure - exact) ** 2) / np.sum(mass * exact**2))
    return miss, abs(result.last.pressure.max() * radius / load / pin_pressure(0.0, angle) - 1), seconds


def speed_against_error(row: Callable[[float], tuple]) -> Table:
    """Time against the error of an exact solution, by elements to the half contact."""
    rows = []
    for cells in _sizes(3, 6, 12, 24, 48, 96):
        profile, peak, seconds = row(cells)
        rows.append([cells, 100 * profile, 100 * peak, seconds])
    return ["cells_to_half_contact", "error_L2_pct", "error_peak_pct", "seconds"], np.array(rows)


def scaling() -> Table:
    """Time and peak memory of one boundary value problem against its densities: a ring under pressure, its error at mid-wall."""
    from bem.boundary import Condition
    from bem.internal import stress_at
    ring, rows = Outline([[Edge(arc((0, 0), 2, 0, 2 * np.pi), "outer")], [Edge(arc((0, 0), 1, 0, 2 * np.pi), "inner")]]), []
    for size in _sizes(0.2, 0.1, 0.05, 0.025, 0.0125):
        mesh = mesh_outline(ring, Sizing(size))
        solution, seconds = _timed(lambda: solve_boundary(mesh, STEEL, {"inner": Condition(traction=(-1e6, None), local=True)}), runs=2)
        tracemalloc.start()
        solve_boundary(mesh, STEEL, {"inner": Condition(traction=(-1e6, None), local=True)})
        peak = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        hoop = stress_at(solution, np.array([[1.5, 0.0]]))[0, 1]
        rows.append([mesh.densities, seconds, peak / 1e6, abs(hoop / (1e6 / 3 * (1 + 4 / 2.25)) - 1) * 100])
    return ["densities", "seconds", "peak_MB", "error_hoop_pct"], np.array(rows)


def one_case(fixed: Body, moving: Body, drive: Drive) -> Table:
    """The whole of one case at the thesis' 0.2 mm: zone, meshes, contact and internal field (the thesis: 404 to 640 s)."""
    def whole():
        result = solve_case(fixed, moving, drive, 0.2 * MM)
        return result, field_below(result, 0.2 * MM)

    whole()
    (result, field), total = _timed(whole, runs=5)
    _, contact = _timed(lambda: solve_case(fixed, moving, drive, 0.2 * MM), runs=5)
    row = [contact, total, result.last.pressure.max() / 1e6, np.nanmax(field.von_mises) / 1e6, np.nanmin(field.displacement[..., 1]) / MM,
           field.von_mises.size]
    return ["contact_s", "with_field_s", "pressure_MPa", "von_mises_MPa", "displacement_mm", "points"], np.array([row])


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
    return (Body(block_behind(below, below[:, 1].min() - 0.06), STEEL), Body(block_behind(above, above[:, 1].max() + 0.06), STEEL))


def _print(title: str, table: Table) -> None:
    names, rows = table
    print(f"\n{title}\n  " + "  ".join(f"{name:>14}" for name in names))
    for row in rows:
        print("  " + "  ".join(f"{value:14.5g}".rjust(max(14, len(name))) for value, name in zip(row, names)), flush=True)


def main(arguments: list[str] | None = None) -> None:
    """Run the studies; see the module's docstring."""
    parser = argparse.ArgumentParser(prog="python -m bem.study", description="convergence, speed against error, scaling")
    parser.add_argument("--out", type=Path, help="folder for CSV and PNG files")
    parser.add_argument("--profiles", type=Path, nargs=2, metavar=("LOWER", "UPPER"),
                        help="two profiles (y, z in metres) instead of the three cases")
    parser.add_argument("--load", type=float, default=4e6, help="load for --profiles, N per m of thickness")
    options = parser.parse_args(arguments)
    if options.profiles:
        cases = {"profiles": (*profile_case(*options.profiles), Drive.of(force=(None, -options.load)))}
    else:
        cases = {name: (*case(), LOAD) for name, case in CASES.items()}
    work = {}
    for name, case in cases.items():
        work[f"{name}: one case at 0.2 mm"] = lambda case=case: one_case(*case)
        work[f"{name}: boundary mesh"] = lambda case=case: boundary_convergence(*case)
        work[f"{name}: internal grid"] = lambda case=case: internal_convergence(*case)
    if not options.profiles:
        work["Hertz line contact: speed against error"] = lambda: speed_against_error(_hertz_row)
        work["pin in hole, 60 degrees: speed against error"] = lambda: speed_against_error(_pin_row)
        work["ring: scaling"] = scaling
    tables = {}
    for title, study in work.items():
        tables[title] = study()
        _print(title, tables[title])
    if options.out:
        from bem.figures import draw_fields, draw_tables, write_tables
        options.out.mkdir(parents=True, exist_ok=True)
        files = write_tables(options.out, tables) + draw_tables(options.out, tables)
        for name, case in cases.items():
            result = solve_case(*case, 0.2 * MM)
            files += draw_fields(options.out, name, result, field_below(result, 0.2 * MM))
        print("\nwritten: " + ", ".join(str(file) for file in files))


if __name__ == "__main__":
    main()
