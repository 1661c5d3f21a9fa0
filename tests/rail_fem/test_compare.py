"""Results side by side: errors against a known history, refusals, the cheapest that is good enough."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from rail_fem import cli
from rail_fem.case.casefile import load_case
from rail_fem.output.result import Cost, PassResult, Peak
from rail_fem.sweeps.compare import QUANTITIES, CompareError, advice, compare, history_error, table

ROOT = Path(__file__).resolve().parents[2]
SCENE = load_case(ROOT / "cases" / "nose_transfer.toml").scene


def made(model: str, factor: float, seconds: float, way=(0.1, 0.5), rows=401, backwards=False) -> PassResult:
    """A force of 100 kN (1 + sin) along the way, times a factor."""
    x = np.linspace(*way, rows)[:: -1 if backwards else 1]
    force = factor * 1e5 * (1 + np.sin(20 * x))
    peaks = {"largest_force": Peak(force.max(), "N"), "first_impact": Peak(force.max(), "N")}
    return PassResult(model, SCENE, {}, {"time": np.linspace(0, 1e-2, rows), "x": x, "force": force}, peaks, transfer_x=0.36, cost=Cost(seconds), error_estimate={"step": 0.01})


@pytest.fixture
def folders(tmp_path):
    for name, result in {"dear": made("fe_full", 1.0, 400.0), "middle": made("rigid_hertz", 0.96, 0.2), "cheap": made("lumped", 1.5, 0.1)}.items():
        result.save(tmp_path / name)
    return tmp_path


def test_errors_of_a_scaled_history_are_the_scale(folders):
    found = compare([folders])
    assert [r.model for r in found.results] == ["lumped", "rigid_hertz", "fe_full"] and found.reference.model == "fe_full"
    for quantity in ("first impact", "largest force"):
        assert [found.error(r, quantity) for r in found.results] == pytest.approx([0.5, -0.04, 0.0], abs=1e-12)
    assert [found.error(r, "history") for r in found.results] == pytest.approx([0.5, 0.04, 0.0], abs=1e-12)
    assert np.isnan(found.error(found.results[0], "strain"))


def test_histories_are_compared_where_both_run_and_in_either_direction():
    reference = made("fe_full", 1.0, 1.0)
    part = made("lumped", 1.2, 1.0, way=(0.2, 0.9), rows=7001, backwards=True)
    assert history_error(part, reference) == pytest.approx(0.2, rel=1e-5)  # of interpolation between 0.1 mm: (20 h)^2 / 8
    assert np.isnan(history_error(made("lumped", 1.0, 1.0, way=(0.6, 0.9)), reference))


def test_settling_is_compared_in_neither_run():
    """Force 0 while it settles, over the first 2.5 of 10 ms; exact afterwards."""
    reference, begun = made("fe_full", 1.0, 1.0), made("fe_window", 1.0, 1.0)
    settling = begun.history["time"] <= 2.5e-3
    begun = replace(begun, settings={"settle_time": 2.5e-3}, history=begun.history | {"force": np.where(settling, 0.0, begun.history["force"])})
    assert history_error(begun, reference) == 0.0
    assert history_error(replace(begun, settings={}), reference) > 0.3


def test_a_peak_that_a_window_did_not_run_over_is_not_compared():
    window = made("fe_window", 1.0, 1.0, way=(0.3, 0.5))
    for place, compared in ((0.25, False), (0.35, True)):
        reference = replace(made("fe_full", 1.0, 1.0), peaks={"first_impact": Peak(1e5, "N", x=place)})
        assert np.isfinite(QUANTITIES["first impact"].error(window, reference)) == compared


def test_the_cheapest_within_an_error_is_named_with_its_cost_and_doubts(folders):
    found = compare([folders])
    assert "middle (rigid_hertz) is the cheapest within 0.05" in advice(found, 0.05, "first impact") and "2e+03 times less" in advice(found, 0.05, "first impact")
    assert "cheap (lumped)" in advice(found, 0.6, "first impact")
    assert "nothing cheaper than dear" in advice(found, 0.001, "first impact") and "itself claims no less than 1.00%" in advice(found, 0.001, "first impact")
    assert "nothing cheaper" in advice(found, 0.5, "strain")  # what nobody resolves nobody meets
    assert compare([folders / "middle", folders / "cheap"], folders / "cheap").reference.model == "lumped"


def test_what_cannot_be_compared_is_refused_by_name(folders, tmp_path):
    other = replace(made("lumped", 1.0, 1.0), scene=SCENE.model_copy(update={"speed": 20.0}))
    other.save(tmp_path / "b" / "slow")
    with pytest.raises(CompareError, match=r"slow: another scene.*1 difference.*\n.*speed: "):
        compare([folders, tmp_path / "b" / "slow"])
    replace(made("lumped", 1.0, 1.0), fault="it broke").save(tmp_path / "c" / "broken")
    with pytest.raises(CompareError, match="broken: that run failed .it broke."):
        compare([folders, tmp_path / "c"])
    with pytest.raises(CompareError, match="one result only"):
        compare([folders / "cheap"])
    with pytest.raises(CompareError, match="no result.json"):
        compare([tmp_path / "nothing"])
    summary = json.loads((folders / "cheap" / "result.json").read_text())
    summary["scene"]["a_key_of_old"] = 1.0
    (folders / "cheap" / "result.json").write_text(json.dumps(summary))
    with pytest.raises(CompareError, match="cheap: cannot be read by this program, another version"):
        compare([folders])


def test_command_writes_table_and_figure_and_refuses_nonsense(folders, tmp_path):
    run = lambda *arguments: CliRunner().invoke(cli.app, ["compare", *map(str, arguments)])
    done = run(folders, "--within", "5%", "--out", tmp_path / "page")
    assert done.exit_code == 0 and "cheapest within 0.05" in done.output
    assert (tmp_path / "page" / "compare.png").stat().st_size > 10_000 and "rigid_hertz" in (tmp_path / "page" / "compare.md").read_text()
    assert table(compare([folders])).count("\n") == 5
    for arguments, words in [(["--within", "five"], "not a number"), (["--within", "500%"], "between 0 and 100"), (["--quantity", "colour"], "choose one of")]:
        refused = run(folders, *arguments)
        assert refused.exit_code != 0 and words in " ".join(refused.output.split())
