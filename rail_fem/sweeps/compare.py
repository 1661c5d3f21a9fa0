"""Results of one scene side by side: what each model costs, how far it is from a reference, what it says of itself."""

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from rail_fem.hierarchy import MODELS
from rail_fem.result.events import NEAR_END, force_peaks, settled_rows, stated_peaks
from rail_fem.result.quantities import FORCES, REPORTED
from rail_fem.result.result import NAN, PassResult, Peak, load
from rail_fem.result.runfolder import differences

# the formula's P2 is the force with which the wheel strikes, and it knows no bodies
IMPACT, FIRST_IMPACT = ("impact_on_wheel", "p2"), ("first_impact_on_nose", "first_impact_on_wing", "p2")
SHARE = "first impact on the body taking over"


class CompareError(ValueError):
    """Results that cannot be compared: which, why, what to do."""


@dataclass(frozen=True)
class ErrorMeasure:
    """How far a result is from the reference on their common path: `error(result, reference)` relative, NaN where one
    of them does not resolve
    it. forces : names of the peaks it is about;  reported : of what is no force, its name among
    rail_fem.result.quantities.REPORTED"""

    meaning: str
    error: Callable[[PassResult, PassResult], float]
    forces: tuple[str, ...] = ()
    reported: str = ""


def peak(result: PassResult, *names: str) -> float:
    """The first of these peaks that the result states, or its history shows (SI); NaN without any."""
    peaks = stated_peaks(result)
    return next((peaks[name].value for name in names if name in peaks), NAN)


@dataclass(frozen=True)
class CommonPath:
    """The part of the path [m] over which two results are compared: what both ran over after they had settled."""

    low: float
    high: float

    def holds(self, x: float) -> bool:
        """Whether x [m] lies on it."""
        return self.low <= x <= self.high

    @property
    def words(self) -> str:
        """Its ends in mm."""
        return f"{self.low * 1e3:.0f} to {self.high * 1e3:.0f}" if self.high > self.low else "none"


def common_path(result: PassResult, reference: PassResult) -> CommonPath:
    """A result without history (a formula) is compared over all of the reference's path."""
    paths = [x for one in (result, reference) if len(x := settled_rows(one)["x"])]
    return CommonPath(max((x.min() for x in paths), default=NAN), min((x.max() for x in paths), default=NAN))


def forces_on(result: PassResult, path: CommonPath) -> dict[str, Peak]:
    """Impacts and largest forces on this path; those of a formula are at the transfer, wherever that is."""
    if not len(result.history["x"]):
        return dict(result.peaks)
    scene, rows = result.scene, settled_rows(result)
    on = (rows["x"] >= path.low) & (rows["x"] <= path.high)
    there = {name: values[on] for name, values in rows.items()}
    return force_peaks(there, scene.direction_sign, scene.static_wheel_load, leg_end=scene.crossing.leg_end)


def of_force(meaning: str, *names: str) -> ErrorMeasure:
    """Relative difference of the first of these peaks that a result has, both taken on the common path."""

    def error(result: PassResult, reference: PassResult) -> float:
        path = common_path(result, reference)
        values = [
            next((found[name].value for name in names if name in found), NAN)
            for found in (forces_on(r, path) for r in (result, reference))
        ]
        return values[0] / values[1] - 1

    return ErrorMeasure(meaning, error, names)


def strain_error(result: PassResult, reference: PassResult) -> float:
    """Relative difference of the mean plastic strain of the nose's worst block, which has no history; NaN where one of
    the two blocks lies outside the common path."""
    path = common_path(result, reference)
    left, exact = (r.metal.get("nose") for r in (result, reference))
    if not (left and exact and path.holds(left["block"][0]) and path.holds(exact["block"][0])):
        return NAN
    return left["values"]["block"] / exact["values"]["block"] - 1


def accident(result: PassResult, reference: PassResult, *names: str) -> str:
    """Why a force on the common path may be an accident of it, for result or reference; "" where it is none."""
    path, moving = common_path(result, reference), [one for one in (result, reference) if len(one.history["x"])]
    stated = [one.peaks[name].x for one in moving for name in names if name in one.peaks]
    taken = [found[name].x for found in (forces_on(one, path) for one in moving) for name in names if name in found]
    if not all(map(path.holds, stated)):
        return "outside"
    return "at its end" if any(min(x - path.low, path.high - x) < NEAR_END for x in taken) else ""


def along(result: PassResult, x: np.ndarray) -> np.ndarray:
    """The history of the force at positions x (n,)."""
    order = np.argsort(result.history["x"], kind="stable")
    return np.interp(x, result.history["x"][order], result.history["force"][order])


def history_error(result: PassResult, reference: PassResult) -> float:
    """Relative L2 difference of the force's history over the common path; NaN where there is none."""
    path, x = common_path(result, reference), settled_rows(reference)["x"]
    x = x[(x >= path.low) & (x <= path.high)]
    if not len(x) or not len(result.history["x"]):
        return NAN
    exact, found = along(reference, x), along(result, x)
    return float(np.linalg.norm(found - exact) / np.linalg.norm(exact))


