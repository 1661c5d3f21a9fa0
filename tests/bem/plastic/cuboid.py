"""Stress and displacement of one cuboid of uniform eigenstrain in a half-space, exact: what many are held against.

Axes of the room: depth z >= 0 positive into the body, traction-free surface z = 0; order VOIGT with tensor shears.
Source: bem.plastic.symbols. Published closed forms of the same field: Chiu, J. Appl. Mech. 45 (1978) 302 (not looked
at). Error: round-off, growing as (distance / side)^3 eps (tests/bem/plastic/test_cuboid.py).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bem.checks import refuse_unless_finite, refuse_unless_positive
from bem.material import Elastic
from bem.patch import ContactInputError
from bem.plastic.corners import COUNT, fill_corner
from bem.plastic.symbols import PAIRS, coefficient_tables, depth_parity, facing_layers
from kernel_cache import njit

_NUDGE = 1e-9  # of a cuboid's side: how far an observer is moved off the planes of its faces


@dataclass(frozen=True)
class Cuboid:
    """x, y, z : (low, high) [m], z the depth. Errors: ContactInputError for faces in the wrong order or above the
    surface."""

    x: tuple[float, float]
    y: tuple[float, float]
    z: tuple[float, float]

    def __post_init__(self) -> None:
        for name in "xyz":
            low, high = getattr(self, name)
            refuse_unless_finite(ContactInputError, **{f"cuboid {name}": low, f"cuboid {name} ": high})
            if not low < high:
                raise ContactInputError(f"cuboid: {name} from {low:g} to {high:g} m: give the lower face first")
        if self.z[0] < 0:
            raise ContactInputError(f"cuboid: depth from {self.z[0]:g} m lies above the surface z = 0")


def cuboid_stress(points: np.ndarray, cuboid: Cuboid, strain: np.ndarray, elastic: Elastic) -> np.ndarray:
    """(n, 6) stress [Pa] at points (n, 3) [m], z >= 0, of eigenstrain (6,) in the cuboid; inside the elastic stress.

    An observer on a plane of a face is moved off it by 1e-9 of the side, towards growing coordinates; one on an edge
    or corner sees the logarithm's large but finite value.
    """
    points, strain = _checked(points, strain, elastic)
    stress = _field("stress", PAIRS, points, cuboid, strain, elastic) * elastic.shear
    stress[_inside(points, cuboid)] += facing_layers(strain, elastic)
    return stress


def cuboid_displacement(points: np.ndarray, cuboid: Cuboid, strain: np.ndarray, elastic: Elastic) -> np.ndarray:
    """(n, 3) displacement [m] at points (n, 3) [m], z >= 0, of eigenstrain (6,) in the cuboid."""
    points, strain = _checked(points, strain, elastic)
    return _field("displacement", ((0,), (1,), (2,)), points, cuboid, strain, elastic)


def _checked(points: np.ndarray, strain: np.ndarray, elastic: Elastic) -> tuple[np.ndarray, np.ndarray]:
    points, strain = np.atleast_2d(np.asarray(points, float)), np.asarray(strain, float)
    if points.ndim != 2 or points.shape[1] != 3 or not np.isfinite(points).all() or (points[:, 2] < 0).any():
        raise ContactInputError(f"points of shape {points.shape}: give finite (n, 3) with depths z >= 0")
    if strain.shape != (6,) or not np.isfinite(strain).all():
        raise ContactInputError(f"eigenstrain {strain!r}: give six finite tensor components, order xx yy zz yz xz xy")
    refuse_unless_positive(ContactInputError, **{"Young's modulus [Pa]": elastic.young})
    return points, strain


def _inside(points: np.ndarray, cuboid: Cuboid) -> np.ndarray:
    sides = (cuboid.x, cuboid.y, cuboid.z)
    return np.all([(points[:, k] >= low) & (points[:, k] < high) for k, (low, high) in enumerate(sides)], axis=0)


def _field(name: str, indices, points: np.ndarray, cuboid: Cuboid, strain, elastic: Elastic) -> np.ndarray:
    tables = coefficient_tables(elastic.poisson)
    weigh = lambda table, sign: np.einsum("ikfmn,k,ik->ifmn", table, strain, sign)
    above = np.array([[depth_parity(field, k) for k in range(6)] for field in indices], float)
    full, surface = tables[f"full {name}"], tables[f"surface {name}"]
    one = np.ones_like(above)
    faces = np.array([cuboid.x, cuboid.y, cuboid.z], float)
    return _sum_corners(points, faces, weigh(full, one), weigh(full, above), weigh(surface, one))


@njit(cache=True)
def _off(distance: float, side: float, nudge: float) -> float:
    return distance if abs(distance) > nudge * side else nudge * side


@njit(cache=True)
def _add_corners(x, y, faces, eta, sign, table, depth, sources, out):
    """Adds the field of a layer's face at the distance eta, for the four corners."""
    values = np.empty(COUNT)
    side_x, side_y = faces[0, 1] - faces[0, 0], faces[1, 1] - faces[1, 0]
    for i in range(2):
        for j in range(2):
            fill_corner(_off(x - faces[0, i], side_x, _NUDGE), _off(y - faces[1, j], side_y, _NUDGE), eta, values)
            corner = sign * (1.0 if i == j else -1.0)
            for k in range(table.shape[0]):
                for f in range(COUNT):
                    out[k] += (
                        corner
                        * values[f]
                        * (
                            table[k, f, 0, 0]
                            + depth * table[k, f, 1, 0]
                            + sources * (table[k, f, 0, 1] + depth * table[k, f, 1, 1])
                        )
                    )


@njit(cache=True)
def _sum_corners(points, faces, below, above, surface):
    """(n, components): full space (observer below or above the source, or beside it), and what the surface adds."""
    out = np.zeros((len(points), below.shape[0]))
    top, bottom = faces[2, 0], faces[2, 1]
    for p in range(len(points)):
        x, y, z = points[p]
        if z > top:  # the part of the cuboid above the observer: he is below the source
            low = min(z, bottom)
            _add_corners(x, y, faces, z - low, 1.0, below, z - low, 0.0, out[p])
            _add_corners(x, y, faces, z - top, -1.0, below, z - top, 0.0, out[p])
        if z < bottom:
            high = max(z, top)
            _add_corners(x, y, faces, high - z, 1.0, above, high - z, 0.0, out[p])
            _add_corners(x, y, faces, bottom - z, -1.0, above, bottom - z, 0.0, out[p])
        _add_corners(x, y, faces, z + top, 1.0, surface, z, top, out[p])
        _add_corners(x, y, faces, z + bottom, -1.0, surface, z, bottom, out[p])
    return out
