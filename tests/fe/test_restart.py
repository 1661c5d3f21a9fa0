"""A restarted run is the run: every attribute of every object, to the last bit, at any moment."""

import re
import shutil
import tracemalloc
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from mpi4py import MPI

from geometry.meshing.blocks import mesh_box
from rail_fem.case.casefile import load_case
from rail_fem.fe.blocks import ElementBlocks, ElementSettings, material_table
from rail_fem.fe.checkpoint import _block_works, _restore_block_works, load_checkpoint, save_checkpoint
from rail_fem.fe.contact.contact import Contact
from rail_fem.fe.contact.pairs import Pairs
from rail_fem.fe.dynamics import Dynamics
from rail_fem.fe.meshing import make_mesh
from rail_fem.fe.passage import build_passage
from rail_fem.fe.recorder import Recorder
from rail_fem.fe.rolling_wheel import RollingWheel
from rail_fem.fe.run import Run
from rail_fem.fe.running import running_of
from rail_fem.fe.start_state import resting
from rail_fem.fe.supports import Link, RigidGroup
from rail_fem.files.sealed import SealError
from rail_fem.models import fe_full
from rail_fem.scene.steel import MN13
from rail_fem.settings.explicit import FeSettings
from tests.fe.bodies import structure_of
from tests.fe.elastic_wheel import coarse_block, coarse_wheel, on_elastic_wheel

OURS, NOT_OURS = ("rail_fem", "geometry", "bem"), ("dolfinx", "mpi4py")
SETTLE = 60e-6  # a hundred and some steps [s]
CASE = load_case("nose_transfer")
SETTINGS = FeSettings(
    element_size="5 mm", start="310 mm", end="400 mm", settle_time="60 us", history_interval="20 us", field_frames=1
)


@pytest.fixture(scope="module")
def bodies():
    """Mesh and rigid path, which all runs share."""
    running = running_of(CASE.scene, SETTINGS)
    mesh, _, datum = make_mesh(CASE.scene, SETTINGS, running)
    return running, mesh, datum


def start_of(model: str, running):
    """fe_full begins at rest, fe_window in the middle of a pass; here that is made up."""
    at_rest = resting(CASE.scene, running.speed * float(running.slope(running.start)))
    return (
        at_rest
        if model == "fe_full"
        else replace(
            at_rest,
            force=1.3 * at_rest.force,
            foundation=0.8 * at_rest.foundation,
            axle=-0.2,
            sprung=-0.05,
            crossing=-0.02,
            resting=False,
        )
    )


def new_run(model: str, bodies, folder, settings: FeSettings = SETTINGS, scene=CASE.scene, **condensed) -> Run:
    running, mesh, datum = bodies
    start = start_of(model, running)
    passage = build_passage(MPI.COMM_WORLD, scene, settings, running, mesh, datum, start, **condensed)
    return Run(MPI.COMM_WORLD, scene, settings, passage, folder, None)


def differences(there: Any, here: Any, path: str = "run", seen: set | None = None) -> list[str]:
    """Paths of all attributes, entries and elements that are not bitwise equal; SCRATCH is passed over."""
    seen = set() if seen is None else seen
    if isinstance(there, np.ndarray):
        same = isinstance(here, np.ndarray) and (there.dtype, there.shape, there.tobytes()) == (
            here.dtype,
            here.shape,
            here.tobytes(),
        )
        return [] if same else [path]
    if isinstance(there, dict):
        return (
            [path]
            if not isinstance(here, dict) or list(there) != list(here)
            else [d for k in there for d in differences(there[k], here[k], f"{path}[{k!r}]", seen)]
        )
    if isinstance(there, (list, tuple)):
        if type(there) is not type(here) or len(there) != len(here):
            return [path]
        names = getattr(there, "_fields", range(len(there)))
        return [
            d
            for name, a, b in zip(names, there, here)
            if name not in getattr(there, "SCRATCH", ())
            for d in differences(a, b, f"{path}.{name}", seen)
        ]
    if type(there).__module__.split(".")[0] in OURS and hasattr(there, "__dict__"):
        if id(there) in seen:
            return []
        seen.add(id(there))
        kept = [name for name in vars(there) if name not in getattr(there, "SCRATCH", ())]
        return [
            d for name in kept for d in differences(getattr(there, name), getattr(here, name), f"{path}.{name}", seen)
        ]
    if isinstance(there, (int, float, str, bool, type(None), np.generic)):
        return [] if there == here or (there != there and here != here) else [path]
    return [] if type(there).__module__.split(".")[0] in NOT_OURS or type(there) is type(here) else [path]


