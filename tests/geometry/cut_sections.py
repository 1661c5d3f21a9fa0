"""Sections cut from the parametric crossing and written as a .slcs with one .prr each: what measured sections are,
without anybody's file."""

from pathlib import Path

import numpy as np

from geometry.surfaces.crossing import CastCrossing
from geometry.surfaces.section_cuts import cut_section
from tests.geometry.faulty_profiles import simpack, written

MM = 1e-3


def write_cut_sections(folder: Path, stations: np.ndarray, number: float = 9.25, spacing: float = 0.2 * MM) -> Path:
    """crossing.slcs in `folder`: sections of the 1:number crossing at stations (m,) [m], points `spacing` apart in
    y."""
    crossing = CastCrossing(number)
    for k, x in enumerate(stations, 1):
        written(
            folder / "cut" / f"section_{k}.prr",
            simpack(cut_section(crossing, x, spacing) / MM, "rail", f"% x = {x / MM:.2f} mm\n"),
        )
    names = "".join(f"  {x / MM:10.3f} 'cut/section_{k}.prr'\n" for k, x in enumerate(stations, 1))
    head = "% cut from the parametric crossing\n 0.0 1.0 S_OFFSET [mm], S_SCALE [mm/mm]\n"
    counts = f" {len(stations)} NSLC\n 0 0 0 NFEAT, NKINK, NACCEL\n 1 S_METHOD\n\n"
    return written(folder / "crossing.slcs", head + counts + names)
