"""Profile doctor: each malformed profile is repaired with a visible report or refused with file, line and reason."""

from pathlib import Path

import numpy as np
import pytest
from scipy.interpolate import make_smoothing_spline
from scipy.optimize import minimize_scalar

from geometry.profiles.defects import noise_level
from geometry.profiles.doctor import examine, refuse_loops
from geometry.profiles.formats.raw import RawProfile
from geometry.profiles.profile import ProfileError
from geometry.profiles.rail import rail_head
from geometry.profiles.smoothing import smoothing_spline, stretch_move
from geometry.profiles.wheel import wheel_profile, worn

RAIL = rail_head("60E1").points[::3]
WHEEL = wheel_profile("P8").points
MM = 1e-3


def raw(points, kind="rail", **known):
    return RawProfile(
        np.asarray(points), np.arange(1, len(points) + 1), Path("made.txt"), "two-column text", kind=kind, **known
    )


def says(found, weight, words):
    return any(f.weight == weight and words in f.text for f in found.findings)


@pytest.mark.parametrize("scale, name", [(1.0, "m"), (1e3, "mm"), (1 / 0.0254, "inch")])
@pytest.mark.parametrize("mirror, turn, order", [(1, 1, 1), (-1, 1, 1), (1, -1, -1), (-1, -1, 1)])
def test_unit_mirror_axis_and_order_of_a_wheel_give_the_same_profile(scale, name, mirror, turn, order):
    points = (WHEEL * [mirror, turn] * scale)[::order]
    found = examine(raw(points, "wheel"))
    assert found.unit_name == name
    assert np.abs(found.profile.points - WHEEL).max() < 1e-12
    assert says(found, "repaired", "mirrored") == (mirror < 0)


def test_a_declared_unit_that_cannot_be_is_refused_with_the_one_that_fits():
    with pytest.raises(ProfileError, match="made.txt: in m as declared the wheel is 1.35e.05 mm wide.*would fit in mm"):
        examine(raw(WHEEL * 1e3, "wheel", unit=1.0))


def test_a_measured_wheel_is_set_on_its_datum():
    found = examine(raw(WHEEL + [0.0712, -0.0034], "wheel"))
    assert says(found, "repaired", "set on the tread datum")
    assert np.abs(found.profile.points - WHEEL).max() < 2.5e-7  # the EN arc passes D0 itself at 0.19 um


@pytest.mark.parametrize("raised", [-50.0, 80.0])
def test_where_a_measured_wheels_zero_lies_does_not_change_its_flange(raised):
    """Its height counts from the tread; a file may have its zero anywhere, at the flange's tip or on the axle's
    side."""
    found = examine(raw(WHEEL + [0.0712, raised * MM], "wheel"))
    assert says(found, "repaired", f"{-raised:.3f} mm; flange {-WHEEL[:, 1].min() / MM:.2f} mm high")
    assert np.abs(found.profile.points - WHEEL).max() < 2.5e-7


def test_repeated_points_are_taken_out_and_said():
    found = examine(raw(np.repeat(RAIL, 2, axis=0)))
    assert says(found, "repaired", f"{len(RAIL)} repeated point(s) taken out, the first on line 2")
    assert np.array_equal(found.profile.points, RAIL)


def test_zigzag_is_repaired_by_taking_out_what_turns_back():
    points = np.insert(RAIL, 60, RAIL[40] + [0, 1 * MM * 0], axis=0)
    found = examine(raw(points))
    assert says(found, "repaired", "zig-zag: 1 point(s)")
    assert np.array_equal(found.profile.points, RAIL)


def test_a_profile_that_is_all_zigzag_is_refused():
    shuffled = np.random.default_rng(1).permutation(RAIL)
    with pytest.raises(ProfileError, match="made.txt: line .*turns back on itself"):
        examine(raw(shuffled, up=1))


def test_a_loop_is_refused_with_both_lines():
    t = np.linspace(0, 2 * np.pi, 40)[1:]
    radius = 2 * MM
    at = len(RAIL) // 2
    step = RAIL[at + 1] - RAIL[at]
    angle = np.arctan2(step[1], step[0])
    loop = RAIL[at] + radius * np.column_stack([np.sin(t + angle) - np.sin(angle), np.cos(angle) - np.cos(t + angle)])
    with pytest.raises(ProfileError, match=r"made.txt: line \d+: the profile crosses itself with line \d+"):
        examine(raw(np.vstack([RAIL[: at + 1], loop, RAIL[at + 1 :]]), up=1))


