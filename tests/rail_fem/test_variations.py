"""A case with values changed from outside is the case whose file was written so; a sweep over them is one table and one
figure."""

import csv
import json

import numpy as np
import pytest
from matplotlib.figure import Figure

from rail_fem import load_sweep, plot_sweep
from rail_fem.case.casefile import load_case
from rail_fem.case.examples import example
from rail_fem.case.variations import (
    VariationError,
    as_setting,
    combinations,
    folder_name,
    read_setting,
    read_variation,
    short_keys,
)
from rail_fem.result.result import load
from rail_fem.result.runfolder import digest, fingerprint
from tests import commands

REFERENCE = example("nose_transfer")
FORMULA = '[run.p2_formula]\ndip_angle = "15 mrad"\n'  # needs no search of surfaces


def test_a_value_is_bounded_as_a_case_files_is():
    for text in ("[" * 3000, "{a=" * 300, "1" * 5000):
        with pytest.raises(VariationError, match="brackets 13 deep, at most 12|a word of 5000 characters"):
            read_setting(f"scene.speed={text}")
    assert read_setting(f"title={'x' * 150}")[1] == "x" * 150


@pytest.fixture
def case(tmp_path):
    text = REFERENCE.read_text(encoding="utf-8").partition("[run.")[0]
    (tmp_path / "nose.toml").write_text(text + FORMULA, encoding="utf-8")
    return tmp_path / "nose.toml"


def call(*words, code=0) -> str:
    return " ".join(commands.call(*words, code=code).output.split())


def test_a_series_is_even_in_the_unit_in_which_it_is_typed():
    key, values = read_variation("scene.speed=30mph:100mph:8")
    assert key == "scene.speed" and values == [f"{speed} mph" for speed in range(30, 101, 10)]
    assert read_variation("scene.friction = 0.1:0.5:3")[1] == ["0.1", "0.3", "0.5"]
    assert read_variation("scene.bearers.spacing=500mm:700mm:3")[1] == [
        "500 mm",
        "600 mm",
        "700 mm",
    ]  # an optional table
    assert read_variation("scene.wheel.profile=P8, P1")[1] == ["P8", "P1"]
    assert read_variation("run.rigid_hertz.plastic_indentation=true,false")[1] == [True, False]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("scene.speed", "write KEY=FIRST:LAST:COUNT"),
        ("scene.sped=30mph:60mph:4", "did you mean 'speed'"),
        ("scene.speed=30kg:60kg:4", "dimension"),
        ("scene.speed=30:60:4", "has no unit"),
        ("scene.speed=30mph:60mph:1", "is no series"),
        ("scene.speed=30mph:60mph:4e9", "is no series"),
        ("scene.direction=facing:trailing:2", "no physical quantity"),
        ("run.fe_ful.courant=0.5:0.9:3", "with a model among"),
        ("seene.speed=1mph:2mph:3", "did you mean 'scene'"),
        ("scene.speed.fast=1mph:2mph:3", "speed is no table"),
    ],
)
def test_a_variation_that_cannot_be_is_refused_with_the_remedy(text, words):
    with pytest.raises(VariationError, match=words.replace("(", r"\(")):
        read_variation(text)


def test_a_grid_holds_every_value_with_every_other():
    grid = combinations([("scene.speed", ["1 mph", "2 mph"]), ("scene.friction", [0.1, 0.2, 0.3])])
    assert len(grid) == 6 and len({tuple(change.values()) for change in grid}) == 6
    assert combinations([]) == [{}]
    for wrong in ([("a", [1]), ("a", [2])], [("a", [1, 1])], [("a", [*range(200)]), ("b", [*range(200)])]):
        with pytest.raises(VariationError):
            combinations(wrong)


@pytest.mark.parametrize(
    "value",
    ["60 mph", 4, 0.25, True, "P8-worn", "wheels/my wheel.csv", [0.0, 0.1], ["60 GPa", "8 GPa"], 1e-7, "1060", "true"]
    + ["", " a", "[1]", 'a "new" wheel', "Räder", {"radius": "645 m", "own": {"angle of attack": 0.003, "x": [True]}}],
)
def test_a_setting_reaches_another_process_unchanged(value):
    """Also a table, which a file of groups may change, and a text that looks like a number."""
    assert read_setting(as_setting("scene.key", value)) == ("scene.key", value)


