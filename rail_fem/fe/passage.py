"""A scene as bodies that can move: meshes in place, materials, supports, contact (thesis section 7.2.1).

The wheel is the elastic bottom of a rim on a rigid axle, or on the elastic rest of the wheel
(rail_fem.fe.elastic_group). Its mesh travels with the axle and does not spin: a body of
revolution that stays elastic looks the same however far it has turned, so its fine patch stays at the bottom and the
material flows through it. What that leaves out is of order (V/c)^2 = 1e-4 (inertia of the flow). How fast it flows is
the spin of half a wheelset: its speed along x is given, its rotation free against its inertia. What the other wheel's
rail does is left out, but on a diverging route, where the whole wheelset moves across the track, held by its contact,
the check rail and the other wheel (rail_fem.fe.lateral_guide); it does not roll about the track.
"""

from __future__ import annotations

from copy import copy
from dataclasses import dataclass

import numpy as np

from geometry.meshing.hexmesh import HexMesh
from geometry.meshing.quality import cell_centres
from geometry.surfaces.bodies import CROSSING, PassBody
from rail_fem.fe.beam_track import BeamTrack
from rail_fem.fe.blocks import ElementSettings
from rail_fem.fe.casting_group import CastingGroup
from rail_fem.fe.condensed_body import Condensed, CondensedBlock
from rail_fem.fe.contact.contact import Contact
from rail_fem.fe.contact.messages import owner_count
from rail_fem.fe.contact.search import ContactSettings
from rail_fem.fe.contact.surface import ContactSurfaces, Surface
from rail_fem.fe.domain import Domain
from rail_fem.fe.dynamics import Dynamics
from rail_fem.fe.elastic_group import ElasticGroup
from rail_fem.fe.lateral_guide import LateralGuide
from rail_fem.fe.mass_scaling import MassScaling, choose_scaling
from rail_fem.fe.partition import balanced_parts
from rail_fem.fe.pass_supports import build_supports, set_lumped_masses
from rail_fem.fe.rolling_wheel import RollingWheel
from rail_fem.fe.running import Running
from rail_fem.fe.slabs import Slabs, cut_into_slabs, slab_parts
from rail_fem.fe.start_state import StartState, resting
from rail_fem.fe.structure import Structure
from rail_fem.fe.supports import Link, RigidGroup
from rail_fem.fe.window import Extent, TravellingWindow
from rail_fem.passes.lateral_start import LateralStart
from rail_fem.passes.track_beam import track_beam
from rail_fem.scene.scene import GRAVITY, Scene
from rail_fem.settings.explicit import FeSettings

MARGIN = 0.15e-3  # gap below which nodes are watched [m]
# an update of the wheel's kernels within a step, relative to the finite-strain one
ELASTIC_COST = 0.55
# of contact on one owner, in updates of the finite-strain kernel: of a pair, and of a step besides
PAIR_COST, CONTACT_COST = 3.5, 200.0
WATCHED = 440e-6  # area in which nodes are watched, the same for elements of 0.5 to 4 mm [m2]
LEAST_SHARE = 0.1  # of an even share of the elements, that an owner of contact has at least


@dataclass(frozen=True)
class Passage:
    """The moving scene. crossing, axle, sprung : rigid groups;  settling : the damper that is on before the pass (None
    without)."""

    dynamics: Dynamics
    running: Running
    on_wheel: np.ndarray  # (n_nodes,) bool: whether a local node is the wheel's, else the crossing's
    crossing: RigidGroup
    axle: RigidGroup
    sprung: RigidGroup | None
    settling: Link | None
    rail_nodes: np.ndarray  # (n_rail,) input nodes of the rail's surface, ascending
    rail_region: np.ndarray  # (n_rail,) number of the body of each
    start: StartState
    static_load: float  # NaN where the pass does not begin at rest
    datum_height: float  # of the wheel's D0 at the start, over a crossing at rest under the static load [m]
    static_deflection: float  # of foundation, or beam under the wheel, when the wheel is let go [m]
    scaling: MassScaling
    guide: LateralGuide | None = None  # what holds the wheelset across the track, where it may move
    track: BeamTrack | None = None  # what the crossing stands on, where that is a beam on bearers

    @property
    def relative(self) -> np.ndarray:
        """Positions of the local nodes (n_nodes, 3) less what the base of wing and nose has moved [m]; of the wheel's
        nodes without a meaning."""
        x = self.dynamics.structure.x.reshape(-1, 3)
        return x - self.crossing.displacements(np.arange(len(x)))


