"""Thesis Table 3-3: how its positions were read, how its offsets count, what nominal profiles cannot and a worn wheel
can; the flange jump of P8."""

import numpy as np
import pytest

from geometry.contact.prismatic_search import ContactSearch
from geometry.profiles.wheel import wheel_profile
from geometry.wheelset import Track, Wheelset
from tests.rail_fem.thesis_sites import (
    MEASURED_STEP,
    MM,
    SITES,
    THEORETICAL_STEP,
    ContactPositions,
    TableReading,
    best_reading,
    fitted_wheel,
    flange_shift,
    flange_shifts,  # fmt: skip
    readings,
    sensitivities,
    worn_wheel,
)


@pytest.fixture(scope="module")
def nominal():
    return ContactPositions(wheel_profile("P8"))


@pytest.mark.parametrize("name, step", [("theoretical", THEORETICAL_STEP), ("measured", MEASURED_STEP)])
def test_the_printed_places_were_counted_in_picture_points(name, step):
    """Six multiples of one step, each to the print of 0.01 mm: for steps of 0.83 mm a chance of (2 * 0.005 /
    0.83)^6."""
    count = np.array([getattr(s, name) for s in SITES.values()]) / step
    assert np.abs(count - np.round(count)).max() * step < 0.006 * MM


def test_the_six_places_are_one_curve_for_one_sign_of_the_offset_only():
    def order(reading):
        rows = sorted((reading.inward(s), s.theoretical) for s in SITES.values())
        return bool(np.all(np.diff([position for _, position in rows]) > 0))

    assert order(TableReading())
    assert not any(
        order(TableReading(sign=-1.0, gauge_share=share, alignment_share=a))
        for share in (0, 0.5, 1)
        for a in (-1, 0, 1)
    )


def test_the_nominal_pair_has_the_slope_of_the_thesis_curve_below_its_jump(nominal):
    """From f to e, within a picture point over their distance."""
    e, f = SITES["e"], SITES["f"]
    run = TableReading().inward(e) - TableReading().inward(f)
    found = (nominal.at(TableReading().inward(e)) - nominal.at(TableReading().inward(f))) / run
    assert found == pytest.approx((e.theoretical - f.theoretical) / run, abs=THEORETICAL_STEP / run)


def test_no_reading_of_the_table_lets_nominal_profiles_meet_sites_b_to_e(nominal):
    """Of the readings without cross level and alignment; all 3240 of them: the validate tier. Asked for is 1 mm."""
    few = [r for r in readings(0.5 * MM) if r.alignment_share == 0 and r.level_share == 0]
    assert len(few) >= 150
    reading, miss = best_reading(nominal, few)
    assert reading.sign == 1.0 and 3 * MM < miss < 4 * MM


@pytest.mark.validate
def test_no_reading_at_all_lets_nominal_profiles_meet_sites_b_to_e(nominal):
    assert best_reading(nominal, readings())[1] > 3 * MM


def test_a_tread_worn_by_half_a_millimetre_meets_sites_b_to_e():
    """Within half a picture point, at the inclination, gauge and back-to-back of Table 3-1."""
    assert np.abs(ContactPositions(worn_wheel((0.51, 10.9, 5.0))).misses()).max() < THEORETICAL_STEP / 2
    assert np.abs(ContactPositions(worn_wheel((0.0, 10.9, 5.0))).misses()).max() > 5 * MM


def test_b_and_e_feel_wear_more_than_any_tolerance_of_the_track():
    """A tenth of a millimetre of wear moves them by more than 1 mm; gauge and back-to-back by 2/3 mm a mm, load and yaw
    not at all."""
    for name in ("b", "e"):
        change = sensitivities(SITES[name])
        assert abs(change["tread worn 0.1 mm"]) > 1 * MM
        assert (
            change["gauge +1 mm"]
            == pytest.approx(-change["back-to-back +1 mm"], abs=0.02 * MM)
            == pytest.approx(change["shift inwards 1 mm"] / 2, abs=0.02 * MM)
        )
        assert abs(change["yaw +5 mrad"]) < 0.05 * MM and abs(change["wheel load 49 kN"]) < 0.05 * MM


def test_the_flange_jump_moves_with_half_of_gauge_and_back_to_back():
    """10.74 mm for Table 3-1; what gives the thesis' "approximately 9": gauge 1432 and the axle's own shift, or the
    play as it is gauged."""
    found = flange_shifts()
    at_rail = found["Table 3-1, shift of the wheelset at rail level"]
    assert at_rail == pytest.approx(10.74 * MM, abs=0.01 * MM)
    assert at_rail - found["gauge 1432, rail level"] == pytest.approx(1.5 * MM, abs=5e-6)
    assert at_rail - found["back-to-back 1363, rail level"] == pytest.approx(1.5 * MM, abs=20e-6)
    assert found["gauge 1432, axle"] == pytest.approx(9 * MM, abs=0.25 * MM)
    search = ContactSearch(Wheelset(wheel_profile("P8")), Track.plain_line())
    before, after = (search.settle(at_rail + d, held_at="rail") for d in (-1e-6, 1e-6))
    assert (
        search.contacts(before, "left").lowest().from_flange_back[0]
        - search.contacts(after, "left").lowest().from_flange_back[0]
        > 15 * MM
    )
    # the wheelset rolls about the rails
    assert at_rail - flange_shift(search, "axle") == pytest.approx(before.roll * 0.425, abs=0.05 * MM)


@pytest.mark.validate
def test_the_wear_that_is_found_leaves_less_than_half_a_picture_point():
    wear, left = fitted_wheel()
    assert left < THEORETICAL_STEP / 2 and 0.3 < wear[0] < 0.7
