"""Means, integral and volumes of plastic strain on fields whose answers are known."""

import numpy as np
import pytest
from scipy.special import erf

from geometry.meshing.blocks import mesh_box
from rail_fem.result import plastic_zone as module
from rail_fem.result.plastic_zone import BLOCK, LEVELS, NAMES, plastic_zone, worst_mean

MM = 1e-3


def box(size, length=(24 * MM, 20 * MM, 12 * MM), lift=0.0):
    """Corners of cubes of `size` in a box whose top is at z = lift and whose middle is at x = y = 0."""
    counts = tuple(round(l / size) for l in length)
    mesh = mesh_box(length, counts)
    points = mesh.points - [length[0] / 2, length[1] / 2, length[2] - lift]
    return points[mesh.cells]


def zone(corners, strain, stress=None):
    return plastic_zone(corners, strain, np.zeros((len(strain), 2)) if stress is None else stress)


def test_a_linear_field_has_the_means_of_a_linear_field():
    """5 % at the surface falling to nothing 10 mm below it: layers of 1 mm hold 4.75, 4.25 % and so on."""
    corners = box(1 * MM)
    depth = -corners[:, :, 2].mean(axis=1)
    found = zone(corners, np.maximum(0.05 * (1 - depth / (10 * MM)), 0.0))
    area = 24 * 20 * MM**2
    assert found.values["integral"] == pytest.approx(0.05 * 10 * MM / 2 * area, rel=1e-12)
    assert found.values["block"] == pytest.approx(0.05 * (1 - 1.5 / 10), rel=1e-12)
    # 1000 mm3 are the first layer of 480 mm2, the second, and 40 mm3 of the third
    assert found.values["worst_1000"] == pytest.approx((480 * 4.75 + 480 * 4.25 + 40 * 3.75) / 1000 / 100, rel=1e-12)
    assert found.values["worst_10"] == pytest.approx(0.0475, rel=1e-12)
    # centres at depths 0.5, 1.5, ... mm: four layers lie above 3 %, all but the deepest two above 1 %, none above 5 %
    layers = {"volume_1": 8, "volume_3": 4, "volume_5": 0, "volume_10": 0}
    for name, count in layers.items():
        assert found.values[name] == pytest.approx(count * MM * area, rel=1e-12, abs=1e-20)
    assert found.profile[:4] == pytest.approx([0.0475, 0.0475, 0.0425, 0.0425], rel=1e-12)
    assert found.depth[:2] == pytest.approx([0.25 * MM, 0.75 * MM]) and found.block[2] == pytest.approx(0.0, abs=1e-15)
    assert found.maximum == pytest.approx(0.0475) and found.size == pytest.approx(1 * MM)
    assert set(found.values) == set(NAMES) and set(found.plain()) >= {"values", "maximum", "size", "position"}


@pytest.mark.parametrize("size", [0.5, 1.0, 2.0, 4.0])
def test_the_block_takes_parts_of_cells_that_it_cuts(size):
    """A slab of 4 x 4 mm of metal strained by 6 % from the surface to 4 mm below: 16 of the block's 25 mm2 anywhere
    that it fits."""
    corners = box(size * MM, (24 * MM, 24 * MM, 12 * MM))
    centre = corners.mean(axis=1)
    inside = (np.abs(centre[:, 0] - 2 * MM) < 2 * MM) & (np.abs(centre[:, 1] - 2 * MM) < 2 * MM)
    found = zone(corners, np.where(inside & (centre[:, 2] > -4 * MM), 0.06, 0.0))
    assert found.values["block"] == pytest.approx(0.06 * 16 / 25, rel=1e-12)
    assert np.all(np.abs(np.array(found.block[:2]) - 2 * MM) <= 0.5 * MM + 1e-12)
    assert found.profile[[0, 7, 8, 19]] == pytest.approx([0.06 * 16 / 25] * 2 + [0.0] * 2, abs=1e-15)


def bump(points):
    """A smooth zone 4 mm below the surface with its middle off every mesh line."""
    return 0.1 * np.exp(-(((points - [0.7 * MM, -0.4 * MM, -4 * MM]) / (3 * MM)) ** 2).sum(axis=-1))


