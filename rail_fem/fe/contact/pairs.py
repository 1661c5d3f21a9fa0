"""What contact knows in a step: pairs of a node and the facet that it lies over, the nodes, the law, and what is found.

A pair is one slave node and the facet that it lies over. Both surfaces are slave once, each with half the pressure
(balanced).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

# entries of the sums that `forces.contact_forces` adds up: energies of the step [J], moment on the wheel about
# its axle (y) [N m], forces on it along x and z [N], active pairs
NORMAL_ENERGY, FRICTION_WORK, AXLE_MOMENT, TOWED, CARRIED, N_ACTIVE = range(6)
N_SUMS = 6


class _PairArrays(NamedTuple):
    """What `Pairs` hold: a NamedTuple takes nothing but fields."""

    slaves: np.ndarray
    facets: np.ndarray
    where: np.ndarray
    quads: np.ndarray
    neighbours: np.ndarray
    usable: np.ndarray
    gap: np.ndarray
    normal: np.ndarray
    weight: np.ndarray
    pressure: np.ndarray
    active: np.ndarray
    ahead: np.ndarray


class Pairs(_PairArrays):
    """Nodes of one surface over facets of the other, and what a step finds for them.

    slaves : (k,) nodes;  facets : (k,) facet under each, -1 none;  where : (k, 2) its position xi, eta there
    quads, neighbours : (q, 4) nodes of the facets, facets across the edges 01, 12, 23, 30;
    usable : (q,) facets whose nodes are up to date
    gap [m], normal, weight of the facet's nodes, pressure [Pa], active : (k,), (k, 3), (k, 4), (k,), (k,)
    ahead : (k, 3) normal at the end of the step, which the next one's forces go along, so that their work on surfaces
        that slide over each other is that on the gap
    """

    __slots__ = ()
    STATE = ("slaves", "facets", "where", "usable", "gap", "normal", "weight", "pressure", "active", "ahead")

    @staticmethod
    def over(quads, neighbours, usable, slaves, facets, where) -> Pairs:
        """With room for the results of a step."""
        k = len(slaves)
        return Pairs(
            slaves,
            facets,
            where,
            quads,
            neighbours,
            usable,
            np.zeros(k),
            np.zeros((k, 3)),
            np.zeros((k, 4)),
            np.zeros(k),
            np.zeros(k, np.bool_),
            np.zeros((k, 3)),
        )


class Nodes(NamedTuple):
    """Surface nodes, the rail's first, and where they are.

    area [m2], inverse_mass [1/kg] : (n,);  from_axle : (n, 3) reference position of the wheel's nodes [m]
    position, before : (n, 3) at the end of the step without contact, and at its start [m]
    """

    area: np.ndarray
    inverse_mass: np.ndarray
    from_axle: np.ndarray
    position: np.ndarray
    before: np.ndarray


class Frames(NamedTuple):
    """offset, speed : of the wheel's frame along x [m, m/s];  raised, rise : of the rail's along z;  both since the
    start"""

    offset: float
    speed: float
    raised: float
    rise: float


class Law(NamedTuple):
    """compliance : 1 / penalty per area [m/Pa];  friction [1];  deepest : penetration beyond which a projection is not
    believed [m]"""

    compliance: float
    friction: float
    deepest: float


class NodalForces(NamedTuple):
    """What a step finds at the surface nodes: area that the active pairs put on each [m2], scalar normal force on each
    [N], (n,); force on each (n, 3) [N]; pressure as a slave [Pa] (n,); elastic slip of the rail's nodes (n, 3) [m];
    slot : (n,) scratch, -1 between steps."""

    tributary_area: np.ndarray
    normal_force: np.ndarray
    force: np.ndarray
    pressure_at: np.ndarray
    slip: np.ndarray
    slot: np.ndarray


class Sliding(NamedTuple):
    """Of the rail's k pairs: sticking (k,); path of the node over the wheel's material without contact (k, 3) [m];
    friction force on the wheel (k, 3) [N]."""

    sticking: np.ndarray
    moved: np.ndarray
    drag: np.ndarray
