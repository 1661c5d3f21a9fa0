"""Elements heavier than steel in bodies that weigh what they should: a longer step for a field that is quasi-static.

The density of all elements is multiplied by one factor; the stable step grows with its root. Each body moves as a whole
with the mass of the case, to round-off: its lumped mass is that mass less what the mesh weighs
(rail_fem.fe.supports.RigidGroup). A mesh can therefore never weigh more than its body. The wheel's rotation has the
inertia of the case whatever the mesh weighs, for the mesh does not spin. What changes are waves within the bodies: they
are slower by the root of the factor, so chatter and the first microseconds of an impact are not those of steel.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from geometry.meshing.hexmesh import HexMesh
from rail_fem.fe.hexahedron import volumes
from rail_fem.fe.slabs import Slabs
from rail_fem.fe.window import Extent, heaviest
from rail_fem.light.mass_scaling import SHARE, quasi_static_factor, transit_ratio
from rail_fem.scene.scene import Scene
from rail_fem.scene.steel import Steel
from rail_fem.settings.explicit import FeSettings

AUTO = "auto"


@dataclass(frozen=True)
class MassScaling:
    """factor : on the density of all elements;  steel : mass of each body's mesh at the density of its steel [kg], with
    a travelling window the most of the crossing's that moves in it;
    bodies : mass of each body in the case [kg], infinite where it is held;  transit : see
    rail_fem.light.mass_scaling.transit_ratio;  why : what decided the factor"""

    factor: float
    steel: dict[str, float]
    bodies: dict[str, float]
    transit: float
    why: str

    @property
    def added(self) -> float:
        """What the meshes weigh beyond their steel [kg]; the lumped masses are less by as much."""
        return (self.factor - 1) * sum(self.steel.values())

    @property
    def largest(self) -> float:
        """The factor with which the first mesh weighs as much as its body."""
        return min(self.bodies[name] / mass for name, mass in self.steel.items())

    def densities(self, steels: list[Steel]) -> list[Steel]:
        """The steels as the elements have them."""
        return [replace(steel, density=self.factor * steel.density) for steel in steels]


def choose_scaling(
    scene: Scene,
    settings: FeSettings,
    steels: list[Steel],
    mesh: HexMesh | None,
    comm,
    window: tuple[Slabs, Extent] | None = None,
) -> MassScaling:
    """The factor that the settings ask for. mesh : root only;  window : that travels with the wheel: what lies outside
    is part of the rigid base and its mesh weighs what the base does. Collective.

    Errors: ValueError where a mesh would weigh more than its body, with the largest factor that is possible.
    """
    masses = comm.bcast(None if mesh is None else steel_masses(mesh, steels), root=0)
    moving = comm.bcast(None if mesh is None or window is None else window_mass(mesh, steels, *window), root=0)
    steel = {"crossing": float(masses[0] + masses[1]) if moving is None else moving, "wheel": float(masses[2])}
    bodies = {
        "crossing": _crossing_mass(scene, settings, steel["crossing"]),
        "wheel": scene.vehicle.wheel_unsprung_mass,
    }
    scaling = MassScaling(1.0, steel, bodies, transit_ratio(scene, 1.0), "")
    if isinstance(settings.mass_scaling, str):  # AUTO
        scaling = _automatic(scene, scaling)
    else:
        scaling = replace(scaling, factor=settings.mass_scaling, why="as the case asks")
        _refuse_heavy(scaling)
    return replace(scaling, transit=transit_ratio(scene, scaling.factor))


def steel_masses(mesh: HexMesh, steels: list[Steel]) -> np.ndarray:
    """Mass of each region at the density of its steel (n_steels,) [kg]."""
    return np.bincount(mesh.region, _cell_masses(mesh, steels), minlength=len(steels))


def window_mass(mesh: HexMesh, steels: list[Steel], slabs: Slabs, extent: Extent) -> float:
    """The most that the slabs in a travelling window weigh at the density of their steel [kg]."""
    mass, slab = _cell_masses(mesh, steels), slabs.of_cells(mesh.points[mesh.cells].mean(axis=1)[:, 0], mesh.region)
    of_slabs = tuple(
        np.bincount(slab[mesh.region == region], mass[mesh.region == region], minlength=count)
        for region, count in enumerate(slabs.counts)
    )
    return heaviest(slabs, extent, of_slabs)


def _cell_masses(mesh: HexMesh, steels: list[Steel]) -> np.ndarray:
    density = np.array([steel.density for steel in steels])[mesh.region]
    return density * volumes(mesh.points.ravel(), mesh.cells)


def _crossing_mass(scene: Scene, settings: FeSettings, steel: float) -> float:
    if not settings.foundation:
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
    for name, steel in scaling.steel.items():
        if scaling.factor * steel > scaling.bodies[name]:
            raise ValueError(
                f"mass_scaling {scaling.factor:g}: the mesh of the {name} would weigh {scaling.factor * steel:.0f} kg,"
                f" its body weighs {scaling.bodies[name]:.0f} kg in the case: at most {_floor(scaling.largest):g} is"
                " possible here, or a shorter window"
            )


def _floor(factor: float) -> float:
    return max(1.0, np.floor(10 * factor) / 10)
