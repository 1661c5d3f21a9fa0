"""Finite elements in the figure of speed against error: their rows, and the command."""

import csv

from bem.verification import halfspace_speed as study3d
from bem.verification import halfspace_study
from rail_fem.studies import patch_speed as study_speed


def test_finite_elements_close_on_hertz_with_second_order_and_the_command_draws_all_methods(tmp_path, monkeypatch):
    """0.06 (element / semi-axis)^2, as tests/versus/test_solid_contact.py has it."""
    monkeypatch.setattr(halfspace_study, "least_seconds", lambda action, budget=0: (1e-3, action()))
    slice_rows = study3d.slice_rows
    monkeypatch.setattr(study3d, "slice_rows", lambda sizes: slice_rows((12,)))
    study_speed.main(tmp_path, quick=True)
    rows = list(csv.DictReader(open(tmp_path / "speed_error.csv")))
    finite = {int(row["cells"]): float(row["error"]) for row in rows if row["method"] == "finite elements, static"}
    assert set(finite) == {6, 8} and all(error < 0.06 * (2 / cells) ** 2 for cells, error in finite.items())
    methods = {row["method"] for row in rows}
    assert {
        "Hertz, closed form",
        "half-space",
        "2.5D (b), coupled slices",
        "2.5D (a), parabolic load",
        "FASTSIM",
        "rolling",
        "shift",
    } <= methods
    assert (tmp_path / "speed_error.png").read_bytes()[:4] == b"\x89PNG"
