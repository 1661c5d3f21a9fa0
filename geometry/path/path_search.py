"""Highest position of a rigid wheel over one body of a crossing: first search on a grid, then refinement on the exact
surface."""

from __future__ import annotations

import functools
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from geometry.profiles.profile import Profile, hermite, hermite_many
from geometry.surfaces.bodies import NO_METAL
from geometry.surfaces.surface_height import surface_height
from kernel_cache import njit

if TYPE_CHECKING:
    from geometry.surfaces.any_crossing import AnyCrossing

PEAKS = 4  # lateral positions kept per station of the first search
# spacing of the stations along x over the lateral spacing: the wheel's curvature is that much smaller
STATION_RATIO = 8
SEPARATION = 2e-3  # lateral positions closer than this are one [m]
APART = 18e-3  # of two contacts of a wheel with one body, which give way each by itself [m]
# times the resolution squared: positions whose first-search heights differ by less are all refined [1/m]
UNDECIDED = 320.0
CLOSE = 2e-8  # width to which a position is closed in [m]
GOLDEN = (np.sqrt(5.0) - 1.0) / 2.0

_part = njit(cache=True, forceinline=True, error_model="numpy")


class Bracket(NamedTuple):
    """State of Brent's method for the highest value between a and b: the best position x, the two before it (w, v),
    their values, the last step and the one before it, and the position to be evaluated next; NaN when closed in.

    Source: Brent, Algorithms for Minimization without Derivatives (1973), chapter 5.
    """

    a: float
    b: float
    x: float
    w: float
    v: float
    fx: float
    fw: float
    fv: float
    step: float
    before: float
    next: float


class BodySearch:
    """Contacts of one wheel with one body ("wing" or "nose") over a range of axle positions.

    The first search tabulates, at stations along x, the lateral positions where surface minus profile peaks. It is
    shared by all axle positions: moving the wheel along x changes only how far the wheel has risen away from a station.
    """

    def __init__(self, crossing: AnyCrossing, wheel: Profile, body: str, x, radius, datum, resolution, reach):
        self.surface = (body == "nose", *crossing.tables)
        self.profile = wheel.hermite_table()
        self.radius, self.datum, self.reach = radius, datum, reach
        self.spacing = resolution
        low, high = float(np.min(x) - reach), float(np.max(x) + reach)
        self.stations, self.peaks = _tabulated(crossing, wheel, body, radius, datum, resolution, low, high)

    def contacts(self, x: np.ndarray, beside: np.ndarray | None = None) -> tuple[np.ndarray, np.ndarray]:
        """Axle height less radius (n,) and contact point (n, 3) [m] at axle positions x (n,); NaN where out of
        reach. beside (n,) : y of a contact there, from which others are looked for that lie APART across [m]; NaN:
        none are."""
        wheel = self.radius, self.datum, self.profile
        other = np.full(len(x), np.inf) if beside is None else beside
        return refine_all(x, other, self.stations, self.peaks, self.reach, self.spacing, *wheel, *self.surface)

    def first_search(self, x: np.ndarray, beside: np.ndarray | None = None) -> np.ndarray:
        """Axle height less radius (n,) of the first search alone; NaN where out of reach. beside : as of contacts."""
        other = np.full(len(x), np.inf) if beside is None else beside
        return search_all(x, other, self.stations, self.peaks, self.reach)


@functools.lru_cache(maxsize=32)
def _tabulated(crossing, wheel, body, radius, datum, resolution, low, high) -> tuple[np.ndarray, np.ndarray]:
    """Stations (m,) between low and high [m] and their lateral peaks; kept, as it is most of what a path costs."""
    stations = np.linspace(low, high, max(int(np.ceil((high - low) / (STATION_RATIO * resolution))), 2) + 1)
    profile = wheel.hermite_table()
    width = profile[0][-1] - profile[0][0]
    y = profile[0][0] + np.arange(int(width / resolution) + 1) * resolution
    tread = hermite_many(y, *profile)[0]
    return stations, lateral_peaks(stations, y + datum, tread, radius, body == "nose", *crossing.tables)


