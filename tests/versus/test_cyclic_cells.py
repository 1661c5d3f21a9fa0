"""The law over many cycles in cells of the boundary elements, by five numbers a deviator, against that of a point."""

import numpy as np
import pytest

from bem.material import STEEL
from bem.plastic.rolling_line import rolling_line_contact
from bem.steel.cyclic_law import cyclic_law, plastic_return
from bem.steel.deviator import FROM_DEVIATOR
from bem.steel.nonlinear_kinematic import NonlinearKinematic
from bem.steel.return_map import PlasticState, advanced, radial_return
from tests.bem.plastic.line_shakedown import SHEAR_YIELD, one_pass, rolling_line

CONSTANTS = {"modulus": [100e9, 20e9, 3e9], "recovery": [2000.0, 300.0, 20.0]}
LAWS = {
    "Chaboche": CONSTANTS,
    "Ohno-Wang": CONSTANTS | {"mixing": 0.0},
    "mixed, hardens": CONSTANTS | {"mixing": [1.0, 0.1, 0.3], "hardening": 80e6, "hardening_rate": 20.0},
    "one, linear": {"modulus": [5e9], "recovery": [0.0]},
}


@pytest.mark.parametrize("constants", LAWS.values(), ids=LAWS)
def test_a_cell_goes_along_any_path_as_the_point_of_the_finite_elements_does(constants):
    law = cyclic_law(STEEL.young, STEEL.poisson, 300e6, **constants)
    own = NonlinearKinematic(300e6, **constants)
    count = own.back_stresses
    state, plastic = PlasticState.virgin((1, 5, 1, 1), count), np.zeros(5)
    back, p, flowed = np.zeros((count, 6)), 0.0, 0
    rng = np.random.default_rng(4)
    strain = np.zeros(5)
    for _ in range(300):
        strain += 4e-4 * rng.normal(size=5)  # 2 e of the elastic limit now and then
        trial = 2 * STEEL.shear * (strain - plastic)
        found = radial_return(trial[None, :, None, None], state, own, STEEL.shear)
        state = advanced(state, found, own)
        point = FROM_DEVIATOR @ trial
        dp = plastic_return(law, point, back, p, np.empty(6), np.empty(count))
        p, flowed = p + dp, flowed + (dp > 0)
        plastic = plastic + found.increment[0, :, 0, 0]
        stress = FROM_DEVIATOR @ (2 * STEEL.shear * (strain - plastic))
        assert np.abs(stress - point).max() < 1e-9 * 300e6
        assert state.peeq[0, 0, 0] == pytest.approx(p, rel=1e-9, abs=1e-15)
    assert flowed > 100 and p > 0.02
    assert np.abs(FROM_DEVIATOR @ state.centre[0, :, 0, 0] - back.sum(axis=0)).max() < 1e-9 * 300e6


def test_cells_that_redistribute_ratchet_slower_than_points_led_by_the_elastic_field():
    """A line contact beyond shakedown: plastic strain grows by the same at every pass in both, at the same depth; in
    points more, since what flows around them takes nothing off them (docs/models/cyclic.md)."""
    constants = CONSTANTS | {"mixing": 0.1}
    track, deviator = rolling_line(4.3, 6, depth=4, ring=12, hardening=NonlinearKinematic(300e6, **constants), window=6)
    strain = [np.zeros(track.body.layers)]
    for _ in range(4):
        one_pass(track, deviator, stride=2)
        strain.append(track.state.peeq.mean(axis=1)[:, 0])
    law = cyclic_law(STEEL.young, STEEL.poisson, 300e6, **constants)
    points = rolling_line_contact(law, 1.0, 4.3 * SHEAR_YIELD, 0.0, track.body.depths, 4).plastic_strain
    cells = np.diff(strain, axis=0)
    assert cells[3].max() == pytest.approx(cells[2].max(), rel=0.05)
    assert 0.25 < cells[3].max() / np.diff(points, axis=0)[2].max() < 0.6
    assert abs(int(strain[-1].argmax()) - int(points[-1].argmax())) <= 1
