"""Rail and casting as a beam on bearers under the light models: closed forms, an independent route, and what is
refused."""

import numpy as np
import pytest
from scipy import sparse
from scipy.sparse.linalg import spsolve

from rail_fem.case.casefile import CaseError, load_case
from rail_fem.case.preflight import preflight_errors
from rail_fem.case.warnings import case_warnings
from rail_fem.contact.contact_table import contact_table
from rail_fem.hierarchy import MODELS, solve
from rail_fem.models import rigid_hertz
from rail_fem.passes.beam_kernel import band_times, element_shape, leap
from rail_fem.passes.beam_results import moments
from rail_fem.passes.plastic_indentation import contacts_of
from rail_fem.passes.track_beam import element_rotation, element_stiffness, track_beam
from rail_fem.passes.vertical_pass import run_pass
from rail_fem.result.result import load
from rail_fem.scene.bearers import BeamSection, Bearers
from rail_fem.settings.light import RigidHertzSettings
from rail_fem.show.case_facts import case_report
from tests.order import assert_order
from tests.rail_fem.joint_passes import joint_scene
from tests.rail_fem.test_casefile import GOOD

TRACK = {
    "pad_stiffness": "200 kN/mm",
    "pad_damping": "30 kN s/m",
    "mass": "120 kg",
    "ballast_stiffness": "60 kN/mm",
    "ballast_damping": "60 kN s/m",
}
RAIL = {"second_moment": "2321 cm^4", "mass": "56.3 kg/m", "foot_depth": "74.5 mm"}
LOAD = 100e3


def bearers(**changes) -> Bearers:
    return Bearers.model_validate(TRACK | changes)


def winkler(spacing: float, per_length: float = 80e6, damping: float = 0.0, **changes) -> Bearers:
    """Bearers so stiff on their pads that all gives way below them, as a foundation [N/m2, N s/m2] cut into pieces."""
    return bearers(
        spacing=spacing, ballast_stiffness=per_length * spacing, ballast_damping=damping * spacing, pad_stiffness=1e11,
        mass=1.0, pad_damping=0.0, **changes,
    )  # fmt: skip


def leaps(beam, start, force, x, step):
    """Heights under a wheel that is at x (m + 1,) [m] and presses with force (m,) down [N] over m steps; work of the
    force less losses of each step (m,) [J], losses [J]; energy of the beam half a step before (m + 1,) [J]; round-off
    of that energy, ten operations an entry [J]."""
    band, u, w = beam.band(step), start.position.copy(), start.velocity.copy()
    damped, change, found = band_times(beam.damping, w), np.empty(len(u)), []
    energy = lambda: float(
        beam.energy(beam.mass, w[None])[0] + beam.energy(beam.stiffness, (u - step / 2 * w)[None])[0]
    )
    before = [energy()]
    for k, push in enumerate(force):
        found.append(leap(u, w, damped, change, -push, x[k], x[k + 1], step, band))
        before.append(energy())
    work, lost, height = np.array(found).T
    round_off = 10 * np.finfo(float).eps * beam.energy(np.abs(beam.stiffness), np.abs(u)[None])[0]
    return np.r_[start.height(x[0]), height], work - lost, lost, np.array(before), round_off


@pytest.mark.parametrize("shear_area", [None, 29e-4])
def test_a_cantilever_of_one_element_is_exact_along_its_length(shear_area):
    """Euler and Bernoulli: P x^2 (3 L - x) / 6 EI; shear adds P x / (shear stiffness)."""
    section = BeamSection.model_validate(RAIL | {"shear_area": shear_area})
    length = 0.6
    shear = 12 * section.bending_stiffness / (section.shear_stiffness * length**2)
    tip = np.linalg.solve(element_stiffness(section, length, shear)[2:, 2:], [1.0, 0.0])
    for t in (0.3, 0.7, 1.0):
        x = t * length
        exact = x**2 * (3 * length - x) / (6 * section.bending_stiffness) + x / section.shear_stiffness
        assert element_shape(t, length, shear)[2:] @ tip == pytest.approx(exact, rel=1e-12)
    turned = np.array([0.0, 1.0, length, 1.0])  # a rigid rotation
    assert element_shape(0.4, length, shear) @ turned == pytest.approx(0.4 * length, rel=1e-12)
    assert element_rotation(0.4, length, shear) @ turned == pytest.approx(1.0, rel=1e-12)


