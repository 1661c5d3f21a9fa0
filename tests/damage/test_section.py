"""A switch's section that wears: what a pass takes off, blocks, volume, what a study refuses, going on after a kill."""

import json
import re
from dataclasses import replace
from functools import partial
from types import SimpleNamespace

import numpy as np
import pytest

from geometry.contact.prismatic_search import ContactSearch
from geometry.profiles.doctor import examine
from geometry.profiles.formats.by_suffix import read_raw, write_profile
from geometry.profiles.wheel import wheel_profile
from geometry.wheelset import Wheelset
from rail_fem.case.casefile import CaseError, load_case
from rail_fem.case.examples import example
from rail_fem.contact.load_sharing import static_equilibrium
from rail_fem.damage import study
from rail_fem.damage.evolution import Stepping, begin, evolve
from rail_fem.damage.fatigue import fatigue_of
from rail_fem.damage.patch_figure import points_of, shown_pass
from rail_fem.damage.report import study_report
from rail_fem.damage.rolling import LONGEST, tractions
from rail_fem.damage.section import scattered, sine_positions
from rail_fem.damage.side_by_side import ComparisonError, studies_table
from rail_fem.damage.sites import stepping_of, switch_section, tonnage_of
from rail_fem.damage.summary import _share_by, shortest_block, summary, years_of
from rail_fem.damage.wear import laws_of, worn_area
from rail_fem.damage.worn_profile import WornOutError, depth_between
from tests.commands import call

CASE = example("damage/switch_section")
QUICK = {"damage.cells": 20, "damage.switch.positions": 3}


@pytest.fixture(scope="module")
def section():
    case = load_case(CASE, QUICK)
    return switch_section(case.scene, case.damage)


@pytest.fixture(scope="module")
def first_rate(section):
    return section.rate(section.first())


def test_what_cells_in_seizure_wear_is_a_share_of_all_wheels_wear():
    """Three quarters of the wheels wear 4 of which 1 in seizure, the others 8 of which 4: (0.75 + 1) / (3 + 2)."""
    wheels = [(0.75, [3.0, 1.0], [0.0, 1.0]), (0.25, [4.0, 4.0], [4.0, 0.0])]
    of = lambda share, all_wear, seized: (share, SimpleNamespace(archard=np.array(all_wear), seized=np.array(seized)))
    assert _share_by("seized", [of(*one) for one in wheels]) == pytest.approx(0.35)
    assert _share_by("seized", [of(1.0, [0.0], [0.0])]) == 0.0


def test_the_sine_goes_in_and_out_of_flange_contact(first_rate):
    """At its crest two points carry on the left, stock rail's head and switch rail's corner; elsewhere one. The head's
    T gamma is far below the corner's, whose wear is 18 times and more the head's, as the thesis' example shows."""
    counts = [sum(p.side == "left" for p in r.points) for _, r in first_rate.kinds]
    assert counts == [2, 1, 1]
    corner, head = sorted((p for p in first_rate.kinds[0][1].points if p.side == "left"), key=lambda p: -p.angle)
    assert np.degrees(corner.angle) > 60 > 10 > np.degrees(head.angle)
    assert corner.tgamma > 2 * head.tgamma
    depth = first_rate.depth["archard_patch"]
    s = section_line(first_rate)
    assert depth[s < -0.030].max() > 18 * depth[s > -0.025].max()


def test_the_pass_that_is_drawn_shares_its_load_between_head_and_corner(first_rate):
    """Of the three positions the crest's; the largest force, the head's, comes first."""
    shown = shown_pass(first_rate)
    assert shown is first_rate.kinds[0][1]
    head, corner = points_of(shown)
    assert head.normal_force > corner.normal_force and head.angle < corner.angle


def section_line(rate):
    """y of the nodes of the section at first [m]."""
    case = load_case(CASE, QUICK)
    return switch_section(case.scene, case.damage).first().points[:, 0]


