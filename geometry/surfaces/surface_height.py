"""Height of a crossing's surface for compiled searches, whatever kind of crossing it is.

A search is compiled once for each kind: which height function it calls follows from the type of the tables that it is
handed (`tables` of a crossing), so that neither kind pays for the other.
"""

from typing import NamedTuple

from numba.core import types
from numba.extending import overload

from geometry.surfaces.bodies import NO_METAL
from geometry.surfaces.crossing_surface import CrossingShape, nose_height, wing_height
from geometry.surfaces.depth_field import DepthField, depth_at
from geometry.surfaces.section_grid import SectionGrids, grid_height
from kernel_cache import njit


class WornShape(NamedTuple):
    """Tables of a worn crossing: the unworn crossing's, and what has been worn off."""

    base: CrossingShape | SectionGrids
    wing: DepthField
    nose: DepthField


KINDS = (CrossingShape, SectionGrids, WornShape)


def height_of(x, y, nose, shape, loft):
    """Height [m] of wing (nose False) or nose at one point; NO_METAL beside it. shape, loft : `tables` of a crossing"""
    if isinstance(shape, WornShape):
        z = height_of(x, y, nose, shape.base, loft)
        return z - depth_at(x, y, shape.nose if nose else shape.wing) if z > 0.5 * NO_METAL else z
    if isinstance(shape, CrossingShape):
        return nose_height(x, y, shape) if nose else wing_height(x, y, shape, loft)
    return grid_height(x, y, shape.nose) if nose else grid_height(x, y, shape.wing)


@overload(height_of, inline="never", jit_options={"forceinline": True})
def _height_of(x, y, nose, shape, loft):
    kind = _kind(shape)
    if kind is WornShape:
        base = shape.types[WornShape._fields.index("base")]
        return _worn(_kind(base))
    if kind is CrossingShape:
        return lambda x, y, nose, shape, loft: nose_height(x, y, shape) if nose else wing_height(x, y, shape, loft)
    if kind is SectionGrids:
        return lambda x, y, nose, shape, loft: grid_height(x, y, shape.nose) if nose else grid_height(x, y, shape.wing)
    return None


def _kind(shape):
    return shape.instance_class if isinstance(shape, types.NamedTuple | types.NamedUniTuple) else None


def _worn(base):
    """Height of a worn crossing of this kind. Written out for each kind."""
    if base is CrossingShape:

        def worn(x, y, nose, shape, loft):
            z = nose_height(x, y, shape.base) if nose else wing_height(x, y, shape.base, loft)
            return z - depth_at(x, y, shape.nose if nose else shape.wing) if z > 0.5 * NO_METAL else z

        return worn
    if base is SectionGrids:

        def worn_sections(x, y, nose, shape, loft):
            z = grid_height(x, y, shape.base.nose) if nose else grid_height(x, y, shape.base.wing)
            return z - depth_at(x, y, shape.nose if nose else shape.wing) if z > 0.5 * NO_METAL else z

        return worn_sections
    return None


@njit(cache=True, forceinline=True)
def surface_height(x, y, nose, shape, loft):
    """As height_of, compiled."""
    return height_of(x, y, nose, shape, loft)


__all__ = ["KINDS", "NO_METAL", "height_of", "surface_height"]
