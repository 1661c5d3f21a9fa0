"""Figures of a run: what they show is where it is, and what is not there is said in words."""

import itertools
import os
import re
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import matplotlib.image
import numpy as np
import pytest
from matplotlib.transforms import Bbox

from geometry.meshing.blocks import mesh_grid
from rail_fem.passes.pass_result import pressure_peaks
from rail_fem.result.events import lost_contact, settling_end, stated_peaks
from rail_fem.result.fields import field_file, read_fields
from rail_fem.result.result import PassResult, PatchSummary, Peak
from rail_fem.result.trust import largest_internal
from rail_fem.show.energies import energies_figure
from rail_fem.show.fields import FieldsError, cut_at, depth_below, faces_from_above, read_crossing
from rail_fem.show.figures import HISTORIES, draw_run, field_figures
from rail_fem.show.force import force_figure
from rail_fem.show.histories import creep_figure, patches_figure
from rail_fem.show.panels import Panel, new_panels
from rail_fem.show.plan import cut_in_strips, plan_figure, view_box
from rail_fem.show.section import section_figure
from rail_fem.show.stress import kept_frames, loaded_frame, residual, stress_figure, under_load
from rail_fem.show.style import lettering
from tests.rail_fem.surrogate_run import (
    MOST,
    SETTLE,
    WORST,
    bump,
    surrogate_history,
    surrogate_mesh,
    surrogate_strain,
    write_fields,
    write_run,
)
from tests.rail_fem.test_scene import make_scene
from tests.ranks import HANGS

ROOT = Path(__file__).resolve().parent.parent.parent
STRAIN_TITLES = "plastic_strain_plan", "plastic_strain_section"
STRAIN = {f"{title}.png" for title in STRAIN_TITLES}
PIXEL = 1.0  # boxes that meet share none
NAMES = {"creep.png", "force.png", "energies.png", "stress_section.png", "mesh.png"} | STRAIN


def words(figure) -> str:
    """Everything that a figure says."""
    legends = [axes.get_legend() for axes in figure.axes if axes.get_legend()]
    texts = [text for axes in figure.axes for text in (axes.title, axes.xaxis.label, axes.yaxis.label, *axes.texts)]
    texts += (
        [text for legend in legends for text in legend.get_texts()]
        + list(figure.texts)
        + ([figure._suptitle] if figure._suptitle else [])
    )
    return " ".join("\n".join(text.get_text() for text in texts).split())


def colours(path: Path) -> tuple[tuple[int, int], int]:
    """Height and width of a picture [pixels], and how many colours it has."""
    pixels = (255 * matplotlib.image.imread(path)[..., :3]).astype(np.int64)
    return pixels.shape[:2], len(np.unique(pixels @ [65536, 256, 1]))


def area(polygon: np.ndarray) -> float:
    y, z = polygon.T
    return 0.5 * abs(y @ np.roll(z, -1) - z @ np.roll(y, -1))


def run_alone(*command: str) -> subprocess.CompletedProcess:
    """A process of its own, without a display."""
    environment = {name: value for name, value in os.environ.items() if name not in ("DISPLAY", "WAYLAND_DISPLAY")}
    return subprocess.run(
        [sys.executable, *command], cwd=ROOT, env=environment, capture_output=True, text=True, timeout=HANGS
    )


# ---- the pictures themselves


@pytest.mark.parametrize("direction", ["facing", pytest.param("trailing", marks=pytest.mark.validate)])
def test_all_figures_are_wide_enough_to_read_need_no_display_and_leave_matplotlib_as_it_was(tmp_path, direction):
    """Nor VTK."""
    write_run(tmp_path, direction)
    code = f"""
import sys, numba, matplotlib
before = matplotlib.rcParams.copy()  # a dict of them would look for a backend, and import pyplot for that
from rail_fem.show.figures import draw_run
heavy = [m for m in sys.modules if m.startswith(("vtk", "pyvista")) or m == "matplotlib.pyplot"]
print(*sorted(path.name for path in draw_run({str(tmp_path)!r})), heavy, before == matplotlib.rcParams.copy())
"""
    answer = run_alone("-W", "error::RuntimeWarning", "-c", code)
    assert answer.stdout.split() == [*sorted(NAMES), "[]", "True"], answer.stderr
    drawn = list((tmp_path / "figures").iterdir())
    assert {path.name for path in drawn} == NAMES
    for path in drawn:
        (_, width), count = colours(path)
        assert width == 1800 and count > 50, path.name


