"""Hertz' line contact that rolls over a perfectly plastic half-space: where it yields first, and where it shakes down.

Exact: first yield by von Mises at p0 = 1 / 0.5575 = 1.794 yield stresses (nu 0.3), elastic shakedown up to p0 = 4 k
(Melan; Johnson, Contact Mechanics (1985), section 9.2), k the shear yield stress. Every cell is 400 half-widths long
across, so that the half-space is in plane strain.
"""

from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq

from bem.cycle_jumps import CELL_ERROR, LEAST_FLOW, verdict, verdict_words
from bem.material import STEEL
from bem.patch import Grid
from bem.plastic.body import PlasticBody
from bem.plastic.rolling import PlasticTrack
from bem.plastic.surface import LoadStress
from bem.steel.deviator import FROM_DEVIATOR, equivalent_stress
from bem.steel.hardening import Hardening, YieldLaw

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


@dataclass
class Passes:
    """Repeated passes over a ring.

    growth : (passes,) largest growth of the equivalent plastic strain in each pass, of the mean over the ring
    section : (nz, ny) equivalent plastic strain after the last pass, mean over the ring
    per_pass : (nz, ny) its growth in the last pass
    verdict : one of bem.cycle_jumps.VERDICTS, where plastic strain grows most, or "not steady"; words : with the growth
    strain_growth : (nz, 5, ny) growth of the plastic strain itself in the last pass
    solved : passes that were solved; the others of a steady state go on with its growth
    """

    growth: np.ndarray
    section: np.ndarray
    per_pass: np.ndarray
    strain_growth: np.ndarray
    verdict: str
    words: str
    solved: int


def repeat_passes(
    track: PlasticTrack,
    deviator: np.ndarray,
    passes: int,
    stride: int = 1,
    steady: float = 0.01,
    shakedown: float = LEAST_FLOW,
) -> Passes:
    """Roll a given load over a ring again and again until its state is steady, and go on with the steady growth.

    deviator : (nz, 5, nx, ny) of the load in the window [Pa]; stride : columns a step
    steady   : change of the growth per pass over the growth, below which it is taken for steady
    shakedown : growth per pass below which the body has come to rest elastically

    Error of the extrapolation: at most `steady` of the growth per pass, times the passes left; the plastic strain is
    then that of the pass solved last plus growth times the passes left, stresses stay those of the pass solved last.
    """
    growth, grown, previous, steadied = [], [], None, False
    for _ in range(passes):
        before, strain = track.state.peeq.mean(axis=1), track.state.strain.mean(axis=2)
        one_pass(track, deviator, stride)
        change = track.state.peeq.mean(axis=1) - before
        strain_growth = track.state.strain.mean(axis=2) - strain
        growth.append(float(change.max()))
        grown.append((change, np.sqrt(2 / 3) * np.linalg.norm(strain_growth, axis=1)))
        at_rest = growth[-1] <= shakedown
        steadied = at_rest or (previous is not None and np.abs(change - previous).max() <= steady * change.max())
        if steadied:
            break
        previous = change
    solved, (k, j) = len(growth), np.unravel_index(change.argmax(), change.shape)
    left = passes - solved if steadied and not at_rest else 0
    found = words = "not steady"
    if steadied:
        flow, stays = np.array([(flow[k, j], stays[k, j]) for flow, stays in grown]).T
        found, words = (say(flow, stays, shakedown, CELL_ERROR) for say in (verdict, verdict_words))
    growth += [growth[-1]] * left + [0.0] * (passes - solved - left)
    section = track.state.peeq.mean(axis=1) + left * change
    return Passes(np.array(growth), section, change, strain_growth, found, words, solved)


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


def one_pass(track: PlasticTrack, deviator: np.ndarray, stride: int = 1) -> None:
    """The load once around a ring, or from end to end of a track."""
    trial = None
    for column in range(0, track.last + 1, stride):
        track.stand(column)
        track.body.look(deviator)
        trial = track.body.attempt(deviator, trial, 1e-5)
        while track.widened():
            trial = track.body.attempt(deviator, trial, 1e-5)
        track.accept(trial)
