"""A crossing that wears: volume, blocks, wheels of a mix, several processes, going on after a kill, what is refused."""

import json
from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from rail_fem.case.casefile import CaseError, load_case
from rail_fem.case.examples import example
from rail_fem.damage import crossing_site as crossing_site_module
from rail_fem.damage import study
from rail_fem.damage.evolution import Stepping, begin, evolve
from rail_fem.damage.fatigue import fatigue_of
from rail_fem.damage.figures import passes_panels, tgamma_panels
from rail_fem.damage.flow import FlowError, read_flow
from rail_fem.damage.sites import crossing_site, stepping_of, traffic_of
from rail_fem.damage.traffic import WELD, Event
from rail_fem.damage.wear import laws_of
from rail_fem.damage.worn_profile import WornOutError
from rail_fem.damage.worn_surface import WornSurface
from rail_fem.hierarchy import solve
from rail_fem.processes.pool import Pool, Workers
from rail_fem.settings.damage import DamageSettings
from tests.commands import call

CASE = example("damage/crossing_transfer")
QUICK = {"damage.cells": 12, "damage.patch_spacing": "6 mm", "damage.plan_spacing": "0.5 mm"}
RUN = {"start": "280 mm", "end": "420 mm"}


def quick_site(changes=None, pool=None):
    case = load_case(CASE, QUICK | (changes or {}))
    return crossing_site(case.scene, case.damage, RUN, pool)


@pytest.fixture(scope="module")
def site():
    return quick_site()


@pytest.fixture(scope="module")
def rate(site):
    return site.rate(site.first())


def test_volume_goes_from_the_strips_into_the_surface(site, rate):
    """From the patches' strips to the plan and into the surface: 1e-12 for every law."""
    for law in site.laws:
        new, _ = site.first().worn(rate.depth[law] * 10)
        assert new.amount(new.depth) == pytest.approx(10 * (rate.removed[law] - rate.beyond[law]), rel=1e-12)
    fields = new.crossing(site.base)
    assert fields.wing.volume + fields.nose.volume == pytest.approx(new.amount(new.depth), rel=1e-12)


def test_volume_is_kept_over_blocks_and_nothing_is_worn_beside_the_metal(site):
    *_, end = evolve(site, 20, Stepping(block=10, smoothing=0.5e-3))
    volume = end.worn.amount(end.worn.depth)
    assert volume == pytest.approx(end.removed - end.beyond, rel=1e-9) and volume > 0
    assert end.deepest == pytest.approx(end.depth.max(), rel=1e-12)


def test_figures_tell_forces_of_the_shape_they_are_of_and_no_patch_where_the_wheel_flies(site):
    """A block's rate is that of the shape in its middle: at first was drawn where the first block ends. Over the 70 mm
    of a flight a line of 2 N joined both patches."""
    *_, end = evolve(site, 20, Stepping(block=10, smoothing=0.5e-3))
    settings = DamageSettings(hardness="5 GPa")
    _, tgamma, force = passes_panels(settings, end)
    assert [list(panel.lines[name][0]) for panel, name in ((tgamma, "largest of all points"), (force, "_force"))] == [
        [5, 15]
    ] * 2
    log = end.log.copy()
    log[:, 4] = 2 * log[:, 1]  # an error of twice the wear: no bar reaches to wear below 0
    wear, *_ = passes_panels(settings, replace(end, log=log))
    deepest, (below, above) = wear.lines["deepest; bars: error of the blocks"][1]
    assert (below == deepest).all() and (above == 2 * deepest).all() and deepest[-1] > 0
    case = load_case(CASE, QUICK | {"scene.wheel.profile": "P8", "scene.foundation.stiffness": "80 kN/mm"})
    flown = crossing_site(case.scene, case.damage, {"start": "95 mm", "end": "560 mm"})
    rate, state = flown.rate(flown.first()), begin(flown)
    for panel in tgamma_panels(case.damage, state, rate, rate):
        x = next(line[0] for name, line in panel.lines.items() if name.startswith("nose"))
        assert np.isnan(x).sum() == 1 and np.nanmax(np.diff(x)) < 3 * 6.0  # mm


