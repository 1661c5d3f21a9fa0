"""One wheel over a crossing: patches of wing and nose every few millimetres, their tractions, wear of all laws and
fatigue.

Forces come from a pass of rigid_hertz (any result with forces on wing and nose), positions and radii of the contacts
from rail_fem.damage.wear import tgamma
from the same table of the surfaces. The wheel turns at the spin at which it rolls on its tread datum; the other wheel,
on its stock rail, holds it there. Each patch rolls steadily, though forces change along a patch's length at the
transfer.
A patch whose mean pressure would pass the hardness is as large as the hardness lets it be, at the same shape: what is
plastic there cannot press more, and elastic ellipses on a nose's unworn corner would.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from bem.halfspace.falling_friction import FallingFriction
from bem.halfspace.fastsim import elliptic_patch, fastsim
from bem.material import Elastic
from bem.patch import Creepage, Patch
from geometry.contact.prismatic_search import Motion, creepages_at
from geometry.surfaces.bodies import BODIES
from geometry.wheelset import Wheelset
from rail_fem.damage.wear import WearLaw, friction_work, tgamma
from rail_fem.light.contact_table import ContactTable, contact_table, patch_sizes
from rail_fem.output.result import PassResult
from rail_fem.scene.scene import Scene

SPACING = 2e-3  # between the patches [m]
LATERAL = 0.5e-3  # between the rows of the field d(x, y) [m]
MARGIN = 20e-3  # of the field beyond the contacts [m]
LEAST_FORCE = 100.0  # of a contact that is looked at [N]


@dataclass(frozen=True)
class CrossingContact:
    """One patch of the pass. body : "wing" or "nose";  x [m] of the wheel;  position (3,) of the patch's middle [m]
    patch : solved;  angle [rad], speed [m/s];  enlarged : factor on its axes, above 1 where the elastic patch would
    press more than the hardness"""

    body: str
    x: float
    position: np.ndarray
    patch: Patch
    angle: float
    speed: float
    enlarged: float = 1.0

    @property
    def tgamma(self) -> float:
        """Tractive forces times creepages [N]."""
        return tgamma(self.patch)


@dataclass(frozen=True, eq=False)
class WearField:
    """Depth worn off by one pass on a plan. x (m,), y (n,) [m];  depth : law -> body -> (m, n) [m];  work : body ->
    (m, n) friction work per area [J/m2];  contacts : that it comes from."""

    x: np.ndarray
    y: np.ndarray
    depth: Mapping[str, Mapping[str, np.ndarray]]
    work: Mapping[str, np.ndarray]
    contacts: tuple[CrossingContact, ...]

    def volume(self, law: str) -> float:
        """Worn off by one pass [m3]."""
        step = (self.x[1] - self.x[0]) * (self.y[1] - self.y[0])
        return float(sum(part.sum() for part in self.depth[law].values()) * step)


@dataclass(frozen=True)
class PatchOptions:
    """How the patches of a pass are solved. friction : None: the scene's;  initial_slope : third body;  cells : each
    way;  hardness : of the rail [Pa], which bounds the mean pressure"""

    friction: float | FallingFriction | None = None
    initial_slope: float = 1.0
    cells: int = 50
    hardness: float = np.inf


def pass_contacts(
    result: PassResult,
    spacing: float = SPACING,
    start: float | None = None,
    end: float | None = None,
    shift: float = 0.0,
    options: PatchOptions | None = None,
) -> tuple[CrossingContact, ...]:
    """The patches of a pass, every `spacing` [m] of the wheel's path between start and end [m] (None: the whole pass).

    shift : lateral position of the wheel towards its field side [m]; the forces stay those of the result
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
    table = contact_table(scene, at[0], at[-1], spacing, shift)
    forces = np.stack([np.interp(table.x, history["x"][order], history[f"force_{b}"][order]) for b in BODIES])
    return table_contacts(scene, table, forces, options or PatchOptions())