def test_folders_are_told_apart_by_what_varies_and_can_be_typed():
    assert folder_name("nose", {"speed": "30 mph", "stiffness": "80 kN/mm"}) == "nose-speed=30mph-stiffness=80kN_per_mm"
    assert folder_name("nose", {"profile": "../wheels/my wheel.csv"}) == "nose-profile=mywheel"
    long = [folder_name("nose", {"profile": "x" * 300 + end}) for end in "ab"]
    assert long[0] != long[1] and max(map(len, long)) <= 120
    assert short_keys(["scene.speed", "scene.materials.wing.strength", "scene.materials.nose.strength"]) == {
        "scene.speed": "speed",
        "scene.materials.wing.strength": "wing.strength",
        "scene.materials.nose.strength": "nose.strength",
    }


def test_a_set_value_is_that_of_a_file_written_so(case, tmp_path):
    """Also to its digest, by which a run under mpirun knows its case; a steel given by its grade takes a factor."""
    written = tmp_path / "written.toml"
    text = case.read_text(encoding="utf-8").replace('speed = "75 mph"', 'speed = "60 mph"')
    written.write_text(
        text.replace('wing = "Mn13" ', 'wing = { grade = "Mn13", strength = "200 %" } '), encoding="utf-8"
    )
    changed = load_case(case, {"scene.speed": "60 mph", "scene.materials.wing.strength": "200 %"})
    assert changed.scene == load_case(written).scene and changed.scene != load_case(case).scene
    mark = digest(fingerprint("p2_formula", changed.scene, changed.runs["p2_formula"]))
    options = ("--set", "scene.speed=60mph", "--set", "scene.materials.wing.strength=200%")
    call("run", case, *options, "--out", tmp_path / "run", "--digest", mark)
    assert load(tmp_path / "run").scene == changed.scene
    assert "60 mph" in call("check", case, "--set", "scene.speed=60mph")


def test_all_faults_of_all_cases_are_told_once_and_nothing_runs(case, tmp_path):
    options = ("--vary", "scene.speed=30mph,3 kg,900mph", "--set", "scene.gauge=1435")
    options += ("--set", "run.p2_formula.reeding=all")
    words = call("sweep", case, "--out", tmp_path / "out", *options, code=2)
    for told in ("3 kg", "900mph", "scene.gauge: 1435 has no unit", "did you mean 'reading'"):
        assert words.count(told) == 1, (told, words)
    assert "nothing was run" in words and not (tmp_path / "out").exists()
    assert "both set and varied" in call(
        "sweep", case, "--out", tmp_path / "out", "--vary", "scene.speed=1mph,2mph", "--set", "scene.speed=3mph", code=2
    )


@pytest.fixture
def swept(case, tmp_path):
    """A grid of speeds and stiffnesses by the formula, cut off after its first case and then gone on with."""
    grid = ("--vary", "scene.speed=30mph:90mph:4", "--vary", "scene.foundation.stiffness=80 kN/mm,160kN/mm")
    call("sweep", case, *grid, "--out", tmp_path / "out", "--only", "1")
    assert len(list((tmp_path / "out").glob("*/*/result.json"))) == 1
    words = call("sweep", case, *grid, "--out", tmp_path / "out")
    assert words.count("finished before") == 1 and words.count(": finished in") == 7
    return tmp_path / "out"


def test_a_grid_is_one_table_with_what_varies_as_columns(swept):
    """The formula's dynamic part is proportional to the speed: so are the rows of the table."""
    sweep = load_sweep(swept)
    assert sweep.varied == ["scene.foundation.stiffness", "scene.speed"]
    rows = [row for row in sweep.rows() if row["scene.foundation.stiffness [kN/mm]"] == 80.0]
    speed, dynamic = np.array([[r["scene.speed [mph]"], r["p2 [kN]"] - r["static load [kN]"]] for r in rows]).T
    assert list(speed) == [30.0, 50.0, 70.0, 90.0]
    assert np.allclose(dynamic / speed, dynamic[0] / speed[0], rtol=1e-12)
    with (swept / "sweep.csv").open(encoding="utf-8", newline="") as stream:
        told = list(csv.DictReader(stream))
    assert len(told) == 8 and [float(row["scene.speed [mph]"]) for row in told[:4]] == [30.0, 50.0, 70.0, 90.0]
    assert told[0]["largest_force [kN]"] == ""  # the formula does not resolve it
    assert "| scene.speed [mph] |" in (swept / "sweep.md").read_text(encoding="utf-8")
    assert "varies: scene.foundation.stiffness, scene.speed" in call("show", swept)


