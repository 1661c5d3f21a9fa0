"""What of a scene is meshed, and where finely: the rigid wheel's path says where a fine mesh must lie, before anything
is meshed."""

from collections.abc import Callable

import numpy as np

from geometry.meshing.band import HeadBand
from geometry.meshing.crossing_mesh import BodyMeshSpec, CrossingMeshSpec, check_bands
from geometry.meshing.hexmesh import MeshError
from geometry.meshing.wheel import WheelMeshSpec, check_wheel_bands
from geometry.path.wheel_path import WheelPath
from geometry.surfaces.any_crossing import AnyCrossing
from rail_fem.contact.rigid import anchored_path, meshed_stretch
from rail_fem.scene.scene import Scene
from rail_fem.settings.explicit import FeSettings

NEAR = 0.25e-3  # a body is meshed finely where the rigid wheel clears it by less [m]
PATCH_REACH = 12e-3  # half length of a patch with room to spare [m]
HALF_BAND = 8e-3  # half width of the fine band about the contact point [m]
EDGE = 1e-3  # that the band stays off the ends of the head [m]
ENDS = 25e-3  # of a body beyond its fine part [m]
ALWAYS_FITS = 3.5e-3  # element size up to which every band is more than two elements wide [m]


def mesh_errors(scene: Scene, settings: FeSettings, model: str) -> list[str]:
    """Why the mesher must refuse this element size, if it must: bands that are too narrow for it. Takes a second for
    coarse elements."""
    size = settings.element_size
    if max(size, settings.wheel_size) <= ALWAYS_FITS:
        return []
    low, high = meshed_stretch(scene, settings)
    crossing, path = scene.crossing.surface, anchored_path(scene, low, high)
    try:
        check_bands(crossing, crossing_spec(crossing, path, low, high, settings))
        wheel = wheel_spec(path, scene.wheel_datum_y, settings)
        check_wheel_bands(scene.wheel.shape, scene.wheel.radius, wheel)
    except MeshError as error:
        return [f"run.{model}.element_size: {size * 1e3:g} mm cannot be meshed: {error}"]
    return []


def wheel_spec(path: WheelPath, datum_y: float, settings: FeSettings) -> WheelMeshSpec:
    """The wheel's mesh, fine where the wheel touches on its path; datum_y : where D0 is [m]"""
    bands = wheel_bands(path, datum_y)
    return WheelMeshSpec(
        settings.wheel_size,
        bands=bands,
        fine_half_length=PATCH_REACH + 4e-3,
        rim_depth=settings.wheel_depth,
        length=settings.along,
    )


def crossing_spec(
    crossing: AnyCrossing, path: WheelPath, low: float, high: float, settings: FeSettings
) -> CrossingMeshSpec:
    """Fine where the rigid wheel comes near: the cheaper model says where the fine mesh must lie.

    path : over the stretch that decides the mesh (rail_fem.contact.rigid.anchored_path);
    low, high : the stretch of axle positions that is meshed for (`meshed_stretch`) [m]. Slabs are counted from x = 0 on
        the wing and from the tip on the nose.
    """
    bodies = {}
    for name, gap, point, anchor, begin in (
        ("wing", path.wing_gap, path.wing_point, 0.0, -np.inf),
        ("nose", path.nose_gap, path.nose_point, crossing.nose_x, crossing.nose_x),
    ):
        near = gap < NEAR
        close, design = path.x[near & (path.x >= low) & (path.x <= high)], path.x[near]
        if not len(close):
            continue
        section = crossing.wing_section if name == "wing" else crossing.nose_section
        end = _last(section, close[0], close[-1] + PATCH_REACH + ENDS)
        fine = (max(close[0] - PATCH_REACH, begin), min(close[-1] + PATCH_REACH, end))
        known = np.isfinite(point[:, 1]) & (gap < 4 * NEAR)
        x, y = point[known][np.argsort(point[known, 0]), :2].T
        band = HeadBand(crossing, name, x, y, HALF_BAND, EDGE)
        around = (max(design[0] - PATCH_REACH, begin), min(design[-1] + PATCH_REACH, end))
        bodies[name] = BodyMeshSpec(
            (max(fine[0] - ENDS, begin), min(fine[1] + ENDS, end)),
            fine,
            band,
            anchor=end if end < np.inf else anchor,
            design_x=around,
        )
    return CrossingMeshSpec(
        settings.element_size, bodies.get("wing"), bodies.get("nose"), -settings.rail_depth, length=settings.along
    )


def _last(section: Callable[[float], np.ndarray | None], low: float, high: float) -> float:
    """Where a body ends that is there at x = low; inf where it is at x = high too [m]."""
    if section(high) is not None:
        return np.inf
    while high - low > 1e-9:
        middle = (low + high) / 2
        low, high = (middle, high) if section(middle) is not None else (low, middle)
    return low


def wheel_bands(path: WheelPath, datum_y: float) -> tuple[tuple[float, float], ...]:
    """Lateral ranges from D0 where the wheel may touch wing or nose on a path, merged where they meet [m]; datum_y :
    where D0 is [m]."""
    ranges = []
    for gap, point in ((path.wing_gap, path.wing_point), (path.nose_gap, path.nose_point)):
        y = point[gap < NEAR, 1] - datum_y
        if len(y):
            ranges.append((float(y.min() - HALF_BAND), float(y.max() + HALF_BAND)))
    merged: list[tuple[float, float]] = []
    for start, end in sorted(ranges):
        if merged and start < merged[-1][1] + 2 * HALF_BAND:
            merged[-1] = (merged[-1][0], max(end, merged[-1][1]))
        else:
            merged.append((start, end))
    return tuple(merged)
