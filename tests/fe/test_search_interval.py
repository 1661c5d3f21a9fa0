"""Contact is searched anew before a node that is not watched can come into contact, however fast the wheel and however
long the step; most searches look at near facets only and find the same."""

import dataclasses

import numpy as np
import pytest
from mpi4py import MPI
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import cKDTree

from rail_fem.fe.contact import search as search_module
from rail_fem.fe.contact.contact import Contact
from rail_fem.fe.contact.continuing import close_pairs, time_to_contact
from rail_fem.fe.contact.near_facets import nearest_facets, share_space
from rail_fem.fe.contact.pairs import Pairs
from rail_fem.fe.contact.projection import project_pairs
from rail_fem.fe.contact.search import APPROACH, SLOPE, PairSearch
from rail_fem.fe.contact.surface import edge_neighbours
from tests.fe.rolling_job import rolling, run

DT = 1.5e-7


@pytest.fixture(scope="module")
def search():
    found = rolling(MPI.COMM_SELF).dynamics.contact.search
    found.settings = dataclasses.replace(found.settings, refresh=None)
    return found


@pytest.mark.parametrize("speed", [0.0, 1.0, 33.5, -33.5, 156.5])
@pytest.mark.parametrize("scale", [1, 5, 1000])
def test_surfaces_beyond_a_search_come_at_most_into_contact_before_the_next(search, speed, scale):
    """A search looks at what is within two margins."""
    search.wheel.speed = speed
    dt = scale * DT
    steps = search.steps_between_searches(dt)
    closed = steps * dt * (SLOPE * abs(speed) + APPROACH)
    assert steps >= 1 and (steps == 1 or search.settings.margin < closed <= 2 * search.settings.margin)


def test_a_longest_interval_is_kept(search):
    search.wheel.speed = 0.0
    search.settings = dataclasses.replace(search.settings, refresh=7)
    assert search.steps_between_searches(DT) == 7 and search.steps_between_searches(1.0) == 1


def searched_every(steps: int | None, speed: float) -> tuple[np.ndarray, np.ndarray, int]:
    """Forces and last positions of the rolling cap with at most so many steps between searches; how many there were."""
    scene, searches = rolling(MPI.COMM_SELF), []
    own = scene.dynamics.contact.search
    own.settings, own.wheel.speed, search = dataclasses.replace(own.settings, refresh=steps), speed, own.search
    own.search = lambda dt: searches.append(dt) or search(dt)
    force = run(scene, 700).force
    return force, scene.dynamics.structure.x.copy(), len(searches)


@pytest.mark.validate  # 1 of 24 runs, the first on a machine without kernels, differed by half: its cause is not found
@pytest.mark.parametrize("speed", [100.0, 20.0])
def test_forces_do_not_depend_on_when_searches_happen(speed):
    """The cap comes down, strikes and rolls: what is not watched touches nowhere before the next search, and pairs go
    on as they were. Round-off alone differs: where the projections of a new pair begin."""
    force, x, many = searched_every(1, speed)
    seldom, there, few = searched_every(None, speed)
    assert np.abs(force).max() > 1e3 and many == 700 and few < 700 / 25
    assert np.abs(seldom - force).max() < 1e-9 * np.abs(force).max()
    assert np.abs(there - x).max() < 1e-13


def test_nodes_that_drift_with_their_kick_go_where_they_went_after_it(monkeypatch):
    """Slabs that come and go, a rigid base and a contact change velocities between kick and drift: of those nodes, and
    of all where a search is due, positions follow later. The same bits."""
    force, x = [], []
    for looks in (Contact.looks, lambda self, dt: True):
        monkeypatch.setattr(Contact, "looks", looks)
        scene = rolling(MPI.COMM_SELF, 9e-3, 9e-3)
        force.append(run(scene, 300).force)
        x.append(scene.dynamics.structure.x)
    assert np.abs(force[0]).max() > 1e3
    assert np.array_equal(*force) and np.array_equal(*x)


def facing(gap: np.ndarray) -> tuple[np.ndarray, Pairs]:
    """Four facets of 1 m in a row at z = 0 with a node over each of them at these heights [m]; the pairs, projected.
    Nodes 0 to 9 are the facets', 10 to 13 those above."""
    corners = np.array([[i, j, 0.0] for i in range(5) for j in range(2)])
    quads = np.array([[2 * i, 2 * i + 2, 2 * i + 3, 2 * i + 1] for i in range(4)])
    position = np.concatenate([corners, np.column_stack([np.arange(4) + 0.3, np.full(4, 0.4), gap])])
    usable = np.ones(4, np.bool_)
    pairs = Pairs.over(quads, edge_neighbours(quads), usable, np.arange(10, 14), np.arange(4), np.zeros((4, 2)))
    project_pairs(position, pairs)
    return position, pairs


def test_a_pair_that_is_not_watched_closes_at_the_soonest_after_its_gap_over_its_rate():
    """Gaps of 1, 2, 4 and 8 mm, those above sink at 1 m/s, the facet of the third node rises at 3 m/s, and with it its
    neighbours by what they share."""
    position, pairs = facing(np.array([1e-3, 2e-3, 4e-3, 8e-3]))
    velocity = np.zeros_like(position)
    velocity[10:, 2] = -1.0
    velocity[[4, 5, 6, 7], 2] = 3.0
    assert time_to_contact(pairs, velocity, 1.5e-3, 0.5) == pytest.approx(2e-3 / (1.0 + 0.3 * 3.0 + 0.5))
    assert time_to_contact(pairs, velocity, 3e-3, 0.5) == pytest.approx(4e-3 / (1.0 + 3.0 + 0.5))
    assert time_to_contact(pairs, velocity, 5e-3, 0.5) == pytest.approx(8e-3 / (1.0 + 0.7 * 3.0 + 0.5))
    assert time_to_contact(pairs, -velocity, 5e-3, 0.5) == pytest.approx(8e-3 / 0.5)
    pairs.facets[3] = -1
    assert time_to_contact(pairs, velocity, 5e-3, 0.5) == np.inf


