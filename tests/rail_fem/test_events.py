"""Transfer, first impact, largest forces and what may be an accident of the window, on histories whose answers are
known."""

from dataclasses import replace

import numpy as np
import pytest

from bem.exact.hertz import tangent_stiffness
from rail_fem.contact.contact_table import contact_table
from rail_fem.result.events import (
    IMPACT,
    OPEN,
    SHARE,
    end_warnings,
    first_maximum,
    flights,
    force_peaks,
    longest_flight,
    lost_contact,
    transfer_position,
)
from rail_fem.result.result import PassResult
from tests.rail_fem.test_scene import make_scene

LOAD = 1e5
X = np.linspace(0.2, 0.7, 501)  # rows of 1 mm
FACING, TRAILING = 1.0, -1.0


def history(share, sign=FACING, force=LOAD):
    """share of the nose as a function of x;  force : of the wheel, a number or a function of x. Rows in the order of
    time."""
    x = X if sign > 0 else X[::-1]
    total = force(x) if callable(force) else np.full(len(x), force)
    nose = total * share(x)
    return {"time": np.arange(len(x)) * 1e-4, "x": x, "force": total, "force_wing": total - nose, "force_nose": nose}


def on_nose(*stretches):
    return lambda x: np.where(np.any([(x > low) & (x < high) for low, high in stretches], axis=0), 1.0, 0.0)


def bump(at, height, width=0.03):
    return lambda x: height * np.exp(-(((x - at) / width) ** 2))


@pytest.mark.parametrize("sign", [FACING, TRAILING])
def test_the_transfer_of_a_clean_pass_is_the_same_place_in_both_directions(sign):
    """The nose's share goes linearly from 0 to 1 over 40 mm around x = 350.4 mm, between two rows: exact, whichever way
    the wheel runs."""
    share = lambda x: np.clip((x - 0.3504) / 0.04 + 0.5, 0, 1)
    assert transfer_position(history(share, sign), sign, LOAD) == pytest.approx(0.3504, abs=1e-12)


def test_a_wheel_that_bounces_between_the_bodies_has_transferred_at_the_last_change():
    """On the nose from 0.330 to 0.345 and from 0.361 mm on. Facing it comes to stay on the nose at 0.361; trailing it
    comes to stay on the wing at 0.330: for good means in the order of time, for every model."""
    share = on_nose((0.3295, 0.3455), (0.3605, 1.0))
    assert transfer_position(history(share), FACING, LOAD) == pytest.approx(0.3605, abs=1e-12)
    assert transfer_position(history(share, TRAILING), TRAILING, LOAD) == pytest.approx(0.3295, abs=1e-12)


@pytest.mark.parametrize(
    "stretches", [[], [(0.0, 1.0)], [(0.3, 0.4)]], ids=["wing only", "nose only", "back to the wing"]
)
def test_there_is_no_transfer_where_the_nose_does_not_take_over(stretches):
    found = history(on_nose(*stretches))
    peaks = force_peaks(found, FACING, LOAD)
    assert np.isnan(transfer_position(found, FACING, LOAD)) and not {IMPACT, *SHARE.values()} & set(peaks)


def test_after_a_flight_the_transfer_is_where_the_wheel_lands():
    force = lambda x: np.where((x > 0.3405) & (x < 0.3705), 0.0, LOAD)
    assert transfer_position(history(on_nose((0.35, 1.0)), force=force), FACING, LOAD) == pytest.approx(0.371)
    assert transfer_position(history(on_nose((0.35, 1.0)), TRAILING, force), TRAILING, LOAD) == pytest.approx(0.340)


def test_less_than_a_thousandth_of_the_static_load_is_no_contact():
    """Beyond the transfer something brushes the wing; on every model the same threshold decides whether that counts."""
    for brushed, position in ((0.9 * OPEN * LOAD, 0.3505), (1.1 * OPEN * LOAD, np.nan)):
        found = history(on_nose((0.3505, 0.6005)), force=lambda x: np.where(x > 0.6, brushed, LOAD))
        assert transfer_position(found, FACING, LOAD) == pytest.approx(position, nan_ok=True)


