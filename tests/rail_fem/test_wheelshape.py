"""A profile file that a scene names: read once, by the profile doctor, carried by the scene, known by its content, kept
with the run."""

import builtins
import io
import json
import os
import pickle
import shutil
from pathlib import Path

import numpy as np
import pytest

from geometry.profiles.doctor import examine
from geometry.profiles.formats.by_suffix import read_raw
from geometry.profiles.formats.simpack import write_simpack
from geometry.profiles.wheel import wheel_profile
from rail_fem import hierarchy
from rail_fem.case.casefile import CaseError, load_case
from rail_fem.case.warnings import scene_warnings
from rail_fem.result.result import load
from rail_fem.result.runfolder import digest, fingerprint
from rail_fem.scene.wheel_profile import KEPT, read_wheel
from rail_fem.sweeps.compare import CompareError, compare
from tests.commands import call

ROOT = Path(__file__).resolve().parents[2]
GOOD = (ROOT / "cases" / "nose_transfer.toml").read_text(encoding="utf-8")
SCENE = GOOD.partition("[run.fe_full]")[0]
LIGHT = SCENE + '[run.lumped]\nstart = "330 mm"\nend = "380 mm"\n[run.p2_formula]\n'
P8 = wheel_profile("P8").points[::5]


def write(path, points=P8, scale=1e3, head="# y, z [mm]\n", form="{:.6f},{:.6f}"):
    path.write_text(head + "".join(form.format(*(scale * p)) + "\n" for p in points), encoding="utf-8")


def case_with(folder, name="wheel.csv", text=LIGHT) -> Path:
    path = folder / "case.toml"
    path.write_text(text.replace('"P8-worn"', f'"{name}"'), encoding="utf-8")
    return path


def one_line(outcome) -> str:
    return " ".join(outcome.output.split())


# Read once


def test_a_wheel_that_was_read_can_be_changed_when_its_file_is_gone(tmp_path):
    """Its radius, not its reading: that needs the file again."""
    write(tmp_path / "wheel.csv")
    wheel = load_case(case_with(tmp_path)).scene.wheel
    (tmp_path / "wheel.csv").unlink()
    larger = wheel.replace_si(radius=0.46)
    assert (
        larger.radius == 0.46
        and larger.digest == wheel.digest
        and np.array_equal(larger.shape.points, wheel.shape.points)
    )
    with pytest.raises(ValueError, match='no file "wheel.csv"'):
        wheel.replace(unit="mm")


def test_a_profile_file_is_opened_once_in_a_whole_run(tmp_path, monkeypatch):
    """Loading, searching, solving patches, writing, drawing: bem_passage asks for the wheel's shape some 80 times."""
    write(tmp_path / "wheel.csv")
    opened = []
    count = lambda real: (
        lambda file, *rest, **more: (
            opened.append(file) if str(file).endswith("wheel.csv") else None,
            real(file, *rest, **more),
        )[1]
    )
    for module, name in ((io, "open"), (builtins, "open"), (os, "open")):
        monkeypatch.setattr(module, name, count(getattr(module, name)))
    text = SCENE + '[run.bem_passage]\nstart = "345 mm"\nend = "375 mm"\npatch_spacing = "15 mm"\ncells = 8\n'
    call("run", case_with(tmp_path, text=text), "--out", tmp_path / "run")
    assert opened == [tmp_path / "wheel.csv"]


def test_a_scene_works_on_what_was_read_whatever_becomes_of_the_file(tmp_path):
    write(tmp_path / "wheel.csv")
    scene = load_case(case_with(tmp_path)).scene
    before = scene.wheel.shape.points.copy()
    write(tmp_path / "wheel.csv", wheel_profile("S1002").points[::5])
    assert np.array_equal(scene.wheel.shape.points, before)
    (tmp_path / "wheel.csv").unlink()
    for same in (scene, scene.model_copy(update={"speed": 20.0}), pickle.loads(pickle.dumps(scene))):
        assert np.array_equal(same.wheel.shape.points, before)


