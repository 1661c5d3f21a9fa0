"""A run with a coarse twin: its error bars come from the twin's result, which a restart takes as it is."""

import io
from dataclasses import replace

import numpy as np
import pytest

from geometry.meshing.hexmesh import MeshError
from rail_fem.models import fe_full
from rail_fem.processes.progress import Progress
from rail_fem.result.error_bars import CALIBRATED, calibrated_bars, error_bars
from rail_fem.result.result import load
from rail_fem.settings.explicit import TWIN_COST, FeSettings
from rail_fem.show.force import force_figure
from rail_fem.show.report import result_report
from tests.rail_fem.test_error_bars import at_size

SETTINGS = FeSettings(element_size=3e-3, start=0.095, end=0.110, field_frames=1, mass_scaling="auto", error_twin=True)


class Remembered(Progress):
    """Keeps what status.json was given."""

    def __init__(self, folder):
        self.said = []
        super().__init__(folder, stream=io.StringIO(), interval=0.0)

    def _save(self):
        self.said.append(dict(self.status))
        super()._save()


def test_bars_are_those_of_the_twin_and_a_restart_keeps_it(scene, tmp_path):
    with Remembered(tmp_path) as progress:
        result = fe_full.solve(scene, SETTINGS, tmp_path, progress=progress)
    twin = load(tmp_path / "twin")
    of_twin = [status for status in progress.said if "coarse twin of 6 mm" in status["message"] and status["step"]]
    percent = [status["percent"] for status in progress.said]
    assert percent == sorted(percent) and any(status["eta"] for status in of_twin)
    assert 0 < max(status["percent"] for status in of_twin) <= 100 * TWIN_COST / (1 + TWIN_COST) < percent[-2]
    assert twin.settings["element_size"] == 2 * SETTINGS.element_size and not twin.settings["error_twin"]
    assert twin.cost.elements < result.cost.elements / 2.5 and twin.cost.steps < result.cost.steps
    assert result.error_bars == pytest.approx(error_bars(result, twin))
    assert 0 < result.error_bars["largest_force_wing"] < 0.3 * result.peaks["largest_force_wing"].value
    assert {"worst_1000_wing", "integral_wing"} <= set(result.error_bars) and "block_wing" not in result.error_bars
    forces = [name for name in result.error_bars if name in result.peaks]
    worst = max(result.error_bars[name] / result.peaks[name].value for name in forces)
    assert result.error_estimate["discretisation"] == pytest.approx(worst)
    written = (tmp_path / "twin" / "result.json").stat().st_mtime_ns
    again = fe_full.solve(scene, SETTINGS, tmp_path, restart=True)
    assert again.error_bars == result.error_bars
    assert (tmp_path / "twin" / "result.json").stat().st_mtime_ns == written


def test_calibrated_bars_need_no_twin_and_are_named_as_such(scene, tmp_path, monkeypatch):
    settings = SETTINGS.model_copy(update={"error_twin": "calibrated"})
    monkeypatch.setattr(fe_full, "_passes", lambda *given: at_size(1e-3, settings=settings.model_dump(mode="json")))
    result = fe_full.solve(scene, settings, tmp_path)
    assert result.calibrated and result.error_bars == calibrated_bars(result) and not (tmp_path / "twin").exists()
    # the forces' bar grows with the square of the size
    assert result.error_estimate["discretisation"] == pytest.approx(9 * CALIBRATED["force"][0])
    assert "calibrated" in result_report(replace(result, metal={})).split("note(s)")[1]
    history = {name: np.linspace(0.1, 1.0, 9) for name in ("time", "x", "force")}
    legend = force_figure(replace(result, history=history)).axes[0].get_legend()
    assert any("calibrated" in words.get_text() for words in legend.get_texts())


@pytest.mark.validate
def test_where_twice_the_size_cannot_be_meshed_the_twin_is_less_coarse(scene, tmp_path, monkeypatch):
    make = fe_full.make_mesh

    def refuse_coarse(scene, settings, running):
        if settings.element_size > 5e-3:
            raise MeshError("a folded cell")
        return make(scene, settings, running)

    monkeypatch.setattr(fe_full, "make_mesh", refuse_coarse)
    result = fe_full.solve(scene, SETTINGS, tmp_path)
    twin = load(tmp_path / "twin")
    assert twin.settings["element_size"] == pytest.approx(1.5 * SETTINGS.element_size)
    assert result.error_bars == pytest.approx(error_bars(result, twin)) and result.error_bars


def test_where_no_twin_can_be_meshed_the_run_says_so():
    """The largest that is tried is 6 mm; of 5 mm there is none that is coarser by a quarter."""
    solved, silent = [], Progress(None, active=False)

    def refuse(coarse, below):
        solved.append(coarse.element_size)
        raise MeshError("a folded cell")

    why = fe_full._twin(SETTINGS.model_copy(update={"element_size": 3.5e-3}), None, False, silent, refuse)
    assert why == "no twin of 5.25 mm: a folded cell" and solved == [6e-3, 5.25e-3]
    why = fe_full._twin(SETTINGS.model_copy(update={"element_size": 5e-3}), None, False, silent, refuse)
    assert why == "elements of 5 mm are too large for a coarser twin"


def test_a_run_that_is_cut_off_says_why_it_has_no_bars(scene):
    result = fe_full.solve(scene, SETTINGS.model_copy(update={"element_size": 5e-3, "max_steps": 20}))
    assert result.error_bars == {} and any("no error bars: max_steps" in warning for warning in result.warnings)
