"""Elements of a linear elastic body of revolution in rings: a section element's constants are read once for an arc of
elements, whose nodes lie in lines along it; elements beside them take their nodes from memory in the same round.

Total form, no state, forces of rail_fem.fe.elastic to round-off. In the frame of the middle of an element (t along the
arc, y along the axis, n to the axis) half of the components of its modes (rail_fem.fe.trilinear) are 0 and the others
are the section's times c or w, cosine and minus sine of half the angle between its planes. With m0, m1, m2, m3 the
modes 1, xi, eta, xi eta of a section element, of height n = c rho and length t = w zeta rho:
    du/dt = (o1 m0 + o2 m2 + o3 m1) / w   of half the difference between the planes,
    du/dy = p1 m1 + p2 m2 + p3 m3,   du/dn = (q1 m1 + q2 m2 + q3 m3) / c   of their mean,
and so for the hourglass amplitudes; p, q, o are the section's. Nodal forces follow as the transpose.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from rail_fem.fe.elastic import add_elastic_force
from rail_fem.fe.finite_strain import add_elastic
from rail_fem.fe.lanes import compiled, inlined
from rail_fem.fe.state import HOURGLASS_STIFFNESS, LAME, LANES, SHEAR
from rail_fem.fe.trilinear import combine

_W = LANES
EQUAL = 1e-12  # of positions that are the same about the axis [m]
ROUNDED = 12  # decimals of the angles by which arcs are the same [rad]
LINE = 3 * _W  # numbers of a line of nodes in the scratch vectors: component, plane
N_SECTION = 19  # see `_sections`
N_ARC = 9  # see `_arc`
ROW = (
    _W + 8
)  # of the scratch of a block: 12 rows of modes, 12 of forces on each element's first planes, 12 on the others
SECTION_MODES = np.array([[1, 1, 1, 1], [-1, 1, 1, -1], [-1, -1, 1, 1], [1, -1, 1, -1]]) / 4


class Rings(NamedTuple):
    """Arcs of at most LANES - 1 elements; all in an arc stand between the same planes.

    nodes, places : (k,) nodes of all lines, ascending, for memory gives what lies in a row many times faster than what
        does not; and where each stands in the scratch vectors (n_lines*LINE,). The nodes of elements outside rings
        fill lines of their own: outside : (m, 8) where these stand
    lines : (n_blocks, 4) where the lines of a section element stand there;  sections : (n_blocks, N_SECTION)
    arcs : (n_arcs, N_ARC*LANES);  arc_of : (n_blocks,)
    u, f : scratch vectors, an eighth of the displacement and the force of the lines; f is 0 between calls
    """

    nodes: np.ndarray
    places: np.ndarray
    lines: np.ndarray
    sections: np.ndarray
    arcs: np.ndarray
    arc_of: np.ndarray
    outside: np.ndarray
    u: np.ndarray
    f: np.ndarray

    @property
    def SCRATCH(self) -> tuple[str, ...]:
        """As rail_fem.fe.saved_state has it."""
        return "u", "f"


def find_rings(
    points: np.ndarray, cells: np.ndarray, material: np.ndarray, rows: np.ndarray, axis: tuple[float, float]
) -> tuple[Rings, np.ndarray]:
    """The cells that lie in rings about an axis along y, and which they are (m,) bool.

    points : (n, 3) [m];  cells : (m, 8) VTK order;  material : (m,) row of `rows`;  axis : its x and z [m].
    Rank-local.
    """
    in_ring = np.zeros(len(cells), bool)
    groups: dict[tuple, list[np.ndarray]] = {}
    x, z = points[:, 0] - axis[0], axis[1] - points[:, 2]
    radius, angle = np.hypot(x, z), np.arctan2(x, z)
    for chain in _chains(cells, np.flatnonzero(_swept(radius, angle, points[:, 1], cells))):
        in_ring[chain] = True
        for piece in np.array_split(chain, -(-len(chain) // (_W - 1))):
            planes = angle[[cells[piece[0], 0], *cells[piece, 4]]]
            groups.setdefault((material[piece[0]], *np.round(planes, ROUNDED)), []).append(piece)
    nodes, places, lines, sections, arcs, count = [], [], [], [], [], 0
    for (row, *_), pieces in groups.items():
        corners = np.array([[cells[piece[0], :4], *cells[piece, 4:]] for piece in pieces])  # (pieces, planes, 4) nodes
        every = corners.transpose(0, 2, 1).reshape(-1, corners.shape[1])
        of_lines, line = np.unique(every, axis=0, return_inverse=True)
        nodes.append(of_lines.ravel())
        starts = LINE * (count + np.arange(len(of_lines)))
        places.append((starts[:, None] + np.arange(every.shape[1])).ravel())
        lines.append(starts[line.reshape(-1, 4)])
        sections.append(_sections(-radius[corners[:, 0]], points[corners[:, 0], 1], rows[row]))
        arcs.append(_arc(angle[corners[0, :, 0]]))
        count += len(of_lines)
    others, which = np.unique(cells[~in_ring], return_inverse=True)
    beside = np.arange(len(others))
    beside = LINE * (count + beside // _W) + beside % _W
    nodes.append(others)
    places.append(beside)
    count += -(-len(others) // _W)
    node, place = (np.concatenate([np.empty(0), *part]).astype(np.uint32) for part in (nodes, places))
    order = np.argsort(node, kind="stable")
    return Rings(
        node[order],
        place[order],
        np.concatenate([np.empty((0, 4)), *lines]).astype(np.uint32),
        np.concatenate([np.empty((0, N_SECTION)), *sections]),
        np.array(arcs).reshape(-1, N_ARC * _W),
        np.repeat(np.arange(len(lines)), [len(part) for part in lines]),
        beside[which].reshape(-1, 8).astype(np.uint32),
        np.zeros(LINE * count),
        np.zeros(LINE * count),
    ), in_ring


def _swept(radius: np.ndarray, angle: np.ndarray, across: np.ndarray, cells: np.ndarray) -> np.ndarray:
    """Cells (m,) bool whose last four nodes are the first four, turned about the axis from one plane to another."""
    near, far = cells[:, :4], cells[:, 4:]
    alike = [(np.abs(of[near] - of[far]) < EQUAL).all(axis=1) for of in (radius, across)]
    plane = [(radius[face] * np.abs(angle[face] - angle[face[:, :1]]) < EQUAL).all(axis=1) for face in (near, far)]
    return np.logical_and.reduce([*alike, *plane])


def _chains(cells: np.ndarray, swept: np.ndarray) -> list[np.ndarray]:
    """Swept cells (k,) in runs in which the last four nodes of each are the first four of the next."""
    near, far = ([tuple(face) for face in cells[swept, part].tolist()] for part in (slice(4), slice(4, 8)))
    owner, reached, out = dict(zip(near, range(len(swept)))), set(far), []
    for start in (face for face in near if face not in reached):
        run = [owner[start]]
        while (following := owner.get(far[run[-1]])) is not None:
            run.append(following)
        out.append(swept[run])
    return out


def _sections(rho: np.ndarray, y: np.ndarray, row: np.ndarray) -> np.ndarray:
    """Constants (k, N_SECTION) of section elements: p1 p2 p3, q1 q2 q3, o1 o2 o3, rho1 rho2 rho3, y3, volume over
    8 w c, hourglass stiffness along y, n and t, Lame's constants.

    rho, y : (k, 4) minus radius and position along the axis [m];  row : of the material
    """
    (rho0, rho1, rho2, rho3), (_, y1, y2, y3) = SECTION_MODES @ rho.T, SECTION_MODES @ y.T
    third = 1.0 / 3.0
    p = np.array([rho2 * rho0 + rho3 * rho1 * third, -rho0 * rho1 - rho2 * rho3 * third, (rho2**2 - rho1**2) * third])
    q = np.array([-y2 * rho0 - y3 * rho1 * third, rho0 * y1 + rho2 * y3 * third, (y1 * rho1 - y2 * rho2) * third])
    o = np.array([y1 * rho2 - y2 * rho1, (y3 * rho2 - rho3 * y2) * third, (y1 * rho3 - rho1 * y3) * third])
    modes_y, modes_n, modes_t = np.array([y1, y2, y3]), np.array([rho1, rho2, rho3]), np.array([rho0, rho2, rho1])
    volume = third * (modes_y * p + modes_n * q + modes_t * o).sum(axis=0)
    stiffness = [row[HOURGLASS_STIFFNESS] * (of**2).sum(axis=0) / volume for of in (p, q, o)]
    elastic = [np.full(len(rho), row[k]) for k in (LAME, SHEAR)]
    return np.array([*p / volume, *q / volume, *o / volume, *modes_n, y3, volume, *stiffness, *elastic]).T


def _arc(planes: np.ndarray) -> np.ndarray:
    """What the elements of an arc have of their own (N_ARC*LANES,): cosine and sine of the middle, 1/w, 1/c, w c, w, c,
    w/c, c/w; the last six 0 beyond the last element. planes : angles (k+1,) [rad]"""
    out, middle, half = np.zeros((N_ARC, _W)), 0.5 * (planes[1:] + planes[:-1]), 0.5 * np.diff(planes)
    c, w = np.cos(half), -np.sin(half)
    out[:, : len(half)] = np.cos(middle), np.sin(middle), 1 / w, 1 / c, w * c, w, c, w / c, c / w
    return out.ravel()


@inlined
def turn(c, s, u):
    """Components along x, y, z -> along t, y, n of the frame turned by the angle of cosine c and sine s."""
    return c * u[0] + s * u[2], u[1], c * u[2] - s * u[0]


@inlined
def sum_and_difference(s, mode, e):
    """A mode on the two planes of lane e: its sum and its difference."""
    k = 3 * mode * ROW + e
    a, b = (s[k], s[k + ROW], s[k + 2 * ROW]), (s[k + 1], s[k + ROW + 1], s[k + 2 * ROW + 1])
    return combine(1.0, b, 1.0, a), combine(1.0, b, -1.0, a)


@inlined
def linear(a, u, b, v, c, w):
    """a u + b v + c w, vectors u, v, w."""
    return a * u[0] + b * v[0] + c * w[0], a * u[1] + b * v[1] + c * w[1], a * u[2] + b * v[2] + c * w[2]


@inlined
def put(s, k, e, low, high):
    """Forces of lane e on mode k of its first plane and of its second, the latter under the plane's number."""
    first, second = (12 + 3 * k) * ROW + e, (24 + 3 * k) * ROW + e + 1
    for i in range(3):
        s[first + i * ROW] = low[i]
        s[second + i * ROW] = high[i]