def test_a_wheel_that_is_given_another_file_without_reading_it_says_so(tmp_path):
    write(tmp_path / "wheel.csv")
    wheel = load_case(case_with(tmp_path)).scene.wheel
    with pytest.raises(ValueError, match="other.csv was not read"):
        _ = wheel.model_copy(update={"profile": "other.csv"}).shape
    assert wheel.model_copy(update={"profile": "P8"}).shape == wheel_profile("P8")


# Known by its content


def test_name_place_and_comments_of_a_file_change_nothing_and_its_content_does(tmp_path):
    mark = lambda case: fingerprint("lumped", case.scene, case.runs["lumped"])
    write(tmp_path / "wheel.csv")
    first = mark(load_case(case_with(tmp_path)))
    (tmp_path / "elsewhere").mkdir()
    write(tmp_path / "elsewhere" / "renamed.txt", head="# measured on a Tuesday\n")
    assert mark(load_case(case_with(tmp_path, "elsewhere/renamed.txt"))) == first
    moved = P8.copy()
    moved[40, 1] += 1e-6
    write(tmp_path / "wheel.csv", moved)
    other = mark(load_case(case_with(tmp_path)))
    assert other != first and digest(other) != digest(first)
    assert {key for key in first["scene"]["wheel"] if first["scene"]["wheel"][key] != other["scene"]["wheel"][key]} == {
        "profile"
    }


def test_two_contents_under_one_name_are_two_wheels_for_every_cache(tmp_path):
    """In one process: tables and forces of the second content are those of a process that never saw the first."""
    solve = lambda case: hierarchy.solve("bem_passage", case.scene, case.runs["bem_passage"])
    peak = lambda: solve(load_case(path)).history["force"].max()
    path = case_with(
        tmp_path,
        text=SCENE + '[run.bem_passage]\nstart = "330 mm"\nend = "380 mm"\npatch_spacing = "25 mm"\ncells = 8\n',
    )
    write(tmp_path / "wheel.csv", wheel_profile("P8-worn").points[::5])
    worn = peak()
    write(tmp_path / "wheel.csv", wheel_profile("P8-hollow").points[::5])
    hollow = peak()
    case_with(tmp_path, "other.csv", path.read_text().replace('"wheel.csv"', '"other.csv"'))
    shutil.copy(tmp_path / "wheel.csv", tmp_path / "other.csv")
    assert hollow == peak() and abs(hollow - worn) > 0.01 * worn
    write(tmp_path / "wheel.csv", wheel_profile("P8-worn").points[::5])
    case_with(tmp_path, text=path.read_text().replace('"other.csv"', '"wheel.csv"'))
    assert peak() == worn


def test_a_sweep_runs_again_what_another_content_had_answered(tmp_path, undrawn):
    write(tmp_path / "wheel.csv")
    sweep = lambda: one_line(call("sweep", case_with(tmp_path), "--out", tmp_path / "out"))
    force = lambda: max(
        peak.value for peak in load(tmp_path / "out" / "case" / "p2_formula").peaks.values() if peak.unit == "N"
    )
    assert sweep().count("finished in") == 2
    first = force()
    (tmp_path / "wheel.csv").rename(tmp_path / "moved.csv")
    again = one_line(call("sweep", case_with(tmp_path, "moved.csv"), "--out", tmp_path / "out"))
    assert again.count("finished before") == 2
    write(tmp_path / "wheel.csv", wheel_profile("P8-hollow").points[::5])
    changed = sweep()
    assert changed.count("its profile file had changed") == 2 and "finished before" not in changed
    assert force() > 1.2 * first
    assert sweep().count("finished before") == 2


def test_results_of_two_contents_are_two_scenes_for_compare(tmp_path, undrawn):
    case = case_with(tmp_path)
    for name, wheel in (("a", "P8"), ("b", "S1002")):
        write(tmp_path / "wheel.csv", wheel_profile(wheel).points[::5])
        call("run", case, "--model", "p2_formula" if name == "a" else "lumped", "--out", tmp_path / name)
    with pytest.raises(CompareError, match="another scene"):
        compare([tmp_path / "a", tmp_path / "b"])


