"""A wheel's own modes: exact frequencies with their order, the thin ring's, statics, and what the light models make of
them."""

import numpy as np
import pytest
from scipy import special
from scipy.optimize import brentq
from scipy.sparse.linalg import eigsh

from bem.material import Elastic
from rail_fem.case.preflight import preflight_errors
from rail_fem.models import rigid_hertz
from rail_fem.passes import wheel_modes as module
from rail_fem.passes.fourier_section import grid_section, matrices
from rail_fem.passes.wheel_modes import modes_of, wheel_modes, wheel_section
from rail_fem.scene.wheel_body import WheelBody
from rail_fem.settings.light import RigidHertzSettings
from tests.order import assert_order
from tests.rail_fem.test_scene import make_scene

STEEL, DENSITY = Elastic(206e9, 0.29), 7850.0
BODY, RADIUS, UNSPRUNG = WheelBody(), 0.425, 500.0


def lowest(section, n, held):
    """Lowest frequency [Hz] of harmonic n above 1 Hz with unknowns `held`."""
    stiffness, mass = matrices(section, n, STEEL, DENSITY)
    free = np.setdiff1d(np.arange(stiffness.shape[0]), held)
    square = eigsh(stiffness[free][:, free], k=4, M=mass[free][:, free], sigma=-1e4, return_eigenvectors=False)
    return min(np.sqrt(value) / (2 * np.pi) for value in square if value > 40)


def traction(omega, n, r, steel):
    """(2, 4)  stresses rr and rt at r of the four waves of harmonic n in plane strain, over the shear modulus."""
    lame = 2 * steel.shear * steel.poisson / (1 - 2 * steel.poisson)
    fast, slow = omega * np.sqrt(DENSITY / (lame + 2 * steel.shear)), omega * np.sqrt(DENSITY / steel.shear)
    columns = []
    for k, kind in ((fast, "L"), (slow, "T")):
        for f, slope in ((special.jv, special.jvp), (special.yv, special.yvp)):
            value, first = f(n, k * r), k * slope(n, k * r)
            second = -first / r - (k**2 - n**2 / r**2) * value
            turn = n * (first / r - value / r**2)
            if kind == "L":  # gradient of a potential
                columns.append((-lame / steel.shear * k**2 * value + 2 * second, -2 * turn))
            else:  # curl of one
                columns.append((2 * turn, -(n**2) * value / r**2 - second + first / r))
    return np.array(columns).T


@pytest.mark.parametrize("n", [0, 2, 5])
def test_modes_of_a_hollow_cylinder_in_plane_strain_are_exact_at_fourth_order(n):
    """Free inside and outside, Helmholtz' potentials with Bessel functions: the determinant of four tractions."""
    inner, outer = 0.15, 0.40

    def found(cells):
        section = grid_section(np.linspace(inner, outer, cells + 1), np.array([0.0, 0.05]), np.ones((cells, 1), bool))
        nodes = np.arange(len(section.points))
        held = np.r_[3 * nodes + 2, 3 * nodes + 1] if n == 0 else 3 * nodes + 2
        return lowest(section, n, held)

    def determinant(frequency):
        both = np.vstack([traction(2 * np.pi * frequency, n, r, STEEL) for r in (inner, outer)])
        if n == 0:  # no shear without torsion
            both = both[::2, :2]
        return np.linalg.det(both / np.abs(both).max(axis=0))

    values = {cells: found(cells) for cells in (16, 32, 64)}
    exact = brentq(determinant, 0.9999 * values[64], 1.0001 * values[64], xtol=1e-10)
    assert_order([1 / cells for cells in values], [abs(v - exact) / exact for v in values.values()], expected=4)


