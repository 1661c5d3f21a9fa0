"""Elements heavier than steel in bodies that weigh what they should: a longer step for a field that is quasi-static.

The density of all elements is multiplied by one factor; the stable step grows with its root. Or only small elements are
made heavier, the smallest by the factor, each of the others so that it has the same critical step and none where steel
has it anyway: the same step for a small part of the mass.

Each body moves as a whole with the mass of the case, to round-off: its lumped mass is that mass less what the mesh
weighs (rail_fem.fe.supports.RigidGroup). A mesh can therefore never weigh more than its body. The wheel's rotation has
the inertia of the case whatever the mesh weighs, for the mesh does not spin. What changes are waves within the bodies:
they are slower by the root of the factor, so chatter and the first microseconds of an impact are not those of steel.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from geometry.meshing.cell_measures import eigen_length
from geometry.meshing.hexmesh import HexMesh
from geometry.meshing.quality import cell_centres
from geometry.surfaces.bodies import CROSSING, PassBody
from rail_fem.fe.plan.mass_scaling import GAIN, SHARE, quasi_static_factor, quasi_static_step, transit_ratio
from rail_fem.fe.slabs import Slabs
from rail_fem.fe.structure import cell_masses, critical_steps, heavier
from rail_fem.fe.window import Extent, heaviest
from rail_fem.scene.scene import Scene
from rail_fem.scene.steel import Steel
from rail_fem.settings.explicit import FeSettings


@dataclass(frozen=True)
class MassScaling:
    """factor : on the density of all elements, or of the smallest;  steel : mass of each body's mesh at the density of
    its steel [kg], with a travelling window the most of the crossing's that moves in it;
    bodies : mass of each body in the case [kg], infinite where it is held;  transit : see
    rail_fem.fe.plan.mass_scaling.transit_ratio;  why : what decided the factor
    Where small elements alone are heavier: least_step : critical step that they are made heavy for [s], else 0;
    scaled : as `steel`, with the mass that is added;  slowness : the wheel's speed over that of waves in the elements
    under it;  most : the largest factor that is possible, up to that
    behind : mass of an elastic base of the wheel's mesh, part of the wheel and not of its `bodies` [kg]"""

    factor: float
    steel: dict[str, float]
    bodies: dict[str, float]
    transit: float
    why: str
    least_step: float = 0.0
    scaled: dict[str, float] | None = None
    slowness: float = 0.0
    most: float = 0.0
    behind: float = 0.0

    @property
    def meshes(self) -> dict[str, float]:
        """Mass of each body's mesh as it moves [kg]."""
        return self.scaled or {name: self.factor * mass for name, mass in self.steel.items()}

    @property
    def added(self) -> float:
        """What the meshes weigh beyond their steel [kg]; the lumped masses are less by as much."""
        return sum(self.meshes.values()) - sum(self.steel.values())

    @property
    def largest(self) -> float:
        """The factor with which the first mesh weighs as much as its body."""
        return min(self.bodies[name] / mass for name, mass in self.steel.items())

    def densities(self, steels: list[Steel]) -> list[Steel]:
        """The steels as the elements have them, but for the small ones' own mass."""
        if self.least_step > 0:
            return steels
        return [replace(steel, density=self.factor * steel.density) for steel in steels]


def choose_scaling(
    scene: Scene,
    settings: FeSettings,
    steels: list[Steel],
    mesh: HexMesh | None,
    comm,
    window: tuple[Slabs, Extent] | None = None,
    behind: float = 0.0,
) -> MassScaling:
    """The factor that the settings ask for. mesh : root only;  window : that travels with the wheel: what lies outside
    is part of the rigid base and its mesh weighs what the base does. Collective.

    Errors: ValueError where a mesh would weigh more than its body, with the largest factor that is possible.
    """
    steel = comm.bcast(None if mesh is None else mesh_masses(mesh, steel_masses(mesh, steels), window), root=0)
    bodies = {
        "crossing": _crossing_mass(scene, settings, steel["crossing"]),
        "wheel": scene.vehicle.wheel_unsprung_mass - behind,
    }
    scaling = MassScaling(1.0, steel, bodies, transit_ratio(scene, 1.0), "", behind=behind)
    if settings.scaled_elements == "small" and settings.mass_scaling != 1.0 and scaling.largest > 0:
        scaling = comm.bcast(
            None if mesh is None else _of_small(scene, settings, steels, mesh, window, scaling), root=0
        )
        _refuse_heavy(scaling)
        return scaling
    if isinstance(settings.mass_scaling, str):  # "auto"
        scaling = _automatic(scene, scaling)
    else:
        scaling = replace(scaling, factor=settings.mass_scaling, why="as the case asks")
        _refuse_heavy(scaling)
    return replace(scaling, transit=transit_ratio(scene, scaling.factor))


def steel_masses(mesh: HexMesh, steels: list[Steel]) -> np.ndarray:
    """Mass of each cell at the density of its steel (m,) [kg]."""
    return cell_masses(mesh.points, mesh.cells, mesh.region, steels, 0.0)


