"""A wheel rolled along wing or nose with forces known from a pass: plastic strain, residual stress, new surface.

The body is the half-space of bem.plastic under a strip of cells that follows its surface: x along the track, y across,
depth below the surface. At each position of the wheel the gap of the true surfaces, changed by what was pressed before,
is solved with the plastic strain under the force that the pass found. No friction; edges only flagged.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy import ndimage

from bem.material import Elastic
from bem.patch import ContactInputError, Grid
from bem.plastic.contact import PlasticHalfSpace
from bem.plastic.hardening import Hardening
from bem.plastic.increment import NoEquilibriumError
from bem.plastic.rolling import PlasticTrack
from rail_fem.light.contact_pairs import ContactPair

WIDE = 2.6  # half window over the elastic patch's semi-axis
DEEP = 4.0  # depth of the cells over the smaller semi-axis
REACH = 2.0  # stretch ahead and behind in which a step is felt, over the depth of the cells
MOST_TRIES = 4
GROW = 1.35  # of window or depth where the plastic zone reaches its end
BLOCK = (5e-3, 5e-3, 3e-3)  # along, across, deep: over which plastic strain is averaged [m]


@dataclass(frozen=True)
class Station:
    """One position of the wheel: time [s], the touching pair, normal force [N], the elastic patch's semi-axes [m]."""

    time: float
    pair: ContactPair
    force: float
    semi_axes: tuple[float, float]


@dataclass(frozen=True)
class SolvedStation:
    """What a station came to: area [m^2], largest pressure [Pa], approach [m]."""

    area: float
    max_pressure: float
    approach: float


@dataclass
class Flow:
    """Plastic flow along one body.

    x, y, depths : (nx,), (ny,), (nz,) centres of the cells [m]; side : of the cells [m]
    peeq    : (nz, nx, ny) equivalent plastic strain
    residual : (nz, 5, nx, ny) deviator of the residual stress [Pa], bem.plastic.deviator
    lowered : (nx, ny) change of the surface, positive into the body [m]
    edge_distance : of the plastic zone from the nearest position without surface [m]; inf where none is in the strip
    stations : what each station came to
    """

    x: np.ndarray
    y: np.ndarray
    depths: np.ndarray
    side: float
    peeq: np.ndarray
    residual: np.ndarray
    lowered: np.ndarray
    edge_distance: float
    stations: list[SolvedStation]

    @property
    def volume_integral(self) -> float:
        """Integral of the equivalent plastic strain [m^3]."""
        return float(self.peeq.sum() * self.side**3)

    @property
    def zone_depth(self) -> float:
        """Depth of the deepest cell that has yielded [m]."""
        layers = np.flatnonzero((self.peeq > 0).any(axis=(1, 2)))
        return float((layers[-1] + 1) * self.side) if len(layers) else 0.0

    def block_mean(self) -> float:
        """Largest mean of the equivalent plastic strain over a block of BLOCK from the surface down."""
        layers = max(1, int(round(BLOCK[2] / self.side)))
        top = self.peeq[:layers].mean(axis=0)
        sides = [max(1, int(round(length / self.side))) for length in BLOCK[:2]]
        return float(ndimage.uniform_filter(top, size=sides, mode="constant").max())

    def worst(self) -> tuple[float, float, float, float]:
        """Largest equivalent plastic strain and its x, y, depth [m]."""
        k, i, j = np.unravel_index(self.peeq.argmax(), self.peeq.shape)
        return float(self.peeq[k, i, j]), float(self.x[i]), float(self.y[j]), float(self.depths[k])


