"""A rigid body pressed into a yielding one whose elements lie in lines, the contact growing by one node at a time.

Bilinear quadrilaterals with mean dilatation, about an axis or in plane strain. Each load is the one at which the next
node of the surface just touches, so that the contact's size is known without interpolation.
"""

from collections.abc import Iterator

import numpy as np
from mpi4py import MPI

from bem.material import Elastic
from bem.steel.hardening import Hardening
from rail_fem.fe.compat import plane_mesh
from rail_fem.static_fe.small_strain import BalancedState, HeldMotions, SmallStrain, SmallStrainError

PARTS = 1, 4, 16  # in which the gap of the next node is closed, more where fewer find no equilibrium


def quadrilaterals(
    nodes: np.ndarray, quads: np.ndarray, elastic: Elastic, hardening: Hardening, revolved: bool = False
) -> SmallStrain:
    """Body of nodes (m, 2) [m] and quads (e, 4) counter-clockwise; revolved : as of SmallStrain."""
    cells = np.asarray(quads, np.int64)[:, [0, 1, 3, 2]]
    mesh = plane_mesh(MPI.COMM_SELF, cells, np.ascontiguousarray(nodes, float), "quadrilateral", 1)
    return SmallStrain(mesh, nodes, elastic, hardening, revolved=revolved, mean_dilatation=True)


def graded(size: float, fine: float, far: float, growth: float) -> np.ndarray:
    """Positions from 0: equal steps of `size` up to `fine`, growing ones up to `far` [m]."""
    equal = size * np.arange(int(np.ceil(fine / size)) + 1)
    count = int(np.ceil(np.log1p((far - equal[-1]) / size * (growth - 1)) / np.log(growth)))
    steps = size * growth ** np.arange(1, count + 1)
    return np.r_[equal, equal[-1] + np.cumsum(steps)]


def lined_block(line: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Distance and depth (n^2,) [m] of the nodes of a block with a line (n,) of them each way, their numbers (n, n) and
    quads (e, 4), depth counted down."""
    across, depth = (values.ravel() for values in np.meshgrid(line, line, indexing="ij"))
    at = np.arange(len(line) ** 2).reshape(len(line), -1)
    quads = np.stack([at[:-1, 1:], at[1:, 1:], at[1:, :-1], at[:-1, :-1]], axis=-1).reshape(-1, 4)
    return across, depth, at, quads


def press_by_nodes(
    body: SmallStrain,
    surface: np.ndarray,
    height: np.ndarray,
    still: np.ndarray,
    across: int,
    outer: tuple[np.ndarray, np.ndarray] | None = None,
) -> Iterator[BalancedState]:
    """A rigid body pressed into a surface: the contact grows by one node at a time, 1 to `across`. Each load is the one
    at which the next node just touches and carries nothing, so that the contact's size is known without interpolation.

    surface (n,) : degrees of freedom along z of its nodes;  height (n,) [m] of the rigid body above its lowest point;
    still (c,) : degrees of freedom that do not move;  outer : those (o,) that move with the load, and by how much (o,)
        [m/N]; the second amplitude is then the load [N], the first always the approach [m]
    Raises SmallStrainError where there is no equilibrium, or a node within pulls.
    """
    q = 1 if outer is None else 2
    far_dofs, far = (np.zeros(0, int), np.zeros(0)) if outer is None else outer
    state = body.at_rest(q)
    for k in range(1, across + 1):
        inside = surface[: k + 1]
        dofs = np.r_[still, far_dofs, inside]
        motions, on_force = np.zeros((len(dofs), q)), np.zeros((q, body.count))
        motions[-(k + 1) :, 0] = -1.0
        on_force[0, inside[-1]] = 1.0  # the last node carries nothing
        if outer is not None:
            motions[len(still) : len(still) + len(far), 1], on_force[1, inside] = far, 1.0
        opening = height[k] - state.amplitudes[0] - state.displacement[surface[k]]
        for parts in PARTS:
            found = state
            try:
                for part in range(1, parts + 1):
                    target = np.r_[np.zeros(len(dofs) - k - 1), height[: k + 1]]
                    target[-1] -= (1 - part / parts) * opening
                    held = HeldMotions(dofs, target, motions, on_force, np.diag([0.0, 1.0][:q]))
                    found = body.equilibrium(held, found)
                break
            except SmallStrainError:
                if parts == PARTS[-1]:
                    raise
        state = found
        force = -state.force[inside[:-1]]
        if force.min() < -1e-6 * force.max():
            raise SmallStrainError(f"a node within pulls ({force.min():.3g} N) after {k} of {across}")
        yield state
