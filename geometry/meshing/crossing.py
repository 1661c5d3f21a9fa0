"""Hexahedra of a crossing: one section of each body meshed, carried along x exactly on every section's outline."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from geometry.meshing.hexmesh import HexMesh, MeshError, merge_bodies
from geometry.meshing.axis import graded_line
from geometry.meshing.band import column_count, lateral_columns, lateral_length, steady_band
from geometry.meshing.sweep.carry import carry_section
from geometry.meshing.section.curve import cut_at_base
from geometry.meshing.sweep.matching import feature_lengths, outline_arcs
from geometry.meshing.quality import check_shapes
from geometry.meshing.section.parts import try_sizes
from geometry.meshing.section.rings import depth_steps, ring_width
from geometry.meshing.section.quads import FLAT_CORNER, mesh_section
from geometry.meshing.sweep.sweep import sweep

SAMPLES = 25  # sections at which the mesh of one is judged before it is carried to all
REFERENCES = (0.5, 0.15, 0.85, 0.0, 0.3, 0.7, 1.0)  # places in the fine range, one of which is meshed
Band = tuple[float, float] | Callable[[float], tuple[float, float]]


@dataclass(frozen=True)
class BodyMeshSpec:
    """What is meshed of one body (wing or nose), lengths in m.

    x_range : part of the crossing modelled;  fine_x : where the slabs have the fine length, inside x_range
    band : lateral range (y0, y1) where the wheel runs, constant or a function of x; fine there over fine_x
    fine_depth : depth of the fine block;  coarse : largest element size away from it
    """

    x_range: tuple[float, float]
    fine_x: tuple[float, float]
    band: Band
    fine_depth: float = 0.008
    coarse: float = 0.008

    def band_at(self, x: float) -> tuple[float, float]:
        """Band at x."""
        return self.band(float(x)) if callable(self.band) else self.band


@dataclass(frozen=True)
class CrossingMeshSpec:
    """Mesh of a crossing: element_size is the fine size, the one number that sets the cost. Lengths in m.

    wing, nose : what to mesh of each body, None to leave it out;  base : z of the plane where the bodies are clamped
    growth : ratio of neighbouring sizes away from the fine zone
    """

    element_size: float
    wing: BodyMeshSpec | None = None
    nose: BodyMeshSpec | None = None
    base: float = -0.055
    growth: float = 1.3


def mesh_crossing(crossing, spec: CrossingMeshSpec) -> HexMesh:
    """Mesh the wing and the nose of a crossing as separate blocks, each clamped at its base.

    crossing : has wing_section(x) and nose_section(x) -> (n, 2) y, z [m] (None where the body is not), the same feature
    at the same index for all x. Surface nodes lie on the sections' outlines to round-off at every station; between
    stations and nodes the faceting error is second order in the size.
    Raises MeshError where the spec does not fit the crossing, with place and sizes.
    """
    bodies = [(name, getattr(spec, name), getattr(crossing, f"{name}_section")) for name in ("wing", "nose") if getattr(spec, name) is not None]
    if not bodies:
        raise MeshError("the crossing's mesh has neither wing nor nose; specify at least one")
    return merge_bodies([_mesh_body(name, body, section, spec) for name, body, section in bodies])


def _mesh_body(name, body, section_at, spec):
    check_body(name, body, spec)
    x = body_stations(body, spec)
    curves = [_curve(section_at, station, spec.base, name) for station in x]

    def make(sizes):
        return _loft(name, body, x, curves, sizes)

    return try_sizes(make, spec.element_size, body.fine_depth, body.coarse, spec.growth)


def body_stations(body: BodyMeshSpec, spec: CrossingMeshSpec) -> np.ndarray:
    """Places x of the planes between slabs [m]: three slabs to a group, fine over fine_x, longer outside."""
    return graded_line(*body.x_range, body.fine_x, spec.element_size, spec.growth, body.coarse / 3, multiple=3)


def _loft(name, body, x, curves, sizes):
    fine = np.flatnonzero((x > body.fine_x[0] - 1e-9) & (x < body.fine_x[1] + 1e-9))
    columns = _columns(name, body, x, curves, fine, sizes)
    reference, section = _reference_section(curves, columns, fine, sizes)
    flat = carry_section(section, curves, columns, reference, ring_width(sizes))
    positions = np.concatenate([np.broadcast_to(x[:, None, None], flat.shape[:2] + (1,)), flat], axis=2)
    mesh = sweep(section, positions, name)
    check_shapes(mesh, "the section changes too much along x_range; shorten it, move the band off a corner, or change the element size")
    return mesh


def check_body(name: str, body: BodyMeshSpec, spec: CrossingMeshSpec) -> None:
    """Refuse what cannot be meshed before any geometry is evaluated; raises MeshError."""
    faults = []
    numbers = [spec.element_size, spec.base, spec.growth, body.fine_depth, body.coarse, *body.x_range, *body.fine_x]
    if not np.isfinite(numbers).all():
        faults.append(f"all lengths must be finite numbers, these are {numbers}")
    elif not spec.element_size > 0:
        faults.append(f"element_size {spec.element_size} m must be positive")
    else:
        if not body.x_range[0] <= body.fine_x[0] < body.fine_x[1] <= body.x_range[1]:
            faults.append(f"fine_x {body.fine_x} m must be a range inside x_range {body.x_range} m")
        if body.coarse < spec.element_size:
            faults.append(f"coarse size {body.coarse * 1e3:.2f} mm is below the element size {spec.element_size * 1e3:.2f} mm: take smaller elements or a larger coarse size")
        if body.fine_depth < spec.element_size:
            faults.append(f"fine_depth {body.fine_depth * 1e3:.2f} mm is below the element size {spec.element_size * 1e3:.2f} mm: take smaller elements or a deeper fine zone")
        if not 1.05 <= spec.growth <= 3:
            faults.append(f"growth {spec.growth} is outside [1.05, 3]")
    if faults:
        raise MeshError(f"mesh of the {name}: " + "; ".join(faults))


def _curve(section_at, x, base, name):
    points = section_at(x)
    if points is None:
        raise MeshError(f"the {name} does not exist at x = {x * 1e3:.1f} mm; start its x_range where it does")
    return cut_at_base(points, base, f"{name} at x = {x * 1e3:.1f} mm")


def _columns(name, body, x, curves, fine, sizes):
    """Arc lengths of the fine block's columns at every station: (stations, columns)."""
    what = f"the {name}'s band"
    arcs = [curves[i].band_arcs(body.band_at(x[i]), f"{what} at x = {x[i] * 1e3:.1f} mm") for i in fine]
    top = [curves[i].band_arcs((-np.inf, np.inf), what) for i in fine]
    band, top = (np.array([curves[i].at(ends)[:, 0] for i, ends in zip(fine, part)]) for part in (arcs, top))
    arcs = [curves[i].band_arcs(tuple(ends), what) for i, ends in zip(fine, steady_band(x[fine], band, top))]
    widths = np.array([lateral_length(curves[i], np.linspace(*ends, 200))[-1] for i, ends in zip(fine, arcs)])
    count = column_count(widths, sizes.fine, 2 * len(depth_steps(sizes)), 3 if sizes.triple_ring else 1, what)
    columns = np.array([lateral_columns(curves[i], *ends, count) for i, ends in zip(fine, arcs)])
    before, after = ([_same_features(curves[end], column, curve) for curve in part]
                     for end, column, part in ((fine[0], columns[0], curves[:fine[0]]), (fine[-1], columns[-1], curves[fine[-1] + 1:])))
    return np.array([*before, *columns, *after])


