"""Hertz' line contact that rolls over a perfectly plastic half-space: where it yields first, and where it shakes down.

Exact: first yield by von Mises at p0 = 1 / 0.5575 = 1.794 yield stresses (nu 0.3), elastic shakedown up to p0 = 4 k
(Melan; Johnson, Contact Mechanics (1985), section 9.2), k the shear yield stress. Every cell is 400 half-widths long
across, so that the half-space is in plane strain.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq

from bem.material import STEEL
from bem.patch import Grid
from bem.plastic.body import PlasticBody
from bem.plastic.deviator import FROM_DEVIATOR, equivalent_stress
from bem.plastic.hardening import Hardening, YieldLaw
from bem.plastic.rolling import PlasticTrack, repeat_passes
from bem.plastic.surface import LoadStress

YIELD = 300e6
SHEAR_YIELD = YIELD / np.sqrt(3)
PASSES, RESTS = 16, 0.02  # a load shakes down whose last pass adds less than this part of what the first did
ORTHOGONAL = 4  # xz in the order of stress components


def rolling_line(
    ratio: float, cells: int, depth: float = 3.2, ring: int = 8, hardening: YieldLaw | None = None, window: int = 3
) -> tuple[PlasticTrack, np.ndarray]:
    """A ring of `ring` half-widths (1 m), in so many cells per half-width, and the deviator (nz, 5, nx, 1) [Pa] of
    Hertz' pressure p0 = ratio k over a window of so many half-widths; depth : of the cells over the half-width."""
    side, nx = 1.0 / cells, window * cells
    grid = Grid.over((-nx / 2 * side, nx / 2 * side), (-200.0, 200.0), nx, 1)
    body = PlasticBody(grid, side, int(depth * cells), STEEL, hardening or Hardening.linear(YIELD))
    edges = np.clip(np.append(grid.x - side / 2, grid.x[-1] + side / 2), -1, 1)
    whole = (edges * np.sqrt(1 - edges**2) + np.arcsin(edges)) / 2
    pressure = ratio * SHEAR_YIELD * np.diff(whole) / side
    deviator, _ = LoadStress(grid, body.depths, STEEL.poisson)((pressure[:, None],))
    return PlasticTrack(body, ring * cells, min(window, ring // 2) * cells, periodic=True), deviator


@dataclass(frozen=True)
class LineLimits:
    """cells per half-width; first_yield : p0 over the yield stress; shakedown : p0 over k, found by rolling;
    by_shear : p0 over k at which the largest orthogonal shear stress in these cells is k, Melan's limit for them;
    tried : (p0 over k, growth of the last pass over that of the first) of each load rolled"""

    cells: int
    first_yield: float
    shakedown: float
    by_shear: float
    tried: tuple[tuple[float, float], ...]


def last_growth(ratio: float, cells: int, passes: int = PASSES) -> float:
    """Growth of plastic strain in the last pass over that in the first; 0 where the half-space has come to rest."""
    track, deviator = rolling_line(ratio, cells)
    found = repeat_passes(track, deviator, passes, stride=max(1, cells // 3), steady=1e-3)
    return float(found.growth[-1] / found.growth[0]) if found.growth[0] > 0 else 0.0


def line_limits(cells: int, between: tuple[float, float] = (3.9, 4.2), tolerance: float = 0.01) -> LineLimits:
    """Both limits on so many cells per half-width.

    The shakedown limit is where the last of PASSES passes adds RESTS of what the first did, by Brent's method on the
    logarithm; twice or half of RESTS moves it by 0.3 %.
    """
    _, deviator = rolling_line(1.0, cells)
    shear = np.abs(np.einsum("c,kcij->kij", FROM_DEVIATOR[ORTHOGONAL], deviator)).max() / SHEAR_YIELD
    tried = []

    def excess(ratio: float) -> float:
        growth = last_growth(ratio, cells)
        tried.append((ratio, growth))
        return float(np.log(max(growth, 1e-9) / RESTS))

    limit = brentq(excess, *between, xtol=tolerance)
    first_yield = 1 / (equivalent_stress(deviator).max() / SHEAR_YIELD)
    return LineLimits(cells, float(first_yield), float(limit), float(1 / shear), tuple(tried))
