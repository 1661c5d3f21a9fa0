"""A restarted run is the run: every attribute of every object, to the last bit, at any moment."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from mpi4py import MPI

from rail_fem.casefile import load_case
from rail_fem.fe.contact import Contact
from rail_fem.fe.contact_kernel import Pairs
from rail_fem.fe.dynamics import Dynamics
from rail_fem.fe.meshing import make_mesh
from rail_fem.fe.passage import build_passage, running_of
from rail_fem.fe.recorder import Recorder
from rail_fem.fe.run import Run
from rail_fem.fe.start_state import resting
from rail_fem.fe.supports import Link, RigidGroup
from rail_fem.settings import FeSettings
from tests.rail_fem.test_readme import ROOT

OURS, NOT_OURS = ("rail_fem", "geometry", "bem"), ("dolfinx", "mpi4py")
SETTLE = 60e-6  # a hundred and some steps [s]
CASE = load_case(ROOT / "cases" / "nose_transfer.toml")
SETTINGS = FeSettings(element_size="5 mm", start="310 mm", end="400 mm", settle_time="60 us", history_interval="20 us", field_frames=1)


@pytest.fixture(scope="module")
def bodies():
    """Mesh and rigid path, which all runs share."""
    running = running_of(CASE.scene, SETTINGS)
    mesh, _, datum = make_mesh(CASE.scene, SETTINGS, running)
    return running, mesh, datum


def start_of(model: str, running):
    """fe_full begins at rest, fe_window in the middle of a pass; here that is made up."""
    rest = resting(CASE.scene, running.speed * float(running.slope(running.start)))
    return rest if model == "fe_full" else replace(rest, force=1.3 * rest.force, foundation=0.8 * rest.foundation, axle=-0.2, sprung=-0.05, crossing=-0.02, resting=False)


def new_run(model: str, bodies, folder) -> Run:
    running, mesh, datum = bodies
    return Run(MPI.COMM_WORLD, CASE.scene, SETTINGS, build_passage(MPI.COMM_WORLD, CASE.scene, SETTINGS, running, mesh, datum, start_of(model, running)), folder, None)


def differences(there: Any, here: Any, path: str = "run", seen: set | None = None) -> list[str]:
    """Paths of all attributes, entries and elements that are not bitwise equal; SCRATCH is passed over."""
    seen = set() if seen is None else seen
    if isinstance(there, np.ndarray):
        same = isinstance(here, np.ndarray) and (there.dtype, there.shape, there.tobytes()) == (here.dtype, here.shape, here.tobytes())
        return [] if same else [path]
    if isinstance(there, dict):
        return [path] if not isinstance(here, dict) or list(there) != list(here) else [d for k in there for d in differences(there[k], here[k], f"{path}[{k!r}]", seen)]
    if isinstance(there, (list, tuple)):
        if type(there) is not type(here) or len(there) != len(here):
            return [path]
        names = getattr(there, "_fields", range(len(there)))
        return [d for name, a, b in zip(names, there, here) if name not in getattr(there, "SCRATCH", ()) for d in differences(a, b, f"{path}.{name}", seen)]
    if type(there).__module__.split(".")[0] in OURS and hasattr(there, "__dict__"):
        if id(there) in seen:
            return []
        seen.add(id(there))
        kept = [name for name in vars(there) if name not in getattr(there, "SCRATCH", ())]
        return [d for name in kept for d in differences(getattr(there, name), getattr(here, name), f"{path}.{name}", seen)]
    if isinstance(there, (int, float, str, bool, type(None), np.generic)):
        return [] if there == here or (there != there and here != here) else [path]
    return [] if type(there).__module__.split(".")[0] in NOT_OURS or type(there) is type(here) else [path]


def steps(run: Run, count: int) -> None:
    """So many steps; wall times, which differ between two runs, are set back."""
    for _ in range(count):
        run._step()
    run.loop_time = run.dynamics.kernel_time = 0.0


@pytest.mark.parametrize("model", ["fe_full", "fe_window"])
def test_every_attribute_of_a_restarted_run_is_that_of_the_run_that_went_on(model, bodies, tmp_path):
    """Ten moments: before the first step, while settling, about the release, before and after rows, searches, checks; and again at the next moment."""
    live = new_run(model, bodies, tmp_path)
    release = int(np.ceil(SETTLE / live.dt))
    moments = [0, 1, 50, release - 1, release, release + 1, release + 40, 250, 301, 333, 360]
    for moment, later in zip(moments, moments[1:]):
        assert live.dynamics.step_count == moment and live.settled == (moment > release)
        live.save()
        again = new_run(model, bodies, tmp_path)
        again.resume()
        assert differences(live, again) == [], f"at step {moment}"
        for run in (live, again):
            steps(run, later - moment)
        assert differences(live, again) == [], f"at step {later}, restarted at step {moment}"
    assert live.recorder.rows and live.dynamics.contact.sums.any() and live.dynamics.structure.block_work.any()


FORGOTTEN = [(RigidGroup, "load"), (RigidGroup, "reaction"), (Link, "damping"), (Dynamics, "contact_normal"), (Contact, "sums"), (Pairs, "pressure"), (Recorder, "total"), (Run, "start_energies")]


def test_a_forgotten_attribute_is_found(bodies, tmp_path, monkeypatch):
    """The comparison above can fail: each of these left out of its STATE is named."""
    live = new_run("fe_window", bodies, tmp_path)
    steps(live, 180)
    live.save()
    for owner, name in FORGOTTEN:
        with monkeypatch.context() as patch:
            patch.setattr(owner, "STATE", tuple(kept for kept in owner.STATE if kept != name))
            again = new_run("fe_window", bodies, tmp_path)
            again.resume()
            assert any(path.endswith(f".{name}") for path in differences(live, again)), f"{owner.__name__}.{name}"
