import functools
import resource
from pathlib import Path

import numpy as np
import pytest

from geometry.meshing.quality import mesh_quality
from rail_fem.case import estimate
from rail_fem.case.casefile import load_case
from rail_fem.case.estimate import critical_step, estimate_run, impossible
from rail_fem.case.warnings import fe_warnings, scene_warnings
from rail_fem.fe.plan.mass_scaling import static_patch
from rail_fem.result.warning_records import record
from rail_fem.settings.explicit import FeSettings
from tests.rail_fem.test_scene import make_scene

SCENE = make_scene()


@functools.cache
def meshed(size: float, aspect: float, **changes):
    """Mesh over the nose transfer; it knows neither speed nor masses."""
    pytest.importorskip("dolfinx")
    running, meshing = pytest.importorskip("rail_fem.fe.running"), pytest.importorskip("rail_fem.fe.meshing")
    case = load_case("nose_transfer")
    change = {"element_size": size, "element_aspect": aspect, "wheel_element_ratio": 1.0} | changes
    settings = case.runs["fe_full"].model_copy(update=change)
    return meshing.make_mesh(case.scene, settings, running.running_of(case.scene, settings))[0]


def test_halving_the_element_size_costs_up_to_16_times():
    """Cells grow with the third power at most (less where the fine zone thins out), steps with the first."""
    coarse, fine = (estimate_run(SCENE, FeSettings(element_size=size)) for size in (1e-3, 0.5e-3))
    assert fine.steps / coarse.steps == pytest.approx(2, rel=1e-12)
    assert 2 < fine.cells / coarse.cells < 8


@pytest.mark.parametrize("part", ["wing", "nose", "wheel"])
def test_the_fastest_wave_of_all_three_steels_bounds_the_step(part):
    """A steel of a quarter of the density in one of them carries waves twice as fast as steel; one of four times the
    density holds nobody up."""
    plain = critical_step(SCENE, FeSettings())
    for factor, step in ((0.25, plain / 2), (4.0, plain)):
        steel = getattr(SCENE.materials, part)
        other = steel.model_copy(update={"density": factor * steel.steel().density})
        scene = SCENE.model_copy(update={"materials": SCENE.materials.model_copy(update={part: other})})
        # the grades' own speeds differ by 1e-4
        assert critical_step(scene, FeSettings()) == pytest.approx(step, rel=1e-3)


@pytest.mark.parametrize("size, aspect", [(6e-3, 1.0), (3e-3, 1.0), (3e-3, 2.0)])
def test_cells_and_step_are_right_to_a_factor_of_two(size, aspect):
    """Against the mesher itself, over the nose transfer."""
    mesh = meshed(size, aspect)
    case = load_case("nose_transfer")
    settings = case.runs["fe_full"].model_copy(
        update={"element_size": size, "element_aspect": aspect, "wheel_element_ratio": 1.0, "mass_scaling": 1.0}
    )
    estimate = estimate_run(case.scene, settings)
    assert 0.5 < estimate.cells / len(mesh.cells) < 2
    assert 0.5 < estimate.step / (settings.courant * mesh_quality(mesh).worst_step) < 2


@pytest.mark.parametrize(("size", "speed"), [(6e-3, "2 mph"), (3e-3, "2 mph"), (3e-3, "75 mph"), (3e-3, "300 mph")])
def test_the_step_with_heavier_small_elements_is_right_to_a_factor_of_two(size, speed):
    """From walking pace, where a body's mass is the bound, to where the wheel is nearly as fast as waves allow."""
    mesh = meshed(size, 1.0)
    from mpi4py import MPI

    from rail_fem.fe.mass_scaling import choose_scaling

    case = load_case("nose_transfer")
    change = {"element_size": size, "element_aspect": 1.0, "wheel_element_ratio": 1.0, "scaled_elements": "small"}
    settings = case.runs["fe_full"].model_copy(update=change | {"window_ahead": None, "window_behind": None})
    scene = case.scene.replace_si(speed=speed)
    steels = [getattr(scene.materials, name).steel() for name in ("wing", "nose", "wheel")]
    scaling = choose_scaling(scene, settings, steels, mesh, MPI.COMM_SELF)
    assert 0.5 < critical_step(scene, settings) / (settings.courant * scaling.least_step) < 2


def test_bodies_twice_as_deep_are_rigid_there_and_have_a_fifth_more_cells_and_the_same_step():
    """Sizes grow with depth: as many cells again would lie below the first 55 mm, nearly, at one size."""
    deep, shallow = meshed(3e-3, 1.0, rail_depth=0.110, wheel_depth=0.120), meshed(3e-3, 1.0)
    for mesh, depth in ((deep, 0.110), (shallow, 0.055)):
        rail = mesh.points[np.unique(mesh.cells[mesh.region != 2])]
        assert rail[:, 2].min() == pytest.approx(-depth, abs=1e-9)
        assert np.isclose(mesh.points[mesh.clamp, 2], -depth, atol=1e-9).any()
    assert len(deep.cells) < 5 / 4 * len(shallow.cells)
    assert mesh_quality(deep).worst_step == pytest.approx(mesh_quality(shallow).worst_step, rel=0.1)


def test_two_ranks_take_half_the_time_and_more_memory():
    """Of the steps; meshes are the root's."""
    one, two = (estimate_run(SCENE, FeSettings(), ranks) for ranks in (1, 2))
    assert two.wall_time - two.preparation == pytest.approx((one.wall_time - one.preparation) / 2)
    assert two.preparation == one.preparation and two.memory > one.memory


