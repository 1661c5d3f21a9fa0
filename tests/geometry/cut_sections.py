"""Sections cut from the parametric crossing and written as a .slcs with one .prr each: what measured sections are,
without anybody's file."""

from pathlib import Path

import numpy as np

from geometry.surfaces.crossing import CastCrossing
from tests.geometry.faulty_profiles import simpack, written

MM = 1e-3
FLOOR = -55 * MM


def write_cut_sections(folder: Path, stations: np.ndarray, number: float = 9.25, spacing: float = 0.2 * MM) -> Path:
    """crossing.slcs in `folder`: sections of the 1:number crossing at stations (m,) [m], points `spacing` apart in
    y."""
    crossing, y = CastCrossing(number), np.arange(-60 * MM, 110 * MM, spacing)
    for k, x in enumerate(stations, 1):
        nose = crossing.top_height(x, y, "nose") if x >= crossing.nose_x else np.full(len(y), np.nan)
        z = np.nan_to_num(np.fmax(crossing.top_height(x, y, "wing"), np.fmax(nose, FLOOR)), nan=FLOOR)
        written(
            folder / "cut" / f"section_{k}.prr",
            simpack(np.column_stack([y, z]) / MM, "rail", f"% x = {x / MM:.2f} mm\n"),
        )
    names = "".join(f"  {x / MM:10.3f} 'cut/section_{k}.prr'\n" for k, x in enumerate(stations, 1))
    return written(
        folder / "crossing.slcs",
        f"% cut from the parametric crossing\n 0.0 1.0 S_OFFSET [mm], S_SCALE [mm/mm]\n {len(stations)} NSLC\n 0 0 0"
        f" NFEAT, NKINK, NACCEL\n 1 S_METHOD\n\n{names}",
    )