def mesh_masses(mesh: HexMesh, mass: np.ndarray, window: tuple[Slabs, Extent] | None) -> dict[str, float]:
    """Mass of each body's mesh [kg], with a window the most of the crossing's that moves in it; mass : of the cells
    (m,) [kg]."""
    of_regions = np.bincount(mesh.region, mass, minlength=len(PassBody))
    crossing = sum(of_regions[body] for body in CROSSING) if window is None else window_mass(mesh, mass, *window)
    return {"crossing": float(crossing), "wheel": float(of_regions[PassBody.WHEEL])}


def window_mass(mesh: HexMesh, mass: np.ndarray, slabs: Slabs, extent: Extent) -> float:
    """The most that the slabs in a travelling window weigh [kg]; mass : of the cells (m,) [kg]."""
    slab = slabs.of_cells(cell_centres(mesh.points, mesh.cells)[:, 0], mesh.region)
    of_slabs = tuple(
        np.bincount(slab[mesh.region == region], mass[mesh.region == region], minlength=count)
        for region, count in enumerate(slabs.counts)
    )
    return heaviest(slabs, extent, of_slabs)


def _of_small(
    scene: Scene,
    settings: FeSettings,
    steels: list[Steel],
    mesh: HexMesh,
    window: tuple[Slabs, Extent] | None,
    scaling: MassScaling,
) -> MassScaling:
    """The critical step that small elements are made heavy for. Root only."""
    own, mass = critical_steps(mesh.points, mesh.cells, mesh.region, steels), steel_masses(mesh, steels)
    least = float(own.min())
    under_wheel = float(eigen_length(brick(settings.element_size, settings.along))[0])
    meshes = lambda step: mesh_masses(mesh, heavier(mass, own, step), window)
    if asked := not isinstance(settings.mass_scaling, str):
        step, why = settings.mass_scaling**0.5 * least, "as the case asks"
    else:  # "auto"
        step = max(least, quasi_static_step(scene, under_wheel, settings.wave_ratio))
        why = f"auto: waves in the elements under the wheel {under_wheel / scene.speed / step:.3g} times as fast as it"
    limits = scaling.bodies if asked else {name: _most_by_auto(scaling, name) for name in scaling.bodies}
    allowed = _longest(least, step, lambda one: all(kg <= limits[name] for name, kg in meshes(one).items()))
    if allowed < step and not asked:
        step, found = allowed, meshes(allowed)
        name = max(found, key=lambda name: found[name] / limits[name])
        why = f"auto: the mesh of the {name} weighs {found[name] / scaling.bodies[name]:.0%} of its body"
    return replace(
        scaling,
        factor=(step / least) ** 2,
        least_step=step,
        scaled=meshes(step),
        slowness=scene.speed * step / under_wheel,
        why=why,
        most=(allowed / least) ** 2,
    )


def _most_by_auto(scaling: MassScaling, name: str) -> float:
    """What the mesh of a body may weigh with small elements heavier [kg]."""
    whole = scaling.bodies[name] + (scaling.behind if name == "wheel" else 0.0)
    return min(SHARE * scaling.bodies[name], scaling.steel[name] + GAIN * whole)


def _longest(least: float, step: float, allowed: Callable[[float], bool]) -> float:
    """The step if it is allowed, else the longest from `least` on that is, to a thousandth. allowed : falls with it"""
    if allowed(step):
        return step
    low, high = least, step
    while high > (1 + 1e-3) * low:
        middle = (low * high) ** 0.5
        low, high = (middle, high) if allowed(middle) else (low, middle)
    return low


def brick(size: float, along: float) -> np.ndarray:
    """Corners of an element of nominal size, `along` in x (1, 8, 3) [m]."""
    square = np.array([(0, 0), (1, 0), (1, 1), (0, 1)], float)
    corners = np.vstack([np.c_[square, np.zeros(4)], np.c_[square, np.ones(4)]])
    return (corners * (along, size, size))[None]


def _crossing_mass(scene: Scene, settings: FeSettings, steel: float) -> float:
    if not settings.foundation or settings.stands_on_beam(scene):  # its mesh weighs nothing beside the beam
        return np.inf
    return scene.foundation.track_mass if settings.track_mass else steel


def _automatic(scene: Scene, scaling: MassScaling) -> MassScaling:
    wanted, allowed = quasi_static_factor(scene), SHARE * scaling.largest
    if allowed < wanted:
        heaviest = min(scaling.steel, key=lambda name: scaling.bodies[name] / scaling.steel[name])
        why = f"auto: the mesh of the {heaviest} weighs {SHARE:.0%} of its body"
        return replace(scaling, factor=max(1.0, allowed), why=why)
    return replace(scaling, factor=wanted, why="auto: the largest with which the steel near the patch is quasi-static")


def _refuse_heavy(scaling: MassScaling) -> None:
    """Raise ValueError where a mesh weighs more than its body. At factor 1 RigidGroup.add_mass_up_to says it better."""
    if scaling.factor == 1.0:
        return
    for name, mass in scaling.meshes.items():
        if mass > scaling.bodies[name]:
            raise ValueError(
                f"mass_scaling {scaling.factor:g}: the mesh of the {name} would weigh {mass:.0f} kg,"
                f" its body weighs {scaling.bodies[name]:.0f} kg in the case: at most"
                f" {_floor(scaling.most or scaling.largest):g} is possible here, or a shorter window"
            )


def _floor(factor: float) -> float:
    return max(1.0, np.floor(10 * factor) / 10)