def test_a_touch_below_a_thousandth_of_the_static_load_is_no_first_contact():
    """The wheel is on its way down: what brushes it from row 50 on begins contact only above the threshold, and only
    then is the way to the landing a flight."""
    for brushed, count in ((0.9 * OPEN * LOAD, 0), (1.1 * OPEN * LOAD, 1)):
        force = np.concatenate([np.zeros(50), np.full(10, brushed), np.zeros(40), np.full(100, LOAD)])
        assert len(lost_contact(np.arange(200) * 1e-4, np.arange(200) * 1e-3, force, LOAD)) == count


def test_rows_of_the_settling_count_for_nothing():
    found = history(on_nose((0.35, 1.0)), force=lambda x: LOAD + bump(0.25, 9 * LOAD)(x))
    settled = found["time"][100]  # at x = 0.3 m
    assert force_peaks(found, FACING, LOAD)["largest_force"].x == pytest.approx(0.25, abs=1e-3)
    assert force_peaks(found, FACING, LOAD, settled)["largest_force"].x > 0.3
    assert np.isnan(transfer_position(found, FACING, LOAD, found["time"][200]))


@pytest.mark.parametrize("sign, body", [(FACING, "nose"), (TRAILING, "wing")])
def test_the_first_impact_is_that_of_the_body_that_takes_over_not_the_largest_force(sign, body):
    """Landings of 1.8 and 2.6 times the load after the transfer at 0.45 m, and one of 3 before it: the first is the
    first, the largest the largest."""
    position = lambda ahead: 0.45 + sign * ahead
    force = lambda x: (
        0.2 * LOAD
        + bump(position(0.06), 1.8 * LOAD)(x)
        + bump(position(0.18), 2.6 * LOAD)(x)
        + bump(position(-0.15), 3.0 * LOAD)(x)
    )
    found = force_peaks(history(on_nose((0.45, 1.0)), sign, force), sign, LOAD)
    first, largest = found[f"first_impact_on_{body}"], found["largest_force"]
    assert (first.x, first.value) == pytest.approx((position(0.06), 2.0 * LOAD), rel=1e-3)
    assert (largest.x, largest.value) == pytest.approx((position(-0.15), 3.2 * LOAD), rel=1e-3)
    assert found[f"largest_force_{body}"].x == pytest.approx(position(0.18), abs=1e-3)


@pytest.mark.parametrize("sign, share", [(FACING, "first_impact_on_nose"), (TRAILING, "first_impact_on_wing")])
def test_the_impact_on_the_wheel_counts_what_the_other_body_still_carries(sign, share):
    """From its touch on the receiving body takes over linearly within 0.1 m; the wheel's force peaks at 2.6 of the load
    half-way, the share at its end. What the other body has left at the touch (3 times the load, falling) and
    what comes after the wheel's next minimum are none of it."""
    ahead = lambda x: sign * (x - 0.45)
    falling = lambda x: 1.5 * LOAD * np.clip(-(ahead(x) + 0.042) / 0.02, 0, 2)
    force = lambda x: 0.6 * LOAD + (falling(x) + bump(0.45, 2 * LOAD)(x) + bump(0.45 + sign * 0.15, 3 * LOAD)(x))
    taken = lambda x: np.clip(ahead(x) / 0.1 + 0.5, 0, 1)
    nose = taken if sign > 0 else lambda x: 1 - taken(x)
    found = force_peaks(history(nose, sign, force), sign, LOAD)
    assert (found[IMPACT].x, found[IMPACT].value) == pytest.approx((0.45, 2.6 * LOAD), abs=2e-3 * LOAD)
    assert found[IMPACT].value > 1.1 * found[share].value and ahead(found[share].x) > 5e-3
    assert [name for name in found if name.startswith("first")] == [share]


