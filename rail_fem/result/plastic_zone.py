"""Plastic strain as quantities that have a limit: means over stated volumes, integral, volumes above levels, a profile
over depth.

The largest value of plastic strain grows with every halving of the elements; it is given with the size of its element
and its position, never alone. All else here does not hang on the elements but through their error.
"""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from geometry.meshing.cell_measures import cell_volume

WORST = {"worst_10": 10e-9, "worst_100": 100e-9, "worst_1000": 1000e-9}  # volumes of the most strained metal [m3]
LEVELS = {"volume_1": 0.01, "volume_3": 0.03, "volume_5": 0.05, "volume_10": 0.10}
BLOCK = (5e-3, 5e-3, 3e-3)  # along, across, deep [m]
FULL = 0.95  # of the block's volume that must be metal
COLUMN = 0.25e-3  # of the columns in which metal is counted [m]
BLOCK_COLUMNS = round(BLOCK[0] / COLUMN), round(BLOCK[1] / COLUMN)  # of the block, along and across
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
    at stretch by stretch, and only where it may hold that block."""
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
    from rail_fem.result.plastic_columns import add_layers, add_metal, raise_tops  # compiled, for explicit runs alone

    first, shape = _columns_of(corners)
    cut = corners, *_parts(corners)
    columns = first * COLUMN, COLUMN
    top, metal, filled = np.full(shape, -np.inf), np.zeros(shape), np.zeros(shape)
    raise_tops(*cut, *columns, top)
    add_metal(*cut, volume, fields[:, 0], *columns, top, BLOCK[2], metal, filled)
    metal, filled = _boxes(metal), _boxes(filled)
    full = metal >= FULL * np.prod(BLOCK)
    size = np.array(BLOCK_COLUMNS)
    if stretch is not None:
        middle = (first[0] + np.arange(metal.shape[0]) + size[0] / 2) * COLUMN
        full &= ((middle >= stretch[0]) & (middle <= stretch[1]))[:, None]
    if not full.any():
        return None
    mean = np.where(full, filled / np.where(full, metal, 1.0), -np.inf)
    at = np.array(np.unravel_index(int(np.argmax(mean)), mean.shape))
    held, sums = np.zeros(len(layers)), np.zeros((len(layers), fields.shape[1]))
    add_layers(*cut, volume, fields, *columns, top, at, at + size, LAYER, held, sums)
    profile = np.where(held[:, None] > 0, sums / np.where(held > 0, held, 1.0)[:, None], np.nan)
    x, y = (first + at + size / 2) * COLUMN
    return _Block(
        float(mean.max()), (float(x), float(y), float(top[tuple(at + size // 2)])), layers + LAYER / 2, profile
    )


def _columns_of(corners: np.ndarray) -> tuple[np.ndarray, tuple[int, ...]]:
    """The columns of COLUMN over cells: number of the first along x and y (2,), and how many."""
    plan = corners.reshape(-1, 3)[:, :2]
    first = np.floor(plan.min(axis=0) / COLUMN).astype(np.int64) - 1
    return first, tuple(np.floor(plan.max(axis=0) / COLUMN).astype(np.int64) + 2 - first)


def _boxes(columns: np.ndarray) -> np.ndarray:
    """Sums over all blocks of columns; empty where the field is smaller than a block."""
    nx, ny = BLOCK_COLUMNS
    total = np.pad(columns.cumsum(axis=0).cumsum(axis=1), ((1, 0), (1, 0)))
    return total[nx:, ny:] - total[:-nx, ny:] - total[nx:, :-ny] + total[:-nx, :-ny]


def _parts(corners: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Into how many parts no longer than COLUMN each cell is cut along its own axes (m, 3), and the vertical extent of
    one (m,) [m]."""
    edges = (corners[:, AHEAD] - corners[:, BEHIND]).mean(axis=2)
    parts = np.ceil(np.linalg.norm(edges, axis=2) / COLUMN - 1e-6)
    counts = np.clip(parts, 1, MOST_PARTS).astype(np.int64)
    return counts, (np.abs(edges[:, :, 2]) / counts).sum(axis=1)
