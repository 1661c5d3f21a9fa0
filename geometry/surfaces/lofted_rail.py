"""A rail whose shape changes along the track, as bodies lofted through sections: crossings, switch rails beside stock
rails. Axes: geometry.axes.

Sections of one body have the same number of nodes and the same feature at the same node. Between sections every node's
position, height and slopes follow a cubic spline in x (continuous curvature); between nodes the height is a cubic in y.
So planes are exact, however they lie, and so are prisms; elsewhere the error is of fourth order in the spacing of the
sections and of the nodes.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline, PchipInterpolator

from geometry.profiles.defects import kinks, noise_level
from geometry.profiles.doctor import with_corners
from geometry.profiles.profile import STEEP, Profile, ProfileError
from geometry.surfaces.crossing import CastCrossing
from geometry.surfaces.loft_kernel import MEMORY, SECTION, LoftTrack, loft_at
from geometry.surfaces.sections import SectionCrossing

MM = 1e-3
STEP = 1e-6  # of the differences that give slopes [m]
FLANK = 20.0  # slope by which a body falls beyond its own end, where another section of it is wider
DEEPEST = 50 * MM
HOLLOW = 1.0  # curvature along x [1/m], below that of any wheel
NODE = 0.25 * MM  # spacing of the nodes of measured sections
SPACING = 4 * MM  # of the sections cut from a parametric crossing
REFINED = 3  # nodes for each of the crossing's own


@dataclass(frozen=True, eq=False)
class LoftedBody:
    """Sections at x (m,), growing; nodes y, z (m, n) [m], y growing; slopes dz/dy on leaving and reaching each node (m,
    n).

    limited : the cubics in x are those of Fritsch and Carlson, which do not swing where unlike sections follow each
        other, but whose
    curvature jumps at sections; otherwise a spline's with continuous curvature
    """

    x: np.ndarray
    y: np.ndarray
    z: np.ndarray
    after: np.ndarray
    before: np.ndarray
    label: str = "body"
    limited: bool = False

    def __post_init__(self):
        if len(self.x) < 2 or np.any(np.diff(self.x) <= 0) or self.y.shape[1] < 3:
            raise ProfileError(
                f"{self.label}: {len(self.x)} section(s) of {self.y.shape[1]} nodes: needs at least 2 at growing x, of"
                " 3 nodes"
            )
        values = np.concatenate([np.ravel(v) for v in (self.x, self.y, self.z, self.after[:, :-1], self.before[:, 1:])])
        if not np.isfinite(values).all():
            raise ProfileError(f"{self.label}: {np.sum(~np.isfinite(values))} value(s) of its sections are not finite")
        falls = np.diff(self.y, axis=1) <= 0
        if falls.any():
            section, node = np.argwhere(falls)[0]
            raise ProfileError(
                f"{self.label}: section at x = {self.x[section]:g} m turns back at y = {self.y[section, node]:.6f} m: y"
                " must grow from node to node"
            )

    @classmethod
    def prism(cls, profile: Profile, x: Sequence[float] = (-1e3, 1e3)) -> "LoftedBody":
        """One profile everywhere between x[0] and x[-1]."""
        y, z, after, before = profile.hermite_table()
        repeat = lambda v: np.tile(v, (len(x), 1))
        return cls(np.asarray(x, float), repeat(y), repeat(z), repeat(after), repeat(before), profile.label)

    @classmethod
    def through(
        cls,
        x: Sequence[float],
        sections: Sequence[Profile | np.ndarray],
        datum: Sequence[float] | float = 0.0,
        spacing: float = NODE,
        label: str = "body",
        limited: bool = False,
    ) -> "LoftedBody":
        """Body through sections whose points match at equal distances y - datum, for each section where its gauge face
        is, or 0 [m].

        sections : profiles, or points (k, 2) of y, z with y growing. Where one is narrower than others it falls away
            steeply.
        """
        for at, section in zip(x, sections):
            y, z = (section.points if isinstance(section, Profile) else np.asarray(section, float)).T
            if not np.isfinite(y + z).all():
                raise ProfileError(
                    f"{label}: section at x = {at:g} m: {np.sum(~np.isfinite(y + z))} point(s) not finite"
                )
            if np.any(np.diff(y) <= 0):
                raise ProfileError(
                    f"{label}: section at x = {at:g} m turns back at y = {y[int(np.argmax(np.diff(y) <= 0))]:.6f} m: y"
                    " must grow from point to point"
                )
        datums = np.broadcast_to(np.asarray(datum, float), len(x))
        points = [s.points if isinstance(s, Profile) else np.asarray(s, float) for s in sections]
        low, high = (f([p[i, 0] - d for p, d in zip(points, datums)]) for f, i in ((min, 0), (max, -1)))
        u = np.linspace(low, high, max(int(np.ceil((high - low) / spacing)), 3) + 1)
        z = np.array([_height(s, p, u + d) for s, p, d in zip(sections, points, datums)])
        slope = np.gradient(z, u, axis=1)
        return cls(np.asarray(x, float), u + datums[:, None], z, slope, slope, label, limited)

    def moved(self, lateral: float) -> "LoftedBody":
        """The body moved to + y [m]."""
        return LoftedBody(self.x, self.y + lateral, self.z, self.after, self.before, self.label, self.limited)

    def turned(self) -> "LoftedBody":
        """The body mirrored in x: what was facing is trailing."""
        return LoftedBody(
            -self.x[::-1], self.y[::-1], self.z[::-1], self.after[::-1], self.before[::-1], self.label, self.limited
        )

    def wavy(self) -> np.ndarray:
        """(m,)  whether dz/dx at one y grows by more than HOLLOW per length between the strips beside a section."""
        flags = np.zeros(len(self.x), bool)
        if len(self.x) > 2:
            y = np.arange(self.y.min(), self.y.max(), 1 * MM)
            z = np.array([np.interp(y, *section, left=np.nan, right=np.nan) for section in zip(self.y, self.z)])
            z = np.where(z > np.nanmax(z) - DEEPEST / 2, z, np.nan)
            slope = np.diff(z, axis=0) / np.diff(self.x)[:, None]
            bend = np.diff(slope, axis=0) / (0.5 * (self.x[2:] - self.x[:-2]))[:, None]
            flags[1:-1] = np.nan_to_num(bend, nan=0.0).max(axis=1) > HOLLOW
        return flags

    def nodes(self) -> np.ndarray:
        """(m, n, 8)  y, z, chord times slope on leaving a node and on reaching the next, and the x-derivatives of all
        four."""
        chord = np.diff(self.y, axis=1, append=self.y[:, -1:])
        secant = np.divide(
            np.diff(self.z, axis=1, append=self.z[:, -1:]), chord, out=np.zeros_like(chord), where=chord > 0
        )
        reach = np.concatenate([self.before[:, 1:], self.before[:, -1:]], axis=1)
        steep = (np.abs(self.after) > STEEP) | (np.abs(reach) > STEEP)
        values = np.stack(
            [self.y, self.z, chord * np.where(steep, secant, self.after), chord * np.where(steep, secant, reach)],
            axis=2,
        )
        if len(self.x) == 2:
            rate = np.repeat(np.diff(values, axis=0) / np.diff(self.x)[0], 2, axis=0)
        else:
            rate = (PchipInterpolator if self.limited else CubicSpline)(self.x, values, axis=0).derivative()(self.x)
        return np.concatenate([values, rate], axis=2)


@dataclass(frozen=True, eq=False)
class RailSurface:
    """The bodies of one rail (wing and nose, switch rail and stock rail); where they overlap in plan the higher one is
    the surface.

    Parameters
    ----------
    bodies : tuple of LoftedBody
        Each through its sections; `of_crossing` and `of_sections` make them.

    Examples
    --------
    >>> surface = geometry.RailSurface.of_crossing(geometry.CastCrossing(), first=-0.2, last=0.6)
    >>> [round(float(x), 3) for x in surface.x_range]  # [m]
    [-0.2, 0.6]
    """

    bodies: tuple[LoftedBody, ...]

    @classmethod
    def of_crossing(
        cls,
        crossing: CastCrossing,
        first: float = -1.0,
        last: float | None = None,
        spacing: float = SPACING,
        refined: int = REFINED,
    ) -> "RailSurface":
        """Wing and nose of a parametric crossing.

        Parameters
        ----------
        crossing : CastCrossing
            Its sections are cut.
        first, last : float
            Ends along x [m]; last None: the crossing's own.
        spacing : float
            Of the sections [m].
        refined : int
            Sections in place of one where bodies begin.

        Returns
        -------
        RailSurface
            Error against the crossing's own surface: tests/geometry/test_surface_contact.py.
        """
        last = crossing.x_range[1] if last is None else last
        cut = lambda a: np.linspace(a, last, max(int(np.ceil((last - a) / spacing)), 3) + 1)
        bodies = [_cast_body(crossing, "wing", cut(first), refined)]
        if last > crossing.nose_x:
            bodies.append(_cast_body(crossing, "nose", cut(max(first, crossing.nose_x)), refined))
        return cls(tuple(bodies))

    @classmethod
    def of_sections(cls, sections: SectionCrossing, first: float = -np.inf, last: float = np.inf) -> "RailSurface":
        """Wing and nose through measured sections between x = first and last [m]; points match at equal distances from
        the gauge faces."""
        made = []
        for label, bodies in (("wing", sections.wings), ("nose", sections.noses)):
            within = [(i, b) for i, b in enumerate(bodies) if b is not None and first <= sections.x[i] <= last]
            keep = [i for i, _ in within]
            if len(keep) < 2:
                continue
            if np.any(np.diff(keep) > 1):
                raise ProfileError(
                    f"{label}: missing in the section at x ="
                    f" {sections.x[keep[int(np.argmax(np.diff(keep) > 1))] + 1]:g} m between others that have it"
                )
            x, faces = sections.x[keep], np.array([b.face for _, b in within])
            lines = [_smooth(np.column_stack([b.u + b.face, b.z]), label) for _, b in within]
            made.append(LoftedBody.through(x, lines, faces, label=label, limited=True))
        if not made:
            raise ProfileError(f"fewer than 2 sections between x = {first:g} and {last:g} m")
        return cls(tuple(made))

    @property
    def x_range(self) -> tuple[float, float]:
        """Where there is any body [m]."""
        return min(b.x[0] for b in self.bodies), max(b.x[-1] for b in self.bodies)

    def moved(self, lateral: float) -> "RailSurface":
        """All bodies moved to + y [m]."""
        return RailSurface(tuple(b.moved(lateral) for b in self.bodies))

    def turned(self) -> "RailSurface":
        """Mirrored in x."""
        return RailSurface(tuple(b.turned() for b in self.bodies))

    def tables(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """x of all sections (S,), nodes (N, 8) and bodies (b, 4) as geometry.surfaces.loft_kernel wants them."""
        nodes = [b.nodes().reshape(-1, 8) for b in self.bodies]
        firsts, origins = (np.cumsum([0] + [len(v) for v in part[:-1]]) for part in ([b.x for b in self.bodies], nodes))
        rows = [[first, len(b.x), b.y.shape[1], origin] for b, first, origin in zip(self.bodies, firsts, origins)]
        return (
            np.concatenate([b.x for b in self.bodies]),
            np.ascontiguousarray(np.concatenate(nodes)),
            np.array(rows, np.int64),
        )

    def wavy(self) -> np.ndarray:
        """(S,)  whether the surface about a section is so hollow along x that a wheel may touch it ahead and behind at
        once."""
        return np.concatenate([b.wavy() for b in self.bodies])

    def height(self, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        """Height of the surface.

        Parameters
        ----------
        x, y : array
            [m], broadcast.

        Returns
        -------
        array
            z [m]; NaN where there is none.
        """
        xs, nodes, bodies = self.tables()
        x, y = (np.asarray(v, float) for v in np.broadcast_arrays(x, y))
        height = np.full(x.shape, np.nan)
        for body in bodies:
            track = LoftTrack(xs, nodes, body, np.zeros(MEMORY), np.zeros(2), np.zeros((1, 2)))
            track.memory[SECTION] = body[0]
            found = [loft_at(a, b, track) for a, b in zip(x.ravel(), y.ravel())]
            height = np.fmax(
                height, np.reshape([at.z if at.beyond == at.aside == 0 else np.nan for at in found], x.shape)
            )
        return height


def _smooth(points: np.ndarray, label: str) -> Profile:
    """Splines through measured points (n, 2) between their corners: a chord would be a flat and its ends edges."""
    return with_corners(points, kinks(points, noise_level(points)), label)


def _height(section: Profile | np.ndarray, points: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Heights (n,) of a section, falling away beyond its ends."""
    inside = np.clip(y, *points[[0, -1], 0])
    z = section.height(inside) if isinstance(section, Profile) else np.interp(inside, *points.T)
    return z - np.minimum(FLANK * np.abs(y - inside), DEEPEST)


