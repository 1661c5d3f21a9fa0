"""How good a hexahedral mesh is for explicit dynamics: shape, stable step, and the cells that limit it."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from geometry.meshing.hexmesh import FACES, FoldedCellError, HexMesh

# Corner k of a VTK hexahedron and its three neighbours in right-handed order.
CORNERS = np.array(
    [[0, 1, 3, 4], [1, 2, 0, 5], [2, 3, 1, 6], [3, 0, 2, 7], [4, 7, 5, 0], [5, 4, 6, 1], [6, 5, 7, 2], [7, 6, 4, 3]]
)
EDGES = np.array([[0, 1], [1, 2], [2, 3], [3, 0], [4, 5], [5, 6], [6, 7], [7, 4], [0, 4], [1, 5], [2, 6], [3, 7]])
WAVE_SPEED = 5900.0
LEAST_JACOBIAN = 0.1
CELLS_AT_A_TIME = 4096


@dataclass(frozen=True)
class MeshQuality:
    """Counts, worst cells and the cost of a mesh; print `report()`.

    counts               : dict of str to int: cells of each body, nodes, surface quads, clamped nodes
    worst_scaled_jacobian, worst_scaled_jacobian_at : least scaled Jacobian of all corners, and that cell's centre (3,)
        [m]
    shortest_edge, longest_edge : [m]
    worst_length         : least V / A_max of a cell [m]; worst_step = worst_length / wave_speed [s]
    worst_eigen_step     : least step by the eigenvalue bound of the one-point element [s], conservative by up to 0.58
    slowest              : (10,) cells with the least V / A_max; their centres (10, 3) [m], volumes (10,) [m3], aspects
        (10,)
    cost                 : cells / worst_step [1/s]: cell updates per second of simulated time
    """

    counts: dict[str, int]
    worst_scaled_jacobian: float
    worst_scaled_jacobian_at: np.ndarray
    shortest_edge: float
    longest_edge: float
    wave_speed: float
    worst_length: float
    worst_step: float
    worst_eigen_step: float
    slowest: np.ndarray
    slowest_centre: np.ndarray
    slowest_length: np.ndarray
    slowest_volume: np.ndarray
    slowest_aspect: np.ndarray
    cost: float

    def report(self) -> str:
        """The quality as text, lengths in mm and times in s."""
        mm = 1e3
        at = ", ".join(f"{v * mm:.1f}" for v in self.worst_scaled_jacobian_at)
        lines = [
            "mesh: " + ", ".join(f"{count} {name}" for name, count in self.counts.items()),
            f"worst scaled Jacobian {self.worst_scaled_jacobian:.3f} at ({at}) mm",
            f"edges {self.shortest_edge * mm:.3f} to {self.longest_edge * mm:.1f} mm",
            f"worst step {self.worst_step:.3e} s (V / A_max = {self.worst_length * mm:.3f} mm, wave speed"
            f" {self.wave_speed:.0f} m/s); eigenvalue bound {self.worst_eigen_step:.3e} s",
            f"cost {self.cost:.3e} cell updates per second of motion",
            "slowest cells: number, centre [mm], V / A_max [mm], volume [mm3], longest over shortest edge",
        ]
        sizes = self.slowest_length * mm, self.slowest_volume * mm**3, self.slowest_aspect
        for cell, centre, length, volume, aspect in zip(self.slowest, self.slowest_centre * mm, *sizes):
            lines.append(
                f"  {cell:8d}  ({centre[0]:8.1f}, {centre[1]:8.1f}, {centre[2]:8.1f})  {length:7.3f}  {volume:9.3f} "
                f" {aspect:6.2f}"
            )
        return "\n".join(lines)


def mesh_quality(mesh: HexMesh, wave_speed: float = WAVE_SPEED) -> MeshQuality:
    """Judge a mesh for explicit dynamics; wave_speed: dilatational wave speed [m/s] of the fastest material."""
    jacobian, volume, length, shortest, longest, eigen = over_cells(_measures, mesh.points, mesh.cells).T
    slowest = np.argsort(length, kind="stable")[:10].copy()  # not a view of all
    worst = jacobian.argmin()
    counts = {f"cells in {name}": int((mesh.region == i).sum()) for i, name in enumerate(mesh.region_names)}
    counts |= {"nodes": len(mesh.points), "surface quads": len(mesh.surface), "clamped nodes": len(mesh.clamp)}
    least, edges = float(length.min()), (float(shortest.min()), float(longest.max()))
    steps = wave_speed, least, least / wave_speed, float(eigen.min() / wave_speed)
    centres = cell_centres(mesh.points, mesh.cells[np.append(worst, slowest)])
    of_slowest = slowest, centres[1:], length[slowest], volume[slowest], longest[slowest] / shortest[slowest]
    cost = len(mesh.cells) * wave_speed / least
    return MeshQuality(counts, float(jacobian[worst]), centres[0], *edges, *steps, *of_slowest, cost)


def over_cells(measure: Callable[[np.ndarray], np.ndarray], points: np.ndarray, cells: np.ndarray) -> np.ndarray:
    """measure of the corners (k, 8, 3) of all cells (m, 8), some at a time: of all at once they are many times what the
    mesh takes. Its results (k, ...) in the order of the cells."""
    firsts = range(0, max(len(cells), 1), CELLS_AT_A_TIME)
    return np.concatenate([measure(points[cells[first : first + CELLS_AT_A_TIME]]) for first in firsts])


def cell_centres(points: np.ndarray, cells: np.ndarray) -> np.ndarray:
    """Means of the corners of each cell (m, 3) [m]."""
    return over_cells(lambda corner: corner.mean(axis=1), points, cells)


def _measures(corner: np.ndarray) -> np.ndarray:
    """Scaled Jacobian, volume, V / A_max, shortest and longest edge, length by the eigenvalue bound (m, 6)."""
    edge = np.linalg.norm(corner[:, EDGES[:, 1]] - corner[:, EDGES[:, 0]], axis=2)
    volume = cell_volume(corner)
    length = volume / face_area(corner).max(axis=1)
    return np.stack(
        [scaled_jacobian(corner), volume, length, edge.min(axis=1), edge.max(axis=1), eigen_length(corner)], axis=1
    )


def scaled_jacobian(corner: np.ndarray) -> np.ndarray:
    """Least over the 8 corners of det(e1, e2, e3) / (|e1| |e2| |e3|): (m,), 1 for a brick, <= 0 for a tangled cell.

    corner : (m, 8, 3) corner positions, VTK order
    """
    first, second, third = (corner[:, CORNERS[:, k]] - corner[:, CORNERS[:, 0]] for k in (1, 2, 3))
    squares = [np.einsum("mki,mki->mk", edge, edge) for edge in (first, second, third)]
    volume = np.einsum("mki,mki->mk", first, np.cross(second, third))
    return (volume / np.sqrt(squares[0] * squares[1] * squares[2])).min(axis=1)


def cell_volume(corner: np.ndarray) -> np.ndarray:
    """Exact volume [m3] of trilinear hexahedra (m, 8, 3): the divergence theorem over bilinear faces."""
    relative = corner - corner.mean(axis=1, keepdims=True)
    volume = np.zeros(len(corner))
    for face in FACES:
        a, b, c, d = (relative[:, i] for i in face)
        volume += np.einsum("ij,ij->i", np.cross(c - a, d - b), a + b + c + d) / 24
    return volume


def face_area(corner: np.ndarray) -> np.ndarray:
    """Areas [m2] of the six faces (m, 6) of hexahedra (m, 8, 3), half the cross product of the diagonals (exact for
    plane faces)."""
    face = corner[:, FACES]
    return 0.5 * np.linalg.norm(np.cross(face[:, :, 2] - face[:, :, 0], face[:, :, 3] - face[:, :, 1]), axis=2)


def mean_gradient(corner: np.ndarray) -> np.ndarray:
    """Volume mean of the shape function gradients (m, 8, 3) [1/m] of hexahedra (m, 8, 3): d V / d x_I / V (Flanagan and
    Belytschko 1981)."""
    gradient = np.zeros_like(corner)
    for face in FACES:
        p = corner[:, face]
        for i in range(4):
            following, opposite, preceding = p[:, (i + 1) % 4], p[:, (i + 2) % 4], p[:, (i + 3) % 4]
            gradient[:, face[i]] += (np.cross(following, opposite + preceding) + np.cross(opposite, preceding)) / 12
    return gradient / cell_volume(corner)[:, None, None]


def eigen_length(corner: np.ndarray, poisson: float = 0.3) -> np.ndarray:
    """Wave speed times the step bound 2 / omega_max [m] of the free one-point hexahedron with lumped mass: (m,).

    omega_max^2 = 8 / rho * largest eigenvalue of C (B B^T); C elastic with Poisson's ratio `poisson`, in units of
    lambda + 2 mu. A cube of side h gives 0.734 h (all three directions in phase), a bound for any mesh of such cells.
    In the principal axes of G = B^T B, with invariants I1 to I3, shear strains stand alone and below the others, whose
    eigenvalues are the roots of s^3 - I1 s^2 + (1 - r^2) I2 s - (1 - r)^2 (1 + 2 r) I3, r = nu / (1 - nu).
    """
    gradient = mean_gradient(corner)
    xx, yy, zz, yz, xz, xy = (
        np.einsum("mI,mI->m", gradient[:, :, i], gradient[:, :, j])
        for i, j in ((0, 0), (1, 1), (2, 2), (1, 2), (0, 2), (0, 1))
    )
    r = poisson / (1 - poisson)
    mean = (xx + yy + zz) / 3
    linear = (1 - r**2) * (xx * yy + yy * zz + zz * xx - yz**2 - xz**2 - xy**2)
    determinant = xx * (yy * zz - yz**2) - xy * (xy * zz - xz * yz) + xz * (xy * yz - xz * yy)
    p = mean**2 - linear / 3
    q = mean**3 - mean * linear / 2 + (1 - r) ** 2 * (1 + 2 * r) * determinant / 2
    angle = np.arctan2(np.sqrt(np.maximum(p**3 - q**2, 0.0)), q)
    largest = mean + 2 * np.sqrt(p) * np.cos(angle / 3)
    return 2 / np.sqrt(8 * largest)


def check_shapes(mesh: HexMesh, remedy: str) -> None:
    """Raise FoldedCellError where a cell's scaled Jacobian is below LEAST_JACOBIAN: which body, how bad, where, and the
    remedy."""
    jacobian = over_cells(scaled_jacobian, mesh.points, mesh.cells)
    worst = jacobian.argmin()
    if not jacobian[worst] >= LEAST_JACOBIAN:
        position = ", ".join(f"{v * 1e3:.1f}" for v in cell_centres(mesh.points, mesh.cells[[worst]])[0])
        count = int((~(jacobian >= LEAST_JACOBIAN)).sum())
        many = "" if count == 1 else f", and {count - 1} more"
        raise FoldedCellError(
            f"the {mesh.region_names[mesh.region[worst]]}'s mesh has a folded or flat cell (scaled Jacobian"
            f" {jacobian[worst]:.3f}) at ({position}) mm{many}: {remedy}"
        )
