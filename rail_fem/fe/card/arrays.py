"""What a step reads and writes on a card: one NamedTuple, the only argument of all kernels."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from rail_fem.fe.contact.pairs import N_SUMS, Law, NodalForces, Nodes, Pairs, Sliding
from rail_fem.fe.plasticity import MaterialTable

TO_SEARCH, LEFT, GOES = range(3)  # counters: steps to the next search, steps asked for, whether this one is made
# columns of the threads' sums after those of a step: forces and moments of node_kernels.add_step, pairs that were lost
FORCES, MOMENT, LOST = N_SUMS, N_SUMS + 5, N_SUMS + 9
N_COLUMNS = N_SUMS + 10
OFFSET, SPIN, SPEED, INERTIA, YAW = range(5)  # of the wheel's motion [m, rad/s, m/s, kg m2, rad]; inertia inf: held
# since they were last read: forces and moments as in the sums, works of friction, of towing and driving, of rotation
FRICTION, TOWING, ROTATION = range(LOST - FORCES, LOST - FORCES + 3)
VELOCITY, DISPLACEMENT, REACTION, LOAD, MASS = range(5)  # of a group, mass inf where a direction does not move
STIFFNESS, DAMPING, LENGTH, RATE, DISSIPATED, BEFORE = range(6)  # of a link, the last its rate before the step


class CardNodes(NamedTuple):
    """x, v, force, reference, inverse_mass, displaced : (3 n,), the last for small-displacement elements
    moved : (k,) nodes that a step computes
    power, pushed : (n,) internal work of the kick, work of contact on the body, since they were last read [J]
    first, places : (n+1,), (m,) where the nodal forces of each node's elements stand
    """

    x: np.ndarray
    v: np.ndarray
    force: np.ndarray
    reference: np.ndarray
    inverse_mass: np.ndarray
    displaced: np.ndarray
    moved: np.ndarray
    power: np.ndarray
    pushed: np.ndarray
    first: np.ndarray
    places: np.ndarray


class CardElements(NamedTuple):
    """Finite-strain blocks, arrays as rail_fem.fe.hexahedron.update_elements has them; computed : (k,) blocks that a
    step computes;  work : (n_blocks*N_WORK*LANES,) since it was last read [J];  volume : (n_blocks*LANES,) [m3]"""

    nodes: np.ndarray
    filled: np.ndarray
    material_of: np.ndarray
    state: np.ndarray
    back: np.ndarray
    computed: np.ndarray
    work: np.ndarray
    volume: np.ndarray


class CardSmallElements(NamedTuple):
    """Small-displacement blocks: geometry of rail_fem.fe.elastic.fixed_geometry."""

    nodes: np.ndarray
    material_of: np.ndarray
    geometry: np.ndarray


class CardGroups(NamedTuple):
    """Rigid groups and links between them, as rail_fem.fe.supports has them: replicated there, on the card here.

    members, first : nodes of each group;  partial : (threads, 3 groups) sums of the threads [N]
    motion : (g, 5, 3), see VELOCITY;  load_work : (g,);  upwards : (g,) buffer
    ends : (l, 2) groups of each link, -1 the ground;  links : (l, 6), see STIFFNESS
    """

    members: np.ndarray
    first: np.ndarray
    partial: np.ndarray
    motion: np.ndarray
    load_work: np.ndarray
    upwards: np.ndarray
    ends: np.ndarray
    links: np.ndarray


class CardContact(NamedTuple):
    """All of a contact.

    pairs : those of the rail's nodes, `split` of them, then those of the wheel's, over facets of both surfaces
    facet, corner : (m,) facets around each surface node and its corner there, from first (n+1,) on
    pair_of : (n,) the pair whose slave a node is, -1 none;  head (facets,), after (pairs,) : the pairs over each facet,
        -1 the end
    given : (pairs, 4) what pairs give to nodes, an amount and a vector;  push : (n, 4) what nodes have of that
    state : (pairs, 4) of rail_fem.fe.contact.pressure.take_active;  rows : (pairs, PROJECTION)
    watched : (w,) surface nodes;  local : (n,) their nodes;  region : (n_rail,) their bodies;
    room : (threads, 7, 3);  sums : (threads, N_COLUMNS);  step : (N_SUMS,) sums of the last step
    motion : (5,) of the wheel;  since : (12,), see FRICTION
    surface : (n, 6) positions and velocities for a search
    """

    pairs: Pairs
    nodes: Nodes
    law: Law
    found: NodalForces
    sliding: Sliding
    split: int
    first: np.ndarray
    facet: np.ndarray
    corner: np.ndarray
    pair_of: np.ndarray
    head: np.ndarray
    after: np.ndarray
    given: np.ndarray
    push: np.ndarray
    state: np.ndarray
    rows: np.ndarray
    watched: np.ndarray
    local: np.ndarray
    region: np.ndarray
    room: np.ndarray
    sums: np.ndarray
    step: np.ndarray
    motion: np.ndarray
    since: np.ndarray
    surface: np.ndarray


class CardStep(NamedTuple):
    """dt, damping of the small-displacement elements [s];  forces : nodal forces of all elements, the finite-strain
    ones' first (n*24*LANES,);  counters : (3,)"""

    dt: float
    damping: float
    nodes: CardNodes
    elements: CardElements
    small: CardSmallElements
    steels: MaterialTable
    groups: CardGroups
    contact: CardContact
    forces: np.ndarray
    counters: np.ndarray
