import numpy as np
import pytest
from pydantic import ValidationError

from rail_fem.case.casefile import CaseError, load_case
from rail_fem.case.examples import example
from rail_fem.case.warnings import scene_warnings
from rail_fem.scene.base import InputError
from rail_fem.scene.scene import Foundation, Material, Scene, Vehicle, Wheel
from rail_fem.settings.explicit import FeSettings


def make_scene(**changes) -> Scene:
    sections = {
        "wheel": Wheel(profile="P8-worn"),
        "foundation": Foundation(stiffness="160 kN/mm"),
        "speed": "75 mph",
        "direction": "facing",
        "vehicle": Vehicle(vehicle_sprung_mass="66.25 t", wheelset_unsprung_mass="1.00 t"),
    }
    return Scene(**(sections | changes))


@pytest.mark.parametrize("sprung, wheelset, load", [("66.25 t", "1.00 t", 86.14e3), ("90 t", "1.50 t", 117.72e3)])
def test_static_load_is_an_eighth_of_the_vehicle_and_half_a_wheelset(sprung, wheelset, load):
    """Coleman's thesis, table 7-5: 86.14 and 117.72 kN, printed to 10 N."""
    scene = make_scene(vehicle=Vehicle(vehicle_sprung_mass=sprung, wheelset_unsprung_mass=wheelset))
    assert scene.static_wheel_load == pytest.approx(load, abs=5.1)


def test_of_two_changes_of_a_load_neither_takes_the_place_of_the_other():
    """One takes the place of what the file has; both are a contradiction of who asked."""
    case, key = example("nose_transfer"), "scene.vehicle.{}".format
    assert load_case(case, {key("axle_load"): "22.5 t"}).scene.axle_load == 22.5e3
    assert load_case(case, {key("axle_load"): "none"}).scene.axle_load == 66.25e3 / 4 + 1e3  # the file's own mass stays
    with pytest.raises(CaseError, match="axle_load: 22.5 t, but vehicle_sprung_mass"):
        load_case(case, {key("vehicle_sprung_mass"): "60 t", key("axle_load"): "22.5 t"})


def test_an_axle_load_stands_for_the_sprung_mass():
    """22.5 t on each of four axles, wheelsets of 1 t each: 86 t on the springs, 22.5 t g / 2 on a wheel."""
    told = {"axle_load": "22.5 t", "wheelset_unsprung_mass": "1 t"}
    scene = make_scene(vehicle=Vehicle(**told))
    assert scene.vehicle.vehicle_sprung_mass == 86e3 and scene.static_wheel_load == 22.5e3 * 9.81 / 2
    assert Scene.model_validate(scene.model_dump(mode="json")) == scene  # the file of a result holds both
    heavier = scene.replace(vehicle={"wheelset_unsprung_mass": "2 t"})
    assert heavier.replace(vehicle={"axle_load": "none"}).vehicle.vehicle_sprung_mass == 82e3
    assert heavier.axle_load == 22.5e3 and heavier.vehicle.vehicle_sprung_mass == 82e3
    assert scene.replace(vehicle={"vehicle_sprung_mass": "66 t"}).axle_load == 17.5e3
    assert make_scene().replace(vehicle={"axle_load": "20 t"}).vehicle.vehicle_sprung_mass == 76e3
    for more, said in [
        ({"vehicle_sprung_mass": "80 t"}, "axle_load: 22.5 t, but vehicle_sprung_mass, .* make 21 t: leave one"),
        ({"axle_load": "0.9 t"}, "axle_load: 0.9 t is no more than the wheelset's own 1 t"),
        ({"axle_load": "none"}, "axle_load: neither it nor vehicle_sprung_mass is given: write one"),
    ]:
        with pytest.raises(InputError, match=said):
            Vehicle.checked(told | more)


def test_scene_cannot_be_changed():
    with pytest.raises(ValidationError):
        make_scene().speed = 10.0


