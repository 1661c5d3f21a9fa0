"""Height of a crossing's surface for compiled searches, whatever kind of crossing it is.

A search is compiled once for each kind: which height function it calls follows from the type of the tables that it is
handed (`tables` of a crossing), so that neither kind pays for the other.
"""

from typing import NamedTuple

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


def _parametric(x, y, nose, shape, loft):
    return nose_height(x, y, shape) if nose else wing_height(x, y, shape, loft)


def _by_sections(x, y, nose, shape, loft):
    return grid_height(x, y, shape.nose) if nose else grid_height(x, y, shape.wing)


def _worn(x, y, nose, shape, loft):
    """That of its base, less what has been worn off."""
    z = height_of(x, y, nose, shape.base, loft)
    return z - depth_at(x, y, shape.nose if nose else shape.wing) if z > 0.5 * NO_METAL else z


OF_KIND = {CrossingShape: _parametric, SectionGrids: _by_sections, WornShape: _worn}
KINDS = tuple(OF_KIND)


def height_of(x, y, nose, shape, loft):
    """Height [m] of wing (nose False) or nose at one point; NO_METAL beside it. shape, loft : `tables` of a crossing"""
    return OF_KIND[type(shape)](x, y, nose, shape, loft)


@overload(height_of, inline="never", jit_options={"forceinline": True})
def _height_of(x, y, nose, shape, loft):
    return OF_KIND.get(getattr(shape, "instance_class", object))


@njit(cache=True, forceinline=True)
def surface_height(x, y, nose, shape, loft):
    """As height_of, compiled."""
    return height_of(x, y, nose, shape, loft)


__all__ = ["KINDS", "NO_METAL", "height_of", "surface_height"]
