"""The running surface of a body as contact sees it: bilinear facets with neighbours, areas and normals."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Surface:
    """Bilinear facets of a body. nodes : (n,) input nodes;  quads : (q, 4) positions in `nodes`, outward normal by the
    right-hand rule."""

    nodes: np.ndarray
    quads: np.ndarray

    @staticmethod
    def from_quads(quads: np.ndarray) -> Surface:
        """From facets in input node numbers (q, 4)."""
        nodes, local = np.unique(quads, return_inverse=True)
        return Surface(nodes, local.reshape(quads.shape))


def edge_neighbours(quads: np.ndarray) -> np.ndarray:
    """Facet across each edge 01, 12, 23, 30 of each facet (q, 4), -1 where there is none."""
    out = np.full(quads.shape, -1, np.int64)
    edges = np.sort(np.stack([quads, np.roll(quads, -1, axis=1)], axis=-1).reshape(-1, 2), axis=1)
    order = np.lexsort((edges[:, 1], edges[:, 0]))
    ordered = edges[order]
    same = np.flatnonzero((ordered[1:] == ordered[:-1]).all(axis=1))
    first, second = order[same], order[same + 1]
    out.ravel()[first], out.ravel()[second] = second // 4, first // 4
    return out


def tributary_areas(points: np.ndarray, quads: np.ndarray) -> np.ndarray:
    """A quarter of the area of each facet at a node, summed (n,) [m2]."""
    p = points[quads]
    area = 0.5 * np.linalg.norm(np.cross(p[:, 2] - p[:, 0], p[:, 3] - p[:, 1]), axis=1)
    return np.bincount(quads.ravel(), np.repeat(area / 4, 4), minlength=len(points))


def node_normals(points: np.ndarray, quads: np.ndarray) -> np.ndarray:
    """Outward unit normals (n, 3) of the nodes, facets weighted by their area; 0 where a node has no facet."""
    p = points[quads]
    facet = np.repeat(np.cross(p[:, 2] - p[:, 0], p[:, 3] - p[:, 1]), 4, axis=0)
    out = np.column_stack([np.bincount(quads.ravel(), facet[:, c], minlength=len(points)) for c in range(3)])
    return out / np.maximum(np.linalg.norm(out, axis=1, keepdims=True), 1e-300)
