"""The study of all patch solvers: its rows tell what they claim; the figures are drawn."""

import numpy as np
import pytest

from bem.verification import halfspace_speed as study3d
from bem.verification import halfspace_study


def test_the_half_space_is_wrong_in_a_wide_conformal_contact_and_slices_are_right(tmp_path):
    """Half-angle 75 degrees: slices within 0.5 % of Persson, the half-space off by more than ten times that; at 15
    degrees by no more than angle^2 / 2, the curvature of the face that it neglects."""
    rows = study3d.conformal_rows((15, 75))
    narrow, wide = rows
    assert abs(narrow["half-space error"]) < np.radians(15) ** 2 / 2 and abs(narrow["slices error"]) < 5e-3
    assert abs(wide["slices error"]) < 5e-3 and abs(wide["half-space error"]) > 0.05
    inside = wide["Persson profile"] > 0.2
    np.testing.assert_allclose(wide["slices profile"][inside], wide["Persson profile"][inside], rtol=0.03)
    study3d.conformal_figure(rows, str(tmp_path / "conformal.png"))
    assert (tmp_path / "conformal.png").read_bytes()[:4] == b"\x89PNG"


def test_coupled_slices_converge_to_hertz_and_slices_by_load_do_not(monkeypatch):
    """The second misses what its closed form says, sqrt(3 P E* / (4 pi a R_y)) against Hertz: 8.5 %."""
    monkeypatch.setattr(halfspace_study, "least_seconds", lambda action, budget=0: (1e-3, action()))
    errors = {(row["method"][:8], row["cells"]): row["error"] for row in study3d.slice_rows((12, 24))}
    assert errors["2.5D (b)", 24] < 5e-3
    assert errors["2.5D (a)", 24] == pytest.approx(0.085, abs=5e-3)


@pytest.mark.validate
def test_the_study_command_writes_its_table_and_figures(tmp_path, monkeypatch):
    monkeypatch.setattr(halfspace_study, "least_seconds", lambda action, budget=0: (1e-3, action()))
    study3d.main(["--out", str(tmp_path), "--quick"])
    for name in ("speed_error.png", "creep_curves.png", "conformal.png"):
        assert (tmp_path / name).read_bytes()[:4] == b"\x89PNG"
