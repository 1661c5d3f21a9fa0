"""Each body of a pass weighs what the case says, its mesh included, whatever the mesh."""

import dataclasses
import re

import numpy as np
import pytest
from mpi4py import MPI

from rail_fem.fe.blocks import ElementSettings
from rail_fem.fe.domain import Domain
from rail_fem.fe.mass_scaling import brick
from rail_fem.fe.meshing import make_mesh
from rail_fem.fe.passage import build_passage, end_settling
from rail_fem.fe.plan.mass_scaling import CUBE, GAIN, PATCH_PART, SHARE, quasi_static_step, static_patch
from rail_fem.fe.running import running_of
from rail_fem.fe.state import VISCOUS_WORK
from rail_fem.fe.structure import Structure, cell_masses, critical_steps
from rail_fem.settings.explicit import FeSettings


def passage_of(scene, **settings):
    """A passage with its wheel let go, and what the wheel and the crossing weigh: nodes and added masses [kg]."""
    settings = FeSettings(**settings)
    running = running_of(scene, settings)
    mesh, _, datum = make_mesh(scene, settings, running)
    passage = build_passage(MPI.COMM_SELF, scene, settings, running, mesh, datum)
    end_settling(passage, scene, settings)
    domain = passage.dynamics.domain
    of_wheel = np.zeros(domain.n_nodes, bool)
    of_wheel[domain.cells[domain.region == 2].ravel()] = True
    mass = passage.dynamics.structure.mass
    return passage, mass[of_wheel].sum() + passage.axle.added_mass, mass[~of_wheel].sum() + passage.crossing.added_mass


@pytest.mark.parametrize(
    ("size", "start", "end"), [(5e-3, 0.31, 0.40), pytest.param(4e-3, 0.28, 0.40, marks=pytest.mark.validate)]
)
def test_wheel_and_crossing_weigh_what_the_case_says(scene, size, start, end):
    """To round-off, at any window and element size: half the wheelset, and the lumped track mass."""
    passage, wheel, crossing = passage_of(scene, element_size=size, start=start, end=end)
    assert wheel == pytest.approx(scene.vehicle.wheel_unsprung_mass, rel=1e-12)
    assert crossing == pytest.approx(scene.foundation.track_mass, rel=1e-12)
    assert passage.axle.mesh_mass > 1.5 * passage.axle.node_mass > 0  # clamped nodes alone are not the mesh


def test_a_mesh_heavier_than_its_body_is_refused(scene, made):
    """A track mass below the steel that is modelled: with both masses, and what to do."""
    light, none = (scene.replace_si(foundation={"track_mass": mass}) for mass in (2.0, 0.0))
    complaint = r"mesh of the crossing weighs \d+\.\d kg, more than the {} kg .* shorter window"
    with pytest.raises(ValueError, match=complaint.format("2.0")):
        scaled_passage(light, made)
    with pytest.raises(ValueError, match=complaint.format("0.0")):
        scaled_passage(none, made, mass_scaling="auto", scaled_elements="small")
    passage = scaled_passage(light, made, track_mass=False)
    crossing = passage.dynamics.structure.mass[~passage.on_wheel].sum()
    assert passage.crossing.added_mass == 0.0 and crossing == pytest.approx(passage.crossing.mesh_mass, rel=1e-12)


@pytest.fixture(scope="module")
def made(scene):
    """A short window's running and mesh, for every mass scaling alike."""
    settings = FeSettings(**WINDOW)
    running = running_of(scene, settings)
    return running, make_mesh(scene, settings, running)


WINDOW = {"element_size": 5e-3, "start": 0.31, "end": 0.40}


def scaled_passage(scene, made, **settings):
    running, (mesh, _, datum) = made
    settings = FeSettings(**WINDOW, **settings)
    passage = build_passage(MPI.COMM_SELF, scene, settings, running, mesh, datum)
    end_settling(passage, scene, settings)
    return passage


@pytest.mark.parametrize(
    ("factor", "elements"),
    [(1.0, "all"), (7.3, "all"), (25.0, "all"), ("auto", "all"), (7.3, "small"), (100.0, "small"), ("auto", "small")],
)
def test_bodies_weigh_and_turn_as_the_case_says_at_any_mass_scaling(scene, made, factor, elements):
    """The lumped masses give back what the meshes gain; the wheel's rotation has the case's inertia."""
    passage = scaled_passage(scene, made, mass_scaling=factor, scaled_elements=elements)
    mass, wheel = passage.dynamics.structure.mass, passage.on_wheel
    assert mass[wheel].sum() + passage.axle.added_mass == pytest.approx(scene.vehicle.wheel_unsprung_mass, rel=1e-12)
    assert mass[~wheel].sum() + passage.crossing.added_mass == pytest.approx(scene.foundation.track_mass, rel=1e-12)
    assert passage.dynamics.contact.wheel.inertia == scene.vehicle.wheel_spin_inertia
    assert mass.sum() == pytest.approx(sum(passage.scaling.meshes.values()), rel=1e-12)
    assert (passage.dynamics.contact.surfaces.inverse_mass > 0).all()