def test_pairs_go_on_with_facet_position_and_normal_of_their_last_step():
    """Of four nodes the first has the pair that it had, the second lies far from where it was, the third is lost to the
    search, the fourth is new."""
    _, found = facing(np.array([1e-4, 1e-4, 1e-4, 1e-4]))
    _, before = facing(np.array([2e-4, 2e-4, 2e-4, 2e-4]))
    before = before._replace(slaves=np.array([10, 11, 12, 99]), facets=np.array([1, 1, 2, 3]))
    before.ahead[:], before.where[:] = [0.6, 0.0, 0.8], 0.25
    found.facets[2] = -1
    neighbours = np.full((4, 4), -1)
    neighbours[0, 0], neighbours[1, 0] = 1, 0
    found = found._replace(neighbours=neighbours, usable=np.ones(4, np.bool_))
    before.facets[1] = 3
    slot = np.empty(100, np.int64)
    number, facets, where, ahead = close_pairs(found, before, 3e-4, 1e-3, slot)
    assert number.tolist() == [0, 1, 2, 3] and facets.tolist() == [1, 1, 2, 3]
    assert (where[[0, 2]] == 0.25).all() and (ahead[[0, 2]] == [0.6, 0.0, 0.8]).all()
    assert (where[[1, 3]] == found.where[[1, 3]]).all() and (ahead[[1, 3]] == [0.0, 0.0, 1.0]).all()
    some = found._replace(usable=np.array([True, False, False, True]))
    number, facets, _, _ = close_pairs(some, before, 3e-4, 1e-3, slot)
    assert number.tolist() == [0, 1, 3] and facets.tolist() == [0, 1, 3]
    assert close_pairs(found, before, 5e-5, 1e-3, slot)[0].tolist() == []


@settings(max_examples=60, deadline=None)
@given(
    st.integers(0, 2**31), st.integers(1, 200), st.sampled_from([[1, 1, 1], [1, 1e-3, 1], [1e-3, 1e-3, 1], [0, 0, 1]])
)
def test_the_nearest_facet_is_the_nearest(seed, count, shape):
    rng = np.random.default_rng(seed)
    centres, position = rng.uniform(-1, 1, (count, 3)) * shape, rng.uniform(-2, 2, (150, 3)) * shape
    nodes = rng.permutation(150)[:100]
    exact, _ = cKDTree(centres).query(position[nodes])
    for ranks in (1, 3):
        found = sum(nearest_facets(position, nodes, rank, ranks, centres) for rank in range(ranks))
        np.testing.assert_allclose(np.linalg.norm(centres[found] - position[nodes], axis=1), exact, rtol=1e-12)


@pytest.mark.parametrize("window", [(None, None), (8e-3, 8e-3)], ids=["whole", "travelling window"])
def test_searches_among_near_facets_find_what_searches_of_all_find(monkeypatch, window):
    steps, looks = 900, []
    look = PairSearch._look_at_all
    monkeypatch.setattr(PairSearch, "_look_at_all", lambda *a: looks.append(1) or look(*a))
    near = run(rolling(MPI.COMM_SELF, *window), steps)
    few = len(looks)
    monkeypatch.setattr(search_module, "NEARER", 0.0)
    every = run(rolling(MPI.COMM_SELF, *window), steps)
    assert np.abs(near.force).max() > 1e3 and (near.force == every.force).all()
    assert 2 <= few <= (len(looks) - few) / 5


def boxes(seed: int, count: int, spread: float) -> tuple[np.ndarray, np.ndarray]:
    """Low and high corners of `count` boxes strewn over the unit cube."""
    rng = np.random.default_rng(seed)
    centre, half = rng.uniform(-1, 1, (count, 3)) * [1, 1, spread], rng.uniform(0, 0.05, (count, 3))
    return centre - half, centre + half


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 2**31), st.integers(0, 300), st.integers(0, 300), st.sampled_from([0.0, 0.05, 1.0]))
def test_boxes_that_overlap_are_all_kept(seed, first, second, spread):
    one, other = boxes(seed, first, spread), boxes(seed + 1, second, spread)
    kept = share_space(one, other)
    overlap = ((one[0][:, None] <= other[1]) & (one[1][:, None] >= other[0])).all(axis=2)
    assert (kept[0] >= overlap.any(axis=1)).all() and (kept[1] >= overlap.any(axis=0)).all()


def test_boxes_far_apart_in_height_are_dropped_where_their_plan_says_so():
    """Two saddles that come together at one place: what is kept is near to it."""
    x, y = (part.ravel() for part in np.meshgrid(np.linspace(-1, 1, 60), np.linspace(-1, 1, 60)))
    high = 0.5 * (x**2 + y**2)
    below, above = np.stack([x, y, 0.02 * x], axis=1), np.stack([x, y, 0.02 * x + high], axis=1)
    half = np.array([0.02, 0.02, 0.02])
    for kept, points in zip(share_space((below - half, below + half), (above - half, above + half)), (below, above)):
        gap = 0.5 * (points[:, 0] ** 2 + points[:, 1] ** 2)
        assert kept[gap < 0.02].all() and gap[kept].max() < 0.12
