"""Where a window ends has no physics in it before the wheel is there."""

import numpy as np
import pytest

from geometry.surfaces.crossing import CastCrossing
from rail_fem.contact.rigid import ends_with_path, meshed_stretch
from rail_fem.fe.meshing import make_mesh
from rail_fem.fe.passage import rail_slabs
from rail_fem.fe.plan.fine_zone import PATCH_REACH
from rail_fem.fe.running import running_of
from rail_fem.fe.window import Extent
from rail_fem.models import fe_full
from rail_fem.settings.explicit import FeSettings

SIZE, START, ENDS, SETTLE = 5e-3, 0.31, (0.40, 0.44), 0.3e-3


def settings_to(end: float, **changes) -> FeSettings:
    return FeSettings(
        **{"element_size": SIZE, "start": START, "end": end, "settle_time": SETTLE, "field_frames": 1} | changes
    )


@pytest.fixture(scope="module")
def meshes(scene):
    """Of windows that end at both ENDS, and of one that begins earlier besides."""
    made = []
    for settings in (*map(settings_to, ENDS), settings_to(ENDS[0], start=0.25)):
        made.append(make_mesh(scene, settings, running_of(scene, settings))[0])
    return made


def fine_planes(mesh, region: int, low: float, high: float) -> np.ndarray:
    """Distinct x of the nodes of a region, between two positions [m]."""
    x = mesh.points[np.unique(mesh.cells[mesh.region == region]), 0]
    return np.unique(np.round(x[(x > low) & (x < high)], 10))


@pytest.mark.parametrize("other", [1, 2])
def test_the_mesh_under_the_wheel_is_the_same_in_another_window(meshes, other):
    """Where both windows are fine, all elements of wing and nose stand at the same positions to round-off."""
    low, high = 0.31, ENDS[0] + PATCH_REACH
    centres = [mesh.points[mesh.cells].mean(axis=1) for mesh in meshes]
    fine = [
        centre[(mesh.region != 2) & (centre[:, 0] > low) & (centre[:, 0] < high)]
        for centre, mesh in zip(centres, meshes)
    ]
    assert len(fine[0]) == len(fine[other]) > 500
    order = [np.lexsort(np.round(positions, 9).T) for positions in fine]
    assert np.abs(fine[0][order[0]] - fine[other][order[other]]).max() < 1e-12


def test_planes_between_slabs_are_counted_from_the_crossing(scene, meshes):
    """Whole elements from the theoretical intersection on the wing, from its tip on the nose, at whatever position the
    window begins and ends."""
    for region, anchor in ((0, 0.0), (1, CastCrossing(scene.crossing.ratio).nose_x)):
        for mesh in meshes:
            slabs = (fine_planes(mesh, region, 0.335, 0.37) - anchor) / SIZE
            assert len(slabs) > 5 and np.abs(slabs * 3 - np.round(slabs * 3)).max() < 1e-6 * len(slabs)


@pytest.mark.parametrize("trailing", [False, True])
def test_a_travelling_window_ends_in_the_same_elements_wherever_the_path_ends(scene, trailing):
    """Its last slab ahead of the axle at the end of the path, and what stands behind that, is there as in a longer
    path: fine, at the same positions to round-off."""
    sign, start = (-1, 0.45) if trailing else (1, START)
    direction, first = ("trailing" if trailing else "facing"), start + sign * 0.06
    of = scene.replace(direction=direction)
    planes = []
    for end in (first, first + sign * 0.03):
        settings = settings_to(end, start=start, window_ahead=0.06, window_behind=0.06)
        mesh = make_mesh(of, settings, running_of(of, settings))[0]
        low, high = sorted((start, first + sign * 0.06))
        planes.append([fine_planes(mesh, region, low, high + 1e-9) for region in (0, 1)])
        slabs = rail_slabs(mesh)
        last = slabs.near(*Extent(start, sign, 0.06, 0.06).ends(first - start))[:2, 0 if trailing else 1]
        planes[-1].append(np.array([slabs.planes[region][last[region]] for region in (0, 1)]))
    assert len(planes[0][1]) > 15
    for own, there in zip(*planes):
        assert len(own) == len(there) and np.abs(own - there).max(initial=0.0) < 1e-9


def test_steel_ends_with_the_path_without_a_window_or_where_the_crossing_ends(scene):
    windowed = settings_to(ENDS[0], window_ahead=0.06)
    last = scene.crossing.surface.x_range[1]
    assert not ends_with_path(scene, windowed) and ends_with_path(scene, settings_to(ENDS[0]))
    assert ends_with_path(scene, settings_to(last - 0.15, window_ahead=0.06))
    assert meshed_stretch(scene, windowed) == pytest.approx((START, ENDS[0] + 0.06 + 3 * SIZE))


@pytest.mark.validate
def test_the_end_of_the_path_changes_nothing_of_a_pass_with_a_travelling_window(scene):
    """To round-off until the shorter path ends, on the nose: what the window holds is all that a step sees."""
    changes = {"start": 0.38, "settle_time": 0.0, "window_ahead": 0.06, "window_behind": 0.06}
    short, long = (fe_full.solve(scene, settings_to(end, **changes)).history for end in (0.40, 0.43))
    n = len(short["x"]) - 1  # the last row is that of the end itself
    assert short["x"][n - 1] > 0.398 and (short["force_nose"][:n] > 0).all()
    assert np.abs(short["force"][:n] - long["force"][:n]).max() < 1e-9 * scene.static_wheel_load


@pytest.mark.validate
def test_the_end_of_the_window_changes_nothing_before_the_wheel_is_there(scene):
    """To round-off as long as the crossing is held. From then on the steel behind the shorter end is missing where
    the foundation shakes it, and where waves along the nose come to: force to 5e-7 until the wheel reaches the nose,
    and to 0.5 % while it is taken over, 25 to 60 mm before that end. (The ends of a mesh laid from the window's ends
    had changed it by 12 % of the force, all along.)"""
    taken_over = 0.375
    histories = [fe_full.solve(scene, settings_to(end, max_steps=4200)).history for end in ENDS]
    n = min(len(h["x"]) for h in histories) - 1
    x, time = histories[0]["x"][:n], histories[0]["time"][:n]
    off = np.abs(histories[0]["force"][:n] - histories[1]["force"][:n]) / scene.static_wheel_load
    untouched = histories[0]["force_nose"][:n].cumsum() == 0
    assert x[-1] > taken_over
    assert off[time < SETTLE].max() < 1e-11
    assert np.ptp(x[untouched & (time > SETTLE)]) > 0.015 and off[untouched].max() < 5e-7
    assert off[x < taken_over].max() < 5e-3, off[x < taken_over].max()
