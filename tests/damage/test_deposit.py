"""From the patches' cells to the rail: volume, the strip's sum where nothing changes, order, mirror, neighbours."""

import numpy as np
import pytest

from bem.halfspace.rolled_ellipses import rolled_ellipses
from bem.material import STEEL
from rail_fem.damage.deposit import Footprints, deposit
from rail_fem.damage.wear import dry_laws
from tests.order import assert_order

LINES = np.arange(0, 101) * 2e-3
ACROSS = np.arange(-20, 21) * 0.5e-3
LAWS = dry_laws(2.8e9)


def row(x, direction=1, creepage=(1e-3, 2e-3, 0.2), cells=24):
    """Equal ellipses of 6 by 4 mm at positions x along the rail, and where they lie."""
    k = len(x)
    semi, load = np.tile([6e-3, 4e-3], (k, 1)), np.full(k, 60e3)
    patches = rolled_ellipses(
        semi, load, STEEL, STEEL, 0.3, np.tile(creepage, (k, 1)), (cells, cells), direction=direction
    )
    return patches, footprints(x, patches.grid.dx, patches.grid.dy)


def footprints(x, along, across):
    one = np.ones(len(x))
    return Footprints(np.ones(len(x), int), np.stack([x, 0 * x], axis=1), along * one, across * one)


def worn(law, x, spacing=2e-3, **kind):
    patches, feet = row(np.asarray(x, float), **kind)
    field = deposit(feet, law.cells(patches, 20.0), spacing / 2e-3 * patches.grid.dy, LINES, ACROSS)
    return patches, field


@pytest.mark.parametrize("name", LAWS)
def test_volume_is_that_of_the_strips(name):
    """At any positions, to round-off; nothing goes to the other body; the middle along the rail is the cells'."""
    x = np.array([0.0432, 0.07, 0.1113])
    patches, field = worn(LAWS[name], x)
    strips = LAWS[name].depth(patches, 20.0).sum() * patches.grid.dy[0] * 2e-3
    assert field.sum() * 2e-3 * 0.5e-3 == pytest.approx(strips, rel=1e-13) and strips > 0
    assert not field[0].any()
    cells = LAWS[name].cells(patches, 20.0)
    own = x[:, None] + patches.grid.dx[:, None] * (np.arange(24) - 11.5)
    middle = (own * cells.sum(axis=2)).sum() / cells.sum()
    assert (LINES[:, None] * field[1]).sum() / field[1].sum() == pytest.approx(middle, rel=1e-12)


def test_a_patch_that_does_not_change_wears_its_strips_sum_on_every_line():
    """d(y) = sum over x, the same on all lines that the whole patch has passed: to round-off."""
    patches, field = worn(LAWS["archard"], LINES[10:90])
    inner = field[1][20:80]
    assert np.abs(inner - inner[0]).max() <= 1e-13 * inner.max()
    area = inner[0].sum() * 0.5e-3
    assert area == pytest.approx(LAWS["archard"].depth(patches, 20.0)[0].sum() * patches.grid.dy[0], rel=1e-12)


def test_neighbours_that_carry_by_turns_wear_evenly():
    """80 and 30 by turns, 2 mm apart under patches of 12 mm: the rail is passed by both, and of the 91 % by which they
    differ less than 3 % is left (strips near a patch's edges are short)."""
    patches, feet = row(LINES[10:90])
    turns = np.where(np.arange(80) % 2, 80.0, 30.0)
    cells = patches.pressure * turns[:, None, None]
    field = deposit(feet, cells, patches.grid.dy, LINES, ACROSS)[1][20:80].sum(axis=1)
    assert np.ptp(field) < 0.03 * field.mean()


def test_a_rate_that_changes_along_the_rail_is_met_to_second_order():
    """Even patches of 2 a under 1 + sin(k x): d(x) = 1 + sin(k x) sin(k a) / (k a); spacing and lines halved."""
    a, k, errors = 6e-3, 2 * np.pi / 50e-3, []
    steps = np.array([4e-3, 2e-3, 1e-3, 0.5e-3])
    for step in steps:
        x = np.arange(0, round(0.2 / step) + 1) * step
        at = x[(x > 0.01) & (x < 0.19)]
        cells = (1 + np.sin(k * at))[:, None, None] * np.full((1, 96, 8), 1 / 96)
        feet = footprints(at, 2 * a / 96, 1e-3)
        field = deposit(feet, cells, np.full(len(at), 1e-3), x, ACROSS)[1].sum(axis=1) * 0.5e-3 / 8e-3
        inner = (x > 0.06) & (x < 0.14)
        exact = 1 + np.sin(k * x) * np.sin(k * a) / (k * a)
        errors.append(np.abs(field - exact)[inner].max())
    assert_order(steps, errors, expected=2)


def test_the_other_running_direction_wears_the_mirror_image():
    one = worn(LAWS["archard"], [0.05, 0.0613, 0.1], creepage=(1e-3, 2e-3, 0.2))[1]
    two = worn(LAWS["archard"], [0.15, 0.1387, 0.1], creepage=(-1e-3, 2e-3, -0.2), direction=-1)[1]
    np.testing.assert_allclose(two[1][::-1], one[1], rtol=1e-9, atol=1e-12 * one.max())
    assert np.abs(two - one).max() > 0.1 * one.max()


def test_nothing_wears_where_nothing_slips_and_ends_are_refused():
    assert not worn(LAWS["archard"], [0.05], creepage=(0.0, 0.0, 0.0))[1].any()
    with pytest.raises(ValueError, match="patches reach from x = -0.00[23]"):
        worn(LAWS["archard"], [0.0035])
    patches, feet = row(np.zeros(0))
    assert not deposit(feet, patches.pressure, patches.grid.dy, LINES, ACROSS).any()
