"""Indentation of an elastic-plastic half-space: pressure, plastic strain and residual surface displacement together.

Body 2 (below) yields, body 1 (above) is elastic; friction only as a sliding traction in proportion to the pressure. At
each load the pressure follows from the gap plus the residual displacement of the surface, the plastic strain from the
pressure, and the displacement from the plastic strain; the three are brought to agree by Anderson's mixing. Plastic
strain lives in a box of cells around the yielding zone.
Source: the scheme of Jacq, Nelias, Lormand and Girodin, J. Tribol. 124 (2002) 653 (not looked at), with the increment
of bem.plastic.increment. Error: docs/models/plastic.md.
"""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np

from bem.halfspace.input import check_control, check_friction, check_inside, gap_values
from bem.halfspace.pressure import NormalOperator, PressureSolution, solve_pressure
from bem.material import Elastic, Pair
from bem.patch import HALF_SPACE, ContactInputError, Cost, Grid, Patch
from bem.plastic.body import PlasticBody, Trial
from bem.plastic.increment import NoEquilibriumError
from bem.plastic.mixing import Mixing
from bem.plastic.surface import LoadStress
from bem.steel.deviator import equivalent_stress, stress_of
from bem.steel.hardening import YieldLaw, nearly_incompressible
from bem.steel.return_map import PlasticState

_MOST_TURNS = 60
_INNER = 0.1  # accuracy of the plastic strain over the surface's present change
LARGE_STRAIN = 0.05
EARLY = 0.3  # of a cell: what the edge of such a contact is off by, from 6 to 12 cells across
MOST_PEAK = 0.03  # of the largest pressure above its neighbours' mean; 0.4 to 0.8 of that is what it is too large
MOST_PRESSURE = 3.2  # over the yield stress: finite elements find at most 2.9 below a sphere (docs/models/plastic.md)


@dataclass
class IndentationStep:
    """A solved indentation step.

    patch    : pressure and approach, on the gap that the residual displacement has left
    state    : plastic strain, back stress, equivalent plastic strain on (nz, nx, ny) of patch.grid and depths
    stress   : (nz, nx, ny, 6) under load [Pa], order VOIGT; residual : the part by plastic strain
    surface  : (nx, ny) residual displacement of the surface, positive into the body [m]
    In depth-positive axes (bem.plastic.symbols): for z up, yz and xz change their sign.
    """

    patch: Patch
    depths: np.ndarray
    state: PlasticState
    stress: np.ndarray
    residual: np.ndarray
    surface: np.ndarray
    warnings: tuple[str, ...] = ()


@dataclass
class Agreed:
    """Pressure and plastic strain that agree: the solution of the contact, the trial, turns and products it took."""

    solution: PressureSolution
    trial: Trial | None
    turns: int
    products: int


