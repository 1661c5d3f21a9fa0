"""Commands that need no run: what a stranger types first."""

import csv
import json
import re
from pathlib import Path

import numpy as np
import pytest

import geometry
from geometry.profiles.formats.by_suffix import write_profile
from geometry.profiles.rail import rail_head
from geometry.profiles.wheel import wheel_profile
from rail_fem import studies
from rail_fem.case.casefile import CaseError, load_case
from rail_fem.commands.study import STUDIES
from rail_fem.hierarchy import MODELS
from tests import commands


def call(*words: str, code: int = 0) -> str:
    return commands.call(*words, code=code).output


def numbers(values, key="") -> dict:
    """Nested values as a flat dict; texts and missing values by their hash, so that all can be compared at once."""
    if isinstance(values, dict):
        return {name: number for k, v in values.items() for name, number in numbers(v, f"{key}.{k}").items()}
    return {key: float(values) if isinstance(values, (int, float)) else float(hash(str(values)))}


def test_the_version_is_that_of_the_package():
    import rail_fem

    assert call("--version").split() == ["rail-fem", rail_fem.__version__]


def test_every_command_is_listed_in_a_line_that_is_not_cut_and_has_a_help_of_its_own():
    text = call("--help")
    lines = re.search(r"Commands:\n(.*?)\n\n", text, re.DOTALL)[1].splitlines()
    assert len(lines) >= 18 and not any(line.endswith("...") for line in lines)
    assert all("Usage: " in call(line.split()[0], "--help") for line in lines)
    assert all(study in call("study", "--help") for study in STUDIES)


def test_the_help_of_a_study_keeps_its_units(monkeypatch):
    monkeypatch.setattr("sys.argv", ["rail-fem"])  # the command writes it
    assert "of the wheels [mm]" in call("study", "crossing-path", "--help")


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
    # keys without a value; tables that are not there
    absent = r'^# .*= "none"|^# \[scene\.(bearers|wheel_body|diverging|materials\.\w+\.cyclic)\]'
    lines = [line for line in file.read_text().splitlines() if not re.search(absent, line)]
    plain = tmp_path / "plain.toml"
    plain.write_text("\n".join(re.sub(r"^# (?=\[|\w+ =)", "", line) for line in lines))
    written = load_case(plain)
    assert numbers(written.scene.model_dump()) == pytest.approx(numbers(case.scene.model_dump()), rel=1e-12)
    assert numbers(written.runs[model].model_dump()) == pytest.approx(numbers(case.runs[model].model_dump()), rel=1e-12)


def test_every_key_of_a_new_case_file_can_be_uncommented_alone(tmp_path):
    """Its table's title stands above it: no key lands in another table."""
    file, alone = tmp_path / "case.toml", tmp_path / "alone.toml"
    call("init", str(file), "--model", "rigid_hertz")
    lines = file.read_text().splitlines()
    keys = [k for k, line in enumerate(lines) if re.match(r"# \w+ = ", line)]
    assert len(keys) > 60
    for k in keys:
        alone.write_text("\n".join([*lines[:k], lines[k].removeprefix("# "), *lines[k + 1 :]]))
        try:
            load_case(alone)
        except CaseError as error:  # "none" is no value; another family's key is told of as such
            assert "unknown key" not in str(error), lines[k]


def test_a_case_file_that_is_there_is_not_overwritten(tmp_path):
    file = tmp_path / "case.toml"
    file.write_text("mine")
    assert "is there already" in call("init", str(file), code=2) and file.read_text() == "mine"
    assert "choose from" in call("init", str(tmp_path / "new.toml"), "--model", "fe_ful", code=2)


def test_contact_points_of_the_command_are_those_of_the_search():
    found = json.loads(
        call("contact", "P8", "60E1", "--shift", "3 mm", "--inclination", "1:40", "--radius", "460 mm", "--json")
    )
    told = call("contact", "P8", "60E1", "--shift", "3 mm", "--inclination", "1:40", "--radius", "460 mm")
    assert "rolling radius [mm]" in told and len(told.splitlines()) >= 3
    search = geometry.ContactSearch(
        geometry.Wheelset(geometry.wheel_profile("P8"), radius=0.46), geometry.Track(geometry.rail_head("60E1", 1 / 40))
    )
    state = search.settle(3e-3)
    assert len(found["points"]) == 2
    for row in found["points"]:
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
    assert heavier["largest elastic pressure [MPa]"] > found["largest elastic pressure [MPa]"] > 500


