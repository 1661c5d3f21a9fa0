"""Four wheels on the leg: why a P1 does not fly where the thesis says it does."""

import pytest

from rail_fem.output.events import longest_flight, stated_peaks
from rail_fem.studies import leg_wheels
from rail_fem.studies.leg import CROSSING


@pytest.fixture(scope="module")
def found():
    shorter = {CROSSING + "transition_length": "40 mm"}
    return {
        "worn": leg_wheels.on_leg("P8-worn", {}),
        "cone": leg_wheels.on_leg("P1", {}),
        "cone, 40 mm": leg_wheels.on_leg("P1", shorter),
    }


def test_the_leg_lifts_a_worn_wheel_and_lowers_a_cone_by_what_its_crown_stood_proud(found):
    """The cast section is a plane of 1:20, a P1's tread a cone of 1:20: the cone loses what the plain rail's crown
    stood above that plane under it, which is no climb anywhere."""
    worn, cone = (found[name].path for name in ("worn", "cone"))
    assert worn.height[-1] - worn.height[0] > 0.8e-3 and worn.slope.max() > 25e-3
    assert -0.4e-3 < cone.height[-1] - cone.height[0] < -0.2e-3 and cone.slope.max() < 2e-3


def test_a_wheel_leaves_a_path_that_falls_away_faster_than_it_can_fall(found):
    """V^2 |h''| against P0 / Mu: below 1 a P1 stays on the leg, above it flies, and lands with a larger force."""
    whole, short = found["cone"], found["cone, 40 mm"]
    assert whole.falls_away < 1 and longest_flight(whole.result).length == 0
    assert short.falls_away > 1 and longest_flight(short.result).length > 5e-3
    force = [one.result.peaks["largest_force"].value for one in (whole, short)]
    assert force[1] > 1.05 * force[0]


def test_on_the_benchmark_s_leg_the_worn_wheel_has_the_larger_force(found):
    worn, cone = (stated_peaks(found[name].result)["largest_force_leg"].value for name in ("worn", "cone"))
    assert worn > 1.5 * cone


def test_the_table_has_a_row_for_each(found):
    rows = [leg_wheels.row(name, one) for name, one in found.items()]
    lines = leg_wheels.table(rows)
    assert len(lines) == 5 and all(line.count("|") == 9 for line in lines)
    assert rows[1][-1] == "none"
