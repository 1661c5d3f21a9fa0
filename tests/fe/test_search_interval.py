"""Contact is searched anew before a node that is not watched can come into contact, however fast the wheel and however
long the step; most searches look at near facets only and find the same."""

import dataclasses

import numpy as np
import pytest
from mpi4py import MPI
from hypothesis import given, settings
from hypothesis import strategies as st

from rail_fem.fe.contact import contact as contact_module
from rail_fem.fe.contact.contact import APPROACH, SLOPE, Contact
from rail_fem.fe.contact.near_facets import share_space
from tests.fe.rolling_job import rolling, run

DT = 1.5e-7


@pytest.fixture(scope="module")
def contact():
    found = rolling(MPI.COMM_SELF).dynamics.contact
    found.settings = dataclasses.replace(found.settings, refresh=None)
    return found


@pytest.mark.parametrize("speed", [0.0, 1.0, 33.5, -33.5, 156.5])
@pytest.mark.parametrize("scale", [1, 5, 1000])
def test_surfaces_come_at_most_half_the_margin_nearer_between_searches(contact, speed, scale):
    contact.speed = speed
    dt = scale * DT
    steps = contact.steps_between_searches(dt)
    closed = steps * dt * (SLOPE * abs(speed) + APPROACH)
    assert steps >= 1 and (steps == 1 or 0.25 * contact.settings.margin < closed <= 0.5 * contact.settings.margin)


def test_a_longest_interval_is_kept(contact):
    contact.speed = 0.0
    contact.settings = dataclasses.replace(contact.settings, refresh=7)
    assert contact.steps_between_searches(DT) == 7 and contact.steps_between_searches(1.0) == 1


@pytest.mark.parametrize("window", [(None, None), (8e-3, 8e-3)], ids=["whole", "travelling window"])
def test_searches_among_near_facets_find_what_searches_of_all_find(monkeypatch, window):
    steps, looks = 900, []
    look = Contact._look_at_all
    monkeypatch.setattr(Contact, "_look_at_all", lambda *a: looks.append(1) or look(*a))
    near = run(rolling(MPI.COMM_SELF, *window), steps)
    few = len(looks)
    monkeypatch.setattr(contact_module, "NEARER", 0.0)
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
