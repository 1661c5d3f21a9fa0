"""A body of revolution by its section: stiffness and mass of the harmonics around its axis.

Displacements u_r = U cos(n t), u_t = V sin(n t), u_y = W cos(n t) over the angle t; U, V, W on nine-node quadrilaterals
of the section. For each n a plane problem with three unknowns a node; the angle is integrated exactly.
Source: the strains of cylindrical coordinates; held against the exact modes of a cylinder in plane strain, at fourth
order (tests/rail_fem/test_wheel_modes.py).
"""

from typing import NamedTuple

import numpy as np
from scipy import sparse

from bem.material import Elastic

GAUSS = np.polynomial.legendre.leggauss(3)
NODES = np.array([(i, j) for i in (-1, 0, 1) for j in (-1, 0, 1)])  # natural coordinates of a cell's nodes


class RingSection(NamedTuple):
    """points : (k, 2) radius and y [m];  cells : (m, 9) nodes, order NODES: r slow, y fast"""

    points: np.ndarray
    cells: np.ndarray


def grid_section(r: np.ndarray, y: np.ndarray, inside: np.ndarray) -> RingSection:
    """Cells between the lines r (p + 1,) and y (q + 1,) [m] where inside (p, q)."""
    fine = lambda lines: np.sort(np.r_[lines, (lines[1:] + lines[:-1]) / 2])
    all_r, all_y = fine(r), fine(y)
    p, q = np.nonzero(inside)
    cells = np.stack([(2 * p + 1 + i) * len(all_y) + 2 * q + 1 + j for i, j in NODES], axis=1)
    used, cells = np.unique(cells, return_inverse=True)
    points = np.stack(np.meshgrid(all_r, all_y, indexing="ij"), axis=-1).reshape(-1, 2)
    return RingSection(points[used], cells.reshape(-1, 9))


def shapes(at: tuple[float, float]) -> tuple[np.ndarray, np.ndarray]:
    """Weights (9,) of a cell's nodes at natural coordinates, and their derivatives (2, 9)."""
    line = lambda t: np.array([t * (t - 1) / 2, 1 - t * t, t * (t + 1) / 2])
    slope = lambda t: np.array([t - 0.5, -2 * t, t + 0.5])
    a, b = at
    along = np.stack([np.outer(slope(a), line(b)).ravel(), np.outer(line(a), slope(b)).ravel()])
    return np.outer(line(a), line(b)).ravel(), along


def matrices(section: RingSection, n: int, steel: Elastic, density: float) -> tuple[sparse.csc_array, sparse.csc_array]:
    """Stiffness and mass (3 k, 3 k) of harmonic n, unknowns U, V, W of each node in turn [N/m, kg].

    Of n = 0 without torsion: its V has stiffness and mass none and is to be held.
    """
    turns = 2 * np.pi if n == 0 else np.pi
    law = _law(steel)
    corners = section.points[section.cells]
    count = len(section.cells)
    stiffness, mass = np.zeros((count, 27, 27)), np.zeros((count, 27, 27))
    for a, wa in zip(*GAUSS):
        for b, wb in zip(*GAUSS):
            weights, along = shapes((a, b))
            jacobian = np.einsum("dk,mke->mde", along, corners)
            radius = corners[:, :, 0] @ weights
            volume = turns * wa * wb * np.abs(np.linalg.det(jacobian)) * radius
            slope = np.einsum("med,dk->mek", np.linalg.inv(jacobian), along)
            strain = _strain(n, weights, slope, radius)
            stiffness += np.einsum("mai,ab,mbj,m->mij", strain, law, strain, volume, optimize=True)
            block = np.kron(np.outer(weights, weights), np.diag([1.0, float(n > 0), 1.0]))
            mass += density * volume[:, None, None] * block
    unknowns = (3 * section.cells[:, :, None] + np.arange(3)).reshape(count, 27)
    rows, columns = np.repeat(unknowns, 27, axis=1).ravel(), np.tile(unknowns, 27).ravel()
    size = 3 * len(section.points)
    gather = lambda values: sparse.csc_array((values.ravel(), (rows, columns)), shape=(size, size))
    return gather(stiffness), gather(mass)


def _strain(n: int, weights: np.ndarray, slope: np.ndarray, radius: np.ndarray) -> np.ndarray:
    """(m, 6, 27)  rr, tt, yy, rt, ry, ty (shears as angles) of the nodes' U, V, W; slope (m, 2, 9) to r and y."""
    strain = np.zeros((len(radius), 6, 9, 3))
    over = weights / radius[:, None]
    by_r, by_y = slope[:, 0], slope[:, 1]
    turning = float(n > 0)
    strain[:, 0, :, 0] = by_r
    strain[:, 1, :, 0], strain[:, 1, :, 1] = over, n * over
    strain[:, 2, :, 2] = by_y
    strain[:, 3, :, 0], strain[:, 3, :, 1] = -n * over, turning * (by_r - over)
    strain[:, 4, :, 0], strain[:, 4, :, 2] = by_y, by_r
    strain[:, 5, :, 1], strain[:, 5, :, 2] = turning * by_y, -n * over
    return strain.reshape(len(radius), 6, 27)


def _law(steel: Elastic) -> np.ndarray:
    """(6, 6)  isotropic elasticity for strains in the order of `_strain` [Pa]."""
    lame = 2 * steel.shear * steel.poisson / (1 - 2 * steel.poisson)
    law = np.diag([2 * steel.shear] * 3 + [steel.shear] * 3)
    law[:3, :3] += lame
    return law
