"""A wheelset on two rails: the vertical answer where nothing couples, exact gravitational stiffness and hunting of
cones, order, energy, mirror."""

import numpy as np
import pytest
from scipy.optimize import root

from rail_fem.case.casefile import load_case
from rail_fem.contact.contact_table import contact_table
from rail_fem.models import rigid_hertz
from rail_fem.passes.plastic_indentation import contacts_of
from rail_fem.passes.vertical_pass import energy_columns, run_pass
from rail_fem.passes.wheelset_dynamics import (
    HEIGHT,
    LATERAL,
    ROLL,
    YAW,
    WheelsetContacts,
    WheelsetSystem,
    _creep,
    march,
    potential,
)
from rail_fem.passes.wheelset_pass import datum_arm, start_of, surfaces_of, wheelset_contacts, wheelset_system
from tests.order import assert_order

CASE = load_case("thesis/case_02")
SCENE = CASE.scene
SHORT = CASE.runs["rigid_hertz"].model_copy(
    update={"end": 0.30, "lateral_range": 1e-3, "degrees_of_freedom": "lateral_roll"}
)
# order and sign of q seen in a mirror
MIRROR = np.array([1, 0, 2, 3, 4, 5, 7, 6]), np.array([1, 1, 1, -1, -1, -1, 1, 1])


@pytest.fixture(scope="module")
def surfaces():
    return surfaces_of(SCENE, SHORT)


ELASTIC, ROLLED = {"plastic_indentation": False}, {"indentation_law": "rolled"}


