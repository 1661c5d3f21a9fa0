"""A pass of a wheelset: the scene's wheel over the crossing, the other wheel on its stock rail, from a scene to a
LightPass.

The surfaces are searched for the wheel at several lateral positions (contact_table), the stock rail is the crossing's
own rail ahead of the leg, mirrored. Each rail stands on a foundation and track mass of its own, each side of the
wheelset under a sprung mass above its tread datum. Starts centred and parallel to the track, or where the force across
it is held (lateral_equilibrium): at a check rail that reaches it, on a diverging route, there at its angle of attack,
which the suspension keeps. Left out: lateral and yaw springs of the suspension (they act over metres), lateral motion
of the rails, the change of a contact's stiffness with the lateral position, plastic indentation in the stock rail, the
load that a curve moves to the outer wheel.
"""

from dataclasses import dataclass, replace

import numpy as np

from bem.exact.kalker_table import coefficients
from geometry.axes import GAUGE_FACE_Y
from geometry.path.path_search import BodySearch
from geometry.path.wheel_path import REACH, RESOLUTION, rolling_radius
from geometry.surfaces.bodies import BODIES
from rail_fem.contact.contact_law import ContactLaw
from rail_fem.contact.contact_table import BY_BODY, ContactTable, contact_table
from rail_fem.passes.lateral_equilibrium import lateral_equilibrium
from rail_fem.passes.vertical_dynamics import PassMotion, static_distance
from rail_fem.passes.vertical_pass import Contacts, LightPass, energy_columns, half_steps, scene_masses
from rail_fem.passes.wheelset_dynamics import (
    HEIGHT,
    LATERAL,
    ROLL,
    SPRUNG_LEFT,
    SPRUNG_RIGHT,
    TRACK_LEFT,
    TRACK_RIGHT,
    YAW,
    WheelsetContacts,
    WheelsetSystem,
    march,
    potential,
)
from rail_fem.scene.diverging import Diverging
from rail_fem.scene.scene import GRAVITY, Scene
from rail_fem.settings.light import RigidHertzSettings

LATERAL_SPACING = 0.5e-3  # between the lateral positions that are searched [m]
ROUNDS = 6  # of the levers at the start; each round gains three digits
FLANGE = np.radians(45.0)  # contact angle from which a wheel stands on its flange
LEAST_RATIO, MOST_RATIO = 0.05, 20.0  # of a patch's semi-axes for which Kalker's coefficients are tabulated