def test_the_stable_step_grows_with_the_root_of_the_factor(scene, made):
    """Frequencies of all modes fall alike, so the damping ratios at the highest stay what they were."""
    plain, heavy = (
        scaled_passage(scene, made, mass_scaling=factor, scaled_elements="all").dynamics for factor in (1.0, 16.0)
    )
    assert heavy.stable_step() == pytest.approx(4 * plain.stable_step(), rel=2e-3)
    assert heavy.structure.damping == pytest.approx(4 * plain.structure.damping, rel=2e-3)


def test_small_elements_alone_are_heavier_and_all_have_the_step(scene, made):
    """Each heavier element has the critical step that is asked for, to round-off, each other one a longer one and the
    mass of steel; the mesh' own step nearly follows, for a small part of the mass."""
    factor = 4.0
    plain = scaled_passage(scene, made, mass_scaling=1.0)
    passage = scaled_passage(scene, made, mass_scaling=factor, scaled_elements="small")
    s, scaling = passage.dynamics.structure, passage.scaling
    points = s.domain.reference.reshape(-1, 3)
    step = critical_steps(points, s.domain.cells, s.domain.region, s.steels)
    assert scaling.least_step == pytest.approx(np.sqrt(factor) * step.min(), rel=1e-12)
    ratio = cell_masses(points, s.domain.cells, s.domain.region, s.steels, scaling.least_step) / cell_masses(
        points, s.domain.cells, s.domain.region, s.steels, 0.0
    )
    small = step < scaling.least_step
    assert 0.1 < small.mean() < 0.99
    assert step[small] * np.sqrt(ratio[small]) == pytest.approx(scaling.least_step, rel=1e-12)
    assert np.array_equal(ratio[~small], np.ones((~small).sum()))
    limit = passage.dynamics.stable_step(1.0)
    assert 0.9 * scaling.least_step < limit and 1.4 < limit / plain.dynamics.stable_step(1.0) < 2.05
    assert scaling.added < 0.5 * (factor - 1) * sum(scaling.steel.values())


def test_bulk_viscosity_of_a_heavier_small_element_is_that_of_its_density(scene):
    """A cube that is compressed, its density multiplied: the same viscous work, to round-off."""
    steel = scene.materials.nose.steel()
    side, factor, dt = 1e-3, 9.0, 1e-8
    corners = brick(side, side)[0]
    cube = Domain(MPI.COMM_SELF, points=corners, cells=np.arange(8)[None], region=np.zeros(1, np.int64))
    own_step = critical_steps(corners, np.arange(8)[None], np.zeros(1, np.int64), [steel])[0]
    works = []
    for element in ("one-point", "full"):
        for kind in (
            {"steels": [dataclasses.replace(steel, density=factor * steel.density)]},
            {"steels": [steel], "least_step": np.sqrt(factor) * own_step},
        ):
            s = Structure(cube, settings=ElementSettings(element=element), **kind)
            s.v[:] = (-3.0 * corners).ravel() / side
            s.x += dt * s.v
            s.add_internal_force(dt)
            works.append((s.work[VISCOUS_WORK], s.mass.sum()))
    assert works[0][0] > 0
    for work, mass in works[1:]:
        assert work == pytest.approx(works[0][0], rel=2e-3) and mass == pytest.approx(works[0][1], rel=1e-12)


def test_small_elements_are_as_heavy_as_speed_and_body_allow(scene, made):
    """auto: waves under the wheel so many times as fast as it, the more the longer elements are in the patch; at
    walking pace a mesh may not gain more than a part of its body."""
    walking, line = (
        scaled_passage(scene.replace_si(speed=speed), made, mass_scaling="auto", scaled_elements="small").scaling
        for speed in ("2 mph", "125 mph")
    )
    patch, size = 2 * static_patch(scene).semi_x, CUBE * WINDOW["element_size"]
    assert size > PATCH_PART * patch and line.slowness == pytest.approx(
        np.sqrt(PATCH_PART * patch / size) / FeSettings().wave_ratio, rel=1e-3
    )
    assert quasi_static_step(scene, 1e-4, 14.0) == pytest.approx(1e-4 / (14 * scene.speed))
    assert walking.slowness < line.slowness
    gains = [(walking.meshes[name] - walking.steel[name]) / walking.bodies[name] for name in walking.meshes]
    assert 0.98 * GAIN < max(gains) <= GAIN and "of its body" in walking.why


