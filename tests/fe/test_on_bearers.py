"""A crossing on bearers under the explicit model: momentum and energy of wheel, mesh and beam, the beam by another
scheme under the same force, restart, and what the other models hand over."""

from dataclasses import replace

import numpy as np
import pytest
from mpi4py import MPI

from rail_fem.case.casefile import load_case
from rail_fem.fe.diagnostics import outcome_on_beam
from rail_fem.fe.meshing import make_mesh
from rail_fem.fe.passage import at_rest, build_passage
from rail_fem.fe.run import Run
from rail_fem.fe.running import running_of
from rail_fem.run.form import CASTING, PANEL
from rail_fem.settings.explicit import FeSettings
from tests.fe.test_restart import assert_goes_on, steps

SCENE = load_case("nose_transfer").scene.replace_si(bearers=PANEL.replace_si(casting=CASTING, voided=(1,)))
SETTINGS = FeSettings(element_size=5e-3, start=0.37, end=0.43, beam_reach=3.0, history_interval=1e-5, field_frames=1)
STEPS = 350


@pytest.fixture(scope="module")
def made():
    running = running_of(SCENE, SETTINGS)
    return running, make_mesh(SCENE, SETTINGS, running)


def new_run(made, folder=None, scene=SCENE, start=None) -> Run:
    running, (mesh, _, datum) = made
    passage = build_passage(MPI.COMM_WORLD, scene, SETTINGS, running, mesh, datum, start)
    return Run(MPI.COMM_WORLD, scene, SETTINGS, passage, folder, None)


@pytest.fixture(scope="module")
def ran(made):
    """A run over the first contact of the nose, momentum before each step, and energies at each tenth."""
    run = new_run(made)
    run.begin()
    momenta, energies = [momentum(run)], [run.dynamics.energies()]
    for k in range(STEPS):
        run._step()
        momenta.append(momentum(run))
        if k % 10 == 9:
            energies.append(run.dynamics.energies())
    return run, np.array(momenta), energies


def momentum(run) -> tuple[float, float]:
    """Momentum upwards of wheel, sprung mass and beam [kg m/s]; force of the ground on the beam at the middle of the
    last step, as the scheme has it [N]."""
    p, s, track = run.passage, run.dynamics.structure, run.passage.track
    one = np.zeros(len(track.position))
    one[track.beam.first] = 1.0
    one[[bearer.own for bearer in track.beam.bearers]] = 1.0
    wheel = s.mass[p.on_wheel] @ s.v.reshape(-1, 3)[p.on_wheel, 2] + p.axle.added_mass * p.axle.velocity[2]
    sprung = p.sprung.mass * p.sprung.velocity[2]
    beam = track.beam
    mass, damping, stiffness = (one @ dense(band) for band in (beam.mass, beam.damping, beam.stiffness))
    return wheel + sprung + mass @ track.velocity, stiffness @ track.position, damping @ track.velocity


def dense(band: np.ndarray) -> np.ndarray:
    """(n, n) of a symmetric band (n, b)."""
    full = np.diag(band[:, 0])
    for k in range(1, band.shape[1]):
        full += np.diag(band[:-k, k], k) + np.diag(band[:-k, k], -k)
    return full


def test_wheel_and_beam_alone_have_the_momentum(ran):
    """Weight and ground change it and nothing else does: the mesh of the crossing weighs nothing beside its beam."""
    run, momenta, _ = ran
    (moved, springs, dampers), dt = momenta.T, run.dt
    # Newmark's mean of the spring forces, 1/4 1/2 1/4, and of the dampers
    ground = -(springs[:-2] + 2 * springs[1:-1] + springs[2:]) / 4 - (dampers[1:-1] + dampers[2:]) / 2
    weight = run.scene.static_wheel_load
    assert np.abs(np.diff(moved)[1:] - dt * (ground - weight)).max() < 1e-9 * weight * dt * STEPS
    mesh = run.passage.crossing.mesh_mass * np.ptp(np.diff(run.recorder.history()["crossing_height"])) / 1e-5
    assert mesh > 1e6 * 1e-9 * weight * dt * STEPS  # what it would have otherwise


