from dataclasses import replace
from pathlib import Path

import pytest

from rail_fem.case.casefile import CaseError, load_case
from rail_fem.case.template import template
from rail_fem.result.runfolder import fingerprint
from rail_fem.scene.steel import GRADES
from rail_fem.settings.explicit import FeSettings
from rail_fem.settings.light import BemPlasticSettings, RigidHertzSettings

ROOT = Path(__file__).resolve().parents[2]
GOOD = (ROOT / "cases" / "nose_transfer.toml").read_text(encoding="utf-8")


def errors_of(tmp_path, text) -> list[str]:
    path = tmp_path / "case.toml"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    with pytest.raises(CaseError) as error:
        load_case(path)
    assert str(error.value).splitlines()[0] == f"{path}: {len(error.value.errors)} input error(s)"
    return error.value.errors


@pytest.mark.parametrize("name, events", [("nose_transfer", [0.35]), ("whole_crossing", [-0.7, 0.35])])
def test_reference_cases_are_case_2_of_the_thesis(name, events):
    """Table 7-1, row 2: 75 mph, 66.25 t, 1.00 t, facing, worn P8, 160000 N/mm, Mn13."""
    case = load_case(f"{name}")
    scene = case.scene
    assert (scene.speed, scene.direction, scene.wheel.profile) == (pytest.approx(33.528), "facing", "P8-worn")
    assert (scene.vehicle.vehicle_sprung_mass, scene.vehicle.wheelset_unsprung_mass) == (66250, 1000)
    assert scene.foundation.stiffness == pytest.approx(1.6e8) and scene.crossing.ratio == 10.75
    assert scene.materials.nose.steel().hardening_stress[0] == 310e6
    run = case.runs["fe_full"]
    assert all(run.start + 0.1 < x < run.end - 0.1 for x in events)  # leg transition and load transfer lie well inside


def test_a_case_gives_the_settings_of_a_model_by_their_class():
    case = load_case("thesis/case_02")
    assert case.settings(RigidHertzSettings) is case.runs["rigid_hertz"]
    assert case.settings(FeSettings) is case.runs["fe_full"]  # not fe_window, whose settings are a kind of these
    with pytest.raises(KeyError, match="no model by BemPlasticSettings"):
        replace(case, runs={}).settings(BemPlasticSettings)


def test_a_preset_fills_what_does_not_stand_beside_it(tmp_path):
    """The main job is "fine" written out; a key of the file wins, one asked for from outside takes the place of the
    file's keys."""
    path, (head, rest) = tmp_path / "case.toml", GOOD.split("[run.fe_full]\n")
    stretch = "".join(line for line in rest.splitlines(True) if line.startswith(("start", "end")))
    path.write_text(f'{head}[run.fe_full]\npreset = "fine"\n{stretch}')
    whole, fine = (load_case(one).runs["fe_full"] for one in (ROOT / "cases" / "nose_transfer.toml", path))
    assert fine.model_copy(update={"preset": None}) == whole and whole.preset is None
    assert fingerprint("fe_full", load_case(path).scene, fine) == fingerprint("fe_full", load_case(path).scene, whole)
    assert FeSettings.model_validate(fine.model_dump(mode="json")) == fine
    quick = load_case("nose_transfer", {"run.fe_full.preset": "fast"})
    assert quick.name == "nose_transfer"  # its folder in a sweep
    fast = quick.runs["fe_full"]
    assert (fast.element_size, fast.error_twin, fast.start) == (pytest.approx(1.4e-3), False, whole.start)
    assert load_case(ROOT / "cases" / "nose_transfer.toml", {"run.fe_full.preset": "none"}).runs["fe_full"] == whole
    asked = {"run.fe_full.preset": "finest", "run.fe_full.window_ahead": "50 mm"}
    finest = load_case(path, asked).runs["fe_full"]
    assert (finest.window_ahead, finest.window_behind) == (pytest.approx(0.05), "auto")
    path.write_text(path.read_text() + "courant = 0.5\nwindow_behind = '70 mm'\n")
    assert load_case(path).runs["fe_full"] == fine.model_copy(update={"courant": 0.5, "window_behind": 0.07})
    for word in ('"fines"', '["fast"]', "1.4"):
        (error,) = errors_of(tmp_path, f"{head}[run.fe_full]\npreset = {word}\n{stretch}")
        assert error.startswith("run.fe_full.preset") and "fast, fine, finest" in error


