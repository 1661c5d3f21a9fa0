"""The models p2_formula, lumped and rigid_hertz on real scenes."""

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from bem.exact.hertz import contact_stiffness, point_contact
from geometry.path.wheel_path import wheel_path
from geometry.surfaces.crossing import CastCrossing
from rail_fem.case.casefile import CaseError, load_case
from rail_fem.contact.contact_table import contact_table, hertz_constants, patch_sizes
from rail_fem.contact.intersection import equivalent_paraboloid
from rail_fem.models import bem_passage, lumped, p2_formula, rigid_hertz
from rail_fem.passes.pass_result import patch_steps, patches_at, pressure_peaks
from rail_fem.passes.plastic_indentation import contacts_of
from rail_fem.passes.validity import hertz_flags
from rail_fem.passes.vertical_dynamics import integrate
from rail_fem.passes.vertical_pass import run_pass
from rail_fem.result.events import flights
from rail_fem.result.result import PatchSummary
from rail_fem.settings.light import LumpedSettings, P2Settings, RigidHertzSettings
from tests.order import assert_order

ROOT = Path(__file__).resolve().parents[2]
NOSE = {"start": 0.095, "end": 0.54}


@pytest.fixture(scope="module")
def scene():
    return load_case("thesis/case_02").scene


def test_tabulated_hertz_is_hertz():
    radii = np.exp(np.random.default_rng(0).uniform(-5, 2, (20, 2)))
    exact = np.array([contact_stiffness(*pair, 1e11) for pair in radii])
    # linear between 240 ratios: (log step)^2 / 8
    np.testing.assert_allclose(hertz_constants(radii, 1e11), exact, rtol=3e-5)
    sizes = [(p.semi_x, p.semi_y) for p in (point_contact(1e5, *pair, 1e11) for pair in radii)]
    np.testing.assert_allclose(patch_sizes(np.full(20, 1e5), radii, 1e11), sizes, rtol=1e-4)


def test_equivalent_paraboloid_of_a_paraboloid_is_itself():
    """The error falls with the sampling, unevenly as its edge lies between samples: the gap is linear there."""
    radii, depth = (0.4, 0.05), np.array([1e-4])
    errors = []
    for n in (50, 100, 200):
        along, across = np.linspace(-14e-3, 14e-3, n), np.linspace(-8e-3, 8e-3, n)
        gap = along[None, :, None] ** 2 / (2 * radii[0]) + across[None, None, :] ** 2 / (2 * radii[1])
        found, _, asymmetry = equivalent_paraboloid(gap, gap.min(axis=2), gap.min(axis=1), along, across, depth)
        assert asymmetry[0] < 1e-12
        errors.append(np.abs(found[0] / radii - 1).max())
    assert errors[-1] < 5e-4 and errors[-1] < errors[0]


def test_a_wheel_that_runs_downhill_is_pushed_on(scene):
    """On the falling wing the frictionless contact pushes along the path by force times fall, that of the rigid path: a
    trailing wheel climbs there."""
    at = np.array([0.28, 0.30])
    fall = -wheel_path(scene.wheel.shape, CastCrossing(scene.crossing.ratio), at, scene.wheel.radius).slope
    assert (fall > 2e-3).all()
    found = rigid_hertz.solve(scene, RigidHertzSettings(start=0.2, end=0.32)).history
    force, along = (np.interp(at, found["x"], found[name]) for name in ("force", "force_longitudinal"))
    assert along / force == pytest.approx(fall, rel=0.02)


def test_a_linear_spring_rests_where_hertz_rests_under_the_static_load(scene):
    """And yields there as much to a little more load: it is the tangent."""
    table, constant, load = contact_table(scene, 0.095, 0.12, 1e-3), 9e10, scene.static_wheel_load
    at = np.array([0.1, 0.11])
    laws = [lumped.one_contact(table, constant, name, load)(at) for name in ("hertz", "linear")]
    static_height = lambda law, force: law.height - (force / law.stiffness) ** (1 / law.exponent)
    assert static_height(laws[1], load) == pytest.approx(static_height(laws[0], load), abs=1e-12)
    softer = [(static_height(law, load) - static_height(law, 1.001 * load)) for law in laws]
    assert softer[1] == pytest.approx(softer[0], rel=1e-3)


