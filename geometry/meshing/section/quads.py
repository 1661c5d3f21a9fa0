"""Quadrilaterals of one section: fine blocks under the running bands, two rings around each, Gmsh in the rest.

The sweep along x (mesh_sweep) has three slabs in the fine part for one in the coarse part. So a section has three kinds
of quads: `fine`, swept slab by slab; `strip`, one ring around each block, swept by a 3:1 template; `coarse`, swept
three slabs at a time. Inside the strip another ring triples the size along the outline, so that sizes triple in all
directions.

      outline  _C_S_T_F_F_F_F_F_T_S_C_      F fine block that follows the outline, its layers growing a little
                C S T T T T T T T S C       T triple ring: 3:1 along the outline (fine)
                C  S  S  S  S  S  S C       S strip: 3:1 along x
                C   C   C   C   C   C       C Gmsh's quads, graded to the coarse size (coarse)
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from geometry.meshing.hexmesh import MeshError
from geometry.meshing.section.curve import SectionCurve
from geometry.meshing.section.parts import SectionParts, SectionSizes
from geometry.meshing.section.remainder import Outline, fill_remainder
from geometry.meshing.section.rings import STRIP_MIDDLE, add_block, add_strip, add_triple_ring, ring_width
from geometry.meshing.section.smoothing import Smoother

FLAT_CORNER = 6.0  # badness from which on some corner is flat, or nearly


@dataclass(frozen=True)
class QuadSection:
    """The mesh of one section; nodes are shared by all its arrays.

    points : (n, 2) y, height [m];  fine (f, 4), coarse (c, 4): quads, anticlockwise
    strip : (t, 6) a, b, middle_a, middle_b, c, d: a-b on the fine side, c-d on the coarse side, middles on the
        crosspieces a-c, b-d
    on_curve : (k,) nodes on the outline, in its order;  curve_arc : (k,) their arc lengths [m]
    base : (b,) nodes on the base, both ends included;  smoother : the shapes that its plane quads should have
    badness : of the coarse quads' connections, over all sections (mesh_gmsh.badness); above FLAT_CORNER some corner is
        flat
    """

    points: np.ndarray
    fine: np.ndarray
    strip: np.ndarray
    coarse: np.ndarray
    on_curve: np.ndarray
    curve_arc: np.ndarray
    base: np.ndarray
    smoother: Smoother
    badness: float

    def plane_quads(self) -> np.ndarray:
        """All quads (k, 4) anticlockwise, each strip cell as one quad without its middle nodes."""
        return np.concatenate([self.fine, self.strip[:, [0, 4, 5, 1]], self.coarse])


def mesh_section(
    curve: SectionCurve, blocks: list[np.ndarray], sizes: SectionSizes, elsewhere: Sequence[Outline] = ()
) -> QuadSection:
    """Mesh the body under an outline, fine below the running bands.

    curve : outline, both ends at the same height (the base)
    blocks : for each fine block, left to right, the arc lengths [m] of its columns on the outline; with the triple ring
             its columns plus twice its layers are a multiple of 3
    elsewhere : where arc lengths (k,) of this outline go, (k, 2), on other sections that the mesh will be carried to
    Raises MeshError where the blocks and their rings do not fit on the outline, or Gmsh cannot fill the rest.
    """
    check_room(curve, [(columns[0], columns[-1]) for columns in blocks], ring_width(sizes))
    parts, loops = SectionParts(curve, sizes), []
    for columns in blocks:
        chain = add_block(parts, columns)
        if sizes.triple_ring:
            chain = add_triple_ring(parts, chain)
        loops.append(add_strip(parts, chain))
    parts.smooth(np.zeros(0, dtype=int), rounds=(1e-3,))
    base, badness = fill_remainder(parts, loops, elsewhere)
    smoother = parts.smooth(base, rounds=(0.1, 1e-2, 1e-3))
    points, strip = np.array(parts.points), parts.all_of("strip")
    on_curve = np.array(sorted(parts.arc, key=parts.arc.__getitem__))
    place_strip_middles(points, strip, on_curve)
    arcs = np.array([parts.arc[int(node)] for node in on_curve])
    return QuadSection(
        points, parts.all_of("fine"), strip, parts.all_of("coarse"), on_curve, arcs, base, smoother, badness
    )


def check_room(curve: SectionCurve, spans: list[tuple[float, float]], reach: float) -> None:
    """Raise MeshError where blocks on spans of the outline (arc lengths) with rings of width `reach` overlap or leave
    it; all in m."""
    starts, ends = [0.0] + [end + reach for _, end in spans], [start - reach for start, _ in spans] + [curve.length]
    if min(end - start for start, end in zip(starts, ends)) <= 0.2 * reach:
        millimetres = [(round(start * 1e3, 2), round(end * 1e3, 2)) for start, end in spans]
        raise MeshError(
            f"the fine blocks at {millimetres} mm (arc length) with {reach * 1e3:.2f} mm of transition at each side do"
            f" not fit on an outline of {curve.length * 1e3:.2f} mm; narrow or move the bands, or take smaller elements"
        )


def place_strip_middles(points: np.ndarray, strip: np.ndarray, on_curve: np.ndarray) -> None:
    """Put the strips' middle nodes on their crosspieces, in place: points (n, 2) or (s, n, 2); those on the outline
    stay."""
    crosspieces = np.concatenate([strip[:, [0, 2, 4]], strip[:, [1, 3, 5]]])
    crosspieces = crosspieces[~np.isin(crosspieces[:, 1], on_curve)]
    start, end = points[..., crosspieces[:, 0], :], points[..., crosspieces[:, 2], :]
    points[..., crosspieces[:, 1], :] = start + STRIP_MIDDLE * (end - start)
