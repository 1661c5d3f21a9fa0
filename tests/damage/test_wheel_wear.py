"""Wear of the wheel: volume around its circumference, where on the profile, hardness, and carried over the passes."""

from dataclasses import replace

import numpy as np
import pytest

from rail_fem.case.casefile import load_case
from rail_fem.damage.crossing import patch_options, table_contacts
from rail_fem.damage.crossing_site import dynamics
from rail_fem.damage.evolution import Stepping, begin, evolve
from rail_fem.damage.figures import wheel_panels
from rail_fem.damage.report import study_report
from rail_fem.damage.sites import crossing_site, tonnage_of
from rail_fem.damage.summary import summary
from rail_fem.damage.traffic import WELD
from rail_fem.damage.wheel_wear import circumference, wheel_lines, wheel_wear

CASE = "damage/crossing_transfer"
QUICK = {"damage.cells": 12, "damage.patch_spacing": "6 mm", "damage.plan_spacing": "0.5 mm"}
RUN = {"start": "280 mm", "end": "420 mm"}


def quick_site(changes=None):
    case = load_case(CASE, QUICK | (changes or {}))
    return case, crossing_site(case.scene, case.damage, RUN)


@pytest.fixture(scope="module")
def made():
    case, site = quick_site()
    return case, site, site.rate(site.first())


def test_volume_of_the_wheel_is_that_of_the_strips(made):
    """By laws without hardness the wheel loses what the rail's strips lose, spread over 2 pi r: to round-off."""
    _, site, rate = made
    step = wheel_lines(site.settings.plan_spacing)[1] - wheel_lines(site.settings.plan_spacing)[0]
    _, own = rate.kinds[0]
    for name, depth in zip(site.laws, own.wheel, strict=True):
        volume = float((depth * own.circumference).sum() * step)
        if "archard" not in name:
            assert volume == pytest.approx(rate.removed[name], rel=1e-12)
        assert volume > 0


def test_archards_law_goes_by_the_wheels_own_hardness(made):
    """With one coefficient depth is as 1 over the hardness: a wheel of 2.5 GPa loses twice what the rail of 5 does."""
    changes = {"damage.wear_coefficient": 1e-4, "damage.wheel_hardness": "2.5 GPa"}
    _, site = quick_site(changes)
    rate = site.rate(site.first())
    _, own = rate.kinds[0]
    step = wheel_lines(site.settings.plan_spacing)[1] - wheel_lines(site.settings.plan_spacing)[0]
    volume = float((own.wheel[list(site.laws).index("archard")] * own.circumference).sum() * step)
    assert volume == pytest.approx(2 * rate.removed["archard"], rel=1e-12)


def test_a_wheel_wears_where_it_touches_and_further_out_when_it_is_moved(made):
    """The loss is centred on the contacts' positions on the profile; a wheel moved by 2 mm to the field side meets the
    rail 2 mm nearer to its flange, as far as the rail's shape lets it."""
    case, site, _ = made
    one = site.passes[0]
    table, light = dynamics(one, site.crossing(site.first()), site.run, site.settings.patch_spacing)
    order = np.argsort(light.x)
    forces = np.stack([np.interp(table.x, light.x[order], own[order]) for own in light.force])
    contacts = table_contacts(one.scene, table, forces, patch_options(one.scene, case.damage))
    law = {"krause_poll": site.laws["krause_poll"]}
    y = wheel_lines(0.5e-3)
    here = wheel_wear(contacts, one.scene, table.datum, law, 1.0, 2e-3, y)
    power = law["krause_poll"].depth(contacts.patches, contacts.speed).sum(axis=1) * contacts.patches.grid.dy
    strips = law["krause_poll"].depth(contacts.patches, contacts.speed)
    offset = (strips * contacts.patches.grid.y).sum(axis=1) / strips.sum(axis=1) * np.cos(contacts.angle)
    centre = contacts.position[:, 1] + offset - table.datum
    lost = here[0].sum(axis=0) * circumference(one.scene, y)
    assert (lost * y).sum() / lost.sum() == pytest.approx(np.average(centre, weights=power), abs=0.05e-3)
    there = wheel_wear(contacts, one.scene, table.datum + 2e-3, law, 1.0, 2e-3, y)
    np.testing.assert_allclose(
        there[0, :, :-4] * circumference(one.scene, y)[:-4],
        (here * circumference(one.scene, y))[0, :, 4:],
        atol=1e-9 * lost.max(),
    )


