"""Lists of changes of a case (cases/rows): every row is one that a case takes, what is told of each, and the physics
that the shipped lists hold."""

from copy import deepcopy
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from rail_fem.case.casefile import load_case
from rail_fem.contact.contact_table import contact_table, table_key, table_of
from rail_fem.models import rigid_hertz
from rail_fem.passes.plastic_indentation import contacts_of
from rail_fem.passes.track_beam import track_beam
from rail_fem.passes.vertical_pass import run_pass
from rail_fem.result.events import leg_flight, longest_flight
from rail_fem.settings.light import RigidHertzSettings
from rail_fem.sweeps.rows import cases_of, read_rows, rows_table
from rail_fem.sweeps.trends import MEASURES, TrendError, over_leg
from tests.commands import call

ROWS = Path(__file__).resolve().parents[2] / "cases" / "rows"
LISTS = sorted(path.stem for path in ROWS.glob("*.toml"))
SHORT = {"run.rigid_hertz.end": "-350 mm"}


def run(name: str, words: str, **settings):
    """A row by rigid_hertz."""
    path = ROWS / f"{name}.toml"
    rows = read_rows(path)
    case = load_case(path.parent / rows.cases[0], deepcopy({**rows.change, **rows.rows[words], **settings}))
    return rigid_hertz.solve(case.scene, case.settings(RigidHertzSettings))


def of(result, name: str) -> float:
    """A measure in its unit."""
    return MEASURES[name].factor * MEASURES[name].of(result)


@pytest.mark.parametrize("name", LISTS)
def test_each_row_is_one_that_a_case_takes_and_none_is_like_another(name):
    path = ROWS / f"{name}.toml"
    rows = read_rows(path)
    cases, errors = cases_of(path, rows, {})
    assert not errors and len({case.name for case in cases}) == len(rows.rows) * len(rows.cases)
    for case in cases:
        like = [one.name for one in cases if one.scene == case.scene and one.runs == case.runs]
        assert like == [case.name]


def test_a_list_is_run_by_the_command_into_a_table_and_a_figure(tmp_path):
    (tmp_path / "case.toml").write_text((ROWS.parent / "nose_transfer.toml").read_text())
    (tmp_path / "rows.toml").write_text(
        'title = "Two loads"\ncases = ["case.toml"]\nmodels = ["rigid_hertz"]\ncolumns = ["largest force", "history"]\n'
        'drawn = ["as it is"]\n[change]\n"run.rigid_hertz.start" = "340 mm"\n"run.rigid_hertz.end" = "370 mm"\n[rows]\n'
        '"as it is" = {}\n"heavier" = { "scene.vehicle.vehicle_sprung_mass" = "92 t" }\n'
    )
    call("sweep", tmp_path / "rows.toml", "--out", tmp_path / "out")
    lines = (tmp_path / "out" / "rows.md").read_text().splitlines()
    assert lines[0] == "# Two loads" and lines[2].startswith("| row | model | largest force [kN] | history L2")
    light, heavy = (line.split(" | ") for line in lines[4:])
    assert light[3] == "-" and heavy[3].endswith("%") and float(heavy[2].split()[0]) > float(light[2].split()[0])
    assert (tmp_path / "out" / "rows_rigid_hertz.png").stat().st_size > 20e3
    call("sweep", tmp_path / "rows.toml", "--model", "p2_formula", "--out", tmp_path / "formula")
    assert (tmp_path / "formula" / "rows.md").is_file() and not list(tmp_path.glob("formula/*.png"))
    assert (
        "leave --vary and --groups out"
        in call(
            "sweep", tmp_path / "rows.toml", "--out", tmp_path / "o", "--vary", "scene.speed=1mph,2mph", code=2
        ).output
    )


def test_a_list_with_an_unknown_quantity_is_refused_with_those_there_are(tmp_path):
    (tmp_path / "rows.toml").write_text('title = "x"\ncases = ["c.toml"]\ncolumns = ["forse"]\n[rows]\na = {}\n')
    with pytest.raises(TrendError, match="'forse' is not one of impact on the wheel"):
        read_rows(tmp_path / "rows.toml")


