"""The study of five wheels over the crossing: its table against the published path numbers, its figure and files."""

import numpy as np
import pytest

from geometry.path.contact_band import path_numbers
from geometry.path.wheel_path import wheel_path
from geometry.profiles.formats.by_suffix import write_profile
from geometry.profiles.wheel import wheel_profile
from geometry.surfaces.crossing import CastCrossing
from rail_fem.scene.wheel_profile import wheel_shape
from rail_fem.studies.crossing_path import MM, panels, run_over, table


def studied(names, spacing, ratio=9.25):
    crossing = CastCrossing(ratio)
    paths = {name: run_over(crossing, name, spacing) for name in names}
    return crossing, paths, {name: path_numbers(path, crossing) for name, path in paths.items()}


def test_a_short_study_has_its_table_and_figure():
    crossing, paths, numbers = studied(["P8"], 5 * MM)
    found = table(numbers, 9.25)
    dip = found.head.index("dip mrad")
    assert float(found.rows[0][dip]) == pytest.approx(1e3 * numbers["P8"].dip, abs=0.05)
    assert found.rows[1][0] == "reference" and found.rows[1][dip] == "18.3"
    plan, heights = panels(crossing, paths, numbers)
    wing, nose = (np.diff(np.array_split(plan.lines[f"band on the {body}"][1], 2)[0]) for body in ("wing", "nose"))
    assert np.isfinite(wing).any() and np.isfinite(nose).any()
    assert heights.lines["P8"][1] == pytest.approx(paths["P8"].height / MM)


def test_a_wheel_of_a_file_runs_as_the_one_it_was_written_from(tmp_path):
    """Within what the spline through the points leaves beside the joints of arcs, whose tangents a file does not
    hold."""
    file = str(tmp_path / "mine.prw")
    write_profile(file, wheel_profile("P8").points, "wheel")
    x = np.array([-0.8, -0.65, 0.1, 0.3])
    own, named = (wheel_path(wheel_shape(n), CastCrossing(9.25), x).height for n in (file, "P8"))
    assert own == pytest.approx(named, abs=2e-6)


@pytest.mark.validate
@pytest.mark.parametrize("name, dip", [("P8", 15.8), ("P8-worn", 12.9), ("P1", 16.2), ("S1002", 15.1)])
def test_stretched_to_the_thesis_ratio_the_dips_are_the_published_estimates(name, dip):
    """1:10.75 by stretching x: geometry_and_materials.md 3.7."""
    assert studied([name], 1 * MM, 10.75)[2][name].dip / MM == pytest.approx(dip, abs=0.25)
