"""Performance of the explicit solver's hot paths on this machine, as a table.

    python -m rail_fem.studies.kernel_speed --out bench.md --out bench.json

Each is the fastest of several repeats, for other programs on a machine only ever add time. Kernels count processor
time, whole steps and ranks the wall clock. `--ranks 1` leaves the comparison of ranks out.
"""

from __future__ import annotations

import json
import logging
import os
import platform
from dataclasses import asdict, dataclass
from pathlib import Path

import typer

from rail_fem.atomic import write_text_atomically
from rail_fem.hierarchy import smoke_requested
from rail_fem.launcher import rank_count
from rail_fem.output.markdown import markdown_table
from rail_fem.output.versions import versions
from rail_fem.studies.kernel_flops import Kernel, operations_of_kernels
from rail_fem.studies.kernel_ranks import memory_per_element, study_ranks

MILLION, UPDATES = 1e-6, "million element updates/s"


@dataclass(frozen=True)
class SpeedRow:
    """One measured number: what, value, unit, and what it depends on."""

    what: str
    value: float
    unit: str
    note: str = ""


@dataclass(frozen=True)
class Sizes:
    """How much to measure: cube edges in elements, contact facets along a side, the block of the rank study, steps,
    repeats, rounds."""

    cubes: tuple[int, ...] = (12, 32, 64)
    facets: int = 60
    block: tuple[int, int, int] = (96, 40, 40)
    steps: int = 30
    repeats: int = 7
    shortest: float = 0.1
    rounds: int = 3
    streamed: int = 8_000_000


SMOKE = Sizes(cubes=(4,), facets=6, block=(8, 4, 4), steps=2, repeats=1, shortest=0.0, rounds=1, streamed=1000)


def kernel_rows(sizes: Sizes) -> list[SpeedRow]:
    """Element kernels, dolfinx's assembly and their ratio for each cube; contact."""
    from rail_fem.studies import (
        kernel_reference as kernels,  # imports dolfinx, and with it MPI: only after the jobs under mpirun
    )

    effort, rows = kernels.Effort(sizes.repeats, sizes.shortest), []
    rates: list[dict[str, float]] = []
    for across in sizes.cubes:
        domain = kernels.block_domain(across)
        unit, at = UPDATES, f"{across**3} elements"
        elastic_state, _ = kernels.finite_rate(domain, False, effort)
        plastic_state, share = kernels.finite_rate(domain, True, effort)
        full, full_share = kernels.finite_rate(domain, True, effort, "full")
        small, one_point = kernels.elastic_rate(domain, effort), kernels.assembly_rate(domain, 1, effort)
        rates.append({"one-point": plastic_state, "full": full, "elastic": small})
        shipped, eight_points = (
            kernels.assembly_rate(domain, 1, effort, kernels.AS_SHIPPED),
            kernels.assembly_rate(domain, 2, effort),
        )
        rows += [
            SpeedRow("finite strain, J2, hourglass: nothing yields", elastic_state * MILLION, unit, at),
            SpeedRow(
                "finite strain, J2, hourglass: everything flows",
                plastic_state * MILLION,
                unit,
                f"{at}, {share:.1%} of them flowing",
            ),
            SpeedRow(
                "finite strain, J2, 2x2x2 points: everything flows",
                full * MILLION,
                unit,
                f"{at}, {full_share:.1%} of them flowing",
            ),
            SpeedRow("small displacement, elastic, hourglass", small * MILLION, unit, at),
            SpeedRow(
                "dolfinx assembly, elastic, 1 point, no hourglass",
                one_point * MILLION,
                unit,
                f"{at}, compiled with {' '.join(kernels.TUNED)}",
            ),
            SpeedRow(
                "dolfinx assembly, the same as shipped",
                shipped * MILLION,
                unit,
                f"{at}, compiled with {' '.join(kernels.AS_SHIPPED)}",
            ),
            SpeedRow("dolfinx assembly, elastic, 2x2x2 points", eight_points * MILLION, unit, at),
            SpeedRow(
                "small displacement over dolfinx 1 point",
                small / one_point,
                "times",
                f"{at}; over the faster of the two",
            ),
            SpeedRow("finite strain, nothing yields, over dolfinx 1 point", elastic_state / one_point, "times", at),
            SpeedRow("finite strain, all flows, over dolfinx 1 point", plastic_state / one_point, "times", at),
        ]
    rows += roofline_rows(sizes, effort, rates)
    cost = kernels.contact_cost(sizes.facets, effort)
    at = f"{cost.pairs} pairs, {cost.active} of them active, with friction"
    rows.append(SpeedRow("contact forces", cost.pairs / cost.forces * MILLION, "million pairs/s", at))
    rows.append(
        SpeedRow(
            "contact search",
            cost.search / cost.forces,
            "times a step's contact forces",
            f"once in {cost.refresh} steps",
        )
    )
    return rows