def test_scene_survives_plain_values():
    scene = make_scene(materials={"nose": {"grade": "Mn13", "strength": "400 %"}})
    assert Scene.model_validate(scene.model_dump(mode="json")) == scene


def test_velocity_and_travel_time_follow_speed_and_direction():
    scene = make_scene(speed="20 m/s", direction="trailing")
    assert scene.velocity == -20.0
    assert scene.travel_time(0.5, 0.1) == pytest.approx(0.02, rel=1e-15)
    assert scene.in_order_of_travel(0.1, 0.5) == scene.in_order_of_travel(0.5, 0.1) == (0.5, 0.1)
    assert make_scene(direction="facing").in_order_of_travel(0.5, 0.1) == (0.1, 0.5)


def test_centred_wheelset_puts_the_tread_datum_at_minus_2_5_mm():
    assert make_scene().wheel_datum_y == pytest.approx(-2.5e-3, abs=1e-15)


def test_hybrid_crossing_has_a_hard_nose_on_a_soft_wing():
    scene = make_scene(materials={"nose": Material(grade="Mn13", strength="400 %")})
    assert scene.materials.nose.steel().hardening_stress[0] == pytest.approx(1240e6)
    assert scene.materials.wing.steel().hardening_stress[0] == pytest.approx(310e6)


def test_a_measured_curve_replaces_the_grades():
    steel = Material(
        grade="Mn13", hardening_strain=(0, 0.1), hardening_stress=("350 MPa", "900 MPa"), youngs_modulus="200 GPa"
    ).steel()
    assert list(steel.hardening_stress) == pytest.approx([350e6, 900e6]) and steel.youngs_modulus == pytest.approx(
        200e9
    )


CYCLIC = {"yield_stress": "310 MPa", "modulus": ["60 GPa", "5 GPa"], "recovery": [600, 20], "mixing": [0.5]}


def test_a_law_over_cycles_replaces_the_grades_curve_and_scales_with_strength():
    steel = Material(grade="Mn13", cyclic=CYCLIC, strength="200 %").steel()
    assert steel.cyclic.yield_stress == pytest.approx(620e6) and list(steel.cyclic.mixing) == [0.5, 0.5]
    assert list(steel.cyclic.modulus) == pytest.approx([120e9, 10e9]) and list(steel.cyclic.recovery) == [600, 20]
    assert steel.cyclic.shear == pytest.approx(steel.elastic.shear)
    # at 2 % each back stress is at its bound or on its way
    grown = sum(2 * min(c / g, c / (0.5 * g) * -np.expm1(-0.5 * g * 0.02)) for c, g in ((60e9, 600), (5e9, 20)))
    assert steel.yield_stress(np.array(0.02)) == pytest.approx(620e6 + grown, rel=1e-3)


def test_scenes_without_a_law_over_cycles_are_those_they_were():
    assert "cyclic" not in make_scene().plain()["materials"]["nose"]
    assert make_scene(materials={"nose": {"grade": "Mn13", "cyclic": CYCLIC}}).plain()["materials"]["nose"]["cyclic"][
        "recovery"
    ]


@pytest.mark.parametrize(
    "change, said",
    [
        ({"hardening": "kinematic"}, "hardening and cyclic both say"),
        ({"cyclic": CYCLIC | {"recovery": [600]}}, "2 moduli and 1 recoveries"),
        ({"cyclic": CYCLIC | {"mixing": [0.1, 0.2, 0.3]}}, "2 back stresses and 3 mixings"),
        ({"cyclic": CYCLIC | {"modulus": ["0 GPa", "5 GPa"]}}, "modulus 1 is 0.0"),
        ({"cyclic": CYCLIC | {"hardening": "-400 MPa"}}, "hardening is -400000000.0"),
        ({"cyclic": CYCLIC | {"hardening": "-250 MPa", "hardening_rate": 50}}, "yield curve: falls from"),
        ({"cyclic": CYCLIC | {"yield_stress": "nan MPa"}}, "not a finite number"),
    ],
)
def test_a_law_over_cycles_that_is_none_is_refused(change, said):
    with pytest.raises(ValueError, match=said):
        Material(**({"grade": "Mn13", "cyclic": CYCLIC} | change))


