"""Creepages of the strips of a patch that is laid along a curved face.

On a tight rounding, a nose's corner, the bodies' common normal turns within the patch: by the mean of both faces'
slopes, as steels of one stiffness share what separates them. The wheel's slope is its profile's; the rail's differs
from it by the gap's, distance over relative radius. Each strip slips as the wheel's rigid motion says at its own place.
"""

import numpy as np

from geometry.contact.prismatic_search import Motion, creepages_at
from geometry.profiles.profile import hermite_many
from geometry.wheelset import Wheelset
from rail_fem.contact.contact_table import ContactTable
from rail_fem.scene.scene import Scene


def point_creepages(
    scene: Scene, table: ContactTable, b: int, carries: np.ndarray, points: np.ndarray, angles: np.ndarray
) -> np.ndarray:
    """(k, 3) rigid slip per speed of the wheel at points (k, 3) [m] where normals lean by angles (k,) [rad] across the
    track, at the table's positions carries (k,) of body b; the axle follows the table's heights."""
    wheel, steep = scene.wheel, table.slope[b, carries]
    normal = np.stack([-steep, -np.tan(angles), np.ones_like(angles)], axis=1)
    # seen from the middle of the axle, so that one wheelset serves all positions
    middle = np.stack([table.x[carries], 0 * angles, table.height[b, carries] + wheel.radius], axis=1)
    unit = normal / np.linalg.norm(normal, axis=1)[:, None]
    state = Wheelset(wheel.shape, radius=wheel.radius, back_to_back=scene.back_to_back, x=0.0, z=0.0)
    motion = Motion(scene.velocity, vertical=scene.velocity * steep)
    return creepages_at(state, points - middle, unit, motion)


def patch_centres(table: ContactTable, b: int, carries: np.ndarray) -> np.ndarray:
    """(k, 3) centres of pressure of the patches of body b [m], in the tangent plane at the contact point."""
    lean = table.angle[b, carries]
    tangent = np.stack([np.zeros_like(lean), np.cos(lean), np.sin(lean)], axis=1)
    return table.point[b, carries] + tangent * table.centre[b, carries][:, None]


def plane_creepages(scene: Scene, table: ContactTable, b: int, carries: np.ndarray) -> np.ndarray:
    """(k, 3) creepages of patches of body b in the tangent plane, about their centres of pressure: there the ellipse
    lies, whose strips are counted from it."""
    return point_creepages(scene, table, b, carries, patch_centres(table, b, carries), table.angle[b, carries])


def strip_angles(
    scene: Scene, table: ContactTable, b: int, carries: np.ndarray, semi: np.ndarray, cells: int
) -> tuple[np.ndarray, np.ndarray]:
    """Distances (k, cells) [m] of the strips of patches with half-widths semi (k,) from their centres, and angles
    (k, cells) [rad] of the faces' mean slope there. Beyond the wheel's profile the angle is the contact point's."""
    across = (2 * np.arange(cells) + 1 - cells) / cells
    offset = semi[:, None] * across
    lean = table.angle[b, carries][:, None]
    at = table.point[b, carries, 1][:, None] + (table.centre[b, carries][:, None] + offset) * np.cos(lean)
    _, slope = hermite_many((at - table.datum).ravel(), *scene.wheel.shape.hermite_table())
    turned = np.arctan(slope).reshape(at.shape) - offset / (2 * table.radii[b, carries, 1][:, None])
    return offset, np.where(np.isfinite(turned), turned, lean)


def strip_creepages(
    scene: Scene, table: ContactTable, b: int, carries: np.ndarray, semi: np.ndarray, cells: int
) -> tuple[np.ndarray, np.ndarray]:
    """Creepages (k, 3) of patches with half-widths semi (k,) [m] at their centres, (k, cells, 3) of their strips."""
    offset, angle = strip_angles(scene, table, b, carries, semi, cells)
    step = 2 * semi[:, None] / cells
    level = (angle[:, (cells - 1) // 2] + angle[:, cells // 2]) / 2
    centre = patch_centres(table, b, carries)
    creepage = point_creepages(scene, table, b, carries, centre, level)
    place = lambda part: _from_middle(part(angle) * step)
    points = centre[:, None] + np.stack([0 * offset, place(np.cos), place(np.sin)], axis=2)
    every = np.repeat(carries, cells)
    strips = point_creepages(scene, table, b, every, points.reshape(-1, 3), angle.ravel())
    return creepage, strips.reshape(*offset.shape, 3)


def _from_middle(steps: np.ndarray) -> np.ndarray:
    """Sums (k, n) of steps (k, n) up to each one's middle, 0 in the middle of all."""
    ends = np.cumsum(steps, axis=1)
    half = ends - steps / 2
    count = steps.shape[1]
    return half - (ends[:, count // 2 - 1] if count % 2 == 0 else half[:, count // 2])[:, None]