def test_title_names_crossing_wheel_speed_direction_and_fault(tmp_path):
    result = write_run(tmp_path, fault="unstable at step 7")
    said = words(force_figure(result, "my_case"))
    for part in (
        "my_case",
        "1:10.75",
        "P8-worn",
        "75 mph",
        "121 km/h",
        "facing",
        "86.1 kN",
        "THIS RUN FAILED: unstable at step 7",
    ):
        assert part in said


# ---- positions and values


@pytest.mark.parametrize("title", ["", "of many words " * 20])
def test_titles_and_legends_cover_no_other(tmp_path, title):
    """Boxes as drawn. The legend of the view from above lay on the title, and wing's words on nose's over stresses."""
    result = replace(write_run(tmp_path), title=title)
    with lettering():
        figures = {name: draw(result, "run") for name, draw in HISTORIES.items() if name not in ("patches", "passes")}
        figures |= field_figures(tmp_path, result, "run")
        for name, figure in figures.items():
            figure.draw_without_rendering()
            parts = [figure._suptitle, *(axes.title for axes in figure.axes if axes.get_title())]
            parts += [axes.get_legend() for axes in figure.axes if axes.get_legend()]
            boxes = [part.get_window_extent() for part in parts]
            shared = (Bbox.intersection(one, two) for one, two in itertools.combinations(boxes, 2))
            assert not any(box is not None and min(box.width, box.height) > PIXEL for box in shared), name


def test_peaks_are_those_after_the_settling(tmp_path):
    """The made-up force peaks while settling too: (1 + exp) times the load at 0.15 ms on the wing."""
    result = write_run(tmp_path)
    history = result.history
    after = history["time"] > SETTLE  # a row is the mean of the interval that it ends
    found = stated_peaks(result)["largest_force_wing"]
    assert found.value == history["force_wing"][after].max() < history["force_wing"].max()
    assert found.x == history["x"][after][history["force_wing"][after].argmax()]
    time, x = settling_end(result)
    assert time == SETTLE and x == pytest.approx(0.25 + 33.5 * SETTLE, rel=1e-12)
    assert f"largest {found.value / 1e3:.1f} kN at x = {found.x * 1e3:.1f} mm" in words(force_figure(result, "run"))


def test_stated_peak_outranks_the_sampled_one(tmp_path):
    result = write_run(tmp_path, peaks={"largest_force_nose": Peak(190.25e3, "N", x=0.3591)})
    assert "on the nose: largest 190.2 kN at x = 359.1 mm" in words(force_figure(result, "run"))


def test_lost_contact_is_counted_from_the_first_contact_on():
    force = np.array([0.0, 0.0, 50, 0.0, 0.0, 0.0, 80, np.nan, 0.0, 90, 0.0])
    time = np.arange(11.0)
    losses = lost_contact(time, 10 * time, force, static_load=100.0)
    assert [(loss.start, loss.end) for loss in losses] == [(3, 5), (8, 8), (10, 10)]
    assert [(loss.x_start, loss.x_end) for loss in losses] == [(30, 50), (80, 80), (100, 100)]
    assert lost_contact(time, time, np.zeros(11), 100.0) == []


def test_rigid_path_meets_the_wheel_where_settling_ends(tmp_path):
    result = write_run(tmp_path)
    middle = force_figure(result, "run").axes[1]
    run, rigid = (
        next(line for line in middle.lines if start in line.get_label())
        for start in ("wheel in this run", "rigid wheel")
    )
    x = 1e3 * (0.25 + 33.5 * SETTLE)
    # the run has a row there; the path is linear between 150 points 1.3 mm apart: bend (1/R of the path, < 0.1/m) *
    # spacing^2 / 8
    assert np.interp(x, *rigid.get_data()) == pytest.approx(
        np.interp(x, *run.get_data()), abs=1e3 * 0.1 * 1.4e-3**2 / 8 + 1e-9
    )


def test_stated_rigid_path_is_drawn_as_it_is(tmp_path):
    result = write_run(tmp_path, trust={"rigid_path": {"x": [0.25, 0.45], "height": [0.0, 1e-3]}})
    line = next(line for line in force_figure(result, "run").axes[1].lines if "rigid" in line.get_label())
    assert np.ptp(line.get_ydata()) == pytest.approx(1.0) and len(line.get_xdata()) == 2


