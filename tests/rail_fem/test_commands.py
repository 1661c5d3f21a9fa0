"""Commands that need no run: what a stranger types first."""

import csv
import json
import re

import pytest
from typer.testing import CliRunner

import geometry
from rail_fem.case.casefile import load_case
from rail_fem.cli import app
from rail_fem.commands.study import STUDIES
from rail_fem.hierarchy import MODELS


def call(*words: str, code: int = 0) -> str:
    answer = CliRunner().invoke(app, list(words))
    assert answer.exit_code == code, answer.output
    return answer.output


def numbers(values, key="") -> dict:
    """Nested values as a flat dict; texts and missing values by their hash, so that all can be compared at once."""
    if isinstance(values, dict):
        return {name: number for k, v in values.items() for name, number in numbers(v, f"{key}.{k}").items()}
    return {key: float(values) if isinstance(values, (int, float)) else float(hash(str(values)))}


def test_the_version_is_that_of_the_package():
    import rail_fem

    assert call("--version").split() == ["rail-fem", rail_fem.__version__]


def test_everything_that_can_be_chosen_is_listed():
    text = call("list")
    assert all(name in text for name in (*MODELS, *STUDIES, "P8-worn", "60E1", "Mn13"))


@pytest.mark.parametrize("model", MODELS)
def test_a_new_case_file_can_be_run_and_its_comments_are_the_defaults(tmp_path, model):
    """As written, and with every commented key that has a value uncommented, the file is the same case."""
    file = tmp_path / "case.toml"
    call("init", str(file), "--model", model)
    case = load_case(file)
    assert list(case.runs) == [model]
    lines = [line for line in file.read_text().splitlines() if not re.search(r'= "none"', line)]
    plain = tmp_path / "plain.toml"
    plain.write_text("\n".join(re.sub(r"^# (?=\[|\w+ =)", "", line) for line in lines))
    written = load_case(plain)
    assert numbers(written.scene.model_dump()) == pytest.approx(numbers(case.scene.model_dump()), rel=1e-12)
    assert numbers(written.runs[model].model_dump()) == pytest.approx(numbers(case.runs[model].model_dump()), rel=1e-12)


def test_a_case_file_that_is_there_is_not_overwritten(tmp_path):
    file = tmp_path / "case.toml"
    file.write_text("mine")
    assert "is there already" in call("init", str(file), code=2) and file.read_text() == "mine"
    assert "choose from" in call("init", str(tmp_path / "new.toml"), "--model", "fe_ful", code=2)


def test_contact_points_of_the_command_are_those_of_the_search():
    found = json.loads(
        call("contact", "P8", "60E1", "--shift", "3 mm", "--inclination", "1:40", "--radius", "460 mm", "--json")
    )
    search = geometry.ContactSearch(
        geometry.Wheelset(geometry.wheel_profile("P8"), radius=0.46), geometry.Track(geometry.rail_head("60E1", 1 / 40))
    )
    state = search.settle(3e-3)
    for row in found:
        point = search.contacts(state, row["side"]).lowest()
        assert row["lateral position [mm]"] == pytest.approx(point.position[0, 1] * 1e3, abs=1e-9)
        assert row["rolling radius [mm]"] == pytest.approx(point.rolling_radius[0] * 1e3, abs=1e-9)


def test_a_contact_table_holds_every_shift_and_yaw(tmp_path):
    call(
        "contact",
        "S1002",
        "60E1",
        "--shift=-4 mm:4 mm:3",
        "--yaw",
        "0 mrad:5 mrad:2",
        "--table",
        str(tmp_path / "t.csv"),
    )
    rows = list(csv.DictReader((tmp_path / "t.csv").open()))
    assert len(rows) == 3 * 2 * 2 and {float(row["yaw [mrad]"]) for row in rows} == {0.0, 5.0}
    mirrored = {
        (row["shift [mm]"], row["side"]): float(row["rolling radius [mm]"])
        for row in rows
        if row["yaw [mrad]"] == "0.0"
    }
    assert mirrored["-4.0", "left"] == pytest.approx(mirrored["4.0", "right"], abs=1e-6)


def test_the_patch_of_the_command_carries_the_load(tmp_path):
    found = json.loads(
        call("patch", "P8", "56E1", "--load", "50 kN", "--json", "--figure", str(tmp_path / "patch.png"))
    )
    assert (
        found["normal force [kN]"] == pytest.approx(50.0, rel=0.01) and (tmp_path / "patch.png").stat().st_size > 5000
    )
    heavier = json.loads(call("patch", "P8", "56E1", "--load", "100 kN", "--json"))
    assert heavier["largest pressure [MPa]"] > found["largest pressure [MPa]"] > 500


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("contact", "P9", "60E1"), "no wheel 'P9'"),
        (("contact", "P8", "UIC61"), "no rail"),
        (("contact", "nothere.csv", "60E1"), "no such file"),
        (("contact", "P8", "60E1", "--shift", "3"), "has no unit"),
        (("contact", "P8", "60E1", "--shift", "1 mm:2 mm"), "no series"),
        (("contact", "P8", "60E1", "--inclination", "steep"), "1:20"),
        (("patch", "P8", "60E1", "--load", "-5 kN"), "give a vertical force"),
        (("patch", "P8", "60E1", "--load", "5 mm"), "dimension"),
        (("patch", "P8", "60E1", "--load", "50 kN", "--shift", "300 mm"), ""),
        (("study", "nothing"), "plain-line"),
        (("study", "plain-line", "--quick"), "no short form"),
    ],
)
def test_every_mistake_is_a_sentence(words, said):
    text = call(*words, code=2)
    assert said in text and "Traceback" not in text


def test_every_study_is_there():
    import importlib.util

    assert all(importlib.util.find_spec(study.module) for study in STUDIES.values())


def test_a_study_runs_by_its_name(tmp_path):
    call("study", "halfspace", "--quick", "--out", str(tmp_path))
    rows = list(csv.DictReader((tmp_path / "speed_error.csv").open()))
    assert len(rows) > 4 and (tmp_path / "patch.png").stat().st_size > 5000
