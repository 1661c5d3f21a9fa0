"""A user's own mesh for the explicit model: whether it fits the case, and its wheel set down where the run starts.

Where the wheel stands in the file is known from its contact surface: circles about the axle.
"""

import hashlib
from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy.optimize import least_squares

from geometry.meshing.conforming import position
from geometry.meshing.hexmesh import HexMesh, MeshError
from geometry.meshing.mesh_file import read_mesh_file
from geometry.path.wheel_path import rolling_radius
from geometry.profiles.formats.raw import LARGEST_MESH, open_file
from geometry.profiles.formats.units import UNITS
from geometry.surfaces.bodies import CROSSING, PassBody
from rail_fem.contact.rigid import SPACING, datum_height, rigid_path, running_start
from rail_fem.fe.plan.fine_zone import PATCH_REACH
from rail_fem.scene.scene import Scene
from rail_fem.settings.explicit import FeSettings

LARGEST_MISFIT = 3e-3  # of the mesh's wheel from the case's profile [m]: wheels with flats are run too
LARGEST_CLEARANCE = 2e-3  # of a user's crossing from the case's, under the wheel at the start [m]
BESIDE = 1e-4  # of the mesh's wheel beyond the ends of the case's profile [m]
FACES_LOOKED_AT, SIZES = 12, (0.6, 1.7)  # contact faces under the wheel; their size over element_size


def own_mesh(scene: Scene, settings: FeSettings) -> tuple[HexMesh, float]:
    """The mesh of `settings.mesh`, its wheel set down on the crossing at the start, to within what faces differ from
    the surface through their nodes; height of the wheel's D0 [m].

    settings : with start and end.  Errors: MeshError that says what does not fit and the remedy; OSError.
    """
    path = Path(settings.mesh)
    with open_file(path, LARGEST_MESH) as file:
        if hashlib.file_digest(file, "sha256").hexdigest() != settings.mesh_digest:
            raise MeshError(f"{path}: has changed since the case was read: start the run again")
    mesh = read_mesh_file(path, UNITS[settings.mesh_unit])
    x, z = _axle(path, mesh, scene)
    height = z - scene.wheel.radius
    start = running_start(scene, settings)
    _check_length(path, mesh, settings)
    _check_element_size(path, mesh, scene, settings, start)
    touching = _touching_height(path, mesh, scene, start)
    points = mesh.points.copy()
    points[np.unique(mesh.cells[mesh.region == PassBody.WHEEL])] += [start - x, 0.0, touching - height]
    return replace(mesh, points=points), touching


def _axle(path: Path, mesh: HexMesh, scene: Scene) -> tuple[float, float]:
    """x and z of the axle [m] about which the wheel's contact surface is the case's wheel best (least squares)."""
    nodes = mesh.points[np.unique(mesh.surface[mesh.surface_region == PassBody.WHEEL])]
    y = nodes[:, 1] - scene.wheel_datum_y
    inside = np.clip(y, *np.sort(scene.wheel.shape.points[[0, -1], 0]))
    outside = np.abs(y - inside) > BESIDE
    if outside.any():
        raise MeshError(
            f"{path}: {outside.sum()} of {len(nodes)} nodes of the wheel's contact surface lie beside the case's wheel"
            f" ({scene.wheel.profile}, y from {1e3 * (inside.min() + scene.wheel_datum_y):.4g} to"
            f" {1e3 * (inside.max() + scene.wheel_datum_y):.4g} mm), one at {position(nodes[np.argmax(outside)])}: give"
            " [scene.wheel] as the mesh has it, or move the mesh's wheel"
        )
    radius = rolling_radius(scene.wheel.shape, scene.wheel.radius, inside)

    def misfit(axle: np.ndarray) -> np.ndarray:
        return np.hypot(nodes[:, 0] - axle[0], nodes[:, 2] - axle[1]) - radius

    lowest = nodes[np.argmin(nodes[:, 2])]
    found = least_squares(misfit, [nodes[:, 0].mean(), lowest[2] + scene.wheel.radius], x_scale=scene.wheel.radius)
    away = np.abs(misfit(found.x))
    if not away.max() < LARGEST_MISFIT:
        raise MeshError(
            f"{path}: {int((~(away < LARGEST_MISFIT)).sum())} of {len(nodes)} nodes of the wheel's contact surface lie"
            f" up to {away.max() * 1e3:.3g} mm off the case's wheel ({scene.wheel.profile}, radius"
            f" {scene.wheel.radius * 1e3:g} mm, D0 at y = {scene.wheel_datum_y * 1e3:.4g} mm), one at"
            f" {position(nodes[np.argmax(away)])}: give [scene.wheel] as the mesh has it, or move the mesh's wheel"
        )
    return float(found.x[0]), float(found.x[1])


