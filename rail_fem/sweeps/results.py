"""All results of a sweep's folder at once, for Python users."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from rail_fem.output.result import NAN, PassResult
from rail_fem.sweeps.compare import core_seconds
from rail_fem.sweeps.sweep_report import Results, results_below

TABLE_PEAKS = {"first_impact": ("kN", 1e-3), "largest_force": ("kN", 1e-3), "largest_force_wing": ("kN", 1e-3), "largest_force_nose": ("kN", 1e-3),
               "plastic_strain_wing": ("%", 100.0), "plastic_strain_nose": ("%", 100.0)}  # fmt: skip


@dataclass(frozen=True)
class SweepResults:
    """Results by case and model: `sweep["case_02"]["rigid_hertz"]`. unusable : a sentence on each run that is left
    out"""

    results: Results
    unusable: tuple[str, ...]

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
        return f"<SweepResults: {len(self)} cases, {runs} runs, {len(self.unusable)} left out>"

    def to_dataframe(self):
        """One row a run: case, model, speed, static load, peaks, transfer, core seconds. Errors: ModuleNotFoundError
        where pandas is not installed."""
        import pandas

        return pandas.DataFrame(
            [self._row(case, result) for case, of_case in self.results.items() for result in of_case.values()]
        )

    @staticmethod
    def _row(case: str, result: PassResult) -> dict[str, object]:
        row = {
            "case": case,
            "model": result.model,
            "speed [m/s]": result.scene.speed,
            "static load [kN]": result.scene.static_wheel_load / 1e3,
        }
        for name, (unit, factor) in TABLE_PEAKS.items():
            row[f"{name} [{unit}]"] = result.peaks[name].value * factor if name in result.peaks else NAN
        return row | {
            "transfer_x [mm]": result.transfer_x * 1e3,
            "core seconds": core_seconds(result),
            "warnings": len(result.warnings),
        }


def load_sweep(folder: Path | str) -> SweepResults:
    """Read every result below DIR/CASE/MODEL. Errors: FileNotFoundError where there is none."""
    results, unusable = results_below(Path(folder))
    return SweepResults(results, tuple(unusable))
