"""Boundary elements against finite elements in the plane: the four cases of the thesis' chapter 5, profile by profile.

    python -m rail_fem.studies.plane_contact --out plane                a table (plane.md) and a figure (plane.png) of
    all cases
    python -m rail_fem.studies.plane_contact --size 0.4 --size 0.2      other element sizes [mm]; the last is drawn

Both solvers get the same outlines; nothing else is shared (rail_fem/static_fe/plane_strain.py). The thesis'
counterparts are its Tables 5-3 and 5-5, with deviations up to 2.6 %.
"""

from __future__ import annotations

import time
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np
import typer
from scipy.integrate import trapezoid

from bem.plane.contact import Settings, solve_contact
from bem.plane.contact_result import ContactResult
from bem.plane.coulomb import Control
from bem.plane.internal import field_at
from bem.verification.cases import CASES
from rail_fem.atomic import write_text_atomically
from rail_fem.output.markdown import markdown_table
from rail_fem.static_fe.plane_contact import PlaneContact, solve_plane_contact
from rail_fem.static_fe.plane_strain import Fineness
from rail_fem.studies.sections import RAIL_LOAD, wheel_on_rail

MM = 1e-3
HEAD = (
    "case",
    "element [mm]",
    "FE nodes",
    "FE [s]",
    "BEM [s]",
    "pressure BEM [MPa]",
    "FE to BEM",
    "displacement BEM [mm]",
    "FE to BEM",
    "von Mises BEM [MPa]",
    "FE to BEM",
    "profile, largest",
    "profile, L2",
)


PROBLEMS = {name: (case, 10e6) for name, case in CASES.items()}
PROBLEMS |= {f"P8 on BS113A, E 210/{young}": (partial(wheel_on_rail, young * 1e9), RAIL_LOAD) for young in (210, 190)}


@dataclass(frozen=True)
class Differences:
    """One case solved twice. Differences are (FE - BEM) / BEM.

    largest : largest difference of the pressures farther than two elements from the patch's edges, over the largest
        pressure
    l2      : of the whole profiles, over the norm of the BEM's
    """

    case: str
    size: float
    boundary: ContactResult
    finite: PlaneContact
    boundary_time: float
    finite_time: float
    pressure: tuple[float, float]
    displacement: tuple[float, float]
    von_mises: tuple[float, float]
    largest: float
    l2: float

    @staticmethod
    def difference(pair: tuple[float, float]) -> float:
        """(FE - BEM) / BEM of a pair (BEM, FE)."""
        return pair[1] / pair[0] - 1


def compare(case: str, size: float) -> Differences:
    """Solve a case of PROBLEMS with both methods at an element size [m] in the contact."""
    make, load = PROBLEMS[case]
    fixed, moving = make()
    tick = time.perf_counter()
    boundary = solve_contact(fixed, moving, Control.of(force=(None, -load)), settings=Settings(size=size))
    between = time.perf_counter()
    x, pressure, touched = _profile(boundary)
    far = fixed.outline.size / 15
    finite = solve_plane_contact(
        fixed, moving, load, Fineness(touched, size, MM, far), (touched[0, 0] - MM, touched[-1, 0] + MM)
    )
    points, stress = finite.von_mises()
    end = time.perf_counter()
    peak = points[np.argsort(-stress)[:300]]  # the boundary elements are asked where the finite elements are highest
    face = finite.fixed.nodes[finite.fixed.edges[:, 0]]
    below = face[(face[:, 0] > touched[0, 0]) & (face[:, 0] < touched[-1, 0])]
    solution = boundary.solution("fixed")
    largest, l2 = _differences(boundary, x, pressure, finite, size)
    return Differences(
        case, size, boundary, finite, between - tick, end - between,
        (pressure.max(), finite.pressure.max()),
        (np.nanmin(field_at(solution, below).displacement[:, 1]), finite.lowest),
        (np.nanmax(field_at(solution, peak).von_mises), stress.max()), largest, l2,
    )  # fmt: skip


