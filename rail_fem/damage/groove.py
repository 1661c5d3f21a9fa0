"""The groove that a wheel presses into a rail until its patch carries the load in shakedown.

Rolling contact beyond a limit p0 = c k (k shear yield stress of the hardened steel) makes the rail flow under every
wheel until it conforms so well that p0 comes down to the limit; work-hardening meets it half-way. Lowered by u at the
contact point, the rail has the wheel's shape over the half-width w = sqrt(2 R u), R the relative radius across.
Together they then are the paraboloid of relative radius

    R' = R (1 + u / d),   d the virtual penetration by which rail_fem.contact.contact_table measures radii,

so the pass over the changed surface finds what the law wants. What flows is strained by STRAIN w / R: its square grows
in proportion to u, whatever the steps in which u grows, and k rises along the steel's curve. Depth and hardening are
found together by bisection, none below the limit.
Constants: STRAIN and the limit c are read off surface and plastic strain that ten passes of fe_full have left on
wing and nose (docs/models/damage.md); Tabor's strain is 0.2, elastic shakedown of a line contact 4 (Johnson, Contact
Mechanics (1985), 6.2, 9.2, recalled; tests/bem/plastic/line_shakedown.py).
Error: a Hertz patch in a groove wider than itself; the load's own groove beside others' is not seen before the next
pass over the surface.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy import ndimage

from geometry.surfaces.bodies import BODIES
from rail_fem.contact.contact_table import DEPTHS, VIRTUAL, hertz_constants, patch_sizes
from rail_fem.scene.steel import Steel
from rail_fem.settings.damage import FLOW_LIMIT, FLOW_SHARE

STRAIN = 0.27  # of what flows over half-width / radius of the groove; 0.24 to 0.31 in fe_full
FLATTEST = np.log(1e4)  # of R' / R
DEEPEST = 1e-3  # that one pass over the surface may ask for [m]
ROUNDS = 50
STRIPS = 24  # of a groove's shape
TRACE = 30e-3  # of a pass's begin and end, by which its line goes on [m]
ACROSS = np.linspace(-0.9, 0.9, 7)  # of a patch, where the steel's strain is looked at


@dataclass(frozen=True)
class FlowLaw:
    """limit : largest pressure over shear yield stress in shakedown;  share : of what is left to flow that one pass
    does, below 1"""

    limit: float = FLOW_LIMIT
    share: float = FLOW_SHARE

    @property
    def rate(self) -> float:
        """Of the exponential approach per pass."""
        return float(-np.log1p(-self.share))


class Grooves(NamedTuple):
    """Each (k,). depth : still to flow [m];  half_width : of the groove [m];  square : that its flow adds to the square
    of the strain"""

    depth: np.ndarray
    half_width: np.ndarray
    square: np.ndarray


def grooves(
    force: np.ndarray,
    radii: np.ndarray,
    modulus: float,
    load: np.ndarray,
    steel: Steel,
    strain: np.ndarray,
    limit: float,
    flowed: np.ndarray | float = 0.0,
) -> Grooves:
    """What k patches still press into a steel.

    force (k,) normal [N];  radii (k, 2) relative, along and across [m];  modulus E* [Pa];  load (k,) [N] by which the
    radii were measured;  strain (k,) of the steel so far;  limit : p0 / k of shakedown;  flowed (k,) : depth of flow
    that the radii hold already [m]
    """
    if steel.is_elastic or not len(force):
        return Grooves(*np.zeros((3, len(force))))

    flowed = np.maximum(flowed, 0.0) + np.zeros_like(force)
    measured = np.clip(VIRTUAL * (load / hertz_constants(radii, modulus)) ** (2 / 3), *DEPTHS)
    first = radii[:, 1] / (1 + flowed / measured)  # radius across before any flow

    def at(flatter: np.ndarray) -> tuple[np.ndarray, Grooves]:
        """Pressure over the limit, for the logarithm of R' / R."""
        new = radii * np.stack([np.ones_like(flatter), np.exp(flatter)], axis=1)
        virtual = np.clip(VIRTUAL * (load / hertz_constants(new, modulus)) ** (2 / 3), *DEPTHS)
        depth = np.maximum(virtual * (new[:, 1] / first - 1) - flowed, 0.0)
        half_width = np.sqrt(2 * first * (flowed + depth))
        square = 2 * STRAIN**2 * depth / first
        pressure = 1.5 * force / (np.pi * patch_sizes(force, new, modulus).prod(axis=1))
        shear = steel.yield_stress(np.sqrt(strain**2 + square)) / np.sqrt(3)
        return pressure / (limit * shear), Grooves(depth, half_width, square)

    low, high = np.zeros(len(force)), np.full(len(force), FLATTEST)
    for _ in range(ROUNDS):
        middle = (low + high) / 2
        over = at(middle)[0] > 1
        low, high = np.where(over, middle, low), np.where(over, high, middle)
    flows = (at(np.zeros(len(force)))[0] > 1) & (force > 0)
    found = at(high)[1]
    deep = np.minimum(found.depth, DEEPEST)
    part = deep / np.maximum(found.depth, 1e-30)
    return Grooves(*(np.where(flows, v, 0.0) for v in (deep, found.half_width * np.sqrt(part), found.square * part)))