def build_passage(
    comm,
    scene: Scene,
    settings: FeSettings,
    running: Running,
    mesh: HexMesh | None,
    datum_height: float,
    start: StartState | None = None,
    aside: LateralStart | None = None,
    behind: Condensed | None = None,
    below: CondensedBlock | None = None,
) -> Passage:
    """Bodies, supports and contact. Collective.

    mesh : wing, nose and wheel in place (root only, see rail_fem.fe.initial_position);
    datum_height : of the wheel's D0 at the start [m]
    start : where settling ends; None: at rest under the static load
    aside : the wheelset across the track on a diverging route; None: its lateral position is given
    behind : what of the wheel lies behind its mesh, below : of the casting below its meshes; None: rigid
    """
    start = start or at_rest(scene, settings, running)
    surface = comm.bcast(None if mesh is None else (mesh.surface, mesh.surface_region, mesh.clamp), root=0)
    quads, quad_region, clamp = surface
    slabs = comm.bcast(None if mesh is None or not settings.has_window else rail_slabs(mesh), root=0)
    axis = running.start, datum_height + scene.wheel.radius
    extent = Extent(running.start, running.sign, *settings.window_lengths)
    domain = Domain(comm, **({} if mesh is None else shared_mesh(mesh, slabs, extent, settings, comm.size, axis)))
    steels = scene.materials.steels()
    weight = 0.0 if behind is None else behind.weight
    scaling = choose_scaling(scene, settings, steels, mesh, comm, None if slabs is None else (slabs, extent), weight)
    structure = Structure(
        domain,
        scaling.densities(steels),
        small=(PassBody.WHEEL,),
        settings=ElementSettings(settings.element, settings.hourglass),
        slab=None if slabs is None else slabs.of_cells(domain.cell_centres()[:, 0], domain.region),
        least_step=scaling.least_step,
        axis=axis,
    )
    is_wheel = comm.bcast(None if mesh is None else _on_wheel(len(mesh.points), mesh)[mesh.clamp], root=0)
    masses = structure.region_masses()
    crossing = RigidGroup(
        "crossing",
        clamp[~is_wheel],
        mesh_mass=float(sum(masses[body] for body in CROSSING)),
        moving_mass=None if slabs is None else scaling.meshes["crossing"],
    )
    if below is not None:
        of_steel = copy(structure)
        of_steel.steels, of_steel.least_step = steels, 0.0
        crossing = CastingGroup(
            crossing.name,
            crossing.input_nodes,
            mesh_mass=crossing.mesh_mass,
            moving_mass=crossing.moving_mass,
            block=below,
            steel=below.mass,
            own_mass=of_steel.lumped_mass(),
            own_total=float(sum(of_steel.region_masses()[body] for body in CROSSING)),
        )
    axle = RigidGroup("axle", clamp[is_wheel], mesh_mass=float(masses[PassBody.WHEEL]) + weight)
    if behind is not None and scene.wheel_body is not None:
        axle = ElasticGroup(
            axle.name,
            axle.input_nodes,
            mesh_mass=axle.mesh_mass,
            body=behind,
            origin=np.array([running.start, running.datum_y, datum_height]),
            damping_ratio=scene.wheel_body.damping_ratio,
        )
    wheel_factor = scaling.meshes["wheel"] / scaling.steel["wheel"]
    held = build_supports(scene, settings, running, start, aside, crossing, axle, wheel_factor)
    of_crossing = np.isin(quad_region, CROSSING)
    rail, wheel = Surface.from_quads(quads[of_crossing]), Surface.from_quads(quads[~of_crossing])
    of_facets = quad_region[of_crossing]
    rolling = RollingWheel(
        speed=running.speed,
        spin=running.spin,
        axle=(running.start, running.datum_y, datum_height + scene.wheel.radius),
        inertia=scene.vehicle.wheel_spin_inertia if settings.spin == "free" else None,
        yaw=0.0 if aside is None else running.sign * aside.heading,
    )
    law = contact_settings(scene, settings, steels[PassBody.WING])
    contact = Contact(ContactSurfaces(structure, rail, wheel), law, rolling)
    window = None
    if slabs is not None:
        window = TravellingWindow(structure, slabs, extent, crossing, contact, of_facets)
    track, released = None, running.start + running.speed * settings.settle_time
    if start.beam is not None and settings.stands_on_beam(scene):
        track = BeamTrack(start.beam, released, contact)
    dynamics = Dynamics(structure, held.supports, contact, window=window, more=() if track is None else (track,))
    start_velocities(dynamics, running, axle, held.sprung)
    region = np.zeros(len(rail.nodes), np.int64)
    region[rail.quads] = of_facets[:, None]
    static = scene.static_wheel_load / scene.foundation.stiffness
    if track is not None:
        static = -track.beam.under(scene.static_wheel_load, released, running.speed).height(released)
    deflection, lifted = (start.foundation, static - start.foundation) if settings.foundation else (0.0, 0.0)
    return Passage(
        dynamics=dynamics,
        running=running,
        on_wheel=_on_wheel(domain.n_nodes, domain),
        crossing=crossing,
        axle=axle,
        sprung=held.sprung,
        settling=held.settling,
        rail_nodes=rail.nodes,
        rail_region=region,
        start=start,
        static_load=scene.static_wheel_load if start.resting else np.nan,
        datum_height=datum_height + lifted,
        static_deflection=deflection,
        scaling=scaling,
        guide=held.guide,
        track=track,
    )


