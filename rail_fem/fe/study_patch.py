"""The contact patch of wheel and rail by three-dimensional finite elements with elastic steel: the judge of the patch solvers of `bem`.

    python -m rail_fem.fe.study_patch --out patch        a table (patch.md) and a figure (patch.png): P8 on BS113A by every method

The explicit solver relaxes two blocks with the true faces of a tie (rail_fem/patch_ties.py) under the load until they rest, as in
rail_fem/fe/study.py. The tie is symmetric about x' = 0, so half of it is meshed. The rail's block stands on a rigid base, the
wheel's hangs under a rigid plate that moves along the tie's normal only.
Error: the same elements on Hertz' ellipse, tests/versus/test_hertz_ellipse.py: 0.8 % of pressure and 3 % of area at 8 elements
over the minor axis, 0.2 and 0.8 % at 16, second order. Here: tests/versus/test_patch_3d.py.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import typer
from mpi4py import MPI
from scipy.interpolate import RegularGridInterpolator

from bem.body import Body
from bem.outline import block_behind
from bem.patch import Cost, Grid, Patch
from bem.slice_contact import slice_contact
from bem.slices import Slices, slices_of_profiles
from geometry.mesh import HexMesh, boundary_faces
from geometry.mesh_axis import graded_line
from geometry.mesh_box import mesh_grid
from rail_fem.atomic import write_text_atomically
from rail_fem.fe.contact import Contact
from rail_fem.fe.study import press, rail_pressure, settle
from rail_fem.patch_methods import THESIS_ROWS, WHEEL_LOAD, MethodRow, method_rows, table, thesis_tie
from rail_fem.patch_ties import Tie
from rail_fem.steel import Steel

DENSITY = 7850.0
LONGEST = 8e-3  # simulated time within which the bodies must be at rest [s]
Height = Callable[[np.ndarray, np.ndarray], np.ndarray]


@dataclass(frozen=True)
class Blocks:
    """Blocks cut from wheel and rail about a tie.

    length : the blocks reach to +- this along x' [m];  across : (2,) from, to along s [m];  depth : behind the touch [m]
    """

    length: float = 0.030
    across: tuple[float, float] = (-0.022, 0.026)
    depth: float = 0.035

    def slices(self, tie: Tie, places: int = 41) -> Slices:
        """The same blocks for the slices of `bem`, prisms with the wheel's true gap."""
        s = np.linspace(*self.across, 481)
        x = np.linspace(-self.length, self.length, places) / 2
        rail, wheel = (np.column_stack([s, height(0 * s, s)]) for height in (tie.rail_height, tie.wheel_height))
        bodies = Body(block_behind(rail, -self.depth), tie.rail_steel), Body(block_behind(wheel, self.depth), tie.wheel_steel)
        return slices_of_profiles(*bodies, x, upper_profiles=[np.column_stack([s, tie.wheel_height(0 * s + place, s)]) for place in x])


def block(height: Height, x: np.ndarray, s: np.ndarray, z: np.ndarray, facing: str) -> HexMesh:
    """Hexahedra between the face height(x, s) [m] and a plane z[-1] behind it; z counts from the face, facing "up" or "down"."""
    flat = mesh_grid(x, s, z, facing)
    points, cells = flat.points.copy(), flat.cells
    rise = height(points[:, 0], points[:, 1])
    bottom, top = flat.clamp, flat.clamp + len(z) - 1
    faces, _ = boundary_faces(cells)
    surface = faces[np.isin(faces, bottom).all(axis=1)]
    away = 1.0 if facing == "down" else -1.0
    points[:, 2] = away * points[:, 2] + rise * (1 - points[:, 2] / z[-1])
    if facing == "up":
        cells, surface = cells[:, [4, 5, 6, 7, 0, 1, 2, 3]], surface[:, ::-1].copy()
    return HexMesh(points, cells, np.zeros(len(cells), np.int8), (facing,), surface, np.zeros(len(surface), np.int8), top)


@dataclass
class FinitePatch(Patch):
    """Cells lie about the nodes of the rail's surface. The balanced contact spreads a little pressure to one node beyond the patch's edge, so
    the edge is led on, pressure squared as a line, from the two nodes inside the outermost: second order in the element.
    """

    @property
    def extent(self) -> tuple[float, float]:
        """Length along x and width along y [m]: the longest and the widest row."""
        square = self.pressure**2
        return self.grid.dx * max(_covered(row) for row in square.T), self.grid.dy * max(_covered(row) for row in square)

    @property
    def contact_area(self) -> float:
        """Area in contact [m^2], the mean of what rows along x and along y give, the outermost rows left out."""
        square = self.pressure**2
        rows, columns = (way[np.flatnonzero(way.any(axis=1))[1:-1]] for way in (square, square.T))
        return self.grid.cell_area * (sum(map(_covered, rows)) + sum(map(_covered, columns))) / 2


