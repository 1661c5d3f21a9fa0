"""A crossing by its own sections, measured or drawn, with all that models ask of a crossing. Axes: geometry.axes.

What CastCrossing gives by closed forms, MeasuredCrossing gives by tables through the sections: heights, sections with
the same features at the same points for the mesh, positions of nose and plain rail.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from geometry.profiles.doctor import NOISE, TAKEN, with_corners
from geometry.profiles.profile import ProfileError, along, lengths
from geometry.profiles.smoothing import smoothed
from geometry.surfaces.bodies import NO_METAL, CrossingError, TwoBodies
from geometry.surfaces.crossing import PLAIN_LINE_X, feature_indices
from geometry.surfaces.crossing_surface import FLOOR
from geometry.surfaces.leg_transition import cast_leg
from geometry.surfaces.section_grid import BodyGrid, SectionGrids, body_grid, every_second, grid_heights, no_body
from geometry.surfaces.sections import FACE_DEPTH, SectionBody, SectionCrossing, points_up

MM = 1e-3
BEYOND = 20.0  # by which ends are extended on request [m]
FEWEST = 4  # sections
LEAST_END = 0.15  # of the crossing before the first position where an axle may stand [m]
SIDE_ERROR, HEIGHT_ERROR = 3 * MM, 3 * MM  # of the first section against the gauge line and rail level
LARGEST_JUMP, LARGEST_SLOPE = 4 * MM, 0.3  # of a face or a top from section to section, beside what a taper explains
SEGMENTS = {"face": 16, "corner": 48, "top": 96, "side": 12}
CORNER = 25 * MM  # length of the segment "corner", at most 0.4 of the head
BATTER = 0.02, 0.3  # dy/dz with which faces go on to the floor


@dataclass(frozen=True, eq=False)
class MeasuredCrossing(TwoBodies):
    """Wing and nose through sections; lengths in m.

    sections : the bodies of each station;  extended : both ends go straight on beyond the first and last section
    Error between sections: second order in their distance; on the benchmark's 148 sections the axle's height differs by
    0.05 to 0.1 mm from that on the parametric crossing (tests/geometry/test_section_path.py).
    """

    sections: SectionCrossing
    extended: bool = False
    label: str = "crossing by sections"

    def __post_init__(self):
        check_sections(self.sections)

    @cached_property
    def grids(self) -> SectionGrids:
        """Tables of both bodies."""
        return SectionGrids(self._grid("wing", self.sections.wings), self._grid("nose", self.sections.noses))

    @property
    def tables(self) -> tuple[SectionGrids, np.ndarray]:
        """What the compiled search takes (geometry.surfaces.surface_height)."""
        return self.grids, np.empty((0, 0))

    @property
    def x_range(self) -> tuple[float, float]:
        """Where there are sections, or their extension [m]."""
        beyond = BEYOND if self.extended else 0.0
        return float(self.sections.x[0]) - beyond, float(self.sections.x[-1]) + beyond

    @property
    def modelled(self) -> str:
        return f"the sections of {self.label}"

    @property
    def plain_x(self) -> float:
        """x of plain rail, where the axle's height counts as 0 [m]: as on the parametric crossing, or at the first
        section."""
        return max(PLAIN_LINE_X, self.x_range[0] + LEAST_END)

    @property
    def nose_x(self) -> float:
        """x of the first section with a nose [m]; inf where none has one."""
        return float(self.grids.nose.x[0]) if self.has_nose else np.inf

    @property
    def has_nose(self) -> bool:
        return any(nose is not None for nose in self.sections.noses)

    @cached_property
    def leg_range(self) -> tuple[float, float]:
        """x between which the running surface leaves its first shape [m]: from the first change of 0.05 mm to the nose,
        at most to the
        knuckle."""
        grid = self.grids.wing
        change = np.nanmax(np.abs(np.where(self._head(grid), grid.z - grid.z[0], np.nan)), axis=1, initial=0.0)
        first = int(np.argmax(change > 0.05 * MM)) if (change > 0.05 * MM).any() else len(grid.x) - 1
        start = float(grid.x[max(first - 1, 0)])
        return start, float(np.clip(self.knuckle_x, start, self.x_range[1]))

    @property
    def knuckle_x(self) -> float:
        """x where the wing's face leaves the gauge line by 0.5 mm [m]: the leg ends there."""
        away = self.grids.wing.face - cast_leg().gauge_line > 0.5 * MM
        return float(self.grids.wing.x[int(np.argmax(away))]) if away.any() else self.x_range[1]

    @staticmethod
    def _head(grid: BodyGrid) -> np.ndarray:
        """(m, n)  where the first section's running surface is."""
        return np.broadcast_to(grid.z[0] > -2 * MM, grid.z.shape)

    def heights(self, x: np.ndarray, y: np.ndarray, body: str) -> np.ndarray:
        """Heights (n,) [m] of "wing" or "nose" at x, y (n,); NO_METAL where the body is not."""
        return grid_heights(x, y, self.grids.nose if body == "nose" else self.grids.wing)

    def missed(self, low: float, high: float, y: np.ndarray, radius: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """What the distance of sections costs, by the file alone: x (m,) of the sections between low and high [m], and
        how far a wheel on the section lies from one on the surface without it (m,) [m].

        y, radius : (n,) of the wheel [m], each section under its axle alone. Every second section is left out: of the
        distances that there are a surface without edges along x misses a quarter of what is told, one with them half.
        """
        x = self.sections.x
        x = x[1:-1][(x[1:-1] >= low) & (x[1:-1] <= high)]
        own, without = np.full((2, len(x)), NO_METAL)
        for grid in self.grids:
            own = np.maximum(own, _lowered(grid, x, y, radius))
            for first in (0, 1):
                left = np.isin(x, grid.x[1 - first :: 2])
                found = _lowered(every_second(grid, first), x[left], y, radius) if len(grid.x) > 4 else NO_METAL
                without[left] = np.maximum(without[left], found)
        both = (own > 0) & (without > 0)
        return x[both], (without - own)[both]

    def wing_section(self, x: float) -> np.ndarray | None:
        """(n, 2)  y, z [m] of the wing at x, from the foot of its gauge face to its field-side foot, both on the floor.

        The same number of points and features at the same index for every x: SEGMENTS. None where it has ended.
        """
        return self._outline(x, self.grids.wing)

    def nose_section(self, x: float) -> np.ndarray | None:
        """The same of the nose; None where it is not."""
        return self._outline(x, self.grids.nose)

    # index of the last point of each segment of wing_section and of nose_section
    wing_features = nose_features = feature_indices(SEGMENTS)

    def _grid(self, name: str, bodies: tuple[SectionBody | None, ...]) -> BodyGrid:
        keep = [i for i, body in enumerate(bodies) if body is not None]
        kept = [body for body in bodies if body is not None]
        if len(keep) < 2:
            return no_body()
        x = self.sections.x[keep]
        if self.extended:
            ahead, behind = keep[0] == 0, keep[-1] == len(bodies) - 1
            x = np.concatenate([[x[0] - BEYOND] * ahead, x, [x[-1] + BEYOND] * behind])
            kept = kept[:1] * ahead + kept + kept[-1:] * behind
        return body_grid(x, np.array([body.face for body in kept]), [_smooth_line(body, name) for body in kept])

    def _outline(self, x: float, grid: BodyGrid) -> np.ndarray | None:
        self._check_x(x)
        if not grid.x[0] <= x <= grid.x[-1]:
            return None
        y = np.linspace(np.interp(x, grid.x, grid.low) + 1e-9, np.interp(x, grid.x, grid.far) - 1e-9, 1200)
        z = grid_heights(np.full(len(y), float(x)), y, grid)
        line = np.column_stack([y, z])[z > 0.5 * NO_METAL]
        return outline(line, f"{self.label} at x = {x / MM:.1f} mm")


def _lowered(grid: BodyGrid, x: np.ndarray, y: np.ndarray, radius: np.ndarray) -> np.ndarray:
    """(m,)  height of the axle over a body's sections at x (m,), NO_METAL where it is not; y, radius : (n,) of the
    wheel."""
    z = grid_heights(np.repeat(x, len(y)), np.tile(y, len(x)), grid).reshape(len(x), len(y))
    return np.where(z > 0.5 * NO_METAL, z + radius, NO_METAL).max(axis=1)


def outline(line: np.ndarray, what: str) -> np.ndarray:
    """(n, 2)  outline of a section's running surface (k, 2), carried down to the floor on both sides: SEGMENTS."""
    top = int(np.argmax(line[:, 1]))
    depth = min(FACE_DEPTH, 0.5 * (line[top, 1] - line[0, 1]))
    rising = np.maximum.accumulate(line[: top + 1, 1])
    gauge = int(np.searchsorted(rising, line[top, 1] - depth))
    if top - gauge < 3 or len(line) - gauge < 10:
        raise CrossingError(f"{what}: the body is too narrow to be meshed")
    face, head = line[: gauge + 1], line[gauge:]
    lean = np.clip((face[-1, 0] - face[0, 0]) / max(face[-1, 1] - face[0, 1], 1e-9), *BATTER)
    if face[0, 1] > FLOOR:
        face = np.vstack([[face[0, 0] - lean * (face[0, 1] - FLOOR), FLOOR], face])
    total = lengths(head)[-1]
    corner = min(CORNER, 0.4 * total)
    even = lambda part, start, end, count: along(part, np.linspace(start, end, count + 1)[1:])
    side = np.linspace(head[-1, 1], FLOOR, SEGMENTS["side"] + 1)[1:]
    return np.vstack(
        [
            face[:1],
            even(face, 0.0, lengths(face)[-1], SEGMENTS["face"]),
            even(head, 0.0, corner, SEGMENTS["corner"]),
            even(head, corner, total, SEGMENTS["top"]),
            np.column_stack([np.full(len(side), head[-1, 0]), side]),
        ]
    )


def _smooth_line(body: SectionBody, label: str) -> tuple[np.ndarray, Callable[[np.ndarray], np.ndarray]]:
    """Points (k, 2) of y, z and a height of splines between the points' own corners: chords would be flats with
    edges. Without the points' scatter, as of a wheel."""
    points = body.line + [body.face, 0.0]
    if len(points) < 8:
        return points, lambda u: np.interp(u, *points.T)
    noise, corners = body.scatter
    if noise > NOISE:
        quiet, found = smoothed(points, corners, TAKEN * noise, TAKEN * noise)
        if (np.diff(quiet[:, 0]) > 0).all():  # else a steep face of close points would turn back
            points, corners = quiet, found
    return points, with_corners(points, corners, label).height


def check_sections(sections: SectionCrossing) -> None:
    """Refuse sections that cannot be one crossing in the project's axes. Errors: CrossingError with position, size and
    remedy."""
    x = sections.x
    if len(x) < FEWEST:
        raise CrossingError(f"{len(x)} section(s): a crossing needs at least {FEWEST}")
    _check_datum(sections)
    for name, bodies in (("wing", sections.wings), ("nose", sections.noses)):
        there = np.array([body is not None for body in bodies])
        found = np.flatnonzero(there)
        if len(found) and not there[found[0] : found[-1] + 1].all():
            gap = found[0] + int(np.argmin(there[found[0] : found[-1] + 1]))
            raise CrossingError(
                f"section at x = {x[gap]:g} m lacks the {name} that the sections before and behind it have"
            )
        _check_jumps(name, x[found], [bodies[i] for i in found])


def _check_datum(sections: SectionCrossing) -> None:
    """Gauge face and rail level of the first section, and the nose on the gauge side."""
    first, expected = sections.wings[0], cast_leg().gauge_line
    if first is None:
        raise CrossingError(
            f"section at x = {sections.x[0]:g} m: the first section must hold the plain rail or the leg"
        )
    if points_up(first.z) < 0:
        raise CrossingError(
            f"section at x = {sections.x[0]:g} m: its middle lies lower than its ends, up to"
            f" {np.ptp(first.z) / MM:.1f} mm: does z point up? Change the sign of z where it points down"
        )
    aside, up = first.face - expected, float(first.z.max())
    if abs(up) > HEIGHT_ERROR:  # first: a face is placed below rail level
        raise CrossingError(
            f"section at x = {sections.x[0]:g} m: its top lies {up / MM:+.2f} mm from rail level: give"
            f' height = "{-up / MM:.2f} mm"; of a file that begins behind the plain rail, where the wing has risen,'
            " put a section of the plain rail first"
        )
    if abs(aside) > SIDE_ERROR:
        raise CrossingError(
            f"section at x = {sections.x[0]:g} m: its gauge face stands at y = {first.face / MM:.2f} mm,"
            f" {FACE_DEPTH / MM:g} mm below its top, the gauge line at {expected / MM:.2f} mm (y is positive towards"
            f' the field side of the wing): give lateral = "{-aside / MM:.2f} mm", or mirror = true where y runs the'
            " other way; of a file that begins behind the plain rail, where the wing has left the gauge line, put a"
            " section of the plain rail first"
        )


def _check_jumps(name: str, x: np.ndarray, bodies: list[SectionBody]) -> None:
    """A face or a top that jumps from one section to the next: another unit, another side, another zero."""
    for what, values in (("gauge face", [body.face for body in bodies]), ("top", [body.z.max() for body in bodies])):
        if name == "nose" and len(bodies):  # near its tip the face is not yet 14 mm deep, and the top rises steeply
            tip = np.array([body.z.max() > -FACE_DEPTH / 2 for body in bodies])
            x_seen, values = x[tip], np.array(values)[tip]
        else:
            x_seen, values = x, np.array(values)
        step, length = np.abs(np.diff(values)), np.diff(x_seen)
        bad = step > LARGEST_JUMP + LARGEST_SLOPE * np.minimum(length, 0.1)
        if bad.any():
            k = int(np.argmax(bad))
            raise CrossingError(
                f"between the sections at x = {x_seen[k]:g} and {x_seen[k + 1]:g} m the {name}'s {what} jumps by"
                f" {step[k] / MM:.1f} mm: are both of one unit, one side and one zero? Where y of all sections"
                " runs the other way, give"
                " mirror = true"
            )


def moved(points: np.ndarray, mirror: bool, lateral: float, height: float) -> np.ndarray:
    """A section (n, 2) mirrored in y, then moved [m]."""
    points = points[::-1] * [-1.0, 1.0] if mirror else points
    return points + [lateral, height]


def measured_crossing(
    x: np.ndarray, sections: list[np.ndarray], extended: bool = False, label: str = ""
) -> MeasuredCrossing:
    """Crossing from sections (n, 2) of y, z up at stations x (m,) [m]. Errors: CrossingError, ProfileError."""
    x = np.asarray(x, float)
    if len(x) != len(sections):
        raise CrossingError(f"{len(sections)} section(s) at {len(x)} station(s): give one station to each")
    if len(x) > 1 and np.any(np.diff(x) <= 0):
        at = int(np.argmax(np.diff(x) <= 0)) + 1
        raise CrossingError(f"station {x[at]:g} m does not lie beyond {x[at - 1]:g} m: stations must grow")
    try:
        found = SectionCrossing.from_points(x, sections)
    except ProfileError as error:
        raise CrossingError(str(error)) from error
    return MeasuredCrossing(found, extended, label or "crossing by sections")
