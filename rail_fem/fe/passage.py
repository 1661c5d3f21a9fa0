"""A scene as bodies that can move: meshes in place, materials, supports, contact (thesis section 7.2.1).

The wheel is the elastic bottom of a rim on a rigid axle. Its mesh travels with the axle and does not spin: a body of
revolution that stays elastic looks the same however far it has turned, so its fine patch stays at the bottom and the
material flows through it. What that leaves out is of order (V/c)^2 = 1e-4 (inertia of the flow). How fast it flows is
the spin of half a wheelset: its speed along x is given, its rotation free against its inertia. What the other wheel's
rail does is left out, but on a diverging route, where the whole wheelset moves across the track, held by its contact,
the check rail and the other wheel (rail_fem.fe.lateral_guide); it does not roll about the track.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from bem.exact.hertz import tangent_stiffness
from geometry.meshing.hexmesh import HexMesh
from geometry.path.wheel_path import WheelPath, rolling_radius
from geometry.profiles.profile import Profile
from rail_fem.fe.blocks import ElementSettings
from rail_fem.fe.contact.contact import Contact, ContactSettings
from rail_fem.fe.contact.surface import Surface
from rail_fem.fe.domain import Domain
from rail_fem.fe.dynamics import Dynamics
from rail_fem.fe.lateral_guide import LateralGuide
from rail_fem.fe.mass_scaling import MassScaling, choose_scaling
from rail_fem.fe.slabs import Slabs, cut_into_slabs, slab_parts
from rail_fem.fe.start_state import StartState, resting
from rail_fem.fe.structure import Structure
from rail_fem.fe.supports import Link, RigidGroup, Supports
from rail_fem.fe.window import Extent, TravellingWindow
from rail_fem.light.contact_table import contact_table
from rail_fem.light.lateral_start import LateralStart
from rail_fem.light.plastic_indentation import plastic_indentation
from rail_fem.light.rigid import anchored_path
from rail_fem.scene.scene import GRAVITY, Scene
from rail_fem.settings.explicit import FeSettings

# lumped mass on the wheel while it settles [kg]: little inertia, so it comes to rest within a millisecond
SETTLING_MASS = 10.0
MESH_MASS = 10.0  # about that of the wheel's mesh, which settles with it [kg]
MARGIN = 0.15e-3  # gap below which nodes are watched [m]
NEXT_POSITION = 2.5e-3  # where the contact at the start is looked at once more [m]
# an update of the small-displacement kernel, relative to the finite-strain one (rail_fem.studies.kernel_speed)
ELASTIC_COST = 0.75


@dataclass(frozen=True)
class Running:
    """How the wheel runs: sign (+1 facing, -1 trailing), start and end x [m], signed speed [m/s], spin about y at the
    start [rad/s]:
    that of pure rolling there, the rigid path around its travel, lateral position of the wheel's D0 [m], its
    profile."""

    sign: float
    start: float
    end: float
    speed: float
    spin: float
    path: WheelPath
    datum_y: float
    profile: Profile

    @property
    def duration(self) -> float:
        return (self.end - self.start) / self.speed

    def creep(self, spin: float, y: float) -> float:
        """Longitudinal creep of a contact at lateral position y [m]: (speed - spin * rolling radius) / speed, + where
        the wheel is braked."""
        return (
            1.0
            - spin * float(rolling_radius(self.profile, self.path.radius, np.array([y - self.datum_y]))[0]) / self.speed
        )

    @property
    def transfers(self) -> np.ndarray:
        """x where the rigid wheel is in contact with wing and nose at once on its travel (k,) [m]."""
        low, high = sorted((self.start, self.end))
        return self.path.transfers[(self.path.transfers >= low) & (self.path.transfers <= high)]

    def height(self, x) -> np.ndarray:
        return np.interp(x, self.path.x, self.path.height)

    def slope(self, x) -> np.ndarray:
        return np.interp(x, self.path.x, self.path.slope)


def running_of(scene: Scene, settings: FeSettings) -> Running:
    """The rigid path around the window and the direction of travel. Errors: CrossingError, ProfileError."""
    start, end = scene.in_order_of_travel(settings.start, settings.end)
    path = anchored_path(scene, min(start, end), max(start, end))
    shape, radius, datum = scene.wheel.shape, scene.wheel.radius, scene.wheel_datum_y
    first = path.contact_point[int(np.argmin(np.abs(path.x - start)))]
    rolling = float(rolling_radius(shape, radius, first[1:2] - datum)[0])
    return Running(scene.direction_sign, start, end, scene.velocity, scene.velocity / rolling, path, datum, shape)


@dataclass(frozen=True)
class Passage:
    """The moving scene. crossing, axle, sprung : rigid groups;  settling : the damper that is on before the pass (None
    without)."""

    dynamics: Dynamics
    running: Running
    body_of: np.ndarray  # (n_nodes,) 0 crossing, 1 wheel: body of each local node
    crossing: RigidGroup
    axle: RigidGroup
    sprung: RigidGroup | None
    settling: Link | None
    mesh: HexMesh | None  # root only
    rail_region: np.ndarray  # (n_rail,) 0 wing, 1 nose: region of each rail surface node
    start: StartState
    static_load: float  # NaN where the pass does not begin at rest
    datum_height: float  # of the wheel's D0 at the start, over a crossing at rest under the static load [m]
    static_deflection: float  # of the foundation at the start [m]
    scaling: MassScaling
    guide: LateralGuide | None = None  # what holds the wheelset across the track, where it may move


def build_passage(
    comm,
    scene: Scene,
    settings: FeSettings,
    running: Running,
    mesh: HexMesh | None,
    datum_height: float,
    start: StartState | None = None,
    aside: LateralStart | None = None,
) -> Passage:
    """Bodies, supports and contact. Collective.

    mesh : wing, nose and wheel in place (root only, see rail_fem.fe.initial_position);
    datum_height : of the wheel's D0 at the start [m]
    start : where settling ends; None: at rest under the static load
    aside : the wheelset across the track on a diverging route; None: its lateral position is given
    """
    start = start or resting(scene, running.speed * float(running.slope(running.start)))
    surface = comm.bcast(None if mesh is None else (mesh.surface, mesh.surface_region, mesh.clamp), root=0)
    quads, quad_region, clamp = surface
    slabs = comm.bcast(None if mesh is None or not settings.has_window else rail_slabs(mesh), root=0)
    domain = Domain(comm, **({} if mesh is None else shared_mesh(mesh, slabs, comm.size)))
    materials = scene.materials
    steels = [materials.wing.steel(), materials.nose.steel(), materials.wheel.steel()]
    extent = Extent(running.start, running.sign, *settings.window_lengths)
    scaling = choose_scaling(scene, settings, steels, mesh, comm, None if slabs is None else (slabs, extent))
    structure = Structure(
        domain,
        scaling.densities(steels),
        small=(2,),
        settings=ElementSettings(settings.element, settings.hourglass),
        slab=None if slabs is None else slabs.of_cells(domain.cell_centres()[:, 0], domain.region),
        least_step=scaling.least_step,
    )
    is_wheel = comm.bcast(None if mesh is None else _wheel_nodes(mesh)[mesh.clamp], root=0)
    wheel_factor = scaling.meshes["wheel"] / scaling.steel["wheel"]
    held = build_supports(scene, settings, running, start, clamp[~is_wheel], clamp[is_wheel], wheel_factor)
    crossing, axle, sprung, supports, settling = held
    guide = None if aside is None else guide_across(scene, aside, axle, supports)
    rail, wheel = Surface.from_quads(quads[quad_region != 2]), Surface.from_quads(quads[quad_region == 2])
    contact = Contact(
        structure,
        rail,
        wheel,
        contact_settings(scene, settings, steels[0]),
        speed=running.speed,
        spin=running.spin,
        axle=(running.start, running.datum_y, datum_height + scene.wheel.radius),
        inertia=scene.vehicle.wheel_spin_inertia if settings.spin == "free" else None,
        yaw=0.0 if aside is None else running.sign * aside.heading,
    )
    window = None
    if slabs is not None:
        centres = contact.reference[rail.quads].mean(axis=1)[:, 0]
        of_facets = quad_region[quad_region != 2]
        window = TravellingWindow(structure, slabs, extent, crossing, of_facets, slabs.of_cells(centres, of_facets))
    dynamics = Dynamics(structure, supports, contact, window=window)
    masses = structure.region_masses()
    crossing.mesh_mass, axle.mesh_mass = float(masses[0] + masses[1]), float(masses[2])
    if window is not None:
        crossing.moving_mass = scaling.meshes["crossing"]
    _set_lumped_masses(scene, settings, crossing, axle, settled=settling is None)
    axle.free = (False, guide is not None and settling is None, True)
    start_velocities(dynamics, running, axle, sprung)
    region = np.zeros(len(rail.nodes), np.int64)
    region[rail.quads[quad_region[quad_region != 2] == 1].ravel()] = 1
    static = scene.static_wheel_load / scene.foundation.stiffness
    deflection, lifted = (start.foundation, static - start.foundation) if settings.foundation else (0.0, 0.0)
    load = scene.static_wheel_load if start.resting else np.nan
    return Passage(
        dynamics,
        running,
        _body_of_nodes(domain),
        crossing,
        axle,
        sprung,
        settling,
        mesh,
        region,
        start,
        load,
        datum_height + lifted,
        deflection,
        scaling,
        guide,
    )


def _body_of_nodes(domain: Domain) -> np.ndarray:
    out = np.zeros(domain.n_nodes, np.int64)
    out[domain.cells[domain.region == 2].ravel()] = 1
    return out


def rail_slabs(mesh: HexMesh) -> Slabs:
    """Slabs of wing and nose, which a window lets enter and leave."""
    return cut_into_slabs(mesh.points, mesh.cells, mesh.region, bodies=(0, 1))


def shared_mesh(mesh: HexMesh, slabs: Slabs | None, ranks: int) -> dict[str, np.ndarray | None]:
    """What a Domain is made from, by its arguments. With slabs, blocks of each of them and of the wheel are dealt out
    to the ranks."""
    cost = np.where(mesh.region == 2, ELASTIC_COST, 1.0)
    part = None
    if slabs is not None:
        centres = mesh.points[mesh.cells].mean(axis=1)
        part = slab_parts(centres, mesh.region, slabs.of_cells(centres[:, 0], mesh.region), ranks)
    return dict(points=mesh.points, cells=mesh.cells, region=mesh.region, cost=cost, part=part)


def _wheel_nodes(mesh: HexMesh) -> np.ndarray:
    out = np.zeros(len(mesh.points), bool)
    out[mesh.cells[mesh.region == 2].ravel()] = True
    return out


def contact_settings(scene: Scene, settings: FeSettings, steel) -> ContactSettings:
    """Penalty stiffness per area: 10 times the modulus of one element layer, times the case's factor."""
    shear = steel.youngs_modulus / (2 * (1 + steel.poisson))
    wave = 2 * shear * (1 - steel.poisson) / (1 - 2 * steel.poisson)
    return ContactSettings(
        10 * settings.penalty * wave / settings.element_size, friction=scene.friction, margin=MARGIN, refresh=None
    )


