"""What a body's real cross-section adds to the half-space: by wavenumber along the prism, and from slice to slice.

The surface of a prism gives way to pressure p as a half-space would (Boussinesq, three-dimensional) plus a correction.
The correction is smooth: the half-space holds the singularity. So it is computed at few stations across the face and
few wavenumbers along the prism (bem/slices/prism.py), interpolated, and transformed back:

    correction(x, s, s') = 1/pi integral over k > 0 of correction(k, s, s') cos(k x)

Below the least wavenumber the correction is linear in ln k (the half-space's level), which is integrated in closed
form; above the largest it has died away. The diagonal of the discrete correction carries an error of the mesh alone,
the same at every station:
it is read off from neighbours and taken back. Wavenumbers are independent of each other and go to `threads` in
parallel.
"""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.spatial import cKDTree

from bem.patch import Grid
from bem.plane.body import Body
from bem.plane.kelvin import displacement_integrals
from bem.plane.mesh import BoundaryMesh, Sizing, Zone, mesh_outline
from bem.plane.outline import OutlineError
from bem.plane.pairing import own_cells
from bem.slices.prism import PrismSection
from bem.slices.prism_kernel import bessel_remainders_of

_PER_DECADE = 4.5  # wavenumbers
_COARSE = 0.08  # largest element over the body's size
_GROWTH = 0.4
_LEAST = 0.15  # least wavenumber times the body's size or the patch's length
_LARGEST = 1.2  # largest wavenumber times the element in the contact zone
_GAUSS, _WEIGHTS = np.polynomial.legendre.leggauss(6)


@dataclass(frozen=True)
class Flexibility:
    """Correction of one body's flexibility at m stations and q wavenumbers.

    stations (m,) [m] along the lower body's face; wavenumbers (q,) [1/m]; correction (q, m, m) [m^2/N]: amplitude of
    the displacement into the body under a unit line load with the wavenumber, symmetric
    """

    stations: np.ndarray
    wavenumbers: np.ndarray
    correction: np.ndarray

    def interpolation(self, positions: np.ndarray) -> np.ndarray:
        """Matrix (n, m): values at the stations -> at positions (n,) along the face; constant beyond the outer
        stations."""
        clipped = np.clip(positions, self.stations[0], self.stations[-1])
        return CubicSpline(self.stations, np.eye(len(self.stations)))(clipped)

    def between_slices(self, grid: Grid) -> np.ndarray:
        """(nx, m, m) [1/(N/m)]: displacement in slice j under unit pressure times width on slice 0, by distance j
        dx."""
        nodes, weights = self._quadrature(grid.nx * grid.dx)
        spline = CubicSpline(np.log(self.wavenumbers), self.correction)
        m = len(self.stations)
        cell = weights * np.sinc(nodes * grid.dx / (2 * np.pi)) * grid.dx / np.pi
        cosine = np.cos(np.outer(grid.dx * np.arange(grid.nx), nodes)) * cell
        kernel = (cosine @ spline(np.log(nodes)).reshape(len(nodes), -1)).reshape(grid.nx, m, m)
        return kernel + self._below_least() * grid.dx / np.pi

    def _below_least(self) -> np.ndarray:
        """Integral of the correction over wavenumbers from 0 to the least, for a correction linear in ln k."""
        low = np.log(self.wavenumbers[0])
        slope = (self.correction[1] - self.correction[0]) / np.log(self.wavenumbers[1] / self.wavenumbers[0])
        return self.wavenumbers[0] * (self.correction[0] + slope * (low - 1) - slope * low)

    def _quadrature(self, length: float) -> tuple[np.ndarray, np.ndarray]:
        """Gauss points and weights over the wavenumbers, panels within a factor 2 and half a turn of cos(k length)."""
        ends, last = [self.wavenumbers[0]], self.wavenumbers[-1]
        while ends[-1] < last:
            ends.append(min(2 * ends[-1], ends[-1] + np.pi / length, last))
        ends = np.array(ends)
        half, middle = np.diff(ends) / 2, (ends[1:] + ends[:-1]) / 2
        return (middle[:, None] + half[:, None] * _GAUSS).ravel(), (half[:, None] * _WEIGHTS).ravel()


def body_flexibility(
    body: Body, zone: np.ndarray, size: float, length: float, along: tuple[np.ndarray, np.ndarray], threads: int = 1
) -> Flexibility:
    """Rest of a body's flexibility in the contact zone.

    zone   : (p, 2) [m] points of the face over the zone; size : station spacing [m]; length : of the patch along the
        prism [m]
    along  : points (p, 2) of the lower body's face over the zone and beyond, and their coordinate (p,) [m]: stations
        are projected on it
    """
    if body.held is None and not body.outline.infinite:
        raise OutlineError(
            "slices need a body with a held edge (or an infinite one): a hub holds no prism; hold an inner ring instead"
        )
    mesh = mesh_outline(body.outline, _sizing(body, zone, size))
    nodes = _stations(mesh, body, zone, size)
    if len(nodes) < 2:
        raise OutlineError(
            f"{len(nodes)} stations of {size:.3g} m lie on the face {body.face!r} within the contact zone around"
            f" ({zone[:, 0].mean():.4g}, {zone[:, 1].mean():.4g}) m: the faces do not meet there; move the grid or the"
            " bodies"
        )
    held = np.zeros(mesh.densities, bool)
    if body.held is not None:
        held[mesh.of_edge(body.held)] = True
    section = PrismSection(mesh, body.material, held, mesh.middles[nodes])
    wavenumbers = _wavenumbers(np.ptp(mesh.vertices, axis=0).max(), size, length)
    own, normals = own_cells(mesh, nodes), mesh.normals[nodes]
    forces = np.vstack([-own * normals[:, 0], -own * normals[:, 1], np.zeros_like(own)])
    mass = own.sum(axis=0)
    flat = _Straightened(mesh, nodes)

    def correction(wavenumber: float) -> np.ndarray:
        x, y, _ = section.respond(wavenumber, forces)
        inward = -(x * normals[:, :1] + y * normals[:, 1:])
        return (inward - flat.half_space(wavenumber, body.material.plane_modulus)) / mass

    values = np.array(parallel(correction, wavenumbers, threads))
    values = (values + values.transpose(0, 2, 1)) / 2
    positions = along[1][cKDTree(along[0]).query(mesh.middles[nodes])[1]]
    order = np.argsort(positions, kind="stable")
    # stations beyond the lower face's end fall on that end
    order = order[np.r_[True, np.diff(positions[order]) > 0.02 * size]]
    return Flexibility(positions[order], wavenumbers, _without_mesh_error(values[:, order][:, :, order]))


