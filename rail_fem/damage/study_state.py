"""A study's state as arrays in a sealed file, for restarts and for who reads results."""

from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import numpy as np

from rail_fem.damage.evolution import Evolution, Site
from rail_fem.damage.worn_profile import WornProfile
from rail_fem.damage.worn_surface import WornSurface
from rail_fem.files.sealed import read_sealed, write_sealed

_SHAPES = ("worn", "first")


def state_arrays(state: Evolution) -> dict[str, np.ndarray]:
    """Everything that a state holds, by name."""
    arrays = _shape_arrays(state) | {f"by_law_{name}": depth for name, depth in state.by_law.items()}
    plain = [f.name for f in fields(Evolution) if f.name not in (*_SHAPES, "by_law")]
    return arrays | {name: np.asarray(getattr(state, name)) for name in plain}


def _shape_arrays(state: Evolution) -> dict[str, np.ndarray]:
    if isinstance(state.worn, WornSurface):
        surface = state.worn
        own = {"x": surface.x, "y": surface.y, "worn_depth": surface.depth, "first_depth": state.first.depth}
        return own if surface.flow is None else own | {"worn_flow": surface.flow, "worn_strain": surface.strain}
    return {"points": state.worn.points, "first_points": state.first.points, "corners": state.worn.corners}


def _shapes(stored: dict[str, np.ndarray], label: str) -> tuple[Any, ...]:
    if "worn_depth" in stored:
        one, two = (WornSurface(stored["x"], stored["y"], stored[f"{name}_depth"], label) for name in _SHAPES)
        if "worn_flow" not in stored:
            return one, two
        zero = np.zeros(two.shape)
        return replace(one, flow=stored["worn_flow"], strain=stored["worn_strain"]), replace(
            two, flow=zero, strain=zero
        )
    return tuple(WornProfile(stored[name], stored["corners"], label) for name in ("points", "first_points"))


def write_state(path: Path, state: Evolution, identity: str) -> None:
    """Whole or not at all. Errors: OSError."""
    write_sealed(path, state_arrays(state), {"case": identity})


def read_state(path: Path, identity: str, site: Site) -> Evolution:
    """The state of a study with this identity; the site goes on from its starts. Errors: SealError."""
    stored, _ = read_sealed(path, {"case": identity}, "begin again with --overwrite")
    worn, first = _shapes(stored, site.first().label)
    site.start_from(stored["starts"])
    by_law = {name: stored[f"by_law_{name}"] for name in site.laws}
    plain = {f.name: stored[f.name] for f in fields(Evolution) if f.name not in (*_SHAPES, "by_law")}
    plain = {name: value if value.ndim else float(value) for name, value in plain.items()}
    return Evolution(worn=worn, first=first, by_law=by_law, **plain)
