"""Family "joint": plain line, and the P2 formula's own scene."""

import numpy as np
import pytest
from scipy.linalg import eigh

from bem.exact.hertz import tangent_stiffness
from geometry.axes import tread_datum_y
from geometry.path.wheel_path import wheel_path
from geometry.profiles.wheel import wheel_profile
from geometry.surfaces.joint import Joint, joint_rail
from rail_fem.case.casefile import CaseError, load_case
from rail_fem.case.warnings import case_warnings
from rail_fem.contact.contact_pairs import ContactPairError
from rail_fem.fe.meshing import make_mesh
from rail_fem.fe.running import running_of
from rail_fem.models import bem_passage, lumped, p2_formula, rigid_hertz
from rail_fem.result.low_pass import filtered_peak
from rail_fem.result.warning_records import record
from rail_fem.run.form import form
from rail_fem.settings.explicit import FeSettings
from rail_fem.settings.light import (
    BemPassageSettings,
    BemPlasticSettings,
    LumpedSettings,
    P2Settings,
    RigidHertzSettings,
    unfit_parts,
)
from tests.rail_fem.joint_passes import (
    FILTERED,
    NO_SUSPENSION,
    STIFF,
    TRACK_DAMPING,
    contact_amplitude,
    formula,
    half_period,
    hertz,
    hertz_pass,
    joint_scene,
    over_formula,
    stiff,
)
from tests.rail_fem.test_crossing_section import case_with

WINDOW = {"start": -0.3, "end": 0.6}
DRAWN = 10e-3  # of the dip [rad]
bare = lambda angle, **changes: joint_scene(angle, damping=False, suspension=NO_SUSPENSION, **changes)


def test_on_plain_line_nothing_happens():
    """A joint without a dip: the static load throughout, by every light model; no dip for the formula."""
    scene = joint_scene(0.0)
    assert scene.crossing.name == "plain line"
    for model, settings in ((lumped, LumpedSettings(**WINDOW)), (rigid_hertz, RigidHertzSettings(**WINDOW))):
        force = model.solve(scene, settings).history["force"]
        assert force == pytest.approx(scene.static_wheel_load, rel=1e-6)
    assert p2_formula.solve(scene, P2Settings()).trust["dip_angle"] == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize("shape, within", [("straight", 2e-7), ("parabolic", 1e-5)])
def test_the_rigid_wheel_sees_the_dip_as_it_is(shape, within):
    """Away from the bend its height is the rail's where it touches, and the slopes part by the dip angle."""
    joint = Joint(10e-3, 1.0, shape)
    path = wheel_path(
        wheel_profile("P8"), joint_rail(joint), np.r_[np.arange(-0.9, -0.01, 0.02), np.arange(0.02, 0.9, 0.02)]
    )
    radius = 0.425
    at, slope = path.contact_point[:, 0], path.slope
    exact = joint.height(at) + radius * (1 - np.sqrt(1 + slope**2))
    assert np.abs(path.height - exact).max() < within
    if shape == "straight":
        assert path.slope[0] == pytest.approx(-5e-3, rel=1e-3) and path.slope[-1] == pytest.approx(5e-3, rel=1e-3)


def test_the_formula_takes_the_joint_s_own_dip_angle():
    found = p2_formula.solve(joint_scene(8e-3), P2Settings())
    assert found.trust["dip_angle"] == pytest.approx(8e-3, rel=2e-3)
    assert abs(found.transfer_x) < 5e-3


def test_p1_says_that_its_mass_is_the_whole_track_s_and_what_it_is_by_a_tenth():
    scene = joint_scene(8e-3)
    light = scene.replace_si(foundation={"track_mass": scene.foundation.track_mass / 10})
    (said,) = (text for text in p2_formula.solve(scene, P2Settings()).warnings if text.startswith("P1 mass: 750 kg"))
    least = p2_formula.solve(light, P2Settings()).peaks["p1"].value
    assert said.endswith(f"with a tenth, P1 is {least / 1e3:.1f} kN") and record(said).kind == "model"


def two_modes(scene, contact):
    """Largest force of the track on its spring [N] behind the bend, wheel and track on two springs: exact."""
    wheel, track, spring = scene.vehicle.wheel_unsprung_mass, scene.foundation.track_mass, scene.foundation.stiffness
    matrix = np.array([[contact, -contact], [-contact, contact + spring]])
    square, shape = eigh(matrix, np.diag([wheel, track]))
    time = np.linspace(0, half_period(scene) / scene.speed, 20001)
    moved = shape[1] * shape[0] * wheel * scene.crossing.dip_angle * scene.speed / np.sqrt(square)
    return spring * (moved * np.sin(np.sqrt(square) * time[:, None])).sum(axis=1).max()