def parallel(action, items, threads: int) -> list:
    """action of each item, in order; the linear algebra and the kernels run without the interpreter's lock."""
    if threads <= 1:
        return [action(item) for item in items]
    with ThreadPoolExecutor(threads) as pool:
        return list(pool.map(action, items))


def _sizing(body: Body, zone: np.ndarray, size: float) -> Sizing:
    zones = [Zone(zone, size, 0.5 * size)]
    corners = [curve.at(np.array([s]))[0] for curve in body.outline.edge_curves(body.face) for s in (0.0, curve.length)]
    near = [corner for corner in corners if np.hypot(*(zone - corner).T).min() < 2 * size]
    if near:
        zones.append(Zone(np.array(near), size / 6))
    return Sizing(_COARSE * body.outline.size, zones, _GROWTH)


def _stations(mesh: BoundaryMesh, body: Body, zone: np.ndarray, size: float) -> np.ndarray:
    face = mesh.of_edge(body.face)
    return face[cKDTree(zone).query(mesh.middles[face])[0] < 0.75 * size]


def _wavenumbers(depth: float, size: float, length: float) -> np.ndarray:
    least, largest = _LEAST / max(depth, length), _LARGEST / size
    return np.geomspace(least, largest, max(6, int(np.ceil(_PER_DECADE * np.log10(largest / least))) + 1))


def _without_mesh_error(values: np.ndarray) -> np.ndarray:
    """Takes from the diagonal what is not in its neighbours across it: (4 correction(s-h, s+h) - correction(s-2h,
    s+2h)) / 3 is correction(s, s)."""
    m = values.shape[1]
    if m < 7:
        return values
    i = np.arange(2, m - 2)
    smooth = (4 * values[:, i - 1, i + 1] - values[:, i - 2, i + 2]) / 3
    error = np.median(values[:, i, i] - smooth, axis=1)
    values[:, np.arange(m), np.arange(m)] -= error[:, None]
    return values


class _Straightened:
    """The stations on a straight line: the half-space's answer to the same hats."""

    def __init__(self, mesh: BoundaryMesh, nodes: np.ndarray) -> None:
        m = len(nodes)
        column = mesh.places(nodes)
        e = np.flatnonzero((column[mesh.first] >= 0) | (column[mesh.last] >= 0))
        begin = np.full(mesh.elements, np.nan)
        lengths = mesh.lengths
        chain = _in_order(mesh, e)
        begin[chain] = np.r_[0.0, np.cumsum(lengths[chain])[:-1]]
        self.start, self.end = begin[e], begin[e] + lengths[e]
        self.first, self.last = (np.where(column[hat[e]] < 0, m, column[hat[e]]) for hat in (mesh.first, mesh.last))
        self.positions = np.empty(m + 1)
        middle = {True: 0.25, False: 0.0}
        for element, at, first, last in zip(e, self.start, self.first, self.last):
            self.positions[first] = at + middle[not mesh.smooth[mesh.first[element]]] * lengths[element]
            self.positions[last] = at + lengths[element] * (1 - middle[not mesh.smooth[mesh.last[element]]])
        self.positions, self.m = self.positions[:m], m
        log_r, _ = displacement_integrals(
            self.positions + 0j, self.start + 0j, self.end + 0j, self.first, self.last, m + 1
        )
        self.log_r = log_r[:, :m]

    def half_space(self, wavenumber: float, plane_modulus: float) -> np.ndarray:
        """Displacement amplitude (m, m) [m/Pa] of a half-space under the hats: 2 K0(k r) / (pi E') integrated."""
        values = np.zeros((self.m, self.m + 1))
        for position, weight in zip(_GAUSS, _WEIGHTS):
            rise = (1 + position) / 2
            distance = np.abs(self.positions[:, None] - (self.start + rise * (self.end - self.start)))
            regular = bessel_remainders_of(wavenumber * distance) - np.log(wavenumber / 2)
            share = weight / 2 * (self.end - self.start) * regular
            np.add.at(values.T, self.first, (share * (1 - rise)).T)
            np.add.at(values.T, self.last, (share * rise).T)
        return 2 / (np.pi * plane_modulus) * (values[:, : self.m] - self.log_r)


def _in_order(mesh: BoundaryMesh, elements: np.ndarray) -> np.ndarray:
    """Elements of an open chain from its beginning."""
    inside = np.zeros(mesh.elements, bool)
    inside[elements] = True
    followed = np.zeros(mesh.elements, bool)
    followed[mesh.following[elements]] = True
    heads = elements[~followed[elements]]
    chain = []
    for head in heads if len(heads) else elements[:1]:
        while inside[head]:
            inside[head] = False
            chain.append(head)
            head = mesh.following[head]
    return np.array(chain)