def roll_along(
    stations: list[Station],
    steels: tuple[Elastic, Elastic],
    hardening: Hardening,
    side: float,
    agreement: float,
    report: Callable[[float], None] = lambda share: None,
) -> Flow:
    """Roll over a body from station to station on cells of a side [m]; steels : wheel, body.

    The strip and its depth grow, and the rolling begins anew, where the plastic zone reaches their end.
    Errors: ContactInputError, NoEquilibriumError, with the position.
    """
    widen, deepen = 1.0, 1.0
    for attempt in range(MOST_TRIES):
        try:
            return _roll(stations, steels, hardening, side, agreement, widen, deepen, report)
        except _ZoneAtEnd as reached:
            if attempt == MOST_TRIES - 1:
                raise ContactInputError(str(reached)) from None
            widen, deepen = widen * (1 if reached.deep else GROW), deepen * (GROW if reached.deep else 1)
    raise AssertionError("unreachable")


class _ZoneAtEnd(Exception):
    def __init__(self, words: str) -> None:
        super().__init__(words)
        self.deep = "deepest layer" in words


def _roll(stations, steels, hardening, side, agreement, widen, deepen, report) -> Flow:
    points = np.array([station.pair.point for station in stations])
    half = widen * WIDE * np.max([station.semi_axes for station in stations], axis=0) + 3 * side
    nx = 2 * int(np.ceil(half[0] / side))
    x_low = points[:, 0].min() - (nx // 2 + 1) * side
    columns = int(np.ceil((points[:, 0].max() - x_low) / side)) + nx // 2 + 2
    y_low, y_high = points[:, 1].min() - half[1], points[:, 1].max() + half[1]
    ny = int(np.ceil((y_high - y_low) / side))
    layers = int(np.ceil(deepen * DEEP * min(max(s.semi_axes[0] for s in stations), half[1] / WIDE) / side)) + 2
    window = Grid(-(nx - 1) / 2 * side, y_low + side / 2, side, side, nx, ny)
    contact = PlasticHalfSpace(window, side, layers, steels[0], steels[1], hardening)
    track = PlasticTrack(contact.body, columns, max(4, int(np.ceil(REACH * layers))))
    solved, nowhere, trial = [], np.zeros((columns, ny), bool), None
    for number, station in enumerate(stations):
        point, cosine = station.pair.point, station.pair.frame[1, 1]
        column = int(np.clip(np.rint((point[0] - x_low) / side - nx / 2), 0, track.last))
        track.stand(column)
        x = x_low + (column + np.arange(nx) + 0.5) * side - point[0]
        s = (window.y - point[1]) / cosine
        gap = station.pair.gap(*np.meshgrid(x, s, indexing="ij"))
        nowhere[column : column + nx] |= ~np.isfinite(gap)
        try:
            agreed = contact.agree(gap, station.force, agreement, trial)
            while track.widened():
                agreed = contact.agree(gap, station.force, agreement, agreed.trial)
        except ContactInputError as fault:
            raise _ZoneAtEnd(f"{station.pair.label} at x = {point[0] * 1e3:.1f} mm: {fault}") from None
        except NoEquilibriumError as fault:
            raise NoEquilibriumError(f"{station.pair.label} at x = {point[0] * 1e3:.1f} mm: {fault}") from None
        trial = agreed.trial
        track.accept(trial)
        pressure = agreed.solution.pressure
        area = float(np.count_nonzero(pressure) * side**2)
        solved.append(SolvedStation(area, float(pressure.max()), float(agreed.solution.approach)))
        report((number + 1) / len(stations))
    x, y = x_low + (np.arange(columns) + 0.5) * side, window.y
    edge = _edge_distance(track.state.peeq, nowhere, side)
    return Flow(
        x, y, contact.depths, side, track.state.peeq, track.residual, track.surface, edge, solved
    )  # fmt: skip


def _edge_distance(peeq: np.ndarray, nowhere: np.ndarray, side: float) -> float:
    """Least distance along the surface from a column that has yielded to one without surface [m]."""
    yielded = (peeq > 0).any(axis=0)
    if not yielded.any() or not nowhere.any():
        return float("inf")
    return float(side * ndimage.distance_transform_edt(~nowhere)[yielded].min())