def moved(surfaces, settings=SHORT, step=10e-6, change=lambda contacts: contacts, rolling_radius=None, law=ELASTIC):
    """System, contacts and motion over the true surfaces, elastic where nothing else is said."""
    start, end = settings.window(SCENE)
    count = int(round((end - start) / SCENE.speed / step))
    table = surfaces.over[len(surfaces.over) // 2]
    law = contacts_of(SCENE, settings.model_copy(update=law), table)
    x = np.linspace(start, end, 2 * count + 1)
    contacts, system = change(wheelset_contacts(SCENE, law(x), surfaces, x)), wheelset_system(SCENE, settings)
    system = system if rolling_radius is None else system._replace(rolling_radius=rolling_radius)
    step = (end - start) / SCENE.speed / count
    return system, contacts, march(system, contacts, *start_of(SCENE, system, contacts, step), step)


def lateral_creep_force(load, lateral_speed, friction=0.3):
    """Force [N] to the left on a wheelset that slips sideways, both wheels loaded by `load` [N], Kalker's coefficients
    for the static one."""
    side, two, none = np.array([1.0, -1.0]), np.ones((2, 1)), np.zeros((2, 1, 2))
    speed, into, stiff = np.zeros(8), np.empty(8), np.empty((2, 8, 8))
    speed[LATERAL] = lateral_speed
    contacts = WheelsetContacts(
        side=side,
        contact_y=0.75 * side[:, None],
        shift=np.array([-0.01, 0.01]),
        height=none,
        slope=none,
        radius=np.full((2, 1, 2), 0.42),
        law=np.zeros((2, 1, 6)),
        creep=7e6 * np.ones((2, 1, 2)),
        reference=86e3,
        friction=friction,
    )
    _creep(np.zeros(8), speed, 0, contacts, 0.42, 33.5, 0.0, load * two[:, 0], into, stiff)
    return into[LATERAL]


def test_creep_forces_grow_with_the_patch_area_and_end_at_friction():
    """Kalker's linear force G a b C creep: by Hertz a b goes with load^(2/3), so 8 times the load gives 4 times the
    force; in full sliding mu N of both."""
    few = 1e-6 * 33.5
    # saturation: creep force over 3 mu N, 1e-4
    assert lateral_creep_force(86e3, few) == pytest.approx(-2 * 7e6 * 1e-6, rel=1e-3)
    assert lateral_creep_force(8 * 86e3, few) / lateral_creep_force(86e3, few) == pytest.approx(4.0, rel=1e-3)
    assert lateral_creep_force(86e3, 33.5) == pytest.approx(-2 * 0.3 * 86e3, rel=1e-9)


@pytest.mark.parametrize("law", [ELASTIC, ROLLED], ids=["elastic", "rolled"])
def test_without_cant_of_the_surfaces_each_side_is_the_vertical_model(surfaces, law):
    """Levers and gyration at the tread datum, heights that no lateral motion changes, an axle at rail level, no creep:
    the left wheel is alone, to where Newton ends."""
    arm = datum_arm(SCENE)

    def uncoupled(c):
        middle = c.height[:, :, len(c.shift) // 2, None]
        return c._replace(
            contact_y=np.sign(c.contact_y) * arm,
            height=np.broadcast_to(middle, c.height.shape),
            slope=0 * c.slope,
            friction=0.0,
        )

    _, _, motion = moved(
        surfaces, SHORT.model_copy(update={"degrees_of_freedom": "roll"}), change=uncoupled, rolling_radius=0.0, law=law
    )
    settings = SHORT.model_copy(update=law | {"time_step": (0.30 - 0.095) / SCENE.speed / len(motion.path_work)})
    table = contact_table(SCENE, *settings.window(SCENE), settings.path_spacing)
    alone = run_pass(SCENE, settings, contacts_of(SCENE, settings, table))
    assert alone.force.shape == motion.force[:2].shape
    np.testing.assert_allclose(motion.force[:2], alone.force, rtol=0, atol=1e-6 * SCENE.static_wheel_load)
    # and the right wheel rolls on plain rail
    np.testing.assert_allclose(motion.force[2], SCENE.static_wheel_load, rtol=1e-6)


def test_a_mirror_changes_nothing(surfaces):
    """The crossing under the right wheel: roll, lateral and yaw change sign, forces stay, to round-off."""
    system, contacts, motion = moved(surfaces)
    order, sign = MIRROR
    seen = contacts._replace(side=-contacts.side, contact_y=-contacts.contact_y)
    start = motion.position[0][order] * sign, motion.velocity[0][order] * sign
    mirrored = march(system, seen, *start, motion_step(motion))
    np.testing.assert_allclose(mirrored.position[:, order] * sign, motion.position, rtol=0, atol=1e-12)
    np.testing.assert_allclose(mirrored.force, motion.force, rtol=0, atol=1e-6 * SCENE.static_wheel_load)


def motion_step(motion) -> float:
    return (0.30 - 0.095) / SCENE.speed / len(motion.path_work)


@pytest.mark.parametrize("law", [ELASTIC, ROLLED], ids=["elastic", "rolled"])
def test_second_order_in_the_step_and_energy_is_kept(surfaces, law):
    """Contacts over the true surfaces, with creep: the balance holds to the scheme's second order."""
    runs, steps = [], np.array([40e-6, 20e-6, 10e-6, 1.25e-6])
    for step in steps:
        system, contacts, motion = moved(surfaces, step=step, law=law)
        runs.append((motion, energy_columns(system, motion, potential(system, contacts, motion.position, motion.dent))))
    at = np.linspace(0.1, 0.9, 30)
    curve = lambda m, k: np.interp(at, np.linspace(0, 1, len(m.position)), m.position[:, k])
    for k in (HEIGHT, ROLL, LATERAL, YAW):
        exact = curve(runs[-1][0], k)
        assert_order(steps[:-1], [np.abs(curve(m, k) - exact).max() for m, _ in runs[:-1]], expected=2, slack=0.4)
    lost = [np.abs(e["energy_balance"]).max() for _, e in runs]
    assert lost[1] < lost[0] / 3 and lost[2] < lost[1] / 3 and lost[2] < 1e-3 * np.ptp(runs[2][1]["energy_external"])


CONE, ARM, RADIUS, LOAD = 0.05, 0.75, 0.425, 172e3
HELD = np.array([1.0, 1, 1, 1, 0, 0, 1, 1])  # lateral and yaw


def cones(steps, speed=30.0, friction=0.0, stiffness=1e14, creep=1e7, mass=1000.0, slope=CONE):
    """Two cones of 1:20 on two rails that touch them at fixed positions; no suspension, tracks that do not give."""
    shift, times = np.linspace(-0.02, 0.02, 5), 2 * steps + 1
    line = np.broadcast_to(slope * shift, (2, times, 5))
    side = np.array([1.0, -1.0])
    full = lambda row: np.broadcast_to(row, (2, times, len(row)))
    contacts = WheelsetContacts(
        side,
        np.outer(side, np.full(times, ARM)),
        shift,
        line,
        np.full_like(line, slope),
        np.broadcast_to(RADIUS + slope * shift, line.shape),
        full([stiffness, 1.5, 0.0, 0.0, 0.0, 0.0]),
        full([creep, creep]),
        LOAD / 2,
        friction,
    )
    masses = np.array([1.0, 1.0, mass, mass * 0.6**2, mass, mass * 0.6**2, 1.0, 1.0])
    load = np.zeros(8)
    load[HEIGHT] = -LOAD
    stiff = np.diag([1e6, 1e6, 0, 0, 0, 0, 1e16, 1e16])
    return WheelsetSystem(masses, stiff, np.zeros((8, 8)), load, np.ones(8), RADIUS, speed, (np.inf, 0.0)), contacts


def exact_height(y):
    """Height of the middle of two cones' axle, shifted by y and rolled as it must, on points at +-ARM: plane geometry
    of any size."""

    def misses(unknown):
        z, roll = unknown
        c, s = np.cos(roll), np.sin(roll)
        out = []
        for side in (1, -1):
            across, up = (side * ARM - y) * c - z * s, -(side * ARM - y) * s - z * c
            out.append(up + RADIUS - CONE * (side * across - ARM))
        return out

    return root(misses, [RADIUS, CONE * y / ARM], tol=1e-14).x  # to round-off, which fsolve would warn of


def test_gravitational_stiffness_of_cones_is_that_of_plane_geometry():
    """Second difference over y of the energy at rest: with the exact height of two cones on two points, and in the
    model.

    The model leaves out slope^2 against 1, and contacts of 1e12 N/m^1.5 give by 20 um against a radius of 425 mm.
    """
    positions, stiffness = np.array([-1e-3, 0.0, 1e-3]), 1e12
    exact = LOAD * np.diff([exact_height(y)[0] for y in positions], 2)[0] / 1e-6
    rate = 2 * 1.5 * stiffness ** (2 / 3) * (LOAD / 2) ** (1 / 3)
    energies = []
    for y in positions:
        system, contacts = cones(2000, stiffness=stiffness)
        critical = np.diag(
            [0, 0, *(2 * np.sqrt(rate * np.array([1, ARM**2]) * system.mass[[HEIGHT, ROLL]])), 0, 0, 1e10, 1e10]
        )
        start = np.zeros(8)
        start[LATERAL], start[ROLL], start[HEIGHT] = y, exact_height(y)[1], -((LOAD / 2 / stiffness) ** (2 / 3))
        end = march(
            system._replace(damping=critical, free_dofs=HELD),
            contacts,
            start,
            np.zeros(8),
            0.2 * np.sqrt(system.mass[HEIGHT] / rate),
        ).position
        assert np.abs(end[-1] - end[-2]).max() < 1e-14
        energies.append(
            LOAD * end[-1, HEIGHT] + potential(system, contacts, end, np.zeros((len(contacts.side), len(end))))[-1]
        )
    assert np.diff(energies, 2)[0] / 1e-6 == pytest.approx(exact, rel=CONE**2)


def test_slow_cones_hunt_with_klingel_s_wavelength_and_the_error_falls_with_speed_squared():
    """2 pi sqrt(arm radius / cone) for pure rolling; creep with inertia adds a part that grows with V^2."""
    klingel = 2 * np.pi * np.sqrt(ARM * RADIUS / CONE)
    errors = []
    for speed in (8.0, 4.0, 2.0):
        distance, steps = 1.2 * klingel, 3000
        system, contacts = cones(steps, speed=speed, friction=10.0, stiffness=1e11)
        start = np.zeros(8)
        start[LATERAL], start[HEIGHT] = 1e-3, -((LOAD / 2 / 1e11) ** (2 / 3))
        start[ROLL] = CONE * 1e-3 / ARM
        motion = march(
            system._replace(damping=np.diag([0, 0, 1e5, 1e5, 0, 0, 0, 0.0])),
            contacts,
            start,
            np.zeros(8),
            distance / speed / steps,
        )
        x = np.linspace(0, distance, steps + 1)
        across = motion.position[:, YAW]
        crossing = np.flatnonzero(np.diff(np.sign(across[10:])))[:2] + 10
        zeros = [x[i] - across[i] * (x[i + 1] - x[i]) / (across[i + 1] - across[i]) for i in crossing]
        errors.append(abs(2 * (zeros[1] - zeros[0]) / klingel - 1))
    assert errors[-1] < 0.01, errors
    assert errors[0] > errors[1] > errors[2], errors


def test_creep_is_bounded_by_friction_and_the_check_rail_stops_the_wheelset():
    """Sliding to the left as fast as it runs, friction brakes it with mu W; a check rail at 0.1 mm turns it back; the
    energy's balance closes."""
    system, contacts = cones(4000, friction=0.3, stiffness=1e11, slope=1e-9)
    start, velocity = np.zeros(8), np.zeros(8)
    start[HEIGHT], velocity[LATERAL] = -((LOAD / 2 / 1e11) ** (2 / 3)), 0.3
    slow = system._replace(speed=0.3)
    motion = march(slow, contacts, start, velocity, 1e-6)
    decay = -(motion.velocity[1000, LATERAL] - motion.velocity[0, LATERAL]) / 1e-3
    assert decay == pytest.approx(0.3 * LOAD / system.mass[LATERAL], rel=0.02)
    checked = slow._replace(stop=(0.1e-3, 1e10))
    stopped = march(checked, contacts, start, velocity, 1e-6)
    assert (
        motion.position[:, LATERAL].max() > 0.4e-3 > 0.25e-3 > stopped.position[:, LATERAL].max()
        and stopped.velocity[:, LATERAL].min() < -0.05
    )
    energy = energy_columns(checked, stopped, potential(checked, contacts, stopped.position, stopped.dent))
    assert np.abs(energy["energy_balance"]).max() < 1e-3 * np.ptp(energy["energy_kinetic"])


def test_a_wheelset_that_leaves_the_places_looked_at_is_refused():
    system, contacts = cones(200, stiffness=1e11)
    start, velocity = np.zeros(8), np.zeros(8)
    start[HEIGHT], velocity[LATERAL] = -((LOAD / 2 / 1e11) ** (2 / 3)), 30.0
    with pytest.raises(ValueError, match="beyond the 20.0 mm that were looked at: widen lateral_range"):
        march(system, contacts, start, velocity, 1e-5)


def test_freedom_of_the_wheelset_changes_the_reference_pass_little():
    """The thesis holds the wheel at its lateral position; let go, it moves less than 0.1 mm within the 13 ms of the
    pass, and the nose's force by less than 2 %."""
    settings = CASE.runs["rigid_hertz"]
    held, free_dofs = (
        rigid_hertz.solve(SCENE, settings.model_copy(update={"degrees_of_freedom": f, "lateral_range": 1e-3}))
        for f in ("vertical", "lateral_roll")
    )
    assert free_dofs.peaks["largest_force_nose"].value == pytest.approx(
        held.peaks["largest_force_nose"].value, rel=0.02
    )
    assert 0.01e-3 < np.abs(free_dofs.history["wheel_lateral"]).max() < 0.1e-3
    assert np.isnan(held.history["wheel_lateral"]).all() and free_dofs.history["force_other"].mean() == pytest.approx(
        SCENE.static_wheel_load, rel=0.1
    )
