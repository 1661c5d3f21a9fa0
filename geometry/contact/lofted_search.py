"""Where the wheels of a wheelset touch a track whose rails change along x: crossings, switches, rails read from
sections.

    search = SurfaceSearch(Wheelset(wheel_profile("P8")), Track.plain_line(),
    left=RailSurface.of_crossing(CastCrossing(9.25)))
    state = search.at(0.25).settle(lateral=2e-3, yaw=0.005)     # x of the axle's middle; both wheels just touch
    search.contacts(state, "left", reach=50e-6)                 # Contacts: all points of wing and nose within 50 um
    rail_fem.contact.load_sharing.static_equilibrium(search.at(0.25), (60e3, 60e3))   # under its loads: all forces
    rail_fem.contact.load_sharing.side_held(search, state, "left")                    # forces at any given state

A side without a surface is the track's plain rail. Surfaces have the axes of geometry.axes (gauge face at y = -35 mm, +
to the field side) whichever side they lie on; running towards -x (trailing) is the same position of the wheelset, so
that only a `Motion` knows of it.
"""

import copy
from dataclasses import replace

import numpy as np

from geometry.axes import GAUGE_FACE_Y
from geometry.contact.gap_kernel import Side
from geometry.contact.prismatic_search import RESOLUTION, ContactSearch
from geometry.contact.rail_kinds import MOST_WINDOWS
from geometry.surfaces.loft_kernel import BRANCHES, MEMORY, WIDEST, LoftRail
from geometry.surfaces.lofted_rail import RailSurface
from geometry.wheelset import SIDES, Track, Wheelset, WheelsetError


class SurfaceSearch(ContactSearch):
    """As ContactSearch, on surfaces; `at(x)` sets the axle's middle at x [m], where all further searches are.

    All points are found: on every body, on tread and flange, ahead of and behind the axle. Exact on planes, prisms and
    all that cubics hold: 1e-9 m (tests/geometry/test_surface_contact.py); elsewhere as exact as the surface
    (geometry.surfaces.lofted_rail).

    Parameters
    ----------
    wheelset : Wheelset
        Two wheels on an axle.
    track : Track
        Its plain rails, where a side has no surface.
    left, right : RailSurface, optional
        Surfaces in the axes of geometry.axes (gauge face at y = -35 mm).
    resolution : float
        As of ContactSearch [m].
    checked : mapping of str to (float, float), optional
        By side: x from and to [m] where its check rail stands.

    Examples
    --------
    >>> wheelset = geometry.Wheelset(geometry.wheel_profile("P8"), radius=0.46, z=0.46)
    >>> surface = geometry.RailSurface.of_crossing(geometry.CastCrossing(), first=-0.4, last=0.6)
    >>> search = geometry.SurfaceSearch(wheelset, geometry.Track.plain_line(), left=surface).at(0.1)
    >>> search.contacts(search.settle(), "left").position.size > 0
    True
    """

    def __init__(
        self,
        wheelset: Wheelset,
        track: Track,
        left: RailSurface | None = None,
        right: RailSurface | None = None,
        resolution: float = RESOLUTION,
        checked: dict[str, tuple[float, float]] | None = None,
    ):
        """checked : where the track's check rails are, or the wing beside the flange, "left" or "right": from x to x
        [m]; absent: everywhere."""
        self.surfaces, self.checked = {"left": left, "right": right}, checked or {}
        super().__init__(wheelset, track, resolution)

    def _side(self, side: str) -> Side:
        surface, plain = self.surfaces[side], super()._side(side)
        if surface is None:
            return plain
        rail = surface.moved(self.track.gauge / 2 - GAUGE_FACE_Y)
        ridges = np.concatenate([plain.stations[:1], np.zeros((2 * MOST_WINDOWS, plain.stations.shape[1]))])
        windows = np.zeros((MOST_WINDOWS, MEMORY))
        return plain._replace(rail=LoftRail(*rail.tables(), windows, np.zeros(2), ridges, rail.wavy()))

    def at(self, x: float) -> "SurfaceSearch":
        """The same search with the axle's middle at x [m]. Raises WheelsetError where a surface does not reach as far
        as the wheel."""
        reach = WIDEST * self.wheelset.radius
        for side, surface in self.surfaces.items():
            low, high = (-np.inf, np.inf) if surface is None else surface.x_range
            if not (low + reach <= x <= high - reach):
                raise WheelsetError(
                    f"x = {x:g} m: the {side} rail is known from {low:g} to {high:g} m, and the wheel needs {reach:.3f}"
                    " m ahead and behind"
                )
        here = copy.copy(self)
        here.wheelset = replace(self.wheelset, x=float(x))
        gone = [side for side, (low, high) in self.checked.items() if not low <= x <= high]
        here.track = replace(
            self.track,
            left_check=None if "left" in gone else self.track.left_check,
            right_check=None if "right" in gone else self.track.right_check,
        )
        here.sides = {side: self._standing_at(x, side, own=True) for side in SIDES}
        return here

    def rail_under(self, state: Wheelset, side: str) -> Side:
        """A side for a state: a lofted rail is another at every x."""
        return self._standing_at(state.x, side)

    def _standing_at(self, x: float, side: str, own: bool = False) -> Side:
        """A side with the axle's middle at x [m]; own: with tables of its own for what a search notes there."""
        if self.surfaces[side] is None:
            return self.sides[side]
        of = self.sides[side]
        rail = of.rail._replace(position=np.array([x, 0.0 if own else of.rail.position[BRANCHES]]))
        if own:
            rail = rail._replace(windows=rail.windows.copy(), ridges=rail.ridges.copy())
        return of._replace(rail=rail)

    def rail_station(self, side: str, y: np.ndarray, z: np.ndarray) -> np.ndarray:
        """As of a prismatic rail; on a lofted one y (n,) [m] in the crossing's axes."""
        return (
            super().rail_station(side, y, z) if self.surfaces[side] is None else y - self.track.gauge / 2 + GAUGE_FACE_Y
        )