def test_worst_surface_element_of_each_body_is_named_with_its_place(tmp_path):
    result, mesh = write_run(tmp_path), surrogate_mesh()
    said = words(plan_figure(result, read_crossing(tmp_path), "run"))
    strain, centre = surrogate_strain(mesh), mesh.points[mesh.cells].mean(axis=1)
    for i, body in enumerate(("wing", "nose")):
        worst = np.flatnonzero(mesh.region == i)[strain[mesh.region == i].argmax()]
        assert np.abs(centre[worst, :2] - WORST[body][:2]).max() < 2e-3  # within the element of 2.5 x 3 mm
        stated = re.search(rf"{body}, surface: (\S+) % at x = (\S+), y = (\S+) mm", said)
        exact = [100 * strain[worst], *(1e3 * centre[worst, :2])]
        # as many digits are said
        assert np.abs(np.array(stated.groups(), float) - exact) == pytest.approx(0, abs=0.0501)


def test_section_is_where_the_strain_is_largest_and_says_how_deep(tmp_path):
    """Worst elements are those of the top layer, 2.5 mm high: their middle is 1.25 mm deep."""
    result = write_run(tmp_path)
    fields = read_crossing(tmp_path)
    figure = section_figure(result, fields, "run")
    for body in ("wing", "nose"):
        assert f"{body}: section at x = {1e3 * fields.centre(fields.worst(body))[0]:.1f} mm" in words(figure)
    assert words(figure).count("1.25 mm below the surface") == 2


@pytest.mark.parametrize("x", [0.0, 0.011, 0.02, 0.0299])
def test_section_of_a_skewed_block_has_the_area_of_the_block(x):
    """Planes of a sheared grid: every section is 40 x 10 mm, also through nodes; round-off of 1e3 polygons."""
    mesh = mesh_grid(np.linspace(0, 0.03, 11), np.linspace(0, 0.04, 9), np.linspace(-0.01, 0, 6))
    # sheared: planes of nodes are oblique to x
    points = mesh.points + np.outer(mesh.points[:, 1], [0.3, 0, 0]) - [0.006, 0, 0]
    inside = (x > 0.006) & (x < 0.024)
    polygons, cut = cut_at(points, mesh.cells, x)
    assert len(polygons) == len(cut) and len(set(cut)) == len(cut)
    if inside:
        assert sum(map(area, polygons)) == pytest.approx(0.04 * 0.01, rel=1e-12)
        assert depth_below(polygons, np.array([0.02, -0.004])) == pytest.approx(0.004, rel=1e-12)
    straight, _ = cut_at(mesh.points, mesh.cells, x)
    assert sum(map(area, straight)) == pytest.approx(0.04 * 0.01, rel=1e-12)


def test_only_what_looks_upwards_is_seen_from_above():
    """A dovetail block: top 20 mm, base 30 mm wide; the flanks lean outwards and are seen, turned over they are not."""
    mesh = mesh_grid(np.linspace(0, 0.05, 6), np.linspace(-0.01, 0.01, 5), np.linspace(-0.02, 0, 5))
    plan = {}
    for sign in (1, -1):
        points = mesh.points.copy()
        points[:, 1] *= 1 - sign * 25 * points[:, 2] * (points[:, 2] < 0)
        faces, owner = faces_from_above(points, mesh.cells)
        plan[sign] = sum(area(points[face][:, :2]) for face in faces)
        assert (np.diff(points[faces, 2].mean(axis=1)) >= 0).all() and len(owner) == len(faces)
    assert plan[1] == pytest.approx(0.05 * 0.03, rel=1e-12)  # top and flanks, the shadow of the base
    assert plan[-1] == pytest.approx(0.05 * 0.02, rel=1e-12)  # top alone


def test_long_views_are_cut_in_strips_that_cover_them():
    strips = cut_in_strips(-900.0, 560.0, -40.0, 65.0)
    assert len(strips) == 4 and strips[0][0] == -900 and strips[-1][1] == 560
    assert all(before[1] == after[0] for before, after in zip(strips, strips[1:]))
    assert len(cut_in_strips(200.0, 560.0, -40.0, 65.0)) == 1


def test_view_shows_the_whole_mesh_where_nothing_happened():
    corners = np.array([[[0.0, 0], [10, 0], [10, 5], [0, 5]]])
    nowhere = (np.array([np.nan]), np.array([np.nan]))
    assert view_box(corners, np.array([False]), nowhere) == (0, 10, 0, 5)


# ---- what may be missing


