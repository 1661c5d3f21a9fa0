"""Two finished damage studies side by side: differences by hand, a figure, folders that are no such pair."""

import numpy as np
import pytest

from rail_fem.damage.side_by_side import compare_pair, read, tables


def write_study(folder, blocks, factor=1.0, passes=100.0, flows=False):
    """A nose worn by a parabola across, `factor` times deeper from 0.4 m on; flow: three times that."""
    x, y = np.arange(0.3, 0.5, 0.002), np.arange(-10, 11) * 0.5e-3
    depth = np.zeros((2, len(x), len(y)))
    depth[1] = 1e-4 * np.maximum(1 - (y / 3e-3) ** 2, 0)
    depth[1, x > 0.3999] *= factor
    done = np.linspace(0, passes, blocks + 1)[1:]
    log = np.column_stack([done, 1e-6 * done, *np.zeros((3, blocks)), 2e5 + done, 3e-4 + 0 * done])
    extra = {"worn_flow": 3 * depth} if flows else {}
    folder.mkdir()
    np.savez(folder / "damage.npz", x=x, y=y, worn_depth=depth, error=0.1 * depth, log=log, **extra)
    return folder


def test_table_and_figure_of_two_lengths_of_blocks(tmp_path, capsys):
    """2 % deeper on half the nose: 1 % of volume, 2 % of depth at most, one half of the plan within 1 %."""
    coarse, fine = write_study(tmp_path / "coarse", 5, 1.02), write_study(tmp_path / "fine", 10)
    compare_pair(coarse, fine, tmp_path / "out")
    text = capsys.readouterr().out
    assert "102, 100 (+2.0%)" in text and "(+1.00%)" in text and "wing" not in text
    assert (
        "| nose, 350 to 400 mm | 100, 100 | +0.0% |" in text
        and "| nose, 400 to 450 mm | 102, 100 | +2.0% | +2.0% | 2 (2.0%) |" in text
    )
    assert (tmp_path / "out" / "compare_pair.md").read_text() == text
    assert (tmp_path / "out" / "compare_pair.png").stat().st_size > 10_000


def test_flow_beside_wear_alone(tmp_path):
    """What is lost by both is compared, and told apart over the passes."""
    flow, wear = (read(write_study(tmp_path / str(flows), 4, flows=flows)) for flows in (True, False))
    bodies, _, over = tables(flow, wear)
    assert bodies.rows[0][1] == "400, 100 (+300.0%)"
    assert over.rows[-1] == ["100", "300", "100", "200.1", "100", "200.1"]


def test_studies_that_are_no_pair_are_refused(tmp_path):
    coarse = write_study(tmp_path / "coarse", 5)
    with pytest.raises(ValueError, match="no damage.npz"):
        compare_pair(tmp_path, coarse, None)
    with pytest.raises(ValueError, match="100 and 50 passes"):
        compare_pair(coarse, write_study(tmp_path / "other", 10, passes=50.0), None)