def test_a_thin_ring_bends_as_loves_formula_says():
    """Inextensional bending in its plane: omega^2 = E I / (rho A R^4) n^2 (n^2 - 1)^2 / (n^2 + 1); shear and rotary
    inertia take off some n^2 (t / R)^2."""
    radius, thickness = 0.4, 0.008
    r = radius + thickness * np.array([-0.5, 0.0, 0.5])
    section = grid_section(r, np.array([0.0, thickness]), np.ones((2, 1), bool))
    for n in (2, 3, 4):
        exact = np.sqrt(STEEL.young / DENSITY / 12) * thickness / radius**2
        exact *= n * (n**2 - 1) / np.sqrt(n**2 + 1) / (2 * np.pi)
        nodes = np.arange(len(section.points))
        axial = 3 * nodes[np.abs(section.points[:, 1] - thickness / 2) < 1e-9] + 2  # in its plane, the other half alike
        assert lowest(section, n, axial) == pytest.approx(exact, rel=2 * n**2 * (thickness / radius) ** 2)


def test_the_section_weighs_what_its_rectangles_weigh():
    section = wheel_section(BODY, RADIUS, 0.0)
    up = module._upward(section)
    _, mass = matrices(section, 1, STEEL, DENSITY)
    ring = lambda low, high, width: np.pi * (high**2 - low**2) * width * DENSITY
    inner = RADIUS - BODY.rim_depth
    whole = ring(BODY.bore_radius, BODY.hub_radius, BODY.hub_width) + ring(BODY.hub_radius, inner, BODY.web_thickness)
    whole += ring(inner, RADIUS, BODY.rim_width)
    whole += ring(RADIUS, RADIUS + BODY.flange_height, BODY.flange_thickness)
    assert up @ (mass @ up) == pytest.approx(whole, rel=1e-12)
    assert module.weighed(section, UNSPRUNG, STEEL, DENSITY) == pytest.approx(whole, rel=1e-12)


def test_frequencies_do_not_hang_on_the_elements():
    coarse, fine = (wheel_modes(BODY, RADIUS, UNSPRUNG, STEEL, DENSITY, 3e3, h) for h in (15e-3, 7.5e-3))
    order = [np.argsort(modes.frequency) for modes in (coarse, fine)]
    assert len(coarse.frequency) == len(fine.frequency)
    np.testing.assert_allclose(coarse.frequency[order[0]], fine.frequency[order[1]], rtol=5e-3)


@pytest.mark.validate
def test_the_sum_of_modes_is_the_dynamic_solution_of_the_half_wheelset():
    """Harmonic 1, bore and axle going up and down together: how the contact's flexibility changes from 200 to 1000 Hz,
    against a direct solve. What modes above the sixteenth add is alike at both."""
    section = wheel_section(BODY, RADIUS, 0.0)
    at = int(np.argmin(np.hypot(section.points[:, 0] - RADIUS, section.points[:, 1])))
    stiffness, mass = matrices(section, 1, STEEL, DENSITY)
    up = module._upward(section)
    axle = UNSPRUNG - up @ (mass @ up)
    bore = np.flatnonzero(section.points[:, 0] < BODY.bore_radius + 1e-9)
    held = np.concatenate([3 * bore, 3 * bore + 1, 3 * bore + 2])
    free = np.setdiff1d(np.arange(len(up)), held)
    shape = np.zeros((len(up), len(free) + 1))
    shape[free, np.arange(len(free))], shape[held, -1] = 1.0, up[held]
    force = -shape[3 * at]
    modes = module._harmonic(section, 1, STEEL, DENSITY, axle, at, 1e6)
    direct, modal = [], []
    for omega in 2 * np.pi * np.array([200.0, 1000.0]):
        dynamic = shape.T @ ((stiffness - omega**2 * mass) @ shape)
        dynamic[-1, -1] -= omega**2 * axle
        direct.append(force @ np.linalg.solve(dynamic, force) + 1 / (UNSPRUNG * omega**2))
        modal.append(sum(1 / (m * ((2 * np.pi * f) ** 2 - omega**2)) for _, f, m, _ in modes))
    assert modal[1] - modal[0] == pytest.approx(direct[1] - direct[0], rel=2e-3)


def test_a_wheel_without_modes_in_the_band_is_the_rigid_one():
    settings = RigidHertzSettings(start=0.30, end=0.40, path_spacing=10e-3, wheel_modes=100.0)
    rigid, soft = (rigid_hertz.solve(make_scene(wheel_body=body), settings) for body in (None, BODY))
    for name, values in rigid.history.items():
        np.testing.assert_array_equal(values, soft.history[name])


