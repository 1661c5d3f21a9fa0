"""A body in slabs: planes that no element straddles, and every slab shared evenly among ranks."""

import numpy as np
import pytest

from geometry.meshing.blocks import mesh_grid
from geometry.meshing.hexmesh import merge_bodies
from rail_fem.fe.slabs import cut_into_slabs, slab_parts

MM = 1e-3


@pytest.fixture(scope="module")
def mesh():
    """A body with elements of 1 mm above ones of 3 mm (they share no nodes here), and another one beside it."""
    fine = mesh_grid(np.arange(19) * MM, np.arange(5) * MM, np.array([0.0, 1.0]) * MM, "fine")
    coarse = mesh_grid(np.arange(7) * 3 * MM, np.arange(5) * MM, np.array([-3.0, 0.0]) * MM, "coarse")
    wheel = mesh_grid(np.arange(3) * 5 * MM, np.arange(3) * MM, np.arange(2) * MM, "wheel")
    merged = merge_bodies([fine, coarse, wheel])
    return merged.points, merged.cells, np.where(merged.region == 2, 1, 0)


def test_planes_lie_where_no_element_straddles_them(mesh):
    """Every 3 mm, where the coarse elements end; thinned to the shortest slab allowed, the remainder in the last."""
    slabs = cut_into_slabs(*mesh, bodies=(0,), shortest=1 * MM)
    assert slabs.planes[0] == pytest.approx(np.arange(7) * 3 * MM) and len(slabs.planes[1]) == 0
    assert cut_into_slabs(*mesh, bodies=(0,), shortest=4 * MM).planes[0] == pytest.approx(np.array([0, 6, 12, 18]) * MM)
    assert cut_into_slabs(*mesh, bodies=(0,), shortest=5 * MM).counts.tolist() == [3, 0]
    assert cut_into_slabs(*mesh, bodies=(0,), shortest=11 * MM).planes[0] == pytest.approx(np.array([0, 18]) * MM)


def test_cells_and_nodes_know_their_slabs(mesh):
    points, cells, region = mesh
    slabs = cut_into_slabs(*mesh, bodies=(0,), shortest=6 * MM)
    x = points[:, 0][cells]
    slab = slabs.of_cells(x.mean(axis=1), region)
    body = region == 0
    assert (slabs.planes[0][slab[body]] <= x[body].min(axis=1) + 1e-12).all()
    assert (slabs.planes[0][slab[body] + 1] >= x[body].max(axis=1) - 1e-12).all()
    first, last = slabs.of_nodes(np.array([0.0, 3.0, 6.0, 7.0, 18.0]) * MM, np.zeros(5, int))
    assert first.tolist() == [0, 0, 0, 1, 2] and last.tolist() == [0, 0, 1, 1, 2]


def test_near_are_the_slabs_that_reach_into_a_range(mesh):
    slabs = cut_into_slabs(*mesh, bodies=(0,), shortest=3 * MM)
    for (low, high), expected in {
        (4.0, 5.0): [1, 2],
        (3.0, 6.0): [1, 2],
        (2.9, 6.1): [0, 3],
        (-9.0, 1.0): [0, 1],
        (18.0, 30.0): [0, 0],
        (-np.inf, np.inf): [0, 6],
    }.items():
        assert slabs.near(low * MM, high * MM)[0].tolist() == expected


@pytest.mark.parametrize("parts", [1, 2, 3])
def test_every_slab_is_shared_evenly(mesh, parts):
    """So the ranks have equal work wherever the window stands: to a cell a cut."""
    points, cells, region = mesh
    centres = points[cells].mean(axis=1)
    slabs = cut_into_slabs(*mesh, bodies=(0,), shortest=6 * MM)
    slab = slabs.of_cells(centres[:, 0], region)
    part = slab_parts(centres, np.ones(len(cells)), region, slab, parts)
    for body, number in {(b, s) for b, s in zip(region, slab)}:
        shares = np.bincount(part[(region == body) & (slab == number)], minlength=parts)
        assert np.ptp(shares) <= parts
