"""What the system refuses, and what a result does not hold, is told in a sentence that names the user's own file."""

import numpy as np
import pytest

import rail_fem
from rail_fem.files.atomic import write_text_atomically
from rail_fem.result.low_pass import low_pass
from tests.commands import call


@pytest.fixture(scope="module")
def below(tmp_path_factory):
    """A folder with a run of the formula in it, which has no history and, told its dip angle, no position."""
    folder = tmp_path_factory.mktemp("runs")
    scene = rail_fem.load_case(rail_fem.example("nose_transfer")).scene
    rail_fem.solve("p2_formula", scene, {"dip_angle": "10 mrad"}).save(folder / "a")
    return folder


def test_a_full_disk_is_told_by_the_file_alone(tmp_path, monkeypatch):
    """The system names both ends of a renaming; one of them is ours."""

    def full(source, target):
        raise OSError(28, "No space left on device", str(source), None, str(target))

    monkeypatch.setattr("os.replace", full)
    with pytest.raises(OSError) as told:
        write_text_atomically(tmp_path / "a.csv", "")
    assert str(told.value) == f"[Errno 28] No space left on device: {str(tmp_path / 'a.csv')!r}"


def test_a_position_that_is_not_known_is_not_shown(below):
    said = call("show", below / "a").output
    assert "p2 " in said and "nan" not in said


def test_runs_below_a_folder_are_told_by_their_folders(below, monkeypatch):
    """ "a" stands in "p2_formula", too."""
    monkeypatch.chdir(below)
    assert "a: p2_formula: finished" in call("show", ".").output


def test_a_run_without_a_history_is_not_filtered(below, tmp_path):
    said = call("low-pass", below / "a", "--out", tmp_path / "filtered.csv", code=2).output
    assert "p2_formula leaves no history" in said and not (tmp_path / "filtered.csv").exists()


@pytest.mark.parametrize("words", [("low-pass", "{run}", "--out"), ("list", "--schema"), ("profile", "P8", "--write")])
def test_a_file_that_is_a_runs_own_is_not_written_over(below, words):
    before = (below / "a" / "trust.txt").read_bytes()
    words = [word.format(run=below / "a") for word in words]
    said = call(*words, below / "a" / "trust.txt", code=2).output
    assert "trust.txt: is the run's own file" in said
    assert (below / "a" / "trust.txt").read_bytes() == before


@pytest.mark.parametrize("name, why", [("x.exe", "exe"), ("no/such/x.png", "No such file"), ("", "directory")])
def test_a_picture_that_cannot_be_drawn_is_a_sentence(tmp_path, name, why):
    """matplotlib's and the system's own words as a traceback, after the patch was solved."""
    for words in (
        ("patch", "P8", "60E1", "--load", "80 kN", "--cells", 16, "--figure"),
        ("profile", "P8", "--picture"),
    ):
        said = call(*words, f"{tmp_path}/{name}", code=2).output
        assert why in said and "Traceback" not in said


def test_a_cut_off_of_hours_is_refused():
    """It was carried on for 2 periods at both ends: 1e11 values."""
    with pytest.raises(ValueError, match="less than 0.0001 periods of 1e-06 Hz"):
        low_pass(np.ones(900), 50e3, 1e-6)


@pytest.mark.parametrize("name, why", [("nothere/x.csv", "No such file or directory"), (".", "Is a directory")])
def test_a_file_that_cannot_be_written_is_named_as_it_was_given(tmp_path, monkeypatch, name, why):
    """Not by the name that it has before it is whole."""
    monkeypatch.chdir(tmp_path)
    with pytest.raises(OSError, match=why) as met:
        write_text_atomically(name, "text")
    assert met.value.filename == name


def test_a_sweep_into_a_file_or_of_no_case_is_refused(tmp_path):
    """The first was a traceback, the second "a run failed" and an empty folder."""
    (tmp_path / "file").write_text("mine")
    said = call(
        "sweep", rail_fem.example("nose_transfer"), "--model", "p2_formula", "--out", tmp_path / "file", code=2
    ).output
    assert "file: File exists, choose a folder that can be written" in said and "Traceback" not in said
    said = call("sweep", tmp_path / "nothere.toml", "--out", tmp_path / "out", code=2).output
    assert "no such file" in said and "nothing was run" in said and not (tmp_path / "out").exists()


def test_a_file_that_is_not_there_is_a_sentence(below):
    said = call("measured", below / "a", below / "nothere.csv", code=2).output
    assert "nothere.csv: No such file or directory" in said and "Errno" not in said
    said = call("low-pass", below / "a", "--out", below / "nothere" / "x.csv", "--cutoff", "0 Hz", code=2).output
    assert "Errno" not in said