def test_a_wheel_with_modes_stands_at_rest_and_keeps_its_energy():
    """On plain line the force stays the static load; over the nose the energies balance as those of the rigid wheel
    do."""
    level = make_scene(wheel_body=BODY, crossing={"family": "joint", "dip_angle": 0.0})
    plain = rigid_hertz.solve(level, RigidHertzSettings(start=-0.2, end=0.2, path_spacing=10e-3))
    np.testing.assert_allclose(plain.history["force"], level.static_wheel_load, rtol=1e-6)
    settings = RigidHertzSettings(start=0.30, end=0.40, path_spacing=10e-3)
    rigid, soft = (rigid_hertz.solve(make_scene(wheel_body=body), settings) for body in (None, BODY))
    limits = [np.abs(r.history["energy_balance"]).max() for r in (rigid, soft)]
    assert limits[1] < 3 * limits[0] + 1e-3 * np.ptp(soft.history["energy_contact"])
    assert soft.peaks["largest_force"].value != rigid.peaks["largest_force"].value


def test_a_wheels_centre_sinks_by_what_its_modes_give_between_axle_and_contact():
    """Harmonic 1 moves the axle: without it the centre stood 6 um higher, its acceleration at 2 kHz was 13 % off."""
    level = make_scene(wheel_body=BODY, crossing={"family": "joint", "dip_angle": 0.0})
    settings, modes = RigidHertzSettings(start=-0.02, end=0.02, path_spacing=10e-3), modes_of(BODY, level, 5e3)
    both = level, level.replace(wheel_body=None)
    soft, rigid = (rigid_hertz.solve(one, settings).history["wheel_height"] for one in both)
    given = module.static_deflections(level, modes)
    assert modes.axle @ given < -1e-6
    assert soft[0] - rigid[0] == pytest.approx((modes.axle - 1) @ given, rel=1e-6)


def test_a_wheel_gives_way_more_than_a_rigid_one_below_its_first_mode():
    """Height of the contact per harmonic force on it [m/N], at 50 and 1000 Hz."""
    modes, omega = modes_of(BODY, make_scene(wheel_body=BODY), 5e3), 2 * np.pi * np.array([50.0, 1000.0])
    rigid, own = -1 / (UNSPRUNG * omega**2), 2 * np.pi * modes.frequency[:, None]
    soft = rigid + (1 / modes.mass[:, None] / (own**2 - omega**2)).sum(axis=0)
    assert soft[0] == pytest.approx(rigid[0], rel=0.02) and soft[1] != pytest.approx(rigid[1], rel=0.1)


@pytest.mark.parametrize(
    "changes, complaint",
    [
        ({"bore_radius": 0.14}, "must be smaller than the hub"),
        ({"web_thickness": 0.1, "rim_width": 0.08}, "thinner"),
        ({"web_position": 0.1}, "within the rim"),
    ],
)
def test_a_wheel_that_cannot_be_is_refused(changes, complaint):
    with pytest.raises(ValueError, match=complaint):
        WheelBody(**changes)


def test_a_wheel_that_is_too_heavy_or_has_no_web_is_told():
    with pytest.raises(ValueError, match="half a wheelset 100 kg"):
        wheel_modes(BODY, RADIUS, 100.0, STEEL, DENSITY, 3e3)
    with pytest.raises(ValueError, match="no web"):
        wheel_modes(BODY, 0.19, UNSPRUNG, STEEL, DENSITY, 3e3)


@pytest.mark.parametrize(
    "body, said", [({"hub_radius": 0.36}, "no web"), ({"rim_width": 0.06, "web_position": -0.04}, "not on the tread")]
)
def test_a_check_refuses_a_wheel_that_cannot_be(body, said):
    """Once more than the run, which begins by it."""
    scene = make_scene(wheel_body=WheelBody(**body))
    (error,) = preflight_errors(scene, RigidHertzSettings(), 1, "rigid_hertz")
    assert error.startswith("scene.wheel_body: ") and said in error
