"""The bar of form: what each simplification moves a force by is what passes with and without it differ by."""

import math
from dataclasses import replace

import numpy as np
import pytest

from geometry.axes import RAIL_DEPTH
from rail_fem.case.casefile import load_case
from rail_fem.hierarchy import MODELS, solve
from rail_fem.passes.track_beam import track_beam
from rail_fem.result.quantities import STRAIN
from rail_fem.result.result import Peak, load
from rail_fem.run.form import SIMPLIFICATIONS, form, on_bearers
from rail_fem.run.job import run_case
from rail_fem.scene.wheel_body import WheelBody
from rail_fem.show.metal import metal_rows
from rail_fem.show.report import headlines
from rail_fem.sweeps.compare import SHARE, Comparison
from rail_fem.sweeps.compare_report import advice

WINDOW = {"start": "250 mm", "end": "420 mm", "path_spacing": "5 mm"}


@pytest.fixture(scope="module")
def ran(tmp_path_factory):
    """The folder of a pass by rigid_hertz as the command makes it, and what was said."""
    case, folder, said = load_case("nose_transfer"), tmp_path_factory.mktemp("form") / "run", []
    settings = MODELS["rigid_hertz"].settings.checked(WINDOW)
    case = replace(case, runs={"rigid_hertz": settings})
    assert run_case(case, "rigid_hertz", folder, False, False, said.append) == ""
    return folder, "\n".join(said)


@pytest.mark.parametrize("stiffness, x", [(100e6, 0.357), (200e6, 0.357), (100e6, 4.5), (100e6, -4.5)])
def test_the_casting_on_bearers_is_as_stiff_as_the_foundation_under_the_transfer(scene, stiffness, x):
    """Also a switch's far end, where no bearer's x is that of bearer 0's range."""
    (found,) = on_bearers(scene.replace_si(foundation={"stiffness": stiffness}), x)
    beam = track_beam(found.bearers, x - 0.4, x + 0.4, 0.05, 12.0)
    share = beam.force_at(x)
    assert 1 / (share @ beam.static(share)) == pytest.approx(stiffness, rel=1e-3)


def test_no_row_of_what_the_scene_has_or_no_ballast_can_give(scene):
    (there,) = on_bearers(scene, 0.357)
    assert not on_bearers(there, 0.357)
    assert not SIMPLIFICATIONS[1].better(scene.replace(wheel_body=WheelBody()), 0.357)
    assert not on_bearers(scene.replace(foundation={"stiffness": "5000 kN/mm"}), 0.357)


def test_a_scene_at_the_end_of_a_key_s_range_moves_to_the_other_side_alone(scene):
    """The run itself is within it, and is not to fail by its bar."""
    *_, aside, wing = SIMPLIFICATIONS
    (lower,) = wing.better(scene.replace_si(crossing={"wing_raise": 8e-3}), 0.357)
    assert lower.crossing.wing_raise == pytest.approx(7.5e-3)
    (wider,) = aside.better(scene.replace_si(gauge=0.5, back_to_back=0.425), 0.357)
    assert wider.gauge == pytest.approx(0.502)


def test_what_a_light_model_is_off_over_a_nose_is_told_of_no_joint_nor_a_casting(scene):
    """A wheel on plain line had its static load to within 240 %."""
    plain = scene.replace_si(crossing={"family": "joint", "dip_angle": 0.0})
    of_joint = solve("lumped", plain, {"start": "-50 mm", "end": "50 mm"})
    of_crossing = solve("lumped", scene, WINDOW)
    row = "lumped in place of fe_full"
    found = form(of_joint)
    assert row not in found and "one mass in place of a rail on bearers" in found
    assert not any("casting" in words or "wing" in words for words in found)
    own = of_crossing.peaks["largest_force"].value
    assert form(of_crossing, by_passes=False)[row]["largest_force"] == pytest.approx(own / (1 + 2.40) - own)


def test_one_force_at_one_place_has_one_bar(scene):
    """A joint's impact is the largest force on the wheel and on its only rail; hardening moved it by 14.5 and 4.2 %."""
    bent = scene.replace_si(crossing={"family": "joint", "dip_angle": 4e-3})
    result = solve("rigid_hertz", bent, {"start": "-50 mm", "end": "100 mm", "path_spacing": "5 mm"})
    one, other = (result.peaks[name] for name in ("largest_force", "largest_force_wing"))
    assert (one.x, one.value) == (other.x, other.value)
    rows = form(replace(result, peaks={**result.peaks, "impact_on_wheel": one}), by_passes=False).values()
    assert any("largest_force" in row for row in rows)
    assert all(row["largest_force"] == row["largest_force_wing"] == row["impact_on_wheel"] for row in rows)