class PlasticHalfSpace:
    """Contact of an elastic body 1 with an elastic-plastic body 2 on a grid, its state carried from load to load.

    Parameters
    ----------
    grid : Grid
        Of the contact, and of the cells below it.
    thickness : float
        Of a layer of cells [m].
    layers : int
        Of cells in depth.
    upper, lower : Elastic
        Bodies 1 and 2.
    hardening : Hardening or NonlinearKinematic
        Of body 2.
    sliding : (float, float)
        Traction on body 2 along x and y over the pressure, as of full sliding; its effect on the pressure (for unlike
        bodies, and by the sideways residual displacement) is left out.

    Raises
    ------
    ContactInputError, NoEquilibriumError
        Where the yielding zone leaves the grid; where a load is not carried.

    Examples
    --------
    >>> grid = bem.Grid.over((-4e-3, 4e-3), (-4e-3, 4e-3), 16, 16)
    >>> below = bem.PlasticHalfSpace(grid, 0.5e-3, 8, bem.STEEL, bem.STEEL, bem.Hardening.linear(300e6))
    >>> x, y = grid.points()
    >>> step = below.press((x**2 + y**2) / 0.6, load=8e3)
    >>> bool(0 < below.body.state.peeq.max() < 0.01)
    True
    """

    def __init__(
        self,
        grid: Grid,
        thickness: float,
        layers: int,
        upper: Elastic,
        lower: Elastic,
        hardening: YieldLaw,
        sliding: tuple[float, float] = (0.0, 0.0),
    ) -> None:
        for value in sliding:
            check_friction(abs(value))
        self.grid, self.thickness = grid, thickness
        self.body = PlasticBody(grid, thickness, layers, lower, hardening)
        self.operator = NormalOperator(grid, Pair.of(upper, lower))
        self.sliding = tuple((axis, share) for axis, share in enumerate(sliding, 1) if share)
        self.load_stress = LoadStress(grid, self.body.depths, lower.poisson, (0, *(a for a, _ in self.sliding)))
        self.pressure: np.ndarray | None = None

    @property
    def depths(self) -> np.ndarray:
        """Middles of the layers of cells (nz,) [m]."""
        return self.body.depths

    def press(self, gap: np.ndarray, load: float, tolerance: float = 1e-4) -> IndentationStep:
        """Bring the load [N] from what it was to this value on a gap (nx, ny) [m]; the state moves on.

        tolerance : change of the surface over the approach at which pressure and plastic strain agree
        """
        started = time.perf_counter()
        check_control(load, None)
        if not 0 < tolerance < 1:
            raise ContactInputError(
                f"tolerance = {tolerance!r}: a part of the approach, between 0 and 1; 1e-4 is usual"
            )
        gap = gap_values(gap, self.grid)
        agreed = self.agree(gap, load, tolerance)
        self.body.accept(agreed.trial)
        deviator, mean = self.load_stress(self._tractions(agreed.solution.pressure))
        patch = Patch(
            self.grid, gap + self.body.surface, agreed.solution.pressure, agreed.solution.approach, HALF_SPACE,
            cost=Cost(time.perf_counter() - started, agreed.turns, agreed.products),
        )  # fmt: skip
        residual = stress_of(self.body.residual, self.body.mean_residual())
        return IndentationStep(
            patch, self.depths, self.body.state.copy(), stress_of(deviator, mean) + residual, residual,
            self.body.surface.copy(),
            strain_warnings(self.body)
            + pressure_warnings(self.pressure_ratio(agreed.solution.pressure))
            + peak_warnings(agreed.solution.pressure)
            + depth_warnings(self.depths, equivalent_stress(deviator), bool(self.sliding)),
        )  # fmt: skip

    def agree(self, gap: np.ndarray, load: float, tolerance: float, guess: Trial | None = None) -> Agreed:
        """Pressure and plastic strain under a load, nothing accepted; guess : the trial of a step like this one.

        Errors: NoEquilibriumError.
        """
        body, mixing, trial, products = self.body, Mixing(), guess, 0
        surface, off = body.lowering(guess), 1.0
        for turn in range(1, _MOST_TURNS + 1):
            solution = self._solve(gap + surface, load, max(1e-6, 0.01 * tolerance))
            layers = None if turn == 1 else (body.box.layers if body.box else 1)
            deviator, _ = self.load_stress(self._tractions(solution.pressure), layers)
            if turn == 1:
                body.look(deviator)
            inner = float(np.clip(_INNER * off, 1e-6, 1e-2))
            trial = body.attempt(deviator, trial, inner)
            products += trial.products if trial else 0
            answer = body.lowering(trial)
            off = float(np.abs(answer - surface).max()) / max(abs(solution.approach - gap.min()), 1e-300)
            if off <= tolerance and (trial is None or inner <= tolerance):
                check_inside(solution.pressure, self.grid)
                return Agreed(solution, trial, turn, products)
            if not np.isfinite(off):
                break
            surface = mixing(surface, answer)
        raise NoEquilibriumError(
            f"load {load:g} N: pressure and plastic strain do not agree after {turn} turns (surface off by "
            f"{off:.2g} of the approach): take smaller load steps, or the load is beyond what the body carries"
        )

    def pressure_ratio(self, pressure: np.ndarray) -> float:
        """Largest pressure over the yield stress at the largest plastic strain; 0 where nothing has yielded."""
        strain = float(self.body.state.peeq.max())
        return float(pressure.max() / self.body.hardening.at(np.float64(strain))) if strain > 0 else 0.0

    def _tractions(self, pressure: np.ndarray) -> tuple[np.ndarray, ...]:
        return (pressure, *(share * pressure for _, share in self.sliding))

    def _solve(self, gap: np.ndarray, load: float, tolerance: float) -> PressureSolution:
        if load == 0:
            return PressureSolution(np.zeros(gap.shape), float(gap.min()), 0, 0.0, True)
        solution = solve_pressure(self.operator, gap, load, start=self.pressure, tolerance=tolerance)
        self.pressure = solution.pressure
        return solution