def test_a_loop_through_the_very_first_piece_is_refused_too():
    points = np.array([[0, 0], [2, 0], [2, 1], [1, 1], [1, -1]]) * MM
    with pytest.raises(
        ProfileError, match="made.txt: line 1: the profile crosses itself with line 4 near y=0.00 z=0.00"
    ):
        refuse_loops(points, np.arange(1, 6), raw(points))
    refuse_loops(points[:4], np.arange(1, 5), raw(points))


@pytest.mark.parametrize("level", [7e-6, 10e-6, 30e-6, 100e-6])
def test_noise_is_measured_and_taken_out(level):
    """Level to 25 % (median of 250 samples); what is left is below half of it on the crown."""
    clean = rail_head("60E1", spacing=0.4 * MM).points
    rng = np.random.default_rng(3)
    noisy = clean + rng.normal(0, level, clean.shape)
    assert noise_level(noisy) == pytest.approx(level, rel=0.25)
    found = examine(raw(noisy))
    assert says(found, "repaired", "smoothed")
    # smoothing leaves some of it, the more the fewer points there are
    assert says(found, "warning", "measure again") == (noise_level(noisy) * np.sqrt(0.4 / 0.25) > 10e-6)
    crown = np.linspace(-0.02, 0.02, 201)
    left = found.profile.graph_part().height(crown) - rail_head("60E1").height(crown)
    assert np.sqrt(np.mean(left**2)) < 0.5 * level


def test_a_kink_is_told_from_noise_and_kept():
    y = np.linspace(-35, 35, 281) * MM
    roof = np.column_stack([y, -0.3 * np.abs(y)]) + np.random.default_rng(5).normal(0, 2e-6, (281, 2))
    found = examine(raw(roof))
    assert says(found, "found", "1 kink(s), kept")
    assert found.profile.slope(np.array([-0.4 * MM, 0.4 * MM])) == pytest.approx([0.3, -0.3], abs=0.05)


def test_gaps_are_bridged_with_a_warning_or_refused():
    narrow = np.delete(RAIL, slice(60, 95), axis=0)
    assert says(examine(raw(narrow)), "warning", "gap of")
    y = RAIL[:, 0]
    with pytest.raises(ProfileError, match="too wide to bridge"):
        examine(raw(RAIL[(y < -15 * MM) | (y > 15 * MM)]))


def test_vertical_and_overhanging_walls_are_reported():
    lean = np.radians(12)
    turned = rail_head("60E1").points @ np.array([[np.cos(lean), np.sin(lean)], [-np.sin(lean), np.cos(lean)]])
    assert says(examine(raw(turned)), "found", "overhanging")


@pytest.mark.parametrize("count", [5, 5000])
def test_few_and_many_points_are_taken(count):
    y = np.linspace(-35, 35, count) * MM
    found = examine(raw(np.column_stack([y, -(y**2) / 0.6])))
    assert len(found.profile.points) == count
    assert says(found, "warning", "only 5 points") == (count == 5)


@pytest.mark.parametrize("level", [10e-6, 30e-6])
@pytest.mark.parametrize("every, share", [(3, 0.9), (8, 1.2)])
def test_smoothing_a_wheel_leaves_no_more_than_the_noise_and_rounds_no_edge(every, share, level):
    """P8 whole, with its flange tip's edge and the rim's chamfer, whose corners lie between points: noise across the
    line only.

    Points 0.3 and 0.8 mm apart on roots of 12 and 13 mm. Fitted in one stretch it left 2.7 times the noise, 390 um at
    the chamfer."""
    clean = wheel_profile("P8")
    normal = np.column_stack([-np.sin(clean.angle_after), np.cos(clean.angle_after)])[::every]
    true = clean.points[::every]
    noisy = true + normal * np.random.default_rng(4).normal(0, level, (len(true), 1))
    found = examine(raw(noisy, "wheel", up=1))
    assert len(found.profile.points) == len(true)
    left = ((found.profile.points - true) * normal).sum(axis=1)
    assert np.sqrt(np.mean(left**2)) < share * level
    assert np.abs(left).max() < 6 * level


