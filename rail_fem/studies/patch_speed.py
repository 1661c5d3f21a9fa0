"""Speed against error of all patch solvers on one patch, beside Kalker's CONTACT.

    rail-fem study patch-speed --out speed          patch_speed.png: speed against error

Patch: 100 kN on a Hertz ellipse (relative radii 460 and 300 mm, steel), friction 0.3. Errors:
  normal    largest pressure against Hertz: half-space, both slice methods (blocks 160 mm wide and 120 mm deep, which
            cost 0.1 % of the pressure), finite elements (80 mm deep)
  shift     force against the finest grid's, extrapolated with the order that the three finest show
  rolling   the same
  FASTSIM   force against the rolling reference: the simplified theory's own error included
Seconds are processor time, the least of several runs, one thread, without import and compilation. The reference rows
are Kalker's CONTACT (compiled Fortran, one thread, user seconds on a machine of this kind), as given to the project.
"""

from collections.abc import Callable
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from bem.exact.hertz import PointContact, point_contact
from bem.halfspace.fastsim import elliptic_patch, fastsim
from bem.halfspace.normal import normal_contact
from bem.halfspace.tangential import rolling_contact, shift_contact
from bem.material import STEEL
from bem.patch import Creepage, Grid, Patch
from bem.plane.body import Body
from bem.plane.outline import block_behind
from bem.slices.assumed_load import loaded_slices
from bem.slices.coupled import slice_contact
from bem.slices.slices import Slices, wheel_on_prism
from rail_fem.show.panels import Panel
from rail_fem.show.table_and_figure import Table, publish
from rail_fem.static_fe.solid_blocks import BlockPair, FineZone
from rail_fem.static_fe.solid_contact import finite_patch
from rail_fem.studies.harness import OUT, QUICK, least, spent

LOAD, FRICTION, RADII = 1e5, 0.3, (0.46, 0.30)
CREEPAGE = Creepage(1e-3, 5e-4, 0.3)
SHIFT = Creepage(1e-5, 5e-6, 0.0)
CONTACT_NORMAL = {22: (0.005, 2e-3), 44: (0.014, 6e-4), 88: (0.024, 1.3e-4), 176: (0.058, 3e-5), 704: (1.5, np.nan)}
CONTACT_ROLLING = {22: 0.02, 44: 0.17, 88: 3.1, 176: 92.0}
CONTACT_SHIFT = {22: 0.01, 44: 0.06, 88: 0.26, 176: 1.3}
HALF = 0.08  # half-width of the blocks [m]


def hertz() -> PointContact:
    """The study's patch in closed form."""
    return point_contact(LOAD, *RADII, STEEL.plane_modulus / 2)


def study_grid(cells: int) -> Grid:
    """cells x cells over the ellipse and a margin of one and a half cells or 4.5 %, whichever is more."""
    exact = hertz()
    stretch = max(1.09, 1 / (1 - 3 / cells))
    x, y = stretch * exact.semi_x, stretch * exact.semi_y
    return Grid.over((-x, x), (-y, y), cells, cells)


def solve_normal(cells: int) -> Patch:
    grid = study_grid(cells)
    x, y = grid.points()
    return normal_contact(
        x**2 / (2 * RADII[0]) + y**2 / (2 * RADII[1]), STEEL, STEEL, load=LOAD, grid=grid, estimate=False
    )


def least_seconds(action: Callable[[], Any], budget: float = 1.0) -> tuple[float, Any]:
    """Least processor time of repeated runs within a budget [s], after one that warms up; and the last result."""
    action()
    return least(action, 1, budget)


class SpeedRow(NamedTuple):
    """One point of the figure of speed against error. reference : of others' numbers"""

    problem: str
    method: str
    cells: int
    seconds: float
    error: float
    reference: bool = False


def pressure_rows(
    method: str, sizes: tuple[int, ...], solve: Callable[[int], Any], timed: Callable | None = None
) -> list[SpeedRow]:
    """Seconds and error of the largest pressure of the normal problem. timed : none: the least of several runs"""
    rows, exact = [], hertz().max_pressure
    for n in sizes:
        seconds, patch = (timed or least_seconds)(partial(solve, n))
        rows.append(SpeedRow("normal", method, n, seconds, abs(patch.max_pressure / exact - 1)))
    return rows


def normal_rows(sizes: tuple[int, ...]) -> list[SpeedRow]:
    """Normal problem, and CONTACT's."""
    theirs = [SpeedRow("normal", "half-space, CONTACT", n, *known, True) for n, known in CONTACT_NORMAL.items()]
    return pressure_rows("half-space", sizes, solve_normal) + theirs


