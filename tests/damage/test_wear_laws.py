"""Wear laws: unit conversions against published rates, the energy form, what each refuses."""

import numpy as np
import pytest

from bem.halfspace.fastsim import elliptic_patch, fastsim
from bem.material import STEEL, Elastic
from bem.patch import Creepage
from rail_fem.damage.wear import (
    DENSITY,
    JENDEL,
    Archard,
    BritishRail,
    KrausePoll,
    Usfd,
    WearError,
    WearMap,
    dry_laws,
    friction_work,
    slip_size,
    tgamma,
    worn_area,
)
from tests.order import assert_order

STEEL_201 = Elastic(201e9, 0.3)


def rolling(creepage, cells=50, bound="parabolic", friction=0.3, steel=STEEL):
    patch = elliptic_patch(5.66e-3, 4.02e-3, 49505.0, (cells, cells))
    return fastsim(patch, steel, steel, friction, creepage, bound=bound, estimate=False)


def table_6_2(cells=50):
    return rolling(Creepage(3.7917e-5, 0.005, 0.2023), cells, steel=STEEL_201)


def test_tgamma_of_the_table_is_the_published_one_and_its_power_differs_by_the_spin_moment():
    """74.0 N from the forces alone; with the spin moment it is the frictional power per speed, which FASTSIM's cells
    give to second order (the power of steps not centred on the cells was 72.9 N at 50 x 50 cells)."""
    patch = table_6_2()
    force = patch.tangential_force
    creepage = patch.creepage
    tgamma = -(force[0] * creepage.longitudinal + force[1] * creepage.lateral)
    assert tgamma == pytest.approx(74.0, abs=0.15)
    with_spin = tgamma - patch.moment[2] * creepage.spin
    assert patch.frictional_power == pytest.approx(with_spin, rel=1e-4)
    assert patch.frictional_power == pytest.approx(table_6_2(200).frictional_power, rel=5e-4)


def test_wear_energy_is_friction_work_in_full_slip():
    """V = k / (mu H) W, to round-off, where every cell slides under the pressure's own bound."""
    patch = rolling(Creepage(0.05, 0.02, 0.0), bound="elliptic")
    assert not patch.stick[patch.contact].any()
    law = Archard(2.8e9, coefficient=1e-3)
    assert worn_area(law, patch, 15.0) == pytest.approx(1e-3 / (0.3 * 2.8e9) * patch.frictional_power, rel=1e-12)


def test_specific_wear_of_the_laws_is_that_of_field_practice():
    """ug/J: Krause-Poll 0.77 and 1.7, Archard at mu 0.3 and 2.85 GPa 0.92 for k = 1e-4, USFD mild 5.3, BRR 6.2 in its
    first regime."""
    slow = rolling(Creepage(0.05, 0.0, 0.0), bound="elliptic")
    mass = lambda law, patch, speed=1e-3: worn_area(law, patch, speed) / patch.frictional_power * DENSITY * 1e9
    assert mass(KrausePoll(), slow) == pytest.approx(0.775, abs=0.005)
    assert mass(KrausePoll(), slow, 30.0) == pytest.approx(1.69, abs=0.005)
    assert mass(Archard(2.85e9, coefficient=1e-4), slow) == pytest.approx(0.92, abs=0.005)
    gentle = table_6_2()
    assert gentle.frictional_power / gentle.contact_area < 10.4e6
    assert mass(Usfd(), gentle) == pytest.approx(5.3, rel=1e-9)
    assert mass(BritishRail(), gentle) == pytest.approx(np.pi * 0.25e-3 * 7.85e3, rel=1e-9)  # mm3/J times ug/mm3


def test_usfd_rate_at_its_limits():
    law = Usfd()
    as_published = lambda x: float(law.rate(x * 1e6)) * 1e3  # kg/m3 -> ug/(m mm2)
    assert as_published(10.3) == pytest.approx(54.59)
    assert as_published(10.4) == as_published(77.2) == pytest.approx(55.0)
    assert as_published(77.3) == pytest.approx(61.9 * 77.3 - 4723.7, abs=0.05)  # the printed constant has five digits
    depth = law.depth(table_6_2(), 15.0)
    patch = table_6_2()
    assert depth.sum() * patch.grid.dy * DENSITY == pytest.approx(5.3e-9 * patch.frictional_power)


def test_map_takes_its_regions():
    k = lambda p, v, share=1.0: float(JENDEL.coefficient(np.array(p), np.array(v), share))
    assert [k(0.3, 0.1), k(0.3, 0.5), k(0.3, 2.0), k(0.9, 0.1)] == [10e-4, 40e-4, 10e-4, 400e-4]
    assert [k(0.3, 0.1, 0.5), k(0.3, 0.5, 0.5), k(0.9, 3.0, 0.0)] == pytest.approx([5.5e-4, 35e-4, 300e-4])