class Supported(NamedTuple):
    """Rigid groups of crossing, axle and sprung mass (None without suspension), all supports, and the damper that is on
    while the wheel settles (None: it does not)."""

    crossing: RigidGroup
    axle: RigidGroup
    sprung: RigidGroup | None
    supports: Supports
    settling: Link | None


def build_supports(
    scene: Scene,
    settings: FeSettings,
    running: Running,
    start: StartState,
    base_nodes: np.ndarray,
    rim_nodes: np.ndarray,
    factor: float = 1.0,
) -> Supported:
    """Crossing on its foundation, axle with half a wheelset, sprung mass on the primary suspension; springs as the
    start wants them. factor : of mass scaling on the wheel's mesh.

    While it settles the axle is pressed down so that the contact comes to carry the start's force. Vertical only: the
    lateral position and the speed of the wheel are given (thesis assumption 1).
    """
    vertical = (False, False, True)
    crossing = RigidGroup("crossing", base_nodes, free=vertical)
    axle = RigidGroup("axle", rim_nodes, free=vertical, load=np.array([0.0, 0.0, -start.force]))
    groups, links, sprung = [crossing, axle], [], None
    if settings.suspension:
        mass = scene.vehicle.wheel_sprung_mass
        sprung = RigidGroup("sprung", np.empty(0, np.int64), mass, vertical, load=np.array([0.0, 0.0, -mass * GRAVITY]))
        groups.append(sprung)
        k = scene.vehicle.primary_stiffness
        links.append(
            Link("suspension", sprung, axle, k, scene.vehicle.primary_damping, natural_length=start.suspension)
        )
        axle.load[2] += k * start.suspension
    if settings.foundation:
        k = scene.foundation.stiffness
        links.append(Link("foundation", crossing, None, k, scene.foundation.damping, natural_length=start.foundation))
    else:
        crossing.free = (False, False, False)
    settling = None
    if settings.settle_time > 0:
        rate = running.speed * float(running.slope(running.start))
        settling = Link(
            "settling",
            axle,
            None,
            0.0,
            2 * np.sqrt(loaded_stiffness(scene, running) * (SETTLING_MASS + factor * MESH_MASS)),
            rate=rate,
        )
        links.append(settling)
    return Supported(crossing, axle, sprung, Supports(groups, links), settling)