def test_rows_of_the_explicit_model_that_will_not_start_are_told_before_the_first_does(tmp_path):
    """A window of steel that leaves the crossing, and one too short; nothing runs here, a job array is written."""
    case = ROWS.parent / "whole_crossing.toml"
    (tmp_path / "rows.toml").write_text(
        f'title = "x"\ncases = ["{case}"]\nmodels = ["fe_full"]\ncolumns = ["largest force"]\n'
        '[rows]\n"as it is" = {}\nfar = { "run.fe_full.end" = "2900 mm" }\n'
        'short = { "run.fe_full.window_ahead" = "20 mm" }\n'
    )
    told = call("sweep", tmp_path / "rows.toml", "--out", tmp_path / "out", "--array", "slurm").output
    found = [line.partition("will not start: ")[2] for line in told.splitlines() if "will not start" in line]
    assert [line.partition(":")[0] for line in found] == [
        "far run.fe_full.start, end",
        "short run.fe_full.window_ahead",
    ]
    assert "leaves the modelled crossing" in found[0] and "is shorter than" in found[1]


@pytest.fixture(scope="module")
def legs():
    chosen = ("reference worn P8, 1 in 10.75, 75 mph", "transition of 350 mm", "wheel P1")
    return [run("leg", words, **SHORT) for words in chosen]


def test_a_gentler_climb_throws_less_and_a_cone_that_drops_does_not_fly(legs):
    reference, gentler, cone = legs
    assert of(reference, "flight off the leg") > 2 * of(gentler, "flight off the leg")
    assert of(cone, "flight off the leg") == 0 and np.isnan(of(cone, "launch speed"))
    assert of(reference, "launch speed") > 2 * of(gentler, "launch speed") > 0
    assert of(reference, "climb of the leg's path") > 25 and of(reference, "lift of the leg's path") > 0.8


def test_a_flight_takes_about_the_time_of_its_launch_speed(legs):
    """On rigid bodies: 2 v m / P0. The wheel lands on a track that has come up meanwhile, so it is shorter."""
    flight, scene = leg_flight(legs[0]), legs[0].scene
    ballistic = flight.duration * scene.static_wheel_load / (2 * scene.vehicle.wheel_unsprung_mass)
    assert 0.5 * flight.launch_speed < ballistic < flight.launch_speed


def test_the_less_track_moves_with_the_wheel_the_less_it_is_thrown():
    """The thesis does not state the mass that it adds to the crossing; its force on the leg lies between these two."""
    light, heavy = (run("leg", f"track mass {mass} kg", **SHORT) for mass in (100, 150))
    assert of(light, "largest leg force") < 263.6 < of(heavy, "largest leg force")
    assert of(light, "flight off the leg") == 0 and of(heavy, "flight off the leg") > 20


def test_a_wheel_leaves_a_path_that_falls_away_faster_than_it_can_fall():
    """V^2 |h''| against P0 / Mu: below 1 a P1 stays on the leg, above it flies, and lands with a larger force. The cast
    section is a plane of 1:20 as its tread: the cone loses what the plain rail's crown stood above it."""
    whole, short = (run("leg_wheels", words) for words in ("P1", "P1, transition of 40 mm"))
    assert of(whole, "leg's path falls away") < 1 and longest_flight(whole).length == 0
    assert of(short, "leg's path falls away") > 1 and longest_flight(short).length > 5e-3
    assert of(short, "largest force") > 1.05 * of(whole, "largest force")
    height = over_leg(whole).height
    assert -0.4e-3 < height[-1] - height[0] < -0.2e-3 and over_leg(whole).slope.max() < 2e-3


