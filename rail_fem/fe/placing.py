"""The wheel's mesh set down on the crossing's: along the rigid path first, then by the gap between the meshes themselves."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.spatial import cKDTree

from geometry.axes import GAUGE_POINT_DEPTH
from geometry.crossing import CastCrossing
from geometry.mesh import HexMesh, merge_bodies
from geometry.mesh_loft import BodyMeshSpec, CrossingMeshSpec
from geometry.path import WheelPath
from rail_fem.fe import contact_kernel as kernel
from rail_fem.fe.contact import Surface, edge_neighbours

FARTHEST = 20e-3  # surface nodes farther apart than this are not compared [m]
EDGE = 1e-3  # that the band stays off the ends of the head [m]
ENDS = 25e-3  # of a body beyond its fine part [m]


def place_wheel(rail: HexMesh, wheel: HexMesh, x: float, y: float, height: float) -> tuple[HexMesh, float]:
    """Both meshes in one, the wheel at x, y so that the smallest gap between the meshes is zero; and the gap it had on the rigid path [m].

    rail, wheel : wheel coordinates are x = 0 under the axle, y from D0, z = 0 at D0;  y, height : of D0 on the rigid path [m]
    A gap far from zero means that a mesh is not where the profile is: the caller reports it.
    """
    shift = np.array([x, y, height])
    placed = replace(wheel, points=wheel.points + shift)
    gap = smallest_gap(rail, placed)
    placed = replace(wheel, points=wheel.points + shift - np.array([0.0, 0.0, gap]))
    return merge_bodies([rail, placed]), gap


def smallest_gap(rail: HexMesh, wheel: HexMesh) -> float:
    """Smallest vertical way between the surfaces, rail nodes against wheel facets and the reverse [m]; negative: they overlap."""
    return min(_vertical_gap(rail, wheel), _vertical_gap(wheel, rail))


def _vertical_gap(slave: HexMesh, master: HexMesh) -> float:
    slaves, facets = Surface.from_quads(slave.surface), Surface.from_quads(master.surface)
    points = np.concatenate([slave.points[slaves.nodes], master.points[facets.nodes]])
    n = len(slaves.nodes)
    quads = facets.quads.astype(np.int64) + n
    centres = points[quads].mean(axis=1)
    away, nearest = cKDTree(centres).query(points[:n])
    near = np.flatnonzero(away < FARTHEST)
    if not len(near):
        return np.inf
    pairs = kernel.Pairs.over(quads, edge_neighbours(facets.quads), np.ones(len(quads), np.bool_), near, nearest[near].astype(np.int64), np.zeros((len(near), 2)))
    kernel.project_pairs(points, pairs)
    gap, normal = pairs.gap, pairs.normal
    upright = (pairs.facets >= 0) & (np.abs(normal[:, 2]) > 0.3)
    return float((gap[upright] / np.abs(normal[upright, 2])).min(initial=np.inf))


def crossing_spec(crossing: CastCrossing, path: WheelPath, low: float, high: float, size: float, near: float, reach: float, half_band: float) -> CrossingMeshSpec:
    """Fine where the rigid wheel comes near: the cheaper model says where the fine mesh must lie.

    low, high : the wheel's way [m];  near : clearance below which a body may carry [m];  reach : half length of a patch with room to
    spare [m];  half_band : half width of the fine band about the contact point [m]
    """
    inside = (path.x >= low) & (path.x <= high)
    bodies = {}
    for name, gap, point in (("wing", path.wing_gap, path.wing_point), ("nose", path.nose_gap, path.nose_point)):
        close = path.x[inside & (gap < near)]
        if not len(close):
            continue
        fine = (close[0] - reach, close[-1] + reach)
        known = np.isfinite(point[:, 1]) & (gap < 4 * near)
        band = _band(getattr(crossing, f"{name}_section"), point[known, 0], point[known, 1], half_band)
        bodies[name] = BodyMeshSpec((fine[0] - ENDS, fine[1] + ENDS), fine, band)
    return CrossingMeshSpec(size, **bodies)


def _band(section, x: np.ndarray, y: np.ndarray, half: float):
    """Lateral range about the contact point, kept on the head of the section (above the gauge point)."""
    order = np.argsort(x)
    x, y = x[order], y[order]

    def band(at: float) -> tuple[float, float]:
        outline = section(at)
        head = outline[outline[:, 1] > outline[:, 1].max() - GAUGE_POINT_DEPTH, 0]
        centre = float(np.interp(at, x, y))
        return max(centre - half, head.min() + EDGE), min(centre + half, head.max() - EDGE)

    return band


def wheel_bands(path: WheelPath, datum_y: float, low: float, high: float, near: float, half_band: float) -> tuple[tuple[float, float], ...]:
    """Lateral ranges from D0 where the wheel may touch wing or nose on its way, merged where they meet [m]; datum_y : where D0 is [m]."""
    inside = (path.x >= low) & (path.x <= high)
    ranges = []
    for gap, point in ((path.wing_gap, path.wing_point), (path.nose_gap, path.nose_point)):
        y = point[inside & (gap < near), 1] - datum_y
        if len(y):
            ranges.append((float(y.min() - half_band), float(y.max() + half_band)))
    merged = []
    for start, end in sorted(ranges):
        if merged and start < merged[-1][1] + 2 * half_band:
            merged[-1] = (merged[-1][0], max(end, merged[-1][1]))
        else:
            merged.append((start, end))
    return tuple(merged)