def tangential_rows(sizes: tuple[int, ...]) -> list[SpeedRow]:
    """Rolling, shift and FASTSIM against the extrapolated force; CONTACT's seconds beside the errors of equal cells."""
    solvers = {
        "rolling": lambda patch: rolling_contact(patch, STEEL, STEEL, FRICTION, CREEPAGE, estimate=False),
        "shift": lambda patch: shift_contact(patch, STEEL, STEEL, FRICTION, SHIFT, estimate=False),
    }
    rows, limits = [], {}
    for (name, solver), known in zip(solvers.items(), (CONTACT_ROLLING, CONTACT_SHIFT)):
        timed = {cells: least_seconds(partial(solver, solve_normal(cells))) for cells in sizes}
        forces = np.array([timed[cells][1].tangential_force for cells in sizes])
        limits[name] = extrapolated(forces)
        errors = np.linalg.norm(forces - limits[name], axis=1) / np.linalg.norm(limits[name])
        rows += [SpeedRow("tangential", name, n, timed[n][0], error) for n, error in zip(sizes, errors)]
        theirs = f"{name}, CONTACT's seconds at our error"
        rows += [SpeedRow("tangential", theirs, n, known[n], e, True) for n, e in zip(sizes, errors) if n in known]
    for cells in sizes:
        patch = elliptic_patch(hertz().semi_x, hertz().semi_y, LOAD, (cells, cells))
        seconds, result = least_seconds(lambda: fastsim(patch, STEEL, STEEL, FRICTION, CREEPAGE, estimate=False), 0.2)
        error = np.linalg.norm(result.tangential_force - limits["rolling"]) / np.linalg.norm(limits["rolling"])
        rows.append(SpeedRow("tangential", "FASTSIM", cells, seconds, error))
    return rows


def extrapolated(forces: np.ndarray) -> np.ndarray:
    """Limit of the last three of a series at halved cells, for the order they show, held within 1 and 2."""
    changes = np.linalg.norm(np.diff(forces[-3:], axis=0), axis=1)
    ratio = float(np.clip(changes[0] / changes[1], 2, 4)) if len(changes) == 2 and changes[1] > 0 else 2.0
    return forces[-1] + (forces[-1] - forces[-2]) / (ratio - 1)


def ellipse_slices() -> Slices:
    """The ellipse as slices: a flat-treaded wheel on a round rail, blocks 160 mm wide and 120 mm deep."""
    y = np.linspace(-HALF, HALF, 401)
    radius = RADII[1]
    crown = np.column_stack([y, np.sqrt(radius**2 - y**2) - radius])
    tread = np.column_stack([y, y**2 / 2e4])
    return wheel_on_prism(Body(block_behind(crown, -0.12), STEEL), Body(block_behind(tread, 0.12), STEEL), RADII[0])


def slice_rows(sizes: tuple[int, ...]) -> list[SpeedRow]:
    """Both slice methods, n slices of n cells."""
    slices = ellipse_slices()
    coupled = lambda n: slice_contact(slices, load=LOAD, cells=(n, n), threads=1, estimate=False)
    loaded = lambda n: loaded_slices(slices, load=LOAD, cells=(n, n), estimate=False)
    return [
        *pressure_rows("2.5D (b), coupled slices", sizes, coupled),
        *pressure_rows("2.5D (a), parabolic load", sizes, loaded),
    ]


def ellipse_blocks() -> BlockPair:
    """The ellipse: a cylinder along s over one along x."""
    (rolling, lateral), across = RADII, (-HALF, HALF)
    rail, wheel = lambda x, s: -(s**2) / (2 * lateral) + 0 * x, lambda x, s: x**2 / (2 * rolling) + 0 * s
    return BlockPair(rail, wheel, across, across, HALF, HALF)


def ellipse_zone(exact: PointContact, across: int) -> FineZone:
    """`across` elements over the smaller axis; outer elements grow by 1.4 at 8 and the slower the finer they are."""
    size = 2 * exact.semi_y / across
    along, half, down = (
        np.ceil(reach / size) * size for reach in (1.15 * exact.semi_x, 1.15 * exact.semi_y, 0.5 * exact.semi_y)
    )
    return FineZone(along, (-half, half), down, size, size, 1 + 3.2 / across)


def finite_rows(across: tuple[int, ...]) -> list[SpeedRow]:
    """By numbers of elements over the smaller axis, each solved once."""
    solve = lambda count: finite_patch(ellipse_blocks(), LOAD, ellipse_zone(hertz(), count))
    return pressure_rows("finite elements, static", across, solve, spent)


def all_rows(quick: bool) -> list[SpeedRow]:
    """Every method on the ellipse, and CONTACT's numbers."""
    seconds, _ = least_seconds(hertz, 0.1)
    rows = [SpeedRow("normal", "Hertz, closed form", 0, seconds, float("nan"))]
    rows += normal_rows((22, 44) if quick else (22, 44, 88, 176, 352, 704))
    rows += slice_rows((12,) if quick else (12, 22, 44, 88))
    rows += tangential_rows((11, 22, 44) if quick else (22, 44, 88, 176, 352))
    finite_rows((4,))  # compiles outside the timing
    return rows + finite_rows((6, 8) if quick else (6, 8, 12, 16, 22))


def panels(rows: list[SpeedRow]) -> list[Panel]:
    """Speed against error of the normal problem and of that with friction; marks stand at the grids."""
    found = []
    for problem, of in (("normal", "largest pressure"), ("tangential", "tangential force")):
        own = [row for row in rows if row.problem == problem and row.error > 0]
        lines = {}
        for method in dict.fromkeys(row.method for row in own):
            mine = [row for row in own if row.method == method]
            look = "s:" if mine[0].reference else "o-"
            lines[method] = [row.error for row in mine], [row.seconds for row in mine], look
        found.append(Panel(f"relative error of the {of}", "seconds on one core", lines, problem, "xy"))
    return found


def main(quick: QUICK = False, out: OUT = None) -> None:
    """Speed against error of half-space, slices, FASTSIM, finite elements and CONTACT on one ellipse."""
    rows = all_rows(quick)
    table = Table(SpeedRow._fields, rows)
    publish("patch_speed", out, [table], panels(rows), "Speed against error on one patch, 100 kN, 14.3 x 10.8 mm")
