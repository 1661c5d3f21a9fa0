"""The trust report: rules made from the limits, shares from made-up energies whose answers are known, the overlap that
is really there."""

import re
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from rail_fem.fe.diagnostics import deforming_share, penetration
from rail_fem.fe.mass_scaling import MassScaling
from rail_fem.fe.trust import BAD, GOOD, LIMITS, WARN, _static_row, balance_scale, judged, report_rows
from rail_fem.models.fe_full import judged_over_passes
from rail_fem.result.history import complete_history
from rail_fem.result.trust import last_known, numerical_shares, trust_text, verdict_words
from rail_fem.show.energies import resolved_shares
from tests.fe.test_rebound import STEELS, throw
from tests.rail_fem.surrogate_run import write_run

TIME = np.linspace(0.0, 10e-3, 101)
SETTLED = 2e-3
WORK = 50.0
UNSCALED = MassScaling(1.0, {"crossing": 20.0, "wheel": 14.0}, {"crossing": 750.0, "wheel": 500.0}, 0.04, "")


def energies():
    """An elastic body that is pressed with 20 J, let go to 1 J, and has taken 5 J of plastic work: 25 J at most. While
    it settles all is nonsense."""
    pressed = np.where(TIME < 6e-3, 20.0, 1.0)
    history = {
        "time": TIME,
        "x": TIME * 30,
        "energy_elastic": pressed,
        "energy_plastic": np.full(101, 5.0),
        "energy_hourglass": np.linspace(0, 1.25, 101),
        "energy_contact": np.where(TIME < 6e-3, 0.25, 0.0),
        "energy_contact_loss": 100 + TIME * 50,
        "energy_balance": -40 + np.where(TIME > SETTLED, 7 + 100 * TIME, 0),
    }
    return complete_history(history)


def test_shares_are_those_of_the_largest_internal_energy_so_far_and_of_the_impacts_work():
    shares = numerical_shares(energies(), SETTLED, WORK)
    assert all(np.isnan(values[TIME <= SETTLED]).all() for values in shares.values())
    assert last_known(shares["energy_hourglass"]) == pytest.approx(1.25 / 25, rel=1e-12)
    # not 0.25 / 6, of what is left at the end
    assert np.nanmax(shares["energy_contact"]) == pytest.approx(0.25 / 25, rel=1e-12)
    duration = TIME[-1] - TIME[TIME > SETTLED][0]
    assert last_known(shares["balance_contact"]) == pytest.approx(50 * duration / WORK, rel=1e-12)
    assert last_known(shares["balance_bodies"]) == pytest.approx(150 * duration / WORK, rel=1e-12)


def facts(**changes):
    history = energies()
    return {
        "shares": numerical_shares(history, SETTLED, WORK),
        "impact_work": WORK,
        "balance_scale": WORK,
        "internal_energy": 25.0,
        "hourglass_zone": 0.02,
        "penetration": (9.7e-6, 3.3e-6),
        "approach": 104e-6,
        "initial_clearance": 0.0,
        "resting": True,
        "transfers": True,
        "static_error": 0.004,
        "step": 1e-7,
        "step_ratio": 0.9,
        "limit": 1.1e-7,
        "element_limit": 1e-7,
        "rechecks": 3,
        "outside": 0.2,
        "chatter": (0.0, 0.0),
        "penalty_factor": 1.0,
        "window": None,
        "scaling": UNSCALED,
        "deforming": (0.004, 0.02),
    } | changes


def test_the_figure_of_the_energies_ends_with_the_numbers_of_the_report(tmp_path):
    """Same function, same denominators: what the picture shows at the end of the pass is what the rows say."""
    rows = {row.name: row for row in report_rows(facts())}
    result = write_run(
        tmp_path,
        history=energies(),
        energies={"impact_work": WORK},
        trust={"rows": [row.plain() for row in rows.values()]},
    )
    drawn = resolved_shares(result)
    assert last_known(drawn["energy_hourglass"]) == rows["hourglass energy, all bodies"].value
    assert abs(last_known(drawn["balance_bodies"])) == rows["energy balance of the bodies"].value
    assert abs(last_known(drawn["balance_contact"])) == rows["energy balance of the contact"].value
    assert np.nanmax(drawn["energy_contact"]) == rows["penalty energy"].value


@pytest.mark.parametrize("name", LIMITS)
def test_the_rule_in_words_is_the_limit_that_judges(name):
    """Just below and just above each number that the words of a row name, the verdict changes."""
    warn, bad = (float(number) / 100 for number in re.findall(r"([\d.]+) %", judged(name, 0.0, "").rule))
    for value, verdict in (
        (0.999 * warn, GOOD),
        (1.001 * warn, WARN),
        (0.999 * bad, WARN),
        (1.001 * bad, BAD),
        (np.nan, BAD),
    ):
        row = judged(name, value, f"{value:.2%}")
        assert row.verdict == verdict
        for told in (row.shown, row.short) if value > 0 else ():  # rounded, too, on its side of the limits
            assert [float(told[:-1]) / 100 > one for one in (warn, bad)] == [value > one for one in (warn, bad)]
            assert float(told[:-1]) / 100 not in (warn, bad)


