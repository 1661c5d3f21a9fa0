"""One static patch by every method of `bem`: what the thesis' Table 6-3 compares, P8 on BS113A under 49,505 N.

    table = method_rows(thesis_pair("56E1"), "56E1")

The thesis gives its profiles only as pictures and names its rail a generic BS113A. Two heads are compared here. On the
BS113A of the standard (56E1) the crown's arc of 305 mm ends 5.9 mm from the middle, and no lateral shift makes the
patch wider than 14.9 mm. With the crown's arc out to 10.2 mm, as on a 60E1 head, the same wheel on a centred wheelset
meets the thesis' contact angle (0.083 against 0.086), its position (10.8 against 10.6 mm from the middle of the head),
its FE pressure (926 against 921 MPa) and nearly its patch. So the thesis' figures are read here as those of such a
head; it is an inference from its numbers, not something it says.

Static finite elements of the thesis' sizes, 0.2 x 0.38 mm, on that head give 918 MPa, and 9.60 x 17.77 mm read to the
next node without pressure, as a contour plot shows it: the thesis' 9.59 mm in length is its element on each side of
9.24 mm. Its width, 18.88 mm, is 1.1 mm more, which the mesh does not explain. The lateral position might: 0.25 mm of it
change the width by 1.6 mm, pressure by 8 %.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bem.exact.hertz import PointContact
from bem.material import Elastic
from bem.patch import Patch
from bem.plane.body import Body
from bem.plane.outline import block_behind
from bem.slices.assumed_load import hertz_of, loaded_slices
from bem.slices.coupled import slice_contact
from bem.slices.slices import SliceGap, Slices, wheel_on_prism
from geometry.profiles.rail import rail_head
from rail_fem.contact.contact_pairs import INCLINATION, ContactPair, plain_rail_pair
from rail_fem.files.markdown import markdown_table

WHEEL_LOAD = 49505.0
BLOCKS = "2.5D (b), the finite elements' blocks"
THESIS_STEEL = Elastic(201e9, 0.3)
THESIS_HALF_LENGTH = 11.32e-3 / 2  # Hertz' in the thesis, which its slices take over


def plain_rail_section(pair: ContactPair, rail: str = "56E1") -> tuple[Body, Body]:
    """Rail and wheel of `plain_rail_pair` as plane bodies y, z in place: the thesis' fourth case of chapter 5.

    The whole profiles, closed by straight sides to held edges 100 mm below the crown and 150 mm above the tread datum.
    """
    _, y, z = pair.wheel.position
    wheel = pair.wheel.profile.points + [y, z]
    return (
        Body(block_behind(rail_head(rail, INCLINATION).points, -0.100), pair.rail_steel),
        Body(block_behind(wheel, z + 0.150), pair.wheel_steel),
    )


@dataclass(frozen=True)
class MethodRow:
    """max_pressure [Pa], length and width of the patch, area [m, m^2], seconds; effective_area [m^2] : see below; patch
    is None where there is only a closed form."""

    method: str
    max_pressure: float
    length: float
    width: float
    area: float
    seconds: float = float("nan")
    patch: Patch | None = None
    effective_area: float = float("nan")

    @property
    def known_patch(self) -> Patch:
        """The patch. Errors: ValueError where there is only a closed form."""
        if self.patch is None:
            raise ValueError(f"{self.method}: a closed form, it has no cells")
        return self.patch

    @classmethod
    def of(cls, method: str, patch: Patch) -> MethodRow:
        """The numbers of a solver's patch."""
        area, seconds = patch.contact_area, patch.cost.seconds
        return cls(method, patch.max_pressure, *patch.extent, area, seconds, patch, effective_area(patch))


def effective_area(patch: Patch) -> float:
    """9/8 (integral of p)^2 / integral of p^2 [m^2]: the area of the Hertz patch that would press as evenly; blind to
    where the edge lies between cells."""
    return 9 / 8 * float(patch.pressure.sum() ** 2 / (patch.pressure**2).sum()) * patch.grid.cell_area