@inlined
def plane_modes(u, a, b, c, d, s, row):
    """One component of the modes of the planes of a section element whose lines start at a, b, c, d in u."""
    for e in range(_W):
        u0, u1, u2, u3 = u[a + e], u[b + e], u[c + e], u[d + e]
        s10, d10, s23, d23 = u1 + u0, u1 - u0, u2 + u3, u2 - u3
        s[row + e], s[row + 3 * ROW + e] = s23 + s10, d23 + d10
        s[row + 6 * ROW + e], s[row + 9 * ROW + e] = s23 - s10, d23 - d10


@inlined
def arc_forces(s, own, arc):
    """Modes of the planes of a block, an eighth of them, -> forces on them. s : (36*ROW,), own : (N_SECTION,), arc :
    (N_ARC*LANES,)"""
    p1, p2, p3, q1, q2, q3, o1, o2, o3 = own[0], own[1], own[2], own[3], own[4], own[5], own[6], own[7], own[8]
    rho1, rho2, rho3, y3, volume, lame, shear = own[9], own[10], own[11], own[12], own[13], own[17], own[18]
    for e in range(_W):
        mean0, half0 = sum_and_difference(s, 0, e)
        mean1, half1 = sum_and_difference(s, 1, e)
        mean2, half2 = sum_and_difference(s, 2, e)
        mean3, half3 = sum_and_difference(s, 3, e)
        along = linear(o1, half0, o2, half2, o3, half1)
        across = linear(p1, mean1, p2, mean2, p3, mean3)
        inward = linear(q1, mean1, q2, mean2, q3, mean3)
        wc, w, c = arc[4 * _W + e], arc[5 * _W + e], arc[6 * _W + e]
        k = own[14] * wc + own[15] * arc[7 * _W + e] + own[16] * arc[8 * _W + e]
        h1, h2 = combine(k, half2, -k * rho2, along), combine(k, half1, -k * rho1, along)
        h4, h3 = combine(k, half3, -k * rho3, along), linear(k, mean3, -k * y3, across, -k * rho3, inward)
        cosine, sine = arc[e], arc[_W + e]
        t, y, n = turn(cosine, sine, along), turn(cosine, sine, across), turn(cosine, sine, inward)
        a, b = arc[2 * _W + e], arc[3 * _W + e]
        rows = ((a * t[0], y[0], b * n[0]), (a * t[1], y[1], b * n[1]), (a * t[2], y[2], b * n[2]))
        xx, yy, zz, yz, xz, xy = add_elastic((0.0, 0.0, 0.0, 0.0, 0.0, 0.0), rows, volume, lame, shear)
        t = combine(1.0, turn(cosine, -sine, (c * xx, c * xy, c * xz)), -1.0, linear(rho2, h1, rho1, h2, rho3, h4))
        y = combine(1.0, turn(cosine, -sine, (wc * xy, wc * yy, wc * yz)), -y3, h3)
        n = combine(1.0, turn(cosine, -sine, (w * xz, w * yz, w * zz)), -rho3, h3)
        force1, other1 = combine(p1, y, q1, n), combine(o3, t, 1.0, h2)
        force2, other2 = combine(p2, y, q2, n), combine(o2, t, 1.0, h1)
        force3 = linear(p3, y, q3, n, 1.0, h3)
        put(s, 0, e, (-o1 * t[0], -o1 * t[1], -o1 * t[2]), (o1 * t[0], o1 * t[1], o1 * t[2]))
        put(s, 1, e, combine(1.0, force1, -1.0, other1), combine(1.0, force1, 1.0, other1))
        put(s, 2, e, combine(1.0, force2, -1.0, other2), combine(1.0, force2, 1.0, other2))
        put(s, 3, e, combine(1.0, force3, -1.0, h4), combine(1.0, force3, 1.0, h4))


