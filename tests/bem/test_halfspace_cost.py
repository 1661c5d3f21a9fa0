"""The cost of rolling grows as it should; a patch is drawn without a display."""

import numpy as np

from bem.halfspace.fastsim import elliptic_patch
from bem.halfspace.figures import patch_figure
from bem.halfspace.tangential import rolling_contact
from bem.material import STEEL
from bem.patch import Creepage


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