def test_cracks_fall_where_their_contact_lies():
    """A yawed wheelset wears the stock rail's head (T gamma 300 N), which heals no crack of the switch rail's corner
    31 mm away: 1.57e-6 a pass there, the sum over the corner's own contacts (1.27 years of 500,000 axles; summed over
    both rails it was -9.66e-6, never)."""
    case = load_case(CASE, {"damage.cells": 20, "damage.switch.positions": 6, "damage.switch.yaw": "8 mrad"})
    section = switch_section(case.scene, case.damage)
    rate = section.rate(section.first())
    y, model = section.first().points[:, 0], fatigue_of(section.settings)
    fallen = [
        (r.passing.weight * float(model.damage(p.tgamma)), p.position[0])
        for _, r in rate.kinds
        for p in r.points
        if p.side == "left"
    ]
    corner, head = (sum(d for d, at in fallen if (at < -0.03) == own) for own in (True, False))
    assert rate.crack.max() == pytest.approx(corner, rel=1e-12) and -0.044 < y[rate.crack.argmax()] < -0.042
    assert rate.crack.min() == pytest.approx(head, rel=1e-12) and 1 / (500e3 * corner) == pytest.approx(1.27, abs=0.01)
    assert sum(d for d, _ in fallen) < 0
    *_, end = evolve(section, 4.0, Stepping(block=2.0))
    assert end.crack.min() == 0 and end.crack.max() == pytest.approx(4 * corner, rel=0.02)


def test_years_are_told_within_three_times_what_was_run_and_by_the_last_rate():
    """1,000 passes wore 1 mm, the last one 2 um (2 mm in 1,000): 4 mm come after 2,500 passes, 5 mm are beyond 3,000.
    Places stay apart: what wears fast need not be what is deep, and a crack grows where it is."""
    state = SimpleNamespace(passes=1000.0, began=0.0, lost=0.0, resets=0.0)
    depths, rates = {"archard": np.array([1e-3, 0.5e-3])}, {"archard": np.array([2e-6, 0.1e-6])}
    calm = np.zeros(2), np.zeros(2)
    case = load_case(CASE, {"damage.calibration": 0.2, "damage.axles_per_year": 1000.0}).damage
    found = lambda cracks=calm, **changes: years_of(case.replace_si(**changes), state, depths, rates, cracks)
    assert found(depth_limit=4e-3)["to_limit"] == pytest.approx(2.5) and found(depth_limit=4e-3)["limit"] == "depth"
    assert found(depth_limit=5.1e-3)["to_limit"] is None and found(depth_limit=5.1e-3)["told_up_to"] == 3.0
    assert found(depth_limit=4e-3, calibration=None)["to_limit"] is None
    cracked = found((np.array([0.0, 0.5]), np.array([-1e-2, 5e-4])), depth_limit=4e-3)
    assert cracked["to_limit"] == pytest.approx(2.0) and cracked["limit"] == "cracks"
    worn = found((np.array([0.0, 2.0]), np.array([0.0, -1e-2])), depth_limit=0.8e-3)  # both limits are passed
    assert worn["to_limit"] == pytest.approx(0.5) and worn["to_depth_by_law"]["archard"] == pytest.approx(0.8)
    state.passes = 1.0
    assert found(depth_limit=1.1e-3)["to_limit"] is None


def test_blocks_are_whole_passes(section):
    *_, end = evolve(section, 21.0, Stepping(block=2.5))
    assert (end.log[:, 0] % 1 == 0).all() and end.passes == 21


class _Decays:
    """A line of two nodes whose wear falls as it goes down, dd/dN = r (1 - d / D): d = D (1 - exp(-r N / D))."""

    label, flow_depth, laws, starts = "decays", 0.0, {"own": None}, np.zeros(0)
    shape, beyond, removed, work, crack = (2,), {"own": 0.0}, {"own": 0.0}, np.zeros(2), np.zeros(2)
    wheels = largest_force = 0.0
    tgamma = np.zeros(1), np.ones(1)
    RATES, DEPTHS = np.array([1.0, 0.5]), np.array([100.0, 30.0])

    def __init__(self, depth=np.zeros(2)):
        self.at, self.depth = depth, {"own": self.RATES * (1 - depth / self.DEPTHS)}

    def first(self):
        return self

    def rate(self, shape):
        return shape

    def worn(self, depth):
        return _Decays(self.at + depth), 0.0

    def smoothed(self, depth, width):
        return depth

    def deepest_from(self, first):
        return 0.0

    def flowed(self, shape, rate, passes):
        return shape

    def flow_passes(self, rate, depth):
        return np.inf


