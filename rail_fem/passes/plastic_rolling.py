"""A wheel rolled along wing or nose with forces known from a pass: plastic strain, residual stress, new surface.

The body is the half-space of bem.plastic under a strip of cells that follows its surface: x along the track, y across,
depth below the surface. At each position of the wheel the gap of the true surfaces, changed by what was pressed before,
is solved with the plastic strain under the force that the pass found. No friction; edges only flagged.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import astuple, dataclass, field, replace

import numpy as np
from scipy import ndimage

from bem.cycle_jumps import LEAST_FLOW
from bem.material import Elastic
from bem.patch import ContactInputError, Grid
from bem.plastic.contact import PlasticHalfSpace
from bem.plastic.increment import NoEquilibriumError
from bem.plastic.influence import Cells
from bem.plastic.rolling import PlasticTrack, agree_on
from bem.steel.deviator import stress_of
from bem.steel.hardening import YieldLaw
from rail_fem.contact.contact_pairs import ContactPair
from rail_fem.passes.repeated_wheels import Wheels
from rail_fem.result.parts import CrossingPart
from rail_fem.result.plastic_zone import BLOCK

WIDE = 2.6  # half window over the elastic patch's semi-axis, at least
DEEP = 4.0  # depth of the cells over the smaller semi-axis, at least
BESIDE, BELOW = 0.95, 1.1  # half window and depth over the depth to which the force at one point would yield, at least
REACH = 2.0  # stretch ahead and behind in which a step is felt, over the depth of the cells
MOST_TRIES = 4
GROW = 1.35  # of window or depth where the plastic zone reaches its end
FAINT = 1e-3  # of the largest plastic strain, by which steel behind and ahead may give way after the first wheel


@dataclass(frozen=True)
class Station:
    """One position of the wheel: time [s], the touching pair, normal force [N], the elastic patch's semi-axes [m]."""

    time: float
    pair: ContactPair
    force: float
    semi_axes: tuple[float, float]


@dataclass(frozen=True)
class SolvedStation:
    """What a station came to: x [m], area [m^2], largest pressure [Pa], approach [m], that pressure over the yield
    stress at the largest plastic strain in the window."""

    x: float
    area: float
    max_pressure: float
    approach: float
    over_yield: float = 0.0


@dataclass
class Flow:
    """Plastic flow along one body.

    x, y, depths : (nx,), (ny,), (nz,) centres of the cells [m]; side : of the cells across and in depth, length :
        along the track [m]
    peeq    : (nz, nx, ny) equivalent plastic strain
    residual : (nz, nx, ny, 6) residual stress [Pa], order VOIGT, z up, means over cells; NaN where it is not known:
        across and in depth far beyond what has yielded
    lowered : (nx, ny) change of the surface, positive into the body [m]
    edge : (nx, ny) distance along the surface to the nearest position without one [m]; inf where none is in the strip
    stations : what each station came to
    fall : of the body's own surface below the tangent plane at the worst point, one depth of the zone beside it, over
        that depth; NaN where nothing has yielded or no surface is left there
    grown : most plastic strain that each wheel that was rolled has added to a cell; stays : of it, in that cell, what
        each has left when it was gone; reports : what was told after each
    """

    x: np.ndarray
    y: np.ndarray
    depths: np.ndarray
    side: float
    length: float
    peeq: np.ndarray
    residual: np.ndarray
    lowered: np.ndarray
    edge: np.ndarray
    stations: list[SolvedStation]
    fall: float = np.nan
    grown: list[float] = field(default_factory=list)
    stays: list[float] = field(default_factory=list)
    reports: list[dict[str, float]] = field(default_factory=list)

    @property
    def edge_distance(self) -> float:
        """Of the plastic zone from the nearest position without surface [m]; inf without any."""
        return float(self.edge[(self.peeq > 0).any(axis=0)].min(initial=np.inf))

    @property
    def zone_depth(self) -> float:
        """Depth of the deepest cell that has yielded [m]."""
        layers = np.flatnonzero((self.peeq > 0).any(axis=(1, 2)))
        return float((layers[-1] + 1) * self.side) if len(layers) else 0.0

    def worst(self) -> tuple[float, float, float, float]:
        """Largest equivalent plastic strain and its x, y, depth [m]."""
        k, i, j = np.unravel_index(self.peeq.argmax(), self.peeq.shape)
        return float(self.peeq[k, i, j]), float(self.x[i]), float(self.y[j]), float(self.depths[k])


