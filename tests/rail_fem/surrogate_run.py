"""A run folder made up for tests of the figures: plausible curves and a few hundred elements; no result of any
model."""

from pathlib import Path

import meshio
import numpy as np

from geometry.meshing.blocks import mesh_cap, mesh_grid
from geometry.meshing.hexmesh import HexMesh, merge_bodies
from rail_fem.result.result import PassResult
from tests.rail_fem.test_scene import make_scene

TRANSFER = 0.350
SETTLE = 2e-3
WORST = {"wing": (0.347, 0.032, 0.0), "nose": (0.356, -0.022, 0.0)}  # middle of the made-up plastic strain [m]
MOST = {"wing": 0.012, "nose": 0.034}


def surrogate_mesh() -> HexMesh:
    """Wing and nose as blocks, the wheel as a cap above them."""
    x = np.linspace(0.25, 0.45, 81)
    wing = mesh_grid(x, np.linspace(0.01, 0.055, 16), np.linspace(-0.02, 0.0, 9), "wing")
    nose = mesh_grid(x[20:], np.linspace(-0.035, 0.0, 13), np.linspace(-0.02, 0.0, 9), "nose")
    wheel = mesh_cap(0.42, 0.3, (0.03, 0.05), 0.03, 5e-3, (0.01, 0.05, 0.005), name="wheel")
    wheel.points[:, 0] += 0.4
    return merge_bodies([wing, nose, wheel])


def bump(points: np.ndarray, body: str) -> np.ndarray:
    """Plastic strain around its worst position, zero where it would be small."""
    away = (points - WORST[body]) / (6e-3, 4e-3, 3e-3)
    strain = MOST[body] * np.exp(-0.5 * (away**2).sum(axis=1))
    return np.where(strain > 0.02 * MOST[body], strain, 0.0)


def surrogate_strain(mesh: HexMesh) -> np.ndarray:
    centre = mesh.points[mesh.cells].mean(axis=1)
    strain = np.zeros(len(centre))
    for i, body in enumerate(("wing", "nose")):
        strain[mesh.region == i] = bump(centre[mesh.region == i], body)
    return strain


def surrogate_history(direction: str = "facing", load: float = 86e3) -> dict[str, np.ndarray]:
    """Settling, running on one body, a short loss of contact, impact on the other."""
    time = np.arange(0.0, 6.0e-3, 1e-5)
    x = (0.25 + 33.5 * time) if direction == "facing" else (0.45 - 33.5 * time)
    along = x if direction == "facing" else 0.7 - x  # the same curves met from the other side
    force = load * (1 - np.exp(-time / 2e-4) * np.cos(2 * np.pi * time / 3e-4))
    force += load * 1.1 * np.exp(-0.5 * ((along - 0.358) / 0.004) ** 2) - load * 1.3 * np.exp(
        -0.5 * ((along - 0.345) / 0.002) ** 2
    )
    force = np.maximum(force, 0.0)
    on_nose = 1 / (1 + np.exp(-(x - TRANSFER) / 5e-4))
    carried = force > 0
    contact_y = np.where(carried, 0.032 * (1 - on_nose) - 0.022 * on_nose, np.nan)
    elastic = 15 * (force / load) ** 2
    plastic = 4 / (1 + np.exp(-(along - TRANSFER) / 5e-4))
    return {
        "time": time,
        "x": x,
        "force": force,
        "force_wing": force * (1 - on_nose),
        "force_nose": force * on_nose,
        "force_longitudinal": 0.1 * force * on_nose,
        "creep_longitudinal": -2e-3 * on_nose,
        "wheel_height": -1.2e-3 - 0.6e-3 * np.exp(-0.5 * ((along - 0.36) / 0.05) ** 2),
        "crossing_height": -0.54e-3 * np.minimum(time / SETTLE, 1),
        "contact_x": np.where(carried, x, np.nan),
        "contact_y": contact_y,
        "energy_elastic": elastic,
        "energy_plastic": plastic,
        "energy_hourglass": 0.02 * plastic,
        "energy_contact": 0.01 * elastic,
        "energy_viscosity": 0.03 * plastic,
        "energy_balance": 0.002 * plastic,
        "energy_friction": 0.3 * plastic,
        "energy_external": elastic + 1.5 * plastic,
    }


def write_fields(path: Path, mesh: HexMesh, strain: np.ndarray, **more: np.ndarray) -> None:
    """One VTU as a run writes it; `more` cell data replace or extend the standard ones."""
    stress = np.zeros((len(mesh.cells), 6))
    stress[:, 2] = -2e9 * strain
    data = {
        "region": mesh.region.astype(np.int32),
        "plastic_strain": strain,
        "von_mises": np.abs(stress[:, 2]),
        "stress": stress,
    } | more
    displacement = np.zeros_like(mesh.points)
    displacement[:, 2] = -1e-4
    path.parent.mkdir(parents=True, exist_ok=True)
    cell_data = {name: [values] for name, values in data.items() if values is not None}
    meshio.write(
        path, meshio.Mesh(mesh.points, [("hexahedron", mesh.cells)], {"displacement": displacement}, cell_data)
    )


def write_run(folder: Path, direction: str = "facing", **changes) -> PassResult:
    """history, result and fields/final.vtu of the made-up run; `changes` replace entries of the result."""
    values = {
        "model": "fe_full",
        "scene": make_scene().model_copy(update={"direction": direction}),
        "settings": {"settle_time": SETTLE, "element_size": 2.5e-3},
        "history": surrogate_history(direction),
        "transfer_x": TRANSFER,
    }
    result = PassResult(**(values | changes))
    result.save(folder)
    mesh = surrogate_mesh()
    write_fields(Path(folder) / "fields" / "final.vtu", mesh, surrogate_strain(mesh))
    return result
