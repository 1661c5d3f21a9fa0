"""The plane case studies of the thesis' chapter 5 by boundary elements, finite elements beside them.

    rail-fem study plane-contact --out plane                      pressures, and stress below them
    rail-fem study plane-contact --size 0.4 --size 0.2            other element sizes [mm]; the last is drawn

Three pairs of blocks (bem/verification/cases.py) and a P8 wheel on a BS113A rail, inclined 1:20, gauge 1435 mm,
back-to-back 1360 mm, rail of 210 and of 190 GPa, 4 kN per mm of thickness. Both solvers get the same outlines; nothing
else is shared (rail_fem/static_fe/plane_strain.py). The thesis' counterparts are its Tables 5-3 and 5-5, with
deviations up to 2.6 %, and Figs. 5-10 to 5-22, in kind: its geometry is known from pictures only.
"""

import time
from dataclasses import dataclass
from functools import partial
from typing import Annotated

import numpy as np
import typer
from scipy.integrate import trapezoid

from bem.material import Elastic
from bem.plane.body import Body
from bem.plane.contact import Settings, solve_contact
from bem.plane.contact_result import ContactResult
from bem.plane.coulomb import Control
from bem.plane.internal import Field, field_at, grid_below
from bem.verification.cases import CASES
from rail_fem.contact.contact_pairs import plain_rail_pair
from rail_fem.contact.patch_methods import plain_rail_section
from rail_fem.show.panels import Panel
from rail_fem.show.table_and_figure import Table, publish
from rail_fem.static_fe.plane_contact import PlaneContact, solve_plane_contact
from rail_fem.static_fe.plane_strain import Fineness
from rail_fem.studies.harness import OUT, QUICK

MM = 1e-3
RAIL_LOAD = 4e6  # of the wheel on the rail, per m of thickness [N/m]: the thesis' pressure of 740 MPa within 5 %


def wheel_on_rail(rail_young: float) -> tuple[Body, Body]:
    """P8 on BS113A 1:20, gauge 1435, back-to-back 1360: rail of a modulus [Pa] fixed, wheel of 210 GPa moving."""
    return plain_rail_section(plain_rail_pair(rail_steel=Elastic(rail_young, 0.3)))


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


def field_below(result: ContactResult, size: float) -> Field:
    """The thesis' internal domain in the fixed body below the contact: 20 mm wide, 15 mm deep, at a grid size [m]."""
    touched = _profile(result)[2]
    middle = (touched[0] + touched[-1]) / 2
    grid = grid_below(result.fixed.body.outline, result.fixed.body.face, middle, 10 * MM, 15 * MM, size)
    return field_at(result.solution("fixed"), grid)


def table(rows: list[Differences]) -> Table:
    """A line for each case and size."""
    lines = []
    for row in rows:
        pairs = [(row.pressure, 1e6, ".1f"), (row.displacement, MM, ".5f"), (row.von_mises, 1e6, ".1f")]
        numbers = [(f"{pair[0] / unit:{style}}", f"{row.difference(pair):+.2%}") for pair, unit, style in pairs]
        nodes = len(row.finite.fixed.nodes) + len(row.finite.moving.nodes)
        times = f"{row.finite_time:.2f}", f"{row.boundary_time:.2f}"
        ends = f"{row.largest:.2%}", f"{row.l2:.2%}"
        lines.append([row.case, f"{row.size / MM:g}", nodes, *times, *(cell for two in numbers for cell in two), *ends])
    head = ["case", "element [mm]", "FE nodes", "FE [s]", "BEM [s]", "pressure BEM [MPa]", "FE to BEM"]
    head += ["displacement BEM [mm]", "FE to BEM", "von Mises BEM [MPa]", "FE to BEM"]
    return Table([*head, "profile, largest", "profile, L2"], lines)


def panels(rows: list[Differences]) -> list[Panel]:
    """Pressure profiles of each case by both methods; von Mises stress of the boundary elements below the middle."""
    found = []
    for row in rows:
        x, pressure, _ = _profile(row.boundary)
        finite = (row.finite.x / MM, row.finite.pressure / 1e6, "o")
        lines = {"boundary elements": (x / MM, pressure / 1e6), "finite elements": finite}
        found.append(Panel("x [mm]", "pressure [MPa]", lines, row.case))
    fields = {row.case: field_below(row.boundary, 0.4 * MM) for row in rows}
    middle = lambda values: values[:, values.shape[1] // 2]
    lines = {case: (middle(f.points[..., 1]) / MM, middle(f.von_mises) / 1e6) for case, f in fields.items()}
    return [*found, Panel("z [mm]", "von Mises [MPa]", lines, "below the middle of the patch")]


def main(
    size: Annotated[list[float], typer.Option(help="element sizes in the contact [mm]")] = [0.4, 0.2, 0.1],  # noqa: B006
    quick: QUICK = False,
    out: OUT = None,
) -> None:
    """Case studies in the plane: boundary elements against finite elements."""
    compare(next(iter(PROBLEMS)), 0.4 * MM)  # compiles outside the timing
    sizes = [0.4] if quick else sorted(size, reverse=True)
    rows = [compare(case, value * MM) for case in PROBLEMS for value in sizes]
    drawn, title = panels([row for row in rows if row.size == sizes[-1] * MM]), f"Elements of {sizes[-1]:g} mm"
    publish("plane_contact", out, [table(rows)], drawn, title, columns=3)