def test_bodies_out_of_reach_change_nothing(site, rate, monkeypatch):
    """A body 3 mm below the other is not looked at: forces and wear are those with all of it, to the last bit."""
    monkeypatch.setattr(crossing_site_module, "WITHIN", np.inf)
    whole = site.rate(site.first())
    assert all((whole.depth[law] == rate.depth[law]).all() for law in site.laws) and rate.work.any()
    assert (whole.kinds[0][1].force == rate.kinds[0][1].force).all()


def test_a_wheel_heals_the_cracks_on_its_own_line_alone(site, rate):
    """Half of the passes are made 8 mm beside: damage across the rail is half of each line's own, also where one is
    above 0 and the other below, and no more lines than those under patches have any."""
    (one,), shift = site.passes, 8e-3
    two = replace(site, passes=(replace(one, weight=0.5), replace(one, weight=0.5, shift=shift)))
    both, alone = two.rate(site.first()), replace(site, passes=(replace(one, shift=shift),)).rate(site.first())
    assert both.crack == pytest.approx((rate.crack + alone.crack) / 2, abs=1e-18)
    facts = rate.kinds[0][1].facts
    damage = fatigue_of(site.settings).damage(facts.tgamma)
    assert rate.crack.max() == pytest.approx(damage.max(), rel=0.1) and rate.crack.max() <= damage.max() * (1 + 1e-12)
    assert rate.crack.min() == pytest.approx(min(damage.min(), 0), rel=0.1)
    assert not rate.crack[:, ~(rate.work > 0).any(axis=(0, 2))].any()


def test_wear_changes_the_contact_that_made_it(site, rate):
    """Under the deepest wear the nose gets flatter: its largest pressure falls, and so does its largest T gamma."""
    worn, _ = site.first().worn(rate.depth["archard"] * (20e-6 / rate.depth["archard"].max()))
    after = site.rate(worn)
    one, two = (r.kinds[0][1].facts.of(1) for r in (rate, after))
    assert two.max_pressure.max() < one.max_pressure.max()
    assert after.depth["archard"].max() < rate.depth["archard"].max()


def test_halved_blocks_wear_nearly_the_same(site):
    """One block of 6 um, two and four: volumes within 1 %; contact points that come and go leave no clean order."""
    passes = 6e-6 / site.rate(site.first()).depth["krause_poll"].max()
    ends = []
    for parts in (1, 2, 4):
        *_, end = evolve(site, passes, Stepping("krause_poll", block=passes / parts, smoothing=0.5e-3))
        ends.append(end.worn.amount(end.worn.depth))
    assert ends[0] == pytest.approx(ends[2], rel=0.01) and ends[1] == pytest.approx(ends[2], rel=0.01)


def test_a_pass_that_wears_deeper_than_a_block_may_is_a_block(site, rate):
    deepest = 0.5 * rate.depth["archard"].max()
    assert [state.passes for state in evolve(site, 2, Stepping(deepest=deepest))] == [1.0, 2.0]


def test_the_least_share_of_a_block_is_the_cases_own():
    """A tenth of the passes done on a crossing, a fiftieth on a switch, or what the case says."""
    switch = CASE.parent / "switch_section.toml"
    shares = [stepping_of(load_case(path).damage).least_share for path in (CASE, switch)]
    assert shares == [0.1, 0.02]
    for path in (CASE, switch):
        assert stepping_of(load_case(path, {"damage.block_share": 0.05}).damage).least_share == 0.05
    with pytest.raises(CaseError, match="block_share"):
        load_case(CASE, {"damage.block_share": 2.0})


def test_a_mix_is_the_mean_of_its_wheels_on_any_number_of_processes(rate):
    changes = {"damage.traffic": [{"wheel": "P8-worn", "share": 0.25}, {"wheel": "P8", "share": 0.75}]}
    alone = quick_site({"scene.wheel.profile": "P8"})
    other = alone.rate(alone.first())
    with Pool(Workers(2)) as pool:
        both = quick_site(changes, pool)
        mixed = both.rate(both.first())
    for law in both.laws:
        assert mixed.removed[law] == pytest.approx(0.25 * rate.removed[law] + 0.75 * other.removed[law], rel=1e-12)


