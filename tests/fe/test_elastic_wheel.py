"""A wheel's sector on the condensed rest of the wheel, held by the axle: invariants of its motion, and rest."""

import numpy as np
import pytest
from mpi4py import MPI

from bem.material import Elastic
from rail_fem.case.casefile import load_case
from rail_fem.fe.mass_scaling import choose_scaling
from rail_fem.fe.meshing import make_mesh
from rail_fem.fe.passage import build_passage, start_velocities
from rail_fem.fe.running import running_of
from rail_fem.fe.static_start import LOAD_ERROR, Relaxation, settle_in_place
from rail_fem.models import fe_full
from rail_fem.scene.wheel_body import WheelBody
from rail_fem.settings.explicit import FeSettings, FeWindowSettings
from rail_fem.settings.light import unfit_parts
from rail_fem.static_fe.wheel_base import condensed_wheel
from tests.fe.elastic_wheel import coarse_wheel, on_elastic_wheel

SETTINGS = FeSettings(element_size=5e-3, start=0.095, end=0.125, field_frames=1)


@pytest.fixture(scope="module")
def scene():
    return on_elastic_wheel(load_case("nose_transfer").scene)


@pytest.fixture(scope="module")
def bodies(scene):
    running = running_of(scene, SETTINGS)
    return running, make_mesh(scene, SETTINGS, running)


def passage_of(scene, bodies, behind=None):
    running, (mesh, _, datum) = bodies
    return build_passage(MPI.COMM_SELF, scene, SETTINGS, running, mesh, datum, behind=behind)


def lifted(scene, bodies):
    """The wheel in flight, 1 mm over the crossing, its modes in motion; suspension and foundation hold nothing up."""
    passage = passage_of(scene, bodies, coarse_wheel())
    d, axle = passage.dynamics, passage.axle
    d.structure.x.reshape(-1, 3)[passage.on_wheel, 2] += 1e-3
    start_velocities(d, passage.running, axle, passage.sprung)
    axle.rate[:] = 0.02 * np.cos(np.arange(len(axle.rate)))  # of mass 1: some 0.01 J in all
    d.impose()
    return passage


def test_the_wheel_in_flight_gains_the_momentum_of_its_load(scene, bodies):
    """Nodes, body and axle together, to round-off: the modes push the axle with what they take from it."""
    passage = lifted(scene, bodies)
    d, axle = passage.dynamics, passage.axle
    wheel = d.structure.mass[passage.on_wheel]

    def momentum() -> float:
        nodes = wheel @ d.structure.v.reshape(-1, 3)[passage.on_wheel, 2]
        behind = axle.body.momentum[2] @ axle.modes @ axle.rate
        return nodes + behind + (axle.added_mass + axle.body.weight) * axle.velocity[2]

    before, pushed, dt = momentum(), 0.0, d.stable_step()
    for _ in range(100):
        spring = sum(link.spring_force() + link.damper_force() for link in d.supports.links if link.a is passage.sprung)
        pushed += dt * (axle.load[2] - spring)
        d.step(dt)
    assert not d.contact.normal_force.any() and abs(axle.velocity[2]) > 1e-4
    assert momentum() - before == pytest.approx(pushed, abs=1e-10 * abs(wheel.sum()))
    assert axle.mesh_mass + axle.added_mass == pytest.approx(scene.vehicle.wheel_unsprung_mass, rel=1e-12)


def test_energy_in_flight_is_kept(scene, bodies):
    """Of modes, nodes and axle, to round-off: what the scheme keeps does not ask for small steps."""
    d = lifted(scene, bodies).dynamics
    dt = d.stable_step()
    d.step(dt)
    start = d.energies()
    for _ in range(60):
        d.step(dt)
        now = d.energies()
        assert now["balance"] == pytest.approx(start["balance"], abs=1e-11 * start["springs"])
    assert abs(now["lumped_kinetic"] - start["lumped_kinetic"]) > 1e-3


def test_the_first_six_functions_of_a_base_are_motions_of_a_rigid_body_beside_it_too():
    """What goes along with them does not deform: six parameters hold them at points of the sector, 3 mm from the
    tread, to round-off of terms of fifth power."""
    points = np.random.default_rng(5).uniform((-0.1, -0.06, 0.003), (0.1, 0.06, 0.06), (20, 3))
    turns = [np.cross(axis, points).ravel() for axis in np.eye(3)]
    motions = np.column_stack([np.tile(np.eye(3), (len(points), 1)), *turns])
    functions = coarse_wheel().at(points)[:, :6]
    left = functions - motions @ np.linalg.lstsq(motions, functions, rcond=None)[0]
    assert np.abs(left).max() < 1e-11 * np.abs(functions).max()


def test_the_wheel_at_rest_has_given_way_as_far_as_its_base_is_pressed(scene, bodies):
    """Modes at rest under the elements' forces, but for the lean that goes on when the load is carried; by Clapeyron
    the base's part of the approach is twice its energy over the load."""
    passage = passage_of(scene, bodies, coarse_wheel())
    found = settle_in_place(Relaxation(passage, scene))
    axle = passage.axle
    assert abs(found.error) < LOAD_ERROR
    d = passage.dynamics
    work = np.zeros(axle.size)
    axle.pack(d.structure.force, work)
    static = (work @ axle.decoupled.of_functions) / axle.frequencies**2
    assert axle.amplitude == pytest.approx(static, abs=0.05 * np.abs(static).max())
    assert 0 < 2 * axle.spring_energy() / passage.start.force < found.approach


def test_an_elastic_wheel_takes_the_step_of_a_rigid_one(scene, bodies):
    """Heavier small elements gain a part of the whole wheel, of which the base behind them is one."""
    running, (mesh, _, _) = bodies
    settings = SETTINGS.model_copy(update={"mass_scaling": "auto", "scaled_elements": "small"})
    of = lambda weight: choose_scaling(scene, settings, scene.materials.steels(), mesh, MPI.COMM_SELF, None, weight)
    rigid, elastic = of(0.0), of(coarse_wheel().weight)
    assert elastic.least_step == rigid.least_step > 0
    assert elastic.meshes["wheel"] < elastic.bodies["wheel"] < rigid.bodies["wheel"] - 200


def test_what_an_elastic_wheel_is_refused_for(scene):
    assert unfit_parts(scene, SETTINGS) == []
    assert "scene.wheel_body is for" in unfit_parts(scene, FeWindowSettings())[0]
    deep = SETTINGS.model_copy(update={"wheel_depth": 0.08})
    with pytest.raises(ValueError, match="rim is 65 mm deep, the wheel's mesh 80 mm: give a smaller wheel_depth"):
        fe_full.wheel_behind(scene, deep)
    with pytest.raises(ValueError, match="a wheel from a mesh file ends where it is held"):
        fe_full.wheel_behind(scene, SETTINGS.model_copy(update={"mesh": "wheel.msh"}))


def test_a_rim_that_ends_within_the_wheels_mesh_is_refused():
    steel = Elastic(206e9, 0.29)
    with pytest.raises(ValueError, match="the rim is 60 mm deep, the wheel's mesh 70 mm"):
        condensed_wheel(WheelBody(rim_depth="60 mm"), 0.425, 70e-3, 0.1, steel, 7850.0, 1e3)
