"""Speed against error of all patch solvers: what their rows say."""

import csv
from functools import partial

import numpy as np
import pytest

from bem.exact.kalker_table import coefficients
from bem.halfspace.fastsim import fastsim
from bem.halfspace.tangential import rolling_contact
from bem.material import STEEL, Pair
from bem.patch import Creepage
from rail_fem.studies import patch_speed
from tests.bem.closed_forms import linear_creep_forces


@pytest.fixture(autouse=True)
def no_clock(monkeypatch):
    monkeypatch.setattr(patch_speed, "least_seconds", lambda action, budget=0: (1e-3, action()))


@pytest.mark.validate
def test_the_command_has_a_row_for_each_method_and_draws_them(tmp_path):
    """Finite elements: 0.06 (element / semi-axis)^2, as tests/versus/test_solid_contact.py has it."""
    patch_speed.main(True, tmp_path)
    rows = list(csv.DictReader(line for line in open(tmp_path / "patch_speed.csv") if line.strip()))
    finite = {int(row["cells"]): float(row["error"]) for row in rows if row["method"] == "finite elements, static"}
    assert set(finite) == {6, 8} and all(error < 0.06 * (2 / cells) ** 2 for cells, error in finite.items())
    methods = {"Hertz, closed form", "half-space", "2.5D (b), coupled slices", "2.5D (a), parabolic load"}
    assert methods | {"FASTSIM", "rolling", "shift"} <= {row["method"] for row in rows}
    assert (tmp_path / "patch_speed.png").read_bytes()[:4] == b"\x89PNG"


def test_the_half_space_converges_to_hertz():
    coarse, fine = (row.error for row in patch_speed.normal_rows((22, 44))[:2])
    assert coarse > fine and fine < 1e-3


@pytest.mark.parametrize("order, held", [(1.0, 1.0), (1.5, 1.5), (2.0, 2.0), (3.0, 2.0), (0.5, 1.0)])
def test_the_limit_of_a_series_is_that_of_the_order_it_shows(order, held):
    """Forces F + c h^p at halved cells have the limit F for p from 1 to 2; beyond, the last change is taken for that of
    the order held."""
    limit, slope = np.array([3.0, -1.0]), np.array([0.2, 0.1])
    forces = limit + slope * (0.5 ** (order * np.arange(4)))[:, None]
    expected = forces[-1] + (forces[-1] - forces[-2]) / (2**held - 1)
    assert patch_speed.extrapolated(forces) == pytest.approx(expected, rel=1e-12)
    if order == held:
        assert expected == pytest.approx(limit, rel=1e-12)


def test_coupled_slices_converge_to_hertz_and_slices_by_load_do_not():
    """The second misses what its closed form says, sqrt(3 P E* / (4 pi a R_y)) against Hertz: 8.5 %."""
    errors = {(row.method[:8], row.cells): row.error for row in patch_speed.slice_rows((12, 24))}
    assert errors["2.5D (b)", 24] < 5e-3
    assert errors["2.5D (a)", 24] == pytest.approx(0.085, abs=5e-3)


def test_creep_curves_start_at_the_linear_theory_and_saturate():
    """Longitudinal and lateral, by the full theory and FASTSIM with both bounds."""
    patch, exact, pair = patch_speed.solve_normal(22), patch_speed.hertz(), Pair.of(STEEL, STEEL)
    friction, bodies = patch_speed.FRICTION, (STEEL, STEEL)
    methods = [partial(rolling_contact, estimate=False)]
    methods += [partial(fastsim, bound=bound, estimate=False) for bound in ("parabolic", "elliptic")]
    linear = coefficients(exact.semi_x / exact.semi_y, pair.poisson)
    values = 5e-3 * np.linspace(0, 1, 5) ** 1.5
    for axis, kind in enumerate(("longitudinal", "lateral")):
        creepages = [Creepage(**{kind: v}) for v in values]
        limit = np.abs([linear_creep_forces(exact.semi_x, exact.semi_y, pair, c, linear)[axis] for c in creepages])
        for method in methods:
            force = np.abs([method(patch, *bodies, friction, c).tangential_force[axis] for c in creepages])
            share = force / (friction * patch_speed.LOAD)
            if method is methods[0]:
                assert share[0] == 0 and (np.diff(share) > 0).all() and share[-1] == pytest.approx(1, abs=0.02)
            assert (share <= np.minimum(limit / (friction * patch_speed.LOAD) * 1.06, 1) + 1e-9).all(), (kind, method)