def test_nothing_yielded_is_said(tmp_path):
    result, mesh = write_run(tmp_path), surrogate_mesh()
    write_fields(tmp_path / "fields" / "final.vtu", mesh, np.zeros(len(mesh.cells)))
    fields = read_crossing(tmp_path)
    assert "nothing has yielded" in words(plan_figure(result, fields, "run"))
    assert "no element of the crossing has yielded" in words(section_figure(result, fields, "run"))
    assert {path.name for path in draw_run(tmp_path)} == NAMES


def test_body_that_never_yielded_has_no_section(tmp_path):
    result, mesh = write_run(tmp_path), surrogate_mesh()
    strain = surrogate_strain(mesh)
    strain[mesh.region == 0] = 0.0
    write_fields(tmp_path / "fields" / "final.vtu", mesh, strain)
    said = words(section_figure(result, read_crossing(tmp_path), "run"))
    assert "nose: section" in said and "wing: section" not in said


@pytest.mark.parametrize("absent, present", [("wing", "nose"), ("nose", "wing")])
def test_body_that_the_wheel_never_touched_is_said(tmp_path, absent, present):
    history = surrogate_history()
    history[f"force_{absent}"] = np.zeros_like(history["force"])
    history[f"force_{present}"] = history["force"]
    result = write_run(tmp_path, history=history, transfer_x=float("nan"))
    said = words(force_figure(result, "run"))
    assert said.count("never touched") == 1 and "between wing and nose" not in said


def test_columns_that_a_model_does_not_resolve_are_left_out(tmp_path):
    full = surrogate_history()
    result = write_run(tmp_path, history={name: full[name] for name in ("time", "x", "force")})
    said = words(force_figure(result, "run"))
    assert "on the nose" not in said and "crossing height not resolved" in said
    assert "holds no energies" in words(energies_figure(result, "run"))


def test_empty_history_of_a_failed_run_is_said(tmp_path):
    write_run(
        tmp_path, history={"time": [], "x": []}, fault="the wheel starts inside the rail", transfer_x=float("nan")
    )
    assert {path.name for path in draw_run(tmp_path)} == NAMES - {"creep.png", "energies.png"}
    result = write_run(tmp_path / "again", history={"time": [], "x": []}, fault="the wheel starts inside the rail")
    assert "the history has no rows" in words(force_figure(result, "run")) and "inside the rail" in words(
        force_figure(result, "run")
    )


def test_force_that_is_zero_throughout_is_drawn(tmp_path):
    history = surrogate_history() | {name: np.zeros(600) for name in ("force", "force_wing", "force_nose")}
    write_run(tmp_path, history=history, transfer_x=float("nan"))
    remove(tmp_path / "fields" / "final.vtu", None)  # their figures, which the history does not enter, are words then
    assert {path.name for path in draw_run(tmp_path)} == NAMES


def test_last_frame_stands_in_for_final_fields(tmp_path):
    write_run(tmp_path)
    mesh, fields = surrogate_mesh(), tmp_path / "fields"
    (fields / "final.vtu").rename(fields / "frame_0003.vtu")
    write_fields(fields / "frame_0000.vtu", mesh, np.zeros(len(mesh.cells)))
    found = read_crossing(tmp_path)
    assert (
        found.source == "frame_0003.vtu"
        and found.plastic_strain.max() == bump(found.points[found.cells].mean(axis=1), "nose").max()
    )


def spoil_region(path, mesh):
    write_fields(path, mesh, surrogate_strain(mesh), region=None)


def spoil_strain(path, mesh):
    write_fields(path, mesh, np.full(len(mesh.cells), np.nan))


def spoil_bodies(path, mesh):
    write_fields(path, mesh, surrogate_strain(mesh), region=np.full(len(mesh.cells), 2, np.int32))


def cut_short(path, mesh):
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])


def remove(path, mesh):
    path.unlink()


@pytest.mark.parametrize(
    "spoil, said",
    [
        (remove, "no final.vtu"),
        (cut_short, "cannot be read"),
        (spoil_region, "region"),
        (spoil_strain, "not a number"),
        (spoil_bodies, "belongs to wing"),
    ],
)
def test_fields_that_cannot_be_drawn_are_named_in_the_figure(tmp_path, spoil, said):
    result = write_run(tmp_path)
    spoil(tmp_path / "fields" / "final.vtu", surrogate_mesh())
    with pytest.raises(FieldsError, match=said):
        read_crossing(tmp_path)
    for figure in field_figures(tmp_path, result, "run", STRAIN_TITLES).values():
        assert said in words(figure)