def test_a_bearer_beyond_the_track_that_is_computed_is_told():
    scene = joint_scene(4e-3)
    told = lambda **state: case_warnings(scene.replace(bearers=bearers(**state)), RigidHertzSettings(start=-0.5, end=1))
    assert any("bearer 99 at x = 59.4 m lies beyond" in said for said in told(voided=[99]))
    assert not any("lies beyond" in said for said in told(voided=[1], missing=[-9]))


def test_close_bearers_become_winkler_s_foundation():
    """Deflection P lambda / 2 k with order 4 and moment P / 4 lambda with order 2 in their spacing, over a bearer."""
    spacings, errors, at = (0.8, 0.4, 0.2), [], np.array([0.0])
    for spacing in spacings:
        track = winkler(spacing, 10e6)
        per_length = 1 / (1 / track.pad_stiffness + 1 / track.ballast_stiffness) / spacing
        beam = track_beam(track, 0.0, 0.0, spacing, 16.0)
        root = (per_length / (4 * beam.sections[0].bending_stiffness)) ** 0.25
        u = beam.static(-LOAD * beam.force_at(0.0))[None]
        moment = moments(beam, u, np.array([LOAD]), at)
        height = beam.heights(u, at)[0]
        errors.append((-height / (LOAD * root / (2 * per_length)) - 1, moment.under[0] / (LOAD / (4 * root)) - 1))
        assert moment.under_foot[0] == pytest.approx(moment.under[0] * 74.5e-3 / 2321e-8, rel=1e-9)
    deflection, moment = np.array(errors).T
    assert_order(spacings, deflection, expected=4, slack=0.2)
    assert_order(spacings, moment, expected=2, slack=0.1)


def test_moments_do_not_hang_on_the_elements():
    """In statics they are exact, wherever the load stands in an element."""
    found = []
    for element in (0.3, 0.05):
        beam = track_beam(bearers(), 0.0, 0.0, element, 9.0)
        at = np.array([0.137])
        u = beam.static(-LOAD * beam.force_at(at[0]))[None]
        found.append(moments(beam, u, np.array([LOAD]), at).under[0])
    assert found[0] == pytest.approx(found[1], rel=2e-3)


def test_a_moving_load_sinks_as_deep_as_the_steady_solution():
    """Euler's beam on Winkler's foundation with damping, under a load at half the critical speed; its depth under the
    load by Fourier's integral over wave numbers. Close bearers are off it by what the
    spacing is worth in statics: 0.3 %."""
    speed, per_length, damping, step = 250.0, 10e6, 1e4, 5e-6
    beam = track_beam(winkler(0.2, per_length, damping), 0.0, 12.0, 0.2, 12.0)
    section = beam.sections[0]
    wave = np.linspace(-400.0, 400.0, 400001)
    foundation = per_length - 1j * damping * speed * wave
    steady = 1 / (section.bending_stiffness * wave**4 - (section.mass + 5.0) * (speed * wave) ** 2 + foundation)
    exact = LOAD * steady.real.sum() * (wave[1] - wave[0]) / (2 * np.pi)
    x = speed * step * np.arange(round(12.0 / speed / step) + 1)
    height, *_ = leaps(beam, beam.under(LOAD, 0.0, speed), np.full(len(x) - 1, LOAD), x, step)
    assert exact > 1.1 * -height[0]
    assert -height[x > 10.0].mean() == pytest.approx(exact, rel=5e-3)


def test_leaps_keep_energy_to_round_off():
    """What the moving force does is what the beam gains and its dampers lose, at any step."""
    beam = track_beam(bearers(), 0.0, 1.0, 0.1, 4.0)
    for step in (1e-5, 1e-4):
        x = 33.5 * step * np.arange(301)
        force = LOAD * (1 + np.sin(3000.0 * step * np.arange(300)))
        _, gained, lost, energy, round_off = leaps(beam, beam.under(LOAD, 0.0, 33.5), force, x, step)
        assert np.all(lost >= 0) and lost.sum() > 1.0
        assert np.abs(np.diff(energy) - gained).max() < round_off < 1e-8 * energy.max()


