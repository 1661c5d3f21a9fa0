"""Sections cut from any surface of a crossing, at as many stations as a tolerance asks for. Axes: geometry.axes.

Stations are found by bisection: a stretch between two sections is cut in its middle as long as the surface that a
reader interpolates there (section_grid) lies farther from the section cut there than the tolerance.
"""

from collections.abc import Callable
from functools import partial

import numpy as np

from geometry.surfaces.any_crossing import AnyCrossing
from geometry.surfaces.crossing import CrossingError
from geometry.surfaces.crossing_surface import FLOOR, NO_METAL
from geometry.surfaces.section_grid import Line, heights_between
from geometry.surfaces.sections import STEEPEST, SectionBody, split, tracked

MM = 1e-3
SPACING = 0.2 * MM  # of a section's points across
MARGIN = 3 * MM  # of floor beside a section's bodies
FIRST_STEP = 50 * MM  # between the stations that are tried first
LEAST_STEP = 1 * MM  # below which no stretch is halved: what is left is an edge, not a curve
RUNNING_DEPTH = 16 * MM  # below a section's top, down to which it must be met, but for its steep faces
MOST_STATIONS = 2000
SectionAt = Callable[[float], np.ndarray]  # x [m] -> (n, 2) y, z [m] of the section there


def cut_section(crossing: AnyCrossing, x: float, spacing: float = SPACING) -> np.ndarray:
    """(n, 2)  y, z [m] of the section of a crossing at x [m], growing in y; the floor between and beside its bodies."""
    wing, nose = crossing.wing_section(x), crossing.nose_section(x)
    there = [body for body in (wing, nose) if body is not None]
    if not there:
        raise CrossingError(f"there is neither wing nor nose at x = {x:g} m: nothing can be cut there")
    low, high = (end(f([body[:, 0].min(), body[:, 0].max()]) for body in there) for end, f in ((min, min), (max, max)))
    y = spacing * np.arange(np.floor((low - MARGIN) / spacing), np.ceil((high + MARGIN) / spacing) + 1)
    at = np.full(len(y), float(x))
    z = np.fmax(*(crossing.heights(at, y, name) for name in ("wing", "nose")))
    return np.column_stack([y, np.maximum(np.where(z > 0.5 * NO_METAL, z, FLOOR), FLOOR)])


def cut_stations(
    section_at: SectionAt, low: float, high: float, tolerance: float, known: tuple[float, ...] = ()
) -> tuple[np.ndarray, list[np.ndarray]]:
    """Stations x (m,) from low to high [m], and the sections there, between which a reader's surface is met.

    tolerance : largest distance, at right angles to the surface, in the middles of the stretches between stations [m];
    known : positions of edges, which become stations
    Errors: CrossingError where more than MOST_STATIONS are needed; whatever section_at and the sections raise.
    """
    ends = [low]
    ends += [at for at in sorted(known) if low + LEAST_STEP < at < high - LEAST_STEP]
    ends = [at for k, at in enumerate(ends) if k == 0 or at - ends[k - 1] > 0.1 * LEAST_STEP] + [high]
    x = np.unique(
        np.r_[tuple(np.linspace(a, b, max(2, int(np.ceil((b - a) / FIRST_STEP)) + 1)) for a, b in zip(ends, ends[1:]))]
    )
    sections = {float(at): section_at(float(at)) for at in x}
    met: set[tuple[float, float]] = set()
    while True:
        x = np.array(sorted(sections))
        tried = [(a, b) for a, b in zip(x, x[1:]) if (a, b) not in met and b - a > LEAST_STEP]
        middles = {0.5 * (a + b): section_at(0.5 * (a + b)) for a, b in tried}
        away = _distances(sections, middles)
        missed = {at: section for (at, section) in middles.items() if away[at][0] > tolerance}
        met |= {(a, b) for a, b in tried if 0.5 * (a + b) not in missed}
        if not missed:
            return x, [sections[float(at)] for at in x]
        sections |= missed
        if len(sections) > MOST_STATIONS:
            worst = max(missed, key=lambda at: away[at])
            raise CrossingError(
                f"more than {MOST_STATIONS} sections between x = {low:g} and {high:g} m: at x = {worst:.4f} m,"
                f" y = {away[worst][1]:.4f} m the surface still lies {away[worst][0] / MM:.3g} mm from that between the"
                f" sections, {tolerance / MM:g} mm are allowed: give a larger tolerance, or mend the surface there"
            )


def _distances(sections: dict[float, np.ndarray], middles: dict[float, np.ndarray]) -> dict[float, tuple[float, float]]:
    """How far each middle section lies from the surface through the other sections, and at which y [m]; infinite where
    a body is in the one and not in the other."""
    found = sorted([*sections, *middles])
    bodies = tracked([split(sections[x] if x in sections else middles[x], x) for x in found])
    out = dict.fromkeys(middles, (0.0, np.nan))
    for which in (0, 1):
        here = {x: body for x, pair in zip(found, bodies) if (body := pair[which]) is not None}
        stations = np.array([x for x in here if x in sections])
        faces = np.array([here[x].face for x in stations])
        lines = [_line(here[x]) for x in stations]
        for x in middles:
            between = len(stations) > 1 and stations[0] < x < stations[-1]
            if x in here and between:
                out[x] = max(out[x], _distance(here[x], lambda y: heights_between(x, y, stations, faces, lines)))
            elif x in here or between:
                out[x] = np.inf, here[x].face if x in here else np.nan
    return out


def _line(body: SectionBody) -> Line:
    line = np.column_stack([body.face + body.u, body.z])
    return line, partial(np.interp, xp=line[:, 0], fp=line[:, 1])


def _distance(body: SectionBody, surface: Callable[[np.ndarray], np.ndarray]) -> tuple[float, float]:
    """Largest distance of a body's running surface from heights over y, at right angles, and its y [m]."""
    y = body.face + body.u
    slope = np.gradient(body.z, y)
    height = surface(y)
    seen = (body.z > body.z.max() - RUNNING_DEPTH) & (height > 0.5 * NO_METAL) & (np.abs(slope) < STEEPEST)
    away = np.where(seen, np.abs(height - body.z) / np.sqrt(1 + slope**2), 0.0)
    worst = int(np.argmax(away))
    return float(away[worst]), float(y[worst])
