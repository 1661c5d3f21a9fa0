"""Where two bodies will touch: the contact zone, found before the boundary elements are laid.

The slave's face is sampled; gaps to the master are measured between the smooth profiles; the contact of half-planes
(logarithmic compliance along the face) is solved under the wanted load; with friction nothing slides in it. The samples
are then laid anew, fine where that contact is, until each patch holds a dozen of them. The estimate sets only element
sizes: the boundary elements solve for contact anywhere on the face, and a patch found outside the fine mesh is refined
and solved again.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bem.material import contact_modulus
from bem.plane.body import Body
from bem.plane.boundary import EquilibriumError
from bem.plane.coulomb import ContactState, ContactSystem, Control, ConvergenceError, local_motion, solve_step
from bem.plane.kelvin import displacement_integrals
from bem.plane.mesh import BoundaryMesh, Sizing, Zone, mesh_outline
from bem.plane.outline import CORNER, Outline
from bem.plane.pairing import BEHIND, PairingError, smooth_gap


@dataclass(frozen=True)
class EstimatedPatch:
    """Points (m, 2) [m] of both faces along a patch, its half-width [m], and the half-width [m] of a half ellipse as
    sharp as its peak."""

    points: np.ndarray
    half_width: float
    sharpness: float


NARROWEST = 1 / 16  # of a patch's half-width: sharper peaks are those of edges, which no element resolves


def peak_sharpness(points: np.ndarray, pressure: np.ndarray, half_width: float) -> float:
    """Half-width [m] of the half ellipse that is as sharp as the peak of pressures (n,) at points (n, 2) [m] along a
    patch.

    An ellipse of half-width a stays above sqrt(3) / 2 of its peak over a length a. A patch of several curvatures, or of
    conforming bodies, may peak over a small part of itself. Never less than NARROWEST of half_width, the patch's own.
    """
    peak, level = int(np.argmax(pressure)), np.sqrt(0.75) * pressure.max()
    along = np.r_[0.0, np.cumsum(np.hypot(*np.diff(points, axis=0).T))]
    before, after = np.flatnonzero(pressure[:peak] < level), peak + np.flatnonzero(pressure[peak:] < level)
    begin = _crossing(along, pressure, before[-1], before[-1] + 1, level) if len(before) else along[0]
    end = _crossing(along, pressure, after[0] - 1, after[0], level) if len(after) else along[-1]
    return float(np.clip(end - begin, NARROWEST * half_width, half_width))


def _crossing(along: np.ndarray, pressure: np.ndarray, i: int, j: int, level: float) -> float:
    return along[i] + (along[j] - along[i]) * (level - pressure[i]) / (pressure[j] - pressure[i])


def runs(flags: np.ndarray) -> list[np.ndarray]:
    """Indices of each run of true values."""
    where = np.flatnonzero(flags)
    return np.split(where, np.flatnonzero(np.diff(where) > 1) + 1) if len(where) else []


def face_corners(outline: Outline) -> np.ndarray:
    """Corners of the outline and ends of its edges (m, 2) [m]."""
    found = []
    for curves in outline.curves:
        for (curve, name), (before, before_name) in zip(curves, curves[-1:] + curves[:-1]):
            a, b = curve.direction(np.array([0.0]))[0], before.direction(np.array([before.length]))[0]
            turn = np.arctan2(b[0] * a[1] - b[1] * a[0], a @ b)
            if abs(turn) > CORNER or name != before_name:
                found.append(curve.points[0])
    return np.array(found).reshape(-1, 2)


def _half_plane_system(
    mesh: BoundaryMesh, nodes: np.ndarray, gap: np.ndarray, modulus: float, level: float
) -> ContactSystem:
    """Contact of uncoupled half-planes at nodes of a mesh: log(r / level) between them along both axes, whatever the
    face's shape."""
    column = mesh.places(nodes)
    e = np.flatnonzero((column[mesh.first] >= 0) & (column[mesh.last] >= 0))
    points, normals, n = mesh.middles[nodes], mesh.normals[nodes], len(nodes)
    first, last = column[mesh.first[e]], column[mesh.last[e]]
    log_r, _ = displacement_integrals(points[:, 0] + 1j * points[:, 1], mesh.start[e], mesh.end[e], first, last, n)
    mass = np.bincount(first, mesh.lengths[e] / 2, n) + np.bincount(last, mesh.lengths[e] / 2, n)
    normal = -2 / (np.pi * modulus) * (log_r - mass * np.log(level))
    zero = np.zeros((n, n))
    motion = local_motion(points, normals)
    return ContactSystem(gap, np.block([[normal, zero], [zero, normal]]), motion, motion.T * np.r_[mass, mass])