def test_energies_balance_on_a_beam_as_on_a_rigid_mass(ran, made):
    """Of the bodies, beam included, and of the contact: both as the same wheel and mesh have them on one mass."""
    drift = {}
    fixed = new_run(made, scene=SCENE.replace_si(bearers=None))
    fixed.begin()
    others = [fixed.dynamics.energies()]
    for k in range(STEPS):
        fixed._step()
        if k % 10 == 9:
            others.append(fixed.dynamics.energies())
    for name, energies in (("beam", ran[2]), ("mass", others)):
        drift[name] = [np.ptp([one[what] for one in energies]) for what in ("balance", "contact_loss")]
    assert drift["beam"] == pytest.approx(drift["mass"], rel=0.1)
    assert abs(ran[0].passage.track.work) > 10 * drift["beam"][0]


def test_the_beam_is_where_another_scheme_puts_it_under_the_same_force(ran):
    """The implicit midpoint rule in full matrices over the rows of the history, each with its mean force."""
    run, track = ran[0], ran[0].passage.track
    history = run.recorder.history()
    x = np.r_[run.passage.running.start, history["x"]]
    u, w = track.start.position.copy(), track.start.velocity.copy()
    mass, damping, stiffness = map(dense, (track.beam.mass, track.beam.damping, track.beam.stiffness))
    found, time = [], np.r_[0.0, history["time"]]
    for k, force in enumerate(history["force"]):
        step = time[k + 1] - time[k]
        load = -force * track.beam.force_at((x[k] + x[k + 1]) / 2)
        system = 2 / step * mass + damping + step / 2 * stiffness
        middle = np.linalg.solve(system, 2 / step * mass @ w - stiffness @ u + load)
        u, w = u + step * middle, 2 * middle - w
        found.append(track.beam.force_at(x[k + 1]) @ u)
    moved = history["crossing_height"] - history["crossing_height"][0]
    assert np.abs(np.array(found) - history["crossing_height"]).max() < 0.01 * np.ptp(moved)


def test_a_restarted_run_on_bearers_is_the_run_that_went_on(made, tmp_path):
    live, again = (new_run(made, tmp_path) for _ in range(2))
    live.begin()
    steps(live, 150)
    assert_goes_on(live, again, 30)
    assert live.recorder.beam.shape[0] > 2 and live.passage.track.lost > 0


def test_a_hanging_bearer_and_a_casting_are_told_as_by_the_light_models(ran):
    """Columns, peaks and table of the beam; what hangs carries nothing."""
    told = outcome_on_beam(ran[0], ran[0].recorder.history())
    of = {one.number: one for one in told.bearers}
    assert of[1].ballast_force == 0.0 and of[1].state == "voided" and of[0].ballast_force > 10e3
    moment = told.columns["bending_moment"]
    assert told.peaks["bending_moment"].value >= np.abs(moment).max() > 1e3
    lever = CASTING.foot_depth / CASTING.second_moment
    np.testing.assert_allclose(told.columns["foot_stress"], moment * lever, rtol=1e-12)


def test_a_pass_that_begins_in_motion_goes_on_with_its_beam(made):
    """Height and rate under the wheel are those that are handed over; wheel and sprung mass have their own."""
    running = made[0]
    rest = at_rest(SCENE, SETTINGS, running)
    moving = rest.beam._replace(position=1.2 * rest.beam.position, velocity=0.5 * rest.beam.position / 1e-3)
    start = replace(rest, resting=False, axle=-0.2, sprung=-0.05, beam=moving, foundation=-moving.height(running.start))
    run = new_run(made, start=start)
    run.begin()
    assert [run.passage.axle.velocity[2], run.passage.sprung.velocity[2]] == [-0.2, -0.05]
    for _ in range(20):
        run._step()
    history, rate = run.recorder.history(), moving.rise(running.start, running.speed)
    expected = moving.height(running.start) + rate * history["time"][0]
    assert history["crossing_height"][0] == pytest.approx(expected, abs=0.02 * abs(rate * history["time"][0]))
    assert abs(rate) > 0.1
