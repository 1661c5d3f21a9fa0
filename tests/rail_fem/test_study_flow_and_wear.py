"""Flow and wear beside wear alone: rows at the same passes, a figure, folders that are none."""

import numpy as np
import pytest

from rail_fem.studies.flow_and_wear import main, read, table


def write_study(folder, flows):
    passes, y = np.array([1.0, 10.0, 100.0]), np.arange(-10, 11) * 0.5e-3
    x = np.arange(0.3, 0.5, 0.02)
    worn = np.zeros((2, len(x), len(y)))
    worn[1] = 1e-4 * np.maximum(1 - (y / 3e-3) ** 2, 0)
    log = np.column_stack([passes, 1e-6 * passes, *np.zeros((3, 3)), 2e5 + passes, 3e-4 + 0 * passes])
    extra = {"worn_flow": 3 * worn, "worn_strain": worn} if flows else {}
    folder.mkdir()
    np.savez(folder / "damage.npz", x=x, y=y, worn_depth=worn, log=log, **extra)


def test_table_and_figure_of_two_studies(tmp_path):
    write_study(tmp_path / "flow", True)
    write_study(tmp_path / "wear", False)
    main(tmp_path / "flow", tmp_path / "wear", tmp_path / "out")
    assert "| 100 | 300 | 100 | 200 | 100 | 200 |" in (tmp_path / "out" / "flow_and_wear.md").read_text()
    assert (tmp_path / "out" / "flow_and_wear.png").stat().st_size > 10_000
    assert table(read(tmp_path / "flow"), read(tmp_path / "wear")).count("\n") == 5


def test_folders_that_are_no_such_studies_are_refused(tmp_path):
    write_study(tmp_path / "wear", False)
    with pytest.raises(ValueError, match="no damage.npz"):
        main(tmp_path, tmp_path / "wear", None)
    with pytest.raises(ValueError, match="plastic_flow = true first"):
        main(tmp_path / "wear", tmp_path / "wear", None)