def test_lateral_scatter_spreads_the_wear(site, rate):
    """Five lateral positions of one wheel: forces and points of each its own, the band wider, the deepest less."""
    wide = quick_site({"damage.lateral_scatter": "1 mm"})
    scattered = wide.rate(wide.first())
    assert len(wide.passes) == 5 and sum(p.weight for p in wide.passes) == pytest.approx(1)
    columns = lambda r: (r.depth["krause_poll"].sum(axis=(0, 1)) > 0).sum()
    assert columns(scattered) > columns(rate)
    forces = [own.force.max() for _, own in scattered.kinds]
    assert max(forces) > 1.001 * min(forces)


def test_steps_that_cannot_be_are_refused(site):
    first = site.first()
    for bad, said in ((-1e-9, "0 or more"), (np.nan, "finite"), (1e-3, "one step may take")):
        depth = np.zeros(first.shape)
        depth[0, 3, 4] = bad
        with pytest.raises(WornOutError, match=said):
            first.worn(depth)
    fast = replace(site, laws=laws_of(load_case(CASE, QUICK | {"damage.wear_coefficient": 1.0}).damage))
    with pytest.raises(WornOutError, match="limit is 0.05 mm|one step may take"):
        list(evolve(fast, 1e7, Stepping(limit=50e-6, deepest=20e-6)))


def test_welding_begins_anew_and_grinding_costs_height(site):
    """Welded after 20 of 30 passes: the shape of 10 passes on the first one. Ground: the same, lower by the deepest
    wear and what grinding takes."""
    *_, alone = evolve(site, 10, Stepping(block=10))
    *_, long = evolve(site, 20, Stepping(block=10))
    for event, lost in ((WELD, 0.0), (Event(1.0, removes=0.2e-3), long.deepest + 0.2e-3)):
        *_, end = evolve(site, 30, Stepping(block=10, events=((20, event),)))
        assert (end.worn.depth == alone.worn.depth).all() and end.passes == 30 and end.began == 20
        assert end.lost == pytest.approx(lost, rel=1e-12) and end.resets == 1 and len(end.log) == 3
        assert end.worn.amount(end.worn.depth) == pytest.approx(end.removed - end.beyond, rel=1e-9)


def test_kinds_of_wheel_have_axle_loads_of_their_own():
    """Two wheelsets on two bogies: 14 t an axle is 13 t sprung on each of four."""
    scene = load_case(CASE).scene
    kinds = [{"wheel": "P8", "share": 0.5, "axle_load": "14 t"}, {"wheel": "P8-worn", "share": 0.5}]
    settings = DamageSettings(hardness="5 GPa", traffic=[kinds[0], kinds[1] | {"axle_load": "22.5 t"}])
    light, heavy = (own for own, _ in traffic_of(scene, settings))
    assert light.vehicle.vehicle_sprung_mass == pytest.approx(
        4 * (14e3 - light.vehicle.wheelset_unsprung_mass), rel=1e-12
    )
    assert heavy.static_wheel_load == pytest.approx(22.5e3 / 2 * 9.81, rel=1e-12)
    with pytest.raises(ValueError, match=r"traffic\[0\].*no more than the wheelset's own 1 t"):
        traffic_of(scene, DamageSettings(hardness="5 GPa", traffic=[kinds[0] | {"axle_load": "1 t"}, kinds[1]]))


@pytest.mark.parametrize(
    "wheel, said", [("P9", "P8, P8-worn, P8-hollow"), ("none.txt", "no file 'none.txt'|no file \"none.txt\"")]
)
def test_a_wheel_of_the_traffic_that_is_none_is_told_by_its_place(wheel, said):
    """In words of the case file, without the names of its reader."""
    with pytest.raises(CaseError, match=said) as told:
        load_case(CASE, {"damage.traffic": [{"wheel": "P8", "share": 0.5}, {"wheel": wheel, "share": 0.5}]})
    assert "damage.traffic[1].wheel: " in str(told.value) and "input_value" not in str(told.value)