def roll_along(
    stations: list[Station],
    steels: tuple[Elastic, Elastic],
    hardening: YieldLaw,
    cell: tuple[float, float],
    agreement: float,
    report: Callable[[float], None] = lambda share: None,
    wheels: Wheels = Wheels(),
) -> Flow:
    """Roll over a body from station to station; steels : wheel, body; cell : length along the track, side across and in
    depth [m]; wheels : how often, no more once the steel is at rest.

    The strip and its depth grow, and the rolling begins anew, where the plastic zone reaches their end.
    Errors: ContactInputError, NoEquilibriumError, with the position; SealError of a file to go on from.
    """
    kept = wheels.kept()
    widen, deepen = kept[1]["size"] if kept else (1.0, 1.0)
    for attempt in range(MOST_TRIES):
        try:
            return _roll(stations, steels, hardening, cell, agreement, (widen, deepen), report, wheels, kept)
        except _ZoneAtEnd as reached:
            if attempt == MOST_TRIES - 1:
                raise ContactInputError(str(reached)) from None
            widen, deepen, kept = widen * (1 if reached.deep else GROW), deepen * (GROW if reached.deep else 1), None
    raise AssertionError("unreachable")


def point_zone(force: float, yield_stress: float) -> float:
    """Depth [m] at which the elastic stress below a force [N] at one point falls to the yield stress (nu 0.3): beyond
    a sharp patch, about as far as its plastic zone. Source: Boussinesq, sigma_zz = -3 F / (2 pi z^2), sigma_rr =
    (1 - 2 nu) F / (4 pi z^2); Johnson, Contact Mechanics (1985), section 3.2 (from memory, not verified)."""
    return float(np.sqrt((1.5 + 0.1) / np.pi * force / yield_stress))


@dataclass(frozen=True)
class Strip:
    """Cells along a body: those of the window that travels with the wheel, across and below it, and the columns of the
    whole strip from x_low [m] on."""

    window: Cells
    grid: Grid
    x_low: float
    columns: int


