"""All results of a sweep's folder at once: by case and model, and as one table with what varies as columns."""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from rail_fem.files.atomic import csv_text
from rail_fem.files.markdown import markdown_table
from rail_fem.hierarchy import MODELS
from rail_fem.result.events import flights, stated_peaks
from rail_fem.result.quantities import REPORTED
from rail_fem.result.result import NAN, PassResult, Peak
from rail_fem.result.versions import needed
from rail_fem.scene.units import SHOWN
from rail_fem.sweeps.compare import core_seconds
from rail_fem.sweeps.parameters import Values, asked_values, shown_value, title_of, varied_keys, with_left_out
from rail_fem.sweeps.sweep_report import Results, results_below

# in every table, whether a model resolves it or not; further peaks follow them
FORCES = ("impact_on_wheel", "first_impact_on_nose", "largest_force", "largest_force_wing", "largest_force_nose")
PEAKS = dict.fromkeys(FORCES, "N")
STRAINS = ("worst_1000_wing", "worst_1000_nose", "block_wing", "block_nose", "integral_wing", "integral_nose")
AT, WORDS = ", x", "words of the warnings"  # columns: of a peak's position, of all warnings
DIGITS = 6  # of a number in the Markdown table


@dataclass(frozen=True)
class SweepResults:
    """Results by case and model: `sweep["case_02"]["rigid_hertz"]`.

    Parameters
    ----------
    results : mapping of str to mapping
        PassResult by case and model.
    unusable : tuple of str
        A sentence on each run that is left out.
    asked : mapping of str to mapping
        By case and model: keys of the case file and their values [SI].

    Examples
    --------
    >>> scene = rail_fem.load_case(rail_fem.example("nose_transfer")).scene
    >>> for speed in ("50 mph", "75 mph"):
    ...     rail_fem.solve("p2_formula", scene.replace(speed=speed)).save(f"speeds/{speed[:2]}/p2_formula")
    >>> sweep = rail_fem.load_sweep("speeds")
    >>> sweep.varied, [row["scene.speed [mph]"] for row in sweep.rows()]
    (['scene.speed'], [50.0, 75.0])
    """

    results: Results
    unusable: tuple[str, ...]
    asked: Mapping[str, Mapping[str, Values]] = field(default_factory=dict)

    def __getitem__(self, case: str) -> dict[str, PassResult]:
        if case not in self.results:
            raise KeyError(f"no case '{case}' in this sweep; it holds {', '.join(self.results)}")
        return self.results[case]

    def __iter__(self) -> Iterator[str]:
        return iter(self.results)

    def __len__(self) -> int:
        return len(self.results)

    def __repr__(self) -> str:
        runs = sum(map(len, self.results.values()))
        varied = f", {' and '.join(self.varied)} varied" if 0 < len(self.varied) < 4 else ""
        return f"<SweepResults: {len(self)} cases, {runs} runs, {len(self.unusable)} left out{varied}>"

    @property
    def varied(self) -> list[str]:
        """Keys of the case file that differ between the runs, e.g. "scene.speed"."""
        return varied_keys(values for of_case in self.asked.values() for values in of_case.values())

    def rows(self) -> list[dict[str, Any]]:
        """One row a run: case, model, what varies, axle load, peaks and where they are, transfer, flights from x to x,
        error estimates, cost, warnings; units in the names, NaN for what a model does not resolve. Sorted by what
        varies."""
        runs = [(case, result) for case, of_case in self.results.items() for result in of_case.values()]
        units = PEAKS | {name: peak.unit for _, result in runs for name, peak in stated_peaks(result).items()}
        varied = self.varied
        rows = [self._row(case, result, varied, units) for case, result in runs]
        order = {model: number for number, model in enumerate(MODELS)}
        return sorted(rows, key=lambda row: ([_order(row[title_of(key)]) for key in varied], order[row["model"]]))

    def _row(self, case: str, result: PassResult, varied: list[str], units: Mapping[str, str]) -> dict[str, Any]:
        asked = self.asked.get(case, {}).get(result.model, {})
        row: dict[str, Any] = {"case": case, "model": result.model}
        row |= {title_of(key): shown_value(key, asked.get(key, NAN)) for key in varied}
        scene = result.scene
        row |= {"speed [m/s]": scene.speed, "axle load [t]": scene.axle_load / 1e3}
        row |= {"static load [kN]": scene.static_wheel_load / 1e3}
        peaks = stated_peaks(result)
        for name, si in units.items():
            unit, factor = SHOWN.get(si, (si, 1.0))
            found = peaks.get(name, Peak(NAN, si))
            row |= {f"{name} [{unit}]": found.value * factor, f"{name}{AT} [mm]": found.x * 1e3}
        for name in STRAINS:
            unit, factor = SHOWN[REPORTED[name].unit]
            row[f"plastic_strain_{name} [{unit}]"] = REPORTED[name].of(result) * factor
        return row | {
            "transfer_x [mm]": result.transfer_x * 1e3,
            "flights [mm]": "; ".join(f"{f.x_start * 1e3:.1f} to {f.x_end * 1e3:.1f}" for f in flights(result)),
            "error estimate [%]": 100 * claimed_error(result),
            "core seconds": core_seconds(result),
            "warnings": len(result.warnings),
            WORDS: "; ".join(result.warnings),
        }

    def to_dataframe(self):
        """The rows as a pandas.DataFrame.

        Returns
        -------
        pandas.DataFrame

        Raises
        ------
        ModuleNotFoundError
            Where pandas is not installed.
        """
        with needed("pandas"):
            import pandas
        return pandas.DataFrame(self.rows())

    def to_xarray(self):
        """The rows as an xarray.Dataset over what varies and the model, where the cases are a grid of that, else over
        case and model; units in the attributes, those of the rows; NaN, or "", where there is no run.

        Returns
        -------
        xarray.Dataset

        Raises
        ------
        ModuleNotFoundError
            Where xarray is not installed.
        """
        with needed("xarray"):
            import xarray
        rows, keys = self.rows(), [title_of(key) for key in self.varied]
        values = {key: list(dict.fromkeys(row[key] for row in rows)) for key in keys}
        grid = math.prod(map(len, values.values())) == len(self)
        axes = (values if grid else {"case": list(self)}) | {"model": list(dict.fromkeys(row["model"] for row in rows))}
        places = [tuple(choices.index(row[axis]) for axis, choices in axes.items()) for row in rows]
        shape, dims = tuple(map(len, axes.values())), [_name(axis) for axis in axes]

        def table(column: str) -> tuple:
            numbers = all(isinstance(row[column], (int, float)) for row in rows)
            found = np.full(shape, NAN if numbers else "", dtype=float if numbers else object)
            for place, row in zip(places, rows):
                found[place] = row[column]
            return dims, found, {"units": column.partition(" [")[2].removesuffix("]"), "long_name": column}

        coordinates = {_name(axis): (_name(axis), choices, {"long_name": axis}) for axis, choices in axes.items()}
        return xarray.Dataset({_name(column): table(column) for column in rows[0] if column not in axes}, coordinates)

    def to_csv(self) -> str:
        """The rows as CSV; empty where a model does not resolve a quantity."""
        rows = self.rows()
        return csv_text([rows[0], *(["" if _is_nan(value) else value for value in row.values()] for row in rows)])

    def to_markdown(self) -> str:
        """What varies, and the peaks that any model resolves, as a table, without positions and words."""
        head, cells = self.shown("case")
        return "\n".join(markdown_table(head, cells)) + "\n"

    def shown(self, *left_out: str) -> tuple[list[str], list[list[str]]]:
        """A table of the rows, without positions, words and what no run has.

        Parameters
        ----------
        *left_out : str
            Columns that are not shown either.

        Returns
        -------
        head : list of str
        cells : list of list of str
        """
        rows = self.rows()
        without = lambda name: name in (*left_out, WORDS) or f"{AT} [" in name
        head = [name for name in rows[0] if not (without(name) or all(_is_nan(row[name]) for row in rows))]
        return head, [[_cell(row[name]) for name in head] for row in rows]