def test_rigid_hertz_starts_at_rest_under_the_static_load(scene):
    result = rigid_hertz.solve(scene, RigidHertzSettings(**NOSE))
    first = result.history["x"] < 0.12  # the path is level there
    np.testing.assert_allclose(result.history["force"][first], scene.static_wheel_load, rtol=2e-3)
    np.testing.assert_allclose(
        result.history["force"], result.history["force_wing"] + result.history["force_nose"], rtol=1e-12
    )


def test_rigid_hertz_finds_the_reference_pass_of_the_fe_model(scene):
    """fe_full on 0.5 mm: first impact 191.3 +- 0.3 kN at 402.1 mm, wing 126.6 +- 1.3 kN at 261.3 mm, nose 216.1 +- 1.3
    kN at 567.7 mm, load on the nose from 356.5 mm on (docs/speed.md).

    The bands are what a model without waves, with indentation as rolled over a half-space, can claim: first impact 5 %,
    wing 10 %, behind the flight 15 %; positions half a patch.
    """
    result = rigid_hertz.solve(scene, RigidHertzSettings(start=0.095, end=0.66))
    assert result.peaks["first_impact_on_nose"].value == pytest.approx(191.3e3, rel=0.05)
    assert result.peaks["first_impact_on_nose"].x == pytest.approx(0.4021, abs=8e-3)
    assert result.peaks["largest_force_wing"].value == pytest.approx(126.6e3, rel=0.1)
    assert result.peaks["largest_force_wing"].x == pytest.approx(0.2613, abs=8e-3)
    assert result.peaks["largest_force_nose"].value == pytest.approx(216.1e3, rel=0.15)
    assert result.peaks["largest_force_nose"].x == pytest.approx(0.5677, abs=8e-3)
    assert result.transfer_x == pytest.approx(0.3565, abs=2e-3)
    both = (result.history["force_wing"] > 0) & (result.history["force_nose"] > 0)
    assert both.any()  # two contacts at once
    assert {"plastic", "edge"} <= {flag["what"] for flag in result.trust["validity"]}


def test_the_nose_pushes_the_wheel_away_from_its_gauge_face(scene):
    """Contact lies on the gauge side of the nose, which rises towards the field side (+ y): the wheel is pushed towards
    the track's middle (- y)."""
    found = rigid_hertz.solve(scene, RigidHertzSettings(**NOSE)).history
    alone = (found["force_nose"] > 0.99 * found["force"]) & (found["force"] > 50e3) & (found["contact_y"] < -15e-3)
    assert alone.sum() > 10 and (found["force_lateral"][alone] < 0).all()


def test_contacts_beside_their_patch_are_flagged_and_those_in_its_middle_are_not(scene):
    """Two of four loaded rows lie beside the middle of their patch: the flag says 50 %."""
    run = SimpleNamespace(x=np.arange(5) * 1e-3, force=np.array([[1e5, 1e5, 1e5, 1e5, 0.0], [0.0] * 5]))
    found = {}
    for name, asymmetry in (("middle", np.zeros(5)), ("beside", np.array([0.0, 0.9, 0.8, 0.0, 0.9]))):
        table = SimpleNamespace(
            nearest=lambda x: np.arange(len(x)),
            asymmetry=np.stack([asymmetry, asymmetry]),
            angle=np.zeros((2, 5)),
            radii=np.full((2, 5, 2), 0.4),
        )
        patches = (PatchSummary(0.0, 0.0, 0.0, "wing", 1e-2, 1e-2, 8e-5, 1e5, 1e8),)
        found[name] = [flag for flag in hertz_flags(scene, table, run, patches) if flag["what"] == "edge"]
    assert (
        not found["middle"]
        and len(found["beside"]) == 1
        and "50%" in found["beside"][0]["reason"]
        and "90%" in found["beside"][0]["reason"]
    )


def test_lift_off_says_how_often_and_how_long_as_the_flights_of_the_result_do(scene):
    nominal = scene.replace(
        wheel=scene.wheel.replace(profile="P8"), foundation=scene.foundation.replace(stiffness="80 kN/mm")
    )
    result = rigid_hertz.solve(nominal, RigidHertzSettings(), judged=False)
    (told,) = [line for line in result.warnings if line.startswith("lift-off")]
    found = flights(result)
    assert f"{len(found)} time(s), {sum(f.duration for f in found) * 1e3:.3g} ms in all" in told and len(found) > 1