THESIS_ROWS = (
    MethodRow("thesis: FEA (Abaqus, 37,164 s over 16 CPUs)", 921.42e6, 9.59e-3, 18.88e-3, float("nan"), 37164.17),
    MethodRow("thesis: 2.5D BEM, parabolic", 804.90e6, 11.32e-3, 18.40e-3, float("nan"), 28.31 * 60),
    MethodRow("thesis: Hertz", 1029.90e6, 11.32e-3, 8.04e-3, float("nan"), 3.7278e-4 * 60),
)


def thesis_pair(rail: str) -> ContactPair:
    """P8 on a rail inclined 1:20, gauge 1435, back-to-back 1360, wheelset centred, E 201 GPa."""
    return plain_rail_pair(rail=rail, wheel_steel=THESIS_STEEL, rail_steel=THESIS_STEEL)


def section_slices(pair: ContactPair, rail: str) -> Slices:
    """Slices of wheel and rail in place: whole profiles, the wheel turned about its axle."""
    lower, upper = plain_rail_section(pair, rail)
    return wheel_on_prism(lower, upper, pair.wheel.position[2] + pair.wheel.rolling_radius)


def method_rows(
    pair: ContactPair, rail: str, cells: tuple[int, int] = (50, 80), threads: int | None = None
) -> list[MethodRow]:
    """Hertz, 2.5D by load, 2.5D by displacement and the half-space on one contact pair under WHEEL_LOAD."""
    slices = section_slices(pair, rail)
    exact: PointContact = hertz_of(SliceGap(slices), WHEEL_LOAD)
    numbers = exact.max_pressure, 2 * exact.semi_x, 2 * exact.semi_y, exact.area
    rows = [MethodRow("Hertz, radii at the initial contact", *numbers, effective_area=exact.area)]
    for sharing in ("elliptic", "parabolic"):
        for name, half in (("Hertz' length", None), ("2a = 11.32 mm", THESIS_HALF_LENGTH)):
            patch = loaded_slices(
                slices, load=WHEEL_LOAD, sharing=sharing, semi_length=half, cells=cells, estimate=False
            )
            rows.append(MethodRow.of(f"2.5D (a) {sharing}, {name}", patch))
    coupled = slice_contact(slices, load=WHEEL_LOAD, cells=cells, threads=threads, estimate=False)
    rows.append(MethodRow.of("2.5D (b), coupled slices", coupled))
    return [*rows, MethodRow.of("half-space", pair.patch(WHEEL_LOAD, estimate=False))]


def table(rows: list[MethodRow], reference: MethodRow) -> str:
    """Markdown; each quantity, and its difference to the reference's where it is not the reference."""
    head = ("method", "p_max [MPa]", "2a [mm]", "2b [mm]", "area [mm2]", "effective area [mm2]", "seconds")
    lines = []
    for row in rows:
        cells = [
            _cell(value / unit, digits, None if row is reference else value / right - 1)
            for value, right, unit, digits in zip(
                _numbers(row), _numbers(reference), (1e6, 1e-3, 1e-3, 1e-6, 1e-6), (1, 2, 2, 1, 1)
            )
        ]
        lines.append([row.method, *cells, "" if np.isnan(row.seconds) else format(row.seconds, ".3g")])
    return "\n".join(markdown_table(head, lines)) + "\n"


def _numbers(row: MethodRow) -> tuple[float, ...]:
    return row.max_pressure, row.length, row.width, row.area, row.effective_area


def _cell(value: float, digits: int, difference: float | None) -> str:
    if np.isnan(value):
        return ""
    return (
        f"{value:.{digits}f}"
        if difference is None or np.isnan(difference)
        else f"{value:.{digits}f} ({difference:+.1%})"
    )


def contact_point_of(patch: Patch) -> float:
    """Lateral coordinate of the first point of contact [m]: where the gap of the middle section is least."""
    middle = patch.known_gap[np.abs(patch.grid.x).argmin()]
    return float(patch.grid.y[np.argmin(middle)])
