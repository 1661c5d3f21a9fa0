"""Speed against error of a pass: one case at several element sizes, as a Markdown table.

    mpirun -n 2 python -m mpi4py -m rail_fem.studies.passage_size cases/nose_transfer.toml --sizes 3 2 1.5 --out
    runs/sizes

The error of a run is the relative L2 difference of its contact force to that of the finest size, over the path after
settling. A size whose result is in the folder already is not run again.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from mpi4py import MPI

from rail_fem.case.casefile import load_case
from rail_fem.models.fe_full import solve
from rail_fem.output.markdown import markdown_table
from rail_fem.output.progress import Progress
from rail_fem.output.quantities import REPORTED
from rail_fem.output.result import PassResult, load
from rail_fem.sweeps.compare import history_error

HEAD = (
    "element size [mm]",
    "elements",
    "steps",
    "wall time [s]",
    "updates/s/core [million]",
    "force history, L2 to finest",
    "first impact [kN]",
    "its error",
    "PEEQ of 5 x 5 x 3 mm, wing, nose [%]",
    "PEEQ integral, wing, nose [mm3]",
    "transfer x [mm]",
    "hourglass / internal",
)


def run_sizes(case_path: Path, sizes: list[float], folder: Path) -> list[PassResult]:
    """Results of the case at each size [m], coarse to fine; from the folder where it has them. Collective."""
    comm = MPI.COMM_WORLD
    case = load_case(case_path)
    results = []
    for size in sizes:
        target = folder / f"{size * 1e3:g}mm"
        done = comm.bcast((target / "result.json").is_file() if comm.rank == 0 else None)
        if not done:
            settings = case.runs["fe_full"].model_copy(update={"element_size": size, "error_twin": False})
            if comm.rank == 0:
                target.mkdir(parents=True, exist_ok=True)
            comm.barrier()
            with Progress(target, title=f"{size * 1e3:g} mm", active=comm.rank == 0) as progress:
                result = solve(case.scene, settings, target, False, progress)
            if comm.rank == 0:
                result.save(target)
        comm.barrier()
        results.append(load(target))
    return results


def table(results: list[PassResult]) -> str:
    """Markdown table, the last result is the reference."""
    finest = results[-1]
    rows: list[list[str]] = []
    for r in results:
        peaks, cost = r.peaks, r.cost
        nose = peaks["first_impact"].value
        blocks, integrals = (
            ", ".join(f"{factor * REPORTED[f'{name}_{body}'].of(r):.{digits}f}" for body in ("wing", "nose"))
            for name, factor, digits in (("block", 100.0, 2), ("integral", 1e9, 1))
        )
        hourglass = next(row["value"] for row in r.trust["rows"] if row["name"].startswith("hourglass energy, all"))
        last, best = r is finest, finest.peaks["first_impact"].value
        rows.append(
            [
                f"{r.settings['element_size'] * 1e3:g}",
                f"{cost.elements}",
                f"{cost.steps}",
                f"{cost.wall_time:.0f}",
                f"{cost.updates_per_second / cost.ranks / 1e6:.1f}",
                "reference" if last else f"{history_error(r, finest):.1%}",
                f"{nose / 1e3:.1f}",
                "-" if last else f"{nose / best - 1:+.1%}",
                blocks,
                integrals,
                f"{r.transfer_x * 1e3:.1f}",
                f"{hourglass:.1%}",
            ]
        )
    return "\n".join(markdown_table(HEAD, rows)) + "\n"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("case", type=Path)
    parser.add_argument("--sizes", type=float, nargs="+", default=[3.0, 2.0, 1.5], help="element sizes [mm]")
    parser.add_argument("--out", type=Path, required=True, help="folder of the results and of table.md")
    arguments = parser.parse_args()
    results = run_sizes(arguments.case, [size * 1e-3 for size in sorted(arguments.sizes, reverse=True)], arguments.out)
    if MPI.COMM_WORLD.rank == 0:
        text = table(results)
        (arguments.out / "table.md").write_text(text, encoding="utf-8")
        print(text)


if __name__ == "__main__":
    main()
