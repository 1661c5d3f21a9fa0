"""Carry the mesh of one section to all others: outline nodes by features and distance from the block, inner nodes after
them."""

import numpy as np

from geometry.meshing.section.curve import SectionCurve
from geometry.meshing.section.quads import QuadSection, place_strip_middles
from geometry.meshing.sweep.matching import outline_arcs
from geometry.meshing.sweep.morphing import ElasticMorph


def carry_section(
    section: QuadSection,
    curves: list[SectionCurve],
    columns: np.ndarray,
    features: tuple[np.ndarray, np.ndarray],
    chain: list[int],
    reach: float,
) -> np.ndarray:
    """Positions (stations, n, 2) [m] of a section's nodes on every outline.

    curves, columns : outline and block columns (arc lengths) at every station;  features : see `feature_lengths`
    chain : for each station the one that it follows; the one that follows itself was meshed
    reach : outline [m] beside the block whose nodes keep their distance from it
    Nodes on the outline lie on it to round-off: those of the block on its columns, those within reach at their
    distance, the others at the same share of the mean length of features. Nodes on the base divide it in the same
    ratio. Inner nodes follow those of the station before them in the chain by ElasticMorph and are smoothed;
    translations are carried exactly.
    """
    order = _outwards(chain)
    reference = order[0]
    arcs = [
        outline_arcs(section.curve_arc, features, (curves[reference], columns[reference]), target, reach)
        for target in zip(curves, columns)
    ]
    fixed = np.zeros(len(section.points), dtype=bool)
    fixed[section.on_curve] = fixed[section.base] = True
    morph = ElasticMorph(section.points, section.plane_quads(), fixed)
    start, end = curves[reference].points[[0, -1]]
    share = ((section.points[section.base] - start) @ (end - start) / ((end - start) @ (end - start)))[:, None]
    positions = np.empty((len(curves),) + section.points.shape)
    positions[reference] = section.points
    for i in order[1:]:
        outline = positions[chain[i]].copy()
        outline[section.on_curve] = curves[i].at(arcs[i])
        outline[section.base] = curves[i].points[0] + share * (curves[i].points[-1] - curves[i].points[0])
        positions[i] = _follow(section, morph, positions[chain[i]], outline, fixed)
    place_strip_middles(positions, section.strip, section.on_curve)
    return positions


def _outwards(chain):
    """Stations in an order in which each comes after the one that it follows; first the one that follows itself."""
    order = [next(i for i, leader in enumerate(chain) if leader == i)]
    for leader in order:
        order += [i for i, other in enumerate(chain) if other == leader != i]
    return order


def _follow(section, morph, before, outline, fixed):
    """Positions (n, 2) from those of the neighbouring station and the new positions of the fixed nodes: carried, then
    smoothed."""
    shift = outline - before
    moved = before + morph.carry(shift)
    moved[fixed] = outline[fixed]
    if np.ptp(shift[fixed], axis=0).max() < 1e-9:
        return moved
    return section.smoother.smooth(moved, iterations=40)