@pytest.mark.parametrize(
    "change",
    [
        {"gauge": "1.0 m"},
        {"friction": -0.1},
        {"speed": "-75 mph"},
        {"speed": "0 mph"},
        {"direction": "sideways"},
        {"materials": {"wheel": {"grade": "R8T", "strength": "200 %"}}},
        {"materials": {"nose": {"grade": "Mn13", "hardening_strain": (0, 1)}}},
    ],
)
def test_impossible_scenes_are_refused(change):
    with pytest.raises(ValidationError):
        make_scene(**change)


def test_far_tread_slope_shapes_the_profile():
    """Beyond y = 29 mm the tread of the P8 family rises with this slope."""
    shape = Wheel(profile="P8", far_tread_slope="10 %").shape
    points = shape.points[(shape.points[:, 0] > 0.03) & (shape.points[:, 0] < 0.06)]
    assert np.diff(points[:, 1]) / np.diff(points[:, 0]) == pytest.approx(0.10, abs=1e-9)


def test_smoke_settings_are_short_and_still_valid():
    smoke = FeSettings(element_size="1 mm").smoke()
    assert smoke.element_size >= 6e-3 and smoke.max_steps <= 50
    assert FeSettings.model_validate(smoke.model_dump()) == smoke
    assert FeSettings(max_steps=3).smoke().max_steps == 3


@pytest.mark.parametrize(
    "change, told",
    [
        ({"sped": "3 mph"}, "sped: unknown key, did you mean 'speed'?"),
        ({"foundation": {"stifness": "1 N/m"}}, "foundation.stifness: unknown key, did you mean 'stiffness'?"),
        ({"vehicle": {"wheel_load": "1 t"}}, "wheel_load: unknown key, did you mean 'axle_load' or 'wheel_count'?"),
        ({"crossing": {"ratio": "1:40"}}, "crossing.ratio: 40 is outside [6, 32] for the crossing ratio N of 1:N"),
        ({"crossing": {"ratio": "2:9"}}, 'crossing.ratio: "2:9"'),
        ({"speed": "75"}, 'speed: "75" has no unit, write e.g. "75 mph"'),
        ({"wheel": "P8"}, "wheel: 'P8' is not a table, write [wheel] with its keys below"),
        ({"crossing": {"ratio": -1}}, "crossing.ratio: -1 is outside [6, 32] for the crossing ratio N of 1:N"),
        ({"crossing": {"flangeway": "70 mm"}}, "crossing: crossing: at x = 1011 mm the wing is 7.8 mm wide"),
        ({"friction": "a", "materials": {"nose": "R26"}}, "materials.nose.grade: unknown value 'R26', did you mean"),
    ],
)
def test_a_change_in_python_is_refused_in_the_words_of_a_case_file(change, told):
    with pytest.raises(InputError) as fault:
        make_scene().replace(**change)
    assert told in str(fault.value) and "pydantic" not in str(fault.value)


def test_a_wheelset_that_does_not_fit_between_the_rails_is_said():
    """14 mm below the tread an S1002's flange is 30.8 mm thick: 1380 mm between the backs leave 27.5 mm."""
    wide = {"wheel": Wheel(profile="S1002"), "back_to_back": "1380 mm"}
    told = [warning for warning in scene_warnings(make_scene(**wide)) if "does not fit" in warning]
    assert len(told) == 1 and "30.8 mm thick" in told[0] and "leaves it 27.5 mm" in told[0]
    for fits in ({}, {"wheel": Wheel(profile="S1002")}, {"gauge": "1000 mm", "back_to_back": "925 mm"}):
        assert not any("does not fit" in warning for warning in scene_warnings(make_scene(**fits)))