@pytest.mark.parametrize("blocks", [4, 10, 40])
def test_the_bound_of_told_blocks_is_above_their_error(blocks):
    """Also of few long ones, where the rate changes by what was worn; and not ten times above."""
    *_, end = evolve(_Decays(), 40.0, Stepping("own", block=40.0 / blocks))
    off = np.abs(end.depth - _Decays.DEPTHS * -np.expm1(-_Decays.RATES * 40 / _Decays.DEPTHS))
    assert len(end.log) == blocks and (off < end.error).all() and (end.error < 10 * off).all()


def test_area_at_the_nodes_is_that_of_the_strips(section, first_rate):
    """Volume conserved from cells to profile, 1e-12, for every law."""
    widths = section.first().widths
    for name, law in section.laws.items():
        strips = sum(
            r.passing.weight * worn_area(law, p.patch, p.speed)
            for _, r in first_rate.kinds
            for p in r.points
            if p.side == "left"
        )
        assert (first_rate.depth[name] * widths).sum() == pytest.approx(strips, rel=1e-12)
        assert (
            first_rate.removed[name] == pytest.approx(strips, rel=1e-12)
            and abs(first_rate.beyond[name]) < 1e-9 * strips
        )


def test_a_free_wheelset_has_no_moment_about_its_axle(first_rate):
    for _, record in first_rate.kinds:
        moment = sum(p.patch.tangential_force[0] * p.radius for p in record.points)
        size = sum(abs(p.patch.tangential_force[0]) * p.radius for p in record.points)
        assert abs(moment) < 0.03 * size  # found on coarse cells, with the radius for the lever


def test_blocks_keep_the_area_and_their_halving_changes_little(section):
    """40 passes in two and in four blocks: the deepest wear changes by less than 1 %, the area by what the state is."""
    ends = []
    for block in (20.0, 10.0):
        *_, end = evolve(section, 40.0, Stepping(block=block, smoothing=0.1e-3))
        removed = (end.depth * end.first.widths).sum()
        assert removed == pytest.approx(end.removed, rel=1e-3)  # the line shortens as it wears
        ends.append(end)
    assert ends[0].deepest == pytest.approx(ends[1].deepest, rel=0.01)
    assert len(ends[1].log) == 4 and ends[1].passes == 40


def test_blocks_are_as_long_as_told(section):
    """Also where they are shorter than the least share of the passes done, which is for blocks by tolerance."""
    *_, end = evolve(section, 8.0, Stepping(block=2.0, least_share=1.0, smoothing=0.1e-3))
    assert end.log[:, 0].tolist() == [2.0, 4.0, 6.0, 8.0]


def test_a_told_block_that_is_too_long_is_taken_in_shorter_ones(section):
    """40 passes at k = 0.1 at once turn the corner's line over: it is worn in shorter blocks, none of whose errors
    is beyond 2 % of the deepest; how they grow is part of the state."""
    fast = replace(
        section, positions={}, laws=laws_of(load_case(CASE, QUICK | {"damage.wear_coefficient": 0.1}).damage)
    )
    stepping = Stepping(block=40.0, smoothing=0.1e-3, told_tolerance=0.02)
    whole = list(evolve(fast, 40.0, stepping))
    end, lengths = whole[-1], np.diff([0.0, *(state.passes for state in whole)])
    assert len(lengths) > 2 and lengths[0] < 5 and shortest_block(end) == lengths[:-1].min() < 0.5 * lengths.max()
    assert end.passes == pytest.approx(40) and (np.diff(end.worn.points[:, 0]) > 0).all()
    assert np.diff([0.0, *(state.error.max() for state in whole)]).max() < 0.02 * end.deepest
    fast.start_from(whole[0].starts)
    *_, again = evolve(fast, 40.0, stepping, whole[0])
    assert (again.worn.points == end.worn.points).all()


