"""Wearing in or ratchetting: finished runs of the same passes with different steels, side by side.

    rail-fem run cases/repeated_passes.toml --out runs/cyclic
    rail-fem run isotropic.toml --out runs/isotropic            the same without the tables "cyclic"
    rail-fem compare runs/isotropic runs/cyclic --passes nose --out passes

What a pass adds to the integral of the plastic strain falls from pass to pass by a factor; were this factor of the last
three passes to last, all further passes together would add what a geometric series does. Where it grows towards 1
nothing says that it ends. Plastic strain is cumulated: steel that flows to and fro adds to it and stays in shape. How
far the running surface has fallen, clear of the wheel, says whether the flow runs away in one direction.
"""

from pathlib import Path

import numpy as np

from rail_fem.result.result import NAN, PassResult, load
from rail_fem.show.panels import Panel
from rail_fem.show.table_and_figure import Table, publish

LAST = 3  # passes over which the factor is taken
PARTS = {"leg": "wing", "wing": "wing", "nose": "nose"}  # part of a crossing -> body whose steel it is of


def column(result: PassResult, name: str) -> np.ndarray:
    """(passes,) of a reported quantity [SI], NaN where a pass has none."""
    return np.array([report.get(name, NAN) for report in result.passes])


def added(result: PassResult, part: str = "nose") -> np.ndarray:
    """(passes,) of the integral of the plastic strain that each pass adds [m3]."""
    return np.diff(column(result, f"integral_{part}"), prepend=0.0)


def factors(growth: np.ndarray) -> tuple[float, float]:
    """Mean factor from pass to pass of the last LAST steps, and of the LAST before; NaN without as many."""
    mean = lambda end: (growth[end] / growth[end - LAST]) ** (1 / LAST) if end - LAST >= 0 else NAN
    return float(mean(len(growth) - 1)), float(mean(len(growth) - 1 - LAST))


def steel_of(result: PassResult, part: str = "nose") -> str:
    """The steel's law in a few words."""
    material = getattr(result.scene.materials, PARTS[part])
    if material.cyclic is None:
        return f"{material.grade}, {material.steel().hardening} hardening"
    mixing = " to ".join(f"{value:g}" for value in sorted({*material.steel().cyclic.mixing}))
    return f"{material.grade}, {len(material.cyclic.modulus)} back stresses, mixing {mixing}"


def falls(folder: Path, result: PassResult, part: str = "nose") -> np.ndarray:
    """(passes,) largest fall of the running surface after each pass [m], NaN where its folder is not there."""
    out = np.full(len(result.passes), np.nan)
    for k in range(len(out)):
        own = folder if k == len(out) - 1 else folder / f"pass_{k + 1:04d}"
        metal = load(own).metal if (own / "result.json").is_file() else {}
        fall = metal.get(part, {}).get("surface", {}).get("fall", [])
        out[k] = max(fall, default=np.nan)
    return out


def read(folders: list[Path]) -> list[PassResult]:
    """Finished runs. Errors: ValueError for one of a single pass or that failed; those of result.load."""
    results = [load(folder) for folder in folders]
    for folder, result in zip(folders, results):
        if len(result.passes) < 2:
            raise ValueError(
                f"{folder}: {len(result.passes)} passes on the same steel; give a run with passes = 2 or more"
            )
    return results


def table(results: list[PassResult], fallen: list[np.ndarray], part: str = "nose") -> Table:
    """What each pass did, and how the growth falls. fallen : of each run, see `falls`."""
    rows = []
    for result, fall in zip(results, fallen):
        growth, (last, before) = added(result, part), factors(added(result, part))
        rest = f"{1e9 * growth[-1] * last / (1 - last):.0f}" if last < 1 - 1e-6 else "no end"
        block, force = column(result, f"block_{part}"), column(result, f"largest_force_{part}")
        rows.append(
            {
                f"steel of the {part}": steel_of(result, part),
                "passes": f"{len(growth)}",
                "largest force on it [kN]": ", ".join(f"{value / 1e3:.0f}" for value in force),
                "worst 5 x 5 x 3 mm after the first, last [%]": f"{100 * block[0]:.1f}, {100 * block[-1]:.1f}",
                "added by each [mm3]": ", ".join(f"{1e9 * value:.0f}" for value in growth),
                "factor a pass, before and last": f"{before:.2f}, {last:.2f}",
                "all further passes, were it to last [mm3]": rest,
                "surface fallen by [um]": ", ".join(f"{1e6 * value:.0f}" for value in fall),
            }
        )
    return Table.of(rows)


def panels(results: list[PassResult], fallen: list[np.ndarray], part: str = "nose") -> list[Panel]:
    """Force, plastic strain so far, what each pass adds to it, and the fall of the surface, over the number of the
    pass."""
    asked = {
        f"largest force on the {part} [kN]": [column(r, f"largest_force_{part}") / 1e3 for r in results],
        "PEEQ, mean of the worst 5 x 5 x 3 mm [%]": [100 * column(r, f"block_{part}") for r in results],
        "integral of PEEQ, added by the pass [mm\u00b3]": [1e9 * added(r, part) for r in results],
        "largest fall of the surface [\u00b5m]": [1e6 * fall for fall in fallen],
    }
    names = [steel_of(result, part) for result in results]
    over = lambda values: {name: (np.arange(1, len(y) + 1), y, "o-") for name, y in zip(names, values)}
    return [Panel("pass", words, over(values)) for words, values in asked.items()]


def compare_passes(runs: list[Path], part: str, out: Path | None) -> None:
    """Table and figure. part : of the crossing. Errors: ValueError for another part, those of `read`; OSError."""
    if part not in PARTS:
        raise ValueError(f"--passes {part}: choose from {', '.join(PARTS)}")
    results = read(runs)
    fallen = [falls(folder, result, part) for folder, result in zip(runs, results)]
    drawn = panels(results, fallen, part)
    publish("passes", out, [table(results, fallen, part)], drawn, f"Passes over the same {part}")
