"""Finished damage studies side by side: what each wore off, how sure, and how far they differ; two of one crossing and
as many passes position by position, too: what shorter blocks change, or plastic flow beside wear.

    rail-fem damage cases/damage/crossing_life.toml --out runs/life
    rail-fem damage cases/damage/crossing_life.toml --set damage.block_share=0.05 --out runs/life_half
    rail-fem compare runs/life runs/life_half --out blocks            the finer, or the simpler, study second

    rail-fem damage cases/damage/crossing_flow.toml --out runs/flow             and without plastic_flow: runs/wear
    rail-fem compare runs/flow runs/wear --out flow

Differences by position are of the first study to the second, in what the surface lost by wear and flow: of single
positions in the plan, of means over stretches of the running direction, of the deepest in each section, and of the
volume.
"""

import json
import os
from pathlib import Path
from typing import Any

import numpy as np

from geometry.surfaces.bodies import BODIES
from rail_fem.damage.traffic import time_in_words
from rail_fem.files.markdown import table_of
from rail_fem.files.sealed import damaged
from rail_fem.show.panels import Panel
from rail_fem.show.table_and_figure import Table, publish

UM, MM, KN = 1e6, 1e3, 1e-3
PASSES, WORN, FORCE, FLOW = 0, 1, 5, 6  # columns of a study's log
STRETCH = 50e-3  # of the running direction, of which one row is [m]
SHARES = (0.01, 0.05)  # differences whose share of the worn plan is told
LEAST = 0.1  # of the deepest on a body, from which on a position counts as worn
TIMES = (0.0, 0.01, 0.1, 1.0)  # of all passes, for which the table has a row

Study = dict[str, np.ndarray]


class ComparisonError(ValueError):
    """Studies that cannot stand side by side."""


def is_study(folder: Path) -> bool:
    """Whether a folder holds a finished damage study."""
    return os.path.isfile(Path(folder) / "damage.json")  # False for a name that no file can have


