"""Contact is searched anew before a node that is not watched can come into contact, however fast the wheel and however
long the step."""

import dataclasses

import pytest
from mpi4py import MPI

from rail_fem.fe.contact import APPROACH, SLOPE
from tests.fe.rolling_job import rolling

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
