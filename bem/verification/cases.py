"""Three pairs of blocks that touch in the three ways of the thesis (chapter 5): non-conformal, conformal, at two
points.

The thesis gives its geometry only as pictures; these are stated here in full. Each block is 30 mm wide; its held edge
lies 20 mm behind the mean line of contact; E 210 GPa, nu 0.3; plane strain; 10 kN per mm of thickness; no friction.

| case | upper face (moves) | lower face (fixed) |
|---|---|---|
| non_conformal | convex arc, radius 100 mm | convex arc, radius 400 mm |
| conformal | convex arc, radius 70 mm | concave arc, radius 80 mm |
| two_point | convex arc, radius 100 mm | two convex arcs, radius 60 mm, crowns at -8 and 8 mm, a parabola over the
middle 2 mm |
"""

import numpy as np

from bem.material import STEEL, Elastic
from bem.plane.body import Body
from bem.plane.coulomb import Control
from bem.plane.outline import block_behind

HALF_WIDTH, HEIGHT = 0.015, 0.020
LOAD = Control.of(force=(None, -10e6))


def arc_face(radius: float, half_width: float = HALF_WIDTH, points: int = 241) -> np.ndarray:
    """Profile (n, 2) [m] through the origin: heights of an arc that rises away from it, or falls for a negative
    radius."""
    x = np.linspace(-half_width, half_width, points)
    return np.column_stack([x, np.sign(radius) * (abs(radius) - np.sqrt(radius**2 - x**2))])


def blocks(
    upper: np.ndarray,
    lower: np.ndarray,
    upper_material: Elastic = STEEL,
    lower_material: Elastic = STEEL,
    height: float = HEIGHT,
) -> tuple[Body, Body]:
    """Fixed lower and moving upper block between two profiles (n, 2) [m] and held edges `height` [m] beyond them."""
    return (
        Body(block_behind(lower, lower[:, 1].min() - height), lower_material),
        Body(block_behind(upper, upper[:, 1].max() + height), upper_material),
    )


def non_conformal() -> tuple[Body, Body]:
    """Convex on convex: relative radius 80 mm."""
    return blocks(arc_face(0.100), arc_face(-0.400))


def conformal() -> tuple[Body, Body]:
    """Convex in concave: relative radius 560 mm."""
    return blocks(arc_face(0.070), arc_face(0.080))


def two_point() -> tuple[Body, Body]:
    """An arc that bridges the saddle between two smaller ones; two equal patches."""
    x = np.linspace(-HALF_WIDTH, HALF_WIDTH, 481)
    away = np.maximum(np.abs(x), 0.001) - 0.008
    root = np.sqrt(0.060**2 - away**2)
    saddle = np.minimum(x**2 - 0.001**2, 0) * 0.007 / root / 0.002
    return blocks(arc_face(0.100), np.column_stack([x, root - 0.060 + saddle]))


CASES = {"non-conformal": non_conformal, "conformal": conformal, "two-point": two_point}
