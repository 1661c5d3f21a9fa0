"""All patch solvers on one patch, and where the half-space is wrong: python -m bem.verification.halfspace_speed --out
DIR.

Tables and figures:
  speed_error   half-space, rolling, shift, FASTSIM (bem/verification/halfspace_study.py) and both slice methods on the
  same ellipse, with Kalker's CONTACT creep_curves  longitudinal, lateral and spin by the full theory and FASTSIM
  conformal     a pin in its hole, a long patch: pressure in its middle against the contact's half-angle, Persson's
  solution as judge
The slices' ellipse is pressed between blocks 12 to 16 times as wide as the patch; those cost 0.1 % of the pressure,
which the rows keep.
"""

from __future__ import annotations

import numpy as np

from bem.exact.conformal import pin_clearance, pin_pressure, pin_semi_angle
from bem.halfspace.figures import conformal_figure, creep_curves_figure
from bem.halfspace.normal import normal_contact
from bem.material import STEEL
from bem.patch import Grid, Patch
from bem.plane.body import Body
from bem.plane.curve import arc
from bem.plane.outline import Edge, Outline, block_behind
from bem.slices.assumed_load import loaded_slices
from bem.slices.coupled import SlicePatch, slice_contact
from bem.slices.slices import SliceGap, Slices, wheel_on_prism
from bem.verification import halfspace_study

PIN_RADIUS, CLEARANCE = 0.05, 2e-5
ANGLES = (15, 30, 45, 60, 75)
_BLOCK = 0.08


def ellipse_slices() -> Slices:
    """The study's ellipse as slices: a flat-treaded wheel on a round rail, blocks 160 mm wide and 120 mm deep."""
    y = np.linspace(-_BLOCK, _BLOCK, 401)
    radius = halfspace_study.RADII[1]
    crown = np.column_stack([y, np.sqrt(radius**2 - y**2) - radius])
    tread = np.column_stack([y, y**2 / 2e4])
    return wheel_on_prism(
        Body(block_behind(crown, -0.12), STEEL), Body(block_behind(tread, 0.12), STEEL), halfspace_study.RADII[0]
    )


def slice_rows(sizes: tuple[int, ...]) -> list[dict]:
    """Seconds and error of the largest pressure of both slice methods, n slices of n cells."""
    slices, exact, rows = ellipse_slices(), halfspace_study.hertz().max_pressure, []
    methods = {
        "2.5D (b), coupled slices": lambda n: slice_contact(
            slices, load=halfspace_study.LOAD, cells=(n, n), threads=1, estimate=False
        ),
        "2.5D (a), parabolic load": lambda n: loaded_slices(
            slices, load=halfspace_study.LOAD, cells=(n, n), estimate=False
        ),
    }
    for name, solver in methods.items():
        for n in sizes:
            seconds, patch = halfspace_study.least_seconds(lambda: solver(n))
            rows.append(halfspace_study.speed_row(name, n, seconds, abs(patch.max_pressure / exact - 1)))
    return rows


def pin_in_hole(degrees: float) -> tuple[SlicePatch, Patch, int]:
    """A pin in its hole under the load at which the contact's half-angle is as given, by slices and by the half-space,
    and the middle slice.

    A patch 2 m long, 40 times the pin's radius: its middle is plane strain.
    """
    angle = np.radians(degrees)
    hole = Body(Outline([[Edge(arc((0, 0), PIN_RADIUS, np.pi / 2, 2.5 * np.pi, 721), "face")]], infinite=True), STEEL)
    pin = Body(
        Outline(
            [
                [Edge(arc((0, 0), PIN_RADIUS - CLEARANCE, np.pi / 2, 2.5 * np.pi, 721), "face")],
                [Edge(arc((0, 0), 0.1 * PIN_RADIUS, 0, 2 * np.pi, 181), "hub")],
            ]
        ),
        STEEL,
        held="hub",
    )
    slices = Slices(hole, pin)
    middle, reach = SliceGap(slices).first_point[0], 1.15 * PIN_RADIUS * angle
    grid = Grid.over((-1, 1), (middle - reach, middle + reach), 41, 80)
    load = 2 * STEEL.plane_modulus / 2 * CLEARANCE / pin_clearance(angle)
    patch = slice_contact(slices, load=load, grid=grid, cut=True, threads=1, estimate=False)
    flat = normal_contact(
        patch.gap, STEEL, STEEL, load=patch.line_load.sum() * grid.dx, grid=grid, cut=True, estimate=False
    )
    return patch, flat, 20


