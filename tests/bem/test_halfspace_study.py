"""The study's command runs; cost grows as it should; figures are drawn without a display."""

import csv

import numpy as np
import pytest

from bem.halfspace.fastsim import elliptic_patch
from bem.halfspace.figures import patch_figure
from bem.halfspace.tangential import rolling_contact
from bem.material import STEEL
from bem.patch import Creepage
from bem.verification import halfspace_study


def test_study_writes_its_table_and_figures(tmp_path, monkeypatch):
    monkeypatch.setattr(halfspace_study, "least_seconds", lambda action, budget=0: (1e-3, action()))
    halfspace_study.main(["--out", str(tmp_path), "--quick"])
    rows = list(csv.DictReader(open(tmp_path / "speed_error.csv")))
    normal = [float(row["error"]) for row in rows if row["method"] == "half-space"]
    assert normal[0] > normal[1] and normal[1] < 1e-3
    for name in ("speed_error.png", "creep_curves.png", "patch.png"):
        assert (tmp_path / name).read_bytes()[:4] == b"\x89PNG"


@pytest.mark.parametrize("order, held", [(1.0, 1.0), (1.5, 1.5), (2.0, 2.0), (3.0, 2.0), (0.5, 1.0)])
def test_the_limit_of_a_series_is_that_of_the_order_it_shows(order, held):
    """Forces F + c h^p at halved cells have the limit F for p from 1 to 2; beyond, the last change is taken for that of
    the order held."""
    limit, slope = np.array([3.0, -1.0]), np.array([0.2, 0.1])
    forces = limit + slope * (0.5 ** (order * np.arange(4)))[:, None]
    expected = forces[-1] + (forces[-1] - forces[-2]) / (2**held - 1)
    assert halfspace_study.extrapolated(forces) == pytest.approx(expected, rel=1e-12)
    if order == held:
        assert expected == pytest.approx(limit, rel=1e-12)


def test_creep_curves_start_at_the_linear_theory_and_saturate():
    curves = halfspace_study.creep_curves(22, 5)
    for kind in ("longitudinal", "lateral"):
        data = curves[kind]
        assert data["full theory"][0] == 0 and (np.diff(data["full theory"]) > 0).all()
        assert data["full theory"][-1] == pytest.approx(1, abs=0.02)
        for method in ("full theory", "FASTSIM, parabolic", "FASTSIM, elliptic"):
            assert (data[method] <= np.minimum(data["linear theory"] * 1.06, 1) + 1e-9).all(), (kind, method)


def test_figure_of_a_patch_without_tractions(tmp_path):
    patch_figure(elliptic_patch(5e-3, 4e-3, 1e4, (10, 10)), str(tmp_path / "patch.png"))
    assert (tmp_path / "patch.png").stat().st_size > 1000


def test_the_work_of_rolling_grows_little_faster_than_the_cells():
    """Counted, not timed: products with the influence matrix, each four transforms of the doubled grid. They grow as
    the number of cells a side to 0.55 (condition of a problem of first order: 1/2); at 176 x 176 all of them are the
    work of two products with the full matrix, which a relaxation on it would repeat for every sweep.
    """
    sizes = np.array([44, 88, 176])
    products = np.array([products_of_rolling(cells) for cells in sizes])
    assert (np.log2(products[1:] / products[:-1]) < 0.7).all(), products
    unknowns, transformed = 2 * sizes**2, 4 * sizes**2
    transforms = products * 4 * 5 * transformed * np.log2(transformed)
    assert transforms[-1] < 4 * 2 * unknowns[-1] ** 2, products


def products_of_rolling(cells: int) -> int:
    patch = elliptic_patch(7.16e-3, 5.39e-3, 1e5, (cells, cells))
    return rolling_contact(patch, STEEL, STEEL, 0.3, Creepage(1e-3, 5e-4, 0.3), estimate=False).cost.products
