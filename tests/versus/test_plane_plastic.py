"""A wheel pressed into a yielding rail in the plane: boundary elements with cells of initial stress against finite
elements of another discretisation, steel the same."""

import numpy as np
import pytest

from rail_fem.studies.plane_plastic import compare, difference, judge, press
from rail_fem.studies.plane_plastic_means import (
    READ,
    block_means,
    extrapolated,
    means_table,
    norm,
    of_cells,
    of_elements,
    window_of,
)

MM = 1e-3


@pytest.fixture(scope="module")
def loads():
    """The last two of ten load steps, cells of 1 mm."""
    rows, contact, _ = compare(1 * MM, 0.8 * MM, 10, shown=2)
    return rows, contact


def test_boundary_and_finite_elements_yield_alike(loads):
    last = loads[0][-1]
    boundary, _, finite = last.von_mises
    assert difference(boundary, finite) < 0.03
    assert difference(last.peeq[0], last.peeq[2]) < 0.2
    assert last.peeq[0].max() == pytest.approx(np.nanmax(last.peeq[2]), rel=0.1)
    assert last.peak_pressure[0] == pytest.approx(last.peak_pressure[1], rel=0.1)


def test_a_return_point_by_point_does_not_carry_the_load(loads):
    """The thesis' way: far less plastic strain, and a field farther from that of the finite elements."""
    last = loads[0][-1]
    boundary, capped, finite = last.von_mises
    assert last.peeq[1].max() < 0.4 * last.peeq[0].max()
    assert difference(capped, finite) > 2 * difference(boundary, finite)


def test_more_load_yields_more_and_newton_ends(loads):
    rows, contact = loads
    assert rows[1].peeq[0].max() > rows[0].peeq[0].max() > 0 and max(rows[1].residuals[-1:]) < 1e-8
    assert 0 < len(contact.section.active) < contact.section.cells.count


def test_fields_read_at_points_are_each_method_s_own_and_agree_in_means():
    """Steel with a slope of 2 GPa. Plastic strain summed over the points read is its integral over cells and over Gauss
    points; means over 2 mm squares agree better than over 0.5 mm, von Mises stress to 2 %."""
    contact = press(1 * MM, 5, 2e9)[0]
    found, window = judge(contact, 0.8 * MM, 5, 2e9), window_of(contact)
    ours, theirs = of_cells(contact, window, 1 * MM), of_elements(found, window, 0.8 * MM)
    whole = (contact.steps[-1].step.peeq * contact.section.cells.areas).sum()
    assert np.nansum(ours.peeq) * READ**2 == pytest.approx(whole, rel=0.01)
    a, b, c = np.moveaxis(found.steps[-1].points.reshape(-1, 3, 2), 1, 0)
    one, two = b - a, c - a  # the triangle of Gauss points is a quarter of the element
    areas = 2 * np.abs(one[:, 0] * two[:, 1] - one[:, 1] * two[:, 0])
    whole = (found.steps[-1].peeq.reshape(-1, 3).mean(axis=1) * areas).sum()
    assert np.nansum(theirs.peeq) * READ**2 == pytest.approx(whole, rel=0.02)
    off = []
    for side in (0.5 * MM, 2 * MM):
        (here, there), weight = block_means([ours.peeq, theirs.peeq], side)
        off.append(norm(here - there, weight) / norm(there, weight))
    assert off[1] < off[0] and off[1] < 0.2, off
    (here, there), weight = block_means([ours.von_mises, theirs.von_mises], MM)
    assert norm(here - there, weight) < 0.02 * norm(there, weight)
    sizes = [
        each._replace(size=size, peeq=each.peeq * (1 + size)) for each in (ours, theirs) for size in (4.0, 2.0, 1.0)
    ]
    assert "| 2 mm squares |" in means_table(sizes[:3], sizes[3:], "a steel")


def test_means_leave_out_points_without_a_value_and_a_limit_is_by_the_order_seen():
    """Squares with no common point are none; of a series a + b h^2 the limit is a; of order below one the finest."""
    side = 8 * READ
    field = np.arange(256.0).reshape(16, 16)
    hole = np.where(field < 16 * 8, field, np.nan)
    hole[:8, 8:] = np.nan
    (one, two), count = block_means([field, hole], side)
    assert count.tolist() == [64.0] and one[0] == two[0] == field[:8, :8].mean()
    weight, sizes = np.array([1.0, 3.0]), (4.0, 2.0, 1.0)
    limit, order = extrapolated(np.array([[5 + h**2, 7 - h**2] for h in sizes]), weight, sizes)
    np.testing.assert_allclose(limit, [5, 7], rtol=1e-9)
    assert order == pytest.approx(2)
    slow = np.array([[5 + h**0.5, 7.0] for h in sizes])
    np.testing.assert_array_equal(extrapolated(slow, weight, sizes)[0], slow[-1])