def conformal_rows(angles: tuple[float, ...] = ANGLES) -> list[dict]:
    """For each half-angle: p R / line load in the middle of the contact by Persson, slices and half-space, and the
    profiles across it.

    Errors are against Persson's contact under the line load of the method's own middle slice. At wide angles the
    half-space's patch spreads to the end of the grid, 1.15 times the true half-angle, and is pressed there as by a flat
    punch.
    """
    rows = []
    for degrees in angles:
        patch, flat, middle = pin_in_hole(degrees)
        row = {"degrees": degrees, "angle": (patch.grid.y - patch.grid.y.mean()) / PIN_RADIUS}
        for name, found in (("slices", patch), ("half-space", flat)):
            line_load = patch.line_load[middle] if found is patch else found.pressure[middle].sum() * found.grid.dy
            semi_angle = pin_semi_angle(STEEL.plane_modulus / 2 * CLEARANCE / line_load)
            row[name] = found.pressure[middle, found.grid.ny // 2] * PIN_RADIUS / line_load
            row[f"{name} error"] = row[name] / pin_pressure(0.0, semi_angle) - 1
            row[f"{name} profile"] = found.pressure[middle] * PIN_RADIUS / line_load
        inside = np.abs(row["angle"]) < semi_angle_of(patch, middle)
        row["Persson profile"] = np.zeros(len(row["angle"]))
        row["Persson profile"][inside] = pin_pressure(row["angle"][inside], semi_angle_of(patch, middle))
        row["Persson"] = pin_pressure(0.0, semi_angle_of(patch, middle))
        rows.append(row)
    return rows


def semi_angle_of(patch: SlicePatch, middle: int) -> float:
    """Half-angle [rad] of Persson's contact under the line load of the middle slice."""
    return pin_semi_angle(STEEL.plane_modulus / 2 * CLEARANCE / patch.line_load[middle])


def speed_rows(quick: bool = False) -> list[dict]:
    """Every method on the study's ellipse, and CONTACT's numbers."""
    seconds, _ = halfspace_study.least_seconds(halfspace_study.hertz, 0.1)
    rows = [halfspace_study.speed_row("Hertz, closed form", 0, seconds, float("nan"))]
    rows += halfspace_study.normal_rows((22, 44) if quick else (22, 44, 88, 176, 352, 704))
    rows += slice_rows((12, 22) if quick else (12, 22, 44, 88))
    return rows + halfspace_study.tangential_rows((11, 22, 44) if quick else (22, 44, 88, 176))


def main(arguments: list[str] | None = None) -> None:
    options = halfspace_study.read_options(arguments, __doc__.splitlines()[0], "study3d")
    rows = speed_rows(options.quick)
    halfspace_study.report_speed_error(rows, options.out)
    creep_curves_figure(
        halfspace_study.creep_curves(22 if options.quick else 44, 7 if options.quick else 21),
        str(options.out / "creep_curves.png"),
    )
    conformal = conformal_rows((30, 75) if options.quick else ANGLES)
    print(f"\n{'pin in hole [deg]':>20s} {'p R / P, Persson':>18s} {'slices':>10s} {'half-space':>12s}   (errors)")
    for row in conformal:
        print(
            f"{row['degrees']:20g} {row['Persson']:18.4f} {row['slices error']:+10.2%} {row['half-space error']:+12.2%}"
        )
    conformal_figure(conformal, str(options.out / "conformal.png"))
    print(f"written: {options.out}/speed_error.csv, speed_error.png, creep_curves.png, conformal.png")


if __name__ == "__main__":
    main()