def test_what_shakes_with_the_mesh_is_no_impact():
    """A ripple of 10 % of the static load on the rise does not end it; one of 30 % does."""
    rise = lambda x: LOAD + bump(0.45, LOAD, 0.05)(x)
    for ripple, at in ((0.1, 0.45), (0.3, None)):
        found = force_peaks(
            history(on_nose((0.35, 1.0)), force=lambda x: rise(x) + ripple * LOAD / 2 * np.sin(2 * np.pi * x / 4e-3)),
            FACING,
            LOAD,
        )
        assert (found["first_impact_on_nose"].x == pytest.approx(0.45, abs=4e-3)) == (at is not None)
    assert [
        first_maximum(np.array(values, float), 2.5)
        for values in ([1, 5, 3, 9, 0], [1, 5, 2, 9, 0], [1, 2, 3], [3, 2, 1])
    ] == [3, 1, 2, 0]


def test_a_model_of_one_body_knows_no_transfer():
    found = {
        name: values
        for name, values in history(on_nose((0.35, 1.0))).items()
        if name not in ("force_wing", "force_nose")
    }
    assert np.isnan(transfer_position(found, FACING, LOAD)) and set(force_peaks(found, FACING, LOAD)) == {
        "largest_force"
    }
    nothing = {name: np.empty(0) for name in ("time", "x")}
    assert (
        np.isnan(transfer_position(nothing, FACING, LOAD))
        and force_peaks(nothing, FACING, LOAD) == {}
        and end_warnings(nothing, {}, LOAD) == ()
    )


@pytest.mark.parametrize("end, words", [
    (lambda x: np.where(x > 0.6, LOAD * (1 + 5 * (x - 0.6)), LOAD), "1.49 times the static load and rising"),
    (lambda x: LOAD * (1 + 0.5 * np.clip((0.8 - x) / 0.3, 0, 1)), "1.17"),
    (lambda x: LOAD * (1 + np.clip((0.8 - x) / 0.3, 0, 1)), "1.34 times the static load:"),
], ids=["rising", "below the limit", "falling"])  # fmt: skip
def test_a_run_that_ends_under_more_than_its_static_load_says_so(end, words):
    found = history(on_nose((0.35, 1.0)), force=end)
    said = [text for text in end_warnings(found, {}, LOAD) if "the run ends" in text]
    assert len(said) == (words != "1.17") and all(words in text and "x = 700 mm" in text for text in said)


@pytest.mark.parametrize("start, told", [(0.21, True), (0.26, False)])
def test_a_run_that_begins_within_the_transfer_says_so(start, told):
    """Trailing over a nose of 1:21 from 700 mm, with the wing at half: 205 kN where a wheel from 1 m has 170."""
    found = history(lambda x: np.clip((x - start) / 0.04 + 0.5, 0, 1))
    said = end_warnings(found, {}, LOAD)
    assert len(said) == told and all(
        "begins at x = 200 mm with wing and nose carrying at once" in text for text in said
    )


@pytest.mark.parametrize("left, told", [(0.6, True), (0.695, True), (0.71, False)])
def test_a_run_that_ends_in_the_air_says_so(left, told):
    found = history(on_nose((0.35, 1.0)), force=lambda x: np.where(x > left, 0.0, LOAD))
    said = [text for text in end_warnings(found, {}, LOAD) if "the run ends in flight" in text]
    assert len(said) == told and all(f"from x = {left * 1e3 + 1:.0f} mm on: its landing" in text for text in said)


