"""The leg by the explicit model: what is run, and (validate) that it throws the wheel as the light model says."""

import numpy as np
import pytest
import typer

from rail_fem.case.casefile import load_case
from rail_fem.case.examples import example
from rail_fem.light.contact_table import table_key, table_of
from rail_fem.models import rigid_hertz
from rail_fem.output.events import longest_flight
from rail_fem.settings.light import RigidHertzSettings
from rail_fem.studies import leg_explicit
from rail_fem.studies.leg_contacts import two_contact_pass, two_contact_table


@pytest.mark.parametrize("name", leg_explicit.ROWS)
def test_a_row_runs_over_the_whole_leg_by_both_models(name):
    case = load_case(example("whole_crossing"), leg_explicit.changes_of(name))
    low, high = case.scene.crossing.surface.leg_range
    for model in ("rigid_hertz", "fe_full"):
        settings = case.runs[model]
        assert settings.start < low - 0.05 and settings.end > high + 0.1
    assert case.runs["fe_full"].has_window and case.runs["fe_full"].mass_scaling == "auto"


def test_a_row_that_is_not_there_is_refused(tmp_path):
    with pytest.raises(typer.BadParameter, match="benchmrk is not known, there are benchmark"):
        leg_explicit.main(out=tmp_path, size=4.0, rows="benchmrk", quick=False)


def test_two_contacts_together_are_what_carries_a_rigid_wheel():
    """The higher of both contacts is the whole wheel's, everywhere on the leg."""
    case = load_case(example("whole_crossing"), leg_explicit.changes_of("benchmark"))
    key = table_key(case.scene, -0.78, -0.62, 5e-3)
    both, whole = two_contact_table(key), table_of(key)
    assert np.abs(both.height.max(axis=0) - whole.height[0]).max() < 1e-9
    change = int(np.argmax(both.height[1] > both.height[0]))
    assert 0 < change and both.height[1, 0] < both.height[0, 0]
    near = np.abs(both.x - both.x[change]) < 6e-3  # there the other is within an approach under the load, 0.1 mm
    assert np.abs(both.height[0] - both.height[1])[near].min() < 0.1e-3


def test_with_two_contacts_the_fitted_leg_throws_no_wheel():
    """The leg was fitted to a force and a flight of the model with one contact; with two the force falls by 18 %."""
    case = load_case(example("whole_crossing"), leg_explicit.changes_of("fitted"))
    settings = case.settings(RigidHertzSettings)
    two, one = two_contact_pass(case.scene, settings), rigid_hertz.solve(case.scene, settings)
    assert longest_flight(one).length > 25e-3 and two.flight is None
    assert two.force.max() < 0.85 * one.peaks["largest_force"].value


def test_two_contacts_are_for_the_leg_alone():
    case = load_case(example("whole_crossing"), leg_explicit.changes_of("benchmark"))
    settings = RigidHertzSettings(start=0.2, end=0.5, path_spacing=10e-3)
    with pytest.raises(ValueError, match="the wheel comes to the nose at x = 3"):
        two_contact_pass(case.scene, settings)


@pytest.mark.validate
def test_both_models_throw_the_wheel_off_the_benchmark_s_leg(tmp_path):
    """Elements of 6 mm: force within 30 %, flight within a third of the light model's."""
    pair = leg_explicit.run("benchmark", 6e-3, tmp_path)
    forces = [result.peaks["largest_force"].value for result in (pair.light, pair.explicit)]
    assert forces[1] == pytest.approx(forces[0], rel=0.3)
    lengths = [longest_flight(result).length for result in (pair.light, pair.explicit)]
    assert lengths[1] == pytest.approx(lengths[0], rel=0.33)