def is_begun(folder: Path) -> bool:
    """Whether a folder holds a damage study, finished or not."""
    try:
        case = json.loads((Path(folder) / "case.json").read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return is_study(folder)
    return isinstance(case, dict) and case.get("study") == "damage"


def studies_facts(folders: list[Path]) -> dict[str, dict[str, Any]]:
    """Results of damage studies by folder. Errors: ComparisonError for a folder that holds none, or one that is
    damaged."""
    found = {}
    for folder in map(Path, folders):
        if not is_study(folder) and is_begun(folder):
            raise ComparisonError(f"{folder}: a damage study that has not ended; go on with rail-fem damage --restart")
        if not is_study(folder):
            raise ComparisonError(f"{folder}: no damage.json; a damage study is compared with others of its kind")
        try:
            found[str(folder)] = json.loads((folder / "damage.json").read_text(encoding="utf-8"))
            found[str(folder)]["bodies"]
        except (ValueError, KeyError) as error:
            raise ComparisonError(f"{folder / 'damage.json'}: {damaged(error)}: do the study again") from error
    sites = {facts["site"] for facts in found.values()}
    if len(sites) > 1:
        raise ComparisonError(f"studies of a {' and a '.join(sorted(sites))}: compare those of one kind")
    return found


def studies_table(folders: list[Path]) -> str:
    """Markdown table, a row for each part of each study. Errors: ComparisonError."""
    rows = []
    for name, facts in studies_facts(folders).items():
        for part, own in facts["bodies"].items():
            band = list(own["deepest_by_law"].values())
            rows.append(
                {
                    "study": Path(name).name,
                    "part": part,
                    "passes": f"{facts['passes']:,.0f}",
                    "deepest [\u00b5m]": f"{own['deepest_by_law'][facts['law']] * UM:.3g}",
                    "band over the laws [\u00b5m]": f"{min(band) * UM:.3g} to {max(band) * UM:.3g}",
                    "bound of the blocks' error": f"{facts['block_error']:.1%}",
                    "T\u03b3 first, end [N]": f"{own['largest_tgamma']:.0f}, {own['at_end']['largest_tgamma']:.0f}",
                    "time to the limit": time_in_words(own["years"]["to_limit"]),
                }
            )
    return "\n".join(table_of(rows))


def read(folder: Path) -> Study:
    """Arrays of a finished study of a crossing. Errors: ValueError for another folder."""
    path = Path(folder) / "damage.npz"
    if not path.is_file():
        raise ValueError(f"{folder}: no damage.npz; give the folder of a finished damage study of a crossing")
    with np.load(path) as stored:
        found = {name: stored[name] for name in stored.files}
    if "worn_depth" not in found or not len(found["log"]):
        raise ValueError(f"{folder}: a study of a switch, or of no passes; give one of a crossing that has been passed")
    return found


def read_pair(first: Path, second: Path) -> tuple[Study, Study]:
    """Arrays of both. Errors: ValueError for studies of other passes, or of another plan."""
    one, two = read(first), read(second)
    passes = [float(own["log"][-1, PASSES]) for own in (one, two)]
    if abs(passes[0] - passes[1]) > 1e-6 * passes[1]:
        raise ValueError(f"{first} and {second}: {passes[0]:g} and {passes[1]:g} passes; give two of the same")
    if any(one[name].shape != two[name].shape or not np.allclose(one[name], two[name]) for name in ("x", "y")):
        raise ValueError(f"{first} and {second}: plans differ; give two studies of one crossing and one spacing")
    return one, two


def lowered(study: Study) -> np.ndarray:
    """(2, m, n) depths that wing and nose have lost by wear and flow [m]."""
    return study["worn_depth"] + study.get("worn_flow", 0.0)


def body_row(name: str, one: np.ndarray, two: np.ndarray, cell: float, along: float) -> dict[str, str]:
    """Of one body: depths (m, n) [m] of both studies, plan area of a cell [m2], its length along x [m]."""
    deepest, off = two.max(), np.abs(one - two) / two.max()
    worn, width = two > LEAST * two.max(), max(round(10e-3 / along), 1)
    mean = lambda depth: np.apply_along_axis(np.convolve, 0, depth, np.full(width, 1 / width), mode="valid")
    within = f"of the worn plan within {SHARES[0]:.0%}, {SHARES[1]:.0%}"
    sections = np.abs(one.max(axis=1) - two.max(axis=1)) / deepest
    return {
        "body": name,
        "deepest [\u00b5m]": f"{one.max() * UM:.4g}, {deepest * UM:.4g} ({one.max() / deepest - 1:+.1%})",
        "volume [mm\u00b3]": (
            f"{one.sum() * cell * 1e9:.4g}, {two.sum() * cell * 1e9:.4g} ({one.sum() / two.sum() - 1:+.2%})"
        ),
        "largest difference over the deepest": f"{off.max():.1%}",
        "root mean square where worn": f"{np.sqrt((off[worn] ** 2).mean()):.1%}",
        within: ", ".join(f"{(off[worn] < share).mean():.0%}" for share in SHARES),
        "deepest of a section, largest difference": f"{sections.max():.1%}",
        "means over 10 mm along, largest difference": f"{np.abs(mean(one) - mean(two)).max() / mean(two).max():.1%}",
    }


def tables(one: Study, two: Study) -> list[Table]:
    """A row for each body, for each stretch, and for some of the passes."""
    x, y, depths = two["x"], two["y"], (lowered(one), lowered(two))
    along, cell = x[1] - x[0], (x[1] - x[0]) * (y[1] - y[0])
    pairs = [(name, depths[0][b], depths[1][b]) for b, name in enumerate(BODIES) if depths[1][b].max() > 0]
    rows = []
    for name, a, b in pairs:
        for start in np.arange(np.floor(x[0] / STRETCH) * STRETCH, x[-1], STRETCH):
            own = (x >= start - 1e-9) & (x < start + STRETCH - 1e-9)
            if not own.any() or b[own].max() < LEAST * b.max():
                continue
            off = np.abs(a[own] - b[own]).max()
            deepest = f"{a[own].max() * UM:.4g}, {b[own].max() * UM:.4g}"
            differ = f"{a[own].max() / b[own].max() - 1:+.1%}", f"{a[own].sum() / b[own].sum() - 1:+.1%}"
            where = f"{name}, {start * MM:.0f} to {(start + STRETCH) * MM:.0f} mm"
            rows.append([where, deepest, *differ, f"{off * UM:.3g} ({off / b.max():.1%})"])
    log, other = one["log"], two["log"]
    wanted = np.unique([int(np.argmin(np.abs(log[:, PASSES] - share * log[-1, PASSES]))) for share in TIMES])
    flows, steps = "worn_flow" in one, []
    for row in log[wanted]:
        there = [float(np.interp(row[PASSES], other[:, PASSES], other[:, k])) for k in (WORN, FORCE)]
        flow = row[FLOW] * UM if flows else 0.0
        steps.append([f"{value:.4g}" for value in (row[PASSES], flow, row[WORN] * UM, row[FORCE] * KN)])
        steps[-1] += [f"{there[0] * UM:.4g}", f"{there[1] * KN:.4g}"]
    blocks = f"{len(log)} and {len(other)} blocks, {other[-1, PASSES]:,.0f} passes"
    head = ["where", "deepest [\u00b5m]", "differ", "volume differs", "largest at one position [\u00b5m] (of deepest)"]
    of_time = ["passes", "deepest flow [\u00b5m]", "deepest wear [\u00b5m]", "largest force [kN]"]
    of_time += ["wear of the second [\u00b5m]", "its largest force [kN]"]
    bodies = [body_row(name, a, b, cell, along) for name, a, b in pairs]
    return [Table.of(bodies, blocks), Table(head, rows), Table(of_time, steps)]


def panels(one: Study, two: Study, names: tuple[str, str]) -> list[Panel]:
    """Deepest of each section in both studies, their largest difference there and the bound that the first gives; what
    is lost over the passes."""
    depths, found = (lowered(one), lowered(two)), []
    deepest = lambda study: (two["x"] * MM, study.max(axis=1) * UM)
    for b, body in enumerate(BODIES):
        lines: dict[str, tuple] = {name: deepest(depth[b]) for name, depth in zip(names, depths)}
        lines["largest difference"] = deepest(np.abs(depths[0][b] - depths[1][b]))
        kept = {"worn_flow": "of it flow", "error": "bound that the first study's blocks give"}
        lines |= {words: (*deepest(one[name][b]), ":") for name, words in kept.items() if name in one}
        found.append(Panel("x [mm]", "deepest in the section [\u00b5m]", lines, body))
    logs = {name: study["log"].T for name, study in zip(names, (one, two))}
    over = lambda column, unit: {name: (log[PASSES], log[column] * unit) for name, log in logs.items()}
    found.append(Panel("passes", "deepest wear [\u00b5m]", over(WORN, UM), log="xy"))
    return [*found, Panel("passes", "largest force [kN]", over(FORCE, KN), log="x")]


def compare_pair(first: Path, second: Path, out: Path | None) -> None:
    """Tables and figure of two studies, by position and over the passes. Errors: those of `read_pair`; OSError."""
    one, two = read_pair(first, second)
    title = f"{first.name} against {second.name}, {two['log'][-1, PASSES]:,.0f} passes"
    publish("compare_pair", out, tables(one, two), panels(one, two, (first.name, second.name)), title)
