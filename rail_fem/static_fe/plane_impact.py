"""A stiff striker on a plane body with inertia by implicit finite elements: the reference solution for bem/dynamic.

Quadratic triangles with their consistent mass, the same family of schemes in time, pressures linear between the nodes
of the face and gaps closed in the mean of the same hats (as plane_contact.py). It shares with the boundary elements the
outlines, the striker's own motion, the schemes' weights and the solver of the complementarity problem.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from bem.dynamic.impact import Carriage, Striker, TangentialMotion
from bem.dynamic.pivoting import StepContact
from bem.dynamic.schemes import TRAPEZOIDAL, Scheme
from bem.plane.body import Body
from bem.plane.curve import Curve
from bem.plane.pairing import smooth_gap
from rail_fem.static_fe.plane_contact import GAUSS, face_within, shapes
from rail_fem.static_fe.plane_strain import Fineness, PlaneBody
from rail_fem.static_fe.small_strain import SmallStrainError, factor


@dataclass(frozen=True)
class FiniteImpact:
    """Of k + 1 instants: time, position, velocity and force (k+1,) of the striker [s, m, m/s, N/m], pressure (k+1, c)
    [Pa] at x (c,) [m], energy (k+1, 3) kinetic, strain, striker's kinetic [J/m], largest von Mises stress (k+1,) [Pa]
    where it was asked for, nan elsewhere; displacements (2m,) [m] kept by number of the instant; shear (k+1, c) [Pa] on
    the body along its tangent; slide (k+1, 3) position, velocity, force of the striker along x [m, m/s, N/m]"""

    body: PlaneBody
    time: np.ndarray
    position: np.ndarray
    velocity: np.ndarray
    force: np.ndarray
    x: np.ndarray
    pressure: np.ndarray
    energy: np.ndarray
    displacement: dict[int, np.ndarray]
    shear: np.ndarray
    slide: np.ndarray

    def von_mises(self, instant: int) -> tuple[np.ndarray, np.ndarray]:
        """Points (p, 2) [m] and von Mises stress (p,) [Pa] at an instant that was kept."""
        return self.body.von_mises(self.displacement[instant])


class Hats(NamedTuple):
    """Nodal forces push, drag (2m, c) of unit pressures and unit shears, linear from node to node; gap (c,) [m^2] to
    the striker weighted with the same hats; x (c,) [m]."""

    push: np.ndarray
    drag: np.ndarray
    gap: np.ndarray
    x: np.ndarray


def pressure_hats(body: PlaneBody, edges: np.ndarray, curves: list[Curve], reach: float) -> Hats:
    """Of the edges (e, 3) of a face, against the striker's curves."""
    count = 2 * len(edges) + 1
    push, drag, gap = np.zeros((2 * len(body.nodes), count)), np.zeros((2 * len(body.nodes), count)), np.zeros(count)
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
                    turned = force[:, 1] if axis == 0 else -force[:, 0]
                    np.add.at(drag[:, column], 2 * edge + axis, shape.T @ turned)
                gap[column] += (hat * weight * length * np.minimum(open_by, reach)).sum()
    nodes = np.r_[edges[:, :2].ravel(), edges[-1, 2]]
    return Hats(push, drag, gap, body.nodes[nodes, 0])


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
    sliding: TangentialMotion | None = None,
) -> FiniteImpact:
    """March a body under a striker along y; window (x_min, x_max) [m] of the face that may be touched; sliding : the
    striker's motion along x, with friction.

    Raises SmallStrainError for a scheme with weights between two instants, or a striker along another axis.
    """
    if scheme.alpha_m or scheme.alpha_f or abs(striker.axis[0]) > 0:
        raise SmallStrainError("the reference takes schemes with the balance at the step's end, and strikers along y")
    plane = PlaneBody(body, fineness)
    edges = face_within(plane, window)
    hats = pressure_hats(plane, edges, striker_curves, reach)
    free, gap, x, count = plane.free, hats.gap, hats.x, len(hats.gap)
    mass, stiff = (matrix[free][:, free].tocsc() for matrix in (plane.mass(density), plane.stiffness()))
    k = scheme.after_u * step**2
    march = factor(mass + k * stiff, np.arange(len(free)))
    total = plane.displacement(hats.push).shape[0]
    both = [striker] if sliding is None else [striker, sliding.striker(striker.axis)]
    carriages = [Carriage(one, scheme, step) for one in both]
    push = (hats.push if sliding is None else np.hstack([hats.push, hats.drag]))[free]
    answer = march.solve(np.ascontiguousarray(push))  # acceleration per unit pressure and shear
    # force on the striker, upward and to the right
    arm = np.column_stack([-push[free % 2 == one].sum(axis=0) for one in (1, 0)[: len(both)]])
    matrix = k * push.T @ answer
    matrix = (matrix + matrix.T) / 2
    for column, carriage in zip(arm.T, carriages):
        matrix = matrix + carriage.mobility * np.outer(column, column)
    contact = StepContact(matrix, None if sliding is None else sliding.friction)
    u, v, a = np.zeros((3, len(free)))
    tractions = np.zeros(push.shape[1])
    slip = np.zeros(push.shape[1] - count)
    at = [carriage.begin() for carriage in carriages]
    energies = [(0.0, 0.0, sum(carriage.energy(one) for carriage, one in zip(carriages, at)))]
    motions, history, kept = [[(one.x, one.v, 0.0) for one in at]], [tractions], {}
    for n in range(1, steps + 1):
        time = n * step
        star = u + step * v + scheme.before_u * step**2 * a
        unloaded = -march.solve(stiff @ star)
        ahead = [carriage.predicted(one, time) for carriage, one in zip(carriages, at)]
        moved = push.T @ (star + k * unloaded) + arm @ ahead
        tractions = np.zeros(push.shape[1])
        if striker.release is None or time <= striker.release:
            tractions, _ = contact.solve(moved + np.r_[gap, -slip])
        forces = arm.T @ tractions
        a_new = unloaded + answer @ tractions
        u = star + k * a_new
        v = v + step * (scheme.before_v * a + scheme.after_v * a_new)
        a = a_new
        at = [carriage.moved(one, *rest) for carriage, one, *rest in zip(carriages, at, ahead, forces)]
        slip = push.T[count:] @ u + arm[count:] @ [one.x for one in at]
        motions.append([(one.x, one.v, force) for one, force in zip(at, forces)])
        history.append(tractions)
        moving = sum(carriage.energy(one) for carriage, one in zip(carriages, at))
        energies.append((0.5 * v @ (mass @ v), 0.5 * u @ (stiff @ u), moving))
        if keep(n):
            whole = np.zeros(total)
            whole[free] = u
            kept[n] = whole
    moves, both_tractions = np.array(motions), np.array(history)  # moves (k+1, 1 or 2, 3)
    position, velocity, force = moves[:, 0].T
    return FiniteImpact(
        plane, step * np.arange(steps + 1), position, velocity, force, x, both_tractions[:, :count],
        np.array(energies), kept, shear=both_tractions[:, count:],
        slide=moves[:, -1] if sliding is not None else np.zeros((steps + 1, 3)),
    )  # fmt: skip
