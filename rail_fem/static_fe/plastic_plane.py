"""Plane contact of a yielding body by static finite elements: the judge of bem/plane_plastic.

The bodies, elements and mortar contact are those of plane_strain.py and plane_contact.py; J2 plasticity with linear
hardening at the three Gauss points of each triangle. The plastic strain acts as initial stress on the elastic
stiffness, and strain, contact and plastic strain are brought to agree by Anderson's mixing. The return map is written
out here: nothing of the boundary elements' is used.
Error: second order in the element (rail_fem/studies/plane_plastic.py shows two sizes).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import ufl

from bem.plane.body import Body
from bem.plastic.mixing import Mixing
from rail_fem.fe.compat import cell_dofs, discontinuous, fem
from rail_fem.static_fe.plane_contact import PressedBodies
from rail_fem.static_fe.plane_strain import INNER, Fineness, PlaneBody, PlaneStrainError, TensorAtPoints

_MOST_TURNS = 400


@dataclass
class PlasticPlaneStep:
    """points (p, 2) [m] of the fixed body; stress (p, 4) xx yy zz xy [Pa]; peeq (p,); x, pressure (n,) of the contact;
    approach [m]; turns of the iteration."""

    points: np.ndarray
    stress: np.ndarray
    peeq: np.ndarray
    x: np.ndarray
    pressure: np.ndarray
    approach: float
    turns: int


class InitialStress:
    """Forces and strains of one body's Gauss points: three in each triangle, cell by cell."""

    def __init__(self, body: PlaneBody) -> None:
        self.body, mesh = body, body.mesh
        space = discontinuous(mesh, 1, (2, 2))
        self._stress = fem.Function(space)
        self._dofs = cell_dofs(space)
        at_points = np.column_stack([1 - INNER.sum(axis=1), INNER])
        self._to_corners = np.linalg.inv(at_points)
        test = ufl.TestFunction(body.space)
        measure = ufl.dx(metadata={"quadrature_degree": 2})
        self._form = fem.form(ufl.inner(self._stress, ufl.sym(ufl.grad(test))) * measure)
        self.strain = TensorAtPoints(body, lambda u: ufl.sym(ufl.grad(u)))

    def displacement(self, stress: np.ndarray) -> np.ndarray:
        """Displacement (2 m,) [m] by initial stress (p, 3) xx yy xy [Pa] at the points."""
        corners = np.einsum("ab,kbc->kac", self._to_corners, stress.reshape(-1, 3, 3))
        values = self._stress.x.array.reshape(-1, 4)
        values[self._dofs.ravel()] = corners.reshape(-1, 3)[:, [0, 2, 2, 1]]
        force = np.asarray(fem.assemble_vector(self._form).array)[self.strain.order]
        return self.body.displacement(force[:, None])[:, 0]


def _deviator(strain: np.ndarray) -> np.ndarray:
    """(p, 4) xx yy zz xy of in-plane strain (p, 3)."""
    mean = (strain[:, 0] + strain[:, 1]) / 3
    return np.column_stack([strain[:, 0] - mean, strain[:, 1] - mean, -mean, strain[:, 2]])


def _size(deviator: np.ndarray) -> np.ndarray:
    return np.sqrt((deviator[:, :3] ** 2).sum(axis=1) + 2 * deviator[:, 3] ** 2)


class PlasticPlaneContact:
    """The fixed body yields, the moving one is elastic; the upper is pressed down by loads one after the other.

    yield_stress, slope : [Pa] of linear hardening; kinematic : the yield surface moves instead of growing
    """

    def __init__(
        self, fixed: Body, moving: Body, fineness: Fineness, window: tuple[float, float], yield_stress: float,
        slope: float = 0.0, kinematic: bool = False,
    ) -> None:  # fmt: skip
        self.pressed = PressedBodies.build(fixed, moving, fineness, window)
        self.initial = InitialStress(self.pressed.below)
        self.material, self.yield_stress, self.slope, self.kinematic = fixed.material, yield_stress, slope, kinematic
        count = 3 * len(self.pressed.below.triangles)
        self.plastic, self.back, self.peeq = np.zeros((count, 4)), np.zeros((count, 4)), np.zeros(count)
        self.steps: list[PlasticPlaneStep] = []

    def go_to(self, load: float, tolerance: float = 1e-5) -> PlasticPlaneStep:
        """load : downward force [N/m]; tolerance : of plastic stress over yield stress."""
        shear, pressed = self.material.shear, self.pressed
        mixing, stress = Mixing(depth=10), 2 * shear * self.plastic
        for turn in range(1, _MOST_TURNS + 1):
            moved = self.initial.displacement(stress[:, [0, 1, 3]])
            pressure, approach = pressed.solve(load, moved)
            points, strain = self.initial.strain(pressed.yielded @ pressure + moved)
            grown, direction = self._return(2 * shear * (_deviator(strain) - self.plastic))
            plastic = self.plastic + np.sqrt(1.5) * grown[:, None] * direction
            answer = 2 * shear * plastic
            if np.abs(answer - stress).max() <= tolerance * self.yield_stress:
                return self._accept(points, strain, plastic, grown, direction, pressure, approach, turn)
            stress = mixing(stress, answer)
        raise PlaneStrainError(f"load {load:g} N/m: no equilibrium after {_MOST_TURNS} turns: take smaller steps")

    def _accept(self, points, strain, plastic, grown, direction, pressure, approach, turn) -> PlasticPlaneStep:
        shear = self.material.shear
        self.plastic, self.peeq = plastic, self.peeq + grown
        if self.kinematic:
            self.back = self.back + np.sqrt(2 / 3) * self.slope * grown[:, None] * direction
        bulk = self.material.young / (3 * (1 - 2 * self.material.poisson))
        whole = 2 * shear * (_deviator(strain) - plastic)
        whole[:, :3] += bulk * (strain[:, :1] + strain[:, 1:2])
        self.steps.append(PlasticPlaneStep(points, whole, self.peeq, self.pressed.x, pressure, approach, turn))
        return self.steps[-1]

    def _return(self, trial: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Growth (p,) of the equivalent plastic strain and unit direction (p, 4) of trial deviators [Pa]."""
        away = trial - self.back
        size = np.maximum(_size(away), 1e-300)
        limit = self.yield_stress + (0.0 if self.kinematic else self.slope) * self.peeq
        grown = np.maximum(np.sqrt(1.5) * size - limit, 0) / (3 * self.material.shear + self.slope)
        return grown, away / size[:, None]