def _covered(square: np.ndarray) -> float:
    """Nodes' spacings covered in a row of squared pressures, the outermost nodes not believed; gaps between two patches count as none."""
    pressed = np.flatnonzero(square > 0)
    if len(pressed) < 5:
        return max(len(pressed) - 1.0, 0.0)
    ends = []
    for edge, inner in ((pressed[1], pressed[2]), (pressed[-2], pressed[-3])):
        falling = square[inner] > square[edge]
        ends.append(min(square[edge] / (square[inner] - square[edge]), 2.0) if falling else 1.0)
    return len(pressed) - 3 + sum(ends)


def map_difference(finite: Patch, other: Patch) -> float:
    """L2 norm of the difference of two pressure maps over the norm of the other's, which is averaged over the cells of the first."""
    inside = RegularGridInterpolator((other.grid.x, other.grid.y), other.pressure, bounds_error=False, fill_value=0.0)
    grid, fifths = finite.grid, (np.arange(5) - 2) / 5
    x, y = (grid.x[:, None] + grid.dx * fifths).ravel(), (grid.y[:, None] + grid.dy * fifths).ravel()
    mean = inside(tuple(np.meshgrid(x, y, indexing="ij"))).reshape(grid.nx, 5, grid.ny, 5).mean(axis=(1, 3))
    return float(np.linalg.norm(finite.pressure - mean) / np.linalg.norm(mean))


def finite_element_patch(tie: Tie, wheel_load: float, size: float, expected: Patch, across: float | None = None, blocks: Blocks = Blocks(),
                         comm: MPI.Comm = MPI.COMM_SELF) -> FinitePatch:
    """The patch under a wheel load [N], by elements of a size [m] along x' and down, and `across` (default the same) along s.

    expected : a solution of `bem` for the same tie, about which the mesh is made fine and whose approach sets the damping
    Raises ArithmeticError when the bodies do not come to rest.
    """
    start = time.perf_counter()
    rail, wheel, fine = _meshes(tie, size, across or size, expected, blocks)
    load, steel = tie.normal_force(wheel_load) / 2, Steel(tie.rail_steel.young, tie.rail_steel.poisson, DENSITY)
    mass = DENSITY * blocks.length * np.ptp(blocks.across) * blocks.depth
    dynamics = press(comm, wheel, rail, load, np.sqrt(1.5 * load / expected.approach / mass), 10.0, mirrors=(0,), steel=steel)
    settle(dynamics, load, 0.4 * load * expected.approach, LONGEST)
    grid, pressure = _map(dynamics.contact, fine)
    cells = 2 * dynamics.domain.m_global
    return FinitePatch(grid, None, pressure, np.nan, f"finite elements, {size * 1e3:.3g} x {grid.dy * 1e3:.3g} mm, {cells} of them", cost=Cost(time.perf_counter() - start, dynamics.step_count, 0))


def _meshes(tie: Tie, size: float, width: float, expected: Patch, blocks: Blocks) -> tuple[HexMesh, HexMesh, tuple[int, np.ndarray]]:
    """Rail, wheel, and the fine part of the surface: number of x planes, s planes (m,) [m], evenly spaced both."""
    pressed = expected.grid.y[expected.pressure.any(axis=0)]
    middle, half = (pressed[0] + pressed[-1]) / 2, (pressed[-1] - pressed[0]) / 2
    columns = int(np.ceil(1.12 * half / width)) + 1
    rows = int(np.ceil(1.12 * expected.extent[0] / 2 / size)) + 1
    across = middle - columns * width, middle + columns * width
    x = graded_line(0.0, blocks.length, (0.0, rows * size), size)
    s = graded_line(*blocks.across, across, width)
    z = graded_line(0.0, blocks.depth, (0.0, np.ceil(0.35 * expected.extent[0] / size) * size), size)
    fine = s[(s > across[0] - width / 2) & (s < across[1] + width / 2)]
    return block(tie.rail_height, x, s, z, "up"), block(tie.wheel_height, x, s, z, "down"), (rows + 1, fine)


