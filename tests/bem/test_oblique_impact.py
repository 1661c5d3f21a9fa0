"""A sphere that strikes at an angle: the half-space's friction marched in time, against what is known exactly."""

import numpy as np
import pytest

from tests.bem.closed_forms import cattaneo_sphere
from tests.bem.oblique_impact import RADIUS, ObliqueImpact, SlidingCells, SlidingSprings, rebound


def test_a_row_of_springs_has_the_force_of_cattaneo():
    """At a held approach, over the shift; the row's own error is that of the midpoint rule."""
    impact = ObliqueImpact()
    approach = 0.7 * impact.largest_approach
    radius = np.sqrt(RADIUS * approach)
    limit = impact.friction * 4 / 3 * impact.pair.modulus * radius**3 / RADIUS
    for share in (0.2, 0.6, 0.95):
        _, shift = cattaneo_sphere(share * limit, limit, radius, impact.steel, impact.steel)
        assert SlidingSprings(impact, 2000)(approach, shift) == pytest.approx(-share * limit, rel=1e-3)


def test_a_sphere_that_slides_all_the_time_loses_friction_times_the_normal_impulse():
    """Momentum alone: psi falls by `slide`, to (2.94 / 60)^2 of it by the leapfrog's step."""
    impact = ObliqueImpact()
    for march in (SlidingSprings(impact, 400), SlidingCells(impact, 10)):
        assert rebound(impact, 7.0, march, 60) == pytest.approx(7.0 - impact.slide, abs=0.0024 * impact.slide)


def test_sliding_begins_and_ends_where_the_elastic_surface_outruns_the_sphere():
    """Sliding needs the sphere to be faster than the surface that friction draws along, mu / stiffness ratio times the
    approach: psi > 1 at the start, psi > -1 at the end, so all slides from slide - 1 on, and not below."""
    impact = ObliqueImpact()
    lost = lambda psi: psi - rebound(impact, psi, SlidingSprings(impact, 800), 3000)
    assert lost(impact.slide - 0.9) == pytest.approx(impact.slide, abs=1e-3)
    assert lost(impact.slide - 1.3) < impact.slide - 0.01


def test_friction_and_velocity_drop_out():
    one, two = (
        rebound(impact, 2.0, SlidingSprings(impact, 200), 200)
        for impact in (ObliqueImpact(), ObliqueImpact(0.3, 0.05, 0.2))
    )
    assert one == pytest.approx(two, rel=1e-9)


def test_cells_and_springs_rebound_alike():
    """Sliding at the start, sticking in the middle, sliding back at the end (psi 2): the path that friction remembers.
    With Poisson's ratio 0 Cattaneo's and Mindlin's theory, which the springs are, is exact; the cells are of first
    order."""
    impact = ObliqueImpact(poisson=0.0)
    exact = rebound(impact, 2.0, SlidingSprings(impact, 800), 1600)
    assert rebound(impact, 2.0, SlidingCells(impact, 16), 60) == pytest.approx(exact, abs=0.05)
