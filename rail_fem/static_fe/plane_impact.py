"""A stiff striker on a plane body with inertia by implicit finite elements: the reference solution for bem/dynamic.

Quadratic triangles with their consistent mass, the same family of schemes in time, pressures linear between the nodes
of the face and gaps closed in the mean of the same hats (as plane_contact.py). It shares with the boundary elements the
outlines, the schemes' weights and the solver of the complementarity problem.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.sparse.linalg import splu

from bem.dynamic.contact import NormalContact
from bem.dynamic.impact import Striker, moved_mass
from bem.dynamic.schemes import TRAPEZOIDAL, Scheme
from bem.exact.subsurface import von_mises_plane
from bem.plane.body import Body
from bem.plane.curve import Curve
from bem.plane.pairing import smooth_gap
from rail_fem.static_fe.plane_contact import GAUSS, face_within, shapes
from rail_fem.static_fe.plane_strain import Fineness, PlaneBody, PlaneStrainError


@dataclass(frozen=True)
class FiniteImpact:
    """Of k + 1 instants: time, position, velocity and force (k+1,) of the striker [s, m, m/s, N/m], pressure (k+1, c)
    [Pa] at x (c,) [m], energy (k+1, 3) kinetic, strain, striker's kinetic [J/m], largest von Mises stress (k+1,) [Pa]
    where it was asked for, nan elsewhere; displacements (2m,) [m] kept by number of the instant."""

    body: PlaneBody
    time: np.ndarray
    position: np.ndarray
    velocity: np.ndarray
    force: np.ndarray
    x: np.ndarray
    pressure: np.ndarray
    energy: np.ndarray
    displacement: dict[int, np.ndarray]

    def von_mises(self, instant: int) -> tuple[np.ndarray, np.ndarray]:
        """Points (p, 2) [m] and von Mises stress (p,) [Pa] at an instant that was kept."""
        points, stress = self.body.stress(self.displacement[instant])
        return points, von_mises_plane(stress, self.body.body.material.poisson)


def pressure_hats(
    body: PlaneBody, edges: np.ndarray, curves: list[Curve], reach: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Nodal forces (2m, c) of unit pressures, linear from node to node of the edges (e, 3), the gaps (c,) [m^2] to the
    striker's curves weighted with the same hats, and their x (c,)."""
    count = 2 * len(edges) + 1
    push, gap = np.zeros((2 * len(body.nodes), count)), np.zeros(count)
    for e, edge in enumerate(edges):
        nodes = body.nodes[edge]
        for half in (0.0, 0.5):
            t = half + (GAUSS[0] + 1) / 4
            shape, slope = shapes(t)
            along = slope @ nodes
            length = np.hypot(*along.T)
            weight = GAUSS[1] / 4
            normal = np.column_stack([-along[:, 1], along[:, 0]]) / length[:, None]  # by growing x the body lies below
            open_by = smooth_gap(shape @ nodes, normal, curves, reach, 0.1)
            hats = np.maximum(1 - 2 * t, 0), 1 - np.abs(2 * t - 1), np.maximum(2 * t - 1, 0)
            for column, hat in enumerate(hats, 2 * e):
                if not hat.any():
                    continue
                force = (hat * weight * length)[:, None] * normal
                for axis in (0, 1):
                    np.add.at(push[:, column], 2 * edge + axis, -shape.T @ force[:, axis])
                gap[column] += (hat * weight * length * np.minimum(open_by, reach)).sum()
    nodes = np.r_[edges[:, :2].ravel(), edges[-1, 2]]
    return push, gap, body.nodes[nodes, 0]


def finite_impact(
    body: Body,
    striker_curves: list[Curve],
    striker: Striker,
    density: float,
    step: float,
    steps: int,
    fineness: Fineness,
    window: tuple[float, float],
    scheme: Scheme = TRAPEZOIDAL,
    keep: Callable[[int], bool] = lambda k: False,
    reach: float = 0.01,
) -> FiniteImpact:
    """March a body under a striker along y; window (x_min, x_max) [m] of the face that may be touched.

    Raises PlaneStrainError for a scheme with weights between two instants, or a striker along another axis.
    """
    if scheme.alpha_m or scheme.alpha_f or abs(striker.axis[0]) > 0:
        raise PlaneStrainError("the reference takes schemes with the balance at the step's end, and strikers along y")
    plane = PlaneBody(body, fineness)
    edges = face_within(plane, window)
    push, gap, x = pressure_hats(plane, edges, striker_curves, reach)
    free = plane.free
    mass, stiff = (matrix[free][:, free].tocsc() for matrix in (plane.mass(density), plane.stiffness()))
    k = scheme.after_u * step**2
    factor = splu(mass + k * stiff, permc_spec="MMD_AT_PLUS_A", options={"SymmetricMode": True})
    push, total = push[free], plane.displacement(push).shape[0]
    answer = factor.solve(np.ascontiguousarray(push))  # acceleration per unit pressure
    arm = -push[(free % 2 == 1)].sum(axis=0)  # upward force on the striker
    matrix = k * push.T @ answer
    matrix = (matrix + matrix.T) / 2
    if striker.mass is not None:
        matrix = matrix + k / striker.mass * np.outer(arm, arm)
    contact = NormalContact(matrix)
    u, v, a = np.zeros((3, len(free)))
    place = float(striker.path(0.0)) if striker.path else 0.0
    speed, pull = striker.velocity, (striker.load / striker.mass if striker.mass else 0.0)
    rows, pressures, energies, kept = [(0.0, place, speed, 0.0)], [np.zeros(len(gap))], [], {}
    energies.append((0.0, 0.0, 0.5 * (striker.mass or 0.0) * speed**2))
    for n in range(1, steps + 1):
        time = n * step
        star = u + step * v + scheme.before_u * step**2 * a
        unloaded = -factor.solve(stiff @ star)
        if striker.path is not None:
            ahead = float(striker.path(time))
        else:
            ahead = (
                place
                + step * speed
                + step**2 * (scheme.before_u * pull + scheme.after_u * striker.load / moved_mass(striker))
            )
        pressure = np.zeros(len(gap))
        if striker.release is None or time <= striker.release:
            pressure = contact.solve(gap + push.T @ (star + k * unloaded) + arm * ahead)
        force = float(arm @ pressure)
        a_new = unloaded + answer @ pressure
        u = star + k * a_new
        v = v + step * (scheme.before_v * a + scheme.after_v * a_new)
        a = a_new
        if striker.path is not None:
            speed, place = (ahead - place) / step, ahead
        else:
            pull_new = (force + striker.load) / moved_mass(striker)
            place += step * speed + step**2 * (scheme.before_u * pull + scheme.after_u * pull_new)
            speed += step * (scheme.before_v * pull + scheme.after_v * pull_new)
            pull = pull_new
        rows.append((time, place, speed, force))
        pressures.append(pressure)
        energies.append((0.5 * v @ (mass @ v), 0.5 * u @ (stiff @ u), 0.5 * (striker.mass or 0.0) * speed**2))
        if keep(n):
            whole = np.zeros(total)
            whole[free] = u
            kept[n] = whole
    times, positions, velocities, forces = np.array(rows).T
    return FiniteImpact(
        plane, times, positions, velocities, forces, x, np.array(pressures), np.array(energies), displacement=kept
    )