def crossing_faces(mesh: HexMesh) -> np.ndarray:
    """Contact faces (k, 4) of the crossing's bodies."""
    return mesh.surface[np.isin(mesh.surface_region, CROSSING)]


def _check_length(path: Path, mesh: HexMesh, settings: FeSettings) -> None:
    """The crossing's contact surface reaches from start to end with half a patch beside it."""
    low, high = sorted((settings.start, settings.end))
    x = mesh.points[crossing_faces(mesh), 0]
    first, last = x.min(), x.max()
    if first > low - PATCH_REACH or last < high + PATCH_REACH:
        raise MeshError(
            f"{path}: the crossing's contact surface reaches from x = {first * 1e3:.1f} to {last * 1e3:.1f} mm, the"
            f" wheel runs from {low * 1e3:.4g} to {high * 1e3:.4g} mm with {PATCH_REACH * 1e3:g} mm of patch on either"
            " side: lengthen the mesh, or change start and end"
        )


def _touching_height(path: Path, mesh: HexMesh, scene: Scene, start: float) -> float:
    """Height of D0 where the case's wheel rests on the nodes of the mesh's crossing [m]; near what it has on the case's
    crossing."""
    x, y, z = mesh.points[np.unique(crossing_faces(mesh))].T
    wheel = scene.wheel
    with np.errstate(invalid="ignore"):  # NaN beside the wheel
        heights = z + np.sqrt(
            rolling_radius(wheel.shape, wheel.radius, y - scene.wheel_datum_y) ** 2 - (x - start) ** 2
        )
    touching = float(np.max(heights, where=np.isfinite(heights), initial=-np.inf)) - wheel.radius
    expected = datum_height(scene, rigid_path(scene, start + np.array([-SPACING, 0.0, SPACING])), start)
    if not abs(touching - expected) < LARGEST_CLEARANCE:
        raise MeshError(
            f"{path}: set down at x = {start * 1e3:.4g} mm, the wheel stands {(touching - expected) * 1e3:+.3g} mm"
            f" above its height on the case's crossing (at most {LARGEST_CLEARANCE * 1e3:g} mm): give [scene.crossing]"
            " as the mesh has it, or move the mesh"
        )
    return touching


def _check_element_size(path: Path, mesh: HexMesh, scene: Scene, settings: FeSettings, start: float) -> None:
    """The crossing's faces nearest under the wheel at the start are of the element size that the contact's penalty
    follows from."""
    corner = mesh.points[crossing_faces(mesh)]
    x, y, z = corner.mean(axis=1).T
    near = np.abs(x - start) < PATCH_REACH
    radius = np.where(near, rolling_radius(scene.wheel.shape, scene.wheel.radius, y - scene.wheel_datum_y), np.nan)
    away = -z - np.sqrt(radius**2 - np.where(near, x - start, 0.0) ** 2)
    nearest = np.argsort(away)[: min(FACES_LOOKED_AT, int(np.isfinite(away).sum()))]  # NaN is last
    if not len(nearest):
        raise MeshError(f"{path}: the crossing has no contact face at start, x = {start * 1e3:.4g} mm: refine it there")
    face = corner[nearest]
    areas = np.linalg.norm(np.cross(face[:, 2] - face[:, 0], face[:, 3] - face[:, 1]), axis=1) / 2
    found, size = float(np.sqrt(np.median(areas))), settings.element_size
    if not SIZES[0] < found / size < SIZES[1]:
        raise MeshError(
            f"{path}: the {len(nearest)} contact faces of the crossing nearest under the wheel at start are"
            f" {found * 1e3:.3g} mm long in the median, at {position(corner[nearest[0]].mean(axis=0))}; element_size"
            f' says {size * 1e3:g} mm, by which contact is made stiff: give element_size = "{found * 1e3:.2g} mm"'
        )
