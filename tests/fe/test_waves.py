"""Waves: bar impact, elastic and plastic fronts, speeds of body and surface waves, all against closed forms."""

import numpy as np
import pytest
from scipy.optimize import brentq

from geometry.meshing.blocks import mesh_box
from rail_fem.fe.dynamics import Dynamics
from rail_fem.scene.steel import Steel
from tests.fe.bodies import NO_VISCOSITY, STEEL, at, lame, plastic, structure_of
from tests.order import assert_order


def crossing(time, value, level):
    """First time at which |value| reaches `level`, linear between samples."""
    i = int(np.argmax(np.abs(value) >= level))
    low, high = abs(value[i - 1]), abs(value[i])
    return time[i - 1] + (time[i] - time[i - 1]) * (level - low) / (high - low)


def strike(mesh, steel, speed, held_sides, end, stations):
    """The mesh flies with `speed` in -x into a frictionless wall at x = 0; axial stress at the elements nearest to
    `stations`.

    Returns times (n,) and stresses (n, k) [Pa].
    """
    structure = structure_of(mesh, steel)
    fixed = np.zeros((structure.domain.n_nodes, 3), bool)
    fixed[at(structure, 0, 0.0), 0] = True
    fixed[:, 1:] = held_sides
    structure.v.reshape(-1, 3)[:, 0] = -speed
    dynamics = Dynamics(structure, fixed=fixed)
    dt, time, stress = dynamics.stable_step(), [], []
    centre = structure.x.reshape(-1, 3)[structure.domain.cells].mean(axis=1)[:, 0]
    cells = [int(np.argmin(abs(centre - x))) for x in stations]
    while dynamics.time < end:
        dynamics.step(dt)
        time.append(dynamics.time)
        stress.append(structure.finite.stress()[cells, 0])
    return np.array(time), np.array(stress), centre[cells]


def test_elastic_bar_impact_gives_the_stress_arrival_and_release_of_one_dimensional_waves():
    """sigma = rho c0 v = 406 MPa; the front passes x at x / c0, the release comes back to the wall at 2 L / c0."""
    steel, length, speed = Steel(210e9, 0.0, 7850.0), 0.1, 10.0
    c0 = np.sqrt(steel.youngs_modulus / steel.density)
    period = 2 * length / c0
    time, stress, centre = strike(
        mesh_box((length, 5e-4, 5e-4), (200, 1, 1)), steel, speed, False, 1.3 * period, [0.0, length / 2]
    )
    exact = steel.density * c0 * speed
    assert exact == pytest.approx(406.0e6, rel=1e-4)
    wall, middle = stress.T
    plateau = wall[(time > 0.2 * period) & (time < 0.8 * period)].mean()
    assert -plateau == pytest.approx(exact, rel=0.01)
    assert crossing(time, middle, exact / 2) == pytest.approx(centre[1] / c0, rel=0.01)
    later = time > period / 2
    released = crossing(time[later], exact - np.abs(wall[later]), exact / 2)
    assert released == pytest.approx((2 * length - centre[0]) / c0, rel=0.01)


def test_an_elastic_plastic_plane_wave_has_two_fronts():
    """Uniaxial strain, bilinear hardening: precursor at the Hugoniot elastic limit Y (1 - nu) / (1 - 2 nu) with c_d,
    then a front with sqrt(T / rho), T = K + 4 G H / (3 (3 G + H)), up to the piston's velocity."""
    yield_stress, hardening, speed, length = 400e6, 20e9, 25.0, 0.1
    steel = plastic(STEEL, yield_stress, hardening)
    shear, bulk, density = steel.elastic.shear, steel.elastic.bulk, steel.density
    elastic = steel.wave_speed
    slow = np.sqrt((bulk + 4 * shear * hardening / (3 * (3 * shear + hardening))) / density)
    limit = yield_stress * (1 - steel.poisson) / (1 - 2 * steel.poisson)
    top = limit + density * slow * (speed - limit / (density * elastic))
    time, stress, centre = strike(
        mesh_box((length, 5e-4, 5e-4), (200, 1, 1)),
        steel,
        speed,
        True,
        0.95 * length / elastic,
        [0.3 * length, 0.7 * length],
    )
    near, far = stress.T

    def front_speed(level):
        return (centre[1] - centre[0]) / (crossing(time, far, level) - crossing(time, near, level))

    assert front_speed(limit / 2) == pytest.approx(elastic, rel=0.02)
    assert front_speed((limit + top) / 2) == pytest.approx(slow, rel=0.02)
    between = (time > 1.05 * centre[1] / elastic) & (time < 0.95 * centre[1] / slow)
    assert np.abs(far[between]).mean() == pytest.approx(limit, rel=0.02)
    behind = time > 1.2 * centre[0] / slow
    assert np.abs(near[behind]).mean() == pytest.approx(top, rel=0.02)