def at_rest(scene: Scene, settings: FeSettings, running: Running) -> StartState:
    """Under the static load along the path, on bearers where the scene has them, when the wheel is let go."""
    along = running.speed * float(running.slope(running.start))
    if scene.bearers is None or not settings.foundation:
        return resting(scene, along)
    ends = sorted((running.start, running.end))
    beam = track_beam(scene.bearers, *ends, settings.beam_element, settings.beam_reach)
    released = running.start + running.speed * settings.settle_time
    return resting(scene, along, beam.under(scene.static_wheel_load, released, running.speed), released)


def _on_wheel(n_nodes: int, of: HexMesh | Domain) -> np.ndarray:
    """Whether each node (n_nodes,) of a mesh, or of a rank's share of one, is the wheel's."""
    out = np.zeros(n_nodes, bool)
    out[of.cells[of.region == PassBody.WHEEL]] = True
    return out


def rail_slabs(mesh: HexMesh) -> Slabs:
    """Slabs of wing and nose, which a window lets enter and leave."""
    return cut_into_slabs(mesh.points, mesh.cells, mesh.region, bodies=CROSSING)


def shared_mesh(
    mesh: HexMesh, slabs: Slabs | None, extent: Extent, settings: FeSettings, ranks: int, axis: tuple[float, float]
) -> dict[str, np.ndarray]:
    """What a Domain is made from, by its arguments. With slabs, blocks of each of them and of the wheel, whole rings
    about its axis (x, z) [m], are dealt out to the ranks; fewer elements to those that compute contact."""
    wheel = mesh.region == PassBody.WHEEL
    cost = np.where(wheel, ELASTIC_COST, 1.0)
    centres = cell_centres(mesh.points, mesh.cells)
    if slabs is None:
        part = balanced_parts(centres, cost, ranks, rank_shares(float(cost.sum()), settings, ranks))
    else:
        slab = slabs.of_cells(centres[:, 0], mesh.region)
        low, high = slabs.near(*extent.ends(0.0))[mesh.region].T
        elements = float(cost[wheel | ((slab >= low) & (slab < high))].sum())
        radius = np.hypot(*(centres[wheel][:, [0, 2]] - axis).T)
        centres[wheel] = np.column_stack([np.zeros(len(radius)), centres[wheel, 1], -np.round(radius, 9)])
        part = slab_parts(centres, mesh.region, slab, rank_shares(elements, settings, ranks))
    return dict(points=mesh.points, cells=mesh.cells, region=mesh.region, part=part)