def test_an_impact_and_a_flange_have_a_patch():
    """1 MN on a tread and 80 kN on a flange that climbs: longer than 24 mm each, where the search ended. The
    tread's grows between the third root of a point contact and the square root of a line."""
    light, heavy, flange = (
        json.loads(call("patch", "P8", "60E1", "--load", load, "--shift", shift, "--json"))
        for load, shift in (("500 kN", "0 mm"), ("1 MN", "0 mm"), ("80 kN", "20 mm"))
    )
    assert 2 ** (1 / 3) < heavy["length [mm]"] / light["length [mm]"] <= 2 ** (1 / 2) and heavy["length [mm]"] > 24
    assert flange["first contact from the gauge face [mm]"] < 5 and flange["length [mm]"] > 24


@pytest.mark.parametrize("rail", ["56E1", "60E1"])
def test_a_patch_lies_where_the_wheelset_touches(rail):
    """The gauge is measured at the gauge face, 35.98 mm from the middle of a 60E1's head and 34.89 mm of a 56E1's: by
    this millimetre a P8 touches 10 mm aside, at half more pressure."""
    alone = json.loads(call("contact", "P8", rail, "--json"))["points"][0]
    pressed = json.loads(call("patch", "P8", rail, "--load", "50 kN", "--json"))
    found = pressed["first contact from the gauge face [mm]"]
    assert found == pytest.approx(alone["lateral position [mm]"] - 1435 / 2, abs=0.01)


def test_a_table_over_shift_yaw_and_height_carries_more_the_lower_the_wheelset_stands(tmp_path):
    """Two bodies of revolution that meet at a point: the force grows as depth^1.5 as long as the curvatures are those
    of the point; here between their limits, and each row's own vertical force is its normal force on its slope."""
    options = ("--shift", "0 mm:2 mm:2", "--yaw", "0 mrad:2 mrad:2", "--lower", "0 um:80 um:3")
    call("contact", "P8", "60E1", *options, "--table", str(tmp_path / "t.csv"))
    rows = [
        {k: v if k == "side" else float(v) for k, v in row.items()}
        for row in csv.DictReader((tmp_path / "t.csv").open())
    ]
    assert len({(r["shift [mm]"], r["yaw [mrad]"], r["lowered [um]"], r["side"]) for r in rows}) == 2 * 2 * 3 * 2
    force = {(r["shift [mm]"], r["yaw [mrad]"], r["side"], r["lowered [um]"]): r["normal force [kN]"] for r in rows}
    for place in {key[:3] for key in force}:
        assert abs(force[*place, 0.0]) < 1e-12 and 1.2 < np.log2(force[*place, 80.0] / force[*place, 40.0]) < 1.9
    for r in rows:
        heights = {
            q["height [mm]"] + q["lowered [um]"] / 1e3
            for q in rows
            if q["shift [mm]"] == r["shift [mm]"] and q["yaw [mrad]"] == r["yaw [mrad]"]
        }
        assert np.ptp([*heights]) < 1e-9
        if r["yaw [mrad]"] == 0.0:
            angle = r["contact angle [mrad]"] / 1e3
            assert r["vertical force on the wheel [kN]"] == pytest.approx(
                r["normal force [kN]"] * np.cos(angle), rel=1e-3
            )


def test_one_wheel_under_a_vertical_force_is_in_balance_and_agrees_with_the_half_space():
    """A cone on a crown of one radius, an ellipse by Hertz: strips over the overlap, and the half-space on the true gap
    with 88 cells across (half a cell at each end: 1.2 %)."""
    pair = ("P1", "56E1", "--inclination", "0")
    points = json.loads(call("contact", *pair, "--load", "60 kN:90 kN:2", "--json"))["points"]
    for load in (60.0, 90.0):
        mine = [point for point in points if abs(load - sum_of(points, point)) < 1e-4]
        assert sum(point["vertical force on the wheel [kN]"] for point in mine) == pytest.approx(load, rel=1e-8)
    patch = json.loads(call("patch", *pair, "--load", "90 kN", "--json"))
    last = [point for point in points if abs(90 - sum_of(points, point)) < 1e-4]
    assert len(last) == 1 and last[0]["normal force [kN]"] == pytest.approx(patch["normal force [kN]"], rel=2e-3)
    assert 2 * last[0]["half length [mm]"] == pytest.approx(patch["length [mm]"], rel=0.015)
    assert 2 * last[0]["half width [mm]"] == pytest.approx(patch["width [mm]"], rel=0.015)


