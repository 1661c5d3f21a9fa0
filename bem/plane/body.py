"""An elastic body as contact sees it: outline, material, and how it is held; condensed to the contact zone.

A body is factorised once; after that a contact problem knows it by the displacement at its contact points under
tractions there, and load steps cost nothing of its size. How a body is held decides what its rigid motion means:

- held edge: the edge keeps its shape and moves with the holder (the thesis' blocks);
- hub: a force and a couple at one inner point balance the contact (a wheel on its axle); the displacement has zero mean
and
  mean rotation over the boundary, and the holder's motion adds to it;
- infinite: the plane around a hole; displacement is known up to a constant, since it grows as the logarithm of the
distance.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from bem.checks import plane_points
from bem.material import Elastic
from bem.plane.boundary import MEMORY_LIMIT, BoundaryProblem, BoundarySolution, displacement_matrix, rigid_modes
from bem.plane.mesh import BoundaryMesh
from bem.plane.outline import Outline, OutlineError
from bem.plane.point_load import PointLoad


@dataclass(frozen=True)
class Body:
    """An elastic body of plane strain: its outline, its material and how it is held.

    Parameters
    ----------
    outline : Outline
        Of bem.plane.outline: named edges.
    material : Elastic
        [Pa]
    face : str
        Name of the edges that may touch.
    held : str or None
        Name of the edge that is held.
    hub : (float, float) or None
        x, y of an inner point that carries the load [m]; it is then held by no edge.

    Examples
    --------
    >>> from rail_fem.bem.plane.outline import block_behind
    >>> y = np.linspace(-0.04, 0.04, 161)
    >>> rail = bem.Body(block_behind(np.column_stack([y, -(y**2) / 0.6]), level=-0.1), bem.STEEL)
    >>> rail.held
    'held'
    """

    outline: Outline
    material: Elastic
    face: str = "face"
    held: str | None = "held"
    hub: tuple[float, float] | None = None

    def __post_init__(self) -> None:
        if not isinstance(self.outline, Outline) or not isinstance(self.material, Elastic):
            raise TypeError(
                f"a body takes an Outline and an Elastic, not {type(self.outline).__name__} and"
                f" {type(self.material).__name__}"
            )
        self.outline.edge_curves(self.face)
        if self.hub is not None:
            plane_points([self.hub], OutlineError)
        if self.hub is not None and self.held is not None:
            object.__setattr__(self, "held", None)
        if self.outline.infinite:
            object.__setattr__(self, "held", None)
        elif self.held is None and self.hub is None:
            raise OutlineError(
                "a finite body in contact needs a held edge or a hub: nothing else balances the contact force"
            )
        if self.held == self.face:
            raise OutlineError(
                f"the edge {self.face!r} cannot be both held and touched: give the held one a name of its own"
            )
        if self.held is not None:
            self.outline.edge_curves(self.held)

    def moved(self, by: np.ndarray) -> Body:
        """The body translated by (2,) [m]."""
        hub = None if self.hub is None else (self.hub[0] + by[0], self.hub[1] + by[1])
        return replace(self, outline=self.outline.moved(by), hub=hub)


class CondensedBody:
    """A meshed body reduced to the displacement of chosen points under tractions given as cell forces."""

    def __init__(self, body: Body, mesh: BoundaryMesh, memory_limit: float = MEMORY_LIMIT) -> None:
        self.body, self.mesh = body, mesh
        held = np.zeros((mesh.densities, 2), bool)
        if body.held is not None:
            held[mesh.of_edge(body.held)] = True
        self.problem = BoundaryProblem(mesh, body.material, held, np.zeros(mesh.densities, bool), memory_limit)
        self.hub_units: tuple[PointLoad, ...] = ()
        if body.hub is not None:
            PointLoad(body.hub).refuse_outside(mesh)
            self.hub_units = tuple(
                PointLoad(body.hub, force, moment) for force, moment in (((1, 0), 0), ((0, 1), 0), ((0, 0), 1))
            )

    def condense(self, forces: np.ndarray) -> None:
        """Fix the m load patterns that the contact may apply: forces (2n, m) on the cells, all x then all y [N/m per
        unit]."""
        self.reaction = np.zeros((3, forces.shape[1]))
        load = forces
        if self.body.hub is not None:
            arms = rigid_modes(self.mesh.middles, np.array(self.body.hub))
            self.reaction = -arms.T @ forces
            hub = np.column_stack([unit.resultants(self.mesh, self.body.material) for unit in self.hub_units])
            load = forces - hub @ self.reaction
        self.density, self.shift = self.problem.solve(load, np.zeros_like(load))

    def displacement(self, points: np.ndarray, at_middles: np.ndarray | None = None) -> np.ndarray:
        """Displacement (2k, m), all x then all y, of points (k, 2), or of the middles of the cells `at_middles`
        (k,)."""
        if at_middles is None:
            matrix = displacement_matrix(points, self.mesh, self.body.material)
        else:
            rows = np.r_[at_middles, self.mesh.densities + at_middles]
            matrix, points = self.problem.displacement_at_middles[rows], self.mesh.middles[at_middles]
        moved = matrix @ self.density + np.repeat(self.shift, len(points), axis=0)
        if self.body.hub is not None:
            fields = np.column_stack(
                [unit.displacement(points, self.body.material).T.ravel() for unit in self.hub_units]
            )
            moved += fields @ self.reaction
        return moved

    def solution(self, amplitude: np.ndarray, motion: np.ndarray | None = None) -> BoundarySolution:
        """Field under load patterns of the given amplitude (m,), with a rigid motion (x, y, rotation) about the origin
        added."""
        n = self.mesh.densities
        motion = np.zeros(3) if motion is None else motion
        shift, density = self.shift @ amplitude + motion[:2], (self.density @ amplitude).reshape(2, n).T
        loads = self.hub_loads(amplitude)
        return BoundarySolution(self.mesh, self.body.material, density, shift, loads, float(motion[2]))

    def hub_loads(self, amplitude: np.ndarray) -> tuple[PointLoad, ...]:
        """What balances load patterns of the given amplitude (m,) at the hub, where there is one."""
        if self.body.hub is None:
            return ()
        x, y, moment = self.reaction @ amplitude
        return (PointLoad(self.body.hub, (x, y), moment),)
