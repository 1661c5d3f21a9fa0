"""Times of the parts of a step: each without its inner parts and without the clock."""

import pytest

from rail_fem.studies import step_shares
from rail_fem.studies.step_shares import Stopwatch


class Ticking:
    """A clock that goes on by one whenever it is read."""

    now = 0.0

    def process_time(self) -> float:
        self.now += 1
        return self.now


def test_a_part_has_its_own_time_alone(monkeypatch):
    """Three ticks of work in the inner part, called twice, five in the outer."""
    clock = Ticking()
    monkeypatch.setattr(step_shares, "time", clock)
    watch = Stopwatch()

    def work(ticks):
        clock.now += ticks

    inner = watch.timed("inner", lambda: work(3))

    def both():
        inner()
        work(5)
        inner()

    watch.timed("outer", both)()
    assert watch.spent["inner"] == pytest.approx(6) and watch.calls["inner"] == 2
    assert watch.spent["outer"] == pytest.approx(5, abs=1e-3) and watch.calls["outer"] == 1


def test_what_is_timed_is_there_to_be_timed():
    assert all(callable(getattr(owner, name)) for _, owner, names in step_shares.PARTS for name in names)
