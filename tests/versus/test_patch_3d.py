"""The static patch of P8 on a BS113A rail: half-space and slices against static finite elements, pressure map against
pressure map."""

import numpy as np
import pytest

from bem.halfspace.normal import normal_contact
from bem.slices.coupled import slice_contact
from rail_fem.contact.patch_methods import THESIS_ROWS, WHEEL_LOAD, effective_area, thesis_pair
from rail_fem.static_fe.finite_series import finite_series, map_difference
from rail_fem.studies import patch_methods as study_patch
from rail_fem.studies.patch_methods import COMPARED, pair_blocks, reference_rows, thesis_mesh_row

ASKED = 0.02  # of pressure and patch, by the issue


def test_p8_on_bs113a_meets_finite_elements():
    """11 to 16 elements along the patch and 26 to 37 across: pressure and effective area within what is asked for. The
    finite elements' edge scatters by a seventh of an element on each side (Hertz), their area begins up to a sixth of
    an element outside. Maps: a band of half an element along the edge, where pressure is about a quarter of its mean,
    is 3 % of the norm."""
    pair = thesis_pair("56E1")
    load, blocks = pair.normal_force(WHEEL_LOAD), pair_blocks(pair)
    half_space = pair.patch(WHEEL_LOAD, estimate=False)
    slices = slice_contact(
        blocks.slices(), load=load, cells=(50, 80), length=(-0.014, 0.014), threads=1, estimate=False
    )
    said = []
    coarse, finite = finite_series(blocks, load, half_space, [1e-3, 0.7e-3], said.append)
    assert len(said) == 2 and "to go" in said[0] and "0 s to go" in said[1]
    assert finite.normal_force == pytest.approx(load, rel=1e-4)
    for patch in (half_space, slices):
        assert finite.max_pressure == pytest.approx(patch.max_pressure, rel=ASKED)
        assert effective_area(finite) == pytest.approx(effective_area(patch), rel=ASKED)
        assert finite.extent[0] == pytest.approx(patch.extent[0], abs=2 / 7 * finite.size + patch.grid.dx / 3)
        assert finite.extent[1] == pytest.approx(patch.extent[1], abs=2 / 7 * finite.width + patch.grid.dy / 3)
        around = np.pi * (patch.extent[0] + patch.extent[1]) / 2
        assert (
            patch.contact_area * (1 - ASKED)
            < finite.contact_area
            < patch.contact_area * (1 + ASKED) + around * finite.size / 6
        )
        assert map_difference(finite, patch) < 0.03 and map_difference(finite, patch) < map_difference(coarse, patch)


def test_a_map_differs_from_itself_by_nothing_and_from_a_shifted_one():
    pair = thesis_pair("56E1")
    patch = pair.patch(WHEEL_LOAD, cells=60, estimate=False)
    # averaged over its own cells: half of a cell's pressure is lost at the edge
    assert map_difference(patch, patch) < 0.03
    moved = normal_contact(
        lambda x, y: pair.gap(x - 1e-3, y),
        pair.wheel_steel,
        pair.rail_steel,
        load=pair.normal_force(WHEEL_LOAD),
        window=pair.window(),
        cells=60,
        estimate=False,
    )
    assert map_difference(moved, patch) > 0.1


@pytest.mark.validate
@pytest.mark.parametrize("rail", ["56E1", "60E1"])
def test_half_space_and_slices_are_within_two_percent_of_converged_finite_elements(rail):
    """Pressure, length, width, area and effective area against the limit of 0.7, 0.5 and 0.35 mm."""
    rows, reference, _ = reference_rows(rail, [1e-3, 0.7e-3, 0.5e-3, 0.35e-3], lambda line: None)
    found = {row.method: row for row in rows}
    for method in COMPARED:
        for name in ("max_pressure", "length", "width", "area", "effective_area"):
            assert getattr(found[method], name) == pytest.approx(getattr(reference, name), rel=ASKED), (method, name)
        assert map_difference(reference.patch, found[method].patch) < 0.025


@pytest.mark.validate
def test_the_thesis_finite_elements_are_met_by_ours_of_its_sizes():
    """Pressure 1 %, length half an element, both of them the thesis' own; its width is 1.1 mm more than ours, which the
    mesh does not explain."""
    pair = thesis_pair("60E1")
    half_space = pair.patch(WHEEL_LOAD, estimate=False)
    row, thesis = thesis_mesh_row("60E1", half_space), THESIS_ROWS[0]
    assert row.max_pressure == pytest.approx(thesis.max_pressure, rel=0.01)
    assert row.length == pytest.approx(thesis.length, abs=0.1e-3)
    assert thesis.width - 3.2 * row.patch.width < row.width < thesis.width


@pytest.mark.validate
def test_the_study_command_saves_its_table_and_figures(tmp_path, monkeypatch):
    monkeypatch.setattr(study_patch, "RAILS", ("60E1",))
    monkeypatch.setattr(study_patch, "method_rows", lambda pair, rail: short_rows(pair, rail))
    study_patch.main("methods", [1.5, 1.0], False, False, tmp_path)
    text = (tmp_path / "patch_methods.md").read_text()
    assert (
        text.count("| half-space |") == 1
        and text.count("thesis: FEA") == 1
        and "limit of 1.5, 1 mm" in text
        and "nan" not in text
    )
    for name in ("patch_methods.png",):
        assert (tmp_path / name).read_bytes()[:4] == b"\x89PNG"


def short_rows(pair, rail):
    from rail_fem.contact.patch_methods import method_rows

    return method_rows(pair, rail, cells=(12, 24), threads=1)
