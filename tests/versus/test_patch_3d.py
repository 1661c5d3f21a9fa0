"""The static patch of P8 on a BS113A rail: half-space and slices against explicit finite elements at rest, pressure map against pressure map."""

import numpy as np
import pytest

from bem.halfspace import normal_contact
from bem.slice_contact import slice_contact
from rail_fem.fe import study_patch
from rail_fem.fe.study_patch import Blocks, finite_element_patch, map_difference
from rail_fem.patch_methods import WHEEL_LOAD, thesis_tie


SMALL = Blocks(length=0.020, across=(-0.018, 0.024), depth=0.025)


def solved(rail, sizes, blocks):
    """Half-space, slices of the finite elements' blocks, and finite elements of these sizes along x' [m], half of that across."""
    tie = thesis_tie(rail)
    load = tie.normal_force(WHEEL_LOAD)
    half_space = normal_contact(tie.gap, tie.wheel_steel, tie.rail_steel, load=load, window=tie.window(), cells=88, estimate=False)
    slices = slice_contact(blocks.slices(tie), load=load, cells=(50, 80), length=(-0.014, 0.014), threads=1, estimate=False)
    return half_space, slices, [finite_element_patch(tie, WHEEL_LOAD, size, half_space, size / 2, blocks) for size in sizes]


def assert_same_patch(finite, patch):
    """The issue's goal, 2 % in pressure. The finite elements' edge lies between two nodes: half an element on each side along x; across, where
    the patch ends bluntly at 260 MPa and the balanced contact loads one node more, a whole one. Maps: a band of half an element along the edge, where
    pressure is about a quarter of its mean, is 4 % of the norm."""
    assert finite.max_pressure == pytest.approx(patch.max_pressure, rel=0.02)
    assert map_difference(finite, patch) < 0.04
    assert finite.extent[0] == pytest.approx(patch.extent[0], abs=finite.grid.dx + patch.grid.dx / 2)
    assert finite.extent[1] == pytest.approx(patch.extent[1], abs=2 * finite.grid.dy + patch.grid.dy / 2)


def test_p8_on_bs113a_meets_finite_elements():
    """10 elements along and 29 across the patch; blocks 20 mm long each way, 42 mm wide and 25 mm deep cost 0.2 % of the pressure (slices)."""
    half_space, slices, (finite,) = solved("56E1", [1e-3], SMALL)
    assert slices.max_pressure == pytest.approx(half_space.max_pressure, rel=5e-3)
    for patch in (half_space, slices):
        assert_same_patch(finite, patch)
    assert finite.normal_force == pytest.approx(half_space.normal_force, rel=1e-3)
    np.testing.assert_allclose(finite.pressure, finite.pressure[::-1])


def test_a_map_differs_from_itself_by_nothing_and_from_a_shifted_one():
    tie = thesis_tie("56E1")
    patch = normal_contact(tie.gap, tie.wheel_steel, tie.rail_steel, load=5e4, window=tie.window(), cells=60, estimate=False)
    assert map_difference(patch, patch) < 0.03          # averaged over its own cells: half of a cell's pressure is lost at the edge
    moved = normal_contact(lambda x, y: tie.gap(x - 1e-3, y), tie.wheel_steel, tie.rail_steel, load=5e4, window=tie.window(), cells=60, estimate=False)
    assert map_difference(moved, patch) > 0.1


@pytest.mark.validate
@pytest.mark.parametrize("rail", ["56E1", "60E1"])
def test_finite_elements_converge_to_half_space_and_slices(rail):
    half_space, slices, coarse_and_fine = solved(rail, [1e-3, 0.6e-3], Blocks())
    for patch in (half_space, slices):
        assert_same_patch(coarse_and_fine[-1], patch)
        assert map_difference(coarse_and_fine[-1], patch) < map_difference(coarse_and_fine[0], patch)


@pytest.mark.validate
def test_the_study_command_saves_its_table_and_figure(tmp_path):
    study_patch.main([1.0], tmp_path / "patch")
    text = (tmp_path / "patch.md").read_text()
    assert text.count("| half-space |") == 2 and text.count("thesis: FEA") == 2
    assert (tmp_path / "patch.png").read_bytes()[:4] == b"\x89PNG"
