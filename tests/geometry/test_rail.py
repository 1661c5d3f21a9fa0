"""Rail heads: facts of EN 13674-1, and the transcribed tables where they are at hand."""

import numpy as np
import pytest

from geometry.profiles.profile import ProfileError
from geometry.profiles.rail import HEADS, gauge_face, rail_head
from tests.outside import found

MM = 1e-3


@pytest.mark.parametrize("name, width", [("56E1", 69.775), ("60E1", 71.962), ("60E2", 71.958)])
def test_heads_are_smooth_symmetric_and_of_the_standard_width(name, width):
    head = rail_head(name)
    assert np.all(head.angle_before == head.angle_after)
    assert np.allclose(head.points, head.points[::-1] * [-1, 1], atol=1e-12)
    assert -2 * gauge_face(head) == pytest.approx(width * MM, abs=1e-6)  # printed to 1 um
    assert head.points[:, 1].max() == pytest.approx(0.0, abs=5e-9)  # sampled 0.1 mm apart: within s^2 / 8R


def test_side_faces_lean_outward_one_in_twenty():
    head = rail_head("56E1")
    assert head.slope(np.array([-35.5, 35.5]) * MM) == pytest.approx([20.0, -20.0], rel=5e-3)


@pytest.mark.parametrize("name", HEADS)
def test_an_inclined_head_is_the_upright_one_turned(name):
    upright, turned = rail_head(name), rail_head(name, 1 / 20)
    assert np.allclose(turned.angle_after - upright.angle_after, np.arctan(1 / 20), atol=1e-12)
    assert np.allclose(turned.arc_length, upright.arc_length, atol=1e-12)
    # it leans towards the track
    assert turned.points[:, 1].max() == 0.0 and turned.graph_part().slope(np.array(0.0)) > 0
    assert gauge_face(turned) == pytest.approx(gauge_face(upright), abs=1e-12)


def test_unknown_rails_and_wild_inclinations_are_refused():
    with pytest.raises(ProfileError, match="unknown rail '75lb'; known: 56E1, 60E1, 60E2"):
        rail_head("75lb")
    with pytest.raises(ProfileError, match="inclination 20"):
        rail_head("56E1", 20)


def test_older_names_give_the_same_heads():
    assert np.array_equal(rail_head("BS113A", 1 / 20).points, rail_head("56E1", 1 / 20).points)
    assert np.array_equal(rail_head("UIC60").points, rail_head("60E1").points)


@pytest.mark.parametrize("name", HEADS)
def test_heads_match_the_transcribed_tables(name):
    table = np.loadtxt(found(f"profiles/rail_{name}_head_upright.csv"), delimiter=",", comments=["#", "y"]) * MM
    deviation = rail_head(name).height(table[:, 0]) + table[:, 1]
    assert np.nanmax(np.abs(deviation)) < 1e-6 and np.isnan(deviation).sum() <= 2


@pytest.mark.parametrize("spacing", [1.0 * MM, 0.5 * MM])
def test_the_gauge_face_lies_on_the_cubic_between_the_points(spacing):
    """At 14 mm the face of 60E1 goes over into an arc of 13 mm: straight lines between points miss it by up to s^2 / 8R
    (8.0 and 2.2 um found), a cubic by s^4 / 384 R^3 and what the step in curvature leaves, at most a tenth of that."""
    fine, coarse = rail_head("60E1", 1 / 40, 0.01 * MM), rail_head("60E1", 1 / 40, spacing)
    most = spacing**2 / (8 * 13 * MM) / 10
    assert gauge_face(rail_head("60E1", spacing=spacing)) == pytest.approx(
        gauge_face(rail_head("60E1", spacing=0.01 * MM)), abs=most
    )
    for depth in np.arange(8, 14, 0.37) * MM:
        assert gauge_face(coarse, depth) == pytest.approx(gauge_face(fine, depth), abs=most)