def test_the_largest_elastic_pressure_is_that_of_the_whole_path(scene):
    """A nose is narrower where it is struck first than where the larger landing follows."""
    nominal = scene.replace(wheel=scene.wheel.replace(profile="P8"))
    settings = RigidHertzSettings()
    table = contact_table(nominal, *settings.window(nominal), settings.path_spacing)
    run = run_pass(nominal, settings, contacts_of(nominal, settings, table))
    told = pressure_peaks(patches_at(table, run, patch_steps(table, run, nominal.static_wheel_load)))
    every = pressure_peaks(patches_at(table, run, list(range(0, len(run.time), 10))))
    for name, peak in every.items():
        assert told[name].value >= 0.999 * peak.value, name
    assert abs(told["elastic_pressure_nose"].time - run.time[np.argmax(run.force[1])]) > 1e-3


def test_elastic_contact_is_harder_and_harder_steel_too(scene):
    strong = load_case("thesis/case_14").scene
    peak = lambda s, **options: (
        rigid_hertz.solve(s, RigidHertzSettings(**NOSE, **options)).peaks["largest_force_nose"].value
    )
    assert peak(scene) < peak(strong) < peak(scene, plastic_indentation=False)


@pytest.mark.parametrize(
    "model, settings, law",
    [
        (lumped, LumpedSettings, {}),
        (rigid_hertz, RigidHertzSettings, {}),
        (rigid_hertz, RigidHertzSettings, {"indentation_law": "fully plastic"}),
    ],
)
def test_pass_is_second_order_in_the_step_and_the_balance_falls_with_it(scene, model, settings, law):
    """Up to where the wheel is on the wing alone: the nose's contact begins inside a step."""
    runs = [
        model.solve(scene, settings(start=0.095, end=0.30, time_step=step, history_interval=step, **law))
        for step in (40e-6, 20e-6, 10e-6, 1.25e-6)
    ]
    at = np.linspace(0.1, 0.29, 40)
    curve = lambda r: np.interp(at, r.history["x"], r.history["wheel_height"])
    errors = [np.abs(curve(r) - curve(runs[-1])).max() for r in runs[:-1]]
    # linear interpolation in x adds its own second order
    assert_order([40e-6, 20e-6, 10e-6], errors, expected=2, slack=0.3)
    work = np.ptp(runs[2].history["energy_external"])
    assert np.abs(runs[2].history["energy_balance"]).max() < 1e-3 * work


def test_a_step_too_coarse_for_the_forces_is_told(scene):
    coarse, fine = (lumped.solve(scene, LumpedSettings(start=0.095, end=0.7, time_step=step)) for step in (1e-3, 1e-5))
    assert any(w.startswith("time_step: moves forces by some") for w in coarse.warnings)
    assert not any("time_step" in w for w in fine.warnings)


def test_positions_too_far_apart_for_the_forces_are_told(scene):
    """By lumped, which told nothing: of a joint of 8 mrad 270 kN every 20 mm, 248 every millimetre."""
    joint = scene.replace(crossing={"family": "joint", "dip_angle": "8 mrad"}, speed="30 m/s")
    far, near = (
        lumped.solve(joint, LumpedSettings(start=-0.3, end=0.3, path_spacing=spacing)) for spacing in (0.02, 1e-3)
    )
    assert abs(far.peaks["largest_force"].value / near.peaks["largest_force"].value - 1) > 0.05
    assert any(w.startswith("path_spacing: moves forces by some") for w in far.warnings)
    assert not any("path_spacing" in w for w in near.warnings)


def test_facing_and_trailing_cases_meet_the_same_transfer(scene):
    back = load_case("thesis/case_05")
    facing, trailing = (
        rigid_hertz.solve(scene, RigidHertzSettings(**NOSE)),
        rigid_hertz.solve(back.scene, back.runs["rigid_hertz"]),
    )
    assert trailing.history["x"][0] > trailing.history["x"][-1]
    assert facing.transfer_x == pytest.approx(trailing.transfer_x, abs=10e-3)
    assert trailing.peaks["largest_force_nose"].value < facing.peaks["largest_force_nose"].value  # thesis 7.5.4


