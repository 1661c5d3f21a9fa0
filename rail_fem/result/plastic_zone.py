"""Plastic strain as quantities that have a limit: means over stated volumes, integral, volumes above levels, a profile
over depth.

The largest value of plastic strain grows with every halving of the elements; it is given with the size of its element
and its position, never alone. All else here does not hang on the elements but through their error.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from geometry.meshing.quality import cell_volume

WORST = {"worst_10": 10e-9, "worst_100": 100e-9, "worst_1000": 1000e-9}  # volumes of the most strained metal [m3]
LEVELS = {"volume_1": 0.01, "volume_3": 0.03, "volume_5": 0.05, "volume_10": 0.10}
BLOCK = (5e-3, 5e-3, 3e-3)  # along, across, deep [m]
FULL = 0.95  # of the block's volume that must be metal
COLUMN = 0.25e-3  # of the columns in which metal is counted [m]
DEPTH, LAYER = 10e-3, 0.5e-3  # of the profile over depth, and of its layers [m]
MOST_PARTS = 40  # of a cell's edge: cells of more than 10 mm say little of a block of 5 mm
AROUND = 12e-3  # of the most strained metal that is looked at for the block [m]
STRETCH = 60e-3  # along the track, of such metal that is looked at together [m]
# corners at both ends of a cell's edges along its axes
AHEAD = [[1, 2, 5, 6], [3, 2, 7, 6], [4, 5, 6, 7]]
BEHIND = [[0, 3, 4, 7], [0, 1, 4, 5], [0, 1, 2, 3]]
NAMES = (*WORST, "block", "integral", *LEVELS)


@dataclass(frozen=True)
class PlasticZone:
    """Plastic strain (PEEQ) of one body.

    values : the quantities NAMES: means over the worst 10, 100, 1000 mm3 and over the block of 5 x 5 x 3 mm below the
        running surface where that mean is largest [1], integral over the body, volumes above 1, 3, 5, 10 % [m3]; NaN
        where the body is smaller than the volume that is asked for
    maximum : the largest value of an element [1];  size : cube root of that element's volume [m];  position : its
        centre (3,) [m]
    block : centre of the block's top (3,) [m]
    depth : (k,) middles of layers below the surface [m];  profile : (k,) means over the block's 5 x 5 mm [1]
    stress : (k, 2) means of the stresses along and across the track there [Pa], residual where the wheel is far
    """

    values: dict[str, float]
    maximum: float
    size: float
    position: tuple[float, float, float]
    block: tuple[float, float, float]
    depth: np.ndarray
    profile: np.ndarray
    stress: np.ndarray

    def plain(self) -> dict:
        """As a result keeps it: numbers and lists [SI]."""
        told = lambda value: value if isinstance(value, (float, dict)) else np.asarray(value).tolist()
        return {name: told(value) for name, value in vars(self).items()}


class _Samples(NamedTuple):
    """Points within cells, each for an equal part of its cell: position (n, 3), volume (n,), vertical extent (n,), and
    the number of its cell (n,)."""

    position: np.ndarray
    volume: np.ndarray
    height: np.ndarray
    cell: np.ndarray


def plastic_zone(
    corners: np.ndarray, strain: np.ndarray, stress: np.ndarray, whole: float | None = None
) -> PlasticZone:
    """The plastic zone of a body.

    corners : (m, 8, 3) of its cells, VTK order [m];  strain : (m,) PEEQ [1];  stress : (m, 2) along and across the
    track [Pa];  whole : volume of the body where only those cells are given that have yielded or are `near` [m3]
    Error: exact for cells that are boxes along the axes and no finer than COLUMN; cells elsewhere count in columns of
    0.25 mm.
    """
    volume = cell_volume(corners)
    values = {name: worst_mean(strain, volume, amount, whole) for name, amount in WORST.items()}
    values["integral"] = float(strain @ volume)
    values |= {name: float(volume[strain > level].sum()) for name, level in LEVELS.items()}
    at = int(np.argmax(strain))
    x, y, z = corners[at].mean(axis=0)
    block, top, depth, layers = _block(corners, np.column_stack([strain, stress]), volume)
    values["block"] = block
    return PlasticZone(
        {name: values[name] for name in NAMES},
        float(strain[at]),
        float(np.cbrt(volume[at])),
        (float(x), float(y), float(z)),
        top,
        depth,
        layers[:, 0],
        layers[:, 1:],
    )


def worst_mean(strain: np.ndarray, volume: np.ndarray, amount: float, whole: float | None = None) -> float:
    """Mean of strain (m,) over the most strained `amount` of metal [m3]; the last cell counts in part. NaN where there
    is less metal. whole : volume of the body, the rest of it not strained; None: that of the cells [m3]"""
    if not (volume.sum() if whole is None else whole) >= amount:
        return float("nan")
    order = np.argsort(-strain, kind="stable")
    filled = np.minimum(np.cumsum(volume[order]), amount)
    return float(strain[order] @ np.diff(filled, prepend=0.0) / amount)


class _Block(NamedTuple):
    """The block of largest mean: that mean, the centre of its top [m], depth (k,) and means (k, f) of layers below."""

    mean: float
    top: tuple[float, float, float]
    depth: np.ndarray
    profile: np.ndarray


def _block(corners: np.ndarray, fields: np.ndarray, volume: np.ndarray) -> _Block:
    """Of all blocks of metal that of the largest mean of the first of the fields (m, f). A zone that is long is looked
    at stretch by stretch, for cells are cut into thousands of samples."""
    layers = np.arange(int(round(DEPTH / LAYER))) * LAYER
    nothing = np.full((len(layers), fields.shape[1]), np.nan)
    centre, strain = corners.mean(axis=1), fields[:, 0]
    if not strain.max(initial=0.0) > 0:
        return _Block(0.0, (float("nan"),) * 3, layers + LAYER / 2, nothing)
    box = strained_box(centre, strain, float(strain.max()))
    around = np.flatnonzero(near(centre, box))
    low, high = box[0, 0] - AROUND, box[1, 0] + AROUND
    best = _Block(float("nan"), (float("nan"),) * 3, layers + LAYER / 2, nothing)
    count = max(1, int(np.ceil((high - low - 2 * AROUND) / STRETCH)))
    edges = np.linspace(low, high, count + 1)
    parts, x = [], centre[around, 0]
    for begin, end in zip(edges[:-1], edges[1:]):
        here = around[(x > begin - AROUND) & (x < end + AROUND)]
        most = worst_mean(strain[here], volume[here], FULL * np.prod(BLOCK))
        if not math.isnan(most):  # else there is not metal enough for a block
            parts.append((most, here, (begin, end) if count > 1 else None))
    for most, here, stretch in sorted(parts, key=lambda part: -part[0]):
        if most <= best.mean:  # no block's mean is above that of as much of the worst metal
            break
        found = _block_within(corners[here], fields[here], volume[here], layers, stretch)
        if found is not None and not found.mean <= best.mean:
            best = found
    return best


def strained_box(centre: np.ndarray, strain: np.ndarray, largest: float) -> np.ndarray:
    """Lowest and highest coordinates (2, 3) of the centres (m, 3) of cells with half of the largest strain or more;
    infinite where there are none."""
    strained = centre[strain >= 0.5 * largest]
    return np.array([strained.min(axis=0, initial=np.inf), strained.max(axis=0, initial=-np.inf)])


def near(centre: np.ndarray, box: np.ndarray) -> np.ndarray:
    """Which cells (m,) are looked at for the block: those around and below a `strained_box`."""
    beside = ((centre[:, :2] > box[0, :2] - AROUND) & (centre[:, :2] < box[1, :2] + AROUND)).all(axis=1)
    return beside & (centre[:, 2] > box[0, 2] - DEPTH)


def _block_within(
    corners: np.ndarray, fields: np.ndarray, volume: np.ndarray, layers: np.ndarray, stretch: tuple[float, float] | None
) -> _Block | None:
    """The same among cells (m,), of blocks whose middle lies in a stretch along x [m]; None where there is no metal for
    any."""
    samples = _samples(corners, volume)
    column, first, shape, flat, top = _columns_of(samples)
    depth = top[flat] - samples.position[:, 2]
    weight = samples.volume * _overlap(depth, samples.height, 0.0, BLOCK[2])
    metal = _boxes(np.bincount(flat, weight, len(top)).reshape(shape))
    filled = _boxes(np.bincount(flat, weight * fields[samples.cell, 0], len(top)).reshape(shape))
    full = metal >= FULL * np.prod(BLOCK)
    if stretch is not None:
        middle = (first[0] + np.arange(metal.shape[0]) + _columns()[0] / 2) * COLUMN
        full &= ((middle >= stretch[0]) & (middle <= stretch[1]))[:, None]
    if not full.any():
        return None
    mean = np.where(full, filled / np.where(full, metal, 1.0), -np.inf)
    at = np.array(np.unravel_index(int(np.argmax(mean)), mean.shape))
    below = ((column >= at) & (column < at + _columns())).all(axis=1)
    profile = np.full((len(layers), fields.shape[1]), np.nan)
    for k, start in enumerate(layers):
        weight = samples.volume[below] * _overlap(depth[below], samples.height[below], start, start + LAYER)
        if weight.sum() > 0:
            profile[k] = weight @ fields[samples.cell[below]] / weight.sum()
    surface = top.reshape(shape)[tuple(at + _columns() // 2)]
    x, y = (first + at + _columns() / 2) * COLUMN
    return _Block(float(mean.max()), (float(x), float(y), float(surface)), layers + LAYER / 2, profile)


class _Columns(NamedTuple):
    """Columns of COLUMN: of each sample its column (n, 2) counted from `first` (2,) and its place (n,) among all,
    `shape` of these, and the height of the metal's top in each [m]."""

    column: np.ndarray
    first: np.ndarray
    shape: tuple[int, ...]
    flat: np.ndarray
    top: np.ndarray


