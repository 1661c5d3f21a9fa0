"""Wear by what the wheel reaches: strips' sum where nothing changes, volume, order, pits and bumps, roughness that
heals."""

from dataclasses import replace

import numpy as np
import pytest

from bem.halfspace.rolled_ellipses import rolled_ellipses
from bem.material import STEEL
from geometry.profiles.profile import hermite_many
from rail_fem.case.casefile import load_case
from rail_fem.damage.crossing import PassContacts, footprints
from rail_fem.damage.deposit import deposit_reached
from rail_fem.damage.evolution import Stepping, begin, evolve
from rail_fem.damage.reach import depth_of_patch, reach_of
from rail_fem.damage.sites import crossing_site

CASE = "damage/crossing_transfer"
QUICK = {"damage.cells": 12, "damage.plan_spacing": "0.5 mm"}
SCENE = load_case(CASE).scene
ACROSS = np.arange(-20, 21) * 0.5e-3
SEMI, FLAT = (5e-3, 4e-3), 0.3  # of the patches, and the rail's radius across under the wheel's own profile [m]


class Rail:
    """A rail that the wheel fits along its profile but for a radius FLAT, less depth(x) [m]."""

    def __init__(self, depth=np.zeros_like):
        self.depth = depth

    def heights(self, x, y, body):
        tread, _ = hermite_many(y, *SCENE.wheel.shape.hermite_table())
        return tread - y**2 / (2 * FLAT) - self.depth(x)


def rolled(x, cells=25):
    """Equal patches about the tread datum at axle positions x (k,)."""
    k, one = len(x), np.ones(len(x))
    patches = rolled_ellipses(
        np.tile(SEMI, (k, 1)), 60e3 * one, STEEL, STEEL, 0.3, np.tile([1e-3, 2e-3, 0.1], (k, 1)), (cells, cells)
    )
    radii = np.tile([SCENE.wheel.radius, FLAT], (k, 1))
    position = np.stack([x, 0 * x, 0 * x], axis=1)
    return PassContacts(one.astype(int), x, position, patches, 0 * x, 20.0, one, radii, (1e11, 1e11))


def shared(x, lines, strips, rail=None):
    """Depths (m,) along the lines, mean over the patches' width, by strips (k,) of one."""
    contacts = rolled(x)
    reach = reach_of(contacts, SCENE, rail or Rail(), 0.0, lines)
    feet, width = footprints(contacts), 2 * SEMI[1]
    field = deposit_reached(feet, strips[:, None] * np.ones(25), contacts.patches.grid.dy, reach, lines, ACROSS)
    return field[1].sum(axis=1) * (ACROSS[1] - ACROSS[0]) / width


LINES = np.arange(0, 101) * 2e-3


def test_where_nothing_changes_it_is_the_strips_sum_and_volume_is_kept_anywhere():
    """On all lines that the whole patch has passed, to round-off; at positions between the lines the sum is."""
    even = shared(LINES[10:90], LINES, np.ones(80))
    np.testing.assert_allclose(even[20:80], 1.0, rtol=1e-13)
    odd = np.array([0.0432, 0.07, 0.1113])
    assert shared(odd, LINES, np.array([1.0, 2.0, 4.0])).sum() == pytest.approx(7.0, rel=1e-13)