def test_rows_name_what_they_divide_by():
    rows = {row.name: row for row in report_rows(facts())}
    assert rows["hourglass energy where it yielded"].shown == "2.00% of the plastic work there"
    assert (
        "9.70 um at worst, 9.33% of the approach" in rows["largest penetration"].shown
        and rows["largest penetration"].verdict == WARN
    )
    assert (
        "3.30 um, 3.17% of the approach" in rows["mean penetration"].shown and rows["mean penetration"].verdict == GOOD
    )


def test_a_travelling_window_is_judged_by_what_was_cut_off_at_its_ends():
    """By the larger of kinetic energy lost over the impact's work and plastic work done in the last slab over all."""
    assert "ends of the travelling window" not in {row.name for row in report_rows(facts())}
    for kinetic, late, expected in ((0.004 * WORK, 0.0, GOOD), (0.0, 0.4, WARN), (0.06 * WORK, 0.0, BAD)):
        window = {"left_kinetic": kinetic, "left_elastic": 1.0, "late_flow": late, "plastic": 20.0, "share": 0.3}
        row = {row.name: row for row in report_rows(facts(window=window))}["ends of the travelling window"]
        assert row.verdict == expected
        assert row.value == pytest.approx(max(kinetic / WORK, late / 20.0), rel=1e-12)


def test_a_smaller_impact_makes_no_worse_run_of_the_same_loss():
    """41 J lost along half a metre: of impacts of 655 and 229 J. The scale is the impact's work where that is more."""
    rows = []
    for work in (655.0, 229.0):
        scale = balance_scale(work, 100e3, 0.655)
        shares = numerical_shares(energies(), SETTLED, scale)
        rows += report_rows(facts(shares=shares, impact_work=work, balance_scale=scale))[:2]
    assert [row.value for row in rows[:2]] == [row.value for row in rows[2:]]
    assert "of the impact's work 655 J" in rows[0].shown and "a hundredth of the load" in rows[2].shown
    assert balance_scale(800.0, 100e3, 0.655) == 800.0 and balance_scale(np.nan, 100e3, -0.5) == 500.0


def test_the_trust_of_several_passes_is_the_worst_of_them_with_its_number(tmp_path):
    """Hourglass 5.6 % in the first pass and 4.1 % in the last: the warning of the pass that does most stays."""
    made = []
    for zone, balance in ((0.056, 0.02), (0.049, 0.01), (0.041, 0.03)):
        rows = report_rows(facts(hourglass_zone=zone))
        result = write_run(
            tmp_path / str(zone), history=energies(), trust={"rows": [row.plain() for row in rows]}, energies={}
        )
        own = tuple(f"{row.name}: {row.shown} (rule: {row.rule})" for row in rows if row.verdict != GOOD)
        made.append(replace(result, warnings=(*own, f"ends {zone}"), error_estimate={"energy_balance": balance}))
    whole = judged_over_passes(made[-1], made)
    rows = {row["name"]: row for row in whole.trust["rows"]}
    zone = rows["hourglass energy where it yielded"]
    assert zone["value"] == 0.056 and zone["verdict"] == WARN and zone["shown"].startswith("pass 1 of 3: 5.60%")
    assert rows["mean penetration"] == report_rows(facts())[6].plain()  # good in all
    assert sum("pass 1 of 3: 5.60%" in warning for warning in whole.warnings) == 1
    assert whole.warnings[-3:] == ("pass 1: ends 0.056", "pass 2: ends 0.049", "ends 0.041")
    assert whole.error_estimate == {"energy_balance": 0.03}


def test_penetration_is_weighted_by_the_force():
    rows = np.array([[2e-6, 1e5 * 1e-6, 1e5], [9e-6, 3e5 * 4e-6, 3e5], [0.0, 0.0, 0.0]])
    assert penetration(rows) == pytest.approx((9e-6, 3.25e-6), rel=1e-12)
    assert np.isnan(penetration(np.zeros((2, 3)))).all() and np.isnan(penetration(np.zeros((0, 3)))).all()


def test_steel_that_gives_back_what_an_earlier_pass_left_in_it_has_a_share_of_deformation():
    """Internal energy counted from its lowest: 30 J given back, then 30 J taken up, with 0.3 J in motion."""
    run = SimpleNamespace(recorder=SimpleNamespace(deforming=[9.0, 0.0, 0.3, 0.3]))  # the first row is settling
    time, elastic = np.array([0.0, 1.0, 2.0, 3.0]), np.array([0.0, -30.0, 0.0, 30.0])
    history = {"time": time, "energy_elastic": elastic, "energy_plastic": np.zeros(4)}
    assert deforming_share(run, history, 0.5) == pytest.approx((0.2 / 30, 0.3 / 60), rel=1e-12)
    history["energy_elastic"] = np.array([0.0, 10.0, 20.0, 30.0])  # a first pass: as it is
    assert deforming_share(run, history, 0.5) == pytest.approx((0.2 / 20, 0.3 / 30), rel=1e-12)