def test_strip_sums_do_not_depend_on_the_grid_where_single_cells_do():
    """Table 6-2's creepages, k = 10e-4, H = 2.8 GPa: the largest cell halves with the cell, the largest strip and
    the area stay within 0.1 % from 50 x 50 cells."""
    law = Archard(2.8e9, coefficient=10e-4)
    cell, strip, area = zip(
        *(
            (law.cells(p, 15.0).max(), law.depth(p, 15.0).max(), worn_area(law, p, 15.0))
            for p in map(table_6_2, (25, 50, 100, 200))
        ),
        strict=True,
    )
    assert np.array(cell[:3]) * 1e6 == pytest.approx([1.1e-3, 5.5e-4, 2.7e-4], rel=0.05)
    assert strip[1] * 1e6 == pytest.approx(1.6e-2, rel=0.05)  # printed to two digits
    assert strip[1] == pytest.approx(strip[3], rel=1e-3) and area[1] == pytest.approx(area[3], rel=1e-3)


def test_wear_of_the_mirrored_patch_is_mirrored():
    one = Archard(2.8e9).depth(rolling(Creepage(1e-3, 0.004, 0.3)), 15.0)
    other = Archard(2.8e9).depth(rolling(Creepage(1e-3, -0.004, -0.3)), 15.0)
    assert np.abs(one - other[::-1]).max() < 1e-12 * one.max()


def test_no_creepage_wears_nothing_and_pure_spin_does():
    for law in dry_laws(2.8e9).values():
        assert not law.depth(rolling(Creepage()), 15.0).any()
        spun = law.depth(rolling(Creepage(0.0, 0.0, 2.0)), 15.0)
        assert np.isfinite(spun).all() and spun.sum() > 0


def test_work_of_the_strips_is_the_power():
    patch = table_6_2()
    assert friction_work(patch).sum() * patch.grid.dy == pytest.approx(patch.frictional_power, rel=1e-3)


def test_cells_across_a_border_are_met_to_second_order():
    """Hertz pressure on the unit circle, k twice as large above 0.8: what that adds is 2 pi / 3 (1 - 0.8^3). Mean over
    twenty offsets of the grid, as a single one's error changes sign with where the border runs."""
    jump = WearMap((0.8,), (1.0,), ((1.0, 1.0), (2.0, 2.0)), ((1.0, 1.0), (2.0, 2.0)))
    exact, sizes, errors = 2 * np.pi / 3 * (1 - 0.8**3), 2.2 / np.array([30, 60, 120]), []
    offsets = np.random.default_rng(0).random((20, 2))
    for size in sizes:
        found, at_centres = [], []
        for off in offsets:
            x, y = (-1.15 + size * (np.arange(2.3 // size + 2) + own) for own in off)
            p = np.sqrt(np.maximum(1 - x[:, None] ** 2 - y**2, 0))
            extra = lambda k, p=p, size=size: ((k - 1) * p).sum() * size**2 / exact - 1
            found.append(extra(jump.cell_means(p, 0 * p, 0.0)))
            at_centres.append(extra(jump.coefficient(p, 0 * p, 0.0)))
        errors.append(np.mean(found))
        assert np.abs(found).max() < 0.35 * np.abs(at_centres).max()
    assert_order(sizes, errors, expected=2, slack=0.3)


def test_a_cell_within_one_region_has_its_coefficient():
    """Where neither pressure nor velocity comes near a border, and where both jump to the next cell."""
    p = np.where(np.arange(8)[:, None] < 4, 0.2, 0.9) * np.ones(6)
    v = np.where(np.arange(8)[:, None] < 4, 0.1, 0.5) * np.ones(6)
    for share in (0.0, 0.5, 1.0):
        assert (JENDEL.cell_means(p, v, share) == JENDEL.coefficient(p, v, share)).all()


def test_wear_near_the_borders_of_the_map_is_told():
    """At 0.005 lateral creepage and 40 m/s the largest slip velocity is that of a border."""
    law = Archard(2.8e9)
    patch = table_6_2()
    depth, near = law.cells(patch, 40.0), law.near_border(patch, 40.0)
    assert depth[near].sum() > 0.05 * depth.sum()
    assert not law.cells(patch, 1.0)[law.near_border(patch, 1.0)].any()


@pytest.mark.parametrize(
    "make, said",
    [
        (lambda: Archard(2.8e9).depth(elliptic_patch(5e-3, 4e-3, 1e4), 15.0), "not solved"),
        (lambda: Archard(2.8e9).depth(table_6_2(), 0.0), "speed"),
        (lambda: friction_work(elliptic_patch(5e-3, 4e-3, 1e4)), "not solved"),
        (lambda: slip_size(elliptic_patch(5e-3, 4e-3, 1e4)), "not solved"),
        (lambda: tgamma(elliptic_patch(5e-3, 4e-3, 1e4)), "no creepage"),
    ],
)
def test_refused_with_a_sentence(make, said):
    with pytest.raises(WearError, match=said):
        make()
