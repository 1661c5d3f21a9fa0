"""Height of a crossing's surface for compiled searches, whatever kind of crossing it is.

A search is compiled once for each kind: which height function it calls follows from the type of the tables that it is
handed (`tables` of a crossing), so that neither kind pays for the other.
"""

from numba.core import types
from numba.extending import overload

from geometry.surfaces.bodies import NO_METAL
from geometry.surfaces.crossing_surface import CrossingShape, nose_height, wing_height
from geometry.surfaces.section_grid import SectionGrids, grid_height
from kernel_cache import njit

KINDS = (CrossingShape, SectionGrids)


def height_of(x, y, nose, shape, loft):
    """Height [m] of wing (nose False) or nose at one point; NO_METAL beside it. shape, loft : `tables` of a crossing"""
    if isinstance(shape, CrossingShape):
        return nose_height(x, y, shape) if nose else wing_height(x, y, shape, loft)
    return grid_height(x, y, shape.nose) if nose else grid_height(x, y, shape.wing)


@overload(height_of, inline="never")
def _height_of(x, y, nose, shape, loft):
    kind = shape.instance_class if isinstance(shape, types.NamedTuple | types.NamedUniTuple) else None
    if kind is CrossingShape:
        return lambda x, y, nose, shape, loft: nose_height(x, y, shape) if nose else wing_height(x, y, shape, loft)
    if kind is SectionGrids:
        return lambda x, y, nose, shape, loft: grid_height(x, y, shape.nose) if nose else grid_height(x, y, shape.wing)
    return None


@njit(cache=True)
def surface_height(x, y, nose, shape, loft):
    """As height_of, compiled."""
    return height_of(x, y, nose, shape, loft)


__all__ = ["KINDS", "NO_METAL", "height_of", "surface_height"]
