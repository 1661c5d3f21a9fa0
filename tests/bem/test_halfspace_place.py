"""The grid finds the patch where steep surroundings let many cells seem near."""

import numpy as np
import pytest

from bem.halfspace import normal_contact
from bem.hertz import point_contact
from bem.material import STEEL, contact_modulus

ALONG, ACROSS = 0.4, 0.012  # relative radii [m]


@pytest.mark.parametrize("slope, end", [(0.1, 20e-3), (0.3, 22e-3)])
def test_patch_beside_a_wall_and_bodies_that_end_is_hertz(slope, end):
    """A paraboloid that goes on as a slope on one side and as a wall on the other, on bodies that end at |x| = 22 mm and y = `end`.

    The patch lies within the paraboloid, so Hertz is exact; the bound is the discretisation at 32 cells (tests/bem/test_halfspace_normal.py).
    """

    def gap(x, y):
        low = np.where(y > -3e-3, y**2 / (2 * ACROSS), 3e-3**2 / (2 * ACROSS) + 10 * (-y - 3e-3))
        side = np.where(y < slope * ACROSS, low, slope * y - slope**2 * ACROSS / 2)
        return np.where((np.abs(x) < 22e-3) & (y < end), x**2 / (2 * ALONG) + side, np.inf)

    exact = point_contact(60e3, ALONG, ACROSS, contact_modulus(STEEL, STEEL))
    assert exact.semi_y < slope * ACROSS
    found = normal_contact(gap, STEEL, STEEL, load=60e3, window=((-0.025, 0.025), (-0.025, 0.025)), cells=32, estimate=False)
    assert found.max_pressure == pytest.approx(exact.max_pressure, rel=5e-3)
    assert found.normal_force == pytest.approx(60e3, rel=1e-6)
