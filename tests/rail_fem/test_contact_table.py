"""What a contact table interpolates is the exact value to the error that it claims."""

import numpy as np
import pytest

from bem.exact.hertz import contact_stiffness
from rail_fem.light.contact_table import equivalent_paraboloid, hertz_constants


def test_the_middle_of_an_intersection_lies_where_there_is_metal():
    """Two shoulders of a groove: the middle is that of the shoulder at the contact point; of one piece, as it was."""
    across, along = np.linspace(-4e-3, 4e-3, 81), np.linspace(-4e-3, 4e-3, 41)
    bowl = across**2 / (2 * 0.1) + along[:, None] ** 2 / (2 * 0.4)
    whole = bowl + np.where(across > 0, 0.5, 0.0) * across**2 / 0.1
    depth = np.array([2e-5, 2e-5])
    groove = np.where(np.abs(across - 1e-3) < 0.6e-3, 1e-3, bowl)
    _, middle, _ = equivalent_paraboloid(np.stack([groove, whole]), along, across, depth)
    right_end, left_end = 0.4e-3, -np.sqrt(2 * 0.1 * 2e-5)
    assert middle[0] == pytest.approx((left_end + right_end) / 2, abs=6e-5)
    assert middle[1] == pytest.approx((left_end + np.sqrt(2e-5 * 0.1)) / 2, abs=6e-5)


def test_hertz_constants_of_a_table_are_the_exact_ones_to_2e_5():
    """Radii of a wheel on a rail and beyond, both ways round, between the table's own points."""
    generator = np.random.default_rng(3)
    radii = np.exp(generator.uniform(np.log(0.02), np.log(1.0), (200, 2)))
    exact = np.array([contact_stiffness(*pair, 1.15e11) for pair in radii])
    assert hertz_constants(radii, 1.15e11) == pytest.approx(exact, rel=2e-5)
