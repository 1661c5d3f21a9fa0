"""A pin in its hole: where the half-space is wrong and the slices are right."""

import numpy as np

from bem.exact.conformal import pin_clearance, pin_pressure
from bem.halfspace.normal import normal_contact
from bem.material import STEEL
from bem.patch import Grid, Patch
from bem.plane.body import Body
from bem.plane.curve import arc
from bem.plane.outline import Edge, Outline
from bem.slices.coupled import SlicePatch, slice_contact
from bem.slices.slices import SliceGap, Slices
from tests.bem.closed_forms import pin_semi_angle

PIN_RADIUS, CLEARANCE = 0.05, 2e-5


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


def conformal_rows(angles: tuple[float, ...]) -> list[dict]:
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


def test_the_half_space_is_wrong_in_a_wide_conformal_contact_and_slices_are_right():
    """Half-angle 75 degrees: slices within 0.5 % of Persson, the half-space off by more than ten times that; at 15
    degrees by no more than angle^2 / 2, the curvature of the face that it neglects."""
    rows = conformal_rows((15, 75))
    narrow, wide = rows
    assert abs(narrow["half-space error"]) < np.radians(15) ** 2 / 2 and abs(narrow["slices error"]) < 5e-3
    assert abs(wide["slices error"]) < 5e-3 and abs(wide["half-space error"]) > 0.05
    inside = wide["Persson profile"] > 0.2
    np.testing.assert_allclose(wide["slices profile"][inside], wide["Persson profile"][inside], rtol=0.03)