def _cast_body(crossing: CastCrossing, body: str, x: np.ndarray, refined: int) -> LoftedBody:
    """Sections of a parametric crossing with nodes at the positions of its own sections, `refined` times as dense, on
    the exact surface."""
    section, features = (
        (crossing.wing_section, crossing.wing_features)
        if body == "wing"
        else (crossing.nose_section, crossing.nose_features)
    )
    count = features["shoulder" if body == "wing" else "field face"]
    lines = [(at, section(at)) for at in x]
    if absent := [at for at, line in lines if line is None]:
        raise ProfileError(f"{body}: there is none at x = {absent[0]:g} m, begin behind it")
    at = np.arange(count * refined + 1) / refined
    y = np.array([np.interp(at, np.arange(count + 1), line[: count + 1, 0]) for _, line in lines if line is not None])
    y = np.maximum.accumulate(y, axis=1) + 1e-9 * np.arange(y.shape[1])
    height = lambda shift: crossing.top_height(x[:, None], y + shift, body)
    at = height(0.0)
    at = np.where(np.isfinite(at), at, np.fmax(height(-STEP), height(STEP)))  # the feet lie on the very edges
    after, before = (
        sign * (-3 * at + 4 * height(sign * STEP) - height(2 * sign * STEP)) / (2 * STEP) for sign in (1.0, -1.0)
    )
    secant = np.diff(at, axis=1) / np.diff(y, axis=1)
    wild = lambda slope, near: np.where(np.isfinite(slope), slope, near)
    after, before = wild(after, np.append(secant, secant[:, -1:], 1)), wild(before, np.append(secant[:, :1], secant, 1))
    return LoftedBody(x, y, at, after, before, body)