@njit(cache=True, error_model="numpy")
def lateral_peaks(stations, y, tread, radius, nose, c, loft):
    """Positions where surface minus profile peaks at each station, highest first; NaN where there are fewer than PEAKS.

    Returns (m, PEAKS, 3): y, surface minus profile, radius of the wheel there.
    """
    peaks = np.full((len(stations), PEAKS, 3), np.nan)
    gap = np.empty(len(y))
    for i in range(len(stations)):
        for j in range(len(y)):
            z = surface_height(stations[i], y[j], nose, c, loft)
            gap[j] = z - tread[j] if z > 0.5 * NO_METAL else -np.inf
        for j in range(len(y)):
            rising = j == 0 or gap[j] >= gap[j - 1]
            falling = j == len(y) - 1 or gap[j] > gap[j + 1]
            if rising and falling and gap[j] > -np.inf:
                insert_peak(peaks[i], y[j], gap[j], radius - tread[j])
    return peaks


@_part
def insert_peak(peaks, y, value, radius):
    """Keep the highest peaks (PEAKS, 3), highest first."""
    for k in range(len(peaks)):
        if np.isnan(peaks[k, 1]) or value > peaks[k, 1]:
            for m in range(len(peaks) - 1, k, -1):
                for n in range(3):  # a row at once brings numba's words on shapes that do not fit: seconds to compile
                    peaks[m, n] = peaks[m - 1, n]
            peaks[k, 0], peaks[k, 1], peaks[k, 2] = y, value, radius
            return


@_part
def rise(ahead, radius):
    """How far a circle has risen at this distance from its lowest point."""
    return ahead * ahead / (radius + np.sqrt(radius * radius - ahead * ahead))


@_part
def station_range(at, stations, reach):
    return np.searchsorted(stations, at - reach), np.searchsorted(stations, at + reach, side="right")


@njit(cache=True, error_model="numpy")
def search_all(x, other, stations, peaks, reach):
    """Highest position (n,) over all stations within reach."""
    out = np.full(len(x), np.nan)
    for i in range(len(x)):
        value, station, _ = best_position(x[i], other[i], stations, peaks, reach, out, 0)
        if station >= 0:
            out[i] = value
    return out


@_part
def clear_of(y, found, count):
    for k in range(count):
        if abs(y - found[k]) < SEPARATION:
            return False
    return True


@_part
def best_position(at, other, stations, peaks, reach, found, count):
    """Station and peak of the highest position clear of those already found, and APART from the y of another contact:
    (height, station, peak), station -1: none."""
    best, station, peak = -np.inf, -1, -1
    first, last = station_range(at, stations, reach)
    for s in range(first, last):
        for k in range(peaks.shape[1]):
            if np.isnan(peaks[s, k, 1]):
                break
            height = peaks[s, k, 1] - rise(stations[s] - at, peaks[s, k, 2])
            y = peaks[s, k, 0]
            if height > best and abs(y - other) >= APART and clear_of(y, found, count):
                best, station, peak = height, s, k
    return best, station, peak


@njit(cache=True, error_model="numpy")
def refine_all(x, other, stations, peaks, reach, spacing, radius, datum, profile, nose, c, loft):
    """Refined height (n,) and point (n, 3): the best of all positions that the first search cannot tell apart."""
    height, point = np.full(len(x), np.nan), np.full((len(x), 3), np.nan)
    step = stations[1] - stations[0]
    found = np.empty(PEAKS)
    for i in range(len(x)):
        top = -np.inf
        for count in range(PEAKS):
            value, s, k = best_position(x[i], other[i], stations, peaks, reach, found, count)
            if s < 0 or value < top - UNDECIDED * spacing * spacing:
                break
            top = max(top, value)
            found[count] = peaks[s, k, 0]
            guess = stations[s] - x[i], peaks[s, k, 0]
            z, ahead, y = climb(x[i], guess, reach, step, spacing, radius, datum, profile, nose, c, loft)
            # a position at the rim is not where they meet
            if abs(ahead) < reach and abs(y - other[i]) >= APART and (np.isnan(height[i]) or z > height[i]):
                height[i] = z
                point[i, 0], point[i, 1] = x[i] + ahead, y
                point[i, 2] = surface_height(x[i] + ahead, y, nose, c, loft)
    return height, point


@_part
def axle_height(z, tread, ahead, radius):
    """Axle height less radius at which the wheel, its tread at this height, touches a surface of height z `ahead`."""
    if z < 0.5 * NO_METAL or np.isnan(tread):
        return -np.inf
    return z - tread - rise(ahead, radius - tread)