def test_accelerated_wear_begins_on_the_tongue():
    """By one k the switch rail's corner (its back at y = -30.5 mm) is worn first and deepest, in a narrow groove."""
    case = load_case(CASE, {"damage.wear_coefficient": 0.1, "damage.block": 50})
    *_, end = evolve(switch_section(case.scene, case.damage), 4.0, stepping_of(case.damage))
    depth, on_switch = depth_between(end.worn, end.first), end.first.points[:, 0] < -30.5e-3
    assert end.passes == pytest.approx(4)
    assert depth[on_switch].max() > 3 * depth[~on_switch].max() > 0
    assert end.first.widths[on_switch & (depth > 0.05 * depth.max())].sum() < 1.5e-3


def test_a_switch_s_page_counts_positions_and_speaks_of_no_casting():
    """One wheel at three positions of its sine were three kinds, and the switch rail a casting."""
    case = load_case(CASE, QUICK)
    section = switch_section(case.scene, case.damage)
    rate, tonnage = section.rate(section.first()), tonnage_of(case.scene, case.damage)
    told = study_report("", case.damage, summary(case.damage, begin(section), rate, rate) | {"tonnage": tonnage})
    assert "0 wheel passes of 3 kind(s) and position(s);" in told and "casting" not in told
    assert re.search(r"Jiang and Sehitoglu's fatigue parameter at most 1\.\d MPa", told)


def test_no_friction_wears_nothing_and_ten_is_finite():
    """T gamma 0 and not -0, in any number of passes; at friction 10 what slips wears, all finite."""
    for friction, words in ((0.0, False), (10.0, True)):
        case = load_case(CASE, QUICK | {"scene.friction": friction})
        section = switch_section(case.scene, case.damage)
        rate = section.rate(section.first())
        assert all(np.isfinite(own).all() and own.min() >= 0 for own in rate.depth.values())
        assert rate.depth["archard"].any() == words
        assert not np.signbit(rate.tgamma[0]).any()
        if friction == 0:  # by tolerance and as told: in few blocks
            for stepping in (Stepping(), Stepping(block=500.0, told_tolerance=0.01)):
                *_, end = evolve(section, 2000.0, stepping)
                assert end.deepest == 0 and end.passes == 2000 and len(end.log) <= 6


def test_a_section_worn_through_is_refused(section):
    fast = replace(section, laws=laws_of(load_case(CASE, QUICK | {"damage.wear_coefficient": 1.0}).damage))
    with pytest.raises(WornOutError, match="limit is 0.05 mm|one step may take"):
        list(evolve(fast, 1e5, Stepping(limit=50e-6, smoothing=0.1e-3)))


def test_positions_and_shares():
    positions, shares = sine_positions(1e-3, 2e-3, 400)
    assert shares.sum() == pytest.approx(1) and positions.mean() == pytest.approx(1e-3)
    assert positions.std() == pytest.approx(2e-3 / np.sqrt(2), rel=1e-4)
    positions, shares = scattered(0.0, 1.5e-3)
    assert shares.sum() == pytest.approx(1) and np.sqrt((shares * positions**2).sum()) == pytest.approx(1.5e-3)
    assert scattered(2e-3, 0.0)[0] == [2e-3]


damage = partial(call, "damage")


def small_case(tmp_path, more=""):
    text = CASE.read_text().replace("hardness =", "cells = 12\nhardness =").replace("block = 100", "block = 10")
    text = text.replace("amplitude =", "positions = 2\namplitude =")
    path = tmp_path / "case.toml"
    path.write_text(text + more)
    return path


