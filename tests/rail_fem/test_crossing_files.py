"""`rail-fem crossing`: a crossing written as files of others, and read from them again."""

import numpy as np
import pytest

from geometry.path.wheel_path import wheel_path
from geometry.profiles.wheel import wheel_profile
from geometry.surfaces.crossing import CastCrossing
from rail_fem.scene.scene import Crossing
from tests.commands import call
from tests.rail_fem.test_crossing_section import case_with

MM = 1e-3
X = np.concatenate([np.arange(-0.95, -0.5, 3 * MM), np.arange(-0.5, 0.85, 6 * MM)])


def written(folder, *arguments, code=0):
    """What the command says, and where it wrote."""
    case = case_with(folder, 'family = "UK-cast"', "ratio = 10.75")
    return call("crossing", case, "--to", folder / "sections", *arguments, code=code)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("written")
    assert "sections from x = -1367 to 1232 mm" in written(folder).output
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
    assert "cannot read them as they are" in done.output
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
    assert complaint in written(tmp_path, *arguments, code=2).output


def test_a_folder_that_holds_something_is_left_alone(tmp_path):
    (tmp_path / "sections").mkdir()
    (tmp_path / "sections" / "mine.txt").write_text("mine")
    assert "is not empty" in written(tmp_path, "--start", "200 mm", "--end", "250 mm", code=2).output