def test_shares_that_do_not_add_up_and_corners_that_do_not_grow_are_refused():
    with pytest.raises(CaseError, match="shares add up to 0.5"):
        load_case(CASE, {"damage.traffic": [{"wheel": "P8", "share": 0.5}]})
    with pytest.raises(CaseError, match="must grow"):
        load_case(CASE, {"damage.onset": "100 N"})


def test_smoothing_keeps_volume_and_sign():
    plain = WornSurface.unworn(np.arange(50) * 2e-3, np.arange(120) * 0.25e-3)
    depth = np.zeros(plain.shape)
    depth[1, 20:24, 50:60] = 1e-6
    smooth = plain.smoothed(depth, 0.5e-3)
    assert smooth.sum() == pytest.approx(depth.sum(), rel=1e-12) and smooth.min() >= 0
    assert smooth[1, 22, 48] > 0 and not smooth[0].any() and plain.smoothed(depth, 0.0) is depth


damage = partial(call, "damage")


def small_case(tmp_path):
    run = '[run.rigid_hertz]\nstart = "300 mm"\nend = "400 mm"\n\n'
    run += '[damage]\ncells = 12\npatch_spacing = "8 mm"\nblock = 50'
    path = tmp_path / "case.toml"
    path.write_text(CASE.read_text().replace("[damage]", run).replace("sensitivities = true", ""))
    return path


def test_a_killed_study_of_a_crossing_goes_on_where_it_was(tmp_path, monkeypatch):
    path, whole, cut = small_case(tmp_path), tmp_path / "whole", tmp_path / "cut"
    draw = study.study_figures
    monkeypatch.setattr(study, "study_figures", lambda *arguments: [])
    answer = damage(path, "--passes", "100", "--out", whole)
    monkeypatch.setattr(study, "study_figures", draw)
    write = study.write_state

    def killed(*arguments):
        write(*arguments)
        raise KeyboardInterrupt

    monkeypatch.setattr(study, "write_state", killed)
    damage(path, "--passes", "100", "--out", cut, code=130)
    monkeypatch.setattr(study, "write_state", write)
    assert "going on after 50 passes" in damage(path, "--passes", "100", "--out", cut, "--restart").output
    one, two = np.load(whole / "damage.npz"), np.load(cut / "damage.npz")
    assert set(one) == set(two) and all((one[name] == two[name]).all() for name in one)
    found = json.loads((cut / "damage.json").read_text())
    assert found["passes"] == 100 and found["removed_error"] < 1e-6 and found["bodies"]["nose"]["deepest_by_law"]
    names = {"sections", "depth_plan", "tgamma", "depth_band", "passes", "shakedown", "wheel_wear"}
    assert {p.stem for p in (cut / "figures").glob("*.png")} == names
    assert "How sure" in call("show", cut).output
    answer = call("compare", whole, cut, "--out", tmp_path / "side")
    assert "| nose" in answer.output and (tmp_path / "side" / "compare.md").is_file()
    assert "no damage.json" in call("compare", whole, tmp_path, code=2).output


def test_a_study_that_wears_to_its_limit_tells_what_had_worn_by_then(tmp_path, monkeypatch):
    monkeypatch.setattr(study, "study_figures", lambda *arguments: [])
    answer = damage(
        small_case(tmp_path),
        "--passes",
        "100",
        "--set",
        "damage.depth_limit=0.035 mm",
        "--out",
        tmp_path / "out",
        code=1,
    )
    assert "worn 0.05 mm deep after 100 passes, the limit is" in answer.output.splitlines()[-1], answer.output
    found = json.loads((tmp_path / "out" / "damage.json").read_text())
    assert found["passes"] == 50 and "Ended before its 100 passes" in (tmp_path / "out" / "report.md").read_text()