def _reference_section(curves, columns, fine, sizes):
    """The station that is meshed and its mesh: the middle of the fine range, or another one if corners would be flat elsewhere."""
    found, faults = [], []
    for share in REFERENCES:
        station = fine[int(share * (len(fine) - 1))]
        try:
            section = mesh_section(curves[station], [columns[station]], sizes, _elsewhere(curves, columns, station, sizes))
        except MeshError as fault:
            faults.append(fault)
            continue
        found.append((section.badness, station, section))
        if section.badness < FLAT_CORNER:
            break
    if not found:
        raise faults[0]
    return min(found, key=lambda trial: trial[0])[1:]


def _elsewhere(curves, columns, reference, sizes):
    """Where the reference outline's arc lengths go on some of the other sections."""
    features = feature_lengths(curves)

    def place(i):
        return lambda arcs: curves[i].at(outline_arcs(arcs, features, (curves[reference], columns[reference]), (curves[i], columns[i]), ring_width(sizes)))

    return [place(i) for i in np.unique(np.linspace(0, len(curves) - 1, SAMPLES).round().astype(int))]


def _same_features(curve, arcs, other):
    """Arc lengths on another section of the features at `arcs` (k,) on `curve`: how the block goes on outside the fine range."""
    return np.interp(np.interp(arcs, curve.arc, curve.index), other.index, other.arc)
