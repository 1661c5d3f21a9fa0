"""The same run on 1, 2 and 3 ranks: plasticity, friction, supports and moving contact, to round-off."""

import numpy as np
import pytest

from rail_fem.fe.partition import balanced_parts
from tests.ranks import arrays_of_ranks

pytestmark = pytest.mark.mpi


def run(ranks, out):
    return arrays_of_ranks(ranks, out, "tests/fe/rank_job.py", out)


@pytest.fixture(scope="module")
def serial(tmp_path_factory):
    return run(1, tmp_path_factory.mktemp("ranks") / "1.npz")


@pytest.mark.parametrize("parts", [1, 2, 3, 5, 7])
def test_every_rank_gets_its_share_of_the_work_in_one_piece(parts):
    """Cells of cost 1 and 3 in a bar: each part's cost is the mean to a cell's cost a cut, and the parts follow each
    other along the bar."""
    rng = np.random.default_rng(0)
    centres, cost = rng.uniform(0, 1, (3000, 3)) * [100.0, 1.0, 1.0], rng.choice([1.0, 3.0], 3000)
    part = balanced_parts(centres, cost, parts)
    shares = np.bincount(part, cost, minlength=parts)
    assert np.abs(shares - cost.sum() / parts).max() <= 3 * np.ceil(np.log2(parts)) * 2
    assert (np.diff(part[np.argsort(centres[:, 0])]) >= 0).all()


def test_the_run_is_worth_comparing(serial):
    """It flows, slides and carries load."""
    assert serial["peeq"].max() > 1e-3
    assert -serial["force"][:, 2].min() > 1e3
    assert np.abs(serial["force"][:, 0]).max() > 100.0
    assert all(np.isfinite(serial[name]).all() for name in serial)


@pytest.mark.parametrize("ranks", [pytest.param(2, marks=pytest.mark.validate), 3])
def test_forces_and_state_are_the_same_on_any_number_of_ranks(serial, ranks, tmp_path):
    """Only the order of sums differs: 1e-10 of each quantity's largest value."""
    other = run(ranks, tmp_path / "out.npz")
    assert other["ranks"] == ranks and other["dt"] == serial["dt"]
    for name in ("force", "reactions", "x", "v", "peeq", "stress", "pressure", "energies"):
        scale = np.abs(serial[name]).max()
        assert np.abs(other[name] - serial[name]).max() <= 1e-10 * scale, name
    assert other["exchange"] < 1e-15
    assert (other["apart"] == 0.0).all()  # positions, velocities and forces of a node, on all ranks that have it
    assert other["ahead"] > 0 and serial["ahead"] == 0  # blocks computed while messages are under way
    # no rank waits for all others in a step but in searches, every 20 steps
    assert np.median(other["sums"]) == 0 and (other["sums"] > 0).mean() < 0.1