@_part
def opened(a, b):
    """A bracket between a and b before anything was evaluated."""
    x = a + (1 - GOLDEN) * (b - a)
    return Bracket(a, b, x, x, x, -np.inf, -np.inf, -np.inf, 0.0, np.inf, x)


@_part
def narrowed(old, value):
    """The bracket with the value at its next position: narrower, or closed in."""
    a, b, x, w, v, fx, fw, fv, u = old.a, old.b, old.x, old.w, old.v, old.fx, old.fw, old.fv, old.next
    if old.before == np.inf:  # the first
        fx = fw = fv = value
    elif value >= fx:
        a, b = (x, b) if u >= x else (a, x)
        v, w, x, fv, fw, fx = w, x, u, fw, fx, value
    else:
        a, b = (u, b) if u < x else (a, u)
        if value >= fw or w == x:
            v, w, fv, fw = w, u, fw, value
        elif value >= fv or v == x or v == w:
            v, fv = u, value
    step, before = next_step(a, b, x, w, v, fx, fw, fv, old.step, 0.0 if old.before == np.inf else old.before)
    closed = abs(x - (a + b) / 2) <= CLOSE - (b - a) / 2
    least = step if abs(step) >= CLOSE / 2 else np.copysign(CLOSE / 2, step)
    return Bracket(a, b, x, w, v, fx, fw, fv, step, before, np.nan if closed else x + least)


@_part
def next_step(a, b, x, w, v, fx, fw, fv, step, before):
    """Step from x and the one before it: to the top of a parabola through the three best, where steps shrink so and it
    lies inside; else a golden section of the larger part."""
    middle = (a + b) / 2
    if abs(before) > CLOSE / 2 and np.isfinite(fx + fw + fv):
        r, q = (x - w) * (fv - fx), (x - v) * (fw - fx)
        p, q = (x - v) * q - (x - w) * r, 2 * (q - r)
        p, q = (-p, q) if q > 0 else (p, -q)
        if abs(p) < abs(q * before / 2) and q * (a - x) < p < q * (b - x):
            near = min(x + p / q - a, b - x - p / q) < CLOSE
            return (np.copysign(CLOSE / 2, middle - x) if near else p / q), step
    larger = (a if x >= middle else b) - x
    return (1 - GOLDEN) * larger, larger


@_part
def along_wheel(at, y, low, high, radius, datum, profile, nose, c, loft):
    """Highest position along x at this y between low and high: (height, ahead)."""
    now, (tread, _) = opened(low, high), hermite(y - datum, *profile)
    while not np.isnan(now.next):
        z = surface_height(at + now.next, y, nose, c, loft)
        now = narrowed(now, axle_height(z, tread, now.next, radius))
    return now.fx, now.x


@_part
def climb(at, guess, reach, step, spacing, radius, datum, profile, nose, c, loft):
    """Refine, and again from where that ended as long as it ends at the rim of its window, up to the reach."""
    ahead, y = guess
    z = -np.inf
    while abs(ahead) < reach:
        new, new_ahead, new_y = refine(at, ahead, y, step, spacing, radius, datum, profile, nose, c, loft)
        inside = abs(new_ahead - ahead) < 1.9 * step and abs(new_y - y) < 1.9 * spacing
        higher = new > z + 1e-12  # along a line contact the position may wander without end
        z, ahead, y = max(new, z), new_ahead, new_y
        if inside or not higher:
            break
    return z, ahead, y


@_part
def refine(at, ahead, y, step, spacing, radius, datum, profile, nose, c, loft):
    """Highest position near a first guess: over y of the highest position along x. (height, ahead, y).

    Needs no derivatives, so that edges and kinks of either surface are found as they are; the ends of the window are
    looked at too, as a wheel may stand on its rim. One call of `along_wheel` serves all evaluations: every further one
    would be compiled in again.
    """
    a, b = max(y - 2 * spacing, profile[0][0] + datum), min(y + 2 * spacing, profile[0][-1] + datum)
    now, position, count = opened(a, b), a, 0
    best, best_ahead, best_y = -np.inf, ahead, y
    while not np.isnan(position):
        value, along = along_wheel(
            at, position, ahead - 2 * step, ahead + 2 * step, radius, datum, profile, nose, c, loft
        )
        if value > best:
            best, best_ahead, best_y = value, along, position
        count += 1
        if count > 2:
            now = narrowed(now, value)
        position = b if count == 1 else now.next
    return best, best_ahead, best_y