def test_wear_of_the_wheels_goes_on_over_the_blocks_and_into_the_summary(made):
    case, site, rate = made
    *_, end = evolve(site, 20, Stepping(block=10))
    assert end.wheels.shape == rate.wheels.shape and end.wheels.max() > 0
    assert end.wheels.sum() == pytest.approx(20 * rate.wheels.sum(), rel=0.3)
    found = summary(case.damage, end, rate, rate)["wheels"]
    assert len(found) == 1 and found[0]["deepest_by_law"]["archard"] == pytest.approx(
        end.wheels[0, list(site.laws).index("archard")].sum(axis=0).max(), rel=1e-12
    )
    assert 0 < found[0]["nose_share"] < 1 and -0.05 < found[0]["deepest_at"] < 0.06
    assert summary(case.damage, begin(site), rate, rate)["wheels"] == []


def test_a_page_tells_the_wheels_of_a_thousand_passes_since_the_last_welding(made):
    """Welded after 10 of 20 passes: the wheels' table is that of the 10 passes since, over the same shapes."""
    case, site, rate = made
    tables = []
    for passes, events in ((10, ()), (20, ((10, WELD),))):
        *_, end = evolve(site, passes, Stepping(block=10, events=events))
        found = summary(case.damage, end, rate, rate) | {"tonnage": tonnage_of(case.scene, case.damage)}
        tables.append(study_report("", case.damage, found).partition("## Wheels")[2].partition("## ")[0])
    assert "P8-worn" in tables[0] and tables[0] == tables[1]


def test_where_nothing_has_worn_the_page_names_no_place(made):
    """It named a corner of the plan."""
    case, site, rate = made
    told = study_report(
        "",
        case.damage,
        summary(case.damage, begin(site), rate, rate) | {"tonnage": tonnage_of(case.scene, case.damage)},
    )
    assert told.count("(band 0 to 0 \u00b5m), nowhere.") == told.count("Crack index 0 nowhere (") == 2
    assert told.count("At first: largest T\u03b3") == told.count("N at x, y = ") == 2


def test_two_kinds_of_one_label_are_two_curves(made):
    """Speeds that round to one: the second had taken the first's place."""
    case, site, rate = made
    *_, end = evolve(site, 10, Stepping(block=10))
    (one,) = site.passes
    two = replace(site, passes=(replace(one, weight=0.5), replace(one, weight=0.5)))
    _, each, _ = wheel_panels(case.damage, two, replace(end, wheels=np.concatenate([end.wheels, end.wheels / 2])))
    assert len({np.nanmax(depth) for _, depth in each.lines.values()}) == 2
    assert [words.startswith("_") for words in each.lines] == [False, True]  # one in the legend


def test_the_mean_of_the_traffic_is_drawn_wherever_one_of_its_wheels_wears(made):
    """Of two kinds, a quarter and three quarters, the second wears nothing on the flange's side, where the first wears
    most: there a quarter of that."""
    case, site, rate = made
    *_, end = evolve(site, 10, Stepping(block=10))
    (one,), other = site.passes, end.wheels * (wheel_lines(site.settings.plan_spacing) > 0)
    two = replace(site, passes=(replace(one, weight=0.25), replace(one, weight=0.75, shift=1e-3)))
    _, each, mean = wheel_panels(case.damage, two, replace(end, wheels=np.concatenate([end.wheels, other])))
    deepest = np.nanmax(next(iter(each.lines.values()))[1])
    assert np.nanmax(mean.lines["leading law"][1]) == pytest.approx(0.25 * deepest, rel=1e-12)
