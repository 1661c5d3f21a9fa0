"""Wearing in or ratchetting, from what finished runs report of each pass."""

from dataclasses import replace

import numpy as np
import pytest

from rail_fem.result.result import PassResult, load
from rail_fem.sweeps.compare_passes import added, compare_passes, factors, falls, steel_of, table
from tests.commands import call
from tests.rail_fem.test_scene import CYCLIC, make_scene


def made_up(growth, cyclic: bool, part="nose") -> PassResult:
    """A run whose passes add so much [mm3] to a part of the crossing."""
    steel = {"grade": "Mn13", "cyclic": CYCLIC} if cyclic else "Mn13"
    reports = [
        {f"integral_{part}": 1e-9 * total, f"block_{part}": 1e-4 * total, f"largest_force_{part}": 2e5}
        for total in np.cumsum(growth)
    ]
    time = np.linspace(0, 1e-3, 5)
    history = dict.fromkeys(("time", "x", "force", "force_wing", "force_nose"), time)
    return PassResult("fe_full", make_scene(materials={"nose": steel}), {}, history, passes=tuple(reports))


def test_a_geometric_growth_gives_its_factor_and_the_rest_of_its_series():
    result = made_up(300 * 0.5 ** np.arange(8), False)
    assert added(result) == pytest.approx(1e-9 * 300 * 0.5 ** np.arange(8), rel=1e-9)
    assert factors(added(result)) == pytest.approx((0.5, 0.5), rel=1e-9)
    row = table([result], [np.full(8, 1e-6)]).markdown().splitlines()[-1]
    assert "| 2 | 1, 1, 1" in row and "isotropic" in row and "0.50, 0.50" in row  # 300 / 2^7 and as much again


def test_a_growth_that_stays_has_no_end():
    text = table([made_up(np.full(8, 50.0), True)], [np.full(8, np.nan)]).markdown()
    assert "no end" in text and "2 back stresses, mixing 0.5" in text
    assert np.isnan(factors(np.ones(3))[0])


def test_steels_are_named_and_single_passes_refused(tmp_path):
    assert steel_of(made_up([1.0], False)) == "Mn13, isotropic hardening"
    made_up([1.0], False).save(tmp_path)
    with pytest.raises(ValueError, match="passes = 2 or more"):
        compare_passes([tmp_path], "nose", None)


def test_the_surface_of_each_pass_is_read_from_its_folder(tmp_path):
    for k, fall in enumerate((3e-4, 4e-4, 4.5e-4), 1):
        metal = {"nose": {"surface": {"x": [0.35, 0.36], "fall": [0.5 * fall, fall]}}}
        replace(made_up(np.ones(k), False), metal=metal).save(tmp_path if k == 3 else tmp_path / f"pass_{k:04d}")
    assert falls(tmp_path, load(tmp_path)) == pytest.approx([3e-4, 4e-4, 4.5e-4], rel=1e-12)


def test_table_and_figure_are_written(tmp_path):
    for name, cyclic in (("a", False), ("b", True)):
        made_up(300 * 0.8 ** np.arange(8), cyclic).save(tmp_path / name)
    call("compare", tmp_path / "a", tmp_path / "b", "--passes", "nose", "--out", tmp_path / "out")
    assert (tmp_path / "out" / "passes.png").stat().st_size > 10_000
    assert "0.80, 0.80" in (tmp_path / "out" / "passes.md").read_text()
    assert "choose from leg, wing, nose" in call("compare", tmp_path / "a", "--passes", "frog", code=2).output


def test_the_leg_is_of_the_wing_rail_s_steel_and_has_numbers_of_its_own():
    result = made_up(300 * 0.5 ** np.arange(8), True, "leg")  # the cyclic steel is the nose's
    assert steel_of(result, "leg") == steel_of(result, "wing") != steel_of(result)
    row = table([result], [np.full(8, 1e-6)], "leg").markdown().splitlines()[-1]
    assert "200, 200" in row and "0.50, 0.50" in row
    with pytest.raises(ValueError, match="choose from leg, wing, nose"):
        compare_passes([], "frog", None)
