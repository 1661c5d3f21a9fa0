"""Depths worn off a crossing's surfaces: volume, bounds, what searches and meshes see of them."""

import numpy as np
import pytest

from geometry.path.wheel_path import wheel_path
from geometry.profiles.wheel import wheel_profile
from geometry.surfaces.crossing import CastCrossing
from geometry.surfaces.depth_field import SPREAD, DepthField, depths_at
from geometry.surfaces.surface_height import height_of, surface_height
from geometry.surfaces.worn_crossing import WornCrossing

RNG = np.random.default_rng(4)
BASE = CastCrossing(9.25)


def field(depth, x0=0.2, dx=2e-3, y0=-0.06, dy=0.5e-3):
    return DepthField(x0, dx, y0, dy, np.ascontiguousarray(depth, float))


def bump(height=50e-6, shape=(60, 200)):
    depth = np.zeros(shape)
    depth[20:40, 40:160] = height * RNG.uniform(0.2, 1.0, (20, 120))
    return field(depth)


NOTHING = field(np.zeros((5, 5)))


def test_volume_between_the_surfaces_is_the_sum_of_the_depths():
    """The trapezoidal rule on lines of the grid's spacing is exact for B-splines: 1e-13, on any offset of the lines."""
    own = bump()
    for offset in (0.0, 0.3, 0.77):
        x = own.x0 + own.dx * (np.arange(-4, 66) + offset)
        y = own.y0 + own.dy * (np.arange(-4, 206) + offset / 2)
        at = np.meshgrid(x, y, indexing="ij")
        volume = depths_at(at[0].ravel(), at[1].ravel(), own).sum() * own.dx * own.dy
        assert volume == pytest.approx(own.volume, rel=1e-12)


def test_depths_stay_between_nought_and_the_largest():
    own = bump()
    x, y = RNG.uniform(0.2, 0.32, 4000), RNG.uniform(-0.06, 0.04, 4000)
    depth = depths_at(x, y, own)
    assert depth.min() >= 0 and depth.max() <= own.depth.max()


def test_a_depth_is_spread_by_what_is_stated():
    one = np.zeros((9, 41))
    one[4, 20] = 1e-5
    own = field(one, x0=0.0, y0=0.0)
    y = np.linspace(0, 40 * own.dy, 4001)
    row = depths_at(np.full(len(y), 4 * own.dx), y, own)
    assert np.sqrt(np.average((y - 20 * own.dy) ** 2, weights=row)) == pytest.approx(SPREAD * own.dy, rel=1e-3)


def test_the_slope_is_continuous_everywhere():
    """Differences over 1 um across a line of the grid and beside it agree: the field has no kinks of its own."""
    own, step = bump(), 1e-7
    y = own.y0 + own.dy * np.arange(88, 112)
    x = np.full(len(y), 0.26)
    before, at, after = (depths_at(x, y + k * step, own) for k in (-1, 0, 1))
    assert np.abs(after - 2 * at + before).max() < 1e-3 * np.abs(after - before).max()


@pytest.mark.parametrize("body", ["wing", "nose"])
def test_compiled_search_and_arrays_see_the_same_surface(body):
    worn = WornCrossing(BASE, bump(), bump())
    x, y = RNG.uniform(0.2, 0.32, 300), RNG.uniform(-0.03, 0.02, 300)
    heights, nose = worn.heights(x, y, body), body == "nose"
    compiled = [surface_height(a, b, nose, *worn.tables) for a, b in zip(x, y, strict=True)]
    plain = [height_of(a, b, nose, *worn.tables) for a, b in zip(x[:20], y[:20], strict=True)]
    assert np.abs(heights - compiled).max() < 1e-15 and np.abs(heights[:20] - plain).max() < 1e-15
    assert (heights <= BASE.heights(x, y, body)).all() and (heights < BASE.heights(x, y, body)).any()


def test_a_wheel_sinks_by_an_even_depth():
    """Both bodies lowered everywhere by 0.1 mm: the path is 0.1 mm lower, its points and transfers are the same."""
    even = field(np.full((500, 400), 1e-4), x0=-0.1, y0=-0.1)
    x = np.arange(0.3, 0.4, 5e-3)
    worn, unworn = (wheel_path(wheel_profile("P8"), c, x) for c in (WornCrossing(BASE, even, even), BASE))
    assert np.abs(unworn.height - worn.height - 1e-4).max() < 1e-9
    assert worn.transfers == pytest.approx(unworn.transfers, abs=1e-6)
    np.testing.assert_allclose(worn.nose_gap, unworn.nose_gap, atol=1e-9)


def test_sections_for_the_mesh_are_lowered():
    worn = WornCrossing(BASE, bump(), NOTHING)
    old, new = BASE.wing_section(0.26), worn.wing_section(0.26)
    assert new.shape == old.shape and (new[:, 0] == old[:, 0]).all()
    assert np.abs(old[:, 1] - new[:, 1] - worn.depth(np.full(len(old), 0.26), old[:, 0], "wing")).max() < 1e-15
    assert worn.nose_section(BASE.nose_x - 0.01) is None and worn.wing_features == BASE.wing_features
