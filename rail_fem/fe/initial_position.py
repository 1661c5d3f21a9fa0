"""The wheel's mesh positioned on the crossing's: along the rigid path first, then by the gap between the meshes
themselves."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.spatial import cKDTree

from geometry.meshing.hexmesh import HexMesh, merge_bodies
from geometry.surfaces.bodies import REGIONS
from rail_fem.fe.contact.pairs import Pairs
from rail_fem.fe.contact.projection import project_pairs
from rail_fem.fe.contact.surface import Surface, edge_neighbours

FARTHEST = 20e-3  # surface nodes farther apart than this are not compared [m]


def position_wheel(rail: HexMesh, wheel: HexMesh, x: float, y: float, height: float) -> tuple[HexMesh, float]:
    """Both meshes in one, the wheel at x, y so that the smallest gap between the meshes is zero; and the gap it had on
    the rigid path [m].

    rail, wheel : wheel coordinates are x = 0 under the axle, y from D0, z = 0 at D0;
    y, height : of D0 on the rigid path [m] A gap far from zero means that a mesh is not where the profile is: the
        caller reports it.
    """
    shift = np.array([x, y, height])
    placed = replace(wheel, points=wheel.points + shift)
    gap = smallest_gap(rail, placed)
    placed = replace(wheel, points=wheel.points + shift - np.array([0.0, 0.0, gap]))
    return merge_bodies([rail, placed], REGIONS), gap


def smallest_gap(rail: HexMesh, wheel: HexMesh) -> float:
    """Smallest vertical distance between the surfaces, rail nodes against wheel facets and the reverse [m]; negative:
    they overlap."""
    return min(_vertical_gap(rail, wheel), _vertical_gap(wheel, rail))


def _vertical_gap(slave: HexMesh, master: HexMesh) -> float:
    slaves, facets = Surface.from_quads(slave.surface), Surface.from_quads(master.surface)
    points = np.concatenate([slave.points[slaves.nodes], master.points[facets.nodes]])
    n = len(slaves.nodes)
    quads = facets.quads.astype(np.int64) + n
    centres = points[quads].mean(axis=1)
    away, nearest = cKDTree(centres).query(points[:n])
    near = np.flatnonzero(away < FARTHEST)
    if not len(near):
        return np.inf
    pairs = Pairs.over(
        quads,
        edge_neighbours(facets.quads),
        np.ones(len(quads), np.bool_),
        near,
        nearest[near].astype(np.int64),
        np.zeros((len(near), 2)),
    )
    project_pairs(points, pairs)
    gap, normal = pairs.gap, pairs.normal
    upright = (pairs.facets >= 0) & (np.abs(normal[:, 2]) > 0.3)
    return float((gap[upright] / np.abs(normal[upright, 2])).min(initial=np.inf))