def test_a_contact_that_cannot_open_meets_the_formula_at_any_angle_the_better_the_stiffer_it_is():
    """What is left is the contact's own vibration, of the order of sqrt(Kt / k), which two modes have exactly. The
    path's bend over 2 mm and the thousandth part of a suspension are worth less than 1 %."""
    small, large = bare(0.2e-3), bare(15e-3)
    assert over_formula(stiff(small)) == pytest.approx(over_formula(stiff(large)), rel=2e-3)
    assert over_formula(stiff(large)) == pytest.approx(1, abs=0.03)
    found = []
    for constant in (1e11, 1e12, 1e13):
        contact = tangent_stiffness(constant, large.static_wheel_load)
        found.append(over_formula(stiff(large, constant=constant)))
        assert found[-1] == pytest.approx(two_modes(large, contact) / formula(large), abs=0.01)
        assert 0 < found[-1] - 1 < np.sqrt(large.foundation.stiffness / contact)
    assert (np.diff(found) < 0).all()


def test_a_stiff_contact_that_may_open_rebounds_and_goes_beyond_the_formula():
    """The formula's impact takes track / (wheel + track) of the wheel's energy across the bend away. A contact that
    cannot open keeps it as its own vibration; one that opens, where the vibration reaches the static load, gives some
    of it to the track in further blows: at most all."""
    scene = bare(DRAWN)
    wheel, track = scene.vehicle.wheel_unsprung_mass, scene.foundation.track_mass
    assert 1.05 < over_formula(stiff(scene, opens=True)) < np.sqrt((wheel + track) / wheel)
    contact = tangent_stiffness(STIFF, scene.static_wheel_load)
    angle = DRAWN * scene.static_wheel_load / contact_amplitude(scene, contact)  # where it begins to open
    assert 0.4e-3 < angle < 0.6e-3
    below = bare(0.8 * angle)
    assert over_formula(stiff(below, opens=True)) == pytest.approx(over_formula(stiff(below)), rel=1e-4)


def test_the_suspension_lifts_the_later_peaks_which_are_not_the_formula_s():
    """It is pressed together as the wheel climbs, by Ks 2 alpha x at most: at the second peak, five quarters of a
    period behind the bend, a seventh of the formula's increment."""
    scene = joint_scene(DRAWN, damping=False)
    found, at = stiff(scene), 2.5 * half_period(scene)
    climbed = scene.vehicle.primary_stiffness * DRAWN * at / formula(scene)
    assert over_formula(found) < 1.04 and 0.12 < climbed < 0.16
    assert found.force.max() / formula(scene) - over_formula(found) == pytest.approx(climbed, abs=0.04)
    assert found.x[np.argmax(found.force)] == pytest.approx(at, abs=0.02)


def test_the_formula_s_damping_factor_is_what_a_track_damper_leaves_of_the_first_peak():
    """To first order in the damping ratio; second order and the contact's vibration are worth 1.5 %."""
    scene = bare(DRAWN, track_damping=TRACK_DAMPING)
    left = over_formula(stiff(scene)) / over_formula(stiff(bare(DRAWN)))
    assert left == pytest.approx(formula(scene, damped=True) / formula(scene), abs=0.015) and left < 0.92


def test_damping_takes_the_force_below_the_formula_and_a_low_pass_further():
    scene = joint_scene(4e-3)
    free = joint_scene(4e-3, damping=False)
    assert over_formula(hertz(scene)) < 0.97 * over_formula(hertz(free))
    run = hertz_pass(scene, FILTERED)
    peaks = [filtered_peak(run, cutoff).value for cutoff in (500.0, 50.0, 20.0)]
    assert (np.diff(peaks) < 0).all() and peaks[-1] > scene.static_wheel_load


def test_a_path_that_does_not_pass_the_joint_is_told():
    """The models' own begins at x = 95 mm, where a crossing's wheel is on the wing; plain line has no joint to miss."""
    told = lambda scene, **ends: " ".join(case_warnings(scene, RigidHertzSettings(**ends)))
    assert "does not pass the joint" in told(joint_scene(10e-3)) and "joint" not in told(joint_scene(0.0))
    assert "joint" not in told(joint_scene(10e-3), start=-0.1, end=0.7)