KERNELS: dict[Kernel, str] = {
    "one-point": "finite strain, J2, hourglass: everything flows",
    "full": "finite strain, J2, 2x2x2 points: everything flows",
    "elastic": "small displacement, elastic, hourglass",
}


def roofline_rows(sizes: Sizes, effort, rates: list[dict[str, float]]) -> list[SpeedRow]:
    """The two limits of this core, operations and bytes of each kernel, and how near it comes to what they allow.

    rates : updates per second of each kernel at each size of `sizes.cubes`
    """
    from rail_fem.studies import kernel_reference as kernels
    from rail_fem.studies.kernel_roofline import bytes_of_update, machine_limits

    limits = machine_limits(lambda action: kernels.least_time(action, effort), sizes.streamed)
    rows = [
        SpeedRow(
            "limit of arithmetic", limits.operations * 1e-9, "10^9 operations/s", "multiply-adds in the first cache"
        ),
        SpeedRow(
            "limit of memory", limits.bytes * 1e-9, "10^9 B/s", f"two arrays of {8e-6 * sizes.streamed:g} MB in place"
        ),
    ]
    operations, domain = operations_of_kernels()["flowing"], kernels.block_domain(sizes.cubes[-1])
    for name, what in KERNELS.items():
        moved = bytes_of_update(kernels.structure_of(domain, name))
        by_arithmetic, by_memory = limits.updates(operations[name], moved)
        rows += [
            SpeedRow(f"{what}: operations", operations[name], "an update", "counted on the kernel's source"),
            SpeedRow(f"{what}: bytes", moved, "an update", "each array once"),
            SpeedRow(f"{what}: limit by arithmetic", by_arithmetic * MILLION, UPDATES),
            SpeedRow(f"{what}: limit by memory", by_memory * MILLION, UPDATES, "beyond the cache"),
        ]
        for across, rate in zip(sizes.cubes, rates):
            share = 100 * rate[name] / by_arithmetic
            rows.append(SpeedRow(f"{what}: of the arithmetic's limit", share, "%", f"{across**3} elements"))
        rows.append(
            SpeedRow(f"{what}: of its own rate in cache", 100 * rates[-1][name] / rates[0][name], "%", "largest cube")
        )
    return rows


def rank_rows(ranks: int, sizes: Sizes) -> list[SpeedRow]:
    """Ranks against one, and the halo exchange."""
    study = study_ranks(ranks, sizes.block, sizes.steps, sizes.repeats, sizes.rounds)
    one, shared = study.one, study.shared
    at = f"{one['elements']} elements, {one['flowed']:.0%} of them have yielded"
    return [
        SpeedRow("whole step, 1 rank", one["elements"] / one["step"] * MILLION, UPDATES, at),
        SpeedRow(f"whole step, {ranks} ranks", one["elements"] / shared["step"] * MILLION, UPDATES, "the same block"),
        SpeedRow(f"efficiency of {ranks} ranks", 100 * study.efficiency, "%", "time on 1 rank over ranks x time"),
        SpeedRow(
            f"the same, {ranks} runs at once without a word", 100 * study.machine, "%", "what the machine itself allows"
        ),
        SpeedRow(
            "efficiency beyond the machine's",
            100 * study.efficiency / study.machine,
            "%",
            "communication and imbalance only",
        ),
        SpeedRow(
            "step outside the element kernel, 1 rank",
            100 * (1 - one["kernel"] / one["step"]),
            "%",
            "no contact, no supports",
        ),
        SpeedRow(
            "halo exchange of a step", 1e6 * shared["exchange"], "us", f"{ranks} ranks, {shared['ghosts']} ghost nodes"
        ),
    ]


