"""What initial stress in cells does to a body, and what its boundary layers do to the cells: matrices.

In each cell plastic stress 2 G e^p is a deviator of three numbers (bem.steel.deviator, without yz and xz); so is
2 G times the deviator of total strain. Strains are means over the cell: closed forms for cells near by, 2 x 2 Gauss
points from farther off. (With the strain at the middle, patterns that alternate from cell to cell would have a negative
energy.)
"""

from __future__ import annotations

import numpy as np
from scipy import sparse
from scipy.spatial import cKDTree

from bem.material import Elastic
from bem.plane.boundary import displacement_map, resultant_map, stress_map
from bem.plane.kelvin import displacement_integrals, resultant_integrals
from bem.plane.mesh import BoundaryMesh
from bem.plane_plastic.cells import Cells, boundary_edges
from bem.plane_plastic.kernels import hat_stress_integrals, near_strain
from bem.steel.deviator import FROM_DEVIATOR, TO_DEVIATOR

_NEAR = 4.0  # sizes of both cells within which means are exact
_BLOCK = 4_000_000  # pairs of point and edge at a time

_PLANE, _KEPT = [0, 1, 5], [0, 1, 4]  # xx yy xy of VOIGT; the deviators that are not zero in plane strain
TO_PLANE = FROM_DEVIATOR[np.ix_(_PLANE, _KEPT)]  # (3, 3) in-plane stress of a deviator
OF_STRAIN = TO_DEVIATOR[np.ix_(_KEPT, _PLANE)]  # (3, 3) deviator of an in-plane strain, e_zz = 0


def strain_of_stress(stress: np.ndarray, poisson: float) -> np.ndarray:
    """2 G times the in-plane strain (3, ...) of stress (3, ...) xx yy xy in plane strain; in place."""
    mean = poisson * (stress[0] + stress[1])
    stress[0] -= mean
    stress[1] -= mean
    return stress


def edge_forces(cells: Cells, chosen: np.ndarray) -> tuple[np.ndarray, sparse.csr_matrix]:
    """Edges (e,) (as indices of their first vertices) of cells `chosen` (k,), each shared one once, and the forces
    (2 e, 3 k) [1] on them, all x then all y, by initial stress xx, yy, xy (3, k) of the cells."""
    column = np.full(cells.count, -1)
    column[chosen] = np.arange(len(chosen))
    vertex = np.flatnonzero(column[cells.owner] >= 0)
    key, edge = np.unique(cells.edge_keys[vertex], return_inverse=True)
    first = np.empty(len(key), int)
    first[edge[::-1]] = vertex[::-1]
    step = cells.vertices[cells.following[vertex]] - cells.vertices[vertex]
    normal = np.column_stack([step[:, 1], -step[:, 0]]) / np.hypot(*step.T)[:, None]
    of, e, k = column[cells.owner[vertex]], len(key), len(chosen)
    rows = np.r_[edge, e + edge, edge, e + edge]
    columns = np.r_[of, k + of, 2 * k + of, 2 * k + of]
    values = np.r_[normal[:, 0], normal[:, 1], normal[:, 1], normal[:, 0]]
    return first, sparse.csr_matrix((values, (rows, columns)), shape=(2 * e, 3 * k))


