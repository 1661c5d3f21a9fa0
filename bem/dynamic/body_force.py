"""The field of a uniform body force in a polygon of the infinite plane, in closed form.

With Kelvin's kernels as in bem.plane.kelvin, zeta = z - xi, the area integrals become integrals over the polygon's
edges by Green's theorem, integral of dH/d conj(xi) over the area = 1/(2i) contour integral of H d xi:

    ln r                 from H = -conj(zeta) ln r + conj(zeta) / 2
    zeta / conj(zeta)    from H = -2 zeta ln r
    1 / zeta             from H = -conj(zeta) / zeta
    conj(zeta) / zeta^2  from H = -conj(zeta)^2 / (2 zeta^2)

Each H is of one value and bounded, so the point may lie anywhere, also within the polygon. Far from a square the
moments of the square replace its edges. Stress is continuous across edges: a body force has no jump in traction.
Error: 1e-11 near, 5e-5 of the value at `_FAR` sides, falling with the fourth power
(tests/bem/dynamic/test_body_force.py).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from bem.dynamic.cells import Cells
from bem.material import Elastic
from bem.plane.boundary import displacement_map, stress_map
from bem.plane.kelvin import _frames, _local, _weight_integrals
from bem.plane.mesh import BoundaryMesh
from bem.plane.point_load import InnerLoad
from kernel_cache import njit

_FAR = (
    8.0  # distance from a square, in its sides, beyond which its moments are used: the next term is below (1/8)^4 / 5
)
_GAUSS, _GAUSS_WEIGHT = np.polynomial.legendre.leggauss(2)


class _Layout(NamedTuple):
    """Edges of all cells from start to end (e,) complex, first edge (n + 1,), area, centre (complex), side (n,) and
    whether a cell is a whole square."""

    start: np.ndarray
    end: np.ndarray
    first_edge: np.ndarray
    area: np.ndarray
    centre: np.ndarray
    side: np.ndarray
    whole: np.ndarray


@njit(cache=True, inline="always")
def _seen_from(z, cells, c):
    """Complex arm from the centre of a cell to z, its square, and whether the cell's moments replace its edges."""
    away = z - cells.centre[c]
    r2 = away.real**2 + away.imag**2
    return away, r2, cells.whole[c] and r2 > (_FAR * cells.side[c]) ** 2


@njit(cache=True)
def _displacement_integrals(z, cells):
    """Area integrals (m, N) of ln r and of e^(2 i theta) over the cells of a _Layout."""
    area, side, start, end, first_edge = cells.area, cells.side, cells.start, cells.end, cells.first_edge
    log_r = np.zeros((z.size, area.size))
    twist = np.zeros((z.size, area.size), np.complex128)
    middle, to_local, half, along = _frames(start, end)
    for i in range(z.size):
        for c in range(area.size):
            away, r2, far = _seen_from(z[i], cells, c)
            if far:
                log_r[i, c] = 0.5 * area[c] * np.log(r2)
                mirrored = away.conjugate()
                twist[i, c] = area[c] * (away / mirrored - side[c] ** 2 / (6.0 * mirrored * mirrored))
                continue
            total, turned = 0.0, complex(0.0, 0.0)
            for e in range(first_edge[c], first_edge[c + 1]):
                fall, rise, _, _ = _weight_integrals(z[i], middle[e], to_local[e], half[e], along[e] * along[e])
                moment = (z[i] - start[e]) * fall.real + (z[i] - end[e]) * rise.real  # integral of zeta ln r ds
                total += (along[e] * moment.conjugate()).imag
                turned += along[e] * moment
            log_r[i, c] = -0.5 * total - 0.5 * area[c]
            twist[i, c] = 1j * turned
    return log_r, twist


@njit(cache=True)
def _stress_integrals(z, cells):
    """Area integrals (m, N) of 1 / zeta and of conj(zeta) / zeta^2 over the cells of a _Layout."""
    area, side, first_edge = cells.area, cells.side, cells.first_edge
    pole = np.zeros((z.size, area.size), np.complex128)
    steep = np.zeros((z.size, area.size), np.complex128)
    middle, to_local, half, along = _frames(cells.start, cells.end)
    for i in range(z.size):
        for c in range(area.size):
            away, _, far = _seen_from(z[i], cells, c)
            if far:
                inverse = 1.0 / away
                pole[i, c] = area[c] * inverse
                steep[i, c] = area[c] * inverse * inverse * (away.conjugate() - side[c] ** 2 / 3.0 * inverse)
                continue
            one, two = complex(0.0, 0.0), complex(0.0, 0.0)
            for e in range(first_edge[c], first_edge[c + 1]):
                eta = _local(z[i], middle[e], to_local[e])
                y = eta.imag
                once, twice = complex(2.0, 0.0), complex(2.0, 0.0)  # integrals of conj/zeta, its square, over (-1, 1)
                if y != 0.0:
                    log = np.log((eta + 1.0) / (eta - 1.0))
                    once = 2.0 - 2j * y * log
                    twice = 2.0 - 4j * y * log - 8.0 * y * y / (eta * eta - 1.0)
                back = along[e].conjugate()
                one += half[e] * back * once
                two += half[e] * back * back * back * twice
            pole[i, c] = 0.5j * one
            steep[i, c] = 0.25j * two
    return pole, steep


def _layout(cells: Cells) -> _Layout:
    first_edge = np.searchsorted(cells.owner, np.arange(len(cells) + 1))
    centre = cells.centre[:, 0] + 1j * cells.centre[:, 1]
    return _Layout(cells.start, cells.end, first_edge, cells.area, centre, cells.side, cells.whole)