# Kept with the run


def test_a_run_is_shown_gone_on_with_and_repeated_from_its_own_folder(tmp_path, undrawn):
    rough = P8 + 20e-6 * np.random.default_rng(3).standard_normal(P8.shape)
    write(tmp_path / "wheel.csv", rough)

    def run(case, out, *more, code=0):
        return call("run", case, "--model", "lumped", "--out", tmp_path / out, *more, code=code)

    run(case_with(tmp_path), "run")
    shape = load_case(tmp_path / "case.toml").scene.wheel.shape
    (tmp_path / "wheel.csv").unlink()
    stored = load(tmp_path / "run")
    assert (
        stored.scene.wheel.shape == shape
        and "smoothed" in " ".join(stored.notes)
        and all("> 10 um" in warning for warning in stored.warnings if "wheel.csv" in warning)
        and stored.scene.wheel.name == "wheel.csv"
    )
    assert "smoothed" in call("show", tmp_path / "run").output.split("note(s)")[1]
    gone = run(tmp_path / "case.toml", "run", "--restart", code=2)
    assert f"the {KEPT} of a run that has used it" in one_line(gone)
    run(case_with(tmp_path, f"run/{KEPT}"), "run", "--restart")
    run(tmp_path / "case.toml", "again")
    first, again = (json.loads((tmp_path / name / "case.json").read_text()) for name in ("run", "again"))
    assert first == again and read_wheel(tmp_path / "again" / KEPT).profile == shape
    assert np.array_equal(load(tmp_path / "again").history["force"], stored.history["force"])


def test_case_and_result_state_the_digest(tmp_path):
    write(tmp_path / "wheel.csv")
    call("run", case_with(tmp_path), "--model", "p2_formula", "--out", tmp_path / "run")
    content = load_case(tmp_path / "case.toml").scene.wheel.digest
    assert len(content) == 64
    assert json.loads((tmp_path / "run" / "result.json").read_text())["scene"]["wheel"]["digest"] == content
    assert content in json.loads((tmp_path / "run" / "case.json").read_text())["scene"]["wheel"]["profile"]


def test_a_restart_with_another_content_is_refused_and_told_what_to_do(tmp_path, undrawn):
    write(tmp_path / "wheel.csv")
    call("run", case_with(tmp_path), "--model", "lumped", "--out", tmp_path / "run")
    write(tmp_path / "wheel.csv", wheel_profile("S1002").points[::5])
    refused = call("run", tmp_path / "case.toml", "--model", "lumped", "--out", tmp_path / "run", "--restart", code=2)
    assert (
        "the profile file has changed since the run began: put it back, or name" in one_line(refused)
        and KEPT in refused.output
    )


def test_a_kept_profile_that_was_edited_is_refused(tmp_path):
    write(tmp_path / "wheel.csv")
    read_wheel(tmp_path / "wheel.csv").keep(tmp_path)
    kept = tmp_path / KEPT
    kept.write_text(kept.read_text().replace("\n0.0", "\n0.1", 1).replace("\n-0.0", "\n-0.1", 1))
    with pytest.raises(CaseError, match="was changed since a run wrote it"):
        load_case(case_with(tmp_path, KEPT))


def test_a_scene_that_states_a_digest_takes_no_other_content(tmp_path):
    write(tmp_path / "wheel.csv")
    text = LIGHT.replace('profile = "P8-worn"', 'profile = "P8-worn"\ndigest = "0123456789abcdef"')
    with pytest.raises(CaseError, match="scene.wheel.digest: .*other content .* than is stated .0123456789ab"):
        load_case(case_with(tmp_path, text=text))