def steps(run: Run, count: int) -> None:
    """So many steps; wall times, which differ between two runs, are set back."""
    for _ in range(count):
        run._step()
    run.loop_time = run.spent = run.dynamics.kernel_time = 0.0


def assert_goes_on(live: Run, again: Run, count: int) -> None:
    """A new run that reads what a live one has saved is that one, now and after so many steps of both."""
    live.save()
    again.resume()
    assert differences(live, again) == [], f"at step {live.dynamics.step_count}"
    for run in (live, again):
        steps(run, count)
    assert differences(live, again) == [], f"{count} steps after the restart"


@pytest.mark.parametrize("model", ["fe_full", "fe_window"])
def test_every_attribute_of_a_restarted_run_is_that_of_the_run_that_went_on(model, bodies, tmp_path):
    """Ten moments: before the first step, while settling, about the release, before and after rows, searches, checks;
    and again at the next moment. The models differ in how they begin alone: for fe_full the moments about that."""
    live = new_run(model, bodies, tmp_path)
    release = int(np.ceil(SETTLE / live.dt))
    moments = [0, 1, 50, release - 1, release, release + 1, release + 40, 250, 301, 333, 360]
    if model == "fe_full":
        moments = [0, release, release + 1, 250]
    for moment, later in zip(moments, moments[1:]):
        assert live.dynamics.step_count == moment and live.settled == (moment > release)
        assert_goes_on(live, new_run(model, bodies, tmp_path), later - moment)
    assert live.recorder.rows and live.dynamics.contact.sums.any() and live.dynamics.structure.block_work.any()


def test_a_restarted_run_of_the_full_element_is_the_run_that_went_on(bodies, tmp_path):
    settings = SETTINGS.model_copy(update={"element": "full"})
    live, again = (new_run("fe_full", bodies, tmp_path, settings) for _ in range(2))
    steps(live, 180)
    assert_goes_on(live, again, 20)
    assert live.dynamics.structure.finite.state.any()


def test_a_restarted_run_on_an_elastic_wheel_is_the_run_that_went_on(bodies, tmp_path):
    scene = on_elastic_wheel(CASE.scene)
    live, again = (new_run("fe_full", bodies, tmp_path, SETTINGS, scene, behind=coarse_wheel()) for _ in range(2))
    steps(live, 150)
    assert_goes_on(live, again, 20)
    assert live.passage.axle.amplitude.any()


def test_a_restarted_run_on_an_elastic_casting_is_the_run_that_went_on(bodies, tmp_path):
    """While a travelling window goes on: what rides on the casting is weighed again, and the facets that came with it
    are near to no more searches."""
    changed = {"foot_depth": 0.1, "window_ahead": 0.06, "window_behind": 0.06, "mass_scaling": 25.0}
    settings = SETTINGS.model_copy(update=changed)
    below = coarse_block(settings, bodies[1])
    live, again = (new_run("fe_window", bodies, tmp_path, settings, below=below) for _ in range(2))
    began = live.dynamics.window.active.copy()
    steps(live, 90)
    assert (live.dynamics.window.active != began).any()
    live.save()
    again.resume()
    assert differences(live, again) == []
    for run in (live, again):
        steps(run, 40)
    assert differences(live, again) == [] and live.passage.crossing.amplitude.any()