def strip_along(
    stations: list[Station], hardening: YieldLaw, cell: tuple[float, float], size: tuple[float, float] = (1.0, 1.0)
) -> Strip:
    """The strip under these stations. cell : as `roll_along`;  size : factors on the window's half widths and depth"""
    (length, side), (widen, deepen) = cell, size
    points = np.array([station.pair.point for station in stations])
    zone = point_zone(max(station.force for station in stations), hardening.first_yield)
    axes = np.max([station.semi_axes for station in stations], axis=0)
    half = widen * np.maximum(WIDE * axes, BESIDE * zone) + 3 * np.array(cell)
    nx = 2 * int(np.ceil(half[0] / length))
    x_low = points[:, 0].min() - (nx // 2 + 1) * length
    columns = int(np.ceil((points[:, 0].max() - x_low) / length)) + nx // 2 + 2
    y_low, y_high = points[:, 1].min() - half[1], points[:, 1].max() + half[1]
    ny = int(np.ceil((y_high - y_low) / side))
    layers = int(np.ceil(deepen * max(DEEP * min(axes), BELOW * zone) / side)) + 2
    grid = Grid(-(nx - 1) / 2 * length, y_low + side / 2, length, side, nx, ny)
    return Strip(Cells(length, side, side, nx, ny, layers), grid, x_low, columns)


class _ZoneAtEnd(Exception):
    def __init__(self, words: str) -> None:
        super().__init__(words)
        self.deep = "deepest layer" in words


def _roll(stations, steels, hardening, cell, agreement, size, report, wheels: Wheels, kept) -> Flow:
    (length, side), strip = cell, strip_along(stations, hardening, cell, size)
    window, layers, x_low, columns = strip.grid, strip.window.nz, strip.x_low, strip.columns
    nx, ny = window.nx, window.ny
    contact = PlasticHalfSpace(window, side, layers, steels[0], steels[1], hardening)
    track = PlasticTrack(contact.body, columns, max(4, int(np.ceil(REACH * layers * side / length))))
    contact.body.faint = FAINT if wheels.count > 1 else 0.0
    nowhere = np.zeros((columns, ny), bool)

    def one_wheel(number: int) -> list[SolvedStation]:
        solved, trial, contact.pressure = [], None, None
        for done, station in enumerate(stations, 1):
            point, cosine = station.pair.point, station.pair.frame[1, 1]
            column = int(np.clip(np.rint((point[0] - x_low) / length - nx / 2), 0, track.last))
            track.stand(column)
            x = x_low + (column + np.arange(nx) + 0.5) * length - point[0]
            s = (window.y - point[1]) / cosine
            gap = station.pair.gap(*np.meshgrid(x, s, indexing="ij"))
            nowhere[column : column + nx] |= ~np.isfinite(gap)
            where = f"{station.pair.label} at x = {point[0] * 1e3:.1f} mm"
            where += f", wheel {number + 1} of {wheels.count}" if wheels.count > 1 else ""
            try:
                agreed = agree_on(track, contact, gap, station.force, agreement, trial)
            except ContactInputError as fault:
                raise _ZoneAtEnd(f"{where}: {fault}") from None
            except NoEquilibriumError as fault:
                raise NoEquilibriumError(f"{where}: {fault}") from None
            trial = agreed.trial
            track.accept(trial)
            pressure = agreed.solution.pressure
            area = float(np.count_nonzero(pressure) * length * side)
            reached = float(pressure.max()), float(agreed.solution.approach), contact.pressure_ratio(pressure)
            solved.append(SolvedStation(float(point[0]), area, *reached))
            report((number + done / len(stations)) / wheels.count)
        if wheels.count > 1:  # the wheel is gone before the next one comes
            track.accept(agree_on(track, contact, gap, 0.0, agreement, None).trial)
        return solved

    x, y = x_low + (np.arange(columns) + 0.5) * length, window.y

    def flow(solved: list[SolvedStation], residual: np.ndarray) -> Flow:
        edge = np.full(nowhere.shape, np.inf)
        if nowhere.any():
            edge = ndimage.distance_transform_edt(~nowhere, sampling=cell)
        return Flow(x, y, contact.depths, side, length, track.state.peeq, residual, track.surface, edge, solved)

    solved: list[SolvedStation] = []
    grown: list[float] = []
    stays: list[float] = []
    reports: list[dict[str, float]] = []
    if kept:
        arrays, told = kept
        nowhere = arrays["nowhere"]
        track.recall(arrays)
        solved, reports = [SolvedStation(*one) for one in told["solved"]], told["reports"]
        grown, stays = told["grown"], told["stays"]
    while len(grown) < wheels.count and not (grown and grown[-1] <= LEAST_FLOW):
        before = track.state.copy()
        solved = one_wheel(len(grown))
        added = track.state.peeq - before.peeq
        left = np.sqrt(2 / 3) * np.linalg.norm(track.state.strain - before.strain, axis=1)
        grown.append(float(added.max()))
        stays.append(float(left[np.unravel_index(added.argmax(), added.shape)]))
        if wheels.count > 1:
            reports.append(wheels.tell(flow(solved, np.zeros((*added.shape, 6)))))
        told = {
            "size": size,
            "grown": grown,
            "stays": stays,
            "reports": reports,
            "solved": [astuple(one) for one in solved],
        }
        wheels.keep(track.remembered() | {"nowhere": nowhere}, told)
    found = replace(flow(solved, residual_stress(track)), grown=grown, stays=stays, reports=reports)
    return replace(found, fall=surface_fall(found, stations))


def flow_in(part: CrossingPart, flow: Flow, stations: list[Station]) -> Flow | None:
    """The flow of a body within one of its parts: columns whose middle lies in it; None where nothing has yielded
    there. stations : of the body's pass."""
    inside = part.holds(flow.x)
    if not (flow.peeq[:, inside] > 0).any():
        return None
    piece = replace(
        flow, x=flow.x[inside], peeq=flow.peeq[:, inside], residual=flow.residual[:, inside],
        lowered=flow.lowered[inside], edge=flow.edge[inside],
        stations=[one for one in flow.stations if bool(part.holds(np.float64(one.x)))],
    )  # fmt: skip
    return replace(piece, fall=surface_fall(piece, stations))


def surface_fall(flow: Flow, stations: list[Station]) -> float:
    """How far the body's own surface falls below the tangent plane, one depth of the plastic zone to either side of the
    worst point, over that depth: 1 / (2 r) of a rounding whose radius is r depths. NaN where nothing has yielded, or
    where the body ends before (`edge_distance` says so)."""
    depth = flow.zone_depth
    if not depth:
        return np.nan
    worst = flow.worst()[1]
    pair = min((station.pair for station in stations), key=lambda pair: abs(pair.point[0] - worst))
    height = pair.rail_height(np.zeros(2), np.array([-depth, depth]))
    return float(np.nanmax(-height) / depth) if np.isfinite(height).any() else np.nan


def residual_stress(track: PlasticTrack) -> np.ndarray:
    """(nz, columns, ny, 6) stress that the plastic strain leaves [Pa], order VOIGT, z up; NaN where it is not known.

    It is known as far around what has yielded as files tell it, or, where the kernels for that would be too large, as
    far as the rolling needed it. Error: that of the track (bem.plastic.rolling); the hydrostatic part by the same
    kernels (tests/bem/plastic/test_residual_stress.py).
    """
    margin = around((track.body.thickness, track.body.grid.dx, track.body.grid.dy))
    track.know_around(int(margin[2]), int(margin[0]))
    stress = np.full((*track.state.peeq.shape, 6), np.nan)
    box = track.known
    if box is None:
        return np.zeros_like(stress)
    inside = slice(0, box.layers), slice(None), box.y
    stress[inside] = stress_of(track.residual, track.mean_residual())[inside]
    stress[..., 3:5] *= -1  # depth-positive to z up
    return stress


def around(sides: tuple[float, float, float]) -> np.ndarray:
    """Cells of sides [m] (depth, x, y) that are shown around what has yielded: a block to average over lies within."""
    return np.maximum(2, np.ceil(max(BLOCK) / np.array(sides)).astype(int))