def sum_of(points: list, one: dict) -> float:
    """Vertical force of all points of the same position as one."""
    return sum(p["vertical force on the wheel [kN]"] for p in points if p["height [mm]"] == one["height [mm]"])


@pytest.mark.parametrize(("words", "said"), [
    (("contact", "P9", "60E1"), "no wheel 'P9'"), (("contact", "P8", "UIC61"), "no rail"),
    (("contact", "nothere.csv", "60E1"), "no such file"), (("contact", "P8", "60E1", "--shift", "3"), "has no unit"),
    (("contact", "P8", "60E1", "--shift", "1 mm:2 mm"), "no series"),
    (("contact", "P8", "60E1", "--inclination", "steep"), "1:20"),
    (("contact", "P8", "60E1", "--load", "-80 kN"), "between 0 and 10 MN"),
    (("contact", "P8", "60E1", "--load", "9 GN"), "load"),
    (("contact", "P8", "60E1", "--load", "80 kN", "--lower", "9 um"), "not both"),
    (("contact", "P8", "60E1", "--lower", "2 mm"), "lowered"),
    (("contact", "P8", "60E1", "--gauge", "9 m"), "gauge"),
    (("patch", "P8", "60E1", "--load", "-5 kN"), "give a vertical force"),
    (("patch", "P8", "60E1", "--load", "5 mm"), "dimension"),
    (("patch", "P8", "60E1", "--load", "50 kN", "--shift", "300 mm"), ""),
    (("study", "nothing"), "wheelset"),
    (("study", "wheelset", "--wheel", "no.csv"), "unknown wheel profile 'no.csv'; known: P8"),
])  # fmt: skip
def test_every_mistake_is_a_sentence(words, said):
    text = call(*words, code=2)
    assert said in text and "Traceback" not in text


@pytest.mark.parametrize(
    ("name", "how"),
    [("a.prw", "as it says"), ("a.csv", "as it says"), ("a.prr", "as it says"), ("b.csv", "by its shape")],
)
def test_a_wheel_where_a_rail_is_asked_for_is_refused_and_the_other_way(tmp_path, name, how):
    wheel = name in ("a.prw", "a.csv", "b.csv")
    points = wheel_profile("P8").points if wheel else rail_head("56E1").points
    write_profile(tmp_path / name, points, "wheel" if wheel else "rail")
    if name == "b.csv":
        np.savetxt(tmp_path / name, points * 1e3, delimiter=",")
    file, own = str(tmp_path / name), "wheel" if wheel else "rail"
    pair, asked = (("P8", file), "rail") if wheel else ((file, "56E1"), "wheel")
    for command in (("patch", *pair, "--load", "80 kN"), ("contact", *pair)):
        assert f"a {own} {how}; a {asked} is asked for" in call(*command, code=2)


def test_every_study_is_there_and_none_stands_in_no_list():
    """Each module with a `main`, by its own name."""
    room = Path(__file__).resolve().parents[2] / "rail_fem" / "studies"
    started = {path.stem for path in room.glob("*.py") if "\ndef main(" in path.read_text(encoding="utf-8")}
    assert started == {name.replace("-", "_") for name in STUDIES}
    assert len(STUDIES) <= 17


def test_a_study_runs_by_its_name(tmp_path, monkeypatch):
    """A module that writes what it is given; what the studies themselves do is tested with each of them."""
    code = (
        "import pathlib\ndef main(quick: bool = False, out: str = ''): pathlib.Path(out).write_text(f'quick {quick}')"
    )
    (tmp_path / "own_study.py").write_text(code)
    monkeypatch.setattr(studies, "__path__", [str(tmp_path)])
    monkeypatch.setattr("sys.argv", ["rail-fem"])  # the command writes it
    monkeypatch.setitem(STUDIES, "own-study", "what it is given")
    call("study", "own-study", "--quick", "--out", str(tmp_path / "said.txt"))
    assert (tmp_path / "said.txt").read_text() == "quick True"
