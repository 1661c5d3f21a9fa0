"""`rail-fem profile`: warnings can be told by an option, nothing is drawn unasked, faults are sentences."""

from functools import partial

import numpy as np
import pytest

from geometry.profiles.doctor import examine
from geometry.profiles.formats.by_suffix import read_raw
from geometry.profiles.rail import rail_head
from geometry.profiles.wheel import wheel_profile
from tests.commands import call
from tests.geometry.faulty_profiles import MINIPROF_KEYS, measured_rail, measured_wheel, rows, simpack, written

MM = 1e-3


profile = partial(call, "profile")


@pytest.fixture
def folder(tmp_path, monkeypatch):
    (tmp_path / "here").mkdir()
    monkeypatch.chdir(tmp_path / "here")
    return tmp_path


def test_nothing_is_drawn_unless_a_picture_is_asked_for(folder):
    file = written(folder / "a.ban", MINIPROF_KEYS.format(count=9) + rows(measured_rail()))
    said = profile(file).output
    assert "  drawn " not in said and not list((folder / "here").iterdir())
    profile(file, "--picture", "a.png")
    assert (folder / "here" / "a.png").stat().st_size > 10_000


def test_a_rail_is_mirrored_moved_and_smoothed_as_told_and_written(folder):
    file = written(folder / "a.ban", MINIPROF_KEYS.format(count=9) + rows(measured_rail()))
    said = profile(file, "--mirror", "--write", "b.csv").output
    assert "mirrored as told" in said and "crown set to z = 0: moved by 6.010 mm" in said
    y = np.linspace(-30, 30, 61) * MM
    again = examine(read_raw(folder / "here" / "b.csv", "rail"), mirror=False).profile
    assert np.abs(again.height(y) - rail_head("60E1").height(y)).max() < 0.5e-6
    assert "kept (as told)" in profile(file, "--origin", "file").output
    assert "moved by -0.000, 6.010 mm, as told" in profile(file, "--origin", "0,-6.01").output
    assert "3 um taken out as told" in profile(file, "--smoothing", "3").output
    profile(file, "--origin", "1,x", code=2)


def test_a_wheels_flange_back_is_asked_for_and_taken_as_told(folder):
    file = written(folder / "a.prw", simpack(measured_wheel(begin=3.93, rim=0.0)[:-61] * [1, -1], "wheel"))
    said = profile(file, code=2).output
    assert "give flange_back" in said and "Traceback" not in said
    profile(file, "--flange-back", "0", "--write", "w.csv")
    again, y = examine(read_raw(folder / "here" / "w.csv", "wheel")).profile, np.linspace(-34, 55, 90) * MM
    assert np.abs(again.height(y) - wheel_profile("S1002").height(y)).max() < 5e-6


def test_a_missing_file_is_a_sentence(folder):
    said = profile("nothere.csv", code=2).output
    assert "nothere.csv: no such file" in said and "Errno" not in said


def test_what_is_told_of_a_file_is_not_taken_of_a_built_in_profile(folder):
    """--kind banana was passed over without a word."""
    for told in (["--kind", "banana"], ["--kind", "rail"], ["--unit", "m"], ["--number", 2]):
        said = profile("P8", *told, code=2).output
        assert "P8 is a built-in wheel: --kind, --unit and --number are told of files" in said
    profile("P8", "--kind", "wheel")
    profile("56E1", "--kind", "rail")


def test_a_file_that_cannot_be_written_is_a_sentence(folder):
    for option, name in (("--write", "x.csv"), ("--picture", "x.png")):
        said = profile("P8", option, folder / "nothere" / name, code=2).output
        assert f"{name}: No such file or directory" in said and "Errno" not in said