def _estimate_once(
    master: Body, slave: Body, control: Control, friction: float, size, reach: float
) -> list[EstimatedPatch]:
    mesh = mesh_outline(slave.outline, size)
    nodes = mesh.of_edge(slave.face)
    gap = smooth_gap(mesh.middles[nodes], mesh.normals[nodes], master.outline.edge_curves(master.face), reach, BEHIND)
    nodes, gap = nodes[np.isfinite(gap)], gap[np.isfinite(gap)]
    if len(nodes) < 2:
        raise PairingError(
            f"the slave's face {slave.face!r} does not look at the master's {master.face!r} within {reach:g} m: "
            "check the positions of the bodies, or raise reach"
        )
    level = 2 * max(master.outline.size, slave.outline.size)
    system = _half_plane_system(mesh, nodes, gap, contact_modulus(master.material, slave.material), level)
    pressed = (system.forces[:, : len(nodes)] != 0).any(axis=0)  # a node without an element on the face carries nothing
    state = _estimated_state(_of_nodes(system, pressed), control, friction)
    points = mesh.middles[nodes][pressed]
    feet = points + gap[pressed, None] * mesh.normals[nodes][pressed]
    found = []
    for run in runs(state.pressure > 0):
        around = slice(max(run[0] - 1, 0), run[-1] + 2)
        half = np.hypot(*np.diff(points[around], axis=0).T).sum() / 2
        found.append(
            EstimatedPatch(
                np.vstack([points[run], feet[run]]), half, peak_sharpness(points[around], state.pressure[around], half)
            )
        )
    return found


def _estimated_state(system: ContactSystem, control: Control, friction: float) -> ContactState:
    """With friction nothing slides; where that has no consistent states, as with rough faces, and the load allows it,
    everything does."""
    if friction > 0:
        try:
            return solve_step(system, control, np.inf)
        except ConvergenceError as failure:
            try:
                return solve_step(system, control, 0.0)
            except EquilibriumError:
                raise ConvergenceError(
                    f"the estimate of the contact zone, in which nothing slides: {failure}"
                ) from None
    return solve_step(system, control, 0.0)


def _of_nodes(system: ContactSystem, chosen: np.ndarray) -> ContactSystem:
    both = np.r_[chosen, chosen]
    return ContactSystem(
        system.gap[chosen], system.compliance[np.ix_(both, both)], system.motion[both], system.forces[:, both]
    )


def estimate_patches(
    master: Body, slave: Body, control: Control, friction: float, reach: float, near: np.ndarray, enough: int = 12
) -> list[EstimatedPatch]:
    """Patches of half-planes under a control, each resolved by at least `enough` samples; empty where nothing touches.

    near : (m, 2) [m] positions where the faces are nearest, sampled finely from the start so that no narrow patch is
        missed
    """
    start = [Zone(near, 1e-4 * slave.outline.size)] if len(near) else []
    size: object = Sizing(slave.outline.size / 60, start, 0.4)
    patches = []
    for _ in range(12):
        patches = _estimate_once(master, slave, control, friction, size, reach)
        if all(len(patch.points) >= 2 * enough for patch in patches):
            break
        size = Sizing(
            slave.outline.size / 30, [Zone(p.points, p.half_width / enough, 2 * p.half_width) for p in patches], 0.3
        )
    return patches


def sizing(outline: Outline, patches: list[EstimatedPatch], sizes: list[float], coarse: float, growth: float) -> Sizing:
    """Element sizes for a body: fine over each patch and half its width beyond, finer than coarse at corners."""
    zones = [Zone(patch.points, size, 0.5 * patch.half_width + 2 * size) for patch, size in zip(patches, sizes)]
    corners = face_corners(outline)
    if len(corners):
        zones.append(Zone(corners, coarse / 8))
    return Sizing(coarse, zones, growth)
