"""The finite-element pass stands where its scene says: gauge, back-to-back, far tread and direction."""

from dataclasses import replace

import numpy as np
import pytest

from geometry.axes import tread_datum_y
from geometry.path.wheel_path import rolling_radius
from rail_fem.case.casefile import load_case
from rail_fem.fe.initial_position import smallest_gap
from rail_fem.fe.meshing import make_mesh
from rail_fem.fe.plan import kept_meshes
from rail_fem.fe.running import running_of
from rail_fem.files.sealed import seal_of
from rail_fem.processes.launcher import rank_count
from tests.ranks import printed_by_ranks, printed_here

CASE = load_case("nose_transfer")
SIZE = 5e-3
SETTINGS = CASE.runs["fe_full"].model_copy(
    update={"element_size": SIZE, "element_aspect": 1.0, "wheel_element_ratio": 1.0, "start": 0.30, "end": 0.34}
)
SHARPEST = 80e-3  # smallest crown or tread radius that meets the other body in this window [m]


def scene(**changes):
    return CASE.scene.model_copy(update=changes)


def nodes_of(mesh, name):
    """Points (n, 3) of one body's cells."""
    return mesh.points[np.unique(mesh.cells[mesh.region == mesh.region_names.index(name)])]


@pytest.mark.parametrize(
    "changes, aside",
    [({}, 0.0), ({"back_to_back": 1.370}, 5e-3), ({"gauge": 1.425}, 5e-3), ({"back_to_back": 1.352}, -4e-3)],
)
def test_rigid_path_runs_at_the_wheelsets_own_place(changes, aside):
    """Half of a change of gauge or back-to-back moves the wheel, and its surface goes through the point that carries:
    the axle stands at z + sqrt(r(y)^2 - (x' - x)^2) less its height on plain line, one constant for the whole path."""
    running = running_of(scene(**changes), SETTINGS)
    assert running.datum_y == pytest.approx(tread_datum_y() + aside, abs=1e-15)
    path, wheel = running.path, CASE.scene.wheel
    x, y, z = path.contact_point.T
    rolling = rolling_radius(wheel.shape, wheel.radius, y - tread_datum_y() - aside)
    plain = z + np.sqrt(rolling**2 - (x - path.x) ** 2) - path.height
    assert np.ptp(y) > 1e-3 and np.ptp(plain) < 1e-9  # the stated accuracy of the path


def test_far_tread_slope_of_the_scene_is_that_of_the_path():
    """With the far tread steeper by s, the tread rises by dz = s (y - 29 mm): the maximum falls by at most dz at the
    old contact and at least dz at the new one."""
    steeper = 0.03
    wheel = CASE.scene.wheel.model_copy(update={"far_tread_slope": CASE.scene.wheel.far_tread_slope + steeper})
    old, new = (running_of(scene(**change), SETTINGS) for change in ({}, {"wheel": wheel}))
    on_wing = ~(old.path.on_nose | new.path.on_nose)
    beyond = [
        np.interp(run.path.wing_point[on_wing, 1] - run.datum_y, [0.029, 0.060], [0.0, 0.031]) for run in (old, new)
    ]
    fall = (old.path.height - new.path.height)[on_wing]
    assert (beyond[0] > 5e-3).all()
    assert (fall <= steeper * beyond[0] * 1.001 + 1e-7).all() and (fall >= steeper * beyond[1] * 0.999 - 1e-7).all()


@pytest.mark.parametrize("changes, aside", [({}, 0.0), ({"back_to_back": 1.370}, 5e-3)])
def test_wheel_is_set_down_at_its_lateral_place_and_touches(changes, aside):
    """The meshes' gap on the rigid path is faceting, h^2 / 8 R of either surface; a wheel at another lateral position
    would be out by more."""
    here = scene(**changes)
    running = running_of(here, SETTINGS)
    mesh, gap, datum = make_mesh(here, SETTINGS, running)
    wheel = nodes_of(mesh, "wheel")
    assert wheel[:, 1].min() == pytest.approx(tread_datum_y() + aside - 0.070, abs=1e-9)  # the flange back
    facets = SIZE**2 / 8 * (2 / SHARPEST + 1 / here.wheel.radius)
    assert abs(gap) < facets
    tread = mesh.points[np.unique(mesh.surface[mesh.surface_region == 2])]
    tread = tread[np.abs(tread[:, 1] - running.datum_y - 0.01) < 0.03]
    radius = np.hypot(tread[:, 0] - running.start, tread[:, 2] - datum - here.wheel.radius)
    exact = rolling_radius(here.wheel.shape, here.wheel.radius, tread[:, 1] - tread_datum_y() - aside)
    assert np.abs(radius - exact).max() < 1e-6  # about the axle that stands on `datum`
    bodies = [replace(mesh, surface=mesh.surface[on]) for on in (mesh.surface_region != 2, mesh.surface_region == 2)]
    assert abs(smallest_gap(*bodies)) < 1e-9


def test_trailing_starts_behind_the_nose_and_runs_back():
    running = running_of(scene(direction="trailing"), SETTINGS)
    assert (running.start, running.end) == (SETTINGS.end, SETTINGS.start)
    assert running.speed == -CASE.scene.speed and running.spin < 0 and running.duration > 0


def print_meshed() -> None:
    """Ranks, the mesh's digest and what came with it; nothing is taken from an earlier run."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(kept_meshes, "_file", lambda mesher: None)
        placed = make_mesh(CASE.scene, SETTINGS, running_of(CASE.scene, SETTINGS))
    if placed is not None:
        print(rank_count(), seal_of(vars(placed[0]), {}), *placed[1:])


@pytest.mark.mpi
@pytest.mark.parametrize("ranks", [2, pytest.param(3, marks=pytest.mark.validate)])
def test_bodies_dealt_out_to_ranks_are_meshed_to_the_same_bits(ranks):
    job = "from tests.fe.test_initial_position import print_meshed; print_meshed()"
    one, more = printed_here(print_meshed).split(), printed_by_ranks(ranks, "-c", job).split()
    assert (one[0], more[0]) == ("1", str(ranks)) and one[1:] == more[1:] and len(one) == 4
