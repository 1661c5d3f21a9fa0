"""Transient rolling by the simplified theory: an ellipse whose load, size, position and creepages change as it rolls.

Kalker's simplified theory, u = L q in every point, with the term of time kept: a point of the rail that sticks takes
on the rigid slip of each length rolled, whatever patch lies on it by then,

    L q (now) = L q (before) - rigid slip * length,

and slides where that passes the bound. Points are those of the rail, on an even grid; they enter with no traction at
the leading edge, or where the patch grows over them. Where nothing changes this is `fastsim`'s march, to its order.
Flexibilities, bound and what a sliding point does are those of bem/halfspace/fastsim.py. Where the patch grows the bed
softens: its displacement stays (or, to see what that matters, its traction).
Error: second order in the step of what creepage puts in; against an exact start and fastsim's steady state:
tests/bem/test_transient_fastsim.py. Source: the equation follows from u = L q; no published transient solution was
opened.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from bem.exact.kalker_table import coefficient_rows
from bem.halfspace.fastsim import flexibilities, patch_rates, sliding_flexibility, spring_step
from bem.material import Pair
from bem.patch import ContactInputError
from kernel_cache import njit

COULOMB = 1.0, np.inf, 0.0  # SlipDependentFriction.law of a constant coefficient


class EllipseHistory(NamedTuple):
    """Of n equal steps. centre, semi : (n, 2) along and across [m];  load : (n,) [N];  creepage : (n, 3) longitudinal,
    lateral, spin about the centre [1, 1, 1/m]"""

    centre: np.ndarray
    semi: np.ndarray
    load: np.ndarray
    creepage: np.ndarray

    def held(self, at: int, steps: int, step: float) -> EllipseHistory:
        """Step `at` as it is, rolled on over as many steps to where it lies, each `step` along x [m]."""
        centre = np.repeat(self.centre[at : at + 1], steps, axis=0)
        centre[:, 0] -= step * np.arange(steps - 1, -1, -1)
        rows = (np.repeat(own[at : at + 1], steps, axis=0) for own in (self.semi, self.load, self.creepage))
        return EllipseHistory(centre, *rows)


class SlipLaw(NamedTuple):
    """Wear depth of a point by its pressure and slip, k(p / H, v s) p s / H per length rolled. pressure, velocity :
    borders of k [1, m/s];  k : (m + 1, n + 1);  hardness [Pa];  speed [m/s]"""

    pressure: np.ndarray
    velocity: np.ndarray
    k: np.ndarray
    hardness: float
    speed: float


class Rolled(NamedTuple):
    """force : (n, 2) of the tractions on body 1 [N];  power : (n,) friction work per length rolled [N];  volume : (n,)
    that the slip law wears per length rolled [m2]"""

    force: np.ndarray
    power: np.ndarray
    volume: np.ndarray


def transient(
    history: EllipseHistory,
    pair: Pair,
    friction: float,
    step: float,
    cell: tuple[float, float],
    law: SlipLaw,
    *,
    carry: str = "displacement",
) -> Rolled:
    """Roll an ellipse through its history, its leading edge at + x; it begins without traction.

    step : length rolled from one row to the next [m];  cell : of the grid along and across [m]
    carry : what a point keeps where the bed softens, "displacement" or "traction"
    Errors: ContactInputError for numbers that are none.
    """
    _check(history, friction, step, cell, carry)
    semi, load = history.semi, history.load
    a, b = semi.T
    flexibility = np.stack(flexibilities(a, b, pair, coefficient_rows(a / b, pair.poisson)), axis=1)
    mean = lambda rows: sliding_flexibility(rows, history.creepage, np.sqrt(semi.prod(axis=1)))
    sliding = mean(flexibility)
    keeps = mean(np.vstack([flexibility[:1], flexibility[:-1]])) / sliding if carry == "displacement" else 1 + 0 * load
    low, high = (history.centre - semi).min(axis=0), (history.centre + semi).max(axis=0)
    counts = np.ceil((high - low) / cell - 1e-9).astype(int) + 1
    x, y = (start + size * (np.arange(count) + 0.5) for start, size, count in zip(low, cell, counts, strict=True))
    out = Rolled(np.zeros((len(load), 2)), np.zeros(len(load)), np.zeros(len(load)))
    rates = patch_rates(history.creepage, flexibility, sliding)
    top = load / (np.pi * semi.prod(axis=1))
    _roll(history.centre, semi, x, y, _Steps(top, friction, rates, keeps, step), law, out)
    return out


class _Steps(NamedTuple):
    """top : (n,) load over the ellipse's area [Pa];  rates : (n, 9) as of fastsim's march;  keeps : (n,) factor on the
    tractions of before"""

    top: np.ndarray
    friction: float
    rates: np.ndarray
    keeps: np.ndarray
    step: float


def _check(history: EllipseHistory, friction: float, step: float, cell: tuple[float, float], carry: str) -> None:
    if carry not in ("displacement", "traction"):
        raise ContactInputError(f"carry {carry!r}: give 'displacement' or 'traction'")
    if not (np.isfinite(friction) and friction >= 0):
        raise ContactInputError(f"friction {friction!r}: give a finite number of 0 or more")
    if not (step > 0 and min(cell) > 0 and np.isfinite([step, *cell]).all()):
        raise ContactInputError(f"step {step!r} m, cell {cell!r} m: give finite numbers above 0")
    rows = np.column_stack([history.centre, history.semi, history.creepage, history.load])
    good = np.isfinite(rows).all(axis=1) & (history.semi > 0).all(axis=1) & (history.load >= 0)
    if not (len(good) and good.all()):
        raise ContactInputError(
            f"history of {len(good)} steps, {int((~good).sum())} of them no ellipses: give finite numbers, axes above"
            " 0, loads of 0 or more"
        )


@njit(cache=True)
def _roll(centre, semi, x, y, steps, law, out):
    """All of them on the points of a grid x (p,), y (q,); forces, power and volume are added to those of out."""
    dx, dy = x[1] - x[0], y[1] - y[0]
    traction = np.zeros((len(x), len(y), 2))
    i0, i1, j0, j1 = 0, -1, 0, -1  # box of the patch before
    for n in range(len(centre)):
        a, b = semi[n]
        cx, cy = centre[n]
        left, lower = max(int((cx - a - x[0]) / dx), 0), max(int((cy - b - y[0]) / dy), 0)
        right = min(int((cx + a - x[0]) / dx) + 1, len(x) - 1)
        upper = min(int((cy + b - y[0]) / dy) + 1, len(y) - 1)
        for i in range(i0, i1 + 1):  # what the patch has left is free
            for j in range(j0, j1 + 1):
                if ((x[i] - cx) / a) ** 2 + ((y[j] - cy) / b) ** 2 >= 1.0:
                    traction[i, j, 0] = 0.0
                    traction[i, j, 1] = 0.0
        i0, i1, j0, j1 = left, right, lower, upper
        for j in range(lower, upper + 1):
            across = y[j] - cy
            reach = 1.0 - (across / b) ** 2
            if reach <= 0.0:
                continue
            edge = a * np.sqrt(reach)
            for i in range(left, right + 1):
                along = x[i] - cx
                if abs(along) < edge:
                    where = along, across, edge, reach - (along / a) ** 2
                    _point(n, where, dx * dy, steps, law, traction[i, j], out)


@njit(cache=True)
def _point(n, where, area, steps, law, traction, out):
    """One point, traction (2,), under the patch in step n. where : from the centre along and across, and of the leading
    edge along [m], and what is 1 in the middle, 0 at the edge;  area : that it stands for [m2]"""
    along, across, edge, inside = where
    top = steps.top[n]
    length = min(steps.step, edge - along)  # that it has been under the patch in this step
    qx, qy = traction[0] * steps.keeps[n], traction[1] * steps.keeps[n]
    bound = 2.0 * steps.friction * top * inside
    made = spring_step(qx, qy, along + length, along, across, bound, 1.0, COULOMB, steps.rates[n])
    tx, ty, slid = made.x, made.y, made.slip * length
    traction[0], traction[1] = tx, ty
    out.force[n, 0] += tx * area
    out.force[n, 1] += ty * area
    if slid > 0.0:
        now = np.hypot(tx, ty)
        work = slid * (now + (qx * tx + qy * ty) / now) / 2 if now > 0.0 else 0.0
        pressure = 1.5 * top * np.sqrt(inside)
        row = np.searchsorted(law.pressure, pressure / law.hardness)
        column = np.searchsorted(law.velocity, slid / length * law.speed)
        depth = law.k[row, column] * pressure * slid / law.hardness
        out.power[n] += work * area / steps.step
        out.volume[n] += depth * area / steps.step
