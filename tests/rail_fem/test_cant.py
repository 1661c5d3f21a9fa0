"""A wheelset that is free to shift on canted track: weight pulls it to the lower rail until the contacts hold it."""

import numpy as np
import pytest

from geometry.contact.prismatic_search import ContactSearch
from geometry.profiles.wheel import wheel_profile
from geometry.wheelset import Track, Wheelset, WheelsetError
from rail_fem.contact.load_sharing import equilibrium_under

LOAD = 98.15e3 / 2  # thesis Table 3-1 [N]


def search(cant: float) -> ContactSearch:
    return ContactSearch(Wheelset(wheel_profile("P8")), Track.plain_line(cant=cant))


@pytest.mark.parametrize("cant", [0.0, 0.03, -0.1])
def test_the_contacts_hold_the_weight_alone(cant):
    """Sum of all contact forces in level axes: the weight, straight up, to the 1e-6 of equilibrium_under."""
    canted = search(cant)
    found = equilibrium_under(canted, (LOAD, LOAD))
    force = canted.track.level(np.vstack([found.left.force, found.right.force])).sum(axis=0)
    assert force == pytest.approx([0, 0, 2 * LOAD], abs=3e-6 * 2 * LOAD)
    if cant:
        assert np.sign(found.state.y) == -np.sign(cant) and abs(found.state.y) > 1e-3  # down to the lower rail


def test_cant_is_the_lateral_load_that_it_makes():
    canted, flat = (
        equilibrium_under(search(0.05), (LOAD, LOAD)),
        equilibrium_under(search(0.0), (LOAD * np.cos(0.05),) * 2, -2 * LOAD * np.sin(0.05)),
    )
    assert canted.state.y == pytest.approx(flat.state.y, abs=1e-12) and canted.state.z == pytest.approx(
        flat.state.z, abs=1e-12
    )


def test_centrifugal_load_and_cant_cancel():
    """At balance speed the lateral load along the track plane is that of the cant: the wheelset stays in the middle."""
    found = equilibrium_under(search(0.08), (LOAD, LOAD), 2 * LOAD * np.sin(0.08))
    assert found.state.y == pytest.approx(0.0, abs=1e-6)


def test_what_is_not_held_says_so():
    with pytest.raises(WheelsetError, match="and cant 0.2 rad is not held"):
        equilibrium_under(search(0.2), (LOAD, LOAD), -20 * LOAD * 0.9)