def test_all_faults_are_reported_at_once_with_key_value_and_remedy(tmp_path):
    text = """
titel = "x"
[scene]
sped = "140 km/h"
friction = "0.3 m"
stiffness = 3
direction = "facin"
foundation = 3
[scene.wheel]
profile = "worn P8"
[scene.vehicle]
vehicle_sprung_mass = 66.25
wheelset_unsprung_mass = "9000 kg"
wheel_count = 7
[scene.materials]
wing = "Mn12"
nose = { grade = "Mn13", hardening_strain = [0, 0.1], hardening_stress = ["310 MPa", "200 MPa"] }
[run.fe_ful]
[run.fe_full]
element_size = "1.5 mn"
end = "nan mm"
suspension = "maybe"
"""
    errors = errors_of(tmp_path, text)
    expected = [
        "titel: unknown key, did you mean 'title'?",
        "scene.sped: unknown key, did you mean 'speed'?",
        "scene.speed: missing (running speed v)",
        'scene.friction: "0.3 m" has the dimension [length], not that of a plain number, write e.g. "1"',
        "scene.stiffness: unknown key, it belongs under [scene.foundation]",
        "scene.direction: unknown value 'facin', did you mean 'facing'? (choose from: facing, trailing)",
        "scene.foundation: 3 is not a table, write [scene.foundation] with its keys below",
        "scene.wheel.profile: unknown value 'worn P8' (choose from: P8, P8-worn, P8-hollow, P1, S1002)",
        'scene.vehicle.vehicle_sprung_mass: 66.25 has no unit, write e.g. "66.25 t"',
        (
            "scene.vehicle.wheelset_unsprung_mass: 9000 kg = 9 t is outside [0.1, 6] t for the unsprung mass of one"
            " wheelset"
        ),
        "scene.vehicle.wheel_count: 7 must be a multiple of 2 (number of wheels that carry the vehicle)",
        f"scene.materials.wing.grade: unknown value 'Mn12', did you mean 'Mn13'? (choose from: {', '.join(GRADES)})",
        (
            "scene.materials.nose: steel: hardening_strain and hardening_stress: yield curve: falls from 310 to 200 MPa"
            " behind a plastic strain of 0: softening localises in one cell and has no answer independent of the cells;"
            " give a curve that never falls"
        ),
        (
            "run.fe_ful: unknown model, did you mean 'fe_full'?; models: p2_formula, lumped, rigid_hertz, bem_passage,"
            " bem_plastic, fe_window, fe_full"
        ),
        'run.fe_full.element_size: "1.5 mn": unknown unit "mn", write e.g. "1 mm"',
        'run.fe_full.end: "nan mm" is not a finite number',
        (
            "run.fe_full.suspension: 'maybe' must be a valid boolean, unable to interpret input (sprung mass and"
            " primary suspension)"
        ),
    ]
    assert sorted(errors) == sorted(expected)


def test_a_key_of_another_table_is_told_where_it_belongs(tmp_path):
    """Above all tables, in a wrong one, and one of several models: that which the file runs."""
    above = 'speed = "75 mph"\nhardness = "2.8 GPa"\n'
    text = above + GOOD.replace("[scene]\n", '[scene]\nelement_size = "2 mm"\nsped = 1\n')
    text += '[run.lumped]\ncell_aspect = 2\nspeed = "75 mph"\n'
    assert sorted(errors_of(tmp_path, text)) == [
        "hardness: unknown key, it belongs under [damage]",
        "run.lumped.cell_aspect: unknown key, it belongs under [run.bem_plastic]",
        "run.lumped.speed: unknown key, it belongs under [scene]",
        "scene.element_size: unknown key, it belongs under [run.fe_full]",
        "scene.sped: unknown key, did you mean 'speed'?",
        "speed: unknown key, it belongs under [scene]",
    ]


