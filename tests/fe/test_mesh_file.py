"""The explicit model on a mesh from a file: the run whose mesh it was, and what is refused of a case."""

import re
import shutil
from dataclasses import replace

import numpy as np
import pytest

from rail_fem.case.casefile import CaseError, load_case
from rail_fem.case.preflight import preflight_errors
from rail_fem.export.files import write_by_meshio
from rail_fem.export.tagged import read_tagged
from rail_fem.models import fe_full
from rail_fem.result.runfolder import RunFolderError, digest, fingerprint, prepare_folder
from rail_fem.studies.size_series import run_at
from tests.rail_fem.test_casefile import GOOD

LINES = {
    "element_size": '"5 mm"',
    "start": '"300 mm"',
    "end": '"330 mm"',
    "max_steps": "120",
    "field_frames": "1",
    "mass_scaling": "1",
}


def case_of(folder, **more):
    """The reference case, coarse and short. more : keys of [run.fe_full] as they are typed"""
    path = folder / "case.toml"
    keys = "\n".join(f"{name} = {value}" for name, value in (LINES | more).items())
    path.write_text(f"{GOOD.partition('[run.')[0]}[run.fe_full]\n{keys}\n", encoding="utf-8")
    return path


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """A pass on our own mesh, and that mesh written as .msh."""
    folder = tmp_path_factory.mktemp("meshed")
    case = load_case(case_of(folder))
    result = fe_full.solve(case.scene, case.runs["fe_full"], folder / "run")
    write_by_meshio(folder / "own.msh", read_tagged(folder / "run"))
    return folder, result


def test_a_pass_on_its_own_mesh_read_from_a_file_is_the_same_pass(run):
    """Its wheel stands where the field was written, 2.5 mm on, and is moved back: positions differ by rounding, and a
    node on the edge of two facets may begin on either, whose normals differ by the kink between them."""
    folder, first = run
    case = load_case(case_of(folder, mesh='"own.msh"'))
    assert not preflight_errors(case.scene, case.runs["fe_full"], 1, "fe_full")
    again = fe_full.solve(case.scene, case.runs["fe_full"])
    assert again.cost.elements == first.cost.elements
    force = first.history["force"]
    assert force.max() > 5e4
    assert np.abs(again.history["force"] - force).max() < 1e-4 * force.max()


@pytest.mark.parametrize(
    "more, complaint",
    [
        ({"mesh": '"no.msh"'}, 'run.fe_full.mesh: no file "no.msh"'),
        ({"mesh": '"own.msh"', "error_twin": "true"}, "leave error_twin out"),
        ({"mesh": '"own.msh"', "window_ahead": '"60 mm"'}, "leave window_ahead and window_behind out"),
        ({"mesh": '"own.msh"', "mesh_digest": '"0123"'}, "other content than is stated"),
        ({"mesh": '"own.msh"', "mesh_unit": '"inch"'}, "mesh_unit"),
    ],
)
def test_a_case_that_cannot_be_is_refused(run, more, complaint):
    with pytest.raises(CaseError, match=complaint):
        load_case(case_of(run[0], **more))


def test_a_mesh_that_cannot_be_run_is_refused_before_the_run(run):
    folder, _ = run
    content = (folder / "own.msh").read_bytes()
    (folder / "bad.msh").write_bytes(content.replace(b'"wheel base"', b'"wheel foot"'))
    case = load_case(case_of(folder, mesh='"bad.msh"'))
    assert "the wheel has no base" in preflight_errors(case.scene, case.runs["fe_full"], 1, "fe_full")[0]


def rewritten(folder, change):
    """The exported mesh with changed points and groups, as other.msh. change : of points (n, 3) [m], wheel's nodes"""
    run = read_tagged(folder / "run")
    points = run.fields.points.copy()
    change(points, np.unique(run.fields.cells[run.fields.region == 2]))
    write_by_meshio(folder / "other.msh", replace(run, fields=replace(run.fields, points=points)))


def _raise(points, wheel):
    points[:, 2] += 5e-3


def _turn_inside_out(points, wheel):
    points[:, 1] *= -1


def _another_radius(points, wheel):
    points[wheel, 2] *= 1.2


def _sideways(points, wheel):
    points[wheel, 1] += 10e-3


@pytest.mark.parametrize(
    "change, more, complaint",
    [
        (_turn_inside_out, {}, r"folded or flat cell .* at \(.*\) mm, and \d+ more: .* inside out"),
        (_another_radius, {}, r"of \d+ nodes of the wheel's contact surface lie up to .* give \[scene.wheel\]"),
        (_raise, {}, r"stands \+(5|4.99) mm above its height on the case's crossing .* give \[scene.crossing\]"),
        (_sideways, {}, r"\d+ of \d+ nodes of the wheel's contact surface lie beside the case's wheel"),
        (lambda points, wheel: None, {"end": '"500 mm"'}, "reaches from x = .* the wheel runs from 300 to 500 mm"),
        (
            lambda points, wheel: None,
            {"element_size": '"2 mm"'},
            'element_size says 2 mm.* give element_size = "4.6 mm"',
        ),
        (lambda points, wheel: None, {"mesh_unit": '"mm"'}, "reach|radius"),
    ],
)
def test_a_mesh_that_does_not_fit_the_case_is_refused_before_the_run(run, change, more, complaint):
    folder, _ = run
    rewritten(folder, change)
    case = load_case(case_of(folder, mesh='"other.msh"', **more))
    (error,) = preflight_errors(case.scene, case.runs["fe_full"], 1, "fe_full")
    assert re.search(complaint, error), error


def test_a_study_of_element_sizes_does_not_take_a_mesh_of_one_size(run):
    folder, _ = run
    with pytest.raises(CaseError, match="run.fe_full.mesh has one element size"):
        run_at(case_of(folder, mesh='"own.msh"'), {}, 3e-3, folder / "3mm", print)


def test_a_file_of_other_content_is_another_case(run):
    """The path may change, the content may not, also between reading the case and meshing."""
    folder, _ = run
    shutil.copy(folder / "own.msh", folder / "moved.msh")
    cases = [load_case(case_of(folder, mesh=f'"{name}.msh"')) for name in ("own", "moved")]
    marks = [fingerprint("fe_full", case.scene, case.runs["fe_full"]) for case in cases]
    assert digest(marks[0]) == digest(marks[1])
    prepare_folder(folder / "begun", marks[0])
    rewritten(folder, lambda points, wheel: np.multiply(points, 1 + 1e-9, out=points))
    shutil.copy(folder / "other.msh", folder / "moved.msh")
    later = load_case(case_of(folder, mesh='"moved.msh"'))
    mark = fingerprint("fe_full", later.scene, later.runs["fe_full"])
    with pytest.raises(RunFolderError, match="mesh_digest"):
        prepare_folder(folder / "begun", mark, restart=True)
    assert "has changed since the case was read" in preflight_errors(cases[1].scene, cases[1].runs["fe_full"], 1, "")[0]