def test_a_case_that_changed_while_it_waited_is_refused(tmp_path):
    """What a sweep read is what its processes under mpirun run."""
    refused = call(
        "run", case_with(tmp_path, "P8"), "--model", "lumped", "--out", tmp_path / "run", "--digest", "0" * 64, code=2
    )
    assert "has changed since it was read" in one_line(refused) and not (tmp_path / "run").exists()


# One reader


@pytest.mark.parametrize(
    "change",
    [
        dict(scale=1.0),
        dict(form="{:.6f}, {:.6f}, 0.5"),
        dict(form="{:.6f};{:.6f}"),
        dict(points=P8[::-1]),
        dict(points=P8 * [1, -1]),
        dict(points=P8 * [-1, 1]),
        dict(points=P8 + [0.01, 0.004]),
        dict(points=np.repeat(P8, 2, axis=0)),
    ],
)
def test_a_case_reads_what_the_profile_command_reads_and_says_what_was_repaired(tmp_path, change):
    write(tmp_path / "wheel.csv", **change)
    scene, found = load_case(case_with(tmp_path)).scene, examine(read_raw(tmp_path / "wheel.csv", "wheel"))
    assert scene.wheel.shape == found.profile.graph_part()
    said = lambda weight: [f"wheel profile wheel.csv: {f.text}" for f in found.findings if f.weight == weight]
    assert scene_warnings(scene) == said("warning") and scene.wheel.measured.notes == said("repaired")
    assert (
        np.abs(scene.wheel.shape.height([-0.03, 0.0, 0.04]) - wheel_profile("P8").height([-0.03, 0.0, 0.04])).max()
        < 42e-6
    )


def test_decimal_commas_are_read(tmp_path):
    (tmp_path / "wheel.csv").write_text("".join(f"{1e3 * y:.6f};{1e3 * z:.6f}\n".replace(".", ",") for y, z in P8))
    assert np.abs(load_case(case_with(tmp_path)).scene.wheel.shape.points - P8).max() < 1e-9


def test_scatter_is_smoothed_in_text_as_in_simpack_and_said(tmp_path):
    rough = P8 + 17e-6 * np.random.default_rng(1).standard_normal(P8.shape)
    write(tmp_path / "wheel.csv", rough, form="{:.9f},{:.9f}")
    write_simpack(tmp_path / "wheel.prw", rough, "wheel")
    text, simpack = (load_case(case_with(tmp_path, name)).scene for name in ("wheel.csv", "wheel.prw"))
    assert np.abs(text.wheel.shape.points - simpack.wheel.shape.points).max() < 1e-9
    assert any("smoothed: points moved by" in note for note in text.wheel.measured.notes)
    check = call("check", tmp_path / "case.toml", "--model", "lumped")
    assert "repaired scatter" in one_line(check).split("derived")[0]


@pytest.mark.parametrize(
    "change, said",
    [
        (dict(points=P8[:15]), "wide"),
        (dict(scale=1e5), "fits neither mm, m nor inch"),
        (dict(points=P8[P8[:, 0] > -0.02]), "wide"),
        (dict(points=P8[P8[:, 0] < 0.01]), "wide"),
        (dict(points=P8[::20], head="", form="{:.3f} {:.3f} x"), "is not a number"),
        (dict(points=np.vstack([P8, [np.nan, 0]])), "not finite"),
    ],
)
def test_a_file_that_is_no_wheel_is_a_fault_of_the_case(tmp_path, change, said):
    write(tmp_path / "wheel.csv", **change)
    with pytest.raises(CaseError) as error:
        load_case(case_with(tmp_path))
    assert (
        len(error.value.errors) == 1
        and error.value.errors[0].startswith("scene.wheel.profile: ")
        and said in error.value.errors[0]
    )