def guide_across(scene: Scene, aside: LateralStart, axle: RigidGroup, supports: Supports) -> LateralGuide:
    """The force of the vehicle and of the other wheel's inclined contact on the axle, the other half of the wheelset's
    mass, check rail and creep of the other wheel."""
    axle.load[1] = aside.force + aside.other_push
    axle.lateral_mass = scene.vehicle.wheel_unsprung_mass
    guide = LateralGuide(axle, aside, scene.speed, scene.friction)
    supports.guides.append(guide)
    return guide


def loaded_stiffness(scene: Scene, running: Running) -> float:
    """Of the wheel on the body below it at the start, under the static load [N/m]: Hertz' contact in series with the
    plastic indentation under it.

    For the settling damper, which this makes critical: a narrow nose that yields is four times softer than the wing.
    """
    load, materials = scene.static_wheel_load, scene.materials
    table = contact_table(scene, running.start, running.start + running.sign * NEXT_POSITION, NEXT_POSITION)
    body, here = table.carrier(running.start)
    yield_load, plastic_compliance = (
        values[body, here]
        for values in plastic_indentation(table, (materials.wing.steel(), materials.nose.steel()), load)
    )
    elastic = tangent_stiffness(table.stiffness[body, here], load)
    return float(1 / (1 / elastic + (plastic_compliance if load > yield_load else 0.0)))