def claimed_error(result: PassResult) -> float:
    """What a run claims of its forces, relative: the sum of its estimates that are numbers; NaN without any. That of
    the pressures in patches is none of a force."""
    known = [abs(v) for name, v in result.error_estimate.items() if name != "pressure" and math.isfinite(v)]
    return sum(known) if known else NAN


def _name(column: str) -> str:
    """A column's name without its unit, as one word."""
    return column.partition(" [")[0].replace(AT, "_x").replace(" ", "_")


def _is_nan(value: Any) -> bool:
    return isinstance(value, float) and math.isnan(value)


def _order(value: Any) -> tuple[bool, Any, str]:
    """Numbers by size, then text, NaN last."""
    number = isinstance(value, (int, float)) and not _is_nan(value)
    return not number, value if number else 0.0, str(value)


def _cell(value: Any) -> str:
    if _is_nan(value):
        return "-"
    return f"{value:.{DIGITS}g}" if isinstance(value, float) else str(value)


def load_sweep(folder: Path | str) -> SweepResults:
    """Read every result below FOLDER/CASE/MODEL.

    Parameters
    ----------
    folder : Path or str
        Of a sweep.

    Returns
    -------
    SweepResults

    Raises
    ------
    FileNotFoundError
        Where there is none.

    Examples
    --------
    >>> scene = rail_fem.load_case(rail_fem.example("nose_transfer")).scene
    >>> rail_fem.solve("p2_formula", scene).save("sweep/case/p2_formula")
    >>> list(rail_fem.load_sweep("sweep"))
    ['case']
    """
    return sweep_below(Path(folder))


def sweep_below(folder: Path, known: Mapping[Path, PassResult] | None = None) -> SweepResults:
    """As load_sweep. known : folder -> what was read from it already"""
    results, unusable = results_below(folder, known=known)
    asked = {
        case: {model: asked_values(folder / case / model, result) for model, result in of_case.items()}
        for case, of_case in results.items()
    }
    keys = {key for of_case in asked.values() for values in of_case.values() for key in values}
    full = {
        case: {
            model: with_left_out(asked[case][model], result.scene.crossing, keys) for model, result in of_case.items()
        }
        for case, of_case in results.items()
    }
    return SweepResults(results, tuple(unusable), full)