def test_a_state_of_another_definition_is_refused_in_a_sentence(tmp_path, monkeypatch):
    """A study begun when a cell had the k of its centre is not gone on with."""
    path, out = small_case(tmp_path), tmp_path / "out"
    mark = study.study_mark
    older = lambda *arguments: {k: v for k, v in mark(*arguments).items() if k != "definition"} | {"version": 4}
    monkeypatch.setattr(study, "study_mark", older)
    damage(path, "--passes", "0", "--out", out)
    monkeypatch.setattr(study, "study_mark", mark)
    answer = damage(path, "--passes", "0", "--out", out, "--restart", code=2)
    assert "holds another case" in answer.output
    assert f"definition: None there, {study.DEFINITION[:40]}" in answer.output


def test_numerics_that_a_case_leaves_out_belong_to_the_study_as_those_that_it_gives(tmp_path):
    """So that a study begun by another default is not gone on with."""
    (tmp_path / "plain.toml").write_text(CASE.read_text())
    marks = []
    for law in ("rolled", "fully plastic"):
        (tmp_path / "told.toml").write_text(CASE.read_text() + f'\n[run.rigid_hertz]\nindentation_law = "{law}"\n')
        case = load_case(tmp_path / "told.toml")
        marks.append(study.study_mark(case, case.damage))
    plain = load_case(tmp_path / "plain.toml")
    assert study.study_mark(plain, plain.damage) == marks[0] != marks[1]


def test_a_wheelset_of_several_degrees_of_freedom_is_refused():
    case = load_case(CASE)
    with pytest.raises(ValueError, match="lateral position is given"):
        crossing_site(case.scene, case.damage, {"degrees_of_freedom": "roll"})


@pytest.mark.validate
def test_wear_begins_on_the_surface_that_plastic_flow_has_left(tmp_path, site, rate):
    """A run of bem_plastic before it: the nose is flatter, so that its pressure at first is lower there; the fields
    agree with the run's where it has cells; a run of another crossing is refused."""
    run = {"cell_size": "3 mm", "step": "12 mm", "error_estimate": False, "start": "330 mm", "end": "380 mm"}
    scene = load_case(CASE).scene
    solve("bem_plastic", scene, run, folder=tmp_path).save(tmp_path)
    flow, ends = read_flow(tmp_path, scene, site.grid)
    assert flow[1].max() > 1e-6 and ends == pytest.approx((0.330, 0.380), abs=1e-3)
    with np.load(tmp_path / "plastic.npz") as stored:
        assert flow[1].max() <= stored["nose_lowered"].max()
    last, beyond = (flow[1][np.searchsorted(site.grid[0], at)] for at in (0.366, 0.400))
    assert beyond.max() > 0.5 * last.max()
    with pytest.raises(FlowError, match="run its model over the study's path"):
        read_flow(tmp_path, scene, (site.grid[0] + 1.0, site.grid[1]))
    after = replace(site, flow=flow)
    flowed = after.rate(after.first())
    one, two = (r.kinds[0][1].facts.of(1) for r in (rate, flowed))
    at = lambda facts: np.interp(0.372, facts.x, facts.max_pressure)
    assert at(two) < at(one)
    with pytest.raises(FlowError, match="other numbers"):
        read_flow(tmp_path, scene.replace(crossing={"ratio": 9.25}), site.grid)
    with pytest.raises(FlowError, match="finished run of bem_plastic"):
        read_flow(tmp_path / "none", scene, site.grid)


def test_frictions_at_the_ends_of_the_range():
    """None: nothing wears, in any number of passes. 10: patches stick, what slips wears, all finite."""
    none = quick_site({"scene.friction": 0.0})
    *_, end = evolve(none, 1e8, Stepping(deepest=5e-6))
    assert not end.worn.depth.any() and end.passes == 1e8
    rough = quick_site({"scene.friction": 10.0})
    found = rough.rate(rough.first())
    assert all(np.isfinite(own).all() and own.min() >= 0 for own in found.depth.values())


def test_a_study_of_a_switch_takes_no_flow_of_a_crossing():
    switch = CASE.parent / "switch_section.toml"
    with pytest.raises(CaseError, match="flow: plastic flow is known of a crossing"):
        load_case(switch, {"damage.flow": "runs/flow"})
