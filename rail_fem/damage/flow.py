"""Plastic flow before wear: the surface that a run of bem_plastic has left, on a crossing's plan.

A new casting flows while it hardens, and wears afterwards: the first passes' flow is one field of depths, + into the
metal, negative where metal was pushed up, under the wear of all passes that follow. It does not go on growing here.
"""

from __future__ import annotations

import hashlib
from pathlib import Path

import numpy as np
from scipy.interpolate import RegularGridInterpolator

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
        raise FlowError(
            f"{folder}: its run is of {result.scene.crossing.name} with other numbers: run bem_plastic anew"
        )
    low, high = (float(end(result.history["x"])) for end in (np.min, np.max))
    if low > grid[0][-1] or high < grid[0][0]:
        raise FlowError(
            f"{folder}: its run goes from x = {low * 1e3:.0f} to {high * 1e3:.0f} mm, the study's plan from"
            f" {grid[0][0] * 1e3:.0f} to {grid[0][-1] * 1e3:.0f}: run bem_plastic over the study's path"
        )
    x, y = np.meshgrid(*grid, indexing="ij")
    out = np.zeros((len(BODIES), *x.shape))
    with np.load(path) as stored:
        for b, body in enumerate(BODIES):
            if f"{body}_lowered" in stored:
                axes, lowered = (stored[f"{body}_x"], stored[f"{body}_y"]), np.asarray(stored[f"{body}_lowered"], float)
                field = RegularGridInterpolator(axes, lowered, bounds_error=False, fill_value=0.0)
                out[b] = field((x, y))
    return held_beyond(out, np.array([low, high]), grid[0]), (low, high)


def _archive(folder: Path) -> Path:
    path = Path(folder) / ARCHIVE
    if not path.is_file():
        raise FlowError(f"damage.flow: no {ARCHIVE} in {folder}: give the folder of a finished run of bem_plastic")
    return path