def test_a_rate_that_changes_along_the_rail_is_met_to_second_order_at_least():
    """1 + sin(k x) spread by 1 - u^2 / c^2 : the sine by 3 (sin kc - kc cos kc) / (kc)^3, mean over the strips, whose
    half lengths c follow from the gap across. Where the ends fall between the lines changes the error's sign, so that
    it is held below second order from the coarsest on."""
    k, errors = 2 * np.pi / 50e-3, []
    one = rolled(np.zeros(1))
    y = (np.arange(25) - 12) * one.patches.grid.dy
    rest = depth_of_patch(one) - y**2 / (2 * FLAT)
    tread, _ = hermite_many(y, *SCENE.wheel.shape.hermite_table())
    kc = k * np.sqrt(2 * (SCENE.wheel.radius - tread) * rest)
    assert (rest > 0).all()
    factor = (3 * (np.sin(kc) - kc * np.cos(kc)) / kc**3).mean()
    steps = np.array([4e-3, 2e-3, 1e-3, 0.5e-3])
    for step in steps:
        x = np.arange(0, round(0.2 / step) + 1) * step
        at = x[(x > 0.01) & (x < 0.19)]
        found = shared(at, x, 1 + np.sin(k * at))
        inner = (x > 0.06) & (x < 0.14)
        errors.append(np.abs(found - 1 - factor * np.sin(k * x))[inner].max())
    assert errors[0] < 5e-3 and (np.array(errors) <= errors[0] * (steps / steps[0]) ** 2).all()


@pytest.mark.parametrize("sign", [1, -1])
def test_what_lies_low_is_spared_and_what_stands_up_wears_first(sign):
    """Ten micrometres over 2 mm: less than the rest in a pit, more on a bump. A pit deeper than the patch is not
    reached at all."""
    depth = depth_of_patch(rolled(np.zeros(1)))[0]
    hole = lambda deep: Rail(lambda x: deep * np.exp(-(((x - 0.1) / 2e-3) ** 2)))
    at, ones = LINES[10:90], np.ones(80)
    found = shared(at, LINES, ones, hole(sign * 10e-6))
    assert (found[50] < 0.9 if sign > 0 else found[50] > 1.1) and found[20:80].sum() == pytest.approx(60, rel=1e-3)
    if sign > 0:
        own = np.abs(at - 0.1) > 6e-3  # no wheel stands in it
        assert shared(at[own], LINES, ones[own], hole(1.05 * depth))[50] == 0


def test_a_patch_that_reaches_no_line_wears_its_own_position():
    """Far below all that it is told to reach: the two lines beside it, middle kept."""
    contacts = rolled(np.array([0.0507]))
    gone = Rail(lambda x: np.full_like(x, np.inf))
    reach = reach_of(contacts, SCENE, gone, 0.0, LINES)
    found = LINES[reach.first[0] + np.arange(reach.share.shape[1])] @ reach.share[0]
    np.testing.assert_allclose(found, 0.0507, rtol=1e-12)
    assert ((reach.share[0] > 0).sum(axis=0) == 2).all()


def test_rough_rail_becomes_smooth():
    """Of heights scattered from line to line less than half is left."""
    rough, left = _worn_rough()
    assert left < 0.5 * rough


def _worn_rough():
    """Scatter [m] of plain rail with 4 um from line to line in its splines, before and after 60 um in blocks of 5."""
    case = load_case(CASE, QUICK)
    site = crossing_site(case.scene, case.damage, {"start": "0 mm", "end": "70 mm"})
    x = site.grid[0]
    inner = np.clip(np.minimum(x - 0.015, 0.055 - x) / 5e-3, 0, 1)
    first = site.first()
    rough = np.zeros(first.shape)
    rough[0] = (20e-6 + 4e-6 * inner * np.random.default_rng(1).normal(size=len(x)))[:, None]
    start = replace(begin(site), worn=replace(first, depth=rough), first=replace(first, depth=rough))
    passes = 60e-6 / site.rate(first).depth["archard"].max()
    *_, end = evolve(site, passes, Stepping(block=passes / 12, smoothing=0.0), start)
    assert end.deepest > 50e-6
    return tuple(_scatter(depth[0][(x > 0.02) & (x < 0.05)]) for depth in (rough, end.worn.depth))


def _scatter(depth):
    """Of the surface's deepest line along the rail about a parabola [m]; cubic B-splines at their own lines."""
    line = np.convolve(depth[:, np.argmax(depth.mean(axis=0))], [1 / 6, 4 / 6, 1 / 6], mode="valid")
    at = np.arange(len(line))
    return (line - np.polyval(np.polyfit(at, line, 2), at)).std()