def test_largest_internal_energy_so_far_bridges_what_is_unknown():
    made = lambda elastic, plastic: {
        "time": np.arange(len(elastic)),
        "energy_elastic": np.array(elastic),
        "energy_plastic": np.array(plastic),
    }
    assert largest_internal(made([np.nan, 1, 3, 2], [0.0, 0, 1, 1])).tolist()[1:] == [1, 4, 4]
    assert np.isnan(largest_internal(made([np.nan] * 2, [np.nan] * 2))).all()


@pytest.mark.parametrize(
    "model, columns, drawn",
    [
        ("rigid_hertz", ("force", "energy_springs"), {"force.png", "energies.png"}),
        ("lumped", ("force",), {"force.png"}),
        ("p2_formula", None, set()),
    ],
)
def test_a_model_gets_no_pictures_of_what_it_does_not_resolve(tmp_path, model, columns, drawn):
    full = surrogate_history() | {"energy_springs": np.ones(600)}
    history = {"time": [], "x": []} if columns is None else {name: full[name] for name in ("time", "x", *columns)}
    PassResult(model, make_scene(), {}, history).save(tmp_path)
    assert {path.name for path in draw_run(tmp_path)} == drawn


def test_the_figure_says_where_it_settles_and_what_first_strikes(tmp_path):
    result = write_run(tmp_path)
    first = stated_peaks(result)["first_impact_on_nose"]
    said = words(force_figure(result, "run"))
    assert f"first impact on the nose: {first.value / 1e3:.1f} kN at x = {first.x * 1e3:.1f} mm" in said
    impact = stated_peaks(result)["impact_on_wheel"]
    assert f"impact on the wheel: {impact.value / 1e3:.1f} kN at x = {impact.x * 1e3:.1f} mm" in said
    assert "settling, until t = 2 ms: peaks and shares are those after it" in said
    assert first.x == pytest.approx(0.358, abs=1e-3) and result.transfer_x < first.x
    trailing = words(force_figure(write_run(tmp_path / "back", "trailing"), "run"))
    assert "first impact on the wing rail" in trailing


@pytest.mark.parametrize("model, of", [("rigid_hertz", "Hertz"), ("bem_passage", "half-space")])
def test_the_pressure_of_patches_is_said_to_be_elastic(model, of):
    patch = PatchSummary(0.01, 0.38, 0.0, "nose", max_pressure=6.8e9)
    result = PassResult(model, make_scene(), {}, surrogate_history(), patches=(patch,))
    assert patches_figure(result, "run").axes[0].get_ylabel() == f"elastic pressure\n({of}) [MPa]"
    assert list(pressure_peaks((patch,))) == ["elastic_pressure_nose"]


# ---- pyvista, in processes of its own


def test_pyvista_reads_the_fields_back(tmp_path):
    write_run(tmp_path)
    mesh = surrogate_mesh()
    code = f"""
import pyvista
m = pyvista.read({str(tmp_path / "fields" / "final.vtu")!r})
c = m.cell_data
volume = m.compute_cell_sizes(length=False, area=False)["Volume"][c["region"] == 0].sum()
print(m.n_cells, m.n_points, set(m.celltypes.tolist()), [int((c["region"] == i).sum()) for i in range(3)],
      c["plastic_strain"].max(), c["stress"].shape[1], m.point_data["displacement"].shape[1], volume)
"""
    answer = run_alone("-c", code)
    strain = surrogate_strain(mesh)
    counts = [int((mesh.region == i).sum()) for i in range(3)]
    start = f"{len(mesh.cells)} {len(mesh.points)} {{12}} {counts} {strain.max()} 6 3 "
    assert answer.stdout.startswith(start), answer.stdout + answer.stderr
    assert float(answer.stdout.split()[-1]) == pytest.approx(0.2 * 0.045 * 0.02, rel=1e-12)
    assert strain.max() > 0.8 * MOST["nose"]


def test_script_draws_in_three_dimensions_without_a_display(tmp_path):
    write_run(tmp_path)
    answer = run_alone("cases/plot_plastic_strain.py", str(tmp_path), "--wheel", "--magnify", "10")
    assert answer.returncode == 0, answer.stderr
    size, count = colours(tmp_path / "figures" / "plastic_strain_3d.png")
    assert size == (1000, 1600) and count > 200


