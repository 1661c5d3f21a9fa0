"""Plastic flow before wear: the surface that a run of bem_plastic or fe_full has left, on a crossing's plan.

A new casting flows while it hardens, and wears afterwards: the first passes' flow is one field of depths, + into the
metal, negative where metal was pushed up, under the wear of all passes that follow. It does not go on growing here.
"""

import hashlib
from collections.abc import Callable
from pathlib import Path

import numpy as np
from scipy.interpolate import LinearNDInterpolator, RegularGridInterpolator

from geometry.surfaces.bodies import BODIES
from rail_fem.damage.groove import held_beyond
from rail_fem.passes.plastic_fields import ARCHIVE
from rail_fem.result.result import load
from rail_fem.scene.scene import Scene


class FlowError(ValueError):
    """A run whose plastic flow cannot come before this wear: which, why, what to do."""


def flow_digest(folder: Path) -> str:
    """SHA-256 of the run's surfaces. Errors: FlowError."""
    return hashlib.sha256(_archive(folder).read_bytes()).hexdigest()


def read_flow(
    folder: Path, scene: Scene, grid: tuple[np.ndarray, np.ndarray]
) -> tuple[np.ndarray, tuple[float, float]]:
    """(2, m, n) depths [m] of wing and nose at x (m,), y (n,) [m], linear between the run's cells, and where the run
    began and ended [m]: beyond it its last sections go on, for its groove ends in a ramp that no wheel would make.

    Errors: FlowError for a run of another crossing or model, or one that lies beside the plan.
    """
    path, result = _archive(folder), load(folder)
    if result.scene.crossing.plain() != scene.crossing.plain():
        raise FlowError(f"{folder}: its run is of {result.scene.crossing.name} with other numbers: run its model anew")
    with np.load(path) as stored:
        archive = dict(stored)
    low, high = map(float, archive.get("pressed", (result.history["x"].min(), result.history["x"].max())))
    if low > grid[0][-1] or high < grid[0][0]:
        raise FlowError(
            f"{folder}: its run goes from x = {low * 1e3:.0f} to {high * 1e3:.0f} mm, the study's plan from"
            f" {grid[0][0] * 1e3:.0f} to {grid[0][-1] * 1e3:.0f}: run its model over the study's path"
        )
    x, y = np.meshgrid(*grid, indexing="ij")
    out = np.zeros((len(BODIES), *x.shape))
    for b, body in enumerate(BODIES):
        if archive.get(f"{body}_lowered", np.zeros(0)).size:
            out[b] = _field(archive, body)((x, y))
    return held_beyond(out, np.array([low, high]), grid[0]), (low, high)


def _field(archive: dict[str, np.ndarray], body: str) -> Callable:
    """Depth [m] at x, y by what a run of bem_plastic has on its cells, or fe_full at its surface's nodes; 0 beside."""
    lowered = np.asarray(archive[f"{body}_lowered"], float)
    if f"{body}_at" not in archive:
        axes = archive[f"{body}_x"], archive[f"{body}_y"]
        return RegularGridInterpolator(axes, lowered, bounds_error=False, fill_value=0.0)
    return LinearNDInterpolator(archive[f"{body}_at"], lowered, fill_value=0.0, rescale=True)


def _archive(folder: Path) -> Path:
    path = Path(folder) / ARCHIVE
    if not path.is_file():
        raise FlowError(
            f"damage.flow: no {ARCHIVE} in {folder}: give the folder of a finished run of bem_plastic or fe_full"
        )
    return path
