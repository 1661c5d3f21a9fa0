"""Wear and fatigue along a crossing: volume, mirror of the running direction, what limits pressure, the command."""

import json
from dataclasses import replace

import numpy as np
import pytest

import rail_fem
from geometry.surfaces.bodies import BODIES
from rail_fem.contact.contact_table import contact_table
from rail_fem.damage.crossing import PatchOptions, pass_contacts, wear_field
from rail_fem.damage.drivers import DRIVERS, sensitivities
from rail_fem.damage.fatigue import WholeLifeRail
from rail_fem.damage.strips import strip_angles, strip_creepages
from rail_fem.damage.wear import dry_laws, worn_area
from tests.commands import call

CASE = rail_fem.example("damage/crossing_transfer")
LAWS = dry_laws(5e9)
COARSE = PatchOptions(cells=20, hardness=5e9)


@pytest.fixture(scope="module")
def result():
    return rail_fem.solve("rigid_hertz", rail_fem.load_case(CASE).scene, {"start": "200 mm", "end": "460 mm"})


@pytest.fixture(scope="module")
def contacts(result):
    return pass_contacts(result, start=0.24, end=0.44, options=COARSE)


def test_wing_and_nose_carry_what_the_pass_says(result, contacts):
    x = result.history["x"]
    for body in ("wing", "nose"):
        own = contacts.body == BODIES.index(body)
        vertical = (contacts.patches.normal_force * np.cos(contacts.angle))[own]
        assert vertical == pytest.approx(np.interp(contacts.x[own], x, result.history[f"force_{body}"]), rel=1e-9)


def test_strips_of_a_conformal_patch_have_the_wheels_own_slip(result, contacts):
    """Each strip's spin is the sine of its own angle over the rolling radius, d longitudinal / dy = -spin along the
    face, and the middle's creepage is the patch's. A patch that is a thousandth as wide is plane."""
    scene = result.scene
    table = contact_table(scene, 0.34, 0.44, 4e-3)
    carries = np.flatnonzero(table.stiffness[1] > 0)
    for semi, bend in ((1e-3, True), (1e-6, False)):
        wide = np.full(len(carries), semi)
        offset, angle = strip_angles(scene, table, 1, carries, wide, 24)
        middle, strips = strip_creepages(scene, table, 1, carries, wide, 24)
        assert (np.ptp(angle, axis=1).min() > 0.02) == bend
        slope = np.gradient(strips[..., 0], offset[0], axis=1)[:, 1:-1]
        np.testing.assert_allclose(slope, -strips[:, 1:-1, 2], rtol=2e-2)
        np.testing.assert_allclose(strips[..., 2] * scene.wheel.radius, -np.sin(angle), atol=5e-3)
        np.testing.assert_allclose(strips.mean(axis=1), middle, rtol=0.02, atol=2e-6)


def test_conformal_patches_wear_volume_and_differ_where_the_patch_is_wide(result, contacts):
    """Volume in the field is the strips'; pressures are the same; friction only takes energy; on the nose's narrow
    patches T gamma stays within 3 %."""
    own = pass_contacts(result, start=0.24, end=0.44, options=replace(COARSE, conformal=True))
    assert (own.patches.pressure == contacts.patches.pressure).all()
    assert (own.patches.frictional_power >= 0).all()
    field = wear_field(own, LAWS)
    strips = worn_area(LAWS["archard"], own.patches, own.speed).sum() * 2e-3
    assert field.volume("archard") / strips == pytest.approx(1, rel=1e-9)
    nose = own.body == 1
    assert own.tgamma[nose].sum() == pytest.approx(contacts.tgamma[nose].sum(), rel=0.03)
    assert np.abs(own.patches.frictional_power / contacts.patches.frictional_power - 1).max() > 0.005


def test_volume_of_the_field_is_that_of_the_patches(contacts):
    """And what is removed stays theirs where a narrow field misses a part of it."""
    field, y = wear_field(contacts, LAWS), contacts.position[:, 1]
    narrow = wear_field(contacts, LAWS, grid=(field.x, np.linspace(y.min(), y.max(), 100)))
    for name, law in LAWS.items():
        strips = worn_area(law, contacts.patches, contacts.speed).sum() * 2e-3
        assert field.volume(name) / strips == pytest.approx(1, rel=1e-9)
        assert narrow.removed[name] / strips == pytest.approx(1, rel=1e-12)
        assert narrow.volume(name) < (1 - 1e-6) * strips


def test_half_the_spacing_wears_the_same_volume(result):
    """The sum over patches is a trapezoidal rule along x: 2 mm against 4 mm."""
    volume = lambda d: wear_field(
        pass_contacts(result, spacing=d, start=0.24, end=0.44, options=COARSE), {"brr": LAWS["krause_poll"]}, spacing=d
    ).volume("brr")
    assert volume(4e-3) == pytest.approx(volume(2e-3), rel=0.03)


def test_no_patch_presses_more_than_the_hardness(contacts):
    means = contacts.patches.normal_force / contacts.patches.contact_area
    assert means.max() < 5e9 * 1.01
    assert means[contacts.enlarged > 1] == pytest.approx(5e9, rel=0.01)


def test_damage_function_along_the_pass(contacts):
    """The nose, which takes the load over the transfer, has the larger T gamma; both lie in regions that are told."""
    model = WholeLifeRail()
    top = {name: contacts.tgamma[contacts.body == b].max(initial=0.0) for b, name in enumerate(BODIES)}
    assert top["nose"] > top["wing"] > 0
    assert model.region(top["wing"]) in ("none", "fatigue") and np.isfinite(float(model.damage(top["nose"])))


def test_stretches_outside_of_the_pass_are_refused(result):
    with pytest.raises(ValueError, match="stay within"):
        pass_contacts(result, start=0.0, end=0.3)
    with pytest.raises(ValueError, match="no contact"):
        wear_field((), LAWS)


def test_zero_passes_wear_nothing_and_the_page_says_so(tmp_path):
    path = tmp_path / "case.toml"
    run = '[run.rigid_hertz]\nstart = "240 mm"\nend = "440 mm"\n\n[damage]\ncells = 12\npatch_spacing = "6 mm"'
    path.write_text(CASE.read_text().replace("[damage]", run))
    call("damage", path, "--passes", "0", "--out", tmp_path / "out")
    found = json.loads((tmp_path / "out" / "damage.json").read_text())
    assert all(d == 0 for body in found["bodies"].values() for d in body["deepest_by_law"].values())
    assert found["wheels"] == [] and found["wheel_ratios"]["P8-worn"] > 0
    assert "What drives it" in (tmp_path / "out" / "report.md").read_text()


def test_what_drives_the_noses_wear():
    """More friction wears more; Krause and Poll's law has no jump on this pass, so that the differences of 5 and 10 %
    agree in what does not move the impact along the nose."""
    changes = {"damage.cells": 12, "damage.patch_spacing": "6 mm", "damage.law": "krause_poll"}
    case = rail_fem.load_case(CASE, changes)
    found = {s.name: s for s in sensitivities(case.scene, case.damage, {"start": "240 mm", "end": "440 mm"})}
    assert set(found) == set(DRIVERS)
    assert found["friction"].elasticity > 0 and found["friction"].error < 0.3
    assert all(np.isfinite([s.elasticity, s.error]).all() for s in found.values())
