"""Profiles that wear: area kept, exact shapes, no line that crosses itself, still readable."""

import numpy as np
import pytest

from geometry.profiles.doctor import examine
from geometry.profiles.formats.by_suffix import read_raw, write_profile
from geometry.profiles.profile import Profile
from geometry.profiles.rail import rail_head
from geometry.surfaces.switch import Switch
from rail_fem.damage.worn_profile import WornOutError, WornProfile, area_between, depth_between

HEAD = WornProfile.of(rail_head("56E1", 1 / 20))


def groove(worn, centre, width=10e-3, deep=50e-6):
    s = worn.arc_length
    return deep * np.sqrt(np.maximum(1 - ((s - s[-1] * centre) / width) ** 2, 0))


def bump(worn, middle, deep, width=10e-3):
    """A smooth depth about an arc length [m]."""
    return deep * np.exp(-(((worn.arc_length - middle) / width) ** 2))


def test_a_circle_worn_evenly_is_a_smaller_circle():
    angle = np.linspace(2.2, 0.9, 400)
    arc = WornProfile(0.05 * np.column_stack([np.cos(angle), np.sin(angle)]), np.array([], int), "arc")
    worn, factor = arc.worn(np.full(400, 100e-6), keep_area=False)
    # area per length d = n - n^2 / 2R, and the line's own chords: (h / R)^2 / 8
    n = 0.05 * (1 - np.sqrt(1 - 2 * 100e-6 / 0.05))
    assert np.hypot(*worn.points[5:-5].T) == pytest.approx(0.05 - n, rel=1e-7)
    assert factor == 0


@pytest.mark.parametrize("middle", [0.15, 0.3, 0.5, 0.8])
@pytest.mark.parametrize("deep", [1e-6, 50e-6, 300e-6])
def test_area_lost_is_area_worn(middle, deep):
    depth = bump(HEAD, middle * HEAD.arc_length[-1], deep)
    worn, factor = HEAD.worn(depth)
    assert area_between(HEAD.points, worn.points) == pytest.approx((depth * HEAD.widths).sum(), rel=1e-10)
    assert abs(factor) < 2e-3  # what the correction for curvature leaves


def test_area_of_the_line_that_contact_sees_is_lost_too():
    """The splines through the nodes, integrated, between them as at them."""
    depth = bump(HEAD, 0.5 * HEAD.arc_length[-1], 300e-6, 5e-3)
    worn, _ = HEAD.worn(depth)
    y = np.linspace(-0.030, 0.030, 200001)
    lost = (HEAD.profile.height(y) - worn.profile.height(y)).sum() * (y[1] - y[0])
    assert lost == pytest.approx((depth * HEAD.widths).sum(), rel=1e-6)


def test_strips_deposit_their_area_wherever_they_lie():
    rng = np.random.default_rng(3)
    for centre in (5e-3, 40e-3, 61.3e-3):
        depths = rng.random(50) * 1e-8
        offsets = (np.arange(50) - 24.5) * 0.16e-3
        depth, beyond = HEAD.deposit(centre, offsets, depths, 0.16e-3)
        assert (depth * HEAD.widths).sum() + beyond == pytest.approx(depths.sum() * 0.16e-3, rel=1e-12)
        assert beyond == pytest.approx(0, abs=1e-12 * depths.sum()) and (depth >= -1e-25).all()
    depth, beyond = HEAD.deposit(-1e-3, offsets, depths, 0.16e-3)
    assert beyond > 0 and (depth * HEAD.widths).sum() + beyond == pytest.approx(depths.sum() * 0.16e-3, rel=1e-12)


def test_place_is_the_nearest_point():
    for s in (1e-3, 20.04e-3, 50e-3, 70e-3):
        y, z = (np.interp(s, HEAD.arc_length, v) for v in HEAD.points.T)
        assert HEAD.position(y, z) == pytest.approx(s, abs=2e-9)


def test_zero_depth_changes_nothing():
    worn, factor = HEAD.worn(np.zeros(len(HEAD.points)))
    assert worn is HEAD and factor == 0


def test_nodes_lie_on_the_profile_they_come_from():
    for profile in (rail_head("60E1"), rail_head("56E1", 1 / 20), Switch().section(1.0), Switch().section(2.0)):
        worn = WornProfile.of(profile)
        y, z = worn.points[1:-1].T
        gap = np.abs(worn.profile.height(y) - profile.from_above().height(y))
        steep = np.abs(profile.from_above().slope(y)) > 5
        assert np.nanmax(gap[~steep]) < 1e-6
        middles = (y[1:] + y[:-1]) / 2
        calm = np.abs(profile.from_above().slope(middles)) < 5
        far = np.abs(worn.profile.height(middles) - profile.from_above().height(middles))[calm]
        assert np.nanquantile(far, 0.98) < 1e-6


def test_smoothing_keeps_area_and_positive_depths_and_spreads_by_its_width():
    depth = groove(HEAD, 0.5, 2e-3)
    wide = HEAD.smoothed(depth, 0.5e-3)
    assert (wide * HEAD.widths).sum() == pytest.approx((depth * HEAD.widths).sum(), rel=1e-12)
    s = HEAD.arc_length
    variance = lambda d: np.average((s - np.average(s, weights=d)) ** 2, weights=d)
    assert variance(wide) - variance(depth) == pytest.approx(0.5e-3**2, rel=0.01)
    assert HEAD.smoothed(depth, 0.0) is depth


def test_a_worn_profile_stays_readable(tmp_path):
    worn = HEAD
    for middle in (0.3, 0.35, 0.5):
        worn, _ = worn.worn(bump(worn, middle * worn.arc_length[-1], 200e-6, 4e-3))
    path = tmp_path / "worn.txt"
    write_profile(path, worn.profile.points, "rail", "worn")
    found = examine(read_raw(path, "rail"))
    assert not [f.text for f in found.findings if f.weight == "refused"]
    y = np.linspace(-0.030, 0.030, 400)
    crown = worn.points[:, 1].max()
    assert np.abs(found.profile.height(y) - (worn.profile.height(y) - crown)).max() < 5e-6


@pytest.mark.parametrize(
    "depth, said",
    [
        (lambda p: np.full(len(p.points), np.nan), "finite"),
        (lambda p: -bump(p, 0.04, 1e-6), "0 or more"),
        (lambda p: bump(p, 0.02, 50e-3), "one step may take"),
    ],
)
def test_steps_that_no_profile_takes_are_refused(depth, said):
    with pytest.raises(WornOutError, match=said):
        HEAD.worn(depth(HEAD))


def test_a_line_that_would_turn_back_is_worn_through():
    """A thin wedge is worn from its flank until its two faces meet."""
    points = np.array([[-1.0, 0.0], [-0.2, 0.0], [-0.1, 3.0], [0.0, 3.1], [0.1, 3.0], [0.2, 0.0], [1.0, 0.0]]) * 1e-3
    wedge = WornProfile.of(Profile.from_points(points[1:-1], "wedge"), 0.02e-3)
    worn = wedge
    with pytest.raises(WornOutError, match="worn through|one step"):
        for _ in range(100):
            worn, _ = worn.worn(np.full(len(worn.points), 10e-6))
    assert (np.diff(worn.points[:, 0]) > 0).all() and depth_between(worn, wedge).max() < 3e-3
