"""Hexahedra of a crossing: one section of each body meshed, carried along x exactly on every section's outline."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from geometry.axes import RAIL_DEPTH
from geometry.meshing.axis import graded_line
from geometry.meshing.band import SIDEWAYS, column_count, lateral_columns, lateral_length, steady_band
from geometry.meshing.gmsh_process import gmsh_process
from geometry.meshing.hexmesh import FoldedCellError, HexMesh, MeshError, merge_bodies
from geometry.meshing.quality import check_shapes
from geometry.meshing.section.curve import cut_at_base
from geometry.meshing.section.parts import size_errors, try_sizes
from geometry.meshing.section.quads import FLAT_CORNER, check_room, mesh_section
from geometry.meshing.section.rings import depth_steps, longest_slab, ring_width
from geometry.meshing.sweep.carry import carry_section
from geometry.meshing.sweep.matching import feature_lengths, outline_arcs
from geometry.meshing.sweep.sweep import sweep

SAMPLES = 25  # sections at which the mesh of one is judged before it is carried to all
# positions in the design, one of which is meshed: early, as a nose changes most by its tip
REFERENCES = (0.15, 0.5, 0.85, 0.0, 0.3, 0.7, 1.0)
# of a body beyond its fine slabs, in fine sizes; what is shorter is left out: three slabs of it are as thin as foil,
# and lean by more than they are long where they meet one
LEAST_END = 0.5
Band = tuple[float, float] | Callable[[float], tuple[float, float]]


@dataclass(frozen=True)
class BodyMeshSpec:
    """What is meshed of one body (wing or nose), lengths in m.

    x_range : part of the crossing modelled;  fine_x : where the slabs have the fine length, inside x_range
    band : lateral range (y0, y1) where the wheel runs, constant or a function of x; fine there over fine_x
    fine_depth : depth of the fine block;  coarse : largest element size away from it
    anchor : a position on the body from which its slabs are counted, so that the mesh under the wheel does not hang on
        where x_range ends: they are exactly of the fine length, and fine_x grows by up to three of them at each end
    design_x : the sections that decide the block's columns and which section is meshed, around fine_x; None: those of
        fine_x
    """

    x_range: tuple[float, float]
    fine_x: tuple[float, float]
    band: Band
    fine_depth: float = 0.008
    coarse: float = 0.008
    anchor: float = 0.0
    design_x: tuple[float, float] | None = None

    def band_at(self, x: float) -> tuple[float, float]:
        """Band at x."""
        return self.band(float(x)) if callable(self.band) else self.band


@dataclass(frozen=True)
class CrossingMeshSpec:
    """Mesh of a crossing: element_size is the fine size, the one number that sets the cost. Lengths in m.

    wing, nose : what to mesh of each body, None to leave it out;  base : z of the plane where the bodies are clamped
    length : of the fine slabs along x; None: element_size
    """

    element_size: float
    wing: BodyMeshSpec | None = None
    nose: BodyMeshSpec | None = None
    base: float = -RAIL_DEPTH
    length: float | None = None

    @property
    def slab(self) -> float:
        """Length of the fine slabs [m]."""
        return self.element_size if self.length is None else self.length


@gmsh_process()
def mesh_crossing(crossing, spec: CrossingMeshSpec) -> HexMesh:
    """Mesh the wing and the nose of a crossing as separate blocks, each clamped at its base.

    crossing : has wing_section(x) and nose_section(x) -> (n, 2) y, z [m] (None where the body is not), the same feature
    at the same index for all x. Surface nodes lie on the sections' outlines to round-off at every station; between
    stations and nodes the faceting error is second order in the size.
    Raises MeshError where the spec does not fit the crossing, with position and sizes.
    """
    bodies = [
        (name, getattr(spec, name), getattr(crossing, f"{name}_section"))
        for name in ("wing", "nose")
        if getattr(spec, name) is not None
    ]
    if not bodies:
        raise MeshError("the crossing's mesh has neither wing nor nose; specify at least one")
    return merge_bodies([_mesh_body(name, body, section, spec) for name, body, section in bodies])


def check_bands(crossing, spec: CrossingMeshSpec) -> None:
    """What can be known before anything is meshed: raises the MeshError of `mesh_crossing` where a band is too narrow
    or too wide for the element size."""
    for name in ("wing", "nose"):
        body = getattr(spec, name)
        if body is None:
            continue
        check_body(name, body, spec)
        x = body_stations(body, spec).design
        curves = [_curve(getattr(crossing, f"{name}_section"), at, spec.base, name) for at in x]
        middle = len(x) // 2

        def lay(sizes):
            columns = _columns(name, body, x, curves, sizes)
            check_room(curves[middle], [(columns[middle][0], columns[middle][-1])], ring_width(sizes))

        try_sizes(lay, spec.element_size, body.fine_depth, body.coarse)


def _mesh_body(name, body, section_at, spec):
    check_body(name, body, spec)
    stations = body_stations(body, spec)
    curves = [
        [_curve(section_at, x, spec.base, name) for x in part]
        for part in (stations.before, stations.design, stations.after)
    ]

    errors = []
    for sideways in SIDEWAYS:

        def make(sizes):
            return _loft(name, body, stations, curves, sizes, sideways)

        try:
            return try_sizes(make, spec.element_size, body.fine_depth, body.coarse)
        except FoldedCellError as error:
            errors.append(error)
    raise errors[0]


@dataclass(frozen=True)
class Stations:
    """Positions x of the planes between slabs [m], three slabs to a group.

    design : (n,) fine slabs of the stretch that decides the mesh;
    first, last : those of them between which the body is modelled
    before, after : of the longer slabs on both sides of that
    """

    before: np.ndarray
    design: np.ndarray
    first: int
    last: int
    after: np.ndarray


def body_stations(body: BodyMeshSpec, spec: CrossingMeshSpec) -> Stations:
    """Fine over fine_x, longer outside; see BodyMeshSpec.anchor."""
    low, high = body.fine_x
    longest = longest_slab(spec.element_size, body.coarse)
    group = 3 * spec.slab
    wide = body.design_x or body.fine_x
    ends = [
        round_away((x - body.anchor) / group)
        for x, round_away in ((min(wide[0], low), _floor), (low, _floor), (high, _ceil), (max(wide[1], high), _ceil))
    ]
    design = body.anchor + spec.slab * np.arange(3 * ends[0], 3 * ends[3] + 1)
    first, last = 3 * (ends[1] - ends[0]), 3 * (ends[2] - ends[0])
    fine = (design[first], design[last])
    least = LEAST_END * spec.element_size
    low = body.x_range[0] if fine[0] - body.x_range[0] > least else fine[0]
    high = body.x_range[1] if body.x_range[1] - fine[1] > least else fine[1]
    line = graded_line(low, high, fine, spec.slab, coarse=longest, multiple=3)
    return Stations(line[line < fine[0] - 1e-9], design, first, last, line[line > fine[1] + 1e-9])


def _floor(groups: float) -> int:
    return int(np.floor(groups + 1e-6))


def _ceil(groups: float) -> int:
    return int(np.ceil(groups - 1e-6))


def _loft(name, body, stations, curves, sizes, sideways):
    before, design, after = curves
    columns = _columns(name, body, stations.design, design, sizes, sideways)
    reference, section = _reference_section(design, columns, sizes)
    first, last = stations.first, stations.last
    low, high = min(first, reference), max(last, reference)
    sides = [
        [_same_features(design[end], columns[end], curve) for curve in part]
        for end, part in ((first, before), (last, after))
    ]
    carried = [*before, *design[low : high + 1], *after]
    chain = _chain(len(before), len(after), first - low, reference - low, last - low, high - low + 1)
    lines = np.array([*sides[0], *columns[low : high + 1], *sides[1]])
    flat = carry_section(section, carried, lines, feature_lengths(design), chain, ring_width(sizes))
    n = len(before)
    flat = np.concatenate([flat[:n], flat[n + first - low : n + last - low + 1], flat[n + high - low + 1 :]])
    x = np.concatenate([stations.before, stations.design[first : last + 1], stations.after])
    positions = np.concatenate([np.broadcast_to(x[:, None, None], flat.shape[:2] + (1,)), flat], axis=2)
    mesh = sweep(section, positions, name)
    check_shapes(
        mesh,
        "the section changes too much along x_range; shorten it, move the band off a corner, or change the element"
        " size",
    )
    return mesh


def _chain(before, after, first, reference, last, count):
    """Which station each follows, of `before`, `count` and `after` ones in a row: from the reference outwards, the
    outer ones from first and last."""
    middle = [i + (i < reference) - (i > reference) for i in range(count)]
    return [
        *range(1, before),
        *([before + first] if before else []),
        *(before + i for i in middle),
        *([before + last] if after else []),
        *range(before + count, before + count + after - 1),
    ]


def check_body(name: str, body: BodyMeshSpec, spec: CrossingMeshSpec) -> None:
    """Refuse what cannot be meshed before any geometry is evaluated; raises MeshError."""
    if errors := size_errors(spec.element_size, body.coarse, body.fine_depth):
        raise MeshError(f"mesh of the {name}: " + "; ".join(errors))


def _curve(section_at, x, base, name):
    points = section_at(x)
    if points is None:
        raise MeshError(f"the {name} does not exist at x = {x * 1e3:.1f} mm; start its x_range where it does")
    return cut_at_base(points, base, f"{name} at x = {x * 1e3:.1f} mm")


def _columns(name, body, x, curves, sizes, sideways=SIDEWAYS[0]):
    """Arc lengths of the fine block's columns at the stations of the design: (stations, columns).

    sideways : slope of its edges at most, see steady_band
    """
    what = f"the {name}'s band"
    arcs = [curve.band_arcs(body.band_at(at), f"{what} at x = {at * 1e3:.1f} mm") for curve, at in zip(curves, x)]
    top = [curve.band_arcs((-np.inf, np.inf), what) for curve in curves]
    band, top = (np.array([curve.at(ends)[:, 0] for curve, ends in zip(curves, part)]) for part in (arcs, top))
    arcs = [curve.band_arcs(tuple(ends), what) for curve, ends in zip(curves, steady_band(x, band, top, sideways))]
    widths = np.array([lateral_length(curve, np.linspace(*ends, 200))[-1] for curve, ends in zip(curves, arcs)])
    count = column_count(widths, sizes.fine, 2 * len(depth_steps(sizes)), 3 if sizes.triple_ring else 1, what)
    return np.array([lateral_columns(curve, start, end, count) for curve, (start, end) in zip(curves, arcs)])


def _reference_section(curves, columns, sizes):
    """The station that is meshed and its mesh: the middle of the design, or another one if corners would be flat
    elsewhere."""
    found, errors = [], []
    for share in REFERENCES:
        station = int(share * (len(curves) - 1))
        try:
            section = mesh_section(
                curves[station], [columns[station]], sizes, _elsewhere(curves, columns, station, sizes)
            )
        except MeshError as error:
            errors.append(error)
            continue
        found.append((section.badness, station, section))
        if section.badness < FLAT_CORNER:
            break
    if not found:
        raise errors[0]
    return min(found, key=lambda trial: trial[0])[1:]


def _elsewhere(curves, columns, reference, sizes):
    """Where the reference outline's arc lengths go on some of the other sections."""
    features = feature_lengths(curves)

    def position(i):
        return lambda arcs: curves[i].at(
            outline_arcs(
                arcs, features, (curves[reference], columns[reference]), (curves[i], columns[i]), ring_width(sizes)
            )
        )

    return [position(i) for i in np.unique(np.linspace(0, len(curves) - 1, SAMPLES).round().astype(int))]


def _same_features(curve, arcs, other):
    """Arc lengths on another section of the features at `arcs` (k,) on `curve`: how the block goes on outside the fine
    range."""
    return np.interp(np.interp(arcs, curve.arc, curve.index), other.index, other.arc)
