"""Hexahedra of a wheel's rim: the profile's section meshed once and swept about the axle over a sector at the bottom.

In a frame that moves with the wheel but does not spin, contact stays at the bottom: only a patch there need be fine.
"""

from dataclasses import dataclass

import numpy as np

from geometry.axes import WHEEL_DEPTH
from geometry.meshing.axis import graded_line
from geometry.meshing.band import column_count, lateral_columns, lateral_length
from geometry.meshing.gmsh_process import gmsh_process
from geometry.meshing.hexmesh import HexMesh, MeshError
from geometry.meshing.quality import check_shapes
from geometry.meshing.section.curve import cut_at_base
from geometry.meshing.section.parts import size_errors, try_sizes
from geometry.meshing.section.quads import check_room, mesh_section
from geometry.meshing.section.rings import depth_steps, longest_slab, ring_width
from geometry.meshing.sweep.sweep import sweep

# Of three slabs far from the patch, over the coarse size, and how they grow on the way: forces within 0.11 %, plastic
# strain within 0.05 % of 1 and 1.3, on a third fewer elements of the wheel (x = 250 to 430 mm, 1 mm)
FAR, GROWTH_ALONG = 2.0, 1.7
DEEPER_FROM = 0.105  # of a wheel, below its flange's tip, as of a crossing below its top [m]


@dataclass(frozen=True)
class WheelMeshSpec:
    """Mesh of a wheel's rim; lengths in m.

    element_size : fine size, the one number that sets the cost
    bands : lateral ranges (y0, y1) from D0 where the wheel touches, one or two, left to right
    fine_half_length : the patch is fine for |x| below this;  half_angle : of the sector [rad]
    rim_depth : height of the clamped inner rim above D0;  fine_depth : depth of the fine blocks
    coarse : largest element size in a section
    length : of the fine slabs along the circumference; None: element_size
    """

    element_size: float
    bands: tuple[tuple[float, float], ...] = ((-0.038, -0.014), (0.028, 0.052))
    fine_half_length: float = 0.025
    half_angle: float = np.radians(15)
    rim_depth: float = WHEEL_DEPTH
    fine_depth: float = 0.008
    coarse: float = 0.010
    length: float | None = None

    @property
    def slab(self) -> float:
        """Length of the fine slabs [m]."""
        return self.element_size if self.length is None else self.length


@gmsh_process()
def mesh_wheel(profile, radius: float, spec: WheelMeshSpec) -> HexMesh:
    """Mesh the bottom sector of a wheel's rim.

    profile : Profile or (n, 2) array, y from D0 and height z [m] (flange tip below 0), from the flange back to the
        field side
    radius : of the wheel at D0 [m]
    Points come with x = 0 at the axle, y from D0, z above the lowest point of D0's circle (axle at z = radius). One
    region "wheel"; surface is the profile's sweep, clamp the inner rim and the two cut faces. Nodes lie on the surface
    of revolution to round-off; between them the sagitta is size^2 / (8 radius).
    Raises MeshError where the spec does not fit the wheel.
    """
    check_wheel(radius, spec)
    curve, ends = _outline(np.asarray(getattr(profile, "points", profile), dtype=float), spec)
    angle = (arc_stations(radius, spec) / radius)[:, None]

    def make(sizes):
        section = mesh_section(curve, [_columns(curve, band, sizes) for band in spec.bands], sizes)
        rolling = (radius + section.points[:, 1])[None, :]
        lateral = np.broadcast_to(section.points[:, 0], (len(angle), len(section.points)))
        positions = np.stack([rolling * np.sin(angle), lateral, radius - rolling * np.cos(angle)], axis=-1)
        on_profile = (section.curve_arc > ends[0] - 1e-9) & (section.curve_arc < ends[1] + 1e-9)
        mesh = sweep(section, positions, "wheel", section.on_curve[on_profile], cut_ends_clamped=True)
        check_shapes(mesh, "move or narrow the bands, or change the element size")
        return mesh

    return try_sizes(make, spec.element_size, spec.fine_depth, spec.coarse, DEEPER_FROM)


def check_wheel_bands(profile, radius: float, spec: WheelMeshSpec) -> None:
    """What can be known before anything is meshed: raises the MeshError of `mesh_wheel` where a band is too narrow or
    too wide for the element size."""
    check_wheel(radius, spec)
    curve, _ = _outline(np.asarray(getattr(profile, "points", profile), dtype=float), spec)

    def lay(sizes):
        columns = [_columns(curve, band, sizes) for band in spec.bands]
        check_room(curve, [(line[0], line[-1]) for line in columns], ring_width(sizes))

    try_sizes(lay, spec.element_size, spec.fine_depth, spec.coarse, DEEPER_FROM)


def arc_stations(radius: float, spec: WheelMeshSpec) -> np.ndarray:
    """Arc lengths [m] along D0's circle of the planes between slabs: three slabs to a group, fine in the patch. Far
    from it slabs are longer than in a crossing, which is touched all along."""
    reach, fine = radius * spec.half_angle, (-spec.fine_half_length, spec.fine_half_length)
    longest = longest_slab(spec.element_size, spec.coarse, FAR)
    return graded_line(-reach, reach, fine, spec.slab, GROWTH_ALONG, longest, multiple=3)


def check_wheel(radius: float, spec: WheelMeshSpec) -> None:
    """Refuse what cannot be meshed; raises MeshError with every input error."""
    errors = size_errors(spec.element_size, spec.coarse, spec.fine_depth)
    if not spec.rim_depth < 0.9 * radius:
        errors.append(f"rim_depth {spec.rim_depth * 1e3:.1f} mm must be below 0.9 of the radius {radius * 1e3:.1f} mm")
    if not spec.fine_half_length <= radius * spec.half_angle or spec.half_angle > np.pi / 2:
        errors.append(
            f"fine_half_length {spec.fine_half_length * 1e3:.1f} mm must lie in the sector of"
            f" +-{np.degrees(spec.half_angle):.1f} degrees, and that within +-90"
        )
    if (
        not spec.bands
        or any(not start < end for start, end in spec.bands)
        or any(a[1] >= b[0] for a, b in zip(spec.bands, spec.bands[1:]))
    ):
        errors.append(f"bands {spec.bands} must be at least one range (y0, y1) with y0 < y1, in order and apart")
    if errors:
        raise MeshError("mesh of the wheel: " + "; ".join(errors))


def _outline(points, spec):
    """The section's outline with the body below (z turned over), and the arc lengths between which it is the
    profile."""
    turned = points * [1.0, -1.0]
    curve = cut_at_base(turned, -spec.rim_depth, "the wheel's profile")
    return curve, (curve.arc_of_index(0.0), curve.arc_of_index(len(points) - 1.0))


def _columns(curve, band, sizes):
    arcs = curve.band_arcs(band, "the wheel's band")
    width = lateral_length(curve, np.linspace(*arcs, 200))[-1:]
    multiple = 3 if sizes.triple_ring else 1
    count = column_count(width, sizes.fine, 2 * len(depth_steps(sizes)), multiple, "the wheel's band")
    start, end = arcs
    return lateral_columns(curve, start, end, count)
