"""The critical path of a step: stretches of work take what the slowest rank takes, messages what the last one takes."""

import numpy as np
import pytest

from rail_fem.studies.critical_path import Stretch, critical_paths, length_of_work, mean_length, report


def step(*stretches):
    return [Stretch(*s) for s in stretches]


def test_the_slowest_rank_counts_in_each_stretch_and_the_last_one_in_each_message():
    """Rank 0 has 5 and 1 to do, rank 1 has 3 and 4; rank 1 waits 2 for the other in the message, which takes 0.1."""
    first = step(("sum", 5.0, 0.1), ("end", 1.0, 0.0))
    second = step(("sum", 3.0, 2.1), ("end", 4.0, 0.0))
    (path,) = critical_paths([[first] * 3, [second] * 3])
    assert path.slowest.tolist() == [5.0, 4.0] and path.inside.tolist() == [0.1, 0.0]
    assert path.length == pytest.approx(9.1) and path.work.tolist() == [[5.0, 1.0], [3.0, 4.0]]
    assert length_of_work([path]) == pytest.approx(6.5)
    assert "efficiency 71.4%" in report([path], 13.0, 2)


def test_a_step_that_was_disturbed_counts_no_more_than_others_of_its_kind():
    """Nine steps of 1 and one of 100; one with a search of 3."""
    steps = (
        [step(("sum", 1.0, 0.0))] * 9 + [step(("sum", 100.0, 0.0))] + [step(("search", 2.0, 0.0), ("sum", 1.0, 0.0))]
    )
    paths = critical_paths([steps])
    assert [path.steps for path in paths] == [10, 1]
    assert mean_length(paths) == pytest.approx((10 * 1.0 + 3.0) / 11)


def test_ranks_that_do_not_send_the_same_messages_are_found():
    with pytest.raises(ValueError, match="not the same messages"):
        critical_paths([[step(("sum", 1.0, 0.0))], [step(("gather", 1.0, 0.0))]])
    assert np.isfinite(mean_length(critical_paths([[step(("sum", 1.0, 0.0))]])))
