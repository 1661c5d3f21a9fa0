"""Speed against error of all patch solvers on one patch, finite elements among them, beside Kalker's CONTACT: one
figure.

    python -m rail_fem.studies.patch_speed --out speed          speed_error.csv and speed_error.png in the folder
    `speed`

The ellipse of bem/verification/halfspace_study.py; blocks of finite elements 160 mm wide and 80 mm deep. Error of the
largest pressure against Hertz.
"""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np
import typer

from bem.exact.hertz import PointContact
from bem.verification import halfspace_speed as study3d
from bem.verification import halfspace_study
from rail_fem.static_fe.finite_series import to_stderr
from rail_fem.static_fe.solid_blocks import BlockPair, FineZone
from rail_fem.static_fe.solid_contact import finite_patch

HALF = 0.08  # half-width of the blocks and their depth [m]


def ellipse_blocks() -> BlockPair:
    """The study's ellipse: a cylinder along s over one along x."""
    rolling, lateral = halfspace_study.RADII
    return BlockPair(
        lambda x, s: -(s**2) / (2 * lateral) + 0 * x,
        lambda x, s: x**2 / (2 * rolling) + 0 * s,
        (-HALF, HALF),
        (-HALF, HALF),
        HALF,
        HALF,
    )


def ellipse_zone(exact: PointContact, across: int) -> FineZone:
    """`across` elements over the smaller axis; outer elements grow by 1.4 at 8 and the slower the finer they are."""
    size = 2 * exact.semi_y / across
    along, half, down = (
        np.ceil(reach / size) * size for reach in (1.15 * exact.semi_x, 1.15 * exact.semi_y, 0.5 * exact.semi_y)
    )
    return FineZone(along, (-half, half), down, size, size, 1 + 3.2 / across)


def finite_rows(across: tuple[int, ...]) -> list[dict]:
    """Processor seconds and error of the largest pressure by numbers of elements over the smaller axis."""
    exact, rows = halfspace_study.hertz(), []
    for count in across:
        started = time.process_time()
        patch = finite_patch(ellipse_blocks(), halfspace_study.LOAD, ellipse_zone(exact, count))
        seconds = time.process_time() - started
        rows.append(
            halfspace_study.speed_row(
                "finite elements, static", count, seconds, abs(patch.max_pressure / exact.max_pressure - 1)
            )
        )
        to_stderr(f"finite elements, {count} over the smaller axis: {patch.nodes} nodes, {seconds:.1f} s")
    return rows


def main(
    out: Path = typer.Option(Path("speed"), help="folder for the files"),
    quick: bool = typer.Option(False, help="small grids only, for a look"),
):
    """Speed against error of half-space, slices, FASTSIM, finite elements and CONTACT on one ellipse."""
    out.mkdir(parents=True, exist_ok=True)
    finite_rows((4,))  # compiles outside the timing
    rows = finite_rows((6, 8) if quick else (6, 8, 12, 16, 22))
    halfspace_study.report_speed_error(study3d.speed_rows(quick) + rows, out)


if __name__ == "__main__":
    typer.run(main)
