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
from geometry.surfaces.section_grid import BodyGrid, body_grid, grid_heights
from geometry.surfaces.sections import SectionBody, split, tracked

MM = 1e-3
SPACING = 0.2 * MM  # of a section's points across
MARGIN = 3 * MM  # of floor beside a section's bodies
FIRST_STEP = 50 * MM  # between the stations that are tried first
LEAST_STEP = 1 * MM  # below which no stretch is halved: what is left is an edge, not a curve
RUNNING_DEPTH = 16 * MM  # below a section's top, down to which it must be met
STEEPEST = 1.0  # slope across up to which it must be met: on steeper faces the table's own 0.25 mm decide
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
        missed = {at: section for (at, section) in middles.items() if away[at] > tolerance}
        met |= {(a, b) for a, b in tried if 0.5 * (a + b) not in missed}
        if not missed:
            return x, [sections[float(at)] for at in x]
        sections |= missed
        if len(sections) > MOST_STATIONS:
            raise CrossingError(
                f"more than {MOST_STATIONS} sections between x = {low:g} and {high:g} m, the last at"
                f" {max(missed):.3f} m, for a tolerance of {tolerance / MM:g} mm: give a larger one"
            )


def _distances(sections: dict[float, np.ndarray], middles: dict[float, np.ndarray]) -> dict[float, float]:
    """How far each middle section lies from the surface through the other sections [m]; infinite where a body is in
    the one and not in the other."""
    found = sorted([*sections, *middles])
    bodies = tracked([split(sections[x] if x in sections else middles[x], x) for x in found])
    out = dict.fromkeys(middles, 0.0)
    for which in (0, 1):
        here = {x: body for x, pair in zip(found, bodies) if (body := pair[which]) is not None}
        stations = [x for x in here if x in sections]
        if len(stations) < 2:
            for x in here:
                if x in middles:
                    out[x] = np.inf
            continue
        grid = _grid(np.array(stations), [here[x] for x in stations])
        for x in middles:
            between = stations[0] < x < stations[-1]
            if x in here:
                out[x] = max(out[x], _distance(x, here[x], grid) if between else np.inf)
            elif between:
                out[x] = np.inf
    return out


def _grid(x: np.ndarray, bodies: list[SectionBody]) -> BodyGrid:
    lines = [np.column_stack([body.face + body.u, body.z]) for body in bodies]
    faces = np.array([body.face for body in bodies])
    return body_grid(x, faces, [(line, partial(np.interp, xp=line[:, 0], fp=line[:, 1])) for line in lines])


def _distance(x: float, body: SectionBody, grid: BodyGrid) -> float:
    """Largest distance of a body's running surface from a table, at right angles [m]."""
    y = body.face + body.u
    running = body.z > body.z.max() - RUNNING_DEPTH
    height = grid_heights(np.full(len(y), x), y, grid)
    slope = np.gradient(body.z, y)
    seen = running & (height > 0.5 * NO_METAL) & (np.abs(slope) < STEEPEST)
    return float(np.max(np.abs(height - body.z)[seen] / np.sqrt(1 + slope[seen] ** 2), initial=0.0))