@inlined
def add_to_lines(s, row, f, a, b, c, d):
    """One component of the forces of a block on its planes, added to the four lines of f. Two loops: vector code asks
    first whether lines overlap, which it does for two of them but not for four."""
    low, high = row + 12 * ROW, row + 24 * ROW
    for e in range(_W):
        m0, m1 = s[low + e] + s[high + e], s[low + 3 * ROW + e] + s[high + 3 * ROW + e]
        m2, m3 = s[low + 6 * ROW + e] + s[high + 6 * ROW + e], s[low + 9 * ROW + e] + s[high + 9 * ROW + e]
        f[a + e] += m0 - m2 - (m1 - m3)
        f[b + e] += m0 - m2 + (m1 - m3)
    for e in range(_W):
        m0, m1 = s[low + e] + s[high + e], s[low + 3 * ROW + e] + s[high + 3 * ROW + e]
        m2, m3 = s[low + 6 * ROW + e] + s[high + 6 * ROW + e], s[low + 9 * ROW + e] + s[high + 9 * ROW + e]
        f[c + e] += m0 + m2 + (m1 + m3)
        f[d + e] += m0 + m2 - (m1 + m3)


@inlined
def take_lines(x, reference, v, damping, rings):
    """The displacement x - reference + damping v, (3 n,) vectors, of all lines -> u. Rank-local."""
    u, nodes, places = rings.u, rings.nodes, rings.places
    for k in range(nodes.size):
        i, at = 3 * nodes[k], places[k]
        u[at] = 0.125 * (x[i] - reference[i] + damping * v[i])
        u[at + _W] = 0.125 * (x[i + 1] - reference[i + 1] + damping * v[i + 1])
        u[at + 2 * _W] = 0.125 * (x[i + 2] - reference[i + 2] + damping * v[i + 2])