@pytest.mark.validate
def test_a_killed_study_goes_on_where_it_was(tmp_path, monkeypatch):
    """Bitwise the state of the study that was not killed; its folder then holds figures, page and readable profiles."""
    path, whole, cut = small_case(tmp_path), tmp_path / "whole", tmp_path / "cut"
    damage(path, "--passes", "20", "--out", whole)
    write, written = study.write_state, []

    def killed(*arguments):
        write(*arguments)
        written.append(1)
        raise KeyboardInterrupt

    monkeypatch.setattr(study, "write_state", killed)
    damage(path, "--passes", "20", "--out", cut, code=130)
    assert len(written) == 1
    monkeypatch.setattr(study, "write_state", write)
    damage(path, "--passes", "20", "--out", cut, code=2)  # holds a study already
    assert "going on after 10 passes" in damage(path, "--passes", "20", "--out", cut, "--restart").output
    one, two = np.load(whole / "damage.npz"), np.load(cut / "damage.npz")
    assert all((one[name] == two[name]).all() for name in one)
    found = json.loads((cut / "damage.json").read_text())
    assert found["passes"] == 20 and found["deepest"] > 0 and len(found["bodies"]["section"]["deepest_by_law"]) == 7
    assert {p.stem for p in (cut / "figures").glob("*.png")} == {
        "profiles",
        "depth_band",
        "patches",
        "passes",
        "shakedown",
    }
    assert "How sure" in (cut / "report.md").read_text()
    assert "How sure" in call("show", cut).output
    after = examine(read_raw(cut / "profile_after.txt", "rail"))
    assert after.profile is not None and not any(f.weight == "refused" for f in after.findings)
    assert "finished already" in damage(path, "--passes", "20", "--out", cut, "--restart").output


@pytest.mark.parametrize(
    "change, said",
    [
        ({"damage.hardness": None}, "hardness"),
        ({"damage.passes": 1e9}, "passes"),
        ({"damage.wear_coefficient": -1.0}, "wear_coefficient"),
        ({"damage.traffic": [{"share": 0.5}, {"wheel": "P8-worn", "share": 0.6}]}, "traffic: shares add up to 1.1"),
        ({"damage.traffic": [{"shares": 0.5}]}, r"traffic\[0\].shares: unknown key, did you mean 'share'"),
        ({"damage.peak": "10 N"}, "must grow"),
        ({"damage.kinetic_friction": 10.0}, "kinetic_friction"),
        ({"damage.calibration": 0.0}, "calibration"),
        ({"damage.hardnes": "2 GPa"}, "did you mean 'hardness'"),
    ],
)
def test_bad_input_is_refused_with_its_key(tmp_path, change, said):
    text = CASE.read_text()
    if change.get("damage.hardness", 0) is None:
        path, change = tmp_path / "case.toml", {}
        path.write_text(text.replace('hardness = "2.8 GPa"\n', ""))
    else:
        path = CASE
    with pytest.raises(CaseError, match=said):
        load_case(path, change)


@pytest.mark.parametrize(
    "passes, said",
    [("1e9", "[0, 1e+08]"), ("-3", "[0, 1e+08]"), ("many", "not a number"), ("nan", "not a finite number")],
)
def test_passes_that_cannot_be_are_refused(tmp_path, passes, said):
    answer = damage(CASE, "--passes", passes, "--out", tmp_path / "out", code=2)
    assert said in answer.output and not (tmp_path / "out").exists()


def test_set_changes_the_case_and_its_mistakes_are_sentences(tmp_path):
    path, folder = small_case(tmp_path), tmp_path / "out"
    answer = damage(path, "--passes", "0", "--out", folder, "--set", "damage.hardness=3 GPa")
    assert json.loads((folder / "case.json").read_text())["damage"]["hardness"] == 3e9
    page = (folder / "report.md").read_text()
    assert "No years are told: `calibration` is not given" in page and "| - |" in page
    found = json.loads((folder / "damage.json").read_text())["bodies"]["section"]
    assert "over 100" not in page and found["years"]["to_limit"] is None
    for words, said in (("damage.hardness", "KEY=VALUE"), ("damage.hardnes=3 GPa", "did you mean 'hardness'")):
        answer = damage(path, "--out", tmp_path / "none", "--set", words, code=2)
        assert said in answer.output and not (tmp_path / "none").exists()