def contact_cost(settings: FeSettings, owners: int) -> float:
    """Of a step's contact on each of its owners, in updates of the finite-strain kernel: half of it is projections,
    which they share."""
    facet = settings.element_size * settings.along
    pairs = WATCHED / facet * (1.0 + settings.wheel_element_ratio**-2)
    return CONTACT_COST + PAIR_COST * pairs * 0.5 * (1.0 + 1.0 / owners)


def rank_shares(elements: float, settings: FeSettings, ranks: int) -> np.ndarray:
    """Share of the elements (ranks,) with which all ranks have as much to do: `elements` is what these cost in a step,
    in updates of the finite-strain kernel; the first ranks compute contact besides."""
    owners = owner_count(ranks)
    contact = contact_cost(settings, owners) if ranks > 1 else 0.0
    own = max((elements + owners * contact) / ranks - contact, LEAST_SHARE * elements / ranks)
    work = np.full(ranks, (elements - owners * own) / max(ranks - owners, 1))
    work[:owners] = own
    return work / elements


def contact_settings(scene: Scene, settings: FeSettings, steel) -> ContactSettings:
    """Penalty stiffness per area: 10 times the modulus of one element layer, times the case's factor."""
    shear = steel.youngs_modulus / (2 * (1 + steel.poisson))
    wave = 2 * shear * (1 - steel.poisson) / (1 - 2 * steel.poisson)
    return ContactSettings(
        10 * settings.penalty * wave / settings.element_size, friction=scene.friction, margin=MARGIN, refresh=None
    )


def start_velocities(dynamics: Dynamics, running: Running, axle: RigidGroup, sprung: RigidGroup | None) -> None:
    """Wheel and vehicle start along the slope of the rigid path, so that steady running needs no force beyond the
    weight."""
    vertical, domain = running.speed * float(running.slope(running.start)), dynamics.domain
    wheel = np.unique(domain.cells[domain.region == PassBody.WHEEL])
    dynamics.structure.v.reshape(-1, 3)[wheel, 2] = vertical
    for group in (axle, sprung):
        if group is not None:
            group.velocity[:] = 0.0, 0.0, vertical
    dynamics.impose()


def end_settling(passage: Passage, scene: Scene, settings: FeSettings) -> None:
    """Damper off, true masses on, foundation free. Energies of the lumped masses change here; the balance starts
    afresh."""
    passage.dynamics.balance_mark = None
    if passage.settling is not None:
        passage.settling.damping = 0.0
    set_lumped_masses(scene, settings, passage.crossing, passage.axle, settled=True)
    passage.crossing.free = (False, False, settings.foundation and passage.track is None)
    passage.axle.free = (False, passage.guide is not None, True)
    if passage.start.moves:
        take_up(passage, scene, settings)


def take_up(passage: Passage, scene: Scene, settings: FeSettings) -> None:
    """The motion of a pass that does not begin at rest: each body gets what its group's velocity changes by, all of it
    alike."""
    start, domain, v = passage.start, passage.dynamics.domain, passage.dynamics.structure.v.reshape(-1, 3)
    wheel, rail = (np.unique(domain.cells[(domain.region == PassBody.WHEEL) == moves]) for moves in (True, False))
    v[wheel, 2] += start.axle - passage.axle.velocity[2]
    passage.axle.velocity[2] = start.axle
    if settings.foundation:
        v[rail, 2] += start.crossing - passage.crossing.velocity[2]
        passage.crossing.velocity[2] = start.crossing
    if passage.track is not None:
        passage.track.let_go(passage.running.speed)
    if passage.sprung is not None:
        passage.sprung.velocity[2] = start.sprung
        passage.axle.load[2] = -scene.vehicle.wheel_unsprung_mass * GRAVITY
    else:
        passage.axle.load[2] = -scene.static_wheel_load