@inlined
def add_ring_force(rings):
    """Internal force of the elements in rings at u, added to f. Rank-local. Allocates only its block buffer."""
    u, f, s = rings.u, rings.f, np.zeros(36 * ROW)
    for block in range(rings.arc_of.size):
        lines = rings.lines[block]
        a, b, c, d = lines[0], lines[1], lines[2], lines[3]
        for i in range(3):
            plane_modes(u, a + i * _W, b + i * _W, c + i * _W, d + i * _W, s, i * ROW)
        arc_forces(s, rings.sections[block], rings.arcs[rings.arc_of[block]])
        for i in range(3):
            add_to_lines(s, i * ROW, f, a + i * _W, b + i * _W, c + i * _W, d + i * _W)


@compiled
def find_line_forces(x, reference, v, damping, rings, places, filled, material_of, materials, geometry):
    """Internal forces f at the displacement x - reference + damping v, (3 n,) vectors, of the elements in rings and of
    those beside them, blocks of rail_fem.fe.elastic.add_elastic_force. Rank-local."""
    take_lines(x, reference, v, damping, rings)
    add_ring_force(rings)
    add_elastic_force(rings.u, places, filled, material_of, materials, geometry, rings.f)


@compiled
def take_energy(rings):
    """Half the work [J] of the forces f of all lines on the displacement there, f back to 0. Rank-local."""
    u, f, energy = rings.u, rings.f, 0.0
    for at in rings.places:
        for component in range(3):
            k = at + component * _W
            energy += 4.0 * u[k] * f[k]  # u is an eighth
            f[k] = 0.0
    return energy


@compiled
def give_lines(rings, force):
    """Minus the forces f of all lines, added to `force` (3 n,). Rank-local."""
    f, nodes, places = rings.f, rings.nodes, rings.places
    for k in range(nodes.size):
        i, at = 3 * nodes[k], places[k]
        for component in range(3):
            force[i + component] -= f[at + component * _W]
            f[at + component * _W] = 0.0
