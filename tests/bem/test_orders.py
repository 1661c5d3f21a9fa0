"""The table of errors and observed orders against exact solutions (rail-fem study verification --only orders)."""

from dataclasses import replace

import numpy as np
import pytest

from bem.verification.orders import HEAD, STUDIES, lines_of, measure, observed_order

BY_NAME = {study.name: study for study in STUDIES}


def test_observed_order_is_the_slope():
    sizes = np.array([0.4, 0.2, 0.1])
    assert observed_order(sizes, 3 * sizes**2, contact=False) == pytest.approx(2)
    assert observed_order(1 / sizes, 3 * sizes**1.5, contact=True) == pytest.approx(1.5)


def test_every_problem_of_the_table_has_an_order():
    """Two sizes each; the finer is the more accurate wherever no patch's edge falls between nodes."""
    rows = [row for study in STUDIES for row in lines_of(study, coarse=True)]
    assert {row[0] for row in rows} == set(BY_NAME) and all(len(row) == len(HEAD) for row in rows)
    assert all(np.isfinite(float(row[-1])) for row in rows)
    for row in rows:
        if "(Lame)" in row[0] or "(Kirsch)" in row[0] or "(Flamant)" in row[0]:
            assert float(row[-1]) > 1, row


def test_errors_are_told_in_per_cent():
    study = replace(BY_NAME["line contact (Hertz)"], sizes=(4, 8), phases=(1.0,), quantities=("a", "b"))
    study = replace(study, errors=lambda size: np.array([0.04996 / size, 0.19984 / size**2]))
    assert [row[3:] for row in lines_of(study)] == [["4: 1.2, 8: 0.62", "1.00"], ["4: 1.2, 8: 0.31", "2.00"]]


@pytest.mark.validate
@pytest.mark.parametrize(
    "name, wanted",
    [
        ("pressurised ring (Lame)", [(1.5, 1e-3), (1.5, 1e-3)]),
        ("hole under tension (Kirsch)", [(1.5, 1e-3)]),
        ("point load on a half-plane (Flamant)", [(1.5, 1e-3)]),
        ("line contact (Hertz)", [(1.5, 1e-3), (0.6, 0.01)]),
        *((f"pin in hole, {degrees} degrees (Persson)", [(1.0, 1e-3), (0.5, 0.01)]) for degrees in (30, 45, 60, 75)),
        ("partial slip, Q = 0.75 mu P (Cattaneo)", [(0.6, 0.01), (0.6, 0.01)]),
        ("rolling, Q = 0.64 mu P (Carter)", [(0.6, 0.01), (0.5, 0.01)]),
        ("loading of unlike bodies (Spence)", [(0.8, 0.04)]),
    ],
)
def test_orders_and_finest_errors_are_those_demanded(name, wanted):
    """VERIFICATION D: 1.5 on closed bodies. In contacts the largest pressure is smooth; a profile has its square-root
    edge between two nodes, L2 error of first order, seen from 0.6 up through the scatter of the edge's position."""
    _, errors, orders = measure(BY_NAME[name])
    for order, finest, (least, most) in zip(orders, errors[-1], wanted):
        assert order > least and finest < most
