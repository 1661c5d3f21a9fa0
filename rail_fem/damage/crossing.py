"""One wheel over a crossing: patches of wing and nose every few millimetres, their tractions, wear of all laws and
fatigue.

Forces come from a pass of rigid_hertz (any result with forces on wing and nose), positions and radii of the contacts
from the same table of the surfaces. The wheel turns at the spin at which it rolls on its tread datum; the other wheel,
on its stock rail, holds it there. Each patch rolls steadily, though forces change along a patch's length at the
transfer.
A patch whose mean pressure would pass the hardness is as large as the hardness lets it be, at the same shape: what is
plastic there cannot press more, and elastic ellipses on a nose's unworn corner would.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from bem.halfspace.rolled_ellipses import RolledEllipses, rolled_ellipses
from bem.halfspace.slip_dependent_friction import SlipDependentFriction
from geometry.surfaces.bodies import BODIES
from rail_fem.contact.contact_table import ContactTable, contact_table, patch_sizes
from rail_fem.damage.deposit import Footprints, ReachedLines, deposit, deposit_reached
from rail_fem.damage.rolling import no_more_slender
from rail_fem.damage.strips import patch_centres, plane_creepages, strip_creepages
from rail_fem.damage.wear import WearLaw, friction_work
from rail_fem.result.result import PassResult
from rail_fem.scene.scene import Scene
from rail_fem.settings.damage import DamageSettings

SPACING = 2e-3  # between the patches [m]
LATERAL = 0.5e-3  # between the rows of the field d(x, y) [m]
MARGIN = 20e-3  # of the field beyond the contacts [m]
LEAST_FORCE = 100.0  # of a contact that is looked at [N]


@dataclass(frozen=True, eq=False)
class PassContacts:
    """The k patches of a pass in the order in which the wheel meets them. body : (k,) 0 wing, 1 nose;  x (k,) of the
    wheel, position (k, 3) of the centre of pressure [m];  patches : solved;  angle (k,) [rad];  speed [m/s]
    enlarged (k,) : factor on a patch's axes, above 1 where the elastic one would press more than the hardness
    radii (k, 2) relative, along and across [m];  modulus : E* of wing and nose [Pa]"""

    body: np.ndarray
    x: np.ndarray
    position: np.ndarray
    patches: RolledEllipses
    angle: np.ndarray
    speed: float
    enlarged: np.ndarray
    radii: np.ndarray
    modulus: tuple[float, float]

    def __len__(self) -> int:
        return len(self.x)

    @property
    def tgamma(self) -> np.ndarray:
        """(k,) tractive forces times creepages [N]."""
        force, creepage = self.patches.tangential_force, self.patches.creepage
        return -(force[:, 0] * creepage[:, 0] + force[:, 1] * creepage[:, 1]) + 0.0  # no -0


@dataclass(frozen=True, eq=False)
class WearField:
    """Depth worn off wing and nose by one pass on a plan. x (m,), y (n,) [m];  depth : law -> (2, m, n) [m];  work
    (2, m, n) : friction work per area [J/m2];  removed : law -> what the patches' strips took, on the plan or beside it
    [m3]"""

    x: np.ndarray
    y: np.ndarray
    depth: Mapping[str, np.ndarray]
    work: np.ndarray
    removed: Mapping[str, float]

    def volume(self, law: str) -> float:
        """Worn off the plan by one pass [m3]."""
        return float(self.depth[law].sum() * (self.x[1] - self.x[0]) * (self.y[1] - self.y[0]))


@dataclass(frozen=True)
class PatchOptions:
    """How the patches of a pass are solved. friction : None: the scene's;  initial_slope : third body;  cells : each
    way;  hardness : of the rail [Pa], which bounds the mean pressure;  conformal : strips along the curved face with
    normals and creepages of their own (rail_fem.damage.strips), in place of one tangent plane"""

    friction: float | SlipDependentFriction | None = None
    initial_slope: float = 1.0
    cells: int = 50
    hardness: float = np.inf
    conformal: bool = False


def friction_of(scene: Scene, settings: DamageSettings) -> float | SlipDependentFriction:
    """Friction at the scene's speed."""
    if settings.kinetic_friction is None:
        return scene.friction
    return SlipDependentFriction.at_speed(scene.friction, settings.kinetic_friction, settings.decay_speed, scene.speed)


def patch_options(scene: Scene, settings: DamageSettings) -> PatchOptions:
    """How the patches of its passes over a crossing are solved."""
    friction = friction_of(scene, settings)
    conformal = settings.tangential == "conformal"
    return PatchOptions(friction, settings.initial_slope, settings.cells, settings.hardness, conformal)


def pass_contacts(
    result: PassResult,
    spacing: float = SPACING,
    start: float | None = None,
    end: float | None = None,
    options: PatchOptions | None = None,
) -> PassContacts:
    """The patches of a pass, every `spacing` [m] of the wheel's path between start and end [m] (None: the whole pass).

    Raises ValueError where the result holds no forces on wing and nose, or the stretch lies outside of it.
    """
    scene, history = result.scene, result.history
    if not np.isfinite(history["force_wing"]).any():
        raise ValueError(
            f"{result.model}: its result has no forces on wing and nose; take rigid_hertz or a more expensive model"
        )
    low, high = float(history["x"].min()), float(history["x"].max())
    first, last = low if start is None else start, high if end is None else end
    if not low - 1e-9 <= min(first, last) < max(first, last) <= high + 1e-9:
        raise ValueError(f"from {first:g} to {last:g} m: the pass goes from {low:g} to {high:g} m; stay within it")
    order = np.argsort(history["x"])
    at = np.arange(min(first, last), max(first, last) + spacing / 2, spacing)
    at = np.clip(at, low, high)
    table = contact_table(scene, at[0], at[-1], spacing)
    forces = np.stack([np.interp(table.x, history["x"][order], history[f"force_{b}"][order]) for b in BODIES])
    return table_contacts(scene, table, forces, options or PatchOptions())