def test_a_pass_run_backwards_returns_to_its_start(scene):
    """Without dampers and plastic indentation the trailing pass that begins with the facing one's end, velocities
    turned about, is the same motion backwards.

    The implicit midpoint rule has this symmetry exactly; round-off of 1e-15 m a step grows through two impacts, to less
    than a nanometre.
    """
    settings = RigidHertzSettings(**NOSE, plastic_indentation=False)
    free = scene.replace_si(vehicle={"primary_damping": 0.0}, foundation={"damping": 0.0})
    contacts = contacts_of(free, settings, contact_table(free, 0.095, 0.54, settings.path_spacing))
    there = run_pass(free, settings, contacts)
    x = np.linspace(0.54, 0.095, 2 * len(there.time) + 1)
    back = integrate(there.masses, there.motion.position[-1], -there.motion.velocity[-1], there.step, contacts(x))
    assert there.force[1].max() > 2 * scene.static_wheel_load  # it did strike the nose
    np.testing.assert_allclose(back.position[::-1], there.motion.position, rtol=0, atol=1e-9)
    np.testing.assert_allclose(back.force[:, ::-1], there.force, rtol=0, atol=1e-3 * there.force.max())


@pytest.mark.parametrize("angle, flagged", [("10 mrad", set()), ("11 mrad", {"dip limit"})])
def test_a_joint_is_the_formula_s_own_scene_up_to_the_standard_s_dip(scene, angle, flagged):
    joint = scene.replace_si(crossing={"family": "joint", "dip_angle": angle})
    flags = {flag["what"] for flag in p2_formula.solve(joint, P2Settings()).trust["validity"]}
    assert flags & {"dip limit", "one impact"} == flagged


def test_dip_angle_of_the_path_is_flagged_above_the_standard_s_limit(scene):
    result = p2_formula.solve(scene, P2Settings())
    # 12.9 to 15.8 mrad on the benchmark's sections stretched to 1:10.75
    assert result.trust["dip_angle"] == pytest.approx(15e-3, rel=0.2)
    assert {"dip limit", "P2 limit"} <= {flag["what"] for flag in result.trust["validity"]}
    given = p2_formula.solve(scene, P2Settings(dip_angle=7.33e-3))
    half = p2_formula.solve(scene, P2Settings(dip_angle=7.33e-3, unsprung="half wheelset"))
    said = f"with one wheel's, half, P2 is {half.peaks['p2'].value / 1e3:.1f} kN"
    assert [said in " ".join(result.warnings) for result in (given, half)] == [True, False]
    assert (
        given.peaks["p2"].value == pytest.approx(175.28e3, abs=50)
        and given.peaks["p2"].value < given.peaks["p2_all_times_1.2"].value
    )


def test_window_beyond_the_crossing_and_against_the_direction_are_refused(scene, tmp_path):
    with pytest.raises(ValueError, match="leaves the modelled crossing"):
        rigid_hertz.solve(scene, RigidHertzSettings(start=0.5, end=2.0))
    text = (ROOT / "cases" / "thesis" / "case_02.toml").read_text().replace('end = "700 mm"', 'end = "50 mm"')
    (tmp_path / "bad.toml").write_text(text)
    with pytest.raises(CaseError, match="run.lumped.end: 50 mm must lie above"):
        load_case(tmp_path / "bad.toml")


@pytest.mark.parametrize(
    "models",
    [
        (p2_formula, lumped, rigid_hertz),
        pytest.param((p2_formula, lumped, rigid_hertz, bem_passage), marks=pytest.mark.validate),
    ],
    ids=["quick", "all"],
)
def test_sixteen_cases_are_answered_by_every_light_model(models):
    for n in range(1, 17):
        case = load_case(f"thesis/case_{n:02d}")
        for model in models:
            result = model.solve(case.scene, case.runs[model.__name__.rpartition(".")[2]])
            assert not result.fault and all(np.isfinite(peak.value) for peak in result.peaks.values())


def test_surface_tables_are_shared_by_scenes_that_differ_in_speed_only(scene):
    window = (0.1, 0.4, 2.5e-3)
    assert contact_table(scene, *window) is contact_table(scene.model_copy(update={"speed": 20.0}), *window)
