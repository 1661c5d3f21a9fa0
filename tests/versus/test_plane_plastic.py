"""A wheel pressed into a yielding rail in the plane: boundary elements with cells of initial stress against finite
elements of another discretisation, steel the same."""

import numpy as np
import pytest

from rail_fem.studies.plane_plastic import compare, difference

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
