"""Over which path a model runs: one path for all that are given none, a window around the transfer, no settling across
it; warnings reach the result."""

import itertools
from pathlib import Path

import numpy as np
import pytest

from rail_fem.case.casefile import Case, load_case
from rail_fem.case.preflight import preflight_errors
from rail_fem.case.warnings import case_warnings
from rail_fem.contact.rigid import CLEAR, FOLLOW, LEAD, rigid_path
from rail_fem.fe.plan.travelling_window import with_window
from rail_fem.hierarchy import MODELS
from rail_fem.models import p2_formula, rigid_hertz
from rail_fem.result.result import load
from rail_fem.result.warning_records import record
from rail_fem.scene.scene import Crossing
from rail_fem.scene.units import si_factor
from rail_fem.settings.explicit import COMMON_WINDOW, FeSettings, FeWindowSettings
from rail_fem.settings.light import (
    BemPassageSettings,
    BemPlasticSettings,
    LumpedSettings,
    P2Settings,
    RigidHertzSettings,
)
from rail_fem.show.case_facts import case_facts
from rail_fem.show.report import result_report
from rail_fem.sweeps.rows import cases_of, is_rows, read_rows
from tests.commands import call
from tests.rail_fem.test_scene import make_scene

ROOT = Path(__file__).resolve().parents[2]
CASE = (ROOT / "cases" / "nose_transfer.toml").read_text()


def scene_of(direction="facing", **changes):
    return make_scene().model_copy(update={"direction": direction, **changes})


@pytest.mark.parametrize("direction", ["facing", "trailing"])
def test_models_that_are_given_no_way_run_over_the_same(direction):
    scene, explicit = scene_of(direction), FeSettings()
    windows = {
        tuple(sorted(settings().window(scene))) for settings in (LumpedSettings, RigidHertzSettings, BemPassageSettings)
    }
    assert windows == {tuple(sorted((explicit.start, explicit.end)))} == {COMMON_WINDOW}


@pytest.mark.parametrize(
    "direction, mph, profile",
    [("facing", 75, "P8-worn"), ("facing", 100, "P8"), ("trailing", 50, "P8-worn"), ("facing", 75, "P8-hollow")],
)
def test_a_window_that_is_given_no_place_lies_around_the_transfer_of_this_wheel(direction, mph, profile):
    """Let go LEAD before the rigid wheel changes body, whatever the speed, and on for FOLLOW behind it; such a window
    is never refused."""
    scene = scene_of(direction, speed=mph * si_factor("mph"))
    scene = scene.model_copy(update={"wheel": scene.wheel.model_copy(update={"profile": profile})})
    settings, sign = with_window(scene, FeWindowSettings()), scene.direction_sign
    transfers = sign * rigid_path(scene, np.arange(*COMMON_WINDOW, 5e-3)).transfers
    let_go = sign * settings.start + scene.speed * settings.settle_time
    assert transfers.min() - let_go == pytest.approx(
        LEAD, abs=1e-4
    ) and sign * settings.end - transfers.max() == pytest.approx(FOLLOW, abs=1e-4)
    assert preflight_errors(scene, FeWindowSettings(element_size=3e-3), 1, "fe_window") == []
    given = FeWindowSettings(start=0.2, end=0.5)
    assert with_window(scene, given) is given and with_window(scene, FeWindowSettings(start=0.2)).start == 0.2


@pytest.mark.parametrize("direction, start, end, refused", [
    ("facing", 0.300, 0.45, True), ("facing", 0.290, 0.45, False), ("facing", 0.345, 0.45, True),
    ("trailing", 0.45, 0.300, False), ("trailing", 0.405, 0.25, True), ("trailing", 0.36, 0.25, True),
])  # fmt: skip
def test_a_wheel_that_would_settle_across_its_transfer_is_refused_with_the_remedy(direction, start, end, refused):
    """At 75 mph 1.2 ms of settling are 40 mm; a rigid worn P8 changes body at 353 mm, and 20 mm must lie between."""
    scene = scene_of(direction)
    errors = preflight_errors(
        scene, FeSettings(element_size=3e-3, start=start, end=end, settle_time=1.2e-3), 1, "fe_full"
    )
    assert len(errors) == refused
    for error in errors:
        assert "changes body at 353 mm" in error and "take a shorter settle_time" in error
        remedy = float(error.split("x = ")[-1].split(" mm")[0]) * 1e-3
        shifted = FeSettings(element_size=3e-3, start=remedy - scene.direction_sign * 1e-3, end=end)
        assert preflight_errors(scene, shifted, 1, "fe_full") == []
    assert CLEAR == 20e-3