@pytest.mark.parametrize("size, peak, seconds", [(2e-3, 0.366e9, 8.1), (0.7e-3, 0.457e9, 20.2)])
def test_memory_and_time_of_a_short_run_are_those_that_were_measured(size, peak, seconds):
    """30 mm of the nose transfer, cubes, three steps: nearly all of it meshes and the start. Largest resident memory
    and processor time as measured; memory to a fifth, as the cells are known."""
    case = load_case("nose_transfer")
    change = {"element_size": size, "element_aspect": 1.0, "wheel_element_ratio": 1.0, "max_steps": 3}
    change |= {"end": case.runs["fe_full"].start + 0.03, "error_twin": False}
    estimate = estimate_run(case.scene, case.runs["fe_full"].model_copy(update=change))
    assert estimate.memory == pytest.approx(peak, rel=0.2) and 0.5 < estimate.wall_time / seconds < 2


def test_passes_take_their_number_of_steps():
    one, ten = (estimate_run(SCENE, FeSettings(passes=passes)) for passes in (1, 10))
    assert ten.wall_time - ten.preparation == pytest.approx(10 * (one.wall_time - one.preparation))


def test_too_little_memory_and_too_many_ranks_are_found_before_meshing(monkeypatch):
    monkeypatch.setattr(estimate, "available_memory", lambda: 2e9)
    assert "GB are free" in impossible(SCENE, FeSettings(element_size=0.1e-3))[0]
    monkeypatch.setattr(estimate, "available_memory", lambda: 1e18)
    assert "start fewer ranks" in impossible(SCENE, FeSettings(element_size=20e-3), ranks=10**6)[0]
    assert impossible(SCENE, FeSettings()) == []


def test_size_that_is_said_to_fit_does_fit(monkeypatch):
    monkeypatch.setattr(estimate, "available_memory", lambda: 2e9)
    error = impossible(SCENE, FeSettings(element_size=0.1e-3))[0]
    size = float(error.split()[-3]) * 1e-3
    assert impossible(SCENE, FeSettings(element_size=size)) == []


def test_available_memory_is_that_of_a_machine_or_what_a_shell_leaves():
    assert 1e7 < estimate.available_memory() < 1e14
    soft, hard = resource.getrlimit(resource.RLIMIT_AS)
    own = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    resource.setrlimit(resource.RLIMIT_AS, (own + 10**9, hard))
    try:
        assert 0.5e9 < estimate.available_memory() <= 1e9
    finally:
        resource.setrlimit(resource.RLIMIT_AS, (soft, hard))


@pytest.mark.parametrize("version", [1, 2])
def test_a_control_group_further_down_limits_what_is_free(tmp_path, version):
    """A queue's step: 8 GB for the job, 3 GB of them for the step, of which 2 are taken and half of that is cache."""
    groups, top = ("0::/job/step\n", tmp_path) if version == 2 else ("4:memory:/job/step\n", tmp_path / "memory")
    limit, used, stat, cache = estimate.CGROUP if version == 2 else estimate.CGROUP_1
    (top / "job" / "step").mkdir(parents=True)
    (top / "job" / limit).write_text("8000000000\n")
    (top / "job" / used).write_text("2000000000\n")
    assert estimate.group_memory(groups, tmp_path) == 6e9
    for name, text in ((limit, "3000000000\n"), (used, "2000000000\n"), (stat, f"anon 5\n{cache} 1000000000\n")):
        (top / "job" / "step" / name).write_text(text)
    assert estimate.group_memory(groups, tmp_path) == 2e9
    (top / "job" / "step" / limit).write_text("max\n" if version == 2 else "9223372036854771712\n")
    assert estimate.group_memory(groups, tmp_path) == 6e9 and estimate.group_memory("", tmp_path) == float("inf")


def test_static_patch_carries_the_static_load():
    """Hertz: mean pressure is two thirds of the largest."""
    patch = static_patch(SCENE)
    assert patch.max_pressure * patch.area * 2 / 3 == pytest.approx(SCENE.static_wheel_load, rel=1e-12)


def test_warnings_name_both_numbers():
    assert any("0.9 > 0.7" in warning for warning in scene_warnings(make_scene(friction=0.9)))
    assert any("6 elements of 4 mm" in warning for warning in fe_warnings(SCENE, FeSettings(element_size=4e-3)))
    assert any("penalty 50" in warning for warning in fe_warnings(SCENE, FeSettings(penalty=50)))
    (unheld,) = fe_warnings(SCENE, FeSettings(element_size=1e-3, hourglass=0))  # its energy, 0 %, would be good
    assert "hourglass 0 < 0.0003" in unheld and record(unheld).kind == "numerics"
    assert fe_warnings(SCENE, FeSettings(element_size=1e-3, hourglass=0, element="full")) == []
    assert fe_warnings(SCENE, FeSettings(element_size=1e-3)) == []


def test_mass_scaling_that_no_body_allows_is_refused_before_anything_is_meshed():
    """All elements of a mesh of 5 mm: 35 by the mesher. A window that travels lets a long crossing weigh little."""
    most = lambda factor, **more: impossible(SCENE, FeSettings(mass_scaling=factor, **more))
    assert "mass_scaling: with 10000 the meshes weigh more" in most(1e4)[0] and most(35.0) == most("auto") == []
    assert most(1e4, scaled_elements="small", element_size=2e-3) and not most(700.0, scaled_elements="small")
    light = SCENE.replace_si(foundation={"track_mass": 60.0})
    assert impossible(light, FeSettings(mass_scaling=30.0, start=0.0, end=1.5))
    travels = {"window_ahead": 0.06, "window_behind": 0.06}
    assert impossible(light, FeSettings(mass_scaling=30.0, start=0.0, end=1.5, **travels)) == []