@pytest.mark.parametrize(
    "at, near",
    [
        (0.693, "7.0 mm from where the path ends"),
        (0.689, ""),
        (0.208, "8.0 mm from where the path begins"),
        (0.211, ""),
    ],
)
def test_a_peak_close_to_an_end_of_the_path_says_so(at, near):
    found = history(on_nose((0.35, 1.0)), force=lambda x: LOAD + bump(at, LOAD, 2e-3)(x))
    said = [
        text
        for text in end_warnings(found, force_peaks(found, FACING, LOAD), LOAD)
        if text.startswith("largest force 200.0 kN")
    ]
    assert len(said) == bool(near) and all(near in text for text in said)
    steady = history(on_nose((0.35, 1.0)))
    assert end_warnings(steady, force_peaks(steady, FACING, LOAD), LOAD) == ()  # a constant force has no peak


@pytest.mark.parametrize("at, said", [(0.675, "15 mm"), (0.655, "")])
def test_a_peak_within_forty_millimetres_of_the_end_of_all_steel_says_so(at, said):
    found = history(on_nose((0.35, 1.0)), force=lambda x: LOAD + bump(at, LOAD, 2e-3)(x))
    peaks = force_peaks(found, FACING, LOAD)
    told = [text for text in end_warnings(found, peaks, LOAD, free_end=True) if text.startswith("largest force 200")]
    assert len(told) == bool(said) and all(f"go on for {said}" in text for text in told)
    assert end_warnings(found, peaks, LOAD) == ()
    nearly = {"largest_force": replace(peaks["largest_force"], x=X[-1] - 0.0397)}  # 0 mm to go
    assert end_warnings(found, nearly, LOAD, free_end=True) == ()


def test_contact_stiffness_is_the_derivative_of_the_force_and_the_carrier_is_the_higher_body():
    constant, step = 3e10, 1e-9
    depth = (LOAD / constant) ** (2 / 3)
    slope = constant * ((depth + step) ** 1.5 - (depth - step) ** 1.5) / (2 * step)
    assert tangent_stiffness(constant, LOAD) == pytest.approx(slope, rel=1e-8)
    table = contact_table(make_scene(), 0.3, 0.4, 5e-3)
    for x, body in ((0.3, 0), (0.4, 1)):
        found, at = table.carrier(x)
        assert found == body and table.x[at] == pytest.approx(x) and table.height[body, at] == table.height[:, at].max()


def test_a_flight_is_known_by_place_time_and_launch_speed():
    """A mass thrown up at 0.3 m/s under 170 m/s2 is in the air for 2 v / g = 3.53 ms: 118 mm at 33.5 m/s."""
    launch, gravity, speed = 0.3, 170.0, 33.5
    time = np.arange(-200, 400) * 20e-6
    air = (time > 0) & (time < 2 * launch / gravity)
    force = np.where(air, 0.0, LOAD)
    height = np.where(time > 0, launch * time - gravity * time**2 / 2, launch * time) * (time < 2 * launch / gravity)
    columns = {"time": time + 1.0, "x": -0.7 + speed * time, "force": force, "wheel_height": height}
    result = PassResult("rigid_hertz", make_scene(), {}, columns)
    flight = longest_flight(result)
    assert len(flights(result)) == 1 and flight.launch_speed == pytest.approx(launch, abs=2 * 20e-6 * gravity)
    assert flight.duration == pytest.approx(2 * launch / gravity, abs=2 * 20e-6)
    assert flight.length == pytest.approx(speed * flight.duration) and flight.x_start == pytest.approx(-0.7, abs=1e-3)
    assert longest_flight(PassResult("lumped", make_scene(), {}, columns | {"force": np.full(600, LOAD)})).duration == 0


def test_the_leg_and_the_wing_behind_it_have_their_own_largest_forces():
    found = history(on_nose((0.6, 1.0)), force=lambda x: LOAD + bump(0.3, 2 * LOAD)(x) + bump(0.45, LOAD)(x))
    peaks = force_peaks(found, FACING, LOAD, leg_end=0.4)
    assert [peaks[name].x for name in ("largest_force_leg", "largest_force_wing")] == pytest.approx(
        [0.3, 0.45], abs=2e-3
    )
    assert "largest_force_leg" not in force_peaks(found, FACING, LOAD)