def _complex(points: np.ndarray) -> np.ndarray:
    return np.ascontiguousarray(points[:, 0] + 1j * points[:, 1])


def displacement_of_cells(points: np.ndarray, cells: Cells, material: Elastic) -> np.ndarray:
    """Displacement (2m, 2N) [m per N/m], all x then all y, at points (m, 2) of a unit force spread over each cell."""
    log_r, twist = _displacement_integrals(_complex(points), _layout(cells))
    return displacement_map(log_r, twist, material, cells.area)


def stress_of_cells(points: np.ndarray, cells: Cells, material: Elastic) -> np.ndarray:
    """Stress (3, m, 2N) xx, yy, xy [Pa per N/m] at points (m, 2) of a unit force spread over each cell, x then y."""
    pole, steep = _stress_integrals(_complex(points), _layout(cells))
    return stress_map(pole, steep, material.kolosov, cells.area).reshape(3, len(points), -1)


def path_forces(begin: np.ndarray, end: np.ndarray, cells: Cells, material: Elastic) -> np.ndarray:
    """Resultant (2h, 2N) of the traction over straight paths between complex points (h,), outward on the right, of
    unit forces."""
    step, h = end - begin, len(begin)
    out = np.zeros((2 * h, 2 * len(cells)))
    for position, weight in zip(_GAUSS, _GAUSS_WEIGHT):
        z = begin + step * (1 + position) / 2
        xx, yy, xy = stress_of_cells(np.column_stack([z.real, z.imag]), cells, material)
        nx, ny = (step.imag * weight / 2)[:, None], (-step.real * weight / 2)[:, None]  # normal times length
        out[:h] += xx * nx + xy * ny
        out[h:] += xy * nx + yy * ny
    return out


def cell_tractions(mesh: BoundaryMesh, cells: Cells, material: Elastic) -> np.ndarray:
    """Resultant (2n, 2N) of the traction on each cell of the boundary mesh, all x then all y, of unit forces; with them
    the forces are in equilibrium to round-off, moments about the middles of the boundary's cells included."""
    points, begin, end, cell = mesh.paths()
    n, h = mesh.densities, len(begin)
    out = np.zeros((2 * n, 2 * len(cells)))
    parts = path_forces(points[begin], points[end], cells, material)
    np.add.at(out, cell, parts[:h])
    np.add.at(out, n + cell, parts[h:])
    _balance(out, mesh, cells)
    return out


def _balance(tractions: np.ndarray, mesh: BoundaryMesh, cells: Cells) -> None:
    """Add to resultants (2n, 2N) what they lack in equilibrium with the unit forces, near each force.

    A lack of 1e-3 of a force would move the whole body by that part of its global compliance, which is far more than
    the local compliance by which neighbours differ.
    """
    n, count = mesh.densities, len(cells)
    x, y = (mesh.middles[:, None, axis] - cells.centre[None, :, axis] for axis in (0, 1))  # (n, N) arms
    share = mesh.cell_length[:, None] / (x**2 + y**2 + cells.side**2)
    share /= share.sum(axis=0)
    mean_x, mean_y = (share * x).sum(axis=0), (share * y).sum(axis=0)
    one, zero = np.ones(count), np.zeros(count)
    matrix = np.array(
        [[one, zero, -mean_y], [zero, one, mean_x], [-mean_y, mean_x, (share * (x**2 + y**2)).sum(axis=0)]]
    ).transpose(2, 0, 1)
    for axis in (0, 1):
        columns = slice(axis * count, (axis + 1) * count)
        fx, fy = tractions[:n, columns], tractions[n:, columns]
        lack = -np.array([fx.sum(axis=0) + (axis == 0), fy.sum(axis=0) + (axis == 1), (x * fy - y * fx).sum(axis=0)]).T
        a, b, turn = np.linalg.solve(matrix, lack[..., None])[..., 0].T
        fx += share * (a - turn * y)
        fy += share * (b + turn * x)


class CellForces(InnerLoad):
    """Forces (2N,) [N/m], all x then all y, spread over cells, as a load of a bem.plane.boundary.BoundarySolution.

    memo : a dictionary that keeps the matrices of points asked for, where many instants are asked at the same points
    """

    def __init__(self, cells: Cells, forces: np.ndarray, memo: dict | None = None) -> None:
        self.cells, self.forces, self._memo = cells, forces, {} if memo is None else memo

    def _matrix(self, make: Callable, material: Elastic, *points: np.ndarray) -> np.ndarray:
        key = (make.__name__, *(p.tobytes() for p in points))
        if key not in self._memo:
            self._memo[key] = make(*points, self.cells, material)
        return self._memo[key]

    def displacement(self, points: np.ndarray, material: Elastic) -> np.ndarray:
        """Displacement (m, 2) [m] at points (m, 2)."""
        return (self._matrix(displacement_of_cells, material, points) @ self.forces).reshape(2, -1).T

    def stress(self, points: np.ndarray, material: Elastic) -> np.ndarray:
        """Stress (m, 3) xx, yy, xy [Pa] at points (m, 2)."""
        return (self._matrix(stress_of_cells, material, points) @ self.forces).T

    def path_force(self, begin: np.ndarray, end: np.ndarray, material: Elastic) -> np.ndarray:
        """Force (2, h) [N/m] of the traction over straight paths between complex points, outward on the right."""
        return (self._matrix(path_forces, material, begin, end) @ self.forces).reshape(2, -1)