@pytest.mark.parametrize("element", ["one-point", "full"])
def test_a_restarted_run_of_a_steel_with_back_stresses_is_the_run_that_went_on(element, bodies, tmp_path):
    """They are state: in the file, to the last bit."""
    soft = {"yield_stress": "20 MPa", "modulus": ["60 GPa", "5 GPa"], "recovery": [600, 20], "mixing": [1.0, 0.2]}
    steel = {"grade": "Mn13", "cyclic": soft}
    scene = CASE.scene.replace(materials={"wing": steel, "nose": steel})
    settings = SETTINGS.model_copy(update={"element": element})
    live, again = (new_run("fe_full", bodies, tmp_path, settings, scene) for _ in range(2))
    steps(live, 180)
    assert live.dynamics.structure.finite.back.any()
    assert_goes_on(live, again, 20)


FORGOTTEN = [
    (RigidGroup, "load"),
    (RigidGroup, "reaction"),
    (Link, "damping"),
    (RollingWheel, "spin"),
    (Contact, "sums"),
    (Pairs, "pressure"),
    (Recorder, "total"),
    (Run, "start_energies"),
]


def test_a_forgotten_attribute_is_found(bodies, tmp_path, monkeypatch):
    """The comparison above can fail: each of these left out of its STATE is named."""
    live = new_run("fe_window", bodies, tmp_path)
    steps(live, 180)
    live.save()
    for owner, name in FORGOTTEN:
        monkeypatch.setattr(owner, "STATE", tuple(kept for kept in owner.STATE if kept != name))
    again = new_run("fe_window", bodies, tmp_path)
    again.resume()
    found = differences(live, again)
    for owner, name in FORGOTTEN:
        assert any(path.endswith(f".{name}") for path in found), f"{owner.__name__}.{name}"


# ---- the whole model, from its folder

WHOLE = SETTINGS.model_copy(update={"max_steps": 240, "field_frames": 3})


def bits(folder, result) -> dict:
    """All that a result says, less what the clock and the machine say."""
    trust = [row for row in result.trust["rows"] if "share of a step" not in row["name"]]
    history = {name: values.tobytes() for name, values in result.history.items()}
    plain = {
        name: repr(getattr(result, name))
        for name in ("peaks", "patches", "energies", "error_estimate", "warnings", "transfer_x")
    }
    return (
        history
        | plain
        | {
            "trust": repr(trust),
            "pass.pvd": (folder / "fields" / "pass.pvd").read_text(),
            "fields": (folder / "fields" / "final.vtu").read_bytes(),
        }
    )


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    folder = tmp_path_factory.mktemp("whole")
    return folder, fe_full.solve(CASE.scene, WHOLE, folder)


def test_stops_before_and_after_the_last_step_change_no_bit_of_the_result(whole, tmp_path, monkeypatch):
    """A chain: by few steps, which bound the pass and not the static contact that it begins from; half way, after the
    last restart file; while the final fields are written; and with the result on the disk."""
    folder, result = whole
    assert fe_full.solve(CASE.scene, WHOLE.model_copy(update={"max_steps": 60}), tmp_path).cost.steps == 60
    goes_on = Run._step, Run._frame

    class Stopped(Exception):
        pass

    def stop_half_way(run):
        goes_on[0](run)
        if run.dynamics.step_count == 130:
            run.save()
        if run.dynamics.step_count == 150:
            raise Stopped

    def stop_before_final_fields(run, name, kind="f4"):
        if name == "final.vtu":
            raise Stopped
        goes_on[1](run, name, kind)

    for name, stop in (("_step", stop_half_way), ("_frame", stop_before_final_fields)):
        with monkeypatch.context() as patch, pytest.raises(Stopped):
            patch.setattr(Run, name, stop)
            fe_full.solve(CASE.scene, WHOLE, tmp_path, restart=True)
    for _ in range(2):
        again = fe_full.solve(CASE.scene, WHOLE, tmp_path, restart=True)
        assert bits(tmp_path, again) == bits(folder, result)
    assert again.cost.steps == 240


