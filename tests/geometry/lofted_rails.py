"""Wheels and rails with exact answers, for tests on rails that change along x."""

import numpy as np

from geometry.contact.lofted_search import SurfaceSearch
from geometry.profiles.profile import Profile, arc
from geometry.surfaces.lofted_rail import LoftedBody, RailSurface
from geometry.wheelset import Track, Wheelset

MM = 1e-3
RADIUS = 0.45


def sphere() -> Profile:
    """Wheel that is a sphere of RADIUS."""
    half = 60 * MM
    rise = RADIUS - np.sqrt(RADIUS**2 - half**2)
    return Profile.from_pieces([arc((-half, rise), (half, rise), RADIUS, 0.1 * MM)], "sphere")


def surface(height, x: np.ndarray, half: float = 80 * MM) -> RailSurface:
    """Sections of z = height(x, y) at x (m,)."""
    y = np.linspace(-half, half, 321)
    return RailSurface((LoftedBody.through(x, [np.column_stack([y, height(at, y)]) for at in x], spacing=y[1] - y[0]),))


def on_left(wheel: Profile, rail: RailSurface, x: float = 0.0, **options) -> SurfaceSearch:
    """The wheel on the rail as the left one, a plain rail on the right."""
    return SurfaceSearch(Wheelset(wheel, radius=RADIUS), Track.plain_line(), left=rail, **options).at(x)