def _profile(boundary: ContactResult) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """x (n,) and pressure (n,) by growing x, and the points (k, 2) that touch."""
    points, pressure = boundary.interface.points, boundary.last.pressure
    order = np.argsort(points[:, 0])
    touched = points[order][pressure[order] > 0]
    return points[order, 0], pressure[order], touched


def _differences(boundary: ContactResult, x, pressure, finite: PlaneContact, size: float) -> tuple[float, float]:
    there = np.interp(finite.x, x, pressure)
    edges = np.array([end[0] for patch in boundary.patches() for end in (patch.begin, patch.end)])
    inner = np.abs(finite.x[:, None] - edges).min(axis=1) > 2 * size
    miss = finite.pressure - there
    return np.abs(miss[inner]).max() / pressure.max(), np.sqrt(
        trapezoid(miss**2, finite.x) / trapezoid(there**2, finite.x)
    )


def table(rows: list[Differences]) -> str:
    """Markdown, a line for each case and size."""
    lines = []
    for row in rows:
        pairs = [(row.pressure, 1e6, ".1f"), (row.displacement, MM, ".5f"), (row.von_mises, 1e6, ".1f")]
        numbers = [(f"{pair[0] / unit:{style}}", f"{row.difference(pair):+.2%}") for pair, unit, style in pairs]
        lines.append(
            [
                row.case,
                f"{row.size / MM:g}",
                f"{len(row.finite.fixed.nodes) + len(row.finite.moving.nodes)}",
                f"{row.finite_time:.2f}",
                f"{row.boundary_time:.2f}",
                *(cell for two in numbers for cell in two),
                f"{row.largest:.2%}",
                f"{row.l2:.2%}",
            ]
        )
    return "\n".join(markdown_table(HEAD, lines)) + "\n"


def draw(rows: list[Differences], path: Path) -> None:
    """Pressure profiles of each case, both methods on one axis."""
    from rail_fem.show.style import NOSE, TOTAL, lettering, new_figure, save

    with lettering():
        figure = new_figure(8.0)
        axes = figure.subplots(2, (len(rows) + 1) // 2, squeeze=False).ravel()
        for axis, row in zip(axes, rows):
            x, pressure, touched = _profile(row.boundary)
            axis.plot(
                row.finite.x / MM,
                row.finite.pressure / 1e6,
                "o",
                color=NOSE,
                markersize=5,
                markerfacecolor="none",
                label="finite elements",
            )
            axis.plot(x / MM, pressure / 1e6, color=TOTAL, linewidth=1.2, label="boundary elements")
            axis.set(
                title=row.case,
                xlabel="x [mm]",
                ylabel="pressure [MPa]",
                xlim=(touched[0, 0] / MM - 0.5, touched[-1, 0] / MM + 0.5),
                ylim=(0, None),
            )
        axes[0].legend(loc="lower center", fontsize=9)
        for axis in axes[len(rows) :]:
            axis.remove()
        figure.suptitle(
            f"Plane contact, elements of {rows[-1].size / MM:g} mm: boundary elements against finite elements",
            fontsize=14,
        )
        save(figure, path)


def main(
    size: list[float] = typer.Option([0.4, 0.2, 0.1], help="element sizes in the contact [mm]"),
    out: Path = typer.Option(Path("plane"), help="files to write, without ending"),
):
    """Four case studies in the plane: boundary elements against finite elements."""
    compare(next(iter(PROBLEMS)), 0.4 * MM)  # compiles outside the timing
    rows = [compare(case, value * MM) for case in PROBLEMS for value in sorted(size, reverse=True)]
    text = table(rows)
    write_text_atomically(out.with_suffix(".md"), text)
    draw([row for row in rows if row.size == min(size) * MM], out.with_suffix(".png"))
    print(text, end="")


if __name__ == "__main__":
    typer.run(main)
