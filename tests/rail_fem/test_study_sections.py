"""The thesis' four plane case studies from one command."""

import numpy as np
import pytest

from rail_fem.studies import sections as section_study


def test_all_case_studies_are_there():
    assert list(section_study.cases()) == [
        "non-conformal",
        "conformal",
        "two-point",
        "P8 on BS113A, rail of 210 GPa",
        "P8 on BS113A, rail of 190 GPa",
    ]


def test_wheel_on_rail_gets_its_charts_and_fields(tmp_path, monkeypatch, capsys):
    pytest.importorskip("matplotlib")
    monkeypatch.setenv("RAIL_FEM_SMOKE", "1")
    name, case = list(section_study.cases().items())[3]
    monkeypatch.setattr(section_study, "cases", lambda: {name: case})
    section_study.main(tmp_path, exact=False)
    assert f"{name}: boundary mesh" in capsys.readouterr().out
    stem = "p8_on_bs113a_rail_of_210_gpa_"
    assert sorted(path.name for path in tmp_path.glob("*.png")) == [
        f"{stem}{part}.png" for part in ("boundary_mesh", "fields", "internal_grid")
    ]
    table = np.genfromtxt(tmp_path / f"{stem}one_case_at_0.2_mm.csv", delimiter=",", names=True)
    # the thesis' Table 5-5, whose geometry is known from pictures only
    assert table["pressure_MPa"] == pytest.approx(740.43, rel=0.05)
