"""The wheel begins at rest: the static contact is solved where it stands, and nothing moves when it is let go."""

from dataclasses import replace

import numpy as np
import pytest
from mpi4py import MPI

from rail_fem.case.casefile import load_case
from rail_fem.contact.rigid import release_position
from rail_fem.fe.dynamics import Dynamics
from rail_fem.fe.meshing import make_mesh
from rail_fem.fe.pass_supports import loaded_stiffness
from rail_fem.fe.passage import build_passage
from rail_fem.fe.plan.travelling_window import with_window
from rail_fem.fe.run import CHECKPOINT, STATIC_START, Run
from rail_fem.fe.running import running_of
from rail_fem.fe.start_state import from_rigid_hertz, resting
from rail_fem.fe.static_start import LOAD_ERROR, LOOK, Relaxation, settle_in_place
from rail_fem.models import fe_full, fe_window
from rail_fem.scene.scene import Material
from rail_fem.settings.explicit import FeSettings

SETTINGS = FeSettings(
    element_size=5e-3, start=0.095, end=0.125, history_interval=10e-6, field_frames=1, mass_scaling="auto"
)


@pytest.fixture(scope="module")
def bodies(scene):
    running = running_of(scene, SETTINGS)
    return running, make_mesh(scene, SETTINGS, running)


def passage_of(scene, bodies, **changes):
    running, (mesh, _, datum) = bodies
    return build_passage(MPI.COMM_SELF, scene, SETTINGS.model_copy(update=changes), running, mesh, datum)


class _Killed:
    """A listener of a run that ends it when it has heard of so many looks."""

    def __init__(self, looks: int) -> None:
        self.left = looks

    def before_the_first_step(self, says: str) -> None:
        self.left -= 1
        if self.left < 0:
            raise KeyboardInterrupt


def test_a_static_contact_that_was_cut_off_goes_on_to_the_same_bits(scene, bodies, tmp_path):
    """Twice, from the file of its last look; the pass' own file takes its place."""
    settings = SETTINGS.model_copy(update={"checkpoint_interval": 0.0})
    begin = lambda progress=None: Run(MPI.COMM_SELF, scene, settings, passage_of(scene, bodies), tmp_path, progress)
    straight = begin()
    straight.begin()
    (tmp_path / STATIC_START).unlink()
    for looks in (3, 2):
        with pytest.raises(KeyboardInterrupt):
            run = begin(_Killed(looks))
            run.resume()
            run.begin()
        assert (tmp_path / STATIC_START).is_file() and not (tmp_path / CHECKPOINT).exists()
    run = begin()
    run.resume()
    assert run.relaxation.dynamics.step_count == 5 * LOOK
    run.begin()
    assert run.static_approach == straight.static_approach and run.spent > 0
    one, other = run.dynamics.structure, straight.dynamics.structure
    assert all(np.array_equal(getattr(one, name), getattr(other, name)) for name in one.NODAL)
    assert np.array_equal(one.finite.state, other.finite.state) and run.start_energies == straight.start_energies
    run.save()
    assert (tmp_path / CHECKPOINT).is_file() and not (tmp_path / STATIC_START).exists()


def test_the_contact_carries_the_load_and_nothing_moves(scene, bodies):
    """Within the tolerance of the relaxation; masses and speeds are afterwards those of the pass."""
    passage = passage_of(scene, bodies)
    dynamics = passage.dynamics
    mass, told = dynamics.structure.mass.copy(), []
    found = settle_in_place(Relaxation(passage, scene), look=told.append)
    assert abs(found.error) < LOAD_ERROR and found.approach > 0
    assert "step 20, force off by -" in told[0] and f"step {found.steps - LOOK}, force" in told[-1]
    assert np.array_equal(dynamics.structure.mass, mass) and dynamics.time == 0.0 and dynamics.step_count == 0
    v = dynamics.structure.v.reshape(-1, 3)
    vertical = passage.running.speed * float(passage.running.slope(passage.running.start))
    assert (v[~passage.on_wheel] == 0.0).all() and np.ptp(v[passage.on_wheel, 2]) == 0.0
    assert v[passage.on_wheel, 2] == pytest.approx(vertical)
    energies = dynamics.energies()
    assert energies["wheel_damping"] == pytest.approx(0.0, abs=1e-9 * energies["elastic"])
    assert energies["internal_work_mismatch"] == pytest.approx(0.0, abs=1e-9 * energies["elastic"])


def test_the_static_contact_is_the_same_at_any_mass_scaling(scene, bodies):
    """Masses of the relaxation are its own: approach and plastic strain to the tolerance of the load; to round-off and
    in as many steps where small elements alone are heavier, for it begins from the masses of steel."""
    found, steps = [], []
    for factor, elements in ((1.0, "all"), (20.0, "all"), (20.0, "small")):
        passage = passage_of(scene, bodies, mass_scaling=factor, scaled_elements=elements)
        start = settle_in_place(Relaxation(passage, scene))
        found.append((start.approach, passage.dynamics.structure.finite.plastic_strain().max()))
        steps.append(start.steps)
    assert found[0] == pytest.approx(found[1], rel=3e-3)
    assert found[0] == pytest.approx(found[2], rel=1e-9) and steps[0] == steps[2]


