"""Case files from a stranger: each is refused in words, at once, whatever it holds; what no run survives is a error
before the run."""

import os
import signal
from functools import partial

import pytest

import rail_fem
from geometry.meshing.mesh_file import read_mesh_file
from geometry.profiles.formats.by_suffix import read_raw
from rail_fem.case.casefile import CaseError, load_case
from rail_fem.case.preflight import preflight_errors
from rail_fem.case.warnings import case_warnings
from rail_fem.measurement.record import read_record
from rail_fem.scene.scene import Scene
from rail_fem.scene.section_files import read_crossing
from rail_fem.scene.wheel_profile import read_wheel
from rail_fem.settings.explicit import FeSettings
from rail_fem.sweeps.rows import read_rows
from rail_fem.sweeps.trends import load_source
from tests.commands import call
from tests.rail_fem.test_casefile import GOOD, errors_of

LIGHT = GOOD.partition("[run.fe_full]")[0]
BARE = LIGHT.partition("[scene.materials]")[0]
WINDOW = LIGHT + '[run.fe_window]\nstart = "280 mm"\nend = "470 mm"\n'


@pytest.fixture(autouse=True)
def bounded():
    """Faults come in well under a second; a reader that hangs is stopped here, though kernels were compiled on a slow
    and busy machine."""
    signal.signal(signal.SIGALRM, lambda *_: pytest.fail("hangs"))
    signal.alarm(400)
    yield
    signal.alarm(0)


def changed(line, text=GOOD):
    """The case with one line put in place of that of the same key, or at the end."""
    key = line.split("=")[0].strip()
    lines = [line if old.split("=")[0].strip() == key else old for old in text.splitlines()]
    assert line in lines, f"no {key} in the case"
    return "\n".join(lines) + "\n"


NESTED = {
    "arrays": "x = " + "[" * 900 + "]" * 900,
    "deeper arrays": "x = " + "[" * 100_000 + "]" * 100_000,
    "tables": "x = " + "{a = " * 5000 + "1" + "}" * 5000,
    "unclosed": "[" * 100_000,
    "behind a text": 'x = ["""a"""", ' + "[" * 5000 + "]" * 5000 + ', "b"]',
}
LARGE = {
    "dots": "a" + ".a" * 50_000 + " = 1",
    "quoted dots": '"a"' + '."a"' * 50_000 + " = 1",
    "header": "[a" + ".a" * 50_000 + "]",
    "keys": "".join(f"k{i} = 1\n" for i in range(100_000)),
    "digits": "x = " + "1" * 5000,
    "digits in a list": "x = [" + "1" * 5000 + "]",
    "float": "x = 1." + "1" * 500_000,
    "title": 'title = "' + "x" * 10_000_000 + '"',
    "list": "x = [" + "1, " * 200_000 + "]",
    "escaped quotes": "title = " + '"""\\' * 200_000,
    "open text": 'x = """' + "a" * 1_000_000,
    "open single": "x = '''" + "a'" * 500_000,
    "blanks": " \n" * 300_000 + "x",
}


@pytest.mark.parametrize("name", [*NESTED, *LARGE])
def test_text_that_is_too_deep_or_too_large_is_refused_before_it_is_parsed(tmp_path, name):
    errors = errors_of(tmp_path, GOOD + "\n" + (NESTED | LARGE)[name])
    assert len(errors) == 1 and len(errors[0]) < 300 and errors[0].isprintable()


def test_a_thousand_unknown_keys_are_told_of_in_part(tmp_path):
    errors = errors_of(
        tmp_path, GOOD.replace("[scene]\n", "[scene]\n" + "".join(f"speeed_{i} = 1\n" for i in range(1000)))
    )
    assert len(errors) == 51 and errors[-1] == "and 150 more"  # of those of a section 200 are looked at


