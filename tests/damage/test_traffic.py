"""Tonnage, inspection, time to a limit, maintenance, sensitivities."""

import numpy as np
import pytest

from rail_fem.case.casefile import load_case
from rail_fem.damage.drivers import elasticity
from rail_fem.damage.report import _traffic
from rail_fem.damage.sites import tonnage_of
from rail_fem.damage.traffic import WELD, Event, equivalent_tonnage, life, time_in_words


def test_equivalent_tonnage_is_the_formulas():
    """S_p (K_p T_p + K_t T_tp) + S_f (K_f T_f + K_t T_tf), thesis eq. 1-1, with UIC 714's factors."""
    passenger, freight = 160 / 3.6, 100 / 3.6
    kinds = [("passenger", passenger, 10.0), ("tractive", passenger, 1.0), ("freight", freight, 5.0)]
    kinds.append(("tractive", freight, 0.5))
    assert equivalent_tonnage(kinds) == pytest.approx(1.35 * (10 + 1.4) + 1.15 * (1.15 * 5 + 0.7), rel=1e-12)
    assert [equivalent_tonnage([("passenger", v / 3.6, 1.0)]) for v in (60, 61, 200, 300)] == [1.0, 1.05, 1.4, 1.5]


def test_a_studys_traffic_is_told_as_tonnage_and_between_inspections():
    kinds = [
        {"share": 0.75, "axle_load": "16 t", "speed": "75 mph"},
        {"share": 0.25, "axle_load": "22 t", "speed": "60 km/h", "stock": "freight"},
    ]
    changes = {"damage.traffic": kinds, "damage.axles_per_year": 1e6, "damage.track_category": "1A"}
    case = load_case("damage/crossing_mix", changes)
    found = tonnage_of(case.scene, case.damage)
    assert found == pytest.approx({"gross": 12 + 5.5, "equivalent": 1.25 * 12 + 1.15 * 5.5})
    told = _traffic(case.damage, found)
    assert "17.5 million gross tonnes, 21.3 equivalent" in told
    assert "every 1 week(s)" in told and "(19,165 axles between)" in told and "not allowed" in told


def test_time_to_a_limit_and_what_grinding_moves():
    """1 mm a year to 5 mm: 5 years; cracks of 0.4 a year end it at 2.5; grinding at 2 takes cracks and 0.2 mm away."""
    assert life(1e-3, 0.0, 5e-3).years == pytest.approx(5.0)
    cracked = life(1e-3, 0.4, 5e-3)
    assert (cracked.years, cracked.reached) == (pytest.approx(2.5), "cracks")
    ground = life(1e-3, 0.4, 5e-3, [Event(2.0)])
    assert (ground.years, ground.reached) == (pytest.approx(4.5), "cracks")
    twice = life(1e-3, 0.4, 5e-3, [Event(2.0), Event(4.0)])
    assert (twice.years, twice.reached) == (pytest.approx(5 - 0.4), "depth")
    assert life(1e-3, 0.0, 5e-3, [Event(4.0, *(WELD.name, 0.0, 0.0, 0.0))]).years == pytest.approx(9.0)
    assert life(0.0, -0.1, 5e-3).reached == ""


def test_a_life_goes_on_from_what_is_worn_already():
    """From year 2, 3 mm deep with an index of 0.5."""
    assert life(1e-3, 0.1, 5e-3, begun=(2.0, 3e-3, 0.5)).years == pytest.approx(4.0)
    assert life(1e-3, 0.4, 5e-3, begun=(2.0, 3e-3, 0.5)).years == pytest.approx(3.25)


def test_a_time_has_the_digits_that_it_deserves():
    assert [time_in_words(t) for t in (None, 0.0076, 0.017, 0.12, 0.91, 14.2)] == [
        "-", "3 days", "6 days", "6 weeks", "10 months", "10 years",
    ]  # fmt: skip
    assert time_in_words(14.2, 2) == "14 years"


def test_a_grinding_that_takes_all_ends_it():
    found = life(1e-3, 0.0, 5e-3, [Event(3.0, removes=3e-3)])
    assert found.years == pytest.approx(3.0) and "grinding" in found.reached


def test_elasticity_of_a_power_law_is_its_exponent():
    found = elasticity("axle load", 100e3, lambda load: 3.0 * load**1.7)
    assert found.elasticity == pytest.approx(1.7, rel=1e-12) and found.error < 1e-12
    bent = elasticity("speed", 30.0, lambda v: np.exp(v / 30.0))
    assert abs(bent.elasticity - 1.0) <= bent.error


def test_a_damage_of_nothing_has_no_elasticity():
    """Nor what is nothing on one side: a study that has run tells the rest."""
    for base in (0.0, 0.92):
        found = elasticity("x", base, lambda x: max(x - 0.9, 0.0))
        assert np.isnan([found.elasticity, found.error]).all()