def _set_lumped_masses(
    scene: Scene, settings: FeSettings, crossing: RigidGroup, axle: RigidGroup, settled: bool
) -> None:
    """Masses that make each body, its mesh included, as heavy as the case says; while it settles the wheel carries
    SETTLING_MASS instead.

    Errors: ValueError where a mesh is heavier than its body: the case's mass is of a shorter piece of track, or of a
    lighter wheel.
    """
    axle.add_mass_up_to(scene.vehicle.wheel_unsprung_mass, "give a larger wheelset_unsprung_mass")
    if settings.track_mass and settings.foundation:
        crossing.add_mass_up_to(
            scene.foundation.track_mass,
            "give a larger track_mass, a shorter window, or track_mass = false in the run for the mesh alone",
        )
    if not settled:
        axle.added_mass = SETTLING_MASS
        crossing.free = (False, False, False)


def start_velocities(dynamics: Dynamics, running: Running, axle: RigidGroup, sprung: RigidGroup | None) -> None:
    """Wheel and vehicle start along the slope of the rigid path, so that steady running needs no force beyond the
    weight."""
    vertical, domain = running.speed * float(running.slope(running.start)), dynamics.domain
    wheel = np.unique(domain.cells[domain.region == 2])
    dynamics.structure.v.reshape(-1, 3)[wheel, 2] = vertical
    for group in (axle, sprung):
        if group is not None:
            group.velocity = np.array([0.0, 0.0, vertical])
    dynamics._give_group_velocities()


def end_settling(passage: Passage, scene: Scene, settings: FeSettings) -> None:
    """Damper off, true masses on, foundation free. Energies of the lumped masses change here; the balance starts
    afresh."""
    passage.dynamics.balance_mark = None
    if passage.settling is not None:
        passage.settling.damping = 0.0
    _set_lumped_masses(scene, settings, passage.crossing, passage.axle, settled=True)
    passage.crossing.free = (False, False, settings.foundation)
    passage.axle.free = (False, passage.guide is not None, True)
    if not passage.start.resting:
        take_up(passage, scene, settings)


def take_up(passage: Passage, scene: Scene, settings: FeSettings) -> None:
    """The motion of a pass that does not begin at rest: each body gets what its group's velocity changes by, all of it
    alike."""
    start, domain, v = passage.start, passage.dynamics.domain, passage.dynamics.structure.v.reshape(-1, 3)
    wheel, rail = (np.unique(domain.cells[(domain.region == 2) == moves]) for moves in (True, False))
    v[wheel, 2] += start.axle - passage.axle.velocity[2]
    passage.axle.velocity[2] = start.axle
    if settings.foundation:
        v[rail, 2] += start.crossing - passage.crossing.velocity[2]
        passage.crossing.velocity[2] = start.crossing
    if passage.sprung is not None:
        passage.sprung.velocity[2] = start.sprung
        passage.axle.load[2] = -scene.vehicle.wheel_unsprung_mass * GRAVITY
    else:
        passage.axle.load[2] = -scene.static_wheel_load