def test_over_a_gap_the_rigid_wheel_stands_on_the_nearer_rail_end():
    """It falls by r - sqrt(r^2 - d^2) at a distance d from it, r where the tread touches, and changes rails midway."""
    gap, x = 12e-3, np.r_[-0.1, np.linspace(-6e-3, 6e-3, 7), 0.1]
    path = wheel_path(wheel_profile("P8"), joint_rail(Joint(0.0, gap=gap)), x)
    radius = 0.425 - wheel_profile("P8").height(path.contact_point[:, 1] - tread_datum_y())
    beside = np.maximum(gap / 2 - np.abs(x), 0.0)
    assert path.height == pytest.approx(-(radius - np.sqrt(radius**2 - beside**2)), abs=2e-8)
    assert path.transfers == pytest.approx([0.0], abs=1e-6)


def test_the_dip_of_a_gap_is_what_the_wheel_turns_by_in_it():
    """gap / r, r the radius where the tread touches: sampled every 2.5 mm it was 41 for 47 mrad."""
    scene = joint_scene(0.0).replace_si(crossing={"joint_gap": 20e-3})
    assert scene.crossing.told("first impact on the nose") == "first impact on the rail at x > 0"
    dip = p2_formula.solve(scene, P2Settings()).trust["dip_angle"]
    assert dip == pytest.approx(20e-3 / scene.wheel.radius, rel=0.01)


def test_an_insulated_joint_s_gap_hands_the_wheel_from_rail_to_rail():
    """Within it both rail ends carry; a wider gap strikes harder; without one nothing happens."""
    found = []
    for gap in (0.0, 6e-3, 12e-3):
        scene = joint_scene(0.0).replace_si(crossing={"joint_gap": gap})
        found.append(rigid_hertz.solve(scene, RigidHertzSettings(start=-0.1, end=0.15, path_spacing=1e-3)))
    load = found[0].scene.static_wheel_load
    assert "largest_force_nose" not in found[0].peaks
    assert found[1].transfer_x == pytest.approx(0.0, abs=1e-3)
    both = (found[1].history["force_wing"] > 0.1 * load) & (found[1].history["force_nose"] > 0.1 * load)
    assert both.any()
    peaks = [result.peaks["largest_force"].value / load for result in found]
    assert peaks[0] == pytest.approx(1, rel=1e-5) and 1.05 < peaks[1] < peaks[2] < 2, peaks
    assert any(said.startswith("plastic: rail:") for said in found[2].warnings)  # it has no wing
    with pytest.raises(ContactPairError, match="beside a joint_gap: no half-space lies there; take rigid_hertz"):
        bem_passage.solve(scene, BemPassageSettings(start=-0.1, end=0.15))
    for settings in (BemPassageSettings, BemPlasticSettings):  # before it runs: one found out after minutes
        (said,) = unfit_parts(scene, settings(start=-0.1, end=0.15))
        assert "no half-space: take rigid_hertz or fe_full" in said
        assert unfit_parts(scene, settings(start=0.1, end=0.15)) == [] == unfit_parts(found[0].scene, settings())
    ends = [row for words, row in form(found[2], by_passes=False).items() if words.startswith("a rail's end")]
    assert ends[0]["impact_on_wheel"] > 0.4 * load and not any(
        "end" in words for words in form(found[0], by_passes=False)
    )


def test_a_gap_s_rails_are_meshed_to_their_ends():
    """For fe_full: it looked for a wing within the gap and beyond."""
    scene = joint_scene(0.0).replace_si(crossing={"joint_gap": 12e-3})
    settings = FeSettings(element_size=5e-3, start=-0.05, end=0.05)
    mesh, *_ = make_mesh(scene, settings, running_of(scene, settings))
    x = [mesh.points[mesh.cells[mesh.region == body], 0] for body in (0, 1)]
    assert (x[0].max(), x[1].min()) == pytest.approx((-6e-3, 6e-3), abs=1e-9)


@pytest.mark.parametrize(
    "lines, complaint",
    [
        (['family = "joint"', 'joint_gap = "31 mm"'], "joint_gap: .* is outside"),
        (['family = "switch"', 'joint_gap = "6 mm"'], "joint_gap: does not belong to family switch"),
        (['family = "joint"', 'switch_radius = "200 m"'], "switch_radius: does not belong to family joint"),
        (['family = "joint"', 'dip_angle = "100 mrad"'], "dip_angle: .* is outside"),
        (['family = "joint"', "ratio = 9.25"], "ratio: does not belong to family joint"),
        (['family = "joint"', 'file = "x.csv"'], 'no file "x.csv"'),
        (["ratio = 9.25", 'dip_angle = "5 mrad"'], "dip_angle: does not belong to family UK-cast"),
    ],
)
def test_what_is_no_joint_is_refused(tmp_path, lines, complaint):
    with pytest.raises(CaseError, match=complaint):
        load_case(case_with(tmp_path, *lines))
