"""Where the half-space is wrong, static finite elements as reference solution: the 2.5D slices must be right there."""

import pytest

from rail_fem.contact.patch_methods import MethodRow
from rail_fem.static_fe.finite_series import finite_series
from rail_fem.studies import patch_limits as study_limits
from rail_fem.studies.patch_limits import (
    CASES,
    HALF_SPACE,
    SLICES,
    centre_across,
    edge_case,
    hollow_case,
    light_patches,
    rows_of,
    seen_along_approach,
)


def judged(case, sizes=(1e-3,)):
    """Rows of half-space, slices and the finest finite elements."""
    half_space, slices = light_patches(case)
    finite = finite_series(case.pair, case.load, slices, list(sizes))[-1]
    return (MethodRow.of(HALF_SPACE, half_space), seen_along_approach(SLICES, slices), MethodRow.of("finite", finite))


def assert_slices_right(slices, finite):
    """Finite elements of 1 x 0.6 mm on patches 8 to 20 mm wide: pressure 1 %, effective area 2 % (Hertz at 7 elements
    across: 0.4 and 1 %), width as its edges scatter, a seventh of an element on each side and half a cell on each side
    of the slices' own."""
    assert slices.max_pressure == pytest.approx(finite.max_pressure, rel=0.01)
    assert slices.effective_area == pytest.approx(finite.effective_area, rel=0.02)
    assert slices.width == pytest.approx(finite.width, abs=2 / 7 * finite.patch.width + slices.patch.grid.dy)
    assert centre_across(slices) == pytest.approx(centre_across(finite), abs=0.05e-3)


def test_at_an_edge_the_half_space_presses_on_the_corner_and_the_slices_do_not():
    """3 mm from the edge: the half-space finds more than twice the pressure, at the corner, and a resultant 0.5 mm
    off."""
    half_space, slices, finite = judged(edge_case(3e-3))
    assert_slices_right(slices, finite)
    assert half_space.max_pressure > 2 * finite.max_pressure
    assert centre_across(half_space) - centre_across(finite) > 0.4e-3


def test_on_a_nose_between_two_edges_the_slices_find_the_shift_to_the_stiffer_side():
    half_space, slices, finite = judged(edge_case(6e-3, 4e-3))
    assert_slices_right(slices, finite)
    assert abs(centre_across(half_space)) < 0.05e-3 < 0.3e-3 < centre_across(finite)


def test_under_a_hollow_tread_the_half_space_is_low_and_the_slices_are_right():
    """Tread of 20.4 on a crown of 20 mm, contact over 58 degrees."""
    half_space, slices, finite = judged(hollow_case(0.02, 1.02))
    assert_slices_right(slices, finite)
    assert half_space.max_pressure < 0.96 * finite.max_pressure


@pytest.mark.validate
@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_slices_are_within_two_percent_of_the_limit_in_every_case(case):
    """Pressure, length, width and effective area; the area's own limit is uncertain by up to 2 % (two edges between
    nodes on 8 mm)."""
    rows, reference, miss = rows_of(case, [1e-3, 0.7e-3, 0.5e-3], lambda line: None)
    slices = rows[1]
    assert slices.max_pressure == pytest.approx(reference.max_pressure, rel=5e-3)
    assert slices.effective_area == pytest.approx(reference.effective_area, rel=5e-3)
    for name in ("length", "width", "area"):
        assert getattr(slices, name) == pytest.approx(getattr(reference, name), rel=0.02 + miss[name]), name


def test_the_study_command_saves_its_table_and_figure(tmp_path, monkeypatch):
    monkeypatch.setattr(study_limits, "CASES", CASES[:1])
    study_limits.study_limits([1.6e-3, 1.2e-3], tmp_path)
    text = (tmp_path / "patch_limits.md").read_text()
    assert text.count("| half-space |") == 1 and "Centre of pressure" in text and "nan" not in text
    assert (tmp_path / "patch_limits.png").read_bytes()[:4] == b"\x89PNG"
