"""Where along a crossing a patch wears it: what of the rail under the patch is within the wheel's reach.

An ellipse covers the rail whatever lies under it. A point carries, and so wears, by how far the wheel as it stands
would sink into the true, worn surface there: the gap between the two below the depth at which the patch's own
paraboloid is as large as the patch. So what lies low is spared until its neighbours are down, and what stands up wears
first. Strips keep what they wear; only where along the rail they wear it is shared out.
"""

import numpy as np

from geometry.surfaces.any_crossing import AnyCrossing
from rail_fem.contact.contact_table import surface_gap
from rail_fem.damage.crossing import PassContacts
from rail_fem.damage.deposit import ReachedLines
from rail_fem.scene.scene import Scene

BEYOND = 1.3  # half lengths of a patch within which its reach is looked at


def depth_of_patch(contacts: PassContacts) -> np.ndarray:
    """(k,) depths [m] at which a plane cuts the patches' areas out of their paraboloids, a b / (2 sqrt(Rx Ry))."""
    grid = contacts.patches.grid
    return grid.dx * grid.nx * grid.dy * grid.ny / 8 / np.sqrt(contacts.radii.prod(axis=1))


def reach_of(contacts: PassContacts, scene: Scene, crossing: AnyCrossing, datum: float, x: np.ndarray) -> ReachedLines:
    """Of a scene's wheel with its tread datum at y = `datum` [m] on a crossing as it is now, on the lines of an even
    grid x (m,) [m]: 1 - gap / depth where that is above 0, over its sum along the strip. A strip that reaches nothing
    goes to the two lines beside the patch's own position."""
    grid, dx = contacts.patches.grid, x[1] - x[0]
    half, at = BEYOND * grid.dx * grid.nx / 2, (contacts.position[:, 0] - x[0]) / dx
    first = np.minimum(np.ceil(at - half / dx), np.floor(at)).astype(int)
    first = np.clip(first, 0, len(x) - 2)
    lines = first[:, None] + np.arange(int(np.ceil(2 * half.max(initial=0.0) / dx)) + 2)
    along = x[0] + lines * dx - contacts.position[:, :1]
    across = (np.arange(grid.ny) - (grid.ny - 1) / 2) * (grid.dy * np.cos(contacts.angle))[:, None]
    at_x = np.broadcast_to((contacts.position[:, :1] + along)[:, :, None], (*lines.shape, grid.ny))
    at_y = np.broadcast_to((contacts.position[:, 1:2] + across)[:, None], at_x.shape)
    under = (np.abs(along) <= half[:, None]) & (lines < len(x))
    gap = np.full(at_x.shape, np.inf)
    for body in (0, 1):
        own = under & (contacts.body == body)[:, None]
        axle = np.broadcast_to(contacts.x[:, None], lines.shape)[own][:, None]
        gap[own] = surface_gap(crossing, scene.wheel.shape, body, axle, at_x[own], at_y[own], scene.wheel.radius, datum)
    least = gap.min(axis=(1, 2), initial=np.inf)
    over = (gap - np.where(np.isfinite(least), least, 0.0)[:, None, None]) * np.cos(contacts.angle)[:, None, None]
    weight = np.maximum(1 - over / depth_of_patch(contacts)[:, None, None], 0.0)
    own = np.maximum(1 - np.abs(along) / dx, 0.0)[:, :, None]
    weight = np.where(weight.sum(axis=1, keepdims=True) > 0, weight, own)
    return ReachedLines(first, weight / weight.sum(axis=1, keepdims=True))
