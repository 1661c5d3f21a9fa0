"""What a contact table interpolates is the exact value to the error that it claims."""

import numpy as np
import pytest

from bem.exact.hertz import contact_stiffness
from rail_fem.light.contact_table import hertz_constants


def test_hertz_constants_of_a_table_are_the_exact_ones_to_2e_5():
    """Radii of a wheel on a rail and beyond, both ways round, between the table's own points."""
    generator = np.random.default_rng(3)
    radii = np.exp(generator.uniform(np.log(0.02), np.log(1.0), (200, 2)))
    exact = np.array([contact_stiffness(*pair, 1.15e11) for pair in radii])
    assert hertz_constants(radii, 1.15e11) == pytest.approx(exact, rel=2e-5)