def table_contacts(scene: Scene, table: ContactTable, forces: np.ndarray, options: PatchOptions) -> PassContacts:
    """The patches at all positions of a table under vertical forces (2, n) [N] on wing and nose, in the order in which
    the wheel meets them; one that carries less than LEAST_FORCE is none."""
    (wing, of_wing), (nose, of_nose) = (_of_body(scene, table, b, forces[b], options) for b in (0, 1))
    every = {name: np.concatenate([of_wing[name], of_nose[name]]) for name in of_wing}
    order = np.lexsort([-every["body"], scene.direction_sign * every["x"]])
    rows = {name: values[order] for name, values in every.items()}
    return PassContacts(patches=wing.joined(nose).taken(order), speed=scene.velocity, modulus=table.modulus, **rows)


def _of_body(
    scene: Scene, table: ContactTable, b: int, force: np.ndarray, options: PatchOptions
) -> tuple[RolledEllipses, dict[str, np.ndarray]]:
    """Patches of one body under vertical forces (n,) [N], and what PassContacts holds of each beside them."""
    carries = np.flatnonzero((force > LEAST_FORCE) & (table.stiffness[b] > 0))
    angle = table.angle[b, carries]
    normal = force[carries] / np.cos(angle)
    sizes = patch_sizes(normal, table.radii[b, carries], table.modulus[b])
    large = np.sqrt(np.maximum(normal / (np.pi * sizes.prod(axis=1)) / options.hardness, 1.0))
    wheel, rail = scene.materials.wheel.steel().elastic, getattr(scene.materials, BODIES[b]).steel().elastic
    semi = no_more_slender(large[:, None] * sizes)
    if options.conformal:
        creepage, strips = strip_creepages(scene, table, b, carries, semi[:, 1], options.cells)
    else:
        creepage, strips = plane_creepages(scene, table, b, carries), None
    patches = rolled_ellipses(
        semi,
        normal,
        wheel,
        rail,
        scene.friction if options.friction is None else options.friction,
        creepage,
        (options.cells, options.cells),
        direction=int(scene.direction_sign),
        initial_slope=options.initial_slope,
        strips=strips,
    )
    return patches, {
        "body": np.full(len(carries), b),
        "x": table.x[carries],
        "position": patch_centres(table, b, carries),
        "angle": angle,
        "enlarged": large,
        "radii": table.radii[b, carries],
    }


def wear_field(
    contacts: PassContacts,
    laws: Mapping[str, WearLaw],
    factor: float = 1.0,
    spacing: float = SPACING,
    grid: tuple[np.ndarray, np.ndarray] | None = None,
    reach: ReachedLines | None = None,
) -> WearField:
    """d(x, y) of one pass, its volume that of the patches' strips: each patch wears the line across the rail at its own
    position, `spacing` [m] wide, by its strip sums.

    reach : in its place, on which lines of the grid each strip wears (rail_fem.damage.reach)

    grid : x (m,) and y (n,) of the field, evenly spaced [m]; None: about the contacts
    Raises ValueError where no contact carries, or one lies beyond the grid.
    """
    if not len(contacts):
        raise ValueError("no contact carries on this stretch: nothing wears")
    low, high = contacts.position.min(axis=0), contacts.position.max(axis=0)
    if grid is None:
        room = contacts.patches.grid.dx.max() * contacts.patches.grid.nx / 2 + 2 * spacing
        x = np.arange(low[0] - room, high[0] + room + spacing, spacing)
        y = np.arange(low[1] - MARGIN, high[1] + MARGIN, LATERAL)
    else:
        x, y = grid
    if not (x[0] <= low[0] and high[0] <= x[-1] and y[0] <= low[1] and high[1] <= y[-1]):
        raise ValueError(
            f"contacts lie at x {low[0]:.3f} to {high[0]:.3f} m, y {low[1]:.3f} to {high[1]:.3f} m, the field at x"
            f" {x[0]:.3f} to {x[-1]:.3f}, y {y[0]:.3f} to {y[-1]:.3f}: give a larger one"
        )
    patches = contacts.patches
    feet, share = footprints(contacts), spacing / (x[1] - x[0]) * patches.grid.dy
    if reach is None:
        laid = lambda strips, scale: deposit(feet, strips, scale, x, y)
    else:
        laid = lambda strips, scale: deposit_reached(feet, strips, scale, reach, x, y)
    strips = {name: factor * law.depth(patches, contacts.speed) for name, law in laws.items()}
    removed = {name: float((own.sum(axis=1) * patches.grid.dy).sum()) * spacing for name, own in strips.items()}
    depth = {name: laid(own, share) for name, own in strips.items()}
    return WearField(x, y, depth, laid(friction_work(patches), share), removed)


def footprints(contacts: PassContacts) -> Footprints:
    """Of the patches of a pass."""
    return Footprints(contacts.body, contacts.position[:, :2], contacts.patches.grid.dy * np.cos(contacts.angle))