def _columns_of(samples: _Samples) -> _Columns:
    column = np.floor(samples.position[:, :2] / COLUMN).astype(np.int64)
    first = column.min(axis=0)
    column -= first
    shape = tuple(column.max(axis=0) + 1)
    flat = np.ravel_multi_index(column.T, shape)
    top = np.full(shape[0] * shape[1], -np.inf)
    np.maximum.at(top, flat, samples.position[:, 2] + samples.height / 2)
    return _Columns(column, first, shape, flat, top)


def _columns() -> np.ndarray:
    """Columns of the block along and across."""
    return np.array([round(BLOCK[0] / COLUMN), round(BLOCK[1] / COLUMN)])


def _overlap(depth: np.ndarray, height: np.ndarray, upper: float, lower: float) -> np.ndarray:
    """Part of pieces with middles at `depth` and vertical extents `height` that lies between two depths (n,)."""
    inside = np.minimum(depth + height / 2, lower) - np.maximum(depth - height / 2, upper)
    return np.clip(inside / height, 0.0, 1.0)


def _boxes(columns: np.ndarray) -> np.ndarray:
    """Sums over all blocks of columns; empty where the field is smaller than a block."""
    nx, ny = _columns()
    total = np.pad(columns.cumsum(axis=0).cumsum(axis=1), ((1, 0), (1, 0)))
    return total[nx:, ny:] - total[:-nx, ny:] - total[nx:, :-ny] + total[:-nx, :-ny]