@pytest.mark.parametrize("x", [0.095, 0.43])
def test_the_load_comes_from_below(scene, bodies, x, monkeypatch):
    """Steel keeps what it has yielded: a contact that for a moment carries more than the load leaves the dent of that.
    On the nose it yields far and lies on an edge."""
    settings = SETTINGS.model_copy(update={"start": x, "end": x + 0.03})
    running = running_of(scene, settings)
    mesh, _, datum = make_mesh(scene, settings, running)
    passage = build_passage(MPI.COMM_SELF, scene, settings, running, mesh, datum)
    forces, step = [], Dynamics.step

    def recorded(self, dt):
        step(self, dt)
        forces.append(-self.contact.force_on_rail()[2])

    monkeypatch.setattr(Dynamics, "step", recorded)
    settle_in_place(Relaxation(passage, scene))
    assert max(forces) < (1 + LOAD_ERROR) * passage.start.force


def test_an_elastic_approach_is_that_of_hertz_within_a_coarse_mesh(scene, bodies):
    """Tangent stiffness k of Hertz' contact: 1.5 F / k; elements of 5 mm hold two across the patch's half width, and
    wheel and rail of finite depth add to it."""
    elastic = scene.model_copy(update={"materials": scene.materials.model_copy(update={"wing": Material(grade="R8T")})})
    start = settle_in_place(Relaxation(passage_of(elastic, bodies), elastic))
    hertz = 1.5 * elastic.static_wheel_load / loaded_stiffness(elastic, bodies[0])
    assert start.approach == pytest.approx(hertz, rel=0.3)


def test_let_go_on_a_straight_path_the_wheel_stays_at_rest(scene, bodies, monkeypatch):
    """The force stays at the static load and the wheel at its height from the first row on; friction begins at none."""
    monkeypatch.setattr(fe_full, "make_mesh", lambda *given: bodies[1])
    result = fe_full.solve(scene, SETTINGS)
    force, height = result.history["force"], result.history["wheel_height"]
    # elements of 5 mm come and go beneath it: 7 %, 1.0 % in the mean; on the main job's 3.5 and 0.5 %
    assert np.abs(force / scene.static_wheel_load - 1).max() < 0.08
    assert abs(force.mean() / scene.static_wheel_load - 1) < 0.015
    assert np.ptp(height) < 3e-6


def test_a_start_in_motion_takes_up_its_velocities_at_once(scene, bodies):
    """What fe_window begins with: force of the start, velocities of the bodies as they are given."""
    running, (mesh, _, datum) = bodies
    rest = resting(scene, 0.0)
    start = replace(rest, force=1.2 * rest.force, axle=-0.2, sprung=-0.05, crossing=-0.02, resting=False)
    passage = build_passage(MPI.COMM_SELF, scene, SETTINGS, running, mesh, datum, start)
    run = Run(MPI.COMM_SELF, scene, SETTINGS, passage, None, None)
    run.begin()
    assert passage.axle.velocity[2] == -0.2 and passage.sprung.velocity[2] == -0.05
    assert passage.crossing.velocity[2] == -0.02
    run._step()
    force = -passage.dynamics.contact.force_on_rail()[2]
    assert force == pytest.approx(start.force, rel=0.05)  # the surface's nodes take up their velocity in this step


@pytest.mark.validate
def test_a_node_of_the_contact_that_goes_on_bouncing_does_not_keep_the_wheel_from_rest(scene):
    """Begun at 95 mm of a window to 700 mm, one rail node bounces for ever with 6e-5 of the load's work; the force has
    long been steady then."""
    settings = SETTINGS.model_copy(update={"element_size": 4e-3, "end": 0.7, "element": "full"})
    running = running_of(scene, settings)
    mesh, _, datum = make_mesh(scene, settings, running)
    passage = build_passage(MPI.COMM_SELF, scene, settings, running, mesh, datum)
    found = settle_in_place(Relaxation(passage, scene))
    assert abs(found.error) < 3e-3 and found.steps < 3000


def test_nodes_that_bounce_from_step_to_step_stand_at_their_middle():
    """Two nodes of the reference state's short window change sides in every step: 2.5 % of the axle's load up and down,
    for ever the same where looks are an even number of steps apart."""
    case = load_case("thesis/case_02")
    scene = case.scene
    settings = with_window(scene, case.runs["fe_window"])
    start = from_rigid_hertz(scene, fe_window.approach_of(settings), release_position(scene, settings))
    running = running_of(scene, settings)
    mesh, _, datum = make_mesh(scene, settings, running)
    passage = build_passage(MPI.COMM_SELF, scene, settings, running, mesh, datum, start)
    found = settle_in_place(Relaxation(passage, scene))
    assert abs(found.error) < LOAD_ERROR and found.steps < 1500
