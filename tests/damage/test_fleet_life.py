"""A fleet in a damage study: drawn kinds of pass, life over which wheels come and by which law, and what is refused."""

import json
from dataclasses import replace

import numpy as np
import pytest

from rail_fem.case.casefile import CaseError, load_case
from rail_fem.damage.evolution import Stepping, evolve
from rail_fem.damage.fleet_life import fleet_life
from rail_fem.damage.sites import crossing_site, tonnage_of, traffic_of
from rail_fem.damage.study import study_mark

CASE = "damage/crossing_transfer"
DRAW = {
    "scene.wheel.profile": {"of": ["P8", "P8-worn"], "weights": [1, 3]},
    "scene.speed": {"low": "60 mph", "high": "80 mph"},
    "scene.vehicle.axle_load": {"low": "14 t", "high": "22 t"},
}
QUICK = {
    "damage.cells": 10,
    "damage.patch_spacing": "6 mm",
    "damage.plan_spacing": "0.5 mm",
    "damage.fleet": {"kinds": 4, "draw": DRAW},
}


@pytest.fixture(scope="module")
def worn():
    case = load_case(CASE, QUICK)
    site = crossing_site(case.scene, case.damage, {"start": "300 mm", "end": "400 mm"})
    *_, state = evolve(site, 100, Stepping(block=100))
    return case, site, state, site.rate(state.worn)


def test_the_kinds_of_a_fleet_are_drawn_and_share_the_passes_evenly(worn):
    case, site, *_ = worn
    kinds = traffic_of(case.scene, case.damage)
    assert [share for _, share in kinds] == [0.25] * 4 and len(site.passes) == 4
    assert [own.wheel.profile for own, _ in kinds].count("P8") == 1
    assert all(26.8 <= own.speed <= 35.8 for own, _ in kinds) and len({own.speed for own, _ in kinds}) == 4
    axles = case.damage.axles_per_year * sum(own.axle_load for own, _ in kinds) / 4
    assert tonnage_of(case.scene, case.damage)["gross"] == pytest.approx(axles / 1e9)


def test_kinds_wear_each_its_own_part_and_together_the_mean(worn):
    """At the place of most wear: the mean over the kinds is the rate, by every law."""
    _, _, _, after = worn
    for law, depth in after.depth.items():
        place = int(np.argmax(depth))
        assert after.depths_at(law, place).mean() == pytest.approx(depth.flat[place], rel=1e-12)


def test_life_scatters_by_the_wheels_and_its_laws_stay_apart(worn):
    """The median of resampled kinds is their mean's within its own quantiles, of each law; kinds that wear alike do not
    scatter; what turning the worst is worth follows from the kinds' parts."""
    case, _, state, after = worn
    found = fleet_life(case.damage, 4, state, after)
    for law, (low, middle, high) in found["worn_per_pass"].items():
        assert 0 < low < middle < high, law
        fewest, _, most = found["passes_to_limit"][law]
        assert fewest < most and fewest * high == pytest.approx(most * low, rel=1e-12)
    parts = [part for _, part in found["kinds"]]
    assert sum(parts) == pytest.approx(1.0) and parts == sorted(parts, reverse=True)
    assert found["less_without_worst"] == pytest.approx(1 - (1 - parts[0]) / 3 * 4, abs=1e-12)
    share, first = after.kinds[0]
    alike = replace(after, kinds=((share, first),) * 4)
    low, _, high = fleet_life(case.damage, 4, state, alike)["worn_per_pass"]["archard"]
    assert high == pytest.approx(low, rel=1e-12)


def test_lateral_positions_of_a_kind_count_by_their_shares(worn):
    """Two kinds, each at a usual position and at a rare one that wears ten times as much: as their means alone."""
    case, _, state, after = worn
    one = after.kinds[0][1]
    tenfold = replace(one, depth={law: 10 * own for law, own in one.depth.items()})
    apart, alone = (((0.45, one), (0.05, tenfold)) * 2, ((0.5 * 1.9, one),) * 2)
    scattered, mean = (fleet_life(case.damage, 2, state, replace(after, kinds=kinds)) for kinds in (apart, alone))
    np.testing.assert_allclose(scattered["worn_per_pass"]["archard"], mean["worn_per_pass"]["archard"], rtol=1e-12)


def test_another_seed_is_another_study():
    cases = (load_case(CASE, QUICK | {"damage.fleet.seed": seed}) for seed in (1, 2))
    assert len({json.dumps(study_mark(case, case.damage)) for case in cases}) == 2


@pytest.mark.parametrize(
    ("changes", "reason"),
    [
        ({"damage.traffic": [{"wheel": "P8"}]}, "fleet: is drawn over a crossing in place of traffic"),
        ({"damage.fleet.draw": {"run.rigid_hertz.start": {"of": ["0 mm"]}}}, "is a key of the scene"),
        ({"damage.fleet.draw": {"scene.crossing.ratio": {"of": [9.25]}}}, "the crossing that wears is one"),
        ({"damage.fleet.draw": {"scene.wheel.profile": {"of": ["none.csv"]}}}, "no file"),
    ],
)
def test_what_a_fleet_cannot_be_is_refused(changes, reason):
    with pytest.raises(CaseError, match=reason):
        load_case(CASE, QUICK | changes)


def test_a_draw_in_a_wrong_unit_is_refused_by_its_key():
    case = load_case(CASE, QUICK | {"damage.fleet.draw": {"scene.speed": {"low": "1 kg", "high": "2 mph"}}})
    with pytest.raises(ValueError, match=r"fleet\.draw: scene\.speed"):
        traffic_of(case.scene, case.damage)