def strain_warnings(body: PlasticBody) -> tuple[str, ...]:
    """Where small strain on a flat half-space, or Poisson's ratio, makes an answer doubtful."""
    worst = float(body.state.peeq.max())
    large: tuple[str, ...] = ()
    if worst > LARGE_STRAIN:
        large = (
            f"plastic strain up to {worst:.1%}: above {LARGE_STRAIN:.0%} small-strain theory and the flat surface are"
            " an approximation",
        )
    return large + nearly_incompressible(body.elastic)


def depth_warnings(depths: np.ndarray, loading: np.ndarray, sliding: bool) -> tuple[str, ...]:
    """Where steel below the deepest layer or, pressed without sliding, above the first may yield unseen.

    depths : of the layers (nz,) [m];  loading : von Mises stress of the load alone (nz, nx, ny) [Pa]
    """
    of_layers = loading.max(axis=(1, 2))
    worst = of_layers.argmax()
    if not of_layers[worst] > 0 or 0 < worst < len(depths) - 1 or worst == 0 and sliding:
        return ()
    which, beyond, remedy = ("deepest", "below", "more or thicker") if worst else ("first", "above", "thinner")
    return (
        f"the load's von Mises stress is largest in the {which} of {len(depths)} layers, {depths[worst] * 1e3:.3g} mm"
        f" down: steel {beyond} it may yield and is not looked at; take {remedy} layers",
    )


def pressure_warnings(ratio: float) -> tuple[str, ...]:
    """Where cells are too coarse for the flow at the edge of the contact: `ratio` of `pressure_ratio`."""
    if ratio <= MOST_PRESSURE:
        return ()
    return (
        f"largest pressure {ratio:.2f} times the yield stress at the largest plastic strain (above {MOST_PRESSURE:g}):"
        f" cells are too stiff for the flow at the edge of the contact, which ends up to {EARLY:g} of a cell too early"
        " all around: area too small, mean pressure too large by that; take smaller cells",
    )


def peak_warnings(pressure: np.ndarray) -> tuple[str, ...]:
    """Where cells do not resolve the largest pressure (nx, ny), as on a body rougher than they are fine."""
    i, j = np.unravel_index(pressure.argmax(), pressure.shape)
    beside = np.pad(pressure, 1)
    mean = (beside[i, j + 1] + beside[i + 2, j + 1] + beside[i + 1, j] + beside[i + 1, j + 2]) / 4
    above = 1.0 - mean / pressure[i, j] if pressure[i, j] > 0 else 0.0
    if above <= MOST_PEAK:
        return ()
    return (
        f"the largest pressure stands {above:.1%} above the mean of the four cells beside it (above {MOST_PEAK:.0%}):"
        f" cells do not resolve it, it is too large by about half of that; take smaller cells",
    )
