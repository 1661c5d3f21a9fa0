"""Plastic flow along wing and nose as files: a VTU that figures read, and an archive with the surfaces."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from geometry.surfaces.bodies import PassBody
from rail_fem.files.atomic import write_atomically
from rail_fem.passes.plastic_rolling import Flow, around
from rail_fem.result.fields import VTK_ORDER
from rail_fem.result.plastic_zone import plastic_zone

ARCHIVE = "plastic.npz"


def write_archive(folder: Path, flows: dict[str, Flow]) -> None:
    """plastic.npz: of each body x, y, depths [m], peeq (nz, nx, ny), lowered (nx, ny) [m], residual_stress
    (nz, nx, ny, 6) [Pa], order VOIGT, z up."""
    arrays = {}
    for body, flow in flows.items():
        for name in ("x", "y", "depths", "peeq", "lowered", "residual_stress"):
            values = getattr(flow, name.removesuffix("_stress"))
            arrays[f"{body}_{name}"] = values.astype(np.float32) if values.ndim > 2 else values
    write_arrays(folder, arrays)


def write_arrays(folder: Path, arrays: dict[str, np.ndarray]) -> None:
    """plastic.npz of these."""
    Path(folder).mkdir(parents=True, exist_ok=True)
    write_atomically(Path(folder) / ARCHIVE, lambda path: np.savez_compressed(path, **arrays))


def write_vtu(folder: Path, flows: dict[str, Flow], heights) -> bool:
    """fields/final.vtu with the cells about what has yielded, on the bodies' surfaces; False where meshio is missing.

    heights : body -> z(x, y) [m], NaN without surface
    """
    try:
        import meshio  # comes with the explicit models
    except ImportError:
        return False
    made = [hexahedra(flow, heights[body], PassBody[body.upper()]) for body, flow in flows.items()]
    parts = [part for part in made if part is not None]
    if not parts:
        return True
    offsets = np.cumsum([0] + [len(part["points"]) for part in parts[:-1]])
    join = lambda name: np.concatenate([part[name] for part in parts])
    points = join("points")
    mesh = meshio.Mesh(
        points,
        [("hexahedron", np.concatenate([part["cells"] + k for part, k in zip(parts, offsets)]))],
        point_data={"displacement": np.zeros_like(points)},
        cell_data={name: [join(name)] for name in ("region", "plastic_strain", "stress")},
    )
    target = Path(folder) / "fields" / "final.vtu"
    target.parent.mkdir(parents=True, exist_ok=True)
    write_atomically(target, lambda path: meshio.write(path, mesh, file_format="vtu"))
    return True


def metal_of(flow: Flow, height) -> dict:
    """What the flow leaves in one body: plain values of rail_fem.result.plastic_zone.PlasticZone, as explicit runs have
    them, and the largest fall of the surface in every row of cells; height : z(x, y) [m]. Empty where nothing yielded.
    """
    part = hexahedra(flow, height, 0)
    if part is None:
        return {}
    corners, strain = part["points"][part["cells"]], part["plastic_strain"]
    zone = plastic_zone(corners, strain, part["stress"][:, :2]).plain()
    fall = {"x": flow.x.tolist(), "fall": flow.lowered.max(axis=1).tolist()}
    return zone | {"unloaded": True, "surface": fall}


def hexahedra(flow: Flow, height, region: int) -> dict[str, np.ndarray] | None:
    """Cells around the plastic zone of one body: points [m], cells (m, 8), region, plastic_strain, stress (m, 6): the
    residual stress [Pa] in VTK's order, NaN where it is not known; None where nothing has yielded."""
    used = np.argwhere(flow.peeq > 0)
    if not len(used):
        return None
    sides = flow.side, flow.length, flow.side
    margin = around(sides)
    low, high = np.maximum(used.min(axis=0) - margin, 0), np.minimum(used.max(axis=0) + margin + 1, flow.peeq.shape)
    box = tuple(slice(int(a), int(b)) for a, b in zip((0, *low[1:]), high))
    edges = [
        np.r_[c[s] - side / 2, c[s][-1] + side / 2] for c, s, side in zip((flow.depths, flow.x, flow.y), box, sides)
    ]
    x, y = np.meshgrid(edges[1], edges[2], indexing="ij")
    top = height(x, y)
    z = top[None] - edges[0][:, None, None]
    number = np.arange(z.size).reshape(z.shape)
    lower, upper = number[1:], number[:-1]
    low, high = slice(None, -1), slice(1, None)
    ring = (low, low), (high, low), (high, high), (low, high)
    cells = np.stack([layer[:, a, b] for layer in (lower, upper) for a, b in ring], axis=-1).reshape(-1, 8)
    points = np.stack([np.broadcast_to(x, z.shape), np.broadcast_to(y, z.shape), z], axis=-1).reshape(-1, 3)
    whole = np.isfinite(points[cells]).all(axis=(1, 2))
    return {
        "points": np.nan_to_num(points),
        "cells": cells[whole],
        "region": np.full(int(whole.sum()), region),
        "plastic_strain": flow.peeq[box].ravel()[whole],
        "stress": flow.residual[box].reshape(-1, 6)[whole][:, VTK_ORDER],
    }
