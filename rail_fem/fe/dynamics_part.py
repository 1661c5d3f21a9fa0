"""What moves with the elements of a structure, holds, pushes or hides some of them: one interface for all of it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from rail_fem.fe.structure import Structure

# energies and works that parts have [J]: kinetic of masses beside the nodes', in springs, lost in dampers, work of
# loads; of a contact those of its penalty, friction, prescribed motion and rotation; what left with slabs
OF_PARTS = (
    *("lumped_kinetic", "springs", "dampers", "loads"),
    *("contact_penalty", "friction", "prescribed_motion", "rotation"),
    *("left_elastic", "left_kinetic"),
)


class Reach(NamedTuple):
    """Nodes of a rank that a step concerns, (n_nodes,) bool: touched: with an element that it computes, inside: with
    all of their elements computed. Nodes of bodies that are not cut into slabs are inside."""

    touched: np.ndarray
    inside: np.ndarray


class DynamicsPart:
    """A part of `Dynamics`; what it does not say it does not do. In the order in which a step calls it:

    looks, ready, pack -> one sum over the ranks -> kick;  drift;  moved_on;  add_force

    STATE, SUMMED : what a restart needs (rail_fem.fe.saved_state), SUMMED each rank's part of a sum;  size : numbers of
    the step's message that it fills
    """

    STATE: tuple[str, ...] = ()
    SUMMED: tuple[str, ...] = ()
    size = 0

    def join(self, structure: Structure) -> None:
        """Be part of the dynamics of these bodies from now on. Collective."""

    def moves(self) -> np.ndarray:
        """Local nodes (k,) that it moves itself: no step moves them on their own. Rank-local."""
        return np.empty(0, np.int64)

    def changes(self) -> np.ndarray:
        """Local nodes (k,) whose velocities its kick changes; the others have drifted by then. Rank-local."""
        return self.moves()

    def reach(self) -> Reach | None:
        """The nodes that a step computes, None: all. Rank-local."""
        return None

    def follow(self, touched: np.ndarray) -> None:
        """From now on a step computes these nodes (n_nodes,) bool. Rank-local."""

    def looks(self, dt: float) -> bool:
        """Whether `ready` will look at nodes beyond those that it `changes`, or `moved_on` will change what a step
        computes. Replicated."""
        return False

    def ready(self, dt: float) -> bool:
        """Before anything of a step is packed: `size` and what it `changes` may change here; true where they have.
        Collective."""
        return False

    def pack(self, dt: float, mine: np.ndarray) -> None:
        """This rank's share of the sums over all ranks -> mine (size,), overwritten. Forces are those of the elements
        now, velocities as if the bodies were alone. Rank-local."""

    def kick(self, dt: float, summed: np.ndarray) -> None:
        """Velocities after the step, its own and those of nodes, from the sums over all ranks (size,). Replicated."""

    def impose(self) -> None:
        """Its velocities onto the nodes that it moves. Rank-local."""

    def drift(self, dt: float) -> None:
        """Its positions after the step. Replicated."""

    def moved_on(self) -> bool:
        """After the drift; true where `reach` has changed. Collective."""
        return False

    def add_force(self, dt: float) -> None:
        """Its forces at the new positions, added to `force` of owned and ghost nodes; they are summed up over the ranks
        with those of the elements. Rank-local."""

    def bring_up(self) -> None:
        """What no step touched to where it is now, for those who look at all of the bodies. Rank-local."""

    def end_message(self) -> str | None:
        """A sentence where the run must end here, or None. Replicated."""
        return None

    def energies(self) -> dict[str, float]:
        """Its energies and works so far [J], names of OF_PARTS. Replicated."""
        return {}

    def shares(self) -> tuple[float, float]:
        """This rank's part of: kinetic energy of nodes that no step touches, work of contact on the bodies [J]."""
        return 0.0, 0.0

    def power(self) -> float:
        """Of forces at hand other than the elements' and constant loads on what it moves [W]. Replicated."""
        return 0.0

    def frequency(self) -> float:
        """A bound of the frequencies of what it moves by forces of its own [rad/s]: with that of the elements it bounds
        those of both together, where its masses are its own. Collective."""
        return 0.0