def strain_at_cells(
    points: np.ndarray, start: np.ndarray, end: np.ndarray, first, last, count: int, elastic: Elastic
) -> np.ndarray:
    """2 G strain (3, m, 2, count), mean over the cells whose four points are in `points` (4 m, 2), by unit hats."""
    z, m = points[:, 0] + 1j * points[:, 1], len(points) // 4
    out = np.empty((3, m, 2, count))
    step = max(_BLOCK // max(len(start), 1) // 4, 1)
    for low in range(0, m, step):
        part = slice(low, min(low + step, m))
        a, b = hat_stress_integrals(z[4 * part.start : 4 * part.stop], start, end, first, last, count)
        a, b = (values.reshape(-1, 4, count).mean(axis=1) for values in (a, b))
        out[:, part] = strain_of_stress(stress_map(a, b, elastic.kolosov), elastic.poisson)
    return out


def cell_strain(cells: Cells, rows: np.ndarray, columns: np.ndarray, elastic: Elastic) -> np.ndarray:
    """2 G mean strain (3, rows, 3, columns) of cells by unit initial stress of others, in the infinite plane."""
    edges, forces = edge_forces(cells, columns)
    z, e = cells.complex_vertices, np.arange(len(edges))
    far = strain_at_cells(cells.points(rows), z[edges], z[cells.following[edges]], e, e, len(e), elastic)
    out = (far.reshape(3 * len(rows), -1) @ forces).reshape(3, len(rows), 3, len(columns))
    one, two = _near_pairs(cells, rows, columns)
    exact = near_strain(one, len(rows) + two, *_renumbered(cells, np.r_[rows, columns]), elastic.kolosov)
    out[:, one, :, two] = exact
    return out


def _renumbered(cells: Cells, chosen: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Complex vertices, offsets and areas of chosen cells, one after the other."""
    counts = np.diff(cells.offsets)[chosen]
    offsets = np.r_[0, np.cumsum(counts)]
    index = np.arange(offsets[-1]) - np.repeat(offsets[:-1], counts) + np.repeat(cells.offsets[chosen], counts)
    return cells.complex_vertices[index], offsets, cells.areas[chosen]


def _near_pairs(cells: Cells, rows: np.ndarray, columns: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Pairs of positions in `rows` and `columns` that are near each other for their sizes."""
    reach = _NEAR * (cells.sizes[rows] + cells.sizes[columns].max())
    found = cKDTree(cells.centers[columns]).query_ball_point(cells.centers[rows], reach)
    counts = np.array([len(each) for each in found])
    one, two = np.repeat(np.arange(len(rows)), counts), np.concatenate([np.array(each, int) for each in found])
    away = np.hypot(*(cells.centers[rows[one]] - cells.centers[columns[two]]).T)
    near = away < _NEAR * (cells.sizes[rows[one]] + cells.sizes[columns[two]])
    return one[near], two[near]


def boundary_traces(cells: Cells, chosen: np.ndarray, mesh: BoundaryMesh, elastic: Elastic) -> np.ndarray:
    """Force (2 n, 3 k) [m] on each cell of the boundary by unit initial stress of cells, all x then all y.

    It is the traction outside the initial stress: where a cell lies at the boundary, C : e n less the initial stress.
    """
    edges, forces = edge_forces(cells, chosen)
    z, e = cells.complex_vertices, np.arange(len(edges))
    points, begin, end, cell = mesh.paths()
    integrals = resultant_integrals(
        points, begin, end, cell, mesh.densities, z[edges], z[cells.following[edges]], e, e, len(e)
    )
    out = resultant_map(integrals, elastic) @ forces
    element = boundary_edges(cells, mesh)[edges]
    on = np.flatnonzero(element >= 0)
    own = sparse.csr_matrix(forces)
    for half in (mesh.first, mesh.last):
        for axis in (0, 1):
            length = sparse.csr_matrix(
                (mesh.lengths[element[on]] / 2, (half[element[on]], on)), shape=(mesh.densities, len(e))
            )
            out[axis * mesh.densities : (axis + 1) * mesh.densities] -= (
                length @ own[axis * len(e) : (axis + 1) * len(e)]
            ).toarray()
    return out


def displacement_by_cells(points: np.ndarray, cells: Cells, chosen: np.ndarray, elastic: Elastic) -> np.ndarray:
    """Displacement (2 m, 3 k) [m/Pa] at points (m, 2), all x then all y, by unit initial stress of cells."""
    edges, forces = edge_forces(cells, chosen)
    z, e = cells.complex_vertices, np.arange(len(edges))
    at = points[:, 0] + 1j * points[:, 1]
    log_r, twist = displacement_integrals(at, z[edges], z[cells.following[edges]], e, e, len(e))
    return displacement_map(log_r, twist, elastic) @ forces


def strain_by_layers(points: np.ndarray, mesh: BoundaryMesh, elastic: Elastic) -> np.ndarray:
    """2 G mean strain (3, m, 2 n) of cells with four points each in `points` (4 m, 2) by unit densities, x then y."""
    out = strain_at_cells(points, mesh.start, mesh.end, mesh.first, mesh.last, mesh.densities, elastic)
    return out.reshape(3, len(points) // 4, -1)
