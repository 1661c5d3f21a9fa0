"""A body in slabs: the planes across the track that no element straddles, and which slabs a cell or a node belongs to.

A lofted body is stations along x with slabs of elements between them; its coarse elements span three stations. What a
window activates and deactivates are whole slabs, so that the cut between them is a plane of nodes.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rail_fem.fe.partition import balanced_parts
from rail_fem.fe.state import LANES

# shortest slab [m]: of a millimetre each, half the elements of a slab's last block would be padding
SHORTEST = 6e-3
EQUAL = 1e-9  # between stations that are the same [m]


@dataclass(frozen=True)
class Slabs:
    """Planes between the slabs of each body.

    planes : for each region of the mesh (k+1,) increasing x [m]; empty for a body that is not cut into slabs
    """

    planes: tuple[np.ndarray, ...]

    @property
    def counts(self) -> np.ndarray:
        """Slabs of each region (n_regions,)."""
        return np.array([max(len(planes) - 1, 0) for planes in self.planes], np.int64)

    @property
    def shortest(self) -> float:
        """Length of the shortest slab [m]."""
        return float(min(np.diff(planes).min() for planes in self.planes if len(planes)))

    def of_cells(self, centre_x: np.ndarray, region: np.ndarray) -> np.ndarray:
        """Slab of each cell (m,), from its centre's reference x and its region; 0 in a body without slabs."""
        out = np.zeros(len(region), np.int64)
        for number, planes in enumerate(self.planes):
            mine = region == number
            if len(planes):
                out[mine] = np.searchsorted(planes, centre_x[mine]) - 1
        return out

    def of_nodes(self, x: np.ndarray, region: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """First and last slab (n,), (n,) that a node's elements lie in: two neighbours for a node on a plane between
        them. x : reference position [m];  region : (n,) of its elements"""
        first, last = np.zeros(len(x), np.int16), np.zeros(len(x), np.int16)
        for number, planes in enumerate(self.planes):
            mine = region == number
            if len(planes):
                most = len(planes) - 2
                first[mine] = np.clip(np.searchsorted(planes, x[mine] - EQUAL) - 1, 0, most)
                last[mine] = np.clip(np.searchsorted(planes, x[mine] + EQUAL) - 1, 0, most)
        return first, last

    def near(self, low: float, high: float) -> np.ndarray:
        """Range (n_regions, 2) of the slabs of each body that reach into low < x < high [m], the second number not
        included; 0, 0 where none does."""
        out = np.zeros((len(self.planes), 2), np.int64)
        for number, planes in enumerate(self.planes):
            if len(planes):
                first = np.searchsorted(planes[1:], low + EQUAL)
                end = np.searchsorted(planes[:-1], high - EQUAL)
                out[number] = (first, end) if first < end else (0, 0)
        return out


def cut_into_slabs(
    points: np.ndarray, cells: np.ndarray, region: np.ndarray, bodies: tuple[int, ...], shortest: float = SHORTEST
) -> Slabs:
    """The slabs of the regions `bodies`, each at least `shortest` long [m].

    points : (n, 3) [m];  cells : (m, 8);  region : (m,)
    A body that no plane can be laid through is one slab.
    """
    x = points[:, 0][cells]
    low, high = x.min(axis=1), x.max(axis=1)
    planes = [np.empty(0)] * (int(region.max(initial=-1)) + 1)
    for number in bodies:
        mine = region == number
        if number < len(planes) and mine.any():
            planes[number] = _thinned(_free_planes(low[mine], high[mine]), shortest)
    return Slabs(tuple(planes))


def _free_planes(low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """Increasing x [m] that lie inside none of the intervals low < x < high, both ends of all included."""
    order = np.argsort(low, kind="stable")
    starts, reach = low[order], np.maximum.accumulate(high[order])
    free = np.flatnonzero(starts[1:] >= reach[:-1] - EQUAL) + 1
    return np.concatenate([starts[:1], starts[free], reach[-1:]])


def _thinned(planes: np.ndarray, shortest: float) -> np.ndarray:
    """Those of the planes that make slabs of at least `shortest`; what is left over at the end joins the last."""
    kept = [planes[0]]
    for x in planes[1:-1]:
        if x - kept[-1] >= shortest - EQUAL and planes[-1] - x >= shortest - EQUAL:
            kept.append(x)
    return np.array([*kept, planes[-1]])


def slab_parts(centres: np.ndarray, region: np.ndarray, slab: np.ndarray, shares: np.ndarray) -> np.ndarray:
    """Part (m,) of each cell such that each part has its share (parts,) of the work wherever the window stands: every
    slab is cut across the section, never along x, into whole blocks of LANES cells, for a block that is not full costs
    what a full one does. Blocks are dealt out in turn from slab to slab, so that of any slabs in a row each part has
    its share to one block.

    centres : (m, 3) [m];  region, slab : (m,).  Root only.
    """
    parts = len(shares)
    part = np.zeros(len(centres), np.int32)
    across = centres * [0.0, 1.0, 1.0]
    key = region.astype(np.int64) * (int(slab.max(initial=0)) + 1) + slab
    order = np.argsort(key, kind="stable")
    pieces = np.split(order, np.flatnonzero(np.diff(key[order])) + 1) if len(order) else []
    least = sum(-(-len(mine) // LANES) for mine in pieces) * shares.min() / shares.sum()
    lanes = LANES if least >= 1 else 1
    turns = _turns(sum(-(-len(mine) // lanes) for mine in pieces), shares)
    for mine in pieces:
        blocks = -(-len(mine) // lanes)
        sizes = lanes * np.bincount(turns[:blocks], minlength=parts)
        turns = turns[blocks:]
        takers = np.flatnonzero(sizes)
        sizes[takers[-1]] -= lanes * blocks - len(mine)
        sizes = sizes[takers]
        part[mine] = takers[balanced_parts(across[mine], np.ones(len(mine)), len(takers), sizes)]
    return part


def _turns(count: int, shares: np.ndarray) -> np.ndarray:
    """Which part takes each of so many blocks (count,), each at even distances."""
    shares = shares / shares.sum()
    when = [(np.arange(np.ceil(count * share) + 1) + 0.5) / share for share in shares]
    part = np.repeat(np.arange(len(shares)), list(map(len, when)))
    return part[np.argsort(np.concatenate(when), kind="stable")][:count]