@pytest.mark.parametrize(("elements", "factor", "body"), [("all", 60.0, "wheel"), ("small", 1e4, "crossing")])
def test_a_factor_with_which_a_mesh_outweighs_its_body_is_refused_with_the_largest_that_does_not(
    scene, made, elements, factor, body
):
    complaint = rf"mass_scaling {factor:g}: the mesh of the {body} would weigh .* at most ([\d.]+)"
    with pytest.raises(ValueError, match=complaint) as found:
        scaled_passage(scene, made, mass_scaling=factor, scaled_elements=elements)
    largest = float(re.search(r"at most ([\d.]+)", str(found.value))[1])
    passage = scaled_passage(scene, made, mass_scaling=largest, scaled_elements=elements)
    assert min(passage.axle.added_mass, passage.crossing.added_mass) >= 0
    # to a tenth of a factor, and a thousandth of the step where small elements are sought for
    with pytest.raises(ValueError, match="possible"):
        scaled_passage(scene, made, mass_scaling=1.003 * largest + 0.1, scaled_elements=elements)
    with pytest.raises(ValueError, match="at most 1 is possible"):
        scaled_passage(scene, made, mass_scaling=2.0, track_mass=False, scaled_elements=elements)


def test_auto_takes_less_at_higher_speed_and_never_more_than_its_share(scene, made):
    fast = scene.replace(speed="350 mph")
    factors = [
        scaled_passage(s, made, mass_scaling="auto", scaled_elements="all").scaling.factor for s in (scene, fast)
    ]
    assert 1.0 < factors[1] < 3.0 < 15.0 < factors[0]
    passage = scaled_passage(scene, made, mass_scaling="auto", scaled_elements="all")
    for group, name in ((passage.axle, "wheel"), (passage.crossing, "crossing")):
        assert group.mesh_mass <= SHARE * passage.scaling.bodies[name] * (1 + 1e-12)


def test_a_body_in_flight_answers_a_force_as_the_unscaled_one(scene, made):
    """The wheel alone, off the rail, under its static load for 200 steps: momentum over mass is weight times time over
    the case's mass, whatever the elements weigh."""
    for factor in (1.0, 25.0):
        passage = scaled_passage(scene, made, mass_scaling=factor)
        d, axle = passage.dynamics, passage.axle
        d.contact = None
        d.supports.links.clear()
        axle.load[:] = [0.0, 0.0, -1e5]
        d.structure.v[:], axle.velocity[:] = 0.0, 0.0
        dt = d.stable_step()
        for _ in range(200):
            d.step(dt)
        wheel = passage.on_wheel
        momentum = d.structure.mass[wheel] @ d.structure.v.reshape(-1, 3)[wheel, 2] + axle.added_mass * axle.velocity[2]
        assert momentum / scene.vehicle.wheel_unsprung_mass == pytest.approx(
            -1e5 * d.time / scene.vehicle.wheel_unsprung_mass, rel=1e-9
        )


def test_with_a_travelling_window_only_what_moves_in_it_is_held_against_the_body(scene, made):
    """Outside it the mesh is part of the rigid base. Bodies weigh the case's at any position: nodes that move, and the
    base with all others; a factor is possible that would make the whole mesh heavier than its body."""
    light = scene.model_copy(update={"foundation": scene.foundation.model_copy(update={"track_mass": 45.0})})
    with pytest.raises(ValueError, match="mesh of the crossing would weigh"):
        scaled_passage(light, made, mass_scaling=10.0)
    passage = scaled_passage(light, made, mass_scaling=10.0, window_ahead=0.02, window_behind=0.02)
    window, mass = passage.dynamics.window, passage.dynamics.structure.mass
    assert passage.crossing.mesh_mass > 45.0 > passage.crossing.moving_mass
    for offset in (0.0, 0.03, 0.06):
        window.advance(offset)
        moving = window.in_slabs & ~window.rigid
        assert mass[moving].sum() + passage.crossing.mass == pytest.approx(45.0, rel=1e-12)
        assert passage.crossing.mass > 0 and mass[moving].sum() <= passage.crossing.moving_mass