def standing_frequency(structure, fixed, shape, expected, periods=3):
    """Angular frequency [rad/s] of the standing wave `shape` (n, 3), from the zero crossings of its amplitude."""
    structure.v[:] = 1e-3 * shape.ravel()
    dynamics = Dynamics(structure, fixed=fixed)
    dt = dynamics.stable_step(0.5)
    weight = (structure.mass[:, None] * shape).ravel()
    time, amplitude = [], []
    while dynamics.time < (periods + 0.25) * 2 * np.pi / expected:
        dynamics.step(dt)
        time.append(dynamics.time)
        amplitude.append(weight @ (structure.x - structure.domain.reference))
    time, amplitude = np.array(time), np.array(amplitude)
    i = np.flatnonzero(amplitude[:-1] * amplitude[1:] < 0)
    zeros = time[i] - amplitude[i] * (time[i + 1] - time[i]) / (amplitude[i + 1] - amplitude[i])
    return np.pi * (len(zeros) - 1) / (zeros[-1] - zeros[0])


def walls(structure):
    """Frictionless walls on all six sides of the unit box: (n, 3) bool."""
    return np.stack([at(structure, axis, 0.0) | at(structure, axis, 1.0) for axis in range(3)], axis=1)


def body_wave_speeds(cells):
    """Dilatational and shear wave speed [m/s] from standing waves of half a wavelength along each edge of a cube."""
    out = []
    for kind in ("dilatation", "shear"):
        structure = structure_of(mesh_box((1.0, 1.0, 1.0), (cells, cells, cells)), settings=NO_VISCOSITY)
        s, c = np.sin(np.pi * structure.x.reshape(-1, 3)), np.cos(np.pi * structure.x.reshape(-1, 3))
        ux, uy, uz = s[:, 0] * c[:, 1] * c[:, 2], c[:, 0] * s[:, 1] * c[:, 2], c[:, 0] * c[:, 1] * s[:, 2]
        shape = np.stack([ux, uy, uz] if kind == "dilatation" else [ux, -uy, 0 * uz], axis=1)
        number = np.pi * np.sqrt(3.0)
        expected = number * (STEEL.wave_speed if kind == "dilatation" else np.sqrt(STEEL.elastic.shear / STEEL.density))
        out.append(standing_frequency(structure, walls(structure), shape, expected) / number)
    return np.array(out)


def test_body_waves_in_three_dimensions_run_at_their_speeds_and_converge_with_second_order():
    """grad and curl of cos cos cos between frictionless walls: exact standing waves of wave number sqrt(3) pi."""
    exact = np.array([6001.0, 3208.0])
    assert [STEEL.wave_speed, np.sqrt(STEEL.elastic.shear / STEEL.density)] == pytest.approx(exact, rel=2e-4)
    exact = np.array([STEEL.wave_speed, np.sqrt(STEEL.elastic.shear / STEEL.density)])
    counts = np.array([10, 20])
    errors = np.array([body_wave_speeds(n) / exact - 1 for n in counts])
    assert np.abs(errors[-1]).max() < 0.02
    for kind in (0, 1):
        assert_order(1 / counts, errors[:, kind], expected=2)


def rayleigh(steel):
    """Rayleigh wave speed [m/s] and the two decay rates over the wave number."""
    fast, slow = steel.wave_speed, np.sqrt(steel.elastic.shear / steel.density)

    def secular(c):
        return (2 - (c / slow) ** 2) ** 2 - 4 * np.sqrt(1 - (c / fast) ** 2) * np.sqrt(1 - (c / slow) ** 2)

    speed = brentq(secular, 0.7 * slow, 0.999 * slow)
    return speed, np.sqrt(1 - (speed / fast) ** 2), np.sqrt(1 - (speed / slow) ** 2)


def rayleigh_error(cells):
    """Relative error of the surface wave's speed with `cells` over half a wavelength: a standing wave, plane strain."""
    speed, q, s = rayleigh(STEEL)
    depth = 6  # half wavelengths: the slower part has fallen to exp(-7)
    mesh = mesh_box((1.0, 1.0 / cells, float(depth)), (cells, 1, depth * cells))
    structure = structure_of(mesh, settings=NO_VISCOSITY)
    x, y, z = structure.x.reshape(-1, 3).T
    z = z - depth
    along = np.exp(np.pi * q * z) - 2 * q * s / (1 + s**2) * np.exp(np.pi * s * z)
    down = q * (np.exp(np.pi * q * z) - 2 / (1 + s**2) * np.exp(np.pi * s * z))
    shape = np.stack([np.sin(np.pi * x) * along, 0 * y, -np.cos(np.pi * x) * down], axis=1)
    fixed = np.zeros(shape.shape, bool)
    fixed[at(structure, 0, 0.0) | at(structure, 0, 1.0), 0] = True
    fixed[:, 1] = True
    return standing_frequency(structure, fixed, shape, np.pi * speed) / np.pi / speed - 1


def test_a_surface_wave_runs_at_rayleighs_speed():
    assert rayleigh(STEEL)[0] == pytest.approx(2975.0, rel=1e-3)
    assert lame(STEEL)[1] == pytest.approx(STEEL.elastic.shear)
    counts = np.array([8, 16])
    errors = [rayleigh_error(n) for n in counts]
    assert abs(errors[-1]) < 0.02
    assert_order(1 / counts, errors, expected=2)
