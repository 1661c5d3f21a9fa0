"""The study that holds error bars against finer runs: what it counts, and the real thing on the reference stretch."""

from dataclasses import replace

import numpy as np
import pytest

from rail_fem.result.error_bars import error_bars
from rail_fem.result.quantities import REPORTED
from rail_fem.result.result import Peak
from rail_fem.studies import error_bars as held_out_bars
from rail_fem.studies.error_bars import Held, held
from tests.rail_fem.test_error_bars import FORCE, MM, at_size

QUANTITIES = {"first_impact_on_nose", "transfer_x", "block_nose", "worst_1000_nose", "integral_nose"}


def test_what_converges_at_the_order_holds_and_its_bar_is_wide_by_safety_and_scatter():
    found = held(at_size(2 * MM), error_bars(at_size(2 * MM), at_size(4 * MM)), at_size(1 * MM))
    assert {one.name for one in found} == QUANTITIES and all(one.holds for one in found)
    assert 1 < held_out_bars.median_ratio(found) < 20


def test_a_finer_answer_outside_the_bar_is_counted_and_named():
    finer = at_size(1 * MM)
    finer = replace(finer, peaks=dict.fromkeys(finer.peaks, Peak(2 * FORCE, "N", x=0.38)))
    found = held(at_size(2 * MM), error_bars(at_size(2 * MM), at_size(4 * MM)), finer)
    cells = held_out_bars.row("a scene", found)
    assert cells[1:3] == ["5", "4 (80%)"] and REPORTED["first_impact_on_nose"].meaning in cells[4]
    text = held_out_bars.table("fe_full", {"a scene": found, "another": found}).markdown()
    assert text.splitlines()[-1].startswith("| all | 10 | 8 (80%) |")


def test_a_force_that_is_another_ones_counts_once():
    """The largest force on the nose is the first impact, and the largest anywhere is that."""
    names = (*at_size(1 * MM).peaks, "largest_force_nose", "largest_force")
    peaks = lambda size: dict.fromkeys(names, at_size(size).peaks["first_impact_on_nose"])
    runs = [replace(at_size(size), peaks=peaks(size)) for size in (2 * MM, 4 * MM, 1 * MM)]
    assert {one.name for one in held(runs[0], error_bars(*runs[:2]), runs[2])} == QUANTITIES


def test_nothing_is_claimed_of_nothing():
    assert np.isnan(held_out_bars.median_ratio([])) and held_out_bars.row("none", [])[1:3] == ["0", "0 (0%)"]
    assert Held("first_impact_on_nose", 1.0, 1.0).holds and not Held("first_impact_on_nose", 1.0, 1.0 + 1e-9).holds


@pytest.mark.validate
def test_bars_hold_at_a_speed_they_were_not_fitted_on(tmp_path):
    """100 mph over the nose, 2 mm with its twin of 4 mm against 1 mm: at least 95 % hold."""
    of = held_out_bars.held_on("100 mph", [4 * MM, 2 * MM, 1 * MM], tmp_path)
    found = of["fe_full"]
    assert all(one.holds for light in held_out_bars.LIGHT for one in of[light])
    assert len(found) >= 10 and sum(one.holds for one in found) >= 0.95 * len(found)
    assert held_out_bars.median_ratio(found) < 8