def table_contacts(
    scene: Scene, table: ContactTable, forces: np.ndarray, options: PatchOptions
) -> tuple[CrossingContact, ...]:
    """The patches at all positions of a table under vertical forces (2, n) [N] on wing and nose, in the order in which
    the wheel meets them; one that carries less than LEAST_FORCE is none."""
    sign, found = scene.direction_sign, []
    law = scene.friction if options.friction is None else options.friction
    for b, body in enumerate(BODIES):
        carries = np.flatnonzero((forces[b] > LEAST_FORCE) & (table.stiffness[b] > 0))
        rigid = _creepages(scene, table, b, carries, sign)
        normal = forces[b][carries] / np.cos(table.angle[b, carries])
        sizes = patch_sizes(normal, table.radii[b, carries], table.modulus[b])
        large = np.sqrt(np.maximum(normal / (np.pi * sizes.prod(axis=1)) / options.hardness, 1.0))
        steels = (scene.materials.wheel.steel(), getattr(scene.materials, body).steel())
        upper, lower = (Elastic(steel.youngs_modulus, steel.poisson) for steel in steels)
        for k, i in enumerate(carries):
            axes = large[k] * sizes[k]
            patch = elliptic_patch(float(axes[0]), float(axes[1]), float(normal[k]), (options.cells, options.cells))
            patch = fastsim(
                patch,
                upper,
                lower,
                law,
                Creepage(*map(float, rigid[k])),
                initial_slope=options.initial_slope,
                direction=int(sign),
                estimate=False,
            )
            angle = float(table.angle[b, i])
            aside = table.middle[b, i] * np.array([0.0, np.cos(angle), np.sin(angle)])
            found.append(
                CrossingContact(
                    body, float(table.x[i]), table.point[b, i] + aside, patch, angle, scene.velocity, float(large[k])
                )
            )
    return tuple(sorted(found, key=lambda contact: (sign * contact.x, contact.body)))


def _creepages(scene, table: ContactTable, b: int, positions: np.ndarray, sign: float) -> np.ndarray:
    """(k, 3) rigid slip per speed at the contacts of one body; the axle follows the table's heights."""
    wheel, rigid = scene.wheel, np.zeros((len(positions), 3))
    for row, i in enumerate(positions):
        steep, angle = table.slope[b, i], table.angle[b, i]
        normal = np.array([-steep, -np.tan(angle), 1.0])
        height = float(table.height[b, i]) + wheel.radius
        state = Wheelset(wheel.shape, radius=wheel.radius, back_to_back=scene.back_to_back, x=table.x[i], z=height)
        motion = Motion(scene.velocity, vertical=scene.velocity * steep)
        unit = normal / np.linalg.norm(normal)
        rigid[row] = creepages_at(state, table.point[b, i][None], unit[None], motion)[0]
    return rigid


def wear_field(
    contacts: tuple[CrossingContact, ...],
    laws: Mapping[str, WearLaw],
    factor: float = 1.0,
    spacing: float = SPACING,
    grid: tuple[np.ndarray, np.ndarray] | None = None,
) -> WearField:
    """d(x, y) of one pass: each patch wears the line across the rail that lies under it, `spacing` [m] wide, by its
    strip sums, shared by the two lines of the field next to it. The volume is that of the strips.

    grid : x (m,) and y (n,) of the field, evenly spaced [m]; None: about the contacts
    Raises ValueError where no contact carries, or one lies beyond the grid.
    """
    if not contacts:
        raise ValueError("no contact carries on this stretch: nothing wears")
    positions = np.array([c.position for c in contacts])
    low, high = positions.min(axis=0), positions.max(axis=0)
    if grid is None:
        x = np.arange(low[0] - 2 * spacing, high[0] + 3 * spacing, spacing)
        y = np.arange(low[1] - MARGIN, high[1] + MARGIN, LATERAL)
    else:
        x, y = grid
    if not (x[0] <= low[0] and high[0] <= x[-1] and y[0] <= low[1] and high[1] <= y[-1]):
        raise ValueError(
            f"contacts lie at x {low[0]:.3f} to {high[0]:.3f} m, y {low[1]:.3f} to {high[1]:.3f} m, the field at x"
            f" {x[0]:.3f} to {x[-1]:.3f}, y {y[0]:.3f} to {y[-1]:.3f}: give a larger one"
        )
    lateral, line_share = y[1] - y[0], spacing / (x[1] - x[0])
    empty = lambda: {body: np.zeros((len(x), len(y))) for body in BODIES}
    depth, work = {name: empty() for name in laws}, empty()
    for c in contacts:
        rows = _spread(c.position[0], x)
        cosine = np.cos(c.angle)
        edges = c.position[1] + np.append(c.patch.grid.y - c.patch.grid.dy / 2, c.patch.grid.edges[3]) * cosine
        own = np.append(y - lateral / 2, y[-1] + lateral / 2)
        strips = {name: factor * law.depth(c.patch, c.speed) for name, law in laws.items()}
        for target, values in (
            *((depth[name][c.body], v) for name, v in strips.items()),
            (work[c.body], friction_work(c.patch)),
        ):
            worn = np.concatenate([[0.0], np.cumsum(values) * c.patch.grid.dy])
            line = np.diff(np.interp(own, edges, worn)) / lateral
            for i, share in rows:
                target[i] += share * line_share * line
    return WearField(x, y, depth, work, contacts)


def _spread(position: float, x: np.ndarray) -> tuple[tuple[int, float], tuple[int, float]]:
    """The two lines of the field next to a position and their shares."""
    at = (position - x[0]) / (x[1] - x[0])
    i = int(np.clip(np.floor(at), 0, len(x) - 2))
    return (i, 1 - (at - i)), (i + 1, at - i)