def test_each_row_is_what_the_passes_differ_by(scene, ran):
    result = load(ran[0])
    words = next(words for words in result.form if "aside" in words)
    window = {name: result.settings[name] for name in ("start", "end", "path_spacing")}
    at = lambda gauge: solve("rigid_hertz", scene.replace_si(gauge=gauge), MODELS["rigid_hertz"].settings(**window))
    base, *others = (at(gauge) for gauge in (1.435, 1.433, 1.437))
    moved = max((other.transfer_x - base.transfer_x for other in others), key=abs)
    assert result.form[words]["transfer_x"] == pytest.approx(moved, rel=1e-12)
    force = lambda one: one.peaks["largest_force_wing"].value
    share = max((force(other) / force(base) - 1 for other in others), key=abs)
    assert result.form[words]["largest_force_wing"] == pytest.approx(share * force(result), rel=1e-12)


def test_the_bar_is_saved_told_and_counted(ran):
    folder, said = ran
    result = load(folder)
    name = "impact_on_wheel"
    assert result.form_bar(name) == pytest.approx(math.sqrt(sum(row[name] ** 2 for row in result.form.values())))
    assert f"form +- {result.form_bar(name) / 1e3:.2g} kN" in said
    assert all(words in said for words in result.form)
    assert np.isnan(result.form_bar("block_nose"))
    found = Comparison(result, (replace(result), result), ("other", "own"))
    assert f"{result.form_bar(name) / result.peaks[name].value:.0%} besides (form)" in advice(
        found, 0.05, "impact on the wheel"
    )


def test_what_has_not_flowed_has_no_place(ran):
    unyielded, flowed = Peak(0.0, "", x=0.3, size=1e-3), Peak(0.05, "", x=0.3, size=1e-3)
    result = replace(load(ran[0]), peaks={"plastic_strain_nose": unyielded, "plastic_strain_wing": flowed})
    where = {one.name: one.where for one in headlines(result)}
    assert where["plastic_strain_nose"] == "" and "x = 300 mm" in where["plastic_strain_wing"]


def test_a_scene_that_light_models_cannot_run_has_no_such_rows(scene, ran):
    result = load(ran[0])
    curved = result.scene.replace(diverging={})
    assert set(form(replace(result, scene=curved))) == set(form(result, by_passes=False))


def test_a_comparison_tells_the_form_of_the_body_that_takes_over(ran):
    """Trailing, the wing; the bar of elements is that body's, too."""
    name, result = "first_impact_on_wing", load(ran[0])
    trailing = replace(result, peaks={name: Peak(2e5, "N", x=0.3)}, form={"one": {name: 3e4}}, error_bars={name: 1e4})
    found = Comparison(trailing, (trailing,), ("own",))
    assert (found.bar(SHARE), found.form(SHARE)) == pytest.approx((0.05, 0.15))


@pytest.mark.parametrize("model", ["p2_formula", "lumped"])
def test_a_model_without_bodies_or_path_is_told_what_it_can(scene, model):
    found = form(solve(model, scene))
    assert all(
        name.startswith(("largest_force", "impact", "first", "transfer")) for row in found.values() for name in row
    )


def test_what_light_passes_do_not_see_is_kept_for_the_scenes_it_is_of(ran):
    result = load(ran[0])
    kinematic = {"grade": "Mn13", "hardening": "kinematic"}
    hard = result.scene.replace_si(friction=0.5, materials={"wing": kinematic, "nose": kinematic})
    hard = hard.replace_si(wheel_body=WheelBody())
    assert len(form(result, by_passes=False)) == 3
    deep, shallow = (replace(result, model="fe_full", settings={"rail_depth": depth}) for depth in (0.110, RAIL_DEPTH))
    assert len(form(deep, by_passes=False)) == 3 and len(form(shallow, by_passes=False)) == 4
    (alone,) = form(replace(result, scene=hard), by_passes=False).values()
    nose = {"values": {"block": 0.09}, "maximum": 0.1, "position": [0.4, 0.0, 0.0], "size": 2e-3, "depth": [1e-3]}
    nose |= {"stress": [[0.0, 0.0]], "unloaded": False, "surface": {"fall": [], "x": []}}
    flowed = replace(deep, metal={"nose": nose})
    flowed = replace(flowed, form=form(flowed, by_passes=False))
    assert flowed.form_bar("block_nose") == pytest.approx(0.09 * math.hypot(0.106, 0.030, 0.221))
    unyielded = replace(deep, metal={"nose": nose | {"maximum": 0.0}})
    assert set(form(deep, by_passes=False)) - set(form(unyielded, by_passes=False)) == {
        "isotropic hardening in place of kinematic"
    }
    told = {name: remark for name, _, remark in metal_rows(flowed)}
    assert "form +- 2.2 %" in told[f"nose: {STRAIN['block']}"] and not told[f"nose: {STRAIN['worst_10']}"]
    coarse = replace(flowed, metal={"nose": nose | {"size": 4e-3}})
    told = {name: remark for name, _, remark in metal_rows(coarse)}
    assert told[f"nose: {STRAIN['worst_10']}"] == "of one element of 64 mm3"
    assert not told[f"nose: {STRAIN['worst_100']}"]
    off = MODELS["rigid_hertz"].off[1]
    assert alone["impact_on_wheel"] == pytest.approx(off * result.peaks["impact_on_wheel"].value)
    assert not form(replace(result, scene=hard, model="fe_full"), by_passes=False)
