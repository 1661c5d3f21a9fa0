"""The grid finds the patch where steep surroundings let many cells seem near."""

import numpy as np
import pytest

from bem.exact.hertz import point_contact
from bem.halfspace.normal import normal_contact
from bem.material import STEEL, contact_modulus
from bem.patch import PatchCutError

ALONG, ACROSS = 0.4, 0.012  # relative radii [m]


@pytest.mark.parametrize("slope, end", [(0.1, 20e-3), (0.3, 22e-3)])
def test_patch_beside_a_wall_and_bodies_that_end_is_hertz(slope, end):
    """A paraboloid that goes on as a slope on one side and as a wall on the other, on bodies that end at |x| = 22 mm
    and y = `end`.

    The patch lies within the paraboloid, so Hertz is exact; the bound is the discretisation at 32 cells
    (tests/bem/test_halfspace_normal.py).
    """

    def gap(x, y):
        low = np.where(y > -3e-3, y**2 / (2 * ACROSS), 3e-3**2 / (2 * ACROSS) + 10 * (-y - 3e-3))
        side = np.where(y < slope * ACROSS, low, slope * y - slope**2 * ACROSS / 2)
        return np.where((np.abs(x) < 22e-3) & (y < end), x**2 / (2 * ALONG) + side, np.inf)

    exact = point_contact(60e3, ALONG, ACROSS, contact_modulus(STEEL, STEEL))
    assert exact.semi_y < slope * ACROSS
    found = normal_contact(
        gap, STEEL, STEEL, load=60e3, window=((-0.025, 0.025), (-0.025, 0.025)), cells=32, estimate=False
    )
    assert found.max_pressure == pytest.approx(exact.max_pressure, rel=5e-3)
    assert found.normal_force == pytest.approx(60e3, rel=1e-6)


@pytest.mark.parametrize("seed", range(12))
def test_window_that_cuts_the_patch_ends_with_a_sentence(seed):
    """Windows within a patch of 13 x 10 mm, some far finer than it: the search stretched the grid for ever where the
    edges were rounded."""
    draw = np.random.default_rng(seed)
    (left, right), (low, high) = draw.uniform(-6e-3, -1e-3, 2), draw.uniform(1e-3, 4e-3, 2)
    with pytest.raises(PatchCutError, match="cuts the patch at"):
        normal_contact(
            lambda x, y: x**2 / 0.92 + y**2 / 0.6,
            STEEL,
            STEEL,
            load=80e3,
            window=((left, low), (right, high)),
            cells=24,
            estimate=False,
        )


def test_load_far_above_what_the_window_holds_ends_with_a_sentence():
    with pytest.raises(PatchCutError, match="x_min.*x_max.*y_min.*y_max"):
        normal_contact(
            lambda x, y: x**2 / 0.92 + y**2 / 0.6, STEEL, STEEL, load=1e8, window=((-0.05, 0.05), (-0.05, 0.05))
        )
