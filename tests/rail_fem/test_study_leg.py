"""The study of the leg: what throws the wheel, and the leg that was fitted to the thesis."""

import pytest

from rail_fem.case.casefile import load_case
from rail_fem.case.examples import example
from rail_fem.output.events import stated_peaks
from rail_fem.studies import leg

SHORT = {leg.END: "-350 mm"}


@pytest.fixture(scope="module")
def passes():
    variations = dict(leg.VARIATIONS)
    chosen = "reference: worn P8, 1:10.75, 75 mph", "transition of 350 mm", "wheel: P1"
    found = {words: leg.run(variations[words] | SHORT) for words in chosen}
    return found | {"fitted": leg.run(leg.FITTED | SHORT)}


def test_the_fitted_leg_throws_the_wheel_as_the_thesis_says(passes):
    """263.6 kN and 28.49 mm; the search came to 3 and 1 % of them."""
    flight, peak = leg.first_flight(passes["fitted"]), stated_peaks(passes["fitted"])["largest_force_leg"]
    assert flight.length == pytest.approx(28.49e-3, rel=0.05) and peak.value == pytest.approx(263.6e3, rel=0.05)


@pytest.mark.parametrize("words, changes", leg.VARIATIONS)
def test_each_change_is_one_that_a_case_takes(words, changes):
    before, after = (load_case(example("whole_crossing"), leg.WINDOW | own) for own in ({}, changes))
    same = before.scene.plain() == after.scene.plain() and before.runs["rigid_hertz"] == after.runs["rigid_hertz"]
    assert same == (not changes), words


def test_a_gentler_climb_throws_less_and_a_cone_that_drops_does_not_fly(passes):
    reference, gentler, cone = list(passes.values())[:3]
    assert leg.first_flight(reference).length > 2 * leg.first_flight(gentler).length
    assert leg.first_flight(cone) is None
    speeds = [leg.first_flight(result).launch_speed for result in (reference, gentler)]
    assert speeds[0] > 2 * speeds[1] > 0


def test_the_force_and_flight_of_the_thesis_lie_between_two_track_masses():
    """It does not state the mass that it adds to the crossing; 750 kg is that of its P2 formula."""
    light, heavy = (leg.run(dict(leg.VARIATIONS)[f"track mass {mass} kg"] | SHORT) for mass in (100, 150))
    force, length, *_ = leg.THESIS
    between = [stated_peaks(result)["largest_force_leg"].value / 1e3 for result in (light, heavy)]
    assert between[0] < force < between[1]
    assert leg.first_flight(light) is None and leg.first_flight(heavy).length > 1e-3 * length


def test_a_flight_takes_about_the_time_of_its_launch_speed(passes):
    """On rigid bodies: 2 v m / P0. The wheel lands on a track that has come up meanwhile, so it is shorter."""
    reference = passes["reference: worn P8, 1:10.75, 75 mph"]
    flight = leg.first_flight(reference)
    assert 0.5 * flight.launch_speed < leg.ballistic_speed(flight, reference) < flight.launch_speed


def test_the_table_has_a_row_for_each_change_and_the_thesis(passes):
    text = leg.table([leg.row(words, result) for words, result in passes.items()])
    assert len(text.splitlines()) == 2 + len(passes) + 1 and "| 263.6 | 28.49 | 0.85 |" in text
    assert all(line.count("|") == 9 for line in text.splitlines())