def memory_rows(sizes: Sizes) -> list[SpeedRow]:
    """Memory of a run on one rank."""
    found = memory_per_element(sizes.block)
    at = f"{found['elements']} elements, 1 rank, mesh given, beyond a run of 8"
    return [
        SpeedRow(
            "arrays of the solver", found["arrays"], "B/element", "state, nodes, forces, masses; without dolfinx's mesh"
        ),
        SpeedRow("resident memory while stepping", found["memory"], "B/element", at),
        SpeedRow("peak memory", found["peak_memory"], "B/element", at),
    ]


def machine_words() -> str:
    """Processor, how busy it is already, and versions, in one line."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
        model = next(line.partition(":")[2].strip() for line in lines if line.startswith("model name"))
    except (OSError, StopIteration):
        model = platform.processor() or "unknown processor"
    found = versions()
    busy = (
        f"{os.cpu_count()} cores with a load of {os.getloadavg()[0]:.1f} before the start (comparisons of ranks need"
        " idle cores)"
    )
    return ", ".join(
        [
            model,
            busy,
            platform.platform(),
            *(f"{name} {found[name]}" for name in ("python", "numpy", "numba", "dolfinx")),
        ]
    )


def markdown(rows: list[SpeedRow], machine: str) -> str:
    """The table, with the machine above it."""
    lines = [
        (
            f"{machine}. Float64, one core a rank; the fastest of several repeats; kernels in processor time, whole"
            " steps by the wall clock."
        ),
        "",
        *markdown_table(
            ["what", "value", "unit", "of"], [[row.what, f"{row.value:.4g}", row.unit, row.note] for row in rows]
        ),
    ]
    return "\n".join(lines) + "\n"


def save(path: Path, rows: list[SpeedRow], machine: str) -> None:
    """Markdown or JSON by the file's suffix."""
    if path.suffix == ".json":
        write_text_atomically(
            path, json.dumps({"machine": machine, "rows": [asdict(row) for row in rows]}, indent=1) + "\n"
        )
    else:
        write_text_atomically(path, markdown(rows, machine))


def main(
    out: list[Path] = typer.Option([], help="file to write, .md or .json; may be given twice"),
    ranks: int = typer.Option(2, min=1, help="ranks to compare with one; 1: no comparison"),
) -> None:
    """Element kernels, contact, halo exchange, ranks and memory of the explicit solver on this machine."""
    if rank_count() > 1:
        raise typer.BadParameter("start this without mpirun: it starts its own ranks")
    unknown = [str(path) for path in out if path.suffix not in (".md", ".json")]
    if unknown:
        raise typer.BadParameter(f"{', '.join(unknown)}: the suffix must be .md or .json")
    sizes = SMOKE if smoke_requested() else Sizes()
    machine = machine_words()
    logging.disable(logging.INFO)  # the compiler's own account of the assembled forms
    # before the kernels: they import MPI, and mpirun fails in a program that has
    rows = (rank_rows(ranks, sizes) if ranks > 1 else []) + memory_rows(sizes)
    rows = kernel_rows(sizes) + rows
    for path in out:
        save(path, rows, machine)
    print(markdown(rows, machine), end="")


if __name__ == "__main__":
    typer.run(main)
