"""From the patches' strips to the rail: volume, the strip's sum where nothing changes."""

import numpy as np
import pytest

from bem.halfspace.rolled_ellipses import rolled_ellipses
from bem.material import STEEL
from rail_fem.damage.deposit import Footprints, deposit
from rail_fem.damage.wear import dry_laws

LINES = np.arange(0, 101) * 2e-3
ACROSS = np.arange(-20, 21) * 0.5e-3
LAWS = dry_laws(2.8e9)


def worn(law, x, creepage=(1e-3, 2e-3, 0.2)):
    """Equal ellipses of 6 by 4 mm at positions x along the rail, and what they wear."""
    x, k = np.asarray(x, float), len(x)
    semi, load = np.tile([6e-3, 4e-3], (k, 1)), np.full(k, 60e3)
    patches = rolled_ellipses(semi, load, STEEL, STEEL, 0.3, np.tile(creepage, (k, 1)), (24, 24))
    feet = Footprints(np.ones(k, int), np.stack([x, 0 * x], axis=1), patches.grid.dy)
    return patches, deposit(feet, law.depth(patches, 20.0), patches.grid.dy, LINES, ACROSS)


@pytest.mark.parametrize("name", LAWS)
def test_volume_is_that_of_the_strips(name):
    """At any positions, to round-off; nothing goes to the other body; the middle along the rail is the patches'."""
    x = np.array([0.0432, 0.07, 0.1113])
    patches, field = worn(LAWS[name], x)
    strips = LAWS[name].depth(patches, 20.0).sum() * patches.grid.dy[0] * 2e-3
    assert field.sum() * 2e-3 * 0.5e-3 == pytest.approx(strips, rel=1e-13) and strips > 0
    assert not field[0].any()
    assert (LINES[:, None] * field[1]).sum() / field[1].sum() == pytest.approx(x.mean(), rel=1e-12)


def test_a_patch_that_does_not_change_wears_its_strips_sum_on_every_line():
    """d(y) = sum over x, the same on all lines but the ends: to round-off."""
    patches, field = worn(LAWS["archard"], LINES[10:90])
    inner = field[1][20:80]
    assert np.abs(inner - inner[0]).max() <= 1e-13 * inner.max()
    area = inner[0].sum() * 0.5e-3
    assert area == pytest.approx(LAWS["archard"].depth(patches, 20.0)[0].sum() * patches.grid.dy[0], rel=1e-12)


def test_nothing_wears_where_nothing_slips_and_ends_are_refused():
    assert not worn(LAWS["archard"], [0.05], creepage=(0.0, 0.0, 0.0))[1].any()
    with pytest.raises(ValueError, match="patches reach from x = -0.003"):
        worn(LAWS["archard"], [-0.0025])
    assert not worn(LAWS["archard"], [])[1].any()
