"""Published fits of a sphere and a flat, elastic and perfectly plastic: first yield, pieces, one beside the other."""

import numpy as np
import pytest

from bem.exact.hertz import HertzError
from bem.exact.yielding_sphere import first_yield, jackson_green, kogut_etsion
from bem.material import Elastic, contact_modulus

YIELD, RADIUS = 310e6, 0.1
MODULUS = contact_modulus(Elastic(1e17, 0.3), Elastic(210e9, 0.3))
FIRST = first_yield(RADIUS, MODULUS, YIELD)


def test_first_yield_of_a_sphere_is_that_of_hertz_pressure():
    """p0 = 1.61 yield stresses at nu 0.3 (the fit's C: 1.615), area pi R times the approach, Hertz' load."""
    assert 1.5 * FIRST.load / FIRST.area == pytest.approx(1.615 * YIELD, rel=1e-3)
    assert FIRST.load == pytest.approx(4 / 3 * MODULUS * np.sqrt(RADIUS * FIRST.approach**3), rel=1e-12)
    with pytest.raises(HertzError, match="radius"):
        first_yield(0.0, MODULUS, YIELD)


def test_the_fits_join_their_pieces_and_agree_with_each_other():
    """Kogut and Etsion's pieces meet within 7.5 % at 1 and 3 % at 6; both fits agree within 6 % from 2 to 110."""
    for w, gap in ((1.0, 0.075), (6.0, 0.03)):
        below, above = (np.array(kogut_etsion(w * (1 + e))) for e in (-1e-9, 1e-9))
        assert np.abs(above / below - 1).max() < gap
    w = np.geomspace(2, 110, 40)
    load, area = kogut_etsion(w)
    other_load, other_area = jackson_green(w, RADIUS, MODULUS, YIELD)
    assert np.abs(other_load / load - 1).max() < 0.06 and np.abs(other_area / area - 1).max() < 0.06
    assert np.isnan(kogut_etsion(111.0)[0])