def test_a_grid_is_a_data_set_over_what_varies(swept):
    pytest.importorskip("xarray")
    sweep = load_sweep(swept)
    found = sweep.to_xarray()
    assert found["p2"].dims == ("scene.foundation.stiffness", "scene.speed", "model") and found["p2"].shape == (2, 4, 1)
    for row in sweep.rows():
        at = {key: row[f"{key} [{unit}]"] for key, unit in (("scene.speed", "mph"), (sweep.varied[0], "kN/mm"))}
        assert float(found["p2"].sel(at | {"model": row["model"]})) == row["p2 [kN]"]
    assert found["p2"].notnull().all() and found["p2"].attrs["units"] == "kN"


def test_a_quantity_is_drawn_against_what_varies(swept, tmp_path):
    figure = plot_sweep(load_sweep(swept), "p2", "speed")
    axes = figure.axes[0]
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("speed [mph]", "p2 [kN]")
    lines = {line.get_label(): line.get_xydata() for line in axes.lines}
    of_load = [label for label in lines if label.startswith("static wheel load, ")]
    assert {"p2_formula, stiffness 80 kN/mm", "p2_formula, stiffness 160 kN/mm", *of_load} == set(lines)
    assert len(of_load) == 1
    own = Figure().subplots()
    assert plot_sweep(load_sweep(swept), "p2", "speed", ax=own) is own
    assert {line.get_label() for line in own.lines} == set(lines)
    assert "p2_formula's forces within 68% of fe_full's, all 81% (16 cases)" in figure.texts[0].get_text()
    assert np.array_equal(lines["p2_formula, stiffness 80 kN/mm"][:, 0], [30, 50, 70, 90])
    drawn = call(
        "show", swept, "--quantity", "impact on the wheel", "--against", "scene.speed", "--out", tmp_path / "a.png"
    )
    assert drawn.endswith("a.png") and (tmp_path / "a.png").stat().st_size > 20_000
    for options, words in [
        (("--quantity", "p2"), "give both"),
        (("--quantity", "p22", "--against", "speed"), "did you mean 'p2'"),
        (("--quantity", "p2", "--against", "friction"), "choose one of scene.foundation.stiffness"),
        (("--quantity", "largest_force", "--against", "speed"), "no run of this sweep resolves it"),
    ]:
        assert words in call("show", swept, *options, code=2)


def test_axle_loads_vary_in_a_file_that_states_the_sprung_mass(case, tmp_path):
    """What is changed takes the place of the other key; both given in one go have to agree."""
    loads = ("--vary", "scene.vehicle.axle_load=17 t,22.5 t")
    call("sweep", case, "--out", tmp_path / "both", *loads, "--vary", "scene.speed=30mph:90mph:3")
    lines = plot_sweep(load_sweep(tmp_path / "both"), "p2", "speed").axes[0].lines
    static = {line.get_label(): set(line.get_ydata()) for line in lines if line.get_label().startswith("static")}
    assert list(static) == [f"static wheel load, {t * 9.81 / 2:.1f} kN" for t in (17, 22.5)]  # half an axle's each
    assert all(len(heights) == 1 for heights in static.values())
    call("sweep", case, "--out", tmp_path / "out", *loads)
    sweep = load_sweep(tmp_path / "out")
    assert sweep.varied == ["scene.vehicle.axle_load"]
    rows = [(row["scene.vehicle.axle_load [t]"], row["axle load [t]"], row["static load [kN]"]) for row in sweep.rows()]
    assert rows == [(t, t, pytest.approx(t * 9.81 / 2)) for t in (17.0, 22.5)]
    both = ("--set", "scene.vehicle.axle_load=22.5 t", "--set", "scene.vehicle.vehicle_sprung_mass=80 t")
    assert "scene.vehicle.axle_load: 22.5 t, but" in call("check", case, *both, code=2)


def test_a_model_whose_numerics_vary_runs_alone(case, tmp_path):
    with case.open("a", encoding="utf-8") as stream:
        stream.write("[run.lumped]\n")
    out = tmp_path / "out"
    call("sweep", case, "--out", out, "--vary", "run.p2_formula.reading=increment,all")
    assert {path.parent.name for path in out.glob("*/*/result.json")} == {"p2_formula"}
    sweep = load_sweep(out)
    assert sweep.varied == ["run.p2_formula.reading"]
    assert {row["run.p2_formula.reading"] for row in sweep.rows()} == {"increment", "all"}
    positions = [text.get_text() for text in plot_sweep(sweep, "p2", "reading").axes[0].get_xticklabels()]
    assert sorted(positions) == ["all", "increment"]
    marks = [json.loads(path.read_text())["run.p2_formula"]["reading"] for path in out.glob("*/*/case.json")]
    assert sorted(marks) == ["all", "increment"]