def test_means_integral_and_volumes_of_a_smooth_zone_do_not_hang_on_the_mesh():
    """Cells hold the field at their middles: means and integral are within 4 % at 2 mm and a quarter of that at 1 mm;
    volumes above a level are within a part of a layer of cells."""
    exact = zone(box(0.25 * MM), bump(box(0.25 * MM).mean(axis=1))).values
    for size, mean, volume in ((2.0, 0.04, 0.15), (1.0, 0.01, 0.06), (0.5, 0.0025, 0.03)):
        corners = box(size * MM)
        found = zone(corners, bump(corners.mean(axis=1))).values
        for name in ("worst_100", "worst_1000", "block", "integral"):
            assert found[name] == pytest.approx(exact[name], rel=mean), (name, size)
        for name in LEVELS:
            assert found[name] == pytest.approx(exact[name], rel=volume, abs=1e-12), (name, size)
    # the integral of the bump over the body, by error functions
    reach = [(erf((h - m) / 3) - erf((l - m) / 3)) / 2 for l, h, m in ((-12, 12, 0.7), (-10, 10, -0.4), (-12, 0, -4))]
    assert exact["integral"] == pytest.approx(0.1 * np.pi**1.5 * (3 * MM) ** 3 * np.prod(reach), rel=1e-3)


def test_the_block_follows_a_surface_that_falls():
    """Metal cut by a slope of 1 in 4 across: what lies within 3 mm below it counts, and depth is counted from it."""
    corners = box(0.5 * MM)
    slope = corners.copy()
    slope[..., 2] += 0.25 * slope[..., 1]
    depth = -corners[:, :, 2].mean(axis=1)
    strain = np.where(depth < 3 * MM, 0.04, 0.0)
    found = zone(slope, strain)
    assert found.values["block"] == pytest.approx(0.04, rel=0.03)
    assert found.profile[1] == pytest.approx(0.04, rel=1e-9) and found.profile[-1] == 0.0


def test_stresses_are_means_over_the_same_layers():
    corners = box(1 * MM)
    depth = -corners[:, :, 2].mean(axis=1)
    found = zone(corners, np.where(depth < 2 * MM, 0.02, 0.0), np.column_stack([1e8 * depth / MM, -2e8 * depth / MM]))
    assert found.stress[:2] == pytest.approx(np.array([[0.5e8, -1e8]] * 2), rel=1e-12)


def test_a_body_smaller_than_what_is_asked_for_has_no_such_mean():
    corners = box(1 * MM, (4 * MM, 4 * MM, 4 * MM))
    found = zone(corners, np.full(64, 0.03))
    assert np.isnan(found.values["worst_100"]) and np.isnan(found.values["block"])
    assert found.values["worst_10"] == pytest.approx(0.03)
    assert np.isnan(worst_mean(np.ones(3), np.ones(3), 4.0)) and np.prod(BLOCK) > 64e-9


def test_metal_without_plastic_strain_has_none():
    corners = box(2 * MM)
    found = zone(corners, np.zeros(len(corners)))
    assert found.maximum == 0.0 and found.values["block"] == 0.0 and found.values["integral"] == 0.0


def test_a_zone_along_the_whole_body_is_looked_at_in_stretches(monkeypatch):
    """Strain between half of its largest value and all of it over 0.24 m: the block, its layers and stresses of stretch
    by stretch are those of all at once, which took gigabytes over a whole crossing."""
    corners = box(2 * MM, (240 * MM, 12 * MM, 12 * MM))
    x, y, z = corners.mean(axis=1).T
    strain = 0.05 * (0.8 + 0.2 * np.sin(37 * x)) * np.exp(-((z - z.max()) ** 2 + (y - 0.7 * MM) ** 2) / (20 * MM) ** 2)
    found = zone(corners, strain)
    monkeypatch.setattr(module, "STRETCH", np.inf)
    whole = zone(corners, strain)
    assert found.values["block"] == pytest.approx(whole.values["block"], rel=1e-12)
    assert found.block == pytest.approx(whole.block) and found.profile == pytest.approx(whole.profile, rel=1e-12)
