"""What each rank has to do in a step of a pass: elements, and on some of them contact."""

import numpy as np
import pytest

from rail_fem.case.casefile import load_case
from rail_fem.fe.contact.messages import owner_count
from rail_fem.fe.passage import LEAST_SHARE, contact_cost, rank_shares

ELEMENTS = 40e3


@pytest.fixture(scope="module")
def settings():
    return load_case("nose_transfer").runs["fe_full"]


@pytest.mark.parametrize(("ranks", "owners"), [(1, 1), (2, 1), (3, 1), (8, 2)])
def test_all_ranks_have_as_much_to_do(settings, ranks, owners):
    work = rank_shares(ELEMENTS, settings, ranks) * ELEMENTS
    assert owner_count(ranks) == owners and np.isclose(work.sum(), ELEMENTS, rtol=1e-12)
    work[:owners] += contact_cost(settings, owners)
    assert np.ptp(work) < 1e-9 * ELEMENTS


def test_on_many_ranks_owners_still_have_elements(settings):
    shares = rank_shares(ELEMENTS, settings, 64)
    assert owner_count(64) == 4 and np.allclose(shares[:4], LEAST_SHARE / 64, rtol=1e-12)
    assert np.isclose(shares.sum(), 1.0) and np.ptp(shares[4:]) == 0


def test_contact_costs_as_its_pairs(settings):
    """Measured on the reference pass: 59 pairs on cubes of 4 mm, 652 on the main job's elements, 1,273 on 0.5 mm."""
    cost = lambda size, aspect, ratio: contact_cost(
        settings.model_copy(update={"element_size": size, "element_aspect": aspect, "wheel_element_ratio": ratio}), 1
    )
    least = cost(1.0, 1.0, 1.0)
    of_pair = [
        (cost(*shape) - least) / pairs
        for shape, pairs in (((4e-3, 1, 1), 59), ((0.7e-3, 2, 1.5), 652), ((0.5e-3, 2, 1.5), 1273))
    ]
    assert np.ptp(of_pair) < 0.1 * min(of_pair)