def _samples(corners: np.ndarray, volume: np.ndarray) -> _Samples:
    """Each cell cut along its own axes into parts no longer than COLUMN."""
    edges = (corners[:, AHEAD] - corners[:, BEHIND]).mean(axis=2)
    parts = np.ceil(np.linalg.norm(edges, axis=2) / COLUMN - 1e-6)
    counts = np.clip(parts, 1, MOST_PARTS).astype(np.int64)
    parts = []
    for count in np.unique(counts, axis=0):
        mine = np.flatnonzero((counts == count).all(axis=1))
        position = np.matmul(_shape_functions(count), corners[mine])
        height = (np.abs(edges[mine, :, 2]) / count).sum(axis=1)
        pieces = int(np.prod(count))
        of_cells = (np.repeat(values, pieces) for values in (volume[mine] / pieces, height, mine))
        parts.append(_Samples(position.reshape(-1, 3), *of_cells))
    return _Samples(*(np.concatenate(column) for column in zip(*parts)))


def _shape_functions(count: np.ndarray) -> np.ndarray:
    """Trilinear shape functions (p, 8) at the middles of a cell's parts, `count` (3,) along its axes."""
    axes = [(np.arange(n) + 0.5) / n for n in count]
    r, s, t = (axis.ravel() for axis in np.meshgrid(*axes, indexing="ij"))
    bottom = np.stack([(1 - r) * (1 - s), r * (1 - s), r * s, (1 - r) * s], axis=1)
    return np.concatenate([bottom * (1 - t)[:, None], bottom * t[:, None]], axis=1)
