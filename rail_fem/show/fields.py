"""The fields of a run as figures need them: read from its VTU file, and cut to what is seen from above or in a
section."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from geometry.meshing.cell_measures import EDGES
from geometry.meshing.hexmesh import boundary_faces
from geometry.surfaces.bodies import CROSSING
from rail_fem.result.fields import Fields, FieldsError, field_file, read_fields

SEEN = 0.05  # a face is seen from above when the upward part of its unit normal exceeds this


def read_crossing(folder: Path) -> Fields:
    """Wing and nose, with all nodes, from the last fields of a run. Errors: FieldsError."""
    path = field_file(folder)
    found = read_fields(path)
    crossing = np.isin(found.region, CROSSING)
    if not crossing.any():
        raise FieldsError(
            f"{path}: none of its {len(found.region)} cells belongs to wing (region 0) or nose (region 1)"
        )
    of_cells = ("cells", "region", "plastic_strain", "stress")
    return replace(found, **{name: getattr(found, name)[crossing] for name in of_cells})


def faces_from_above(points: np.ndarray, cells: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Outer faces that look upwards, lowest first, so that drawn in this order the upper hide the lower.

    Returns faces (k, 4) and the cell of each (k,).
    """
    faces, owner = boundary_faces(cells)
    corner = points[faces]
    normal = np.cross(corner[:, 2] - corner[:, 0], corner[:, 3] - corner[:, 1])
    up = normal[:, 2] > SEEN * np.linalg.norm(normal, axis=1)
    order = np.argsort(corner[up, :, 2].mean(axis=1), kind="stable")
    return faces[up][order], owner[up][order]


def cut_at(points: np.ndarray, cells: np.ndarray, x: float) -> tuple[list[np.ndarray], np.ndarray]:
    """Section of hexahedra by the plane x: polygons [(corners, 2) y, z in m] and the cell of each (k,).

    Nodes in the plane count as just before it, so a plane of nodes cuts the cells behind it once.
    """
    side = points[cells, 0] > x
    cut = np.flatnonzero(side.any(axis=1) & ~side.all(axis=1))
    ends = cells[cut][:, EDGES]
    before, after = points[ends[..., 0]], points[ends[..., 1]]
    crosses = (before[..., 0] > x) != (after[..., 0] > x)
    run = np.where(crosses, after[..., 0] - before[..., 0], 1.0)
    at = before + ((x - before[..., 0]) / run)[..., None] * (after - before)
    polygons = [_round_polygon(at[i][crosses[i]][:, 1:]) for i in range(len(cut))]
    return polygons, cut


def _round_polygon(corners: np.ndarray) -> np.ndarray:
    """Corners (k, 2) in the order of their angle about their mean: the outline of a convex polygon."""
    away = corners - corners.mean(axis=0)
    return corners[np.argsort(np.arctan2(away[:, 1], away[:, 0]))]


def depth_below(polygons: list[np.ndarray], position: np.ndarray) -> float:
    """How far the section's upper outline stands above a point (2,) y, z of it [m]."""
    y, z = position
    start = np.concatenate(polygons)
    run, rise = (np.concatenate([np.roll(polygon, -1, axis=0) for polygon in polygons]) - start).T
    along = y - start[:, 0]
    over = (np.minimum(run, 0.0) <= along) & (along <= np.maximum(run, 0.0)) & (run != 0.0)
    height = start[over, 1] + along[over] / run[over] * rise[over]
    return float(height.max(initial=z) - z)
