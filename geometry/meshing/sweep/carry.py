"""Carry the mesh of one section to all others: outline nodes by features and distance from the block, inner nodes after
them by linear elasticity, small quads stiffer."""

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.linalg import splu

from geometry.meshing.hexmesh import cross_2d
from geometry.meshing.section.curve import SectionCurve
from geometry.meshing.section.quads import QuadSection, place_strip_middles
from geometry.meshing.sweep.matching import outline_arcs

POINTS = np.array([-1.0, 1.0]) / np.sqrt(3.0)
CORNER = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])


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


class ElasticMorph:
    """Displacements of a section's inner nodes from those of its outline.

    points : (n, 2) reference positions [m];  quads : (k, 4) anticlockwise;
    fixed : (n,) bool, nodes with prescribed motion Each quad's modulus is proportional to 1 / area, so that small quads
        keep their shape and large ones give way. Motions without strain
    (translations, small turns) are carried exactly, uniform strains where all quads have one area.
    """

    def __init__(self, points: np.ndarray, quads: np.ndarray, fixed: np.ndarray):
        self.used = np.unique(quads)
        stiffness = plane_stiffness(points, quads)
        free = np.zeros(len(points), dtype=bool)
        free[self.used] = True
        free &= ~fixed
        self.free = free
        free_dofs, fixed_dofs = (np.flatnonzero(np.repeat(mask, 2)) for mask in (free, fixed))
        self.fixed = fixed
        self.solver = splu(stiffness[free_dofs][:, free_dofs].tocsc())
        self.coupling = stiffness[free_dofs][:, fixed_dofs].tocsr()

    def carry(self, displacement: np.ndarray) -> np.ndarray:
        """Displacements of all nodes (n, 2) [m] from those of the fixed nodes, given in the rows of `displacement` (n,
        2)."""
        result = displacement.copy()
        result[self.free] = -self.solver.solve(self.coupling @ displacement[self.fixed].ravel()).reshape(-1, 2)
        return result


def plane_stiffness(points: np.ndarray, quads: np.ndarray, poisson: float = 0.3):
    """Plane strain stiffness (2n, 2n), sparse, of bilinear quads (k, 4) with modulus proportional to 1 / area."""
    corner = points[quads]
    diagonals = corner[:, 2] - corner[:, 0], corner[:, 3] - corner[:, 1]
    area = np.abs(cross_2d(*diagonals)) / 2
    lam, mu = poisson / (1 - 2 * poisson), 0.5
    law = np.array([[lam + 2 * mu, lam, 0], [lam, lam + 2 * mu, 0], [0, 0, mu]])
    element = np.zeros((len(quads), 8, 8))
    for r in POINTS:
        for s in POINTS:
            local = 0.25 * np.stack(
                [CORNER[:, 0] * (1 + CORNER[:, 1] * s), CORNER[:, 1] * (1 + CORNER[:, 0] * r)], axis=1
            )
            jacobian = np.einsum("ia,kib->kab", local, corner)
            gradient = np.einsum("kab,ib->kia", np.linalg.inv(jacobian), local)
            strain = np.zeros((len(quads), 3, 8))
            strain[:, 0, 0::2] = strain[:, 2, 1::2] = gradient[:, :, 0]
            strain[:, 1, 1::2] = strain[:, 2, 0::2] = gradient[:, :, 1]
            measure = np.abs(np.linalg.det(jacobian)) / area
            element += np.einsum("kai,ab,kbj,k->kij", strain, law, strain, measure)
    dofs = (2 * quads[:, :, None] + np.arange(2)).reshape(-1, 8)
    rows, columns = np.repeat(dofs, 8, axis=1).ravel(), np.tile(dofs, (1, 8)).ravel()
    return coo_matrix((element.ravel(), (rows, columns)), shape=(2 * len(points),) * 2).tocsr()
