"""Tonnage, inspection, time to a limit, maintenance, sensitivities."""

import numpy as np
import pytest

from rail_fem.damage.traffic import (
    INSPECTION,
    WELD,
    Emgtpa,
    Event,
    Mix,
    TrafficError,
    category,
    elasticity,
    life,
    time_in_words,
)


def test_equivalent_tonnage_is_the_formulas():
    """S_p (K_p T_p + K_t T_tp) + S_f (K_f T_f + K_t T_tf), thesis eq. 1-1, with UIC 714's factors."""
    found = Emgtpa().value(passenger=(160 / 3.6, 10.0, 1.0), freight=(100 / 3.6, 5.0, 0.5))
    assert found == pytest.approx(1.35 * (10 + 1.4) + 1.15 * (1.15 * 5 + 0.7))
    own = Emgtpa(passenger=1.1, freight=1.45, tractive=1.2)
    assert own.value(freight=(60 / 3.6, 2.0, 1.0)) == pytest.approx(1.45 * 2 + 1.2)
    assert [Emgtpa().speed_factor(v / 3.6) for v in (60, 61, 200, 300)] == [1.0, 1.05, 1.40, 1.5]


def test_category_is_the_owners_table():
    table = (("6", 1.0, 20.0), ("3", 10.0, 45.0), ("1A", 1e3, 60.0))
    assert (
        category(table, 0.5, 15.0) == "6" and category(table, 0.5, 30.0) == "3" and category(table, 20.0, 50.0) == "1A"
    )
    with pytest.raises(TrafficError, match="beyond"):
        category(table, 0.5, 100.0)
    assert INSPECTION["1A"] == (1.0, None, 5.0) and INSPECTION["6"] == (2.0, 2.0, 13.0)


def test_damage_a_year_is_the_sum_over_axles():
    mix = Mix({"freight": (100e3, 225e3), "passenger": (300e3, 130e3)})
    assert mix.per_year({"freight": 2e-9, "passenger": 1e-9}) == pytest.approx(5e-4)
    assert sum(mix.weights.values()) == pytest.approx(1) and mix.weights["freight"] == 0.25
    assert mix.gross == pytest.approx((100e3 * 225e3 + 300e3 * 130e3) / 9.81 / 1e9)
    with pytest.raises(TrafficError, match="passenger"):
        mix.per_year({"freight": 1.0})


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
    assert life(0.0, -0.1, 5e-3).reached == "" and life(0.0, -0.1, 5e-3).crack.max() == 0


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


@pytest.mark.parametrize(
    "make",
    [
        lambda: Emgtpa(passenger=-1.0),
        lambda: Emgtpa(speed=((10.0, 1.0), (5.0, 1.1))),
        lambda: Emgtpa().value(freight=(20.0, -1.0, 0.0)),
        lambda: Mix({"none": (0.0, 1e5)}),
        lambda: Mix({"a": (1.0, -1e5)}),
        lambda: life(-1.0, 0.0, 1e-3),
        lambda: life(np.nan, 0.0, 1e-3),
        lambda: life(1e-3, 0.0, 0.0),
        lambda: Event(1.0, keeps_depth=2.0),
        lambda: elasticity("x", 1.0, lambda x: -x),
    ],
)
def test_traffic_that_cannot_be_is_refused(make):
    with pytest.raises(TrafficError):
        make()