def test_pipes_devices_and_folders_are_no_case_files(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    for path in (tmp_path / "pipe", "/dev/zero", tmp_path):
        with pytest.raises(CaseError, match="cannot be read: it is no file"):
            load_case(path)


@pytest.mark.parametrize("name", ["p.step", "p.csv", "p.slcs", "stations.csv", "p.toml", "p.msh", "wheel_profile.csv"])
def test_no_file_that_a_user_names_is_waited_for(tmp_path, name):
    """A pipe without a writer: sections, STEP, profiles, records, groups of a report, lists of changes, meshes."""
    os.mkfifo(tmp_path / name)
    path = tmp_path if name == "stations.csv" else tmp_path / name
    readers = [read_crossing] if name[-4:] in ("step", ".csv", "slcs") else []
    by_suffix = {".csv": [lambda path: read_record(path, 30.0), read_raw], "toml": [load_source, read_rows]}
    readers += by_suffix.get(name[-4:], [])
    readers += [read_wheel] if name == "wheel_profile.csv" else [read_mesh_file] if name == "p.msh" else []
    for reader in readers:
        with pytest.raises(ValueError, match="no file|no list|a folder"):
            reader(path)


def test_sections_beyond_any_crossing_are_refused(tmp_path):
    """A last station at 1e308 mm was taken."""
    rows = "".join(f"{x},{y},{abs(y) / 10}\n" for x in ("0", "10", "20", "30", "1e308") for y in range(-40, 41, 8))
    (tmp_path / "s.csv").write_text(f"# unit: mm\nx,y,z\n{rows}")
    with pytest.raises(ValueError, match="s.csv: stations from x = 0 to 1e[+]305 m: is their unit right"):
        read_crossing(tmp_path / "s.csv")


@pytest.mark.parametrize(
    "line, said",
    [
        ('end = "3000 mm"', "run.fe_full.start, end: wheel_path: x 0.095 to 3 m .* leaves the modelled crossing"),
        ('approach_start = "400 mm"', "run.fe_window.approach_start: 400 mm lies behind start"),
    ],
)
def test_what_forbids_a_run_is_told_before_it(tmp_path, line, said):
    """The first was a traceback of `check`; start of the second stands where the rigid wheel changes body."""
    model = said.split(".")[1]
    (tmp_path / "case.toml").write_text(LIGHT + f"[run.{model}]\n{line}\n" + 'start = "95 mm"\n' * (model == "fe_full"))
    case = load_case(tmp_path / "case.toml")
    with pytest.raises(ValueError, match=said):
        raise ValueError("; ".join(preflight_errors(case.scene, case.runs[model], 1, model)))


@pytest.mark.parametrize("changes", [[1], {3: 4}, "scene.speed=3"])
def test_changes_of_a_wrong_kind_are_a_fault_of_the_case(changes):
    with pytest.raises(CaseError, match="changes: .*give them by their keys"):
        load_case(rail_fem.example("nose_transfer"), changes)


def test_comments_cost_nothing(tmp_path):
    (tmp_path / "case.toml").write_text("# a remark of some length\n" * 400_000 + GOOD)
    assert load_case(tmp_path / "case.toml").title.startswith("UK cast")


@pytest.mark.parametrize(
    "line, said",
    [
        ('speed = "75 mph**9**9**9"', "scene.speed: "),
        ('speed = "75 mph^2"', "scene.speed: "),
        ("speed = 1" + "0" * 90, "has no unit"),
        ('speed = "75 mph\\u0000"', "scene.speed: "),
        ('speed = "75 mph\\u001b[2J"', "scene.speed: "),
        ('speed = ["75 mph"]', "is not a quantity"),
        ('speed = "600 mph"', "is outside [0.5, 350] mph"),
        ('title = "a\\nb"', "title: "),
        ('title = "\\u001b[31mred"', "title: "),
        ("title = 3", "title: "),
        ('direction = "faci\\u0000ng"', "scene.direction: "),
        ('profile = "a\\u0000.csv"', "scene.wheel.profile: "),
        ('profile = "' + "a" * 300 + '.csv"', "scene.wheel.profile: "),
        ('profile = "' + "a" * 1500 + '.csv"', "scene.wheel.profile: "),
        ('profile = "/dev/zero.csv"', "scene.wheel.profile: "),
        ('profile = ".."', "scene.wheel.profile: "),
        ('friction = "30 deg"', "[angle], not that of a plain number"),
        ('friction = "0.3 rad"', "[angle]"),
        ('vehicle_sprung_mass = "66.25 ton"', 'write "t" for 1000 kg'),
    ],
)
def test_values_that_cannot_be_meant_are_refused_on_one_line(tmp_path, line, said):
    errors = errors_of(tmp_path, changed(line))
    assert len(errors) == 1 and said in errors[0] and errors[0].isprintable() and len(errors[0]) < 2100


@pytest.mark.parametrize(
    "key, said", [('label = "a\\nb"', "scene.label"), ('"sp\\u001bed" = 1', "unknown key, did you mean 'speed'?")]
)
def test_a_key_more_in_the_scene(tmp_path, key, said):
    errors = errors_of(tmp_path, GOOD.replace("[scene]\n", f"[scene]\n{key}\n"))
    assert len(errors) == 1 and said in errors[0] and errors[0].isprintable()


@pytest.mark.parametrize(
    "material, said",
    [
        ('{ grade = "Mn13", hardening = "mixed" }', "unknown value 'mixed' (choose from: isotropic, kinematic)"),
        ('{ grade = "Mn13", hardening = "kinematc" }', "did you mean 'kinematic'?"),
        ('{ grade = "Mn13", hardening = 3 }', "choose from: isotropic, kinematic"),
        (
            '{ grade = "Mn13", hardening_strain = [0, 0.1], hardening_stress = [310, 900] }',
            'hardening_stress[0]: 310 has no unit, write e.g. "310 MPa"',
        ),
        (
            '{ grade = "Mn13", hardening_strain = [0, 0.1], hardening_stress = "310 MPa" }',
            "scene.materials.wing.hardening_stress: ",
        ),
    ],
)
def test_faults_of_a_material(tmp_path, material, said):
    assert any(
        said in error
        for error in errors_of(tmp_path, BARE + f"[scene.materials]\nwing = {material}\n[run.p2_formula]\n")
    )


@pytest.mark.parametrize(
    "line, said",
    [
        ("max_steps = true", "max_steps: True must be a valid integer"),
        ("max_steps = 0", "max_steps: 0 must be"),
        ("field_frames = true", "field_frames: True"),
        ('settle_time = "20 ms"', "settle_time: 20 ms, but the pass takes 5.667 ms"),
        ("courant = 1.0", "outside [0.05, 0.97]"),
        (
            'history_interval = "1e5 us"',
            "history_interval: 100000 us gives 0.057 rows, the pass takes 5.667 ms; at most 567 us gives 10",
        ),
        ('approach_start = "300 mm"', "approach_start: 300 mm lies behind start 280 mm of a facing pass"),
    ],
)
def test_numerics_that_no_run_survives_are_faults(tmp_path, line, said):
    errors = errors_of(tmp_path, WINDOW + line + "\n")
    assert len(errors) == 1 and said in errors[0]


def test_light_models_refuse_a_history_of_one_row_too(tmp_path):
    assert (
        "history_interval: 100000 us gives"
        in errors_of(tmp_path, LIGHT + '[run.lumped]\nhistory_interval = "1e5 us"\n')[0]
    )


def test_check_shows_what_is_not_set_and_lists_with_their_units(tmp_path):
    text = (
        BARE
        + """[scene.materials.wing]
grade = "Mn13"
hardening_strain = [0, 0.1]
hardening_stress = ["500 MPa", "800 MPa"]
[run.rigid_hertz]
"""
    )
    (tmp_path / "case.toml").write_text(text)
    check = partial(call, "check", tmp_path / "case.toml")
    told, every = (
        {" ".join(line.split()[:2]): " ".join(line.split()[2:]) for line in check(*more).output.splitlines()}
        for more in ((), ("--all",))
    )
    assert every["materials.wing.hardening_stress 500"].startswith("MPa, 800 MPa true yield stress")
    assert every["check_rail not"].startswith("set flangeway") and "check_rail not" not in told
    assert {"start 95", "end 700", "crossing.ratio 10.75"} <= set(told)  # the window that is run, in mm
    others = ("crossing.dip_angle 10", "crossing.switch_entry 6.6667", "crossing.joint_gap 0")
    assert set(others) <= set(every) and not set(others) & set(told)


def test_case_files_have_a_schema():
    """For an editor's completion: every quantity with its unit and range."""
    scene = Scene.model_json_schema()
    assert (
        scene["properties"]["speed"]["description"] == "running speed v, [0.5, 350] mph"
        and scene["properties"]["speed"]["type"] == "string"
    )
    assert (
        "measured" not in scene["$defs"]["Wheel"]["properties"]
        and FeSettings.model_json_schema()["properties"]["courant"]["anyOf"][0]["maximum"] == 0.97
    )


@pytest.mark.parametrize(
    "old, new, said",
    [
        ("friction = 0.3", "friction = 9.9", "friction 9.9 > 0.7"),
        ("ratio = 10.75", "ratio = 20", "crossing 1:20: the parametric crossing was compared at"),
        ('track_mass = "750 kg"', 'track_mass = "750 g"', "track mass 0.75 kg < 50 kg"),
        ("[run.fe_window]", "[run.fe_window]\nfield_frames = 10000", "10000 field outputs > 500"),
        ("[run.fe_window]", '[run.fe_window]\nhistory_interval = "0.01 us"', "history interval 0.01 us < 1 us"),
        (
            'start = "280 mm"\nend = "470 mm"',
            'start = "95 mm"\nend = "540 mm"\nsettle_time = "7 ms"',
            "rolls 234.7 of 445 mm while it settles",
        ),
    ],
)
def test_what_is_allowed_but_doubtful_is_a_warning_of_the_case(tmp_path, old, new, said):
    assert old in WINDOW
    (tmp_path / "case.toml").write_text(WINDOW.replace(old, new))
    case = load_case(tmp_path / "case.toml")
    assert said in " ".join(case_warnings(case.scene, case.runs["fe_window"]))
    assert said in " ".join(call("check", tmp_path / "case.toml").output.split("warning(s)")[1].split())


def test_a_light_model_without_a_track_mass_is_refused_before_it_runs(tmp_path):
    """fe_window, too, which begins in the motion of one."""
    (tmp_path / "case.toml").write_text(WINDOW.replace('track_mass = "750 kg"', 'track_mass = "0 kg"'))
    shown = call("check", tmp_path / "case.toml", code=2)
    assert "  scene.foundation.track_mass: 0 kg, the light models need" in shown.stderr


@pytest.mark.parametrize("size", [6, 7, 9, 20])
def test_what_the_mesher_must_refuse_is_told_by_check(tmp_path, size):
    """S1002 in the window about the nose: the band on the wing is 11.9 mm wide."""
    text = WINDOW.replace('"P8-worn"', '"S1002"').replace('"280 mm"', '"240 mm"') + f'element_size = "{size} mm"\n'
    (tmp_path / "case.toml").write_text(text)
    shown = call("check", tmp_path / "case.toml", code=2)
    assert f"run.fe_window.element_size: {size} mm cannot be meshed: " in shown.stderr
    call("run", tmp_path / "case.toml", "--out", tmp_path / "out", code=2)
    assert not (tmp_path / "out").exists()
