"""Contact band of a rigid wheel on the plan of a crossing, and what its path does there in numbers. Axes:
geometry.axes.

The band is the part of the surface that comes nearer to the rolling wheel than half of an elastic approach. An approach
d flattens a patch of half width sqrt(R d) (Hertz), and two bodies pressed together by d / 2 without giving way overlap
over just that width.
"""

from dataclasses import dataclass

import numpy as np

from geometry.axes import tread_datum_y
from geometry.path.wheel_path import WheelPath
from geometry.profiles.profile import Profile
from geometry.surfaces.any_crossing import AnyCrossing
from geometry.surfaces.bodies import NO_METAL
from geometry.surfaces.crossing import CastCrossing
from kernel_cache import njit

AWAY = 1.0  # clearance where there is no surface or no wheel [m]
REACH = 0.05  # of a position along the track from the axles that may be near it [m]


@njit(cache=True)
def nearest(x, y, surface, axle_x, axle, radius, reach):
    """Least clearance (n, m) [m] of rolling circles over surface heights (n, m) at x (n,), y (m,).

    axle_x, axle : (k,)  growing positions of the axle and its heights;  radius : (m,)  of the wheel at y, NaN beside it
    """
    out = np.full(surface.shape, AWAY)
    for i in range(len(x)):
        first, last = np.searchsorted(axle_x, x[i] - reach), np.searchsorted(axle_x, x[i] + reach)
        for j in range(len(y)):
            if surface[i, j] < 0.5 * NO_METAL or np.isnan(radius[j]):
                continue
            square = radius[j] ** 2
            for k in range(first, last):
                ahead = x[i] - axle_x[k]
                out[i, j] = min(out[i, j], axle[k] - np.sqrt(square - ahead * ahead) - surface[i, j])
    return out


def clearance(
    crossing: AnyCrossing, wheel: Profile, path: WheelPath, x: np.ndarray, y: np.ndarray, body: str
) -> np.ndarray:
    """How near (n, m) [m] the wheel comes to "wing" or "nose" at x (n,), y (m,) while its axle goes along the path;
    AWAY where it cannot.

    Second order in the path's spacing h: h^2 / (8 radius), 0.3 um at 1 mm. x within the path.
    """
    grid_x, grid_y = np.meshgrid(x, y, indexing="ij")
    surface = np.nan_to_num(crossing.top_height(grid_x, grid_y, body), nan=NO_METAL)
    datum = tread_datum_y()
    point, order = path.contact_point, np.argsort(path.x)
    rolling = path.radius - wheel.height(point[:, 1] - datum)
    axle = point[:, 2] + np.sqrt(rolling**2 - (point[:, 0] - path.x) ** 2)
    return nearest(x, y, surface, path.x[order], axle[order], path.radius - wheel.height(y - datum), REACH)


def band_edges(near: np.ndarray, y: np.ndarray, approach: float) -> np.ndarray:
    """Edges (n, 2) of the band at each x [m]: outermost y nearer than half an approach; NaN where there is none."""
    inside = near < approach / 2
    low, high = y[np.argmax(inside, axis=1)], y[inside.shape[1] - 1 - np.argmax(inside[:, ::-1], axis=1)]
    return np.where(inside.any(axis=1)[:, None], np.column_stack([low, high]), np.nan)


@dataclass(frozen=True)
class PathNumbers:
    """What a path does, facing; trailing is the same path run backwards: every climb is then a fall.

    ramp_lift : height gained from plain rail to the cast leg [m];
    ramp_slope, ramp_x : steepest climb there and where it is
    lowest_x, lowest : where the axle stands lowest about the nose, and how far below plain line [m]
    transfer_x : where the nose takes over [m];  fall, rise : slopes before and after it;
    dip : their sum, 0 where the path does not rise [rad]
    trailing_slope, trailing_x : steepest climb met when run backwards
    """

    ramp_lift: float
    ramp_slope: float
    ramp_x: float
    lowest_x: float
    lowest: float
    transfer_x: float
    fall: float
    rise: float
    dip: float
    trailing_slope: float
    trailing_x: float


# over which the slopes beside the transfer are taken at 1:9.25; they stretch with the crossing [m]
FALL_LENGTH, RISE_LENGTH = 20e-3, 55e-3


LEAST_RISE = 0.1e-3  # of the path after the transfer, below which there is no dip [rad]


def path_numbers(path: WheelPath, crossing: CastCrossing) -> PathNumbers:
    """Numbers of a path that reaches from plain rail to beyond the transfer, x growing."""
    shape, x = crossing.shape, path.x
    ramp = (x > shape.leg_start - 0.08) & (x < shape.leg_end + 0.115)
    steepest = int(np.argmax(np.where(ramp, path.slope, -np.inf)))
    about_nose = x > 0.0
    lowest = int(np.argmin(np.where(about_nose, path.height, np.inf)))
    transfer = float(path.transfers[0]) if len(path.transfers) else np.nan
    height = lambda at: float(np.interp(at, x, path.height))
    # the path bends between them
    before, after = x[x <= transfer].max(initial=-np.inf), x[x >= transfer].min(initial=np.inf)
    back, on = crossing.stretch * FALL_LENGTH, crossing.stretch * RISE_LENGTH
    fall = (height(before - back) - height(before)) / back
    rise = (height(after + on) - height(after)) / on
    backwards = int(np.argmin(path.slope))
    return PathNumbers(
        ramp_lift=float(path.height[ramp][-1]),
        ramp_slope=max(float(path.slope[steepest]), 0.0),
        ramp_x=float(x[steepest]),
        lowest_x=float(x[lowest]),
        lowest=float(-path.height[lowest]),
        transfer_x=transfer,
        fall=fall,
        rise=rise,
        dip=fall + rise if rise > LEAST_RISE else 0.0,
        trailing_slope=float(-path.slope[backwards]),
        trailing_x=float(x[backwards]),
    )
