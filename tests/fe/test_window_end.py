"""Where a window ends has no physics in it before the wheel is there."""

from pathlib import Path

import numpy as np
import pytest

from geometry.surfaces.crossing import CastCrossing
from rail_fem.case.casefile import load_case
from rail_fem.fe.meshing import make_mesh
from rail_fem.fe.running import running_of
from rail_fem.light.fine_zone import PATCH_REACH
from rail_fem.models import fe_full
from rail_fem.settings.explicit import FeSettings

ROOT = Path(__file__).resolve().parents[2]
SIZE, START, ENDS, SETTLE = 5e-3, 0.31, (0.40, 0.44), 0.3e-3


@pytest.fixture(scope="module")
def scene():
    return load_case(ROOT / "cases" / "nose_transfer.toml").scene


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


@pytest.mark.validate
def test_the_end_of_the_window_changes_nothing_before_the_wheel_is_there(scene):
    """To the last bit as long as the crossing is held. From then on the steel behind the shorter end is missing where
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
    assert not off[time < SETTLE].any()
    assert np.ptp(x[untouched & (time > SETTLE)]) > 0.015 and off[untouched].max() < 5e-7
    assert off[x < taken_over].max() < 5e-3, off[x < taken_over].max()