def test_absent_and_endless_files_are_faults_at_once(tmp_path):
    with pytest.raises(CaseError, match='scene.wheel.profile: no file "wheel.csv" in '):
        load_case(case_with(tmp_path))
    os.mkfifo(tmp_path / "wheel.csv")
    with pytest.raises(CaseError, match="scene.wheel.profile: .* is no file"):
        load_case(tmp_path / "case.toml")
    (tmp_path / "wheel.csv").unlink()
    with open(tmp_path / "wheel.csv", "wb") as stream:
        stream.truncate(30_000_000)
    with pytest.raises(CaseError, match="30 MB, the largest that is read here has 20 MB"):
        load_case(tmp_path / "case.toml")


def test_what_was_read_cannot_be_typed_into_a_case(tmp_path):
    with pytest.raises(CaseError, match="scene.wheel.measured: unknown key"):
        load_case(case_with(tmp_path, "P8", LIGHT.replace('profile = "P8-worn"', 'profile = "P8-worn"\nmeasured = 3')))


# What a case tells of its file


def told(tmp_path, *lines, name="wheel.csv"):
    return case_with(
        tmp_path, text=LIGHT.replace('profile = "P8-worn"', "\n".join(['profile = "P8-worn"', *lines])), name=name
    )


def test_a_case_tells_what_its_file_does_not_say(tmp_path):
    cut = P8[(P8[:, 0] > -0.0625)] + [0.07, 0.0]  # y from the flange back, of which nothing is measured
    write(tmp_path / "wheel.csv", cut, form="{:.9f},{:.9f}")
    with pytest.raises(CaseError, match="give flange_back"):
        load_case(case_with(tmp_path))
    scene = load_case(told(tmp_path, 'flange_back = "0 mm"', 'unit = "mm"', 'smoothing = "3 um"')).scene
    assert (
        np.abs(scene.wheel.shape.height([-0.03, 0.0, 0.04]) - wheel_profile("P8").height([-0.03, 0.0, 0.04])).max()
        < 50e-6
    )
    assert "3 um taken out as told" in " ".join(scene.wheel.measured.notes)


def test_how_a_file_is_read_belongs_to_its_content(tmp_path):
    write(tmp_path / "wheel.csv", P8 + 17e-6 * np.random.default_rng(1).standard_normal(P8.shape), form="{:.9f},{:.9f}")
    plain, smoother = load_case(case_with(tmp_path)).scene, load_case(told(tmp_path, 'smoothing = "40 um"')).scene
    assert plain.plain() != smoother.plain() and plain.wheel.shape != smoother.wheel.shape
    assert smoother.wheel.replace(smoothing=None).shape == plain.wheel.shape
    smoother.keep_files(tmp_path)
    restored = load_case(case_with(tmp_path, KEPT)).scene
    assert restored.plain() == smoother.plain() and restored.wheel.shape == smoother.wheel.shape
    with pytest.raises(CaseError, match="nothing left to tell of its reading: leave out smoothing"):
        load_case(told(tmp_path, 'smoothing = "40 um"', name=KEPT))


def test_a_result_of_a_file_read_as_told_is_read_back(tmp_path):
    write(tmp_path / "wheel.csv")
    call("run", told(tmp_path, 'smoothing = "2 um"'), "--model", "p2_formula", "--out", tmp_path / "run")
    scene = load_case(tmp_path / "case.toml").scene
    assert (
        load(tmp_path / "run").scene.plain() == scene.plain()
        and load(tmp_path / "run").scene.wheel.shape == scene.wheel.shape
    )


@pytest.mark.parametrize(
    "line, said",
    [
        ('flange_back = "0 mm"', "scene.wheel.flange_back: is told of a profile file, P8 is known by its name"),
        ("number = 2", "scene.wheel.number: is told"),
        ('unit = "furlong"', "scene.wheel.unit: unknown value 'furlong' (choose from: mm, cm, m, inch)"),
        ("number = true", "scene.wheel.number: True must be"),
        ("smoothing = 3", "scene.wheel.smoothing: 3 has no unit"),
    ],
)
def test_what_cannot_be_told_of_a_wheel(tmp_path, line, said):
    with pytest.raises(CaseError) as error:
        load_case(told(tmp_path, line, name="P8"))
    assert any(said in line for line in error.value.errors)
