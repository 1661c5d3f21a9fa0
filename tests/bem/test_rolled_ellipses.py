"""FASTSIM on a row of ellipses: one by one the same, and the same refusals."""

import numpy as np
import pytest

from bem.halfspace.fastsim import elliptic_patch, fastsim
from bem.halfspace.rolled_ellipses import rolled_ellipses
from bem.halfspace.slip_dependent_friction import SlipDependentFriction
from bem.material import STEEL, Elastic
from bem.patch import ContactInputError, Creepage

SEMI = np.array([[6e-3, 4e-3], [1e-3, 8e-3], [9e-3, 0.3e-3], [5e-3, 5e-3]])  # the third beyond the table of Kalker's
LOAD = np.array([1e5, 2e4, 3e3, 0.0])
CREEPAGE = np.array([[1e-3, 2e-4, 0.3], [-2e-3, 4e-3, 0.0], [0.0, 0.0, -1.5], [0.0, 0.0, 0.0]])


@pytest.mark.parametrize("direction", [1, -1])
@pytest.mark.parametrize("friction", [0.3, SlipDependentFriction(0.4, 0.2, 2e-3)])
def test_a_row_is_what_each_is_alone(direction, friction):
    """Fields, forces and area to round-off (the marches begin from numbers that are rounded otherwise)."""
    soft, cells = Elastic(200e9, 0.25), (30, 20)
    settings = {"direction": direction, "initial_slope": 0.7}
    row = rolled_ellipses(SEMI, LOAD, STEEL, soft, friction, CREEPAGE, cells, **settings)
    for k, (semi, load, creepage) in enumerate(zip(SEMI, LOAD, CREEPAGE, strict=True)):
        alone = elliptic_patch(*map(float, semi), float(load), cells)
        alone = fastsim(alone, STEEL, soft, friction, Creepage(*creepage), estimate=False, **settings)
        own = row.patch(k)
        scale = max(alone.pressure.max(), 1.0)
        assert np.allclose(own.pressure, alone.pressure, rtol=1e-12, atol=1e-12 * scale)
        assert np.allclose(own.traction, alone.traction, rtol=0, atol=1e-10 * scale)
        assert np.allclose(own.slip, alone.slip, rtol=0, atol=1e-10 * max(np.abs(alone.slip).max(), 1e-9))
        assert np.count_nonzero(own.stick != alone.stick) <= 0.01 * own.stick.size
        assert own.grid.y == pytest.approx(alone.grid.y, rel=1e-12) and own.grid.dx == pytest.approx(alone.grid.dx)
        assert row.normal_force[k] == pytest.approx(alone.normal_force, rel=1e-12)
        assert row.tangential_force[k] == pytest.approx(alone.tangential_force, rel=1e-10, abs=1e-9)
        assert row.frictional_power[k] == pytest.approx(alone.frictional_power, rel=1e-9)
        assert row.contact_area[k] == pytest.approx(alone.contact_area, rel=1e-12)


def test_rows_are_put_in_order_and_joined():
    row = rolled_ellipses(SEMI, LOAD, STEEL, STEEL, 0.3, CREEPAGE, (12, 12))
    back = row.taken(np.array([3, 2, 1, 0])).taken(np.array([3, 2]))
    both = back.joined(row.taken(np.array([2, 3])))
    assert len(both) == 4 and (both.traction == row.traction).all() and (both.grid.dy == row.grid.dy).all()
    none = rolled_ellipses(np.zeros((0, 2)), np.zeros(0), STEEL, STEEL, 0.3, np.zeros((0, 3)), (12, 12))
    assert len(none) == 0 and len(none.joined(row)) == 4
    with pytest.raises(ContactInputError, match="do not go in one row"):
        row.joined(rolled_ellipses(SEMI, LOAD, STEEL, STEEL, 0.3, CREEPAGE, (10, 10)))


@pytest.mark.parametrize(
    "change, said",
    [
        ({"semi": SEMI * [1, -1]}, "ellipse 1 of 4"),
        ({"load": np.array([1e5, np.nan, 1.0, 1.0])}, "ellipse 2 of 4"),
        ({"friction": -0.1}, "friction"),
        ({"creepage": np.full((4, 3), np.inf)}, "every part must be"),
        ({"direction": 0}, "direction 0"),
        ({"initial_slope": 0.0}, "initial_slope 0.0"),
    ],
)
def test_what_cannot_roll_is_refused(change, said):
    given = {"semi": SEMI, "load": LOAD, "friction": 0.3, "creepage": CREEPAGE} | change
    rest = {name: given[name] for name in given.keys() - {"semi", "load", "friction", "creepage"}}
    with pytest.raises(ContactInputError, match=said):
        rolled_ellipses(given["semi"], given["load"], STEEL, STEEL, given["friction"], given["creepage"], **rest)