def test_on_a_crossing_the_half_space_names_the_better_model_and_on_plain_rail_not():
    """Its corners have a free side that a half-space lacks; a rail's head with a dip is what it is for."""
    named = lambda scene: [text for text in case_warnings(scene, BemPlasticSettings()) if "fe_full at 1.4 mm" in text]
    assert len(named(scene_of())) == 1 and named(scene_of(crossing=Crossing(family="joint"))) == []


def test_a_light_model_beyond_the_speeds_it_was_compared_at_is_told_and_the_explicit_one_not():
    """Those of the sixteen cases; a joint has no bar of theirs."""
    fastest = max(load_case(path).scene.speed for path in (ROOT / "cases" / "thesis").glob("case_*.toml"))
    told = lambda settings, **changes: [
        record(text).kind for text in case_warnings(scene_of(**changes), settings) if text.startswith("speed ")
    ]
    assert told(LumpedSettings(), speed=fastest) == []
    assert told(LumpedSettings(), speed=1.001 * fastest) == ["scene"] == told(P2Settings(), speed=1.001 * fastest)
    assert told(FeSettings(start=0.2, end=0.5), speed=2 * fastest) == []
    assert told(LumpedSettings(), speed=2 * fastest, crossing=Crossing(family="joint")) == []


def test_what_check_warns_of_stands_in_result_and_trust_report(tmp_path, undrawn):
    """A crossing scaled beyond what was compared, and a surrogate for a worn wheel."""
    case = tmp_path / "case.toml"
    case.write_text(
        CASE.partition("[run.fe_full]")[0].replace("ratio = 10.75", "ratio = 12")
        + '[run.lumped]\nstart = "300 mm"\nend = "400 mm"\n'
    )
    said = " ".join(call("check", case).output.split())
    call("run", case, "--out", tmp_path / "out")
    result = load(tmp_path / "out")
    warnings = case_warnings(result.scene, LumpedSettings())
    assert len(warnings) == 2 and "1:12" in warnings[1] and "surrogate" in warnings[0]
    report = (tmp_path / "out" / "trust.txt").read_text()
    assert all(warning in said and warning in result.warnings and warning in report for warning in warnings)


@pytest.mark.validate
def test_a_shipped_case_is_taken_by_every_model_or_refused_for_the_part_of_its_scene_that_the_model_has_not():
    """Of each list the first row and the last two, by seven models; some 20 core seconds."""
    parts = ("scene.bearers", "scene.wheel_body", "scene.diverging", "never changes body")  # no nose for fe_window
    told = []
    for path in sorted((ROOT / "cases").rglob("*.toml")):
        if path.parent.name == "design" or path.name in ("observations.toml", "trends.toml", "whole_crossing.toml"):
            continue
        cases, faults = cases_of(path, read_rows(path), {}) if is_rows(path) else ([load_case(path)], [])
        assert not faults, path
        for case, model in itertools.product((cases[0], *cases[-2:]), MODELS):
            by = case.by(model)
            told += [(path.name, model, error) for error in preflight_errors(by.scene, by.runs[model], 1, model)]
    assert told and all(any(part in error for part in parts) for _, _, error in told)


@pytest.mark.parametrize("direction, ways", [("facing", "wing to nose"), ("trailing", "nose to wing")])
def test_a_path_that_ends_before_a_slim_nose_is_said_and_the_formula_looks_farther(direction, ways):
    """A worn P8 on a 1:32 changes body at some 353 mm x 32 / 10.75, the common path ends at 700 mm: result and check
    say so, not the pass of a 1:10.75; the formula finds it."""
    slim = scene_of(direction, crossing=Crossing(ratio=32))
    warned = [w for w in rigid_hertz.solve(slim, RigidHertzSettings()).warnings if w.startswith("no transfer")]
    assert len(warned) == 1 and ways in warned[0]
    usual = rigid_hertz.solve(scene_of(direction), RigidHertzSettings())
    assert not any("no transfer" in w for w in usual.warnings) and f"transfer from {ways}" in result_report(usual)
    facts = case_facts(Case(Path("slim"), "slim", slim, {"rigid_hertz": RigidHertzSettings()}), "rigid_hertz", 1)
    assert any("no load transfer" in warning for warning in facts["warnings"])
    assert p2_formula.solve(slim, P2Settings()).transfer_x == pytest.approx(0.353 * 32 / 10.75, rel=0.03)


def test_the_formula_looks_no_farther_than_the_crossing_goes():
    """Of a 1:6 only 688 mm are modelled."""
    assert p2_formula.solve(scene_of(crossing=Crossing(ratio=6)), P2Settings()).transfer_x < 0.3