def test_a_hollow_wheel_says_that_its_tread_is_off_its_datum():
    """Hollow by 1.5 mm the file's datum is kept, by 3 mm the wheel is set on its tread: both are said."""
    slightly = worn(wheel_profile("P8"), 1.5 * MM, 33 * MM, "hollow").points
    found = examine(raw(slightly, "wheel"))
    assert (
        says(found, "warning", "passes +1.50 mm off the file's datum")
        and np.abs(found.profile.points - slightly).max() < 1e-12
    )
    assert says(examine(raw(wheel_profile("P8-hollow").points, "wheel")), "repaired", "shifted by 0.000, -3.000 mm")
    assert not says(examine(raw(WHEEL, "wheel")), "warning", "off the file's datum")


@pytest.mark.parametrize("count, noise", [(8, 1e-3), (100, 1e-3), (377, 1e-1)])
def test_the_smoothing_spline_is_the_natural_one_and_leaves_straight_lines_alone(count, noise):
    """Against scipy's spline at the same amount, found from the fit itself; with a straight line nothing moves."""
    rng = np.random.default_rng(2)
    s = np.cumsum(rng.uniform(0.5, 1.5, count))
    s = (s - s[0]) / (s[-1] - s[0])
    value = np.sin(5 * s) + noise * rng.standard_normal(count)
    found = smoothing_spline(s, value)
    distance = lambda log_amount: np.abs(make_smoothing_spline(s, value, lam=np.exp(log_amount))(s) - found).max()
    grid = np.linspace(-30, 5, 71)
    best = grid[np.argmin([distance(a) for a in grid])]
    closest = minimize_scalar(distance, bounds=(best - 0.5, best + 0.5), method="bounded", options={"xatol": 1e-8})
    assert closest.fun < 1e-5 * noise
    assert np.sqrt(np.mean((found - np.sin(5 * s)) ** 2)) < (1.2 if count == 8 else 0.5) * noise
    assert smoothing_spline(s, 3 * s - 1) == pytest.approx(3 * s - 1, abs=1e-9)
    twice = np.column_stack([s, value])[np.r_[: len(s), -1]]  # two points in one place have no spline
    assert not stretch_move(twice).any()


@pytest.mark.parametrize("count", [700, 2000])
@pytest.mark.parametrize("least", [0.5, 1e-2, 1e-9])
def test_a_long_line_is_smoothed_as_a_short_one(count, least):
    """Of white noise a smoothing spline leaves a tenth or three on a sine, whatever the lengths of its steps."""
    rng = np.random.default_rng(2)
    step = rng.uniform(0.5, 1.5, count)
    step[:: count // 5] = least
    s = np.cumsum(step)
    s = (s - s[0]) / (s[-1] - s[0])
    found = smoothing_spline(s, np.sin(5 * s) + 1e-4 * rng.standard_normal(count))
    assert np.sqrt(np.mean((found - np.sin(5 * s)) ** 2)) < 0.4e-4


def test_an_outlier_on_the_tread_is_no_corner():
    """One point of a wheel with 30 um of noise lies 0.3 mm off: it is put back in line, and no kink is made of it."""
    clean = wheel_profile("P8").points[::3]
    noisy = clean + np.random.default_rng(6).normal(0, 30e-6, clean.shape) * [0, 1]
    at = int(np.argmin(np.abs(clean[:, 0] + 17 * MM)))
    noisy[at, 1] += 0.3 * MM
    found = examine(raw(noisy, "wheel", up=1)).profile
    near = np.abs(found.points[:, 0] + 17 * MM) < 5 * MM
    assert np.array_equal(found.angle_before[near], found.angle_after[near])
    assert np.abs(found.points[near, 1] - np.interp(found.points[near, 0], *clean.T)).max() < 0.1 * MM


def test_only_a_rail_that_is_not_its_own_mirror_image_is_warned_of():
    """An upright head reads the same from both sides; one inclined by 1 in 40 and cut level does not, by 70 mm / 40."""
    inclined = rail_head("60E1", 1 / 40).points
    level = inclined[inclined[:, 1] > inclined[[0, -1], 1].max()]
    assert says(examine(raw(RAIL)), "found", "gauge side not to be told")
    assert not says(examine(raw(RAIL)), "warning", "gauge side")
    assert says(examine(raw(level)), "warning", "gauge side not to be told")
