"""Plastic flow that runs have left on the plan of a crossing that wears: before all wear, or by passes at its stops.

A new casting flows while it hardens, and wears afterwards: the first passes' flow is one field of depths, + into the
metal, negative where metal was pushed up, under the wear of all passes that follow. It does not go on growing here.

At stops the most frequent kind of pass runs by fe_full over the crossing as it is worn by then, on the steel that its
passes at the stop before have left; what it has lowered holds until the next stop. Other kinds of pass press nothing of
their own: where one of them presses deeper, it is not in the study.
"""

import hashlib
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from scipy.interpolate import LinearNDInterpolator, RegularGridInterpolator

from geometry.surfaces.bodies import BODIES
from rail_fem import hierarchy
from rail_fem.damage.crossing_site import CrossingPass, CrossingSite
from rail_fem.damage.groove import held_beyond
from rail_fem.damage.worn_surface import WornSurface
from rail_fem.passes.plastic_fields import ARCHIVE
from rail_fem.processes.progress import Progress
from rail_fem.result.quantities import reported
from rail_fem.result.result import load
from rail_fem.scene.scene import Scene
from rail_fem.settings.damage import ExplicitFlow
from rail_fem.settings.explicit import FeSettings

MODEL = "fe_full"
SAME = 1e-9  # relative, within which a study has come to a stop


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


@dataclass(frozen=True)
class ExplicitStops:
    """Where a study of `total` passes stops for passes of fe_full. settings : of these;  numerics : of each of them;
    folder : theirs;  identity : of the study"""

    settings: ExplicitFlow
    numerics: FeSettings
    total: float
    folder: Path
    identity: str

    @property
    def ends(self) -> list[float]:
        """Passes of the study after which the next stop comes, and all passes."""
        stops = np.arange(1, np.ceil(self.total / self.settings.every * (1 - SAME))) * self.settings.every
        return [*stops.tolist(), self.total]

    def folder_of(self, stop: int) -> Path:
        """Of a stop's passes, the first 0."""
        return self.folder / f"stop_{stop:03d}"

    def flowed(self, stop: int, site: CrossingSite, shape: WornSurface, say: Callable[[str], None]) -> CrossingSite:
        """The site with what the passes of a stop have left, which are made on a shape where they are not there yet.
        Errors: those of fe_full."""
        folder, one = self.folder_of(stop), most_frequent(site)
        if not (folder / "result.json").is_file():
            explicit: Any = hierarchy.load(MODEL)
            last = self.folder_of(stop - 1) if stop else None
            before = explicit.SteelBefore(last, shape.x, shape.y, shape.depth, self.identity)
            numerics = self.numerics.model_copy(update={"passes": self.settings.passes})
            words = f"{self.settings.passes} passes of {MODEL} after {stop * self.settings.every:.6g}: {one.label}"
            say(words)
            folder.mkdir(parents=True, exist_ok=True)
            with Progress(folder, title=words) as progress:
                result = explicit.solve_on(before, one.scene, numerics, folder, restart=True, progress=progress)
            result.save(folder)
        flow, _ = read_flow(folder, one.scene, site.grid)
        return replace(site, flow=flow)

    def rows(self, site: CrossingSite) -> list[dict[str, Any]]:
        """Of each stop: passes of the study before it, the kind of its explicit passes and between which x they tell
        their flow [m], deepest flow of wing and nose [m], impact of the last [N], and what that one has added to the
        integral of plastic strain in the nose [m3]."""
        found, before, kind = [], 0.0, most_frequent(site).label
        for stop in range(len(self.ends)):
            result = load(self.folder_of(stop))
            (wing, nose), (low, high) = read_flow(self.folder_of(stop), result.scene, site.grid)
            every = result.passes or (reported(result),)
            strain = [before, *(one.get("integral_nose", 0.0) for one in every)]
            row = {"passes": stop * self.settings.every, "kind": kind, "start": low, "end": high}
            row |= {"wing": float(wing.max()), "nose": float(nose.max()), "impact": every[-1]["impact_on_wheel"]}
            found.append(row | {"added": strain[-1] - strain[-2]})
            before = strain[-1]
        return found


def most_frequent(site: CrossingSite) -> CrossingPass:
    """The kind of pass with the largest share, the first of several, in the middle of its lateral scatter."""
    return replace(max(site.passes, key=lambda one: one.weight), shift=0.0)
