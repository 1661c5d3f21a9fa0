"""How good a hexahedral mesh is for explicit dynamics: shape, stable step, and the cells that limit it."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from geometry.meshing.cell_measures import cell_volume, edge_length, eigen_length, face_area, scaled_jacobian
from geometry.meshing.hexmesh import FoldedCellError, HexMesh

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
    edge, volume = edge_length(corner), cell_volume(corner)
    length = volume / face_area(corner).max(axis=1)
    return np.stack(
        [scaled_jacobian(corner), volume, length, edge.min(axis=1), edge.max(axis=1), eigen_length(corner)], axis=1
    )


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
