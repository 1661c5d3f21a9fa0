"""The leg by the explicit model: what is run, and (validate) that it throws the wheel as the light model says."""

import pytest
import typer

from rail_fem.case.casefile import load_case
from rail_fem.case.examples import example
from rail_fem.output.events import longest_flight
from rail_fem.studies import leg_explicit


@pytest.mark.parametrize("name", leg_explicit.ROWS)
def test_a_row_runs_over_the_whole_leg_by_both_models(name):
    case = load_case(example("whole_crossing"), leg_explicit.changes_of(name))
    low, high = case.scene.crossing.surface.leg_range
    for model in ("rigid_hertz", "fe_full"):
        settings = case.runs[model]
        assert settings.start < low - 0.05 and settings.end > high + 0.2
    assert case.runs["fe_full"].has_window and case.runs["fe_full"].mass_scaling == "auto"


def test_a_row_that_is_not_there_is_refused(tmp_path):
    with pytest.raises(typer.BadParameter, match="benchmrk is not known, there are benchmark"):
        leg_explicit.main(out=tmp_path, size=4.0, rows="benchmrk", quick=False)


@pytest.mark.validate
def test_both_models_throw_the_wheel_off_the_benchmark_s_leg(tmp_path):
    """Elements of 6 mm: force within 30 %, flight within a third of the light model's."""
    pair = leg_explicit.run("benchmark", 6e-3, tmp_path)
    forces = [result.peaks["largest_force"].value for result in (pair.light, pair.explicit)]
    assert forces[1] == pytest.approx(forces[0], rel=0.3)
    lengths = [longest_flight(result).length for result in (pair.light, pair.explicit)]
    assert lengths[1] == pytest.approx(lengths[0], rel=0.33)
