import numpy as np
import pytest

from rail_fem.scene.steel import GRADES, MN13, R8T, Steel, prestrained


def test_wave_speed_is_that_of_a_plane_dilatational_wave():
    """c_d = sqrt((lambda + 2 mu) / rho); steel of 210 GPa, nu 0.3, 7850 kg/m3: 6001 m/s."""
    steel = Steel(210e9, 0.3, 7850.0)
    lame = steel.youngs_modulus * 0.3 / (1.3 * 0.4)
    assert steel.wave_speed == pytest.approx(np.sqrt((lame + 2 * steel.elastic.shear) / 7850), rel=1e-14)
    assert steel.wave_speed == pytest.approx(6001, abs=0.5)


def test_mn13_first_yields_at_310_mpa_and_hardens_along_its_table():
    assert MN13.yield_stress(np.array(0.0)) == 310e6
    assert MN13.yield_stress(np.array([0.05, 0.075])) == pytest.approx([550e6, 625e6])
    assert MN13.yield_stress(np.array(9.0)) == 1550e6


def test_scaled_steel_has_scaled_stresses_and_the_same_elasticity():
    hard = MN13.scaled(4.0)
    assert hard.yield_stress(np.array(0.0)) == 1240e6
    assert (hard.youngs_modulus, hard.wave_speed) == (MN13.youngs_modulus, MN13.wave_speed)


def test_elastic_steel_never_yields():
    assert R8T.is_elastic and not MN13.is_elastic
    assert np.isinf(R8T.yield_stress(np.array([0.0, 1.0]))).all()


def test_curve_cannot_be_changed_afterwards():
    with pytest.raises(ValueError):
        MN13.hardening_stress[0] = 1.0


@pytest.mark.parametrize(
    "change, said",
    [
        ({"hardening_strain": [0.0, 0.1]}, "two equal lists"),
        ({"hardening_strain": [0.1], "hardening_stress": [1e6]}, "start at 0"),
        ({"hardening_strain": [0, 0.1, 0.1], "hardening_stress": [1e6, 2e6, 3e6]}, "increase strictly"),
        ({"hardening_strain": [0, 0.1], "hardening_stress": [2e6, 1e6]}, "never falls"),
        ({"hardening_strain": [0, 0.1], "hardening_stress": [1e6, np.nan]}, "not finite"),
        ({"hardening_strain": [0.0], "hardening_stress": [0.0]}, "positive"),
    ],
)
def test_values_that_no_steel_has_are_refused(change, said):
    with pytest.raises(ValueError, match=said):
        Steel(**({"youngs_modulus": 2e11, "poisson": 0.3, "density": 7800.0} | change))


@pytest.mark.parametrize("name, proof, strength, uniform", [("R260", 480, 880, 0.09), ("R350HT", 780, 1175, 0.08)])
def test_a_rail_steel_has_the_tensile_test_it_was_made_from(name, proof, strength, uniform):
    """0.2 % proof stress; greatest nominal stress of the pulled bar, true stress times exp(-strain), at Considere's
    point."""
    steel, strain = GRADES[name], np.linspace(1e-3, 0.4, 4000)
    assert steel.yield_stress(np.array(0.002)) == pytest.approx(proof * 1e6, rel=0.01)
    nominal = steel.yield_stress(strain) * np.exp(-strain)
    # the greatest nominal stress lies at the uniform elongation; chords of the table cut up to 1 % off
    assert nominal.max() == pytest.approx(strength * 1e6, rel=0.03)
    assert nominal[-1] < nominal.max() and nominal[0] < nominal.max()


def test_a_prestrained_steel_goes_on_where_its_curve_was_left():
    hard = prestrained(MN13, 0.2)
    assert hard.yield_stress(np.array([0.0, 0.1])) == pytest.approx(MN13.yield_stress(np.array([0.2, 0.3])))
    # Tabor: 3 times the flow stress after a further 8 % is the hardness, 200 HB as cast, 350 hardened [kgf/mm2]
    hardness = [3 * float(steel.yield_stress(np.array(0.08))) / 9.81e6 for steel in (MN13, GRADES["Mn13-hardened"])]
    assert hardness == pytest.approx([200, 350], rel=0.06)
