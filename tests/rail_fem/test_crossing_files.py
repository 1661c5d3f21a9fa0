"""`rail-fem crossing`: a crossing written as files of others, and read from them again."""

import numpy as np
import pytest
from typer.testing import CliRunner

from geometry.path.wheel_path import wheel_path
from geometry.profiles.wheel import wheel_profile
from geometry.surfaces.crossing import CastCrossing
from rail_fem.cli import app
from rail_fem.scene.scene import Crossing
from tests.rail_fem.test_crossing_section import case_with

MM = 1e-3
X = np.concatenate([np.arange(-0.95, -0.5, 3 * MM), np.arange(-0.5, 0.85, 6 * MM)])


def written(folder, *arguments):
    """What the command says, and where it wrote."""
    case = case_with(folder, 'family = "UK-cast"', "ratio = 10.75")
    return CliRunner().invoke(app, ["crossing", str(case), "--to", str(folder / "sections"), *arguments])


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("written")
    done = written(folder)
    assert done.exit_code == 0 and "sections from x = -1367 to 1232 mm" in done.output
    return folder / "sections"


@pytest.mark.parametrize("wheel", ["P8", "P8-worn", "P8-hollow", "P1"])
def test_a_crossing_written_as_sections_and_read_again_carries_wheels_as_before(folder, wheel):
    """To 0.01 mm over leg, knuckle and transfer."""
    paths = [
        wheel_path(wheel_profile(wheel), surface, X)
        for surface in (CastCrossing(10.75), Crossing(family="sections", file=str(folder)).surface)
    ]
    assert np.abs(paths[1].height - paths[0].height).max() < 10e-6
    assert paths[1].transfers == pytest.approx(paths[0].transfers, abs=0.1 * MM)


def test_a_finer_tolerance_takes_more_sections(tmp_path, folder):
    done = written(tmp_path, "--tolerance", "5 um", "--start", "0.2 m", "--end", "300 mm")
    assert done.exit_code == 0 and "cannot read them as they are" in done.output
    assert "put a section of the plain rail first" in done.output.replace("\n", " ")
    stations = lambda folder: np.loadtxt(folder / "stations.csv", delimiter=",", skiprows=2, usecols=1)
    coarse, fine = stations(folder), stations(tmp_path / "sections")
    assert np.sum((coarse >= 200) & (coarse <= 300)) < len(fine) < 400


@pytest.mark.parametrize(
    "arguments, complaint",
    [
        (["--start", "2 m"], "cannot be cut: the crossing reaches"),
        (["--start", "1 kg"], "dimension"),
        (["--tolerance", "0 um"], "must be more than 0"),
    ],
)
def test_what_cannot_be_written_is_refused(tmp_path, arguments, complaint):
    done = written(tmp_path, *arguments)
    assert done.exit_code == 2 and complaint in done.output


def test_a_folder_that_holds_something_is_left_alone(tmp_path):
    (tmp_path / "sections").mkdir()
    (tmp_path / "sections" / "mine.txt").write_text("mine")
    done = written(tmp_path, "--start", "200 mm", "--end", "250 mm")
    assert done.exit_code == 2 and "is not empty" in done.output