QUANTITIES: dict[str, ErrorMeasure] = {
    "impact on the wheel": of_force("impact on the wheel", *IMPACT),
    SHARE: of_force(f"{SHARE}, its share", *FIRST_IMPACT),
    "largest force": of_force(FORCES["largest_force"], "largest_force"),
    "largest wing force": of_force(FORCES["largest_force_wing"], "largest_force_wing"),
    "largest nose force": of_force(FORCES["largest_force_nose"], "largest_force_nose"),
    "history": ErrorMeasure("force history, relative L2", history_error),
    "strain": ErrorMeasure("mean plastic strain of the nose's worst 5 x 5 x 3 mm", strain_error, reported="block_nose"),
}


@dataclass(frozen=True)
class Comparison:
    """Results of one scene and the one that the others are held against."""

    reference: PassResult
    results: tuple[PassResult, ...]  # the least expensive first, the reference among them
    names: tuple[str, ...]

    def error(self, result: PassResult, quantity: str) -> float:
        """Relative; 0 for the reference itself, NaN where not resolved."""
        return QUANTITIES[quantity].error(result, self.reference)

    def _reported(self, quantity: str) -> str:
        """Under what name of REPORTED the reference has it; "" where it has not."""
        measure, peaks = QUANTITIES[quantity], self.reference.peaks
        return measure.reported or next((name for name in measure.forces if name in peaks and name in REPORTED), "")

    def bar(self, quantity: str) -> float:
        """The reference's own error bar, relative to its value; 0 where it claims none."""
        name = self._reported(quantity)
        bar = self.reference.error_bars.get(name, 0.0)
        return bar / abs(REPORTED[name].of(self.reference)) if bar else 0.0

    def form(self, quantity: str) -> float:
        """By what share of its value the reference's form moves a quantity; NaN where nothing is claimed."""
        name = self._reported(quantity)
        return abs(self.reference.form_bar(name) / REPORTED[name].of(self.reference)) if name else NAN

    def least_expensive_within(self, limit: float, quantity: str) -> int | None:
        """Index of the least expensive result whose error is at most `limit`, the reference's error bar added to it;
        None when only the reference is."""
        room = limit - self.bar(quantity)
        good = [
            i for i, r in enumerate(self.results) if r is not self.reference and abs(self.error(r, quantity)) <= room
        ]
        return good[0] if good else None


def core_seconds(result: PassResult) -> float:
    """Solve time on all ranks [s], by which models are ranked: a first run also compiles, and finds what is kept."""
    return result.cost.solve_time * result.cost.ranks


def result_folders(folders: list[Path]) -> list[Path]:
    """Folders of runs among or right below those given. Errors: CompareError for a folder without any."""
    found = []
    for folder in map(Path, folders):
        itself = (folder / "result.json").is_file()
        below = [folder] if itself else sorted(p.parent for p in folder.glob("*/result.json"))
        if not below:
            raise CompareError(
                f"{folder}: no result.json in it or right below it; give the folder of a run, or that of a"
                " case in a sweep"
            )
        found += below
    return list({path.resolve(): path for path in found}.values())


def compare(folders: list[Path], reference: Path | None = None) -> Comparison:
    """Load the results below `folders`; the reference is that of the most expensive model, or the one in folder
    `reference`.

    Errors: CompareError for failed or unreadable results, results of unlike scenes (with the keys that differ), fewer
    than two.
    """
    paths = result_folders([*folders, *([reference] if reference else [])])
    loaded = [(path, _load(path)) for path in paths]
    if len(loaded) < 2:
        raise CompareError(f"{paths[0]}: one result only, there is nothing to compare it with")
    loaded.sort(key=lambda pair: (core_seconds(pair[1]), str(pair[0])))
    order = list(MODELS)
    chosen = next((i for i, (path, _) in enumerate(loaded) if reference and path == Path(reference)), None)
    if chosen is None:
        chosen = max(range(len(loaded)), key=lambda i: (order.index(loaded[i][1].model), core_seconds(loaded[i][1])))
    _refuse_unlike_scenes(loaded, chosen)
    return Comparison(loaded[chosen][1], tuple(r for _, r in loaded), short_names([path for path, _ in loaded]))


def _load(path: Path) -> PassResult:
    try:
        result = load(path)
    except (ValueError, KeyError, TypeError) as error:
        raise CompareError(
            f"{path}: cannot be read by this program, another version of the scene or result may have written it"
            f" ({error}): run it again"
        ) from error
    if result.fault:
        raise CompareError(f"{path}: that run failed ({result.fault}): leave it out or run it again")
    if result.model not in MODELS:
        raise CompareError(f"{path}: model {result.model} is no model of this program ({', '.join(MODELS)})")
    return result


def _refuse_unlike_scenes(loaded: list[tuple[Path, PassResult]], chosen: int) -> None:
    there, reference = loaded[chosen]
    for path, result in loaded:
        unlike = differences(reference.scene.plain(), result.scene.plain())
        if unlike:
            said = (
                f"{path}: another scene than {there}, {len(unlike)} difference(s); errors between scenes mean nothing"
            )
            raise CompareError("\n  ".join([said, *unlike]))


def short_names(paths: list[Path]) -> tuple[str, ...]:
    """Names of the folders, with as many of those above them as tell each from the others."""
    parts = [path.resolve().parts[1:] for path in paths]
    endings = [[tuple(one[-k:]) for k in range(1, len(one) + 1)] for one in parts]
    taken = Counter(ending for one in endings for ending in one)
    return tuple("/".join(next((e for e in one if taken[e] == 1), one[-1])) for one in endings)
