"""Rolling over the transfer with memory and without: a short stretch, the other direction, a figure."""

import numpy as np
import pytest

from rail_fem.case.casefile import load_case
from rail_fem.studies import transient_rolling as study


@pytest.fixture(scope="module")
def found():
    read = load_case(study.CASE, {"damage.cells": 12})
    return read, study.compare(read.scene, read.damage, {"start": "340 mm", "end": "400 mm"}, 0.4e-3)


def test_friction_work_lags_behind_the_load(found):
    """Where the nose takes the load over, points came under a smaller patch and slip less than in the steady state;
    where the wing gives it up they slip more. By what a point keeps as the bed softens it differs by less than that."""
    _, both = found
    nose, wing = both["nose"], both["wing"]
    rises, falls = np.gradient(nose.load) > 0, np.gradient(wing.load) < 0
    assert 0.6 < nose.moving.power[rises].sum() / nose.steady.power[rises].sum() < 0.97
    assert 1.01 < wing.moving.power[falls].sum() / wing.steady.power[falls].sum() < 1.4
    for own in both.values():
        assert own.traction.power.sum() / own.moving.power.sum() == pytest.approx(1, abs=0.1)
        assert own.coarse.power.sum() * 2 / own.moving.power.sum() == pytest.approx(1, abs=0.02)
        assert np.isfinite(own.moving.force).all() and (own.moving.volume >= 0).all()


def test_table_and_figure(found):
    _, both = found
    assert [row[0] for row in study.table(both, 0.4e-3).rows] == ["wing", "nose"]
    load, work = study.panels(both)
    assert set(load.lines) == {"wing", "nose"} and len(work.lines) == 4


def test_its_case_is_found_from_any_folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert load_case(study.CASE).damage is not None


def test_a_body_that_never_carries_is_said():
    read = load_case(study.CASE, {"damage.cells": 12})
    with pytest.raises(ValueError, match="nose: carries at 0 position"):
        study.compare(read.scene, read.damage, {"start": "200 mm", "end": "230 mm"}, 0.4e-3)
