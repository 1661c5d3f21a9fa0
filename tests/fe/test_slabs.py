"""A body in slabs: planes that no element straddles, and slabs shared among ranks in whole blocks."""

import numpy as np
import pytest

from geometry.meshing.blocks import mesh_grid
from geometry.meshing.hexmesh import merge_bodies
from rail_fem.fe.slabs import cut_into_slabs, slab_parts
from rail_fem.fe.state import LANES

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


@pytest.mark.parametrize("parts", [1, 2, 3, 7, 16])
def test_ranks_have_equal_work_wherever_the_window_stands(parts):
    """Two bodies of 14 slabs, of 187 and of 100 cells: of any slabs in a row each rank computes as many blocks of LANES
    cells as the others, or one more, and together no more than one rank alone, whose last block of a slab is not full
    either."""
    sizes = np.repeat([187, 100], 14)
    region, slab = np.repeat(np.repeat([0, 1], 14), sizes), np.repeat(np.tile(np.arange(14), 2), sizes)
    centres = np.random.default_rng(0).uniform(size=(sizes.sum(), 3)) * [0.0, 60 * MM, 40 * MM]
    part = slab_parts(centres, region, slab, np.ones(parts))
    for body, alone in ((0, 6), (1, 4)):
        shares = [np.bincount(part[(region == body) & (slab == s)], minlength=parts) for s in range(14)]
        blocks = -(-np.array(shares) // LANES)
        assert (blocks.sum(axis=1) == alone).all()
        for first in range(14):
            for last in range(first + 1, 15):
                assert np.ptp(blocks[first:last].sum(axis=0)) <= 1


@pytest.mark.parametrize("shares", [[0.3, 0.35, 0.35], [0.05, 0.95], [0.2, *[0.1] * 8]])
def test_ranks_have_their_share_of_the_work_wherever_the_window_stands(shares):
    """20 slabs of six blocks: of any slabs in a row each rank has its share of the blocks, to one or two."""
    slab = np.repeat(np.arange(20), 6 * LANES)
    centres = np.random.default_rng(0).uniform(size=(len(slab), 3))
    part = slab_parts(centres, np.zeros(len(slab), int), slab, np.array(shares))
    blocks = np.array([np.bincount(part[slab == s], minlength=len(shares)) for s in range(20)]) / LANES
    for first in range(20):
        for last in range(first + 1, 21):
            assert np.abs(blocks[first:last].sum(axis=0) - 6 * (last - first) * np.array(shares)).max() < 2


@pytest.mark.parametrize("parts", [1, 2, 3, 40])
def test_no_rank_is_without_cells(mesh, parts):
    """Also where there are fewer blocks than ranks: cells are dealt out then."""
    points, cells, region = mesh
    centres = points[cells].mean(axis=1)
    slabs = cut_into_slabs(*mesh, bodies=(0,), shortest=6 * MM)
    even, uneven = np.ones(parts), np.array([0.2, *[1.0] * (parts - 1)])
    for shares in (even, uneven):
        part = slab_parts(centres, region, slabs.of_cells(centres[:, 0], region), shares)
        assert np.bincount(part, minlength=parts).min() >= 1 and len(np.unique(part)) == parts


def test_a_slab_is_cut_into_pieces_that_lie_together():
    """Along its longest side, at whole blocks."""
    centres = np.column_stack([np.zeros(187), np.random.default_rng(1).permutation(187) * MM, np.zeros(187)])
    part = slab_parts(centres, np.zeros(187, int), np.zeros(187, int), np.ones(2))
    assert (np.diff(part[np.argsort(centres[:, 1])]) >= 0).all() and np.bincount(part).tolist() == [96, 91]
