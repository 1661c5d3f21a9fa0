"""A scene's crossing as a folder of two-column sections with their stations, or as STEP: what families "sections" and
"step" read."""

from pathlib import Path

import numpy as np

from geometry.cad.step_writer import step_text
from geometry.surfaces.any_crossing import AnyCrossing
from geometry.surfaces.section_cuts import cut_section, cut_stations
from rail_fem.files.atomic import write_text_atomically
from rail_fem.scene.section_files import STATIONS

PLAIN_BEFORE = 0.6  # of the plain rail before the leg that is written unless told otherwise [m]
BEHIND_NOSE = 1.1  # of the crossing behind the nose's begin [m]
AFTER_EDGE = 1e-6  # behind the position where the nose begins, so that the first section of it holds it [m]


def written_range(crossing: AnyCrossing, low: float | None, high: float | None) -> tuple[float, float]:
    """Where a crossing is cut [m]: from plain rail to behind the nose, or as told. Errors: ValueError."""
    first, last = crossing.x_range
    nose = crossing.nose_x if np.isfinite(crossing.nose_x) else last
    low = max(first, crossing.leg_range[0] - PLAIN_BEFORE) if low is None else low
    high = min(last, nose + BEHIND_NOSE) if high is None else high
    if not first <= low < high <= last:
        raise ValueError(
            f"from x = {1e3 * low:g} to {1e3 * high:g} mm cannot be cut: the crossing reaches from {1e3 * first:g} to"
            f" {1e3 * last:g} mm"
        )
    return low, high


def crossing_sections(
    crossing: AnyCrossing, low: float, high: float, tolerance: float
) -> tuple[np.ndarray, list[np.ndarray]]:
    """Stations x (m,) and sections (n, 2) of y, z [m] through which the crossing is met to a tolerance [m]. Errors:
    CrossingError."""
    edges = (*crossing.leg_range, crossing.knuckle_x, crossing.nose_x + AFTER_EDGE)
    return cut_stations(lambda x: cut_section(crossing, x), low, high, tolerance, edges)


def write_section_folder(folder: Path, x: np.ndarray, sections: list[np.ndarray], title: str) -> None:
    """Two-column files in mm and their list of stations, written last. Errors: FileExistsError where the folder holds
    something; OSError."""
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    if any(folder.iterdir()):
        raise FileExistsError(f"{folder} is not empty: name another folder")
    names = [f"section_{k:04d}.txt" for k in range(1, len(x) + 1)]
    for name, at, points in zip(names, x, sections):
        rows = [f"{1e3 * y:.6f} {1e3 * z:.6f}" for y, z in points]
        head = ["# unit: mm", f"# {title}, x = {1e3 * at:.6f} mm: y to the wing's field side, z up"]
        write_text_atomically(folder / name, "\n".join([*head, *rows]) + "\n")
    rows = [f"{name}, {1e3 * at:.6f}" for name, at in zip(names, x)]
    write_text_atomically(folder / STATIONS, "\n".join(["# unit: mm", "file, x", *rows]) + "\n")


def write_step(path: Path, crossing: AnyCrossing, x: np.ndarray) -> None:
    """Surfaces of wing and nose through their outlines at stations x (m,) [m]. Errors: CrossingError, OSError."""
    Path(path).parent.mkdir(parents=True, exist_ok=True)
    write_text_atomically(path, step_text(crossing, x))