def test_collection_lists_each_moment_once(whole):
    text = (whole[0] / "fields" / "pass.pvd").read_text()
    times, names = re.findall(r'timestep="([^"]+)"', text), re.findall(r'file="([^"]+)"', text)
    assert len(set(times)) == len(times) and len(set(names)) == len(names) and names[-1] == "final.vtu"
    assert all((whole[0] / "fields" / name).is_file() for name in names)


def test_mesh_that_comes_out_the_same_goes_on_and_another_is_refused(whole, tmp_path):
    shutil.copytree(whole[0], tmp_path, dirs_exist_ok=True)
    (tmp_path / "mesh.npz").unlink()
    assert bits(tmp_path, fe_full.solve(CASE.scene, WHOLE, tmp_path, restart=True)) == bits(*whole)
    other = WHOLE.model_copy(update={"hourglass": 0.02})
    with pytest.raises(SealError, match=r"mesh.npz: belongs to another case: remove it"):
        fe_full.solve(CASE.scene, other, tmp_path, restart=True)
    (tmp_path / "mesh.npz").unlink()
    with pytest.raises(ValueError, match=r"checkpoint.npz: belongs to another case and another mesh: remove it"):
        fe_full.solve(CASE.scene, other, tmp_path, restart=True)
    (tmp_path / "checkpoint.npz").write_bytes(b"PK")
    with pytest.raises(
        ValueError, match=r"checkpoint.npz: damaged, .*: remove it and --restart begins at the first step"
    ):
        fe_full.solve(CASE.scene, other, tmp_path, restart=True)


def test_works_of_blocks_stay_where_they_were_on_another_partition():
    """Blocks cut anew: the whole is kept, and only cells of blocks that had yielded count as yielded; cut as before,
    every bit."""
    rng, cells = np.random.default_rng(3), 100
    coarse = SimpleNamespace(
        domain=SimpleNamespace(comm=MPI.COMM_SELF),
        finite=blocks_of(np.arange(cells)),
        block_work=rng.uniform(1.0, 2.0, (4, 3)),
    )
    coarse.block_work[[0, 3]] = 0.0
    rows = _block_works(coarse)
    same = SimpleNamespace(finite=blocks_of(np.arange(cells)), block_work=np.zeros((4, 3)))
    _restore_block_works(same, rows)
    assert same.block_work.tobytes() == coarse.block_work.tobytes()
    halves = [np.arange(50), np.arange(50, cells)]
    anew = [SimpleNamespace(finite=blocks_of(half), block_work=np.zeros((2, 3))) for half in halves]
    for part, half in zip(anew, halves):
        _restore_block_works(part, rows[half])
    works = np.concatenate([part.block_work for part in anew])
    assert np.allclose(works.sum(axis=0), coarse.block_work.sum(axis=0), rtol=1e-14)
    # cells 0-31, 32-49, 50-81, 82-99; the blocks had 0-31, 32-63, 64-95, 96-99
    assert (works[:, 0] > 0).tolist() == [False, True, True, True]


def blocks_of(cells: np.ndarray) -> ElementBlocks:
    return ElementBlocks(
        np.zeros((len(cells), 8), np.int64), np.zeros(len(cells), np.int64), material_table([MN13], ElementSettings())
    )


def test_restart_file_takes_little_memory_to_write_and_read(tmp_path):
    """Beside what it holds, the elements' states in their order and some columns of them."""
    dynamics, path = Dynamics(structure_of(mesh_box((1.0, 1.0, 1.0), (20, 20, 20)))), tmp_path / "checkpoint.npz"
    tracemalloc.start()
    for move in (save_checkpoint, load_checkpoint):
        tracemalloc.reset_peak()
        held = tracemalloc.get_traced_memory()[0]
        move(path, dynamics, dynamics, {})
        assert tracemalloc.get_traced_memory()[1] - held < 1.9 * path.stat().st_size
    tracemalloc.stop()
