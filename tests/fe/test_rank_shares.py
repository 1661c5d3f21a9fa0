"""What each rank has to do in a step of a pass: elements, and on one of them contact."""

import numpy as np
import pytest

from rail_fem.case.casefile import load_case
from rail_fem.fe.contact.messages import OWNER
from rail_fem.fe.passage import LEAST_SHARE, contact_cost, rank_shares


@pytest.mark.parametrize("ranks", [1, 2, 3, 8])
def test_all_ranks_have_as_much_to_do(ranks):
    elements, contact = 40e3, 2.5e3
    work = rank_shares(elements, contact, ranks) * elements / ranks
    assert np.isclose(work.sum(), elements, rtol=1e-12)
    work[OWNER] += contact if ranks > 1 else 0.0
    assert np.ptp(work) < 1e-9 * elements


def test_on_many_ranks_the_owner_still_has_elements():
    shares = rank_shares(40e3, 2.5e3, 64)
    assert shares[OWNER] == LEAST_SHARE and np.isclose(shares.sum(), 64) and np.ptp(np.delete(shares, OWNER)) == 0


def test_contact_costs_as_its_pairs():
    """Measured on the reference pass: 59 pairs on cubes of 4 mm, 652 on the main job's elements, 1,273 on 0.5 mm."""
    settings = load_case("nose_transfer").runs["fe_full"]
    cost = lambda size, aspect, ratio: contact_cost(
        settings.model_copy(update={"element_size": size, "element_aspect": aspect, "wheel_element_ratio": ratio})
    )
    least = cost(1.0, 1.0, 1.0)
    of_pair = [
        (cost(*shape) - least) / pairs
        for shape, pairs in (((4e-3, 1, 1), 59), ((0.7e-3, 2, 1.5), 652), ((0.5e-3, 2, 1.5), 1273))
    ]
    assert np.ptp(of_pair) < 0.1 * min(of_pair)
