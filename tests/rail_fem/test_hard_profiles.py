"""Every malformed or extreme profile that is repaired goes all the way: file, doctor, contact search, loaded rest. What
is refused: test_profile_doctor."""

import numpy as np
import pytest

from geometry.contact.prismatic_search import ContactSearch
from geometry.profiles.doctor import examine
from geometry.profiles.formats.by_suffix import read_raw
from geometry.profiles.rail import rail_head
from geometry.profiles.wheel import wheel_profile, worn
from geometry.wheelset import Track, Wheelset, WheelsetError
from rail_fem.contact.load_sharing import static_equilibrium
from rail_fem.models.rigid_hertz import solve
from rail_fem.result.quantities import REPORTED
from rail_fem.settings.light import RigidHertzSettings
from tests.rail_fem.test_scene import make_scene

MM = 1e-3
WHEEL, RAIL = wheel_profile("P8"), rail_head("56E1", 1 / 20)
LOAD = 60e3


def thinned(profile, every=3):
    return profile.points[::every]


def flange_worn() -> np.ndarray:
    """2 mm off the flange face, fading over the root."""
    points = thinned(WHEEL).copy()
    face = (np.arange(len(points)) > np.argmin(points[:, 1])) & (points[:, 0] < -36 * MM)
    points[face, 0] -= 2 * MM * np.clip((-36 * MM - points[face, 0]) / (10 * MM), 0, 1)
    return points


def scattered(points: np.ndarray, level: float) -> np.ndarray:
    return points + np.random.default_rng(9).normal(0, level, points.shape) * [0, 1]


def swapped(points: np.ndarray, at: int) -> np.ndarray:
    points = points.copy()
    points[[at, at + 1]] = points[[at + 1, at]]
    return points


def dense(count: int) -> np.ndarray:
    y = np.linspace(-69.5 * MM, 64.5 * MM, count)
    return np.column_stack([y, WHEEL.height(y)])


WHEELS = {
    "duplicate points": np.insert(thinned(WHEEL), 100, thinned(WHEEL)[100], axis=0) / MM,
    "reversed": thinned(WHEEL)[::-1] / MM,
    "mirrored": thinned(WHEEL) * [-1, 1] / MM,
    "zig-zag": swapped(thinned(WHEEL), 250) / MM,
    "noise of 10 um": scattered(thinned(WHEEL, 8), 10e-6) / MM,
    "noise of 100 um": scattered(thinned(WHEEL, 8), 100e-6) / MM,
    "5000 points": dense(5000) / MM,
    "metres": thinned(WHEEL),
    "inches": thinned(WHEEL) / 25.4e-3,
    "hollow 2 mm": thinned(worn(WHEEL, 2 * MM, 33 * MM, "hollow")) / MM,
    "hollow 4 mm": thinned(worn(WHEEL, 4 * MM, 33 * MM, "hollow")) / MM,
    "worn flange": flange_worn() / MM,
}
WRITTEN = {"metres": "{:.7f} {:.7f}", "inches": "{:.6f} {:.6f}"}


def through_a_file(folder, points: np.ndarray, form: str = "{:.4f} {:.4f}", start: str = ""):
    path = folder / "profile.txt"
    path.write_text(start + "\n".join(form.format(*p) for p in points) + "\n", encoding="utf-8")
    return path


def stands(wheel, rail) -> None:
    """At five shifts: a position on both rails, the loads met, all numbers finite; or a word about roughness."""
    search = ContactSearch(Wheelset(wheel.graph_part()), Track(rail))
    for lateral in np.array([-9.0, -3.0, 0.0, 4.0, 9.0]) * MM:
        found = search.contacts(search.settle(lateral, 5e-3), "left").lowest()
        assert (
            abs(found.gap[0]) < 1e-9
            and np.isfinite(np.concatenate([found.position[0], found.angle, found.curvature[0]])).all()
        )
        try:
            loaded = static_equilibrium(search, (LOAD, LOAD), lateral, 5e-3)
        except WheelsetError as error:
            assert "rough" in str(error)
            continue
        assert loaded.left.force[:, 2].sum() == pytest.approx(LOAD, rel=1e-6)