def test_leaps_are_the_march_of_the_light_models():
    """The same force over the same beam, by the march at its own steps and by steps thirty times as short: the heights
    differ by the march's error, which doubling its steps says (second order: a third of the change), and by half a
    short step, by which the mean of a force stands beside its moment."""
    scene = joint_scene(4e-3, length=0.3, shape="parabolic").replace(bearers=bearers())
    window = {"start": -0.4, "end": -0.02, "beam_reach": 4.0}
    coarse, fine = (
        run_pass(scene, settings, contacts_of(scene, settings, contact_table(scene, -0.4, -0.02, 2.5e-3)))
        for settings in (RigidHertzSettings(**window, time_step=step) for step in (2e-5, 1e-5))
    )
    error = np.abs(np.interp(coarse.x, fine.x, fine.track_height) - coarse.track_height).max() / 3
    force, part = fine.force.sum(axis=0), 30
    step = fine.step / part
    x = np.linspace(-0.4, -0.4 + scene.speed * fine.step * len(force), part * len(force) + 1)
    start = fine.beam.under(scene.static_wheel_load, -0.4, scene.speed)
    height, *_ = leaps(fine.beam, start, np.repeat(force, part), x, step)
    late = np.abs(np.diff(height)).max() / 2
    assert np.abs(height[part // 2 :: part] - fine.track_height).max() < error + late < 1e-4 * np.abs(height).max()


def receptance(beam, x, frequency):
    """(f,) complex height at x per harmonic force there [m/N]."""
    load, found = beam.force_at(x), []
    for omega in 2 * np.pi * frequency:
        band = beam.stiffness - omega**2 * beam.mass + 1j * omega * beam.damping
        below = [sparse.diags(band[: len(load) - d, d], -d) for d in range(1, band.shape[1])]
        dynamic = sparse.diags(band[:, 0]) + sum(lower + lower.T for lower in below)
        found.append(load @ spsolve(dynamic.tocsc(), load))
    return np.array(found)


def test_receptance_is_that_of_an_endless_beam_on_its_supports():
    """Independent route: Green's function of an endless beam (Euler, Bernoulli) and the reactions of 81 supports."""
    track, frequency = bearers(), np.array([20.0, 80.0, 180.0, 400.0, 700.0, 1000.0])
    beam = track_beam(track, 0.0, 0.0, 0.05, 14.0)
    for at in (0.0, 0.3):
        exact = np.array([endless(track, at, f) for f in frequency])
        found = receptance(beam, at, frequency)
        assert np.abs(found / exact - 1).max() < 0.01, np.abs(found / exact - 1)


def endless(track: Bearers, at: float, frequency: float) -> complex:
    omega, stiffness = 2 * np.pi * frequency, track.rail.bending_stiffness
    wave = (track.rail.mass * omega**2 / stiffness) ** 0.25
    green = lambda r: -(np.exp(-wave * np.abs(r)) + 1j * np.exp(-1j * wave * np.abs(r))) / (4 * stiffness * wave**3)
    x = track.spacing * np.arange(-40, 41)
    ground = track.ballast_stiffness + 1j * omega * track.ballast_damping - omega**2 * track.mass
    pad = track.pad_stiffness + 1j * omega * track.pad_damping
    reaction = 1 / (1 / pad + 1 / ground)
    heights = np.linalg.solve(np.eye(81) + reaction * green(x[:, None] - x), green(x - at))
    return green(0.0) - reaction * green(at - x) @ heights


@pytest.mark.parametrize("shear_area", [None, 29e-4])
def test_the_pinned_pinned_resonance_is_that_of_a_bay_on_two_pins(shear_area):
    """The receptance in a bay peaks where half a bending wave fills it. Timoshenko: his frequency equation."""
    rail = BeamSection.model_validate(RAIL | {"shear_area": shear_area})
    beam = track_beam(bearers(rail=rail), 0.0, 0.0, 0.05, 14.0)
    wave = np.pi / 0.6
    bending, mass, turning = rail.bending_stiffness, rail.mass, rail.rotary_inertia
    if shear_area is None:
        exact = wave**2 * np.sqrt(bending / mass) / (2 * np.pi)
    else:
        shear = rail.shear_stiffness
        a, b, c = turning * mass / shear, -(mass + (turning + mass * bending / shear) * wave**2), bending * wave**4
        exact = np.sqrt((-b - np.sqrt(b * b - 4 * a * c)) / (2 * a)) / (2 * np.pi)
    frequency = exact * np.linspace(0.9, 1.1, 161)
    size = np.abs(receptance(beam, 0.3, frequency))
    assert frequency[np.argmax(size)] == pytest.approx(exact, rel=0.01)
    over_bearer = np.abs(receptance(beam, 0.0, np.array([exact])))[0]
    assert over_bearer < 0.2 * size.max()


def test_energies_balance_with_the_square_of_the_step():
    scene = joint_scene(4e-3, length=0.3, shape="parabolic").replace(bearers=bearers())
    steps, errors = (80e-6, 40e-6, 20e-6), []
    for step in steps:
        settings = RigidHertzSettings(start=-0.4, end=-0.02, time_step=step, beam_reach=4.0)
        history = rigid_hertz.solve(scene, settings).history
        errors.append(np.abs(history["energy_balance"]).max() / np.ptp(history["energy_external"]))
    assert errors[-1] < 1e-3
    assert_order(steps, errors, expected=2, slack=0.4)


def test_bearers_carry_the_wheel_and_a_hanging_one_carries_nothing():
    """At rest the ballast forces sum to the wheel load; a void bends the beam more and loads its neighbours."""
    scene = joint_scene(0.0)
    window = RigidHertzSettings(start=-0.3, end=0.3)
    sound, void, gone = (
        rigid_hertz.solve(scene.replace(bearers=bearers(**changes)), window)
        for changes in ({}, {"voided": [0]}, {"missing": [0]})
    )
    of = lambda result: {one.number: one for one in result.bearers}
    assert of(void)[0].ballast_force == 0.0 and of(void)[0].state == "voided" and 0 not in of(gone)
    assert of(void)[1].ballast_force > 1.2 * of(sound)[1].ballast_force
    values = [result.peaks["bending_moment"].value for result in (sound, void, gone)]
    assert values[1] > 1.2 * values[0] and values[2] == pytest.approx(values[1], rel=0.1)
    assert sound.peaks["force_foundation"].value == pytest.approx(scene.static_wheel_load, rel=0.03)
    assert sound.peaks["foot_stress"].value == pytest.approx(values[0] * 74.5e-3 / 2321e-8, rel=1e-6)
    assert {"beam_element", "beam_reach", "time_step"} <= set(sound.error_estimate)


@pytest.mark.parametrize("kind", ["voided", "missing"])
@pytest.mark.parametrize("model", ["rigid_hertz", "fe_full"])
def test_a_track_that_less_than_two_bearers_carry_is_refused_before_a_run(kind, model):
    """One holds it up and lets it turn; two carry the wheel, however deep."""
    own = MODELS[model].settings(start=-0.3, end=0.3, beam_reach=3.0)
    for carry, words in ((0, "0 of"), (1, "1 of 13 bearers"), (2, "")):
        gone = tuple(number for number in range(-10, 11) if number not in (-2, 3)[:carry])
        found = preflight_errors(joint_scene(0.0).replace(bearers=bearers(**{kind: gone})), own, 1, model)
        assert words in " ".join(found) if words else not found


def test_a_stiff_casting_is_a_section_of_its_own(tmp_path):
    casting = RAIL | {"second_moment": "9000 cm^4", "mass": "180 kg/m", "start": "-650 mm", "end": "1250 mm"}
    scene = joint_scene(0.0)
    window = RigidHertzSettings(start=-0.1, end=0.5)
    plain, stiff = (
        rigid_hertz.solve(scene.replace(bearers=bearers(**of)), window) for of in ({}, {"casting": casting})
    )
    assert np.abs(stiff.history["crossing_height"]).max() < 0.9 * np.abs(plain.history["crossing_height"]).max()
    stiff.save(tmp_path)
    again = load(tmp_path)
    assert again.bearers == stiff.bearers and again.scene == stiff.scene
    np.testing.assert_array_equal(again.history["foot_stress"], stiff.history["foot_stress"])


def test_scenes_without_bearers_are_the_scenes_they_were():
    """A run that stands on a rigid mass goes on where it was; bearers make another scene."""
    scene = joint_scene(1e-3)
    assert "bearers" not in scene.plain()
    assert scene.replace(bearers=bearers()).plain() != scene.replace(bearers=bearers(voided=[1])).plain()


BEARERS = (
    '[scene.bearers]\npad_stiffness = "200 kN/mm"\npad_damping = "30 kN s/m"\nmass = "120 kg"\n'
    'ballast_stiffness = "60 kN/mm"\nballast_damping = "60 kN s/m"\n'
)


@pytest.mark.parametrize(
    "lines, complaint",
    [
        (BEARERS.replace("120 kg", "0 kg"), "scene.bearers.mass: 0 kg is outside"),
        (BEARERS.replace("pad_stiffness", "pad_stifness"), "unknown key, did you mean 'pad_stiffness'"),
        (BEARERS + "voided = [1]\nmissing = [1]\n", "bearer 1 is named twice"),
        (
            BEARERS + "unlike = [1, 2]\nunlike_pad = [0.5]\n",
            "scene.bearers.unlike_pad: 1 factor.s. for 2 bearer.s. of unlike",
        ),
        (BEARERS + "unlike = [1]\nunlike_pad = [0.0]\n", "name the bearer in missing"),
        (BEARERS + 'voided = ["one"]\n', "voided"),
        (BEARERS + '[scene.bearers.casting]\nstart = "0 m"\nend = "1 m"\n', "scene.bearers.casting.mass: missing"),
        (
            BEARERS
            + '[scene.bearers.casting]\nstart = "1 m"\nend = "0 m"\nsecond_moment = "1 cm^4"\nmass = "1 kg/m"\n',
            "second_moment: 1 cm\\^4 is outside",
        ),
    ],
)
def test_what_are_no_bearers_is_refused(tmp_path, lines, complaint):
    scene = GOOD.partition("[run.")[0]
    path = tmp_path / "case.toml"
    path.write_text(scene + lines + "[run.rigid_hertz]\n", encoding="utf-8")
    with pytest.raises(CaseError, match=complaint):
        load_case(path)


def test_a_model_that_stands_on_a_rigid_mass_refuses_bearers(tmp_path):
    model = "p2_formula"
    path = tmp_path / "case.toml"
    path.write_text(GOOD.partition("[run.")[0] + BEARERS + f"[run.{model}]\n", encoding="utf-8")
    case = load_case(path)  # others may run it
    (error,) = preflight_errors(case.scene, case.runs[model], 1, model)
    assert error.startswith(f"run.{model}: scene.bearers is for lumped")


def test_a_check_of_a_scene_on_bearers_shows_no_foundation_that_is_not_used(tmp_path):
    path = tmp_path / "case.toml"
    path.write_text(GOOD.partition("[run.")[0] + BEARERS + "[run.lumped]\n", encoding="utf-8")
    report, every = (case_report(load_case(path), "lumped", 1, every_key)[0] for every_key in (False, True))
    assert "bearers.ballast_stiffness" in report and "foundation." not in report and "foundation.stiffness" in every


def test_a_wheelset_with_more_degrees_of_freedom_refuses_bearers():
    scene = joint_scene(0.0).replace(bearers=bearers())
    with pytest.raises(ValueError, match="degrees_of_freedom vertical"):
        solve("rigid_hertz", scene, RigidHertzSettings(start=-0.1, end=0.1, degrees_of_freedom="roll"))
