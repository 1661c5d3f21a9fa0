"""A crossing from a STEP file: sliced into as many sections as a tolerance asks for."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from geometry.cad.step_slices import faces_by_body, opened_step, slice_face, tabulated, upper_line
from geometry.meshing.gmsh_process import in_gmsh_process
from geometry.surfaces.crossing import CrossingError
from geometry.surfaces.measured_crossing import FEWEST
from geometry.surfaces.section_cuts import LEAST_STEP, cut_stations

INSIDE = 1e-6  # of the first and last section from the ends of the shapes [m]
LARGEST_EXTENT = 200.0  # of a shape along the track [m]
ROUNDED = 10  # digits of a metre: what is left of a sum's order must not make another crossing


@dataclass(frozen=True)
class StepReading:
    """How a STEP file is read. named : by bodies named "wing" and "nose", else the highest of all faces;  tolerance :
    between sections [m]"""

    named: bool = True
    tolerance: float = 10e-6


def read_step(path: Path, reading: StepReading = StepReading()) -> tuple[np.ndarray, list[np.ndarray]]:
    """Stations x (m,) and sections (n, 2) of y, z up [m] as the file has them.

    Errors: CrossingError for what is no STEP, has not the named bodies, or no face across the track; MeshError where
    Gmsh ends or hangs.
    """
    return in_gmsh_process(_read, str(path), reading)


def _read(path: str, reading: StepReading) -> tuple[np.ndarray, list[np.ndarray]]:
    with opened_step(Path(path)) as gmsh:
        by_body = faces_by_body(gmsh, Path(path), reading.named)
        tags = [tag for found in by_body.values() for tag in found]
        boxes = np.array([gmsh.model.getBoundingBox(2, tag) for tag in tags])
        if not FEWEST * LEAST_STEP < np.ptp(boxes[:, [0, 3]]) < LARGEST_EXTENT:
            raise CrossingError(
                f"{path}: its shapes reach from x = {boxes[:, 0].min():g} to {boxes[:, 3].max():g} m: is x along the"
                " track, and the file's unit right?"
            )
        faces = [tabulated(gmsh, tag) for tag in tags]
        low = min(float(face.points[..., 0].min()) for face in faces) + INSIDE
        high = max(float(face.points[..., 0].max()) for face in faces) - INSIDE

        def section_at(x: float) -> np.ndarray:
            line = upper_line(np.concatenate([slice_face(gmsh, face, x) for face in faces]))
            if not len(line):
                raise CrossingError(f"{path}: no face is cut at x = {x:g} m: the running surface has a gap there")
            return np.round(line, ROUNDED)

        edges = tuple(float(end) for face in faces for end in _ends(face))
        x, sections = cut_stations(section_at, low, high, reading.tolerance, edges)
    return np.round(x, ROUNDED), sections


def _ends(face) -> tuple[float, float]:
    """x just inside both ends of a face [m]."""
    x = face.points[..., 0]
    return x.min() + INSIDE, x.max() - INSIDE
