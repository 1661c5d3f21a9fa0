"""A run with a coarse twin: its error bars come from the twin's result, which a restart takes as it is."""

from pathlib import Path

import pytest

from rail_fem.case.casefile import load_case
from rail_fem.models import fe_full
from rail_fem.output.error_bars import error_bars
from rail_fem.output.result import load
from rail_fem.settings.explicit import FeSettings

ROOT = Path(__file__).resolve().parents[2]
SETTINGS = FeSettings(element_size=3e-3, start=0.095, end=0.110, field_frames=1, mass_scaling="auto", error_twin=True)


@pytest.fixture(scope="module")
def scene():
    return load_case(ROOT / "cases" / "nose_transfer.toml").scene


def test_bars_are_those_of_the_twin_and_a_restart_keeps_it(scene, tmp_path):
    result = fe_full.solve(scene, SETTINGS, tmp_path)
    twin = load(tmp_path / "twin")
    assert twin.settings["element_size"] == 2 * SETTINGS.element_size and not twin.settings["error_twin"]
    assert twin.cost.elements < result.cost.elements / 3 and twin.cost.steps < result.cost.steps
    assert result.error_bars == pytest.approx(error_bars(result, twin))
    assert 0 < result.error_bars["largest_force_wing"] < 0.3 * result.peaks["largest_force_wing"].value
    assert {"block_wing", "integral_wing"} <= set(result.error_bars)
    forces = [name for name in result.error_bars if name in result.peaks]
    worst = max(result.error_bars[name] / result.peaks[name].value for name in forces)
    assert result.error_estimate["discretisation"] == pytest.approx(worst)
    written = (tmp_path / "twin" / "result.json").stat().st_mtime_ns
    again = fe_full.solve(scene, SETTINGS, tmp_path, restart=True)
    assert again.error_bars == result.error_bars
    assert (tmp_path / "twin" / "result.json").stat().st_mtime_ns == written


def test_a_run_that_is_cut_off_says_why_it_has_no_bars(scene):
    result = fe_full.solve(scene, SETTINGS.model_copy(update={"element_size": 5e-3, "max_steps": 20}))
    assert result.error_bars == {} and any("no error bars: max_steps" in warning for warning in result.warnings)