@dataclass(frozen=True)
class Surfaces:
    """Tables of the wheel at lateral positions shift (k,) [m] over the crossing, the same on plain line, and plain
    line's height there (k,) [m]."""

    shift: np.ndarray
    over: tuple[ContactTable, ...]
    plain: tuple[ContactTable, ...]
    level: np.ndarray

    @property
    def centred(self) -> ContactTable:
        """The table of the centred wheel; what all searches cost, kept from another scene or not, is in it."""
        cost = sum(table.search_time for table in self.over + self.plain)
        return replace(self.over[len(self.over) // 2], search_time=cost)

    def under(self, run: LightPass) -> ContactTable:
        """The centred table with the contacts of the wheel where it ran, each at the nearest position looked at."""
        table, order = self.centred, np.argsort(run.x)
        across = np.interp(table.x, run.x[order], run.columns["wheel_lateral"][order])
        k, i = np.abs(across - self.shift[:, None]).argmin(axis=0), np.arange(len(table.x))
        at = lambda name: np.moveaxis(np.stack([getattr(t, name) for t in self.over])[k, :, i], 0, 1)
        return replace(table, **{name: at(name) for name in BY_BODY})


def centred(scene: Scene) -> Scene:
    """The scene with its wheelset in the middle of the track."""
    if scene.diverging is None or scene.diverging.lateral is None:
        return scene
    return scene.replace(diverging={"lateral": None})


def surfaces_of(scene: Scene, settings: RigidHertzSettings) -> Surfaces:
    """Search the surfaces. Errors: as contact_table."""
    scene = centred(scene)
    count = int(np.ceil(settings.lateral_range / LATERAL_SPACING))
    shift = LATERAL_SPACING * np.arange(-count, count + 1)
    start, end = settings.window(scene)
    crossing = scene.crossing.surface
    over = tuple(contact_table(scene, start, end, settings.path_spacing, s) for s in shift)
    plain = tuple(
        contact_table(scene, crossing.plain_x, crossing.plain_x + 2 * settings.path_spacing, settings.path_spacing, s)
        for s in shift
    )
    x = np.array([crossing.plain_x])
    height = [
        BodySearch(
            crossing, scene.wheel.shape, "wing", x, scene.wheel.radius, scene.wheel_datum_y + s, RESOLUTION, REACH
        ).contacts(x)[0][0]
        for s in shift
    ]
    return Surfaces(shift, over, plain, np.array(height) - height[count])


def run_wheelset(
    surfaces: Surfaces, scene: Scene, settings: RigidHertzSettings, contacts: Contacts, step: float | None = None
) -> LightPass:
    """March over the window. contacts : law of wing and nose for the centred wheel. Errors: ValueError,
    FloatingPointError."""
    step, x = half_steps(scene, settings, step)
    found, system = wheelset_contacts(scene, contacts(x), surfaces, x), wheelset_system(scene, settings)
    position, velocity = start_of(scene, system, found, step)
    refuse_flange_on_nose(scene, system, surfaces, position[None])
    motion = march(system, found, position, velocity, step)
    refuse_flange_on_nose(scene, system, surfaces, motion.position)
    return as_light(scene, system, found, motion, x, step)


def refuse_flange_on_nose(scene: Scene, system: WheelsetSystem, surfaces: Surfaces, position: np.ndarray) -> None:
    """Raise ValueError where a wheelset of a diverging route that comes to positions (m, 8) strikes the nose with its
    flange."""
    if scene.diverging is None or not (found := flange_on_nose(surfaces)):
        return
    allowed, x = found
    across = float(system.across(position).max())
    if across < allowed:
        return
    if np.isfinite(system.stop[0]):
        flangeway, narrower = (scene.diverging.check_rail or 0.0) * 1e3, (across - allowed + LATERAL_SPACING) * 1e3
        held = f"the check rail lets the wheelset {across * 1e3:.2f} mm to the outside (flangeway {flangeway:g} mm)"
        remedy = f"a check_rail narrower by {narrower:.1f} mm"
    else:
        held = f"nothing but the crossing holds the wheelset, {across * 1e3:.2f} mm to the outside"
        remedy = "a check_rail"
    raise ValueError(
        f"{held}: from {allowed * 1e3:.2f} mm on its flange strikes the nose at x = {x * 1e3:.0f} mm: give {remedy},"
        " less lateral_force or angle_of_attack"
    )


def flange_on_nose(surfaces: Surfaces) -> tuple[float, float] | None:
    """Least lateral position [m] at which the rigid wheel stands on the nose with its flange, and x there [m]; None
    where it does so at none that was looked at."""
    for shift, table in zip(surfaces.shift, surfaces.over):
        on_flange = (table.height[1] > table.height[0]) & (np.abs(table.angle[1]) > FLANGE)
        if shift > 0 and on_flange.any():
            return float(shift), float(table.x[np.argmax(on_flange)])
    return None


def wheelset_system(scene: Scene, settings: RigidHertzSettings) -> WheelsetSystem:
    """Masses, suspension and foundation of both sides."""
    one, arm, vehicle = scene_masses(scene), datum_arm(scene), scene.vehicle
    axle, inertia = 2 * vehicle.wheel_unsprung_mass, 2 * vehicle.wheel_unsprung_mass * (settings.gyration or arm) ** 2
    mass = np.array([one.mass[0], one.mass[0], axle, inertia, axle, inertia, one.mass[2], one.mass[2]])
    stiffness, damping = np.zeros((8, 8)), np.zeros((8, 8))
    for sprung, track, side in ((SPRUNG_LEFT, TRACK_LEFT, 1.0), (SPRUNG_RIGHT, TRACK_RIGHT, -1.0)):
        stretch = np.zeros(8)
        stretch[[sprung, HEIGHT, ROLL]] = 1.0, -1.0, -side * arm
        stiffness += vehicle.primary_stiffness * np.outer(stretch, stretch)
        damping += vehicle.primary_damping * np.outer(stretch, stretch)
        stiffness[track, track] += scene.foundation.stiffness
        damping[track, track] += scene.foundation.damping
    load = np.zeros(8)
    load[[SPRUNG_LEFT, SPRUNG_RIGHT, HEIGHT]] = -GRAVITY * mass[[SPRUNG_LEFT, SPRUNG_RIGHT, HEIGHT]]
    load[LATERAL] = scene.lateral_force
    free_dofs, route = np.ones(8), scene.diverging
    if settings.degrees_of_freedom == "roll":
        free_dofs[[LATERAL, YAW]] = 0.0
    if route is not None and route.angle_of_attack is not None:
        free_dofs[YAW] = 0.0
    curvature = 0.0 if route is None else route.curvature
    return WheelsetSystem(
        mass,
        stiffness,
        damping,
        load,
        free_dofs,
        scene.wheel.radius,
        scene.speed,
        check_stop(scene, settings),
        curvature,
    )


def check_stop(scene: Scene, settings: RigidHertzSettings) -> tuple[float, float]:
    """How far the centred wheelset may move towards the wheel's field side before the check rail holds it [m], inf
    without one, and the check rail's stiffness [N/m]."""
    route = scene.diverging or Diverging.model_construct(check_rail=settings.check_rail)
    return route.clearance(scene.gauge, scene.back_to_back), route.check_stiffness


def datum_arm(scene: Scene) -> float:
    """From the middle of the axle to each tread datum [m], wherever across the track the wheelset stands."""
    return centred(scene).wheel_datum_y - track_middle(scene)


def track_middle(scene: Scene) -> float:
    """y of the track's centre line in the crossing's axes [m]."""
    return GAUGE_FACE_Y - scene.gauge / 2


def wheelset_contacts(scene: Scene, law: ContactLaw, surfaces: Surfaces, x: np.ndarray) -> WheelsetContacts:
    """Wing, nose and stock rail at wheel positions x (t,)."""
    scene = centred(scene)  # of which the surfaces are
    middle, centre = len(surfaces.shift) // 2, track_middle(scene)
    table = surfaces.over[middle]
    heights = np.stack([t.height_at(x) for t in surfaces.over], axis=-1) + surfaces.level
    slopes = np.stack([t.between(x, np.tan(t.angle)) for t in surfaces.over], axis=-1)
    radii = np.stack(
        [t.between(x, wheel_radii(scene, t, shift)) for t, shift in zip(surfaces.over, surfaces.shift)], axis=-1
    )
    plain = surfaces.plain
    contact_y = np.stack([known(table.point[b, :, 1], scene.wheel_datum_y) for b in range(len(BODIES))]) - centre
    laws = law.arrays[1]
    repeat = lambda row: np.broadcast_to(row, (1, len(x), *np.shape(row)))
    stock = plain[middle]
    creep = np.stack([creep_coefficients(scene, table, b) for b in range(len(BODIES))])
    creeps = np.stack([table.between(x, creep[..., k]) for k in range(2)], axis=-1)
    return WheelsetContacts(
        side=np.array([1.0, 1.0, -1.0]),
        contact_y=np.concatenate([table.between(x, contact_y), repeat(centre - stock.point[0, 0, 1])]),
        shift=surfaces.shift,
        height=np.concatenate([heights, repeat(surfaces.level)]),
        slope=np.concatenate([slopes, repeat(np.array([np.tan(t.angle[0, 0]) for t in plain]))]),
        radius=np.concatenate(
            [radii, repeat(np.array([wheel_radii(scene, t, s)[0, 0] for t, s in zip(plain, surfaces.shift)]))]
        ),
        law=np.concatenate([laws, repeat(np.array([stock.stiffness[0, 0], 1.5, 0.0, 0.0, 0.0, 0.0]))]),
        creep=np.concatenate([creeps, repeat(creep_coefficients(scene, stock, 0)[0])]),
        reference=scene.static_wheel_load,
        friction=scene.friction,
    )


def known(values: np.ndarray, otherwise: float) -> np.ndarray:
    """Values (n,) with those of the nearest known position where there is none."""
    there = np.flatnonzero(np.isfinite(values))
    return (
        np.full(len(values), otherwise) if not len(there) else np.interp(np.arange(len(values)), there, values[there])
    )


def wheel_radii(scene: Scene, table: ContactTable, shift: float) -> np.ndarray:
    """(2, n) radius of the wheel where it is in contact [m]."""
    datum = scene.wheel_datum_y + shift
    return np.stack(
        [rolling_radius(scene.wheel.shape, scene.wheel.radius, known(row[:, 1], datum) - datum) for row in table.point]
    )


def creep_coefficients(scene: Scene, table: ContactTable, body: int) -> np.ndarray:
    """(n, 2) G a b C11 and G a b C22 [N] of the Hertz ellipses under the static load; 0 out of reach."""
    rail, wheel = ((scene.materials.wing, scene.materials.nose)[body].steel(), scene.materials.wheel.steel())
    poisson = (rail.poisson + wheel.poisson) / 2
    shear = 2 / sum(2 * (1 + steel.poisson) / steel.youngs_modulus for steel in (rail, wheel))
    found = np.zeros((len(table.x), 2))
    for i in np.flatnonzero(table.stiffness[body] > 0):
        along, across = table.semi_axes(body, i, scene.static_wheel_load)
        kalker = coefficients(float(np.clip(along / across, LEAST_RATIO, MOST_RATIO)), poisson)
        found[i] = shear * along * across * np.array([kalker.c11, kalker.c22])
    return found


def start_of(
    scene: Scene, system: WheelsetSystem, contacts: WheelsetContacts, step: float
) -> tuple[np.ndarray, np.ndarray]:
    """Positions and velocities (8,) of steady running: centred at rail level, or where a diverging route has the
    wheelset, each rail under its part of the weight, the left wheel along the path's first slope.

    Errors: as lateral_equilibrium.
    """
    centred, arm = len(contacts.shift) // 2, datum_arm(scene)
    left = contacts.side > 0
    height = contacts.height[:, :2, centred]
    carrier = int(np.argmax(np.where(left, height[:, 0], -np.inf)))
    arms = np.array([contacts.contact_y[carrier, 0], -contacts.contact_y[~left, 0][0]])
    loads = 2 * scene.static_wheel_load * arms[::-1] / arms.sum()
    static = [
        static_distance(load, _held(height[rows, :1], contacts.law[rows, :1]))
        for load, rows in zip(loads, (left, ~left))
    ]
    track = -loads / scene.foundation.stiffness
    wheels, position, velocity = np.array(static) + track, np.zeros(8), np.zeros(8)
    # levers are taken from the middle of the axle, which lies to the side of the track's when the wheels are centred
    for _ in range(ROUNDS):
        both = np.array([[1.0, arms[0] - position[LATERAL]], [1.0, -arms[1] - position[LATERAL]]])
        position[[HEIGHT, ROLL]] = np.linalg.solve(both, wheels + system.rolling_radius * position[ROLL] ** 2 / 2)
        position[LATERAL] = -system.rolling_radius * position[ROLL]
    position[[TRACK_LEFT, TRACK_RIGHT]] = track
    position[[SPRUNG_LEFT, SPRUNG_RIGHT]] = (
        position[HEIGHT]
        + arm * np.array([1, -1]) * position[ROLL]
        - system.mass[0] * GRAVITY / scene.vehicle.primary_stiffness
    )
    rate = (height[left, 1].max() - height[left, 0].max()) / (step / 2)
    velocity[[HEIGHT, ROLL]] = np.linalg.solve(both, [rate, 0.0])
    velocity[[SPRUNG_LEFT, SPRUNG_RIGHT]] = velocity[HEIGHT] + arm * np.array([1, -1]) * velocity[ROLL]
    return diverging_start(scene, system, contacts, position), velocity


def _held(height: np.ndarray, law: np.ndarray) -> ContactLaw:
    """The law (bodies, 1, 6) of one moment, kept."""
    return ContactLaw(np.repeat(height, 3, axis=1), *np.moveaxis(np.repeat(law, 3, axis=1), -1, 0))


def diverging_start(
    scene: Scene, system: WheelsetSystem, contacts: WheelsetContacts, position: np.ndarray
) -> np.ndarray:
    """A centred wheelset's position (8,) as the scene's diverging route has it: at the lateral position and the angle
    of attack that it gives, in equilibrium where it gives none and something pushes, as a check rail does that reaches
    past the centred flange's back, on any route. Errors: as lateral_equilibrium."""
    route = scene.diverging
    held, heading = (None, 0.0) if route is None else (route.lateral, route.angle_of_attack or 0.0)
    nothing_pushes = system.load[LATERAL] == 0.0 and heading == 0.0 and system.stop[0] >= 0.0
    if not system.free_dofs[LATERAL] or (held is None and nothing_pushes):
        return position
    position = position.copy()
    position[YAW] = heading
    return lateral_equilibrium(system, contacts, position, held).position


def as_light(
    scene: Scene, system: WheelsetSystem, contacts: WheelsetContacts, motion: PassMotion, x: np.ndarray, step: float
) -> LightPass:
    """The left wheel's pass, with the wheelset's energies and its own columns."""
    arm, middle = datum_arm(scene), (motion.position[1:] + motion.position[:-1]) / 2
    of_left = lambda a: np.stack([a[:, SPRUNG_LEFT], a[:, HEIGHT] + arm * a[:, ROLL], a[:, TRACK_LEFT]], axis=1)
    clearance, stiffness = system.stop
    across = system.across(middle)
    columns = {"force_other": motion.force[2]}
    if np.isfinite(clearance):
        columns["force_check"] = stiffness * np.maximum(across - clearance, 0.0)
    columns |= {"wheel_lateral": across, "wheel_roll": middle[:, ROLL], "wheel_yaw": middle[:, YAW]}
    # with creep, which is not told contact by contact
    columns |= dict.fromkeys(("force_longitudinal", "force_lateral"), np.full(len(across), np.nan))
    left = motion._replace(
        position=of_left(motion.position), velocity=of_left(motion.velocity), force=motion.force[:2],
        dent=motion.dent[:2],
    )  # fmt: skip
    energies = lambda: energy_columns(system, motion, potential(system, contacts, motion.position, motion.dent))
    time = (np.arange(len(motion.path_work)) + 0.5) * step
    return LightPass(time, x[1::2], left.force, left, scene_masses(scene), step, energies, columns=columns)