def test_on_bearers_each_track_is_as_stiff_as_the_foundation_where_the_wheel_strikes():
    """Also that the beam is stiffer than its ballast: several bearers carry. Where some hang there is less."""
    cases, _ = cases_of(ROWS / "bearers.toml", read_rows(ROWS / "bearers.toml"), {})
    for case in (case for case in cases[1:] if not case.scene.bearers.voided):
        beam = track_beam(case.scene.bearers, 0.36 - 1.0, 0.36 + 1.0, 0.1, 9.0)
        share = beam.force_at(0.36)
        assert 1 / (share @ beam.static(share)) == pytest.approx(160e6, rel=1e-4)


def test_the_curve_presses_the_wheelset_outwards_and_the_nose_carries_earlier():
    """It stands 4.5 mm to the outside, held by the check rail, and comes to the nose before it does on the through
    route."""
    spaced = {
        "run.rigid_hertz.path_spacing": "10 mm",
        "run.rigid_hertz.start": "200 mm",
        "run.rigid_hertz.end": "380 mm",
    }
    through, curve = (run("diverging", words, **spaced) for words in ("through route", "curve, 3 mrad, 41 mm"))
    assert curve.transfer_x < through.transfer_x - 0.02 and 4 < of(curve, "lateral position at the start") < 5
    assert np.isnan(of(through, "check rail force")) and of(curve, "check rail force") > 40


def test_a_peak_is_told_with_its_place_and_what_a_model_does_not_resolve_with_a_dash(legs):
    rows = read_rows(ROWS / "leg.toml")
    words = list(rows.rows)[0]
    lines = rows_table(rows, {"a": (words, rows.cases[0])}, {("a", "rigid_hertz"): legs[2]})
    cells = lines[2].strip("| ").split(" | ")
    assert cells[5].split(" at ")[1] == f"{1e3 * legs[2].peaks['largest_force_leg'].x:.0f}" and cells[8] == "-"


def leg_case():
    """The case and its settings around the leg."""
    case = load_case(ROWS.parent / "whole_crossing.toml")
    low, high = case.scene.crossing.surface.leg_range
    return case.scene, RigidHertzSettings(start=low - 0.06, end=high + 0.25)


def test_where_the_wheel_changes_sides_on_the_leg_first_and_second_contact_change_places():
    """As high there as each other, each where the other one was, and no second contact above its first."""
    table = table_of(table_key(leg_case()[0], -0.76, -0.70, 1e-3))
    second, side = table.second, np.sign(table.point[0, :, 1])
    (change,) = np.flatnonzero(np.diff(side))
    apart = table.height[0] - second.height[0]
    assert (apart[np.isfinite(second.height[0])] >= 0).all()
    # the new side rises by 30 mrad: within a step of 1 mm the two are as high
    assert apart[[change, change + 1]].max() < 0.04e-3
    assert np.abs(table.point[0, change + 1] - second.point[0, change]).max() < 2e-3
    assert np.abs(second.point[0, change + 1] - table.point[0, change]).max() < 2e-3


def test_a_cone_that_lies_on_a_plane_touches_once():
    """Its rigid path goes from one end of the line to the other: no second contact, for the gap never opens between."""
    cone = load_case(ROWS.parent / "thesis" / "case_08.toml").scene
    assert table_of(table_key(cone, 0.12, 0.17, 5e-3)).second is None


def test_where_both_sides_of_the_leg_are_as_high_they_carry_twice_what_one_does():
    """Approaches are alike there, and stiffness is by a tenth (fe_full on 2 mm: 108 kN, both 114, one 56)."""
    scene, settings = leg_case()
    settings = settings.model_copy(update={"contact_law": "two loads"})
    table = contact_table(scene, *settings.window(scene), settings.path_spacing)
    tables = table, replace(table, second=None)
    both, one = (run_pass(scene, settings, contacts_of(scene, settings, t)) for t in tables)
    change = table.x[1:][np.diff(np.sign(table.point[0, :, 1])) != 0][0]
    force = [np.interp(change, run.x, run.force.sum(axis=0)) for run in (both, one)]
    assert force[0] / force[1] == pytest.approx(2.0, rel=0.15)
