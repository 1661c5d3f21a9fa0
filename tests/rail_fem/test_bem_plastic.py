"""The model bem_plastic: a short stretch of the nose, its files and figures, and what it says of itself."""

from pathlib import Path

import numpy as np
import pytest

from rail_fem.case.casefile import load_case
from rail_fem.hierarchy import solve
from rail_fem.light.plastic_rolling import BLOCK, Flow
from rail_fem.output.result import load
from rail_fem.show.fields import read_crossing

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture(scope="module")
def short_pass(tmp_path_factory):
    """80 mm of the reference pass about the first impact on the nose, coarse."""
    folder = tmp_path_factory.mktemp("plastic")
    scene = load_case(ROOT / "cases" / "nose_transfer.toml").scene
    settings = {"start": 0.36, "end": 0.44, "cell_size": 3e-3, "step": 15e-3, "error_estimate": False}
    result = solve("bem_plastic", scene, settings, folder=folder)
    result.save(folder)
    return folder, result


def test_plastic_strain_lies_below_the_surface_where_the_wheel_strikes(short_pass):
    _, result = short_pass
    peak, force = result.peaks["plastic_strain_nose"], result.peaks["largest_force_nose"]
    assert 0.01 < peak.value < 0.2
    assert abs(peak.x - force.x) < 0.03 and -0.01 < peak.z < 0
    row = result.trust["plastic_flow_nose"]
    assert 0 < row["block_mean"] < peak.value and row["deepest_groove"] > 10e-6
    assert any(flag["what"] == "no friction" for flag in result.trust["validity"])


def test_its_files_are_read_back_by_results_and_figures(short_pass):
    folder, result = short_pass
    assert load(folder).peaks["plastic_strain_nose"].value == result.peaks["plastic_strain_nose"].value
    pytest.importorskip("meshio")
    fields = read_crossing(folder)
    worst = fields.worst("nose")
    assert fields.plastic_strain[worst] == pytest.approx(result.peaks["plastic_strain_nose"].value)
    assert fields.centre(worst)[0] == pytest.approx(result.peaks["plastic_strain_nose"].x, abs=1e-6)
    with np.load(folder / "plastic.npz") as archive:
        assert archive["nose_peeq"].max() == pytest.approx(fields.plastic_strain[worst], rel=1e-6)


def test_block_mean_and_integral_are_those_of_the_cells():
    peeq = np.zeros((4, 20, 12))
    peeq[:3, 8:13, 4:9] = 0.02
    side = 1e-3
    flow = Flow(np.arange(20.0), np.arange(12.0), np.arange(4.0), side, peeq, None, None, np.inf, [])
    assert BLOCK == (5e-3, 5e-3, 3e-3)
    assert flow.block_mean() == pytest.approx(0.02)
    assert flow.volume_integral == pytest.approx(0.02 * 75e-9)
    assert flow.zone_depth == pytest.approx(3e-3)
