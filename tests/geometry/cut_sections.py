"""Sections cut from the parametric crossing and written as a .slcs with one .prr each: what measured sections are,
without anybody's file."""

from pathlib import Path

import numpy as np

from geometry.surfaces.crossing import CastCrossing
from tests.geometry.faulty_profiles import simpack, written

MM = 1e-3
FLOOR = -55 * MM


def cut_points(crossing: CastCrossing, x: float, spacing: float = 0.2 * MM) -> np.ndarray:
    """(n, 2)  y, z of the section of a crossing at x [m], the floor between and beside its bodies."""
    y = np.arange(-60 * MM, 110 * MM, spacing)
    nose = crossing.top_height(x, y, "nose") if x >= crossing.nose_x else np.full(len(y), np.nan)
    z = np.nan_to_num(np.fmax(crossing.top_height(x, y, "wing"), np.fmax(nose, FLOOR)), nan=FLOOR)
    return np.column_stack([y, z])


def write_cut_sections(folder: Path, stations: np.ndarray, number: float = 9.25, spacing: float = 0.2 * MM) -> Path:
    """crossing.slcs in `folder`: sections of the 1:number crossing at stations (m,) [m], points `spacing` apart in
    y."""
    crossing = CastCrossing(number)
    for k, x in enumerate(stations, 1):
        written(
            folder / "cut" / f"section_{k}.prr",
            simpack(cut_points(crossing, x, spacing) / MM, "rail", f"% x = {x / MM:.2f} mm\n"),
        )
    names = "".join(f"  {x / MM:10.3f} 'cut/section_{k}.prr'\n" for k, x in enumerate(stations, 1))
    head = "% cut from the parametric crossing\n 0.0 1.0 S_OFFSET [mm], S_SCALE [mm/mm]\n"
    counts = f" {len(stations)} NSLC\n 0 0 0 NFEAT, NKINK, NACCEL\n 1 S_METHOD\n\n"
    return written(folder / "crossing.slcs", head + counts + names)