def test_the_static_row_says_where_there_is_nothing_to_judge():
    assert (
        "no transfer in this window" in _static_row(0.004, True, False).shown
        and _static_row(0.004, True, False).verdict == GOOD
    )
    assert "transfer" not in _static_row(0.03, True, True).shown and _static_row(0.03, True, True).verdict == WARN
    loses = _static_row(-0.15, True, True)
    assert loses.verdict == BAD and "shallower than the groove" in loses.shown and "begin 40 mm" in loses.shown
    assert all("groove" not in _static_row(error, True, True).shown for error in (-0.004, 0.15))
    assert _static_row(np.nan, True, True).verdict == WARN and "bends within" in _static_row(np.nan, True, True).shown
    assert (
        _static_row(np.nan, False, True).verdict == GOOD
        and "begins in motion" in _static_row(np.nan, False, True).shown
    )


def test_report_and_verdict_in_words():
    trust = {"rows": [row.plain() for row in report_rows(facts(hourglass_zone=0.064))], "slowest": ["element 7"]}
    text = trust_text(trust, ["the wheel is a surrogate"])
    assert (
        "1 warning(s)\n    the wheel is a surrogate" in text
        and "element 7" in text
        and text.count("(rule: ") == len(trust["rows"])
    )
    words = verdict_words(trust)
    assert (
        words.startswith("3 of 14 rows fail: ")
        and "hourglass energy where it yielded 6.4%" in words
        and "energy balance of the bodies" in words
    )
    assert verdict_words({"rows": [judged("penalty energy", 0.0, "").plain()]}) == "good" and verdict_words({}) == ""
    assert trust_text({}, []).splitlines()[0] == "how far to trust this run"


@pytest.mark.parametrize("speed", [0.0, 10.0])
def test_overlap_is_how_deep_the_surfaces_lie_in_one_another(speed):
    """A cube set 1 um into a plate: that, everywhere. Thrown at it: the lowest node of its sole where the step before
    the last has left it."""
    dynamics = throw(STEELS["elastic"], speed, gap=-1e-6)
    contact, dt = dynamics.contact, dynamics.stable_step()
    dynamics.step(dt)
    deepest, work, force = contact.overlap()
    assert (deepest, work / force) == pytest.approx((1e-6, 1e-6), rel=1e-6) and force > 0
    for _ in range(20):
        lowest = dynamics.structure.x.reshape(-1, 3)[:, 2][
            dynamics.structure.domain.local_nodes(contact.surfaces.input_nodes[contact.surfaces.n_rail :])[0]
        ].min()
        dynamics.step(dt)
    deepest, work, force = contact.overlap()
    assert deepest == pytest.approx(max(-lowest, 0.0), abs=1e-9) and 0 <= work <= deepest * force


@pytest.mark.parametrize("mean, remedy", [(0.004, ""), (0.08, "take mass_scaling = 6.2"), (np.nan, "")])
def test_a_scaling_whose_inertia_shows_is_said_with_a_factor_that_would_do(mean, remedy):
    """The energy goes with the factor: 25 with 8 % becomes 6.25 for 2 %. Unscaled runs have the same limit."""
    scaled = MassScaling(25.0, {"crossing": 20.0, "wheel": 14.0}, {"crossing": 750.0, "wheel": 500.0}, 0.2, "as asked")
    rows = {row.name: row for row in report_rows(facts(scaling=scaled, deforming=(mean, 0.1)))}
    row, added = rows["kinetic energy of deformation"], rows["added mass"]
    assert row.verdict == (GOOD if mean < 0.02 else WARN if mean < 0.1 else BAD)
    assert (remedy in row.shown) and ("take mass_scaling" in row.shown) == bool(remedy)
    assert added.value == pytest.approx(24.0) and "816 kg more" in added.shown and "500 of 750 kg" in added.shown


def test_heavier_small_elements_are_told_with_what_they_weigh_and_how_fast_their_waves_are():
    steel, bodies = {"crossing": 20.0, "wheel": 14.0}, {"crossing": 750.0, "wheel": 500.0}
    small = MassScaling(
        100.0, steel, bodies, 0.04, "as asked", least_step=1e-6, scaled={"crossing": 50.0, "wheel": 52.0}, slowness=0.05
    )
    added = {row.name: row for row in report_rows(facts(scaling=small))}["added mass"]
    assert added.value == pytest.approx(2.0) and "68 kg more" in added.shown and "50 of 750 kg" in added.shown
    held = replace(small, bodies=bodies | {"crossing": np.inf})
    assert "crossing 50 kg, held, wheel 52 of 500 kg" in report_rows(facts(scaling=held))[-3].shown
    assert "of the smallest element times 100" in added.shown and "rolls at 0.050 of the speed of waves" in added.shown
