"""Plastic flow along wing and nose as files: a VTU that figures read, and an archive with the surfaces."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from bem.plastic.deviator import FROM_DEVIATOR
from geometry.surfaces.bodies import BODIES
from rail_fem.atomic import write_atomically
from rail_fem.light.plastic_rolling import Flow
from rail_fem.output.fields import REGIONS, VTK_ORDER

ARCHIVE = "plastic.npz"


def write_archive(folder: Path, flows: dict[str, Flow]) -> None:
    """plastic.npz: of each body x, y, depths [m], peeq (nz, nx, ny), lowered (nx, ny) [m], residual deviator
    (nz, 5, nx, ny) [Pa]."""
    arrays = {}
    for body, flow in flows.items():
        for name in ("x", "y", "depths", "peeq", "lowered", "residual"):
            values = getattr(flow, name)
            arrays[f"{body}_{name}"] = values.astype(np.float32) if values.ndim > 2 else values

    def write(path: Path) -> None:
        with path.open("wb") as stream:
            np.savez_compressed(stream, **arrays)

    Path(folder).mkdir(parents=True, exist_ok=True)
    write_atomically(Path(folder) / ARCHIVE, write)


def write_vtu(folder: Path, flows: dict[str, Flow], heights, time: float) -> bool:
    """fields/final.vtu with the cells about what has yielded, on the bodies' surfaces; False where meshio is missing.

    heights : body -> z(x, y) [m], NaN without surface
    """
    try:
        import meshio  # comes with the explicit models
    except ImportError:
        return False
    made = [_hexahedra(flow, heights[body], BODIES.index(body)) for body, flow in flows.items()]
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


def _hexahedra(flow: Flow, height, region: int) -> dict[str, np.ndarray] | None:
    """Cells around the plastic zone of one body; the axis order of the deviator is turned to z up."""
    assert REGIONS[: len(BODIES)] == BODIES
    used = np.argwhere(flow.peeq > 0)
    if not len(used):
        return None
    low, high = np.maximum(used.min(axis=0) - 2, 0), np.minimum(used.max(axis=0) + 3, flow.peeq.shape)
    box = tuple(slice(a, b) for a, b in zip((0, *low[1:]), high))
    edges = [np.r_[c[s] - flow.side / 2, c[s][-1] + flow.side / 2] for c, s in zip((flow.depths, flow.x, flow.y), box)]
    x, y = np.meshgrid(edges[1], edges[2], indexing="ij")
    top = height(x, y)
    z = top[None] - edges[0][:, None, None]
    number = np.arange(z.size).reshape(z.shape)
    lower, upper = number[1:], number[:-1]
    low, high = slice(None, -1), slice(1, None)
    ring = (low, low), (high, low), (high, high), (low, high)
    cells = np.stack([layer[:, a, b] for layer in (lower, upper) for a, b in ring], axis=-1).reshape(-1, 8)
    stress = np.einsum("vc,kcij->kijv", FROM_DEVIATOR, flow.residual[box[0], :, box[1], box[2]]).reshape(-1, 6)
    stress[:, 3:5] *= -1  # depth-positive to z up
    points = np.stack([np.broadcast_to(x, z.shape), np.broadcast_to(y, z.shape), z], axis=-1).reshape(-1, 3)
    whole = np.isfinite(points[cells]).all(axis=(1, 2))
    return {
        "points": np.nan_to_num(points),
        "cells": cells[whole],
        "region": np.full(int(whole.sum()), region),
        "plastic_strain": flow.peeq[box].ravel()[whole],
        "stress": stress[whole][:, VTK_ORDER],
    }
