"""Displacement and stress inside a solved body, up to its boundary.

The sums over elements are exact for the densities found. But the polygon has a weak (logarithmic) stress peak at its
vertices, which the smooth body has not. So within half an element of the boundary the stress goes linearly from the
sums' value there down to a value on the boundary itself, taken from traction and stretch of the elements
(`_on_boundary`).
Error: second order in element size, up to the boundary (tests/bem/test_boundary.py).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bem.checks import plane_points, refuse_unless_positive
from bem.exact.subsurface import von_mises_plane
from bem.plane.boundary import BoundarySolution, resultant_map
from bem.plane.kelvin import components, displacement_sums, resultant_integrals, stress_sums
from bem.plane.outline import Outline

_NEAR = 0.5  # nearer than this (in element lengths) the stress is interpolated down to the boundary
_VERTEX = 0.1  # next to a vertex the sum is bridged over this part of both elements
_KINK = 0.01  # turn [rad] between elements beyond which their own stresses are taken at the boundary
_OUTSIDE = 0.05  # farther outside than this a point is outside the body: a chord lies h^2/8R within a convex profile


MOST_POINTS = 20_000_000  # of a grid: their fields take 1.3 GB


class PositionError(ValueError):
    """Points at which no field can be given."""


def displacement_at(solution: BoundarySolution, points: np.ndarray) -> np.ndarray:
    """Displacement (m, 2) [m] at points (m, 2) [m]; nan outside the body."""
    points = plane_points(points, PositionError)
    return _inside_displacement(solution, points, solution.mesh.locate(points))


def _inside_displacement(solution: BoundarySolution, points: np.ndarray, located: tuple) -> np.ndarray:
    element, _, distance = located
    moved = _displacement(solution, points)
    moved[distance < -_OUTSIDE * solution.mesh.lengths[element]] = np.nan
    return moved


def _displacement(solution: BoundarySolution, points: np.ndarray) -> np.ndarray:
    mesh, w = solution.mesh, solution.density[:, 0] + 1j * solution.density[:, 1]
    z = points[:, 0] + 1j * points[:, 1]
    moved = displacement_sums(z, mesh.start, mesh.end, w[mesh.first], w[mesh.last], solution.material.kolosov)
    total = np.column_stack([moved.real, moved.imag]) / (2 * solution.material.shear) + solution.shift
    total += solution.rotation * np.column_stack([-points[:, 1], points[:, 0]])
    for load in solution.loads:
        total = total + load.displacement(points, solution.material)
    return total


def stress_at(solution: BoundarySolution, points: np.ndarray) -> np.ndarray:
    """Stress (m, 3) xx, yy, xy [Pa] at points (m, 2) [m]; nan outside the body."""
    points = plane_points(points, PositionError)
    return _inside_stress(solution, points, solution.mesh.locate(points))


def _inside_stress(solution: BoundarySolution, points: np.ndarray, located: tuple) -> np.ndarray:
    mesh, (element, fraction, distance) = solution.mesh, located
    length = mesh.lengths[element]
    z = points[:, 0] + 1j * points[:, 1]
    near = np.flatnonzero(distance < _NEAR * length)
    step = (mesh.end - mesh.start)[element[near]]
    z[near] = mesh.start[element[near]] + step * (fraction[near] + 1j * _NEAR)
    stress = _sum(solution, z)
    if len(near):
        share = np.clip(distance[near] / (_NEAR * length[near]), 0, 1)[:, None]
        stress[near] = share * stress[near] + (1 - share) * _on_boundary(solution, element[near], fraction[near])
    stress[distance < -_OUTSIDE * length] = np.nan
    return stress


def _sum(solution: BoundarySolution, z: np.ndarray) -> np.ndarray:
    mesh, w = solution.mesh, solution.density[:, 0] + 1j * solution.density[:, 1]
    stress = stress_sums(z, mesh.start, mesh.end, w[mesh.first], w[mesh.last], solution.material.kolosov)
    for load in solution.loads:
        stress = stress + load.stress(np.column_stack([z.real, z.imag]), solution.material)
    return stress


def _on_boundary(solution: BoundarySolution, element: np.ndarray, fraction: np.ndarray) -> np.ndarray:
    """Stress (m, 3) [Pa] on elements at fractions of their length.

    Where the boundary turns by _KINK or more from element to element: the elements' own stress, linear between their
    middles and constant towards corners. Where it is almost straight: the sums' limit, which follows the stress within
    an element.
    """
    mesh = solution.mesh
    before = np.empty(mesh.elements, int)
    before[mesh.following] = np.arange(mesh.elements)
    behind = fraction < 0.5
    beside = np.where(behind, before[element], mesh.following[element])
    beside = np.where(mesh.smooth[np.where(behind, mesh.first[element], mesh.last[element])], beside, element)
    wanted = np.unique(np.r_[element, beside])
    stress = boundary_stress(solution, wanted)
    away = np.abs(fraction - 0.5) * mesh.lengths[element]
    share = (away / ((mesh.lengths[element] + mesh.lengths[beside]) / 2))[:, None]
    own, other = (stress[np.searchsorted(wanted, which)] for which in (element, beside))
    turn = np.abs(np.angle((mesh.end - mesh.start)[beside] / (mesh.end - mesh.start)[element]))
    bent = np.minimum(turn / _KINK, 1)[:, None]
    return bent * ((1 - share) * own + share * other) + (1 - bent) * _bridged(solution, element, beside, fraction)


def _bridged(solution: BoundarySolution, element: np.ndarray, beside: np.ndarray, fraction: np.ndarray) -> np.ndarray:
    """Sums (m, 3) on elements, linear over the parts next to a vertex that is shared with the element `beside`."""
    mesh = solution.mesh
    start, step = mesh.start, mesh.end - mesh.start
    stress = _sum(solution, start[element] + step[element] * np.clip(fraction, _VERTEX, 1 - _VERTEX))
    chosen = np.flatnonzero((np.abs(fraction - 0.5) > 0.5 - _VERTEX) & (beside != element))
    if len(chosen):
        position = np.where(fraction[chosen] < 0.5, 1 - _VERTEX, _VERTEX)
        other = _sum(solution, start[beside[chosen]] + step[beside[chosen]] * position)
        here, there = _VERTEX * mesh.lengths[element[chosen]], _VERTEX * mesh.lengths[beside[chosen]]
        away = np.minimum(fraction, 1 - fraction)[chosen] * mesh.lengths[element[chosen]]
        share = ((here - away) / (here + there))[:, None]
        stress[chosen] = (1 - share) * stress[chosen] + share * other
    return stress


def boundary_stress(solution: BoundarySolution, element: np.ndarray) -> np.ndarray:
    """Stress (m, 3) xx, yy, xy [Pa] on elements (m,): traction from the resultant, stress along from the stretch;
    second order."""
    mesh, material, m = solution.mesh, solution.material, len(element)
    start, step = mesh.start[element], (mesh.end - mesh.start)[element]
    length, along = np.abs(step), step / np.abs(step)
    points = np.r_[start, start + step / 2, start + step]
    path = np.arange(m)
    begin, end, cell = np.r_[path, m + path], np.r_[m + path, 2 * m + path], np.r_[path, path]
    hats = mesh.start, mesh.end, mesh.first, mesh.last, mesh.densities
    integrals = resultant_integrals(points, begin, end, cell, m, *hats)
    force = (resultant_map(integrals, material) @ solution.density.T.ravel()).reshape(2, m)
    for load in solution.loads:
        force = force + load.path_force(start, start + step, material)
    ends = np.column_stack([points.real, points.imag])
    moved = _displacement(solution, ends[2 * m :]) - _displacement(solution, ends[:m])
    stretch = (moved[:, 0] * along.real + moved[:, 1] * along.imag) / length
    traction = (force[0] + 1j * force[1]) / length * np.conj(-1j * along)  # normal + i tangential
    normal, shear = traction.real, traction.imag
    tangential = material.plane_modulus * stretch + material.poisson / (1 - material.poisson) * normal
    total, deviator = normal + tangential, (tangential - normal + 2j * shear) * np.conj(-1j * along) ** 2
    # yy - xx + 2 i xy turns by twice the angle of the normal, backwards
    return components(total, deviator).T


@dataclass(frozen=True)
class Field:
    """points (..., 2) [m]; displacement (..., 2) [m]; stress (..., 3) xx, yy, xy [Pa]; von_mises (...) of plane strain
    [Pa]."""

    points: np.ndarray
    displacement: np.ndarray
    stress: np.ndarray
    von_mises: np.ndarray


def field_at(solution: BoundarySolution, points: np.ndarray) -> Field:
    """Everything at points (..., 2) [m] of any shape."""
    points = np.asarray(points, float)
    if points.ndim < 2:
        raise PositionError(f"points have the shape {points.shape}: give an array (..., 2) of at least two dimensions")
    flat, shape = plane_points(points.reshape(-1, points.shape[-1]), PositionError), points.shape[:-1]
    located = solution.mesh.locate(flat)
    stress, moved = _inside_stress(solution, flat, located), _inside_displacement(solution, flat, located)
    return Field(
        points,
        moved.reshape(*shape, 2),
        stress.reshape(*shape, 3),
        von_mises_plane(stress, solution.material.poisson).reshape(shape),
    )


def grid_below(
    outline: Outline, face: str, middle: np.ndarray, half_width: float, depth: float, size: float
) -> np.ndarray:
    """Points (rows, columns, 2) [m] below a face: columns from the face straight inward, the first row on the face.

    middle : (2,) [m] a point near the face; half_width : of the grid along the face [m]; depth, size : of the grid [m]
    """
    refuse_unless_positive(PositionError, half_width=half_width, depth=depth, size=size)
    if 2 * half_width / size * (depth / size) > MOST_POINTS:
        raise PositionError(
            f"a grid of {2 * half_width:g} by {depth:g} m at {size:g} m has {2 * half_width * depth / size**2:.3g}"
            f" points, more than {MOST_POINTS:.3g}: choose a larger size"
        )
    curves = outline.edge_curves(face)
    samples = [np.linspace(0, curve.length, 2001) for curve in curves]
    away = [np.hypot(*(curve.at(s) - middle).T) for curve, s in zip(curves, samples)]
    best = int(np.argmin([a.min() for a in away]))
    curve, foot = curves[best], samples[best][np.argmin(away[best])]
    columns, rows = max(int(round(2 * half_width / size)), 1), max(int(round(depth / size)), 1)
    s = np.linspace(max(foot - half_width, 0), min(foot + half_width, curve.length), columns + 1)
    along = curve.direction(np.array([foot]))[0]
    inward = np.array([-along[1], along[0]])
    return curve.at(s)[None] + np.linspace(0, depth, rows + 1)[:, None, None] * inward