def test_script_says_what_it_misses(tmp_path):
    answer = run_alone("cases/plot_plastic_strain.py", str(tmp_path))
    assert (
        answer.returncode == 1
        and "no such file; give the folder of a run" in answer.stderr
        and "Traceback" not in answer.stderr
    )


def test_creep_is_drawn_where_the_wheel_is_in_contact_and_has_no_empty_panel_where_a_model_knows_none(tmp_path):
    said = words(creep_figure(write_run(tmp_path), "run"))
    assert "largest +" in said and "friction 0.3 times the vertical force" in said and "longitudinal creep [%]" in said
    lost = {name: column for name, column in surrogate_history().items() if name != "creep_longitudinal"}
    without = creep_figure(write_run(tmp_path / "lost", history=lost), "run")
    assert len(without.axes) == 1 and "creep" not in words(without)


# ---- stresses


def test_stresses_are_shown_where_they_are_largest_and_where_steel_has_flowed_most(tmp_path):
    """The made-up stress is uniaxial, -2 GPa times the plastic strain along z: both rings are on the worst element."""
    write_run(tmp_path)
    fields = read_fields(field_file(tmp_path))
    for body in ("wing", "nose"):
        mine = fields.region == ("wing", "nose").index(body)
        largest = fields.plastic_strain[mine].max()
        panel = under_load(fields, body)
        assert panel.worst == pytest.approx(2e3 * largest, rel=1e-6)
        assert panel.values.max() == pytest.approx(panel.worst, rel=1e-6)
        assert np.abs(1e-3 * panel.at - WORST[body][1:]).max() < 2e-3 and panel.depth == pytest.approx(1.25, rel=1e-6)
        along = residual(fields, body, 0)
        assert along.worst == 0.0 and np.abs(along.at - panel.at).max() < 1e-9


def test_the_frame_under_load_is_that_in_which_the_body_carries_most(tmp_path):
    """Of three moments the nose carries most in the last, the wing in the second: at 6 ms and at 1.5 ms."""
    result = write_run(tmp_path)
    assert kept_frames(tmp_path) == [] and loaded_frame(result, tmp_path, "nose") is None
    mesh, times = surrogate_mesh(), (0.0, 1.5e-3, 3.3e-3)
    sets = [f'<DataSet timestep="{time}" file="frame_{k:04d}.vtu"/>' for k, time in enumerate(times)]
    for k in range(len(times)):
        write_fields(tmp_path / "fields" / f"frame_{k:04d}.vtu", mesh, surrogate_strain(mesh))
    (tmp_path / "fields" / "pass.pvd").write_text(f"<VTKFile><Collection>{''.join(sets)}</Collection></VTKFile>")
    assert [time for time, _ in kept_frames(tmp_path)] == list(times)
    assert loaded_frame(result, tmp_path, "wing").source == "frame_0001.vtu"
    assert loaded_frame(result, tmp_path, "nose").source == "frame_0002.vtu"


def test_a_wheel_that_may_still_press_is_said_beside_the_residual_stress(tmp_path):
    result = write_run(tmp_path, metal={"nose": {"unloaded": True}, "wing": {"unloaded": False}})
    said = words(stress_figure(result, tmp_path, "my_case"))
    assert said.count("the wheel may still press on it") == 1 and "stress along the track [MPa], tension +" in said


def test_round_off_is_drawn_as_no_trend():
    """123 kN that loses 0.1 N is a level line: its axis spans 1 % of it, about the same middle."""
    _, axes = new_panels(4.0)
    Panel("passes", "largest force [kN]", {"_force": ([30, 50], [123.0, 122.9999])}).draw(axes)
    low, high = axes.get_ylim()
    assert high - low == pytest.approx(1.23, rel=1e-3) and (low + high) / 2 == pytest.approx(122.99995)


def test_a_logarithmic_axis_of_less_than_ten_has_plain_numbers():
    """6 x 10^-1 beside 10^0 is wider than its room."""
    figure, axes = new_panels(4.0)
    Panel("radius", "strain", {"_strain": ([0.5, 2.0], [4.3, 130.0])}, log="xy").draw(axes)
    figure.canvas.draw()
    shown = [[label.get_text() for label in axis.get_ticklabels(which="both")] for axis in (axes.xaxis, axes.yaxis)]
    assert {"0.5", "1", "2"} <= set(shown[0]) and "^" not in str(shown[0]) and "10^" in str(shown[1])