def mean_under(
    field: np.ndarray, grid: tuple[np.ndarray, np.ndarray], body: np.ndarray, position: np.ndarray, width: np.ndarray
) -> np.ndarray:
    """(k,) mean of a field (2, m, n) on the plan x (m,), y (n,) across patches of half-width (k,) in plan [m]."""
    x, y = grid
    i = np.repeat(((position[:, 0] - x[0]) / (x[1] - x[0]))[:, None], len(ACROSS), axis=1)
    j = (position[:, 1, None] + width[:, None] * ACROSS - y[0]) / (y[1] - y[0])
    out = np.zeros(len(body))
    for b in range(len(BODIES)):
        own = body == b
        out[own] = ndimage.map_coordinates(field[b], [i[own], j[own]], order=1, mode="nearest").mean(axis=1)
    return out


def groove_strips(found: Grooves) -> tuple[np.ndarray, np.ndarray]:
    """Depths and squares of strain (k, 2, STRIPS) of strips across each groove, a parabola; their widths (k,) [m]."""
    across = (2 * np.arange(STRIPS) + 1 - STRIPS) / STRIPS
    shape = found.depth[:, None] * (1 - across**2)
    with np.errstate(divide="ignore", invalid="ignore"):
        per_depth = np.where(found.depth > 0, found.square / found.depth, 0.0)
    return np.stack([shape, shape * per_depth[:, None]], axis=1), 2 * found.half_width / STRIPS


def carried_beyond(
    place: np.ndarray, pass_x: np.ndarray, spacing: float, x: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Which of the patches at place (k, 2) [m] press a groove, and where: all of them, and where the pass over x of its
    patches pass_x [m] begins or ends on their body the outermost once more every spacing [m] to the end of the plan x
    (m,), along the line in which they lie: a groove that ended where the pass does, or ran on beside the wheel's line,
    would be a step that no wheel has made."""
    of, out = [np.arange(len(place))], [place]
    for side, end, edge in ((-1, pass_x.min(initial=np.inf), x[0]), (1, pass_x.max(initial=-np.inf), x[-1])):
        near = np.flatnonzero(np.abs(place[:, 0] - end) < TRACE)
        if len(near) > 1 and np.abs(place[near, 0] - end).min() < spacing:
            last = near[np.argmin(np.abs(place[near, 0] - end))]
            slope = np.polyfit(place[near, 0] - place[last, 0], place[near, 1], 1)[0]
            away = side * np.arange(spacing, np.abs(edge - end) - spacing / 2, spacing)
            of.append(np.full(len(away), last))
            out.append(place[last] + away[:, None] * np.array([1.0, slope]))
    return np.concatenate(of), np.concatenate(out)


def held_beyond(field: np.ndarray, at: np.ndarray, x: np.ndarray) -> np.ndarray:
    """A field (..., m, n) on lines x (m,) whose lines beyond the patches at (k,) [m] go on as the last ones under them:
    a groove that ended where the pass does would be a ramp that no wheel has made."""
    if len(at) < 2:
        return field
    first, last = np.searchsorted(x, at.min()) + 1, np.searchsorted(x, at.max()) - 2
    if first >= last:
        return field
    out = field.copy()
    out[..., :first, :], out[..., last + 1 :, :] = field[..., first, None, :], field[..., last, None, :]
    return out