@pytest.mark.parametrize(
    "text, said",
    [
        (
            "version = 2\n" + GOOD.replace("version = 1\n", "").replace("speed", "sped"),
            "case version 2, this program reads version 1",
        ),
        ("version = 'x'\n[scene]\n", "case version 'x'"),
        ("[scene\n", "not valid TOML"),
        (b"\xff\xfe[scene]", "not UTF-8"),
        (GOOD.replace("[run.fe_full]", "[other]"), "run: missing, write a table [run.MODEL]"),
        ("", "scene: missing"),
    ],
)
def test_files_of_another_kind_are_refused_in_one_sentence(tmp_path, text, said):
    assert any(said in error for error in errors_of(tmp_path, text))


def test_a_folder_whose_name_is_no_text_is_refused_in_one_sentence(tmp_path):
    """Of bytes that are not UTF-8: no result could name the files of such a case."""
    with pytest.raises(CaseError, match="not UTF-8 text: give it another name"):
        load_case(tmp_path / "S\udcfcd" / "case.toml")


def test_another_version_is_the_only_fault_then_reported(tmp_path):
    assert len(errors_of(tmp_path, GOOD.replace("version = 1", "version = 2").replace("speed =", "sped ="))) == 1


def test_a_list_of_changes_and_a_design_are_told_from_a_case():
    for name, command in (("rows/joint", "sweep"), ("design/casting", "design")):  # all their keys were unknown
        with pytest.raises(CaseError, match=f"is no case .*'rail-fem {command}' takes it"):
            load_case(name)


def test_absent_case_file_is_a_fault(tmp_path):
    with pytest.raises(CaseError, match="no such file"):
        load_case(tmp_path / "absent.toml")
    (tmp_path / "nose.toml").write_text(GOOD)
    with pytest.raises(CaseError, match="no such file, did you mean 'nose.toml'.; beside it: nose.toml;"):
        load_case(tmp_path / "noze.toml")
    with pytest.raises(CaseError, match="no such file, did you mean 'nose_transfer'"):
        load_case("nose_transfr")
    with pytest.raises(CaseError, match="cannot be read"):
        load_case(tmp_path)


@pytest.mark.parametrize("direction, start, end", [("facing", "560 mm", "200 mm"), ("trailing", "200 mm", "560 mm")])
def test_window_must_lie_along_the_direction_of_travel(tmp_path, direction, start, end):
    text = (
        GOOD.partition("[run.fe_full]")[0].replace('"facing"', f'"{direction}"')
        + f'[run.fe_full]\nstart = "{start}"\nend = "{end}"\n'
    )
    assert "exchange the two" in errors_of(tmp_path, text)[0]


def test_a_path_that_nobody_gave_is_run_either_way(tmp_path):
    """A file of `init` names fe_full, whose path is written facing: varied over directions by another model, it was
    refused for it."""
    path = tmp_path / "case.toml"
    path.write_text("\n".join(template(["rigid_hertz", "fe_full"])))
    assert load_case(path, {"scene.direction": "trailing"}).scene.direction_sign < 0
    with pytest.raises(CaseError, match="exchange the two"):
        load_case(path, {"scene.direction": "trailing", "run.fe_full.end": "600 mm"})


def test_byte_order_mark_is_read_over(tmp_path):
    path = tmp_path / "case.toml"
    path.write_bytes(b"\xef\xbb\xbf" + GOOD.encode())
    assert load_case(path).title.startswith("UK cast")


def test_a_title_tells_what_was_changed_in_words():
    """Of many changes the scene's first; the file's own words stand before them."""
    case, size = ROOT / "cases" / "nose_transfer.toml", {"run.fe_full.element_size": "2 mm"}
    steel = {"scene.materials.wing": {"grade": "Mn13", "strength": "200 %"}}
    told = lambda changes: load_case(case, changes).title.partition("; ")[2]
    assert told({}) == "" and told(size) == "changed: element size 2 mm"
    assert told({"scene.diverging": {}} | size) == "changed: diverging, element size 2 mm"  # an empty table
    more = size | {"run.fe_full.error_twin": False, "scene.vehicle.vehicle_sprung_mass": "90 t"} | steel
    assert told(more) == "changed: vehicle sprung mass 90 t, materials wing Mn13 200 %, element size 2 mm, 1 more"