def test_a_study_that_has_not_ended_is_compared_with_nothing(tmp_path):
    """Nor is its folder one that holds no run: it is said to go on with."""
    for name in "ab":
        (tmp_path / name).mkdir()
        (tmp_path / name / "case.json").write_text('{"study": "damage"}')
    answer = call("compare", tmp_path / "a", tmp_path / "b", code=2)
    assert "has not ended" in answer.output and "--restart" in answer.output


def test_a_case_without_the_table_is_told_what_to_write(tmp_path):
    assert "[damage]" in damage(CASE.parents[1] / "nose_transfer.toml", "--out", tmp_path / "out", code=2).output


def test_a_case_of_damage_alone_names_its_command(tmp_path):
    assert "rail-fem damage" in call("run", CASE, "--out", tmp_path / "out", code=2).output


def test_wheel_files_lie_beside_the_case_and_count_by_their_content(tmp_path, monkeypatch):
    """Wherever the program is called from; a file that has changed is another study."""
    path, file = small_case(tmp_path), tmp_path / "wheel.txt"
    monkeypatch.chdir(tmp_path.parent)
    marks = []
    for name in ("P8", "P1", "P8"):
        write_profile(file, wheel_profile(name).points, "wheel", name)
        case = load_case(path, {"damage.traffic": [{"wheel": "wheel.txt"}]})
        marks.append(study.study_mark(case, case.damage.replace(passes=3.0)))
    assert marks[0] == marks[2] != marks[1]
    with pytest.raises(CaseError, match=rf'damage.traffic\[0\].wheel: no file "wheels.txt" in {tmp_path}'):
        load_case(path, {"damage.traffic": [{"wheel": "wheels.txt"}]})


def test_a_wheel_file_that_needs_telling_is_answered_with_the_command_that_tells_it(tmp_path, monkeypatch):
    """Its repairs have no keys in [[damage.traffic]]: the command that is named writes a file that it takes."""
    path, file = small_case(tmp_path), tmp_path / "own.txt"
    points = wheel_profile("P8").points
    np.savetxt(file, (points[points[:, 0] > -0.0625] + [0.07, 0.0]) * 1e3, fmt="%.6f")
    with pytest.raises(CaseError, match="give flange_back.*rail-fem profile .*own.txt .*--write own-told.csv") as told:
        load_case(path, {"damage.traffic": [{"wheel": "own.txt"}]})
    monkeypatch.chdir(tmp_path)
    command = re.search("rail-fem (profile .*csv)", str(told.value))
    call(*command[1].split())
    assert load_case(path, {"damage.traffic": [{"wheel": "own-told.csv"}]}).damage.traffic[0].wheel == str(
        tmp_path / "own-told.csv"
    )


def test_a_ridge_has_the_longest_patch_that_fastsim_takes(section):
    """A worn line's ridge may carry on a patch 100 times as long as wide: it is solved at the longest ratio known, by
    the same load."""
    one = section.passings[0]
    search = ContactSearch(Wheelset(one.wheel, radius=one.radius, back_to_back=section.back_to_back), section.track)
    side = static_equilibrium(search, one.loads).left
    ridge = replace(side, patch=np.tile([5e-3, 0.05e-3], (len(side.patch), 1)))
    patch = tractions(ridge, 0, np.array([1e-3, 0.0, 0.1]), one.rolling)
    assert patch.normal_force == pytest.approx(side.normal_force[0], rel=1e-6) and np.isfinite(patch.slip).all()
    assert patch.grid.dx * patch.grid.nx == pytest.approx(LONGEST * patch.grid.dy * patch.grid.ny)


def test_a_study_that_another_version_wrote_is_refused_and_one_that_touched_nothing_has_no_row(tmp_path):
    facts = {"site": "switch", "passes": 100, "law": "archard", "block_error": 0.01}
    for name, own in (("none", {"bodies": {}}), ("old", {"tgamma": {"largest": 80.0}})):
        (tmp_path / name).mkdir()
        (tmp_path / name / "damage.json").write_text(json.dumps(facts | own))
    assert studies_table([tmp_path / "none"]) == ""
    with pytest.raises(ComparisonError, match="old.damage.json: .*not written by this version.*do the study again"):
        studies_table([tmp_path / "none", tmp_path / "old"])
