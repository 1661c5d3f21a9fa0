"""Plastic flow that goes on with the passes: the groove's law, the mix of wheels in closed form, heaps, a crossing."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from bem.exact.hertz import point_contact
from bem.exact.kalker import check_ellipse
from rail_fem.case.casefile import CaseError, load_case
from rail_fem.contact.contact_table import DEPTHS, VIRTUAL, hertz_constants
from rail_fem.contact.intersection import equivalent_paraboloid
from rail_fem.damage.crossing_site import dynamics, left_to_flow
from rail_fem.damage.evolution import Stepping, begin, evolve
from rail_fem.damage.flowed_surface import HEAPED, flow_in_passes, passes_to_flow, spread_along, with_heaps
from rail_fem.damage.groove import DEEPEST, FlowLaw, carried_beyond, groove_strips, grooves, held_beyond
from rail_fem.damage.rolling import no_more_slender
from rail_fem.damage.sites import crossing_site, stepping_of
from rail_fem.damage.study import read_state, write_state
from rail_fem.damage.worn_profile import WornOutError
from rail_fem.scene.steel import GRADES

CASES = Path(__file__).resolve().parents[2] / "cases" / "damage"
STEEL, MODULUS = GRADES["Mn13"], 115e9
RADII = np.array([[0.43, 7.5e-3], [0.43, 60e-3], [0.43, 3.0]])
FORCE = np.array([30e3, 60e3, 50e3])
QUICK = {
    "damage.cells": 12,
    "damage.patch_spacing": "6 mm",
    "damage.plan_spacing": "0.5 mm",
    "damage.plastic_flow": True,
}


def test_a_groove_as_deep_as_asked_presses_at_the_limit_of_its_hardened_steel():
    """Hertz on the flatter radius: p0 / k = 4 to 1e-3 (Hertz' constants are tabulated); below the limit nothing flows;
    harder steel flows less, and steel that has flowed asks for nothing more."""
    found = grooves(FORCE, RADII, MODULUS, FORCE, STEEL, np.zeros(3), 4.0)
    assert (found.depth[:2] > 1e-5).all() and found.depth[2] == 0
    for k in (0, 1):
        flatter = RADII[k].copy()
        for _ in range(60):  # R' = R (1 + u / d), with the d of R'
            virtual = np.clip(VIRTUAL * (FORCE[k] / hertz_constants(flatter[None], MODULUS)[0]) ** (2 / 3), *DEPTHS)
            flatter[1] = RADII[k, 1] * (1 + found.depth[k] / virtual)
        pressure = point_contact(FORCE[k], *flatter, MODULUS).max_pressure
        shear = STEEL.yield_stress(np.sqrt(found.square[k])) / np.sqrt(3)
        assert pressure / shear == pytest.approx(4.0, rel=1e-3)
        strain, flowed = np.sqrt(found.square[k : k + 1]), found.depth[k : k + 1]
        again = grooves(FORCE[k : k + 1], flatter[None], MODULUS, FORCE[k : k + 1], STEEL, strain, 4.001, flowed)
        assert again.depth[0] < 0.01 * found.depth[k]
    hard = grooves(FORCE, RADII, MODULUS, FORCE, STEEL.scaled(1.5), np.zeros(3), 4.0)
    assert (hard.depth[:2] < 0.7 * found.depth[:2]).all()
    huge = grooves(np.array([1e9]), RADII[:1], MODULUS, np.array([1e5]), STEEL, np.zeros(1), 4.0)
    none = grooves(np.zeros(0), np.zeros((0, 2)), MODULUS, np.zeros(0), STEEL, np.zeros(0), 4.0)
    assert huge.depth[0] == DEEPEST and len(none.depth) == 0


def test_the_groove_has_the_radius_that_the_table_would_measure():
    """A paraboloid's gap with its groove cut into it, measured as contact tables do: width and so radius across to 4 %
    (the intersection is no ellipse any more)."""
    radius, depth, virtual = 10e-3, 60e-6, 30e-6
    along, across = np.linspace(-14e-3, 14e-3, 201), np.linspace(-6e-3, 6e-3, 1201)
    gap = along[:, None] ** 2 / (2 * 0.43) + np.maximum(across**2 / (2 * radius) - depth, 0.0)
    least = gap.min(axis=1)[None], gap.min(axis=0)[None]
    radii, middle, _ = equivalent_paraboloid(gap[None], *least, along, across, np.array([virtual]))
    length, width = (2 * np.sqrt(2 * virtual * 0.43)), 2 * np.sqrt(2 * radius * (depth + virtual))
    assert middle[0] == pytest.approx(0, abs=1e-5)
    assert radii[0, 1] / radii[0, 0] == pytest.approx((width / length) ** 2, rel=0.01)
    assert radii[0, 1] == pytest.approx(radius * (1 + depth / virtual), rel=0.25)


@pytest.mark.parametrize("passes", [0.3, 2.0, 50.0, 1e6])
def test_flow_of_a_mix_is_that_of_its_equation(passes):
    """Closed form against a Runge-Kutta of eighth order, and two parts of the passes against all of them: 1e-9."""
    rng = np.random.default_rng(5)
    wanted = rng.uniform(0, 1e-3, (4, 6))
    wanted[1, 2] = wanted[2, 2] = 0.0
    wanted[:, 3] = 2e-4  # all alike
    wanted[:, 4] = 0.0
    shares, rate = [0.4, 0.3, 0.2, 0.1], FlowLaw().rate
    one = flow_in_passes(wanted, shares, passes, rate)
    slope = lambda _, f: rate * (np.array(shares)[:, None] * np.maximum(wanted - f, 0)).sum(axis=0)
    judge = solve_ivp(slope, (0, min(passes, 400)), np.zeros(6), method="DOP853", rtol=1e-11, atol=1e-16, max_step=0.5)
    np.testing.assert_allclose(one, judge.y[:, -1], atol=2e-9 if passes < 1e3 else 1e-7 * 1e-3 + 1e-9)
    first = flow_in_passes(wanted, shares, 0.4 * passes, rate)
    rest = flow_in_passes(np.maximum(wanted - first, 0), shares, 0.6 * passes, rate)
    np.testing.assert_allclose(first + rest, one, atol=1e-15)
    assert (one <= wanted.max(axis=0) + 1e-18).all() and not one[4]


@pytest.mark.parametrize("share", [0.5, 0.02])
def test_a_block_ends_where_the_deepest_groove_of_any_kind_has_flowed_a_step(share):
    """However rare the kind: in the closed form they flow the step to 1 %, the error of the passes, and no further."""
    wanted = np.array([[10e-6, 0.0, 30e-6], [700e-6, 90e-6, 0.0]])
    shares = [1 - share, share]
    passes = passes_to_flow(wanted, shares, 50e-6, 1.05)
    assert 49.4e-6 < flow_in_passes(wanted, shares, passes, 1.05).max() <= 50e-6
    assert passes_to_flow(wanted, shares, 700e-6, 1.05) == np.inf


def test_heaps_take_their_part_of_each_line_and_lie_where_the_face_falls_away():
    y = np.arange(120) * 0.25e-3
    groove = np.zeros((2, 5, 120))
    groove[1, 1:4] = np.maximum(1e-4 * (1 - ((y - 12e-3) / 2e-3) ** 2), 0)
    groove[0, 2] = np.maximum(2e-5 * (1 - ((y - 1e-3) / 1e-3) ** 2), 0)  # at the edge of its metal
    heights = np.broadcast_to(-0.2 * np.maximum(y - 14e-3, 0), groove.shape)
    metal = np.ones(groove.shape, bool)
    metal[0, :, :4] = False
    net = with_heaps(np.where(metal, groove, 0), heights, metal)
    np.testing.assert_allclose(net[1].sum(axis=-1), (1 - HEAPED) * groove[1].sum(axis=-1), atol=1e-18)
    assert net[0, 2].sum() > (1 - HEAPED) * np.where(metal, groove, 0)[0, 2].sum()  # the lip beside its metal
    assert net[1, 2].max() == pytest.approx(1e-4, rel=1e-2) and -net[1].min() < 0.14e-4
    assert not net[1, 0].any() and not net[~metal].any()
    falls, level = -net[1, 2, y > 14e-3].sum(), -net[1, 2, y < 10e-3].sum()
    assert falls > 3 * level > 0
    row = np.zeros((60, 3))
    row[30] = 1.0
    assert spread_along(row, 2e-3).sum() == pytest.approx(3.0, rel=1e-3)


def test_strips_of_a_groove_are_a_parabola():
    found = grooves(FORCE, RADII, MODULUS, FORCE, STEEL, np.zeros(3), 4.0)
    strips, width = groove_strips(found)
    np.testing.assert_allclose(strips[:, 0].sum(axis=1) * width, 4 / 3 * found.depth * found.half_width, rtol=2e-3)
    assert not strips[2].any()


def test_strain_does_not_depend_on_the_steps_in_which_a_groove_grows():
    """Half of a groove, then what its flatter radius still asks for: depth and square of the strain to 1e-3 (tabulated
    constants of Hertz)."""
    whole = grooves(FORCE, RADII, MODULUS, FORCE, STEEL, np.zeros(3), 7.0)
    half, flatter = whole.depth / 2, RADII.copy()
    for _ in range(80):
        virtual = np.clip(VIRTUAL * (FORCE / hertz_constants(flatter, MODULUS)) ** (2 / 3), *DEPTHS)
        flatter[:, 1] = RADII[:, 1] * (1 + half / virtual)
    rest = grooves(FORCE, flatter, MODULUS, FORCE, STEEL, np.sqrt(whole.square / 2), 7.0, half)
    np.testing.assert_allclose(half + rest.depth, whole.depth, rtol=1e-3)
    np.testing.assert_allclose(whole.square / 2 + rest.square, whole.square, rtol=1e-3)


def test_a_groove_goes_on_along_the_line_of_its_wheel():
    """Patches on a slanting line: those beyond lie on it to round-off, as the outermost; a body that the pass reaches
    at one end alone goes on there alone, and no body has none."""
    at = np.arange(0.26, 0.4, 4e-3)
    place, x = np.column_stack([at, 0.03 + 0.1 * (at - 0.26)]), np.arange(0.2, 0.5, 4e-3)
    of, where = carried_beyond(place, at, 4e-3, x)
    np.testing.assert_allclose(where[:, 1], 0.03 + 0.1 * (where[:, 0] - 0.26), atol=1e-12)
    assert x[0] < where[:, 0].min() < x[2] and x[-3] < where[:, 0].max() < x[-1]
    assert set(of[len(at) :]) == {0, len(at) - 1}
    of, where = carried_beyond(place[10:], at, 4e-3, x)
    assert where[:, 0].min() == at[10] and set(of[len(at) - 10 :]) == {len(at) - 11}
    assert not len(carried_beyond(place[:0], at, 4e-3, x)[0])
    on_the_edge = np.linspace(0.2, at[-1] + 0.06, 50)
    assert carried_beyond(place, at, 0.06, on_the_edge)[1][:, 0].max() < on_the_edge[-1]


def test_a_groove_goes_on_beyond_the_passes_ends_and_is_mirrored_with_its_track():
    field = np.zeros((2, 40, 60))
    field[:, 10:30, 20:40] = np.linspace(1, 2, 20)[:, None]
    x = np.arange(40) * 2e-3
    held = held_beyond(field, np.array([x[10], x[29]]), x)
    assert (held[:, 11:28] == field[:, 11:28]).all()
    assert (held[:, :11] == field[:, 11:12]).all() and (held[:, 28:] == field[:, 27:28]).all()
    assert (held_beyond(field, np.zeros(0), x) == field).all()
    heights, metal = np.broadcast_to(-0.1 * np.arange(60) * 1e-3, field.shape), np.ones(field.shape, bool)
    one = with_heaps(field, heights, metal)
    other = with_heaps(field[..., ::-1], heights[..., ::-1], metal)
    np.testing.assert_allclose(other[..., ::-1], one, atol=1e-14)


@pytest.fixture(scope="module")
def site():
    case = load_case(CASES / "crossing_transfer.toml", QUICK)
    return crossing_site(case.scene, case.damage, {"start": "280 mm", "end": "420 mm"})


def test_a_crossing_flows_first_and_heaps_a_part_of_its_metal(site, tmp_path):
    """What is heaped up is a tenth of what flowed, pressures fall, the steel hardens; a study that was stopped goes on
    to the same bits."""
    step = Stepping(block=2, smoothing=0.5e-3, deepest=1e9, flow_step=200e-6)
    states = list(evolve(site, 4, step))
    end = states[-1]
    assert end.worn.flow_depth > 20 * end.deepest > 0
    heaped = -np.minimum(end.worn.flow, 0).sum() / np.maximum(end.worn.flow, 0).sum()
    assert 0.5 * HEAPED < heaped <= HEAPED  # some heaps lie where a later groove is
    assert end.worn.amount(end.worn.depth) == pytest.approx(end.removed - end.beyond, rel=1e-9)
    assert end.worn.strain.max() > 0.01 and (end.worn.strain >= 0).all()
    first, last = (site.rate(s).kinds[0][1].facts.of(1).max_pressure.max() for s in (site.first(), end.worn))
    assert last < 0.8 * first
    write_state(tmp_path / "state.npz", states[1], "x")
    *_, again = evolve(site, 4, step, read_state(tmp_path / "state.npz", "x", site))
    for name in ("depth", "flow", "strain"):
        assert (getattr(again.worn, name) == getattr(end.worn, name)).all()
    assert (again.log == end.log).all() and end.log[-1, 6] == end.worn.flow_depth


def test_a_wheel_in_its_own_groove_does_not_strike_where_the_pass_begins(site):
    """Two passes' flow moves the wing's force by less than a tenth of the static load over the first 40 mm: the groove
    is nearly even there. Carried on beside the line in which the wheel comes it rang by as much as that load."""
    *_, end = evolve(site, 2, Stepping(block=2, deepest=1e9, flow_step=100e-6))
    one, load = site.passes[0], site.passes[0].scene.static_wheel_load
    flat, grooved = (
        dynamics(one, site.crossing(shape), site.run, site.settings.patch_spacing)[1]
        for shape in (site.first(), end.worn)
    )
    at = np.linspace(0.282, 0.32, 50)
    change = np.interp(at, grooved.x, grooved.force[0]) - np.interp(at, flat.x, flat.force[0])
    assert end.worn.flow[0].max() > 50e-6 and np.abs(change).max() < 0.1 * load


def test_steel_is_indented_by_what_is_still_to_flow(site):
    """As virgin where none has flowed, less and less after, and at rest not at all: its pass is the elastic one."""
    one, table = (
        site.passes[0],
        dynamics(site.passes[0], site.crossing(site.first()), site.run, site.settings.patch_spacing)[0],
    )
    first = site.first()
    assert (left_to_flow(site.flow_law, site.grid, one.scene, first, table) == 1).all()
    parts = []
    for passes in (1, 3):
        *_, end = evolve(site, passes, Stepping(block=2, deepest=1e9, flow_step=100e-6))
        parts.append(left_to_flow(site.flow_law, site.grid, one.scene, end.worn, table)[1, table.stiffness[1] > 0])
    assert (parts[0] >= 0).all() and parts[1].mean() < parts[0].mean() < 1
    runs = [site.run, site.run.model_copy(update={"plastic_indentation": False})]
    rest = lambda table: np.zeros(table.stiffness.shape)
    at_rest, elastic = (
        dynamics(one, site.crossing(first), run, site.settings.patch_spacing, rest)[1].force for run in runs
    )
    np.testing.assert_allclose(at_rest, elastic, rtol=1e-9, atol=1e-6)


def test_steel_that_flows_until_the_shape_roughens_ends_the_study_with_both_forces(site):
    """As if the first block had found 40 % of the force: what came before stands."""
    step = Stepping(block=2, smoothing=0.5e-3, deepest=1e9, flow_step=200e-6)
    state = next(evolve(site, 4, step))
    state.log[0, 5] *= 0.4
    with pytest.raises(WornOutError, match=r"flowed 0\.\d+ mm deep and the largest force has grown from \d+ to \d+ kN"):
        next(evolve(site, 4, step, state))


def test_a_patch_longer_than_any_coefficient_is_widened_and_others_are_not():
    semi = np.array([[60e-3, 0.9e-3], [3e-3, 4e-3], [0.5e-3, 40e-3]])
    held = no_more_slender(semi)
    assert (held[1] == semi[1]).all() and (held.max(axis=1) == semi.max(axis=1)).all()
    assert (held >= semi).all() and held[0, 1] > semi[0, 1] and held[2, 0] > semi[2, 0]
    for a, b in held:
        check_ellipse(a / b, 0.3)


def test_steel_that_is_elastic_does_not_flow(site):
    hard = replace(site, flow_law=FlowLaw(limit=1e3))
    *_, end = evolve(hard, 4, Stepping(block=4))
    assert not end.worn.flow.any() and end.worn.depth.any()


def test_no_passes_do_not_flow(site):
    assert list(evolve(site, 0, Stepping())) == []
    shape = site.first()
    assert not site.flowed(shape, site.rate(shape), 0.0).flow.any()


def test_half_the_step_of_the_flow_presses_the_same_groove(site):
    """Two passes in shapes of 100 and 50 um: the deepest groove differs by the step's error, of first order, 5 %."""
    ends = []
    for step in (100e-6, 50e-6):
        *_, end = evolve(site, 2, Stepping(block=2, deepest=1e9, flow_step=step))
        ends.append(end.worn.flow_depth)
    assert ends[1] == pytest.approx(ends[0], rel=0.05)


def test_no_block_flows_deeper_than_a_step_however_many_passes_were_done(site):
    """As if 1,000 passes were done, of which the least share is 100: the end of a block flows no deeper than the step,
    by the grooves themselves, which spreading along makes shallower."""
    state = replace(begin(site), passes=1000.0)
    step = Stepping(block=100, least_share=0.1, deepest=1e9, flow_step=50e-6)
    after = next(evolve(site, 1100, step, state))
    assert 0 < after.worn.flow_depth <= 50e-6 and after.passes < 1001


def test_a_switch_does_not_flow():
    with pytest.raises(CaseError, match="plastic_flow: plastic flow is known of a crossing"):
        load_case(CASES / "switch_section.toml", {"damage.plastic_flow": True})


@pytest.mark.parametrize(("name", "value"), [("grindings", [3.0]), ("weldings", [3.0]), ("flow", "runs/plastic")])
def test_what_would_flow_twice_is_refused(name, value):
    with pytest.raises(CaseError, match="leave one of them out"):
        load_case(CASES / "crossing_flow.toml", {f"damage.{name}": value})


def test_the_shipped_case_flows_where_its_wheel_does_not_land_again():
    """On its whole path the same passes end after one or two, as grooves by the law roughen the nose."""
    quick = {"damage.cells": 12, "damage.plan_spacing": "0.5 mm", "damage.patch_spacing": "4 mm"}
    for changes in ({}, {"run.rigid_hertz.end": "700 mm"}):
        case = load_case(CASES / "crossing_flow.toml", quick | changes)
        site = crossing_site(case.scene, case.damage, case.runs["rigid_hertz"])
        states = evolve(site, 2, stepping_of(case.damage))
        if changes:
            with pytest.raises(WornOutError, match="roughens"):
                list(states)
        else:
            assert 0.3e-3 < list(states)[-1].worn.flow_depth < 0.6e-3


# fall of the nose's running surface [um] after passes of fe_full on the same steel, elements of 4 mm, 260 to 470 mm of
# cases/repeated_passes.toml without its tables "cyclic"; on 2 mm the first three are 1 to 5 % less
EXPLICIT = {"P8-worn": {1: 438, 2: 538, 5: 613, 10: 644}, "P8": {1: 443, 2: 589, 5: 772, 10: 823}}


@pytest.mark.validate
@pytest.mark.parametrize("wheel", list(EXPLICIT))
def test_the_nose_sinks_as_under_explicit_passes_and_comes_to_rest(wheel):
    """Within a quarter: the law's nose is 9 to 23 % too shallow, why is not shown. From 40 to 60 it sinks by < 1 um."""
    changes = {"scene.wheel.profile": wheel, "damage.patch_spacing": "2 mm", "damage.cells": 12}
    case = load_case(CASES / "crossing_flow.toml", changes | {"damage.plan_spacing": "0.5 mm"})
    site = crossing_site(case.scene, case.damage, {"start": "260 mm", "end": "470 mm"})
    states = [begin(site), *evolve(site, 60, stepping_of(case.damage))]
    passes, depth = np.array([(s.passes, 1e6 * s.worn.flow[1].max()) for s in states]).T
    for number, explicit in EXPLICIT[wheel].items():
        assert np.interp(number, passes, depth) == pytest.approx(explicit, rel=0.25)
    assert depth[-1] - np.interp(40, passes, depth) < 1