@pytest.mark.parametrize("name", WHEELS)
def test_a_wheel_that_was_repaired_stands_on_plain_line(tmp_path, name):
    stands(
        examine(read_raw(through_a_file(tmp_path, WHEELS[name], WRITTEN.get(name, "{:.4f} {:.4f}")), "wheel")).profile,
        RAIL,
    )


@pytest.mark.parametrize("name, start, comma", [("byte-order mark", "\ufeff", False), ("decimal comma", "", True)])
def test_what_text_editors_do_changes_nothing(tmp_path, name, start, comma):
    path = through_a_file(tmp_path, thinned(WHEEL) / MM, "{:.4f};{:.4f}", start)
    if comma:
        path.write_text(path.read_text().replace(".", ","))
    found = examine(read_raw(path, "wheel")).profile
    assert np.abs(found.points - thinned(WHEEL)).max() < 0.06e-6  # printed to 0.1 um
    stands(found, RAIL)


@pytest.mark.parametrize("count", [5, 9, 60])
def test_a_rail_of_few_points_carries(tmp_path, count):
    points = rail_head("56E1").points
    few = points[np.linspace(0, len(points) - 1, count).astype(int)]
    stands(WHEEL, examine(read_raw(through_a_file(tmp_path, few / MM), "rail")).profile)


def test_vertical_walls_are_left_aside_and_the_head_between_them_carries(tmp_path):
    corners = np.array(
        [[-36, -36], [-36, -14], [-24, -2.6], [-10, -0.2], [0, 0], [10, -0.2], [24, -2.6], [36, -14], [36, -36]]
    )
    points = np.vstack(
        [np.linspace(a, b, 20, endpoint=False) for a, b in zip(corners[:-1], corners[1:])] + [corners[-1:]]
    )
    found = examine(read_raw(through_a_file(tmp_path, points), "rail")).profile
    search = ContactSearch(Wheelset(WHEEL), Track(found.graph_part(), gauge_point=13.9 * MM))
    station = search.contacts(search.settle(), "left").lowest().rail_station[0]
    assert min(abs(station - y * MM) for y in (-24, -10, 0, 10)) < 1e-6  # it stands on an edge


@pytest.mark.parametrize(
    "name, apart, printed, most",
    [("P8", 0.25, 2, 0.01), ("P8-worn", 0.5, 2, 0.01), ("P8", 0.25, 3, 0.003), ("S1002", 2.5, 6, 0.01)],
)
def test_what_a_file_prints_of_a_wheel_carries_its_forces(tmp_path, name, apart, printed, most):
    """Rounding to 0.01 mm is 3 um of scatter: unsmoothed, P8's force on the wing was 22 % off, to 1 um 4 %. Of few
    points nothing is smoothed but scatter."""
    points = wheel_profile(name).points / MM
    along = np.concatenate([[0], np.cumsum(np.hypot(*np.diff(points, axis=0).T))])
    at = np.arange(0.0, along[-1], apart)
    some = np.column_stack([np.interp(at, along, points[:, k]) for k in (0, 1)])
    form = f"{{:.{printed}f}} {{:.{printed}f}}"
    scene, settings = make_scene(), RigidHertzSettings(start=0.25, end=0.6, path_spacing=5e-3)
    found, true = (
        solve(scene.replace_si(wheel={"profile": profile}), settings, judged=False)
        for profile in (str(through_a_file(tmp_path, some, form)), name)
    )
    for quantity in ("first_impact_on_nose", "largest_force", "largest_force_wing"):
        assert REPORTED[quantity].of(found) == pytest.approx(REPORTED[quantity].of(true), rel=most), quantity
