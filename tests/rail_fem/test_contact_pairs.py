"""Wheels brought into contact: exact gaps on shapes that are known, the thesis' P8 on BS113A, and positions on a
crossing."""

import numpy as np
import pytest

from bem.material import Elastic
from geometry.profiles.profile import Profile, arc, line
from rail_fem.contact.contact_pairs import ContactPairError, bring_together, plain_rail_pair
from rail_fem.contact.patch_methods import plain_rail_section

CONE = Profile.from_pieces([line((-0.05, -0.05 / 20), (0.05, 0.05 / 20), 1e-3)], "cone 1:20")


def test_cone_on_a_tilted_plane_has_the_gap_of_its_section():
    """A cone 1:20 on a plane of its own slope touches along a line: below the axle the gap is x'^2 / 2R to third order,
    the same along s."""
    pair = bring_together(CONE, lambda x, y: y / 20 + 0 * x, (0.0, 0.0), 0.4)
    # it may be found anywhere on that line, also at its end
    s = np.linspace(-0.01, 0.01, 5) - np.sign(pair.point[1]) * 0.02
    np.testing.assert_allclose(pair.gap(np.zeros(5), s), 0, atol=1e-10)
    radius = (0.4 - pair.point[1] / 20) * np.sqrt(1 + 1 / 400)  # normal section of the cone
    assert pair.gap(np.array([5e-3]), np.zeros(1))[0] == pytest.approx(5e-3**2 / 2 / radius, rel=1e-3)
    assert pair.angle == pytest.approx(np.arctan(1 / 20), rel=1e-6)
    assert pair.normal_force(1000.0) == pytest.approx(1000 * np.sqrt(1 + 1 / 400), rel=1e-6)


def test_two_cylinders_touch_where_their_normals_agree():
    """Concave arc of 330 mm over a crown of 80 mm: relative radius 80 * 330 / 250 mm across, the wheel's along."""
    wheel = Profile.from_pieces([arc((-0.03, 0.0), (0.03, 0.0), -0.33, 1e-4)], "concave")
    pair = bring_together(wheel, lambda x, y: np.sqrt(0.08**2 - y**2) - 0.08 + 0 * x, (0.0, 0.0), 0.425)
    along, across = pair.radii()
    assert across == pytest.approx(0.08 * 0.33 / 0.25, rel=1e-4)
    assert along == pytest.approx(0.425 - wheel.height(np.zeros(1))[0], rel=1e-4)
    np.testing.assert_allclose(pair.point[:2], 0, atol=1e-6)


def test_p8_on_bs113a_as_in_the_thesis():
    """49,505 N, E 201 GPa: not a Hertz patch (joints of the crown's arcs lie in it), and within 1 mm of lateral shift
    the pressure passes the thesis' 921 MPa; what is published of its P8 leaves more freedom than that."""
    steel = Elastic(201e9, 0.3)
    peaks = []
    for lateral in (-1e-3, 0.0):
        pair = plain_rail_pair(lateral=lateral, wheel_steel=steel, rail_steel=steel)
        patch = pair.patch(49505.0, cells=44, estimate=False)
        assert patch.normal_force * pair.frame[2, 2] == pytest.approx(49505.0, rel=1e-6)
        peaks.append(patch.max_pressure)
    assert peaks[0] < 921e6 < peaks[1]
    assert abs(peaks[1] / pair.hertz(49505.0).max_pressure - 1) > 0.1


def test_section_bodies_just_touch():
    pair = plain_rail_pair()
    rail, wheel = plain_rail_section(pair)
    top = max(edge.points[:, 1].max() for edge in wheel.outline.loops[0])
    foot = min(edge.points[:, 1].min() for edge in rail.outline.loops[0])
    assert top == pytest.approx(pair.wheel.position[2] + 0.150) and foot == pytest.approx(-0.100)  # the thesis' blocks
    assert rail.outline.edge_curves("face") and wheel.outline.edge_curves("face")
    assert abs(pair.wheel(0.0 * pair.point[:1], pair.point[1:2]) - pair.rail(pair.point[:1], pair.point[1:2]))[0] < 1e-9


def test_a_wheel_beside_the_rail_is_refused():
    with pytest.raises(ContactPairError, match="no rail lies below"):
        plain_rail_pair(lateral=0.5)