def _map(contact: Contact, fine: tuple[int, np.ndarray]) -> tuple[Grid, np.ndarray]:
    """Pressure at the rail's nodes of the fine zone, mirrored: cells about the nodes."""
    rows, s = fine
    reference = contact.reference[: contact.n_rail]
    order = np.lexsort((reference[:, 1], reference[:, 0]))
    places = reference[order].reshape(-1, np.count_nonzero(reference[:, 0] < 1e-9), 3)
    pressure = rail_pressure(contact)[order].reshape(places.shape[:2])
    first = int(np.argmin(np.abs(places[0, :, 1] - s[0])))
    half = pressure[:rows, first : first + len(s)]
    dx, dy = places[1, 0, 0] - places[0, 0, 0], s[1] - s[0]
    return Grid(-(rows - 1) * dx, float(s[0]), dx, dy, 2 * rows - 1, len(s)), np.vstack([half[:0:-1], half])


def rows_with_judge(rail: str, sizes: list[float]) -> list[MethodRow]:
    """Every method of `bem` and finite elements of these sizes [m] along x' (half of that along s, where pressure is steep); the last is the judge."""
    tie = thesis_tie(rail)
    rows = method_rows(tie, rail)
    blocks = slice_contact(Blocks().slices(tie), load=tie.normal_force(WHEEL_LOAD), length=(-0.014, 0.014), estimate=False)
    rows.insert(-1, MethodRow.of("2.5D (b), the finite elements' blocks", blocks))
    expected = rows[-1].patch
    for size in sizes:
        found = finite_element_patch(tie, WHEEL_LOAD, size, expected, size / 2)
        rows.append(MethodRow.of(found.method, found))
    return rows


def draw(cases: dict[str, list[MethodRow]], path: Path) -> None:
    """Pressure across the patch where it is highest, and along it, every method; one row for each rail."""
    from rail_fem.show.style import GREEN, NOSE, ORANGE, TOTAL, WING, lettering, new_figure, save

    colours = {"half-space": (TOTAL, "-"), "2.5D (b), coupled slices": (GREEN, "--"), "2.5D (a) parabolic, 2a = 11.32 mm": (ORANGE, "-"),
               "2.5D (a) elliptic, 2a = 11.32 mm": (WING, "-")}
    with lettering():
        figure = new_figure(4.6 * len(cases))
        axes = figure.subplots(len(cases), 2, squeeze=False)
        for (across, along), (rail, rows) in zip(axes, cases.items()):
            for row in rows:
                colour, style = colours.get(row.method, (NOSE, "o") if row is rows[-1] else (None, None))
                if colour is not None:
                    _profiles(across, along, row, colour, style)
            across.set(title=f"P8 on {rail}, {WHEEL_LOAD / 1e3:.4g} kN: across, at x = 0", xlabel="along the face, from the touch [mm]", ylabel="pressure [MPa]")
            along.set(title="largest over each section, along the patch", xlabel="x [mm]")
            across.axhline(THESIS_ROWS[0].max_pressure / 1e6, color="#777777", linewidth=1, linestyle=":", label="thesis: FEA, largest")
            along.legend(fontsize=9, loc="lower center")
            across.legend(fontsize=9, loc="upper right")
        save(figure, path)


def _profiles(across, along, row: MethodRow, colour: str, style: str) -> None:
    patch = row.patch
    s = patch.grid.y if row.method == "half-space" or style == "o" else patch.grid.y - _touch(patch)
    kind = {"color": colour, "linewidth": 1.3, "markersize": 4, "markerfacecolor": "none", "label": row.method}
    across.plot(s * 1e3, patch.pressure[patch.grid.nx // 2] / 1e6, style, **kind)
    along.plot(patch.grid.x * 1e3, patch.pressure.max(axis=1) / 1e6, style, **kind)


def _touch(patch: Patch) -> float:
    """Lateral coordinate of the first touch [m]: where the gap of the middle section is least."""
    middle = patch.gap[np.abs(patch.grid.x).argmin()]
    return float(patch.grid.y[np.argmin(middle)])


def main(size: list[float] = typer.Option([1.0, 0.6], help="element sizes along the patch [mm]"), out: Path = typer.Option(Path("patch"), help="files to write, without ending")):
    """P8 on BS113A, 49,505 N: all patch solvers against finite elements, beside the thesis."""
    cases, text = {}, ""
    for rail in ("56E1", "60E1"):
        cases[rail] = rows = rows_with_judge(rail, [value * 1e-3 for value in sorted(size, reverse=True)])
        maps = ", ".join(f"{row.method} {map_difference(rows[-1].patch, row.patch):.1%}" for row in rows if row.method in ("half-space", "2.5D (b), the finite elements' blocks"))
        text += f"P8 on {rail}\n\n{table([*rows, *THESIS_ROWS], rows[-1])}\nPressure map of the last finite elements, L2 difference to: {maps}\n\n"
    write_text_atomically(out.with_suffix(".md"), text)
    draw(cases, out.with_suffix(".png"))
    print(text, end="")


if __name__ == "__main__":
    typer.run(main)
