"""Hexahedra of an extruded rail, whose volume and surface are known, and of a crossing with wing and nose."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import trapezoid

from geometry.meshing.band import SIDEWAYS, lateral_columns
from geometry.meshing.cell_measures import cell_volume
from geometry.meshing.crossing_mesh import BodyMeshSpec, CrossingMeshSpec, mesh_crossing
from geometry.meshing.hexmesh import FoldedCellError, MeshError, boundary_faces
from geometry.meshing.quality import mesh_quality
from geometry.meshing.section.curve import cut_at_base
from geometry.meshing.section.parts import DEEPER, DEEPER_FROM
from geometry.profiles.rail import rail_head
from geometry.surfaces.crossing import CastCrossing, CrossingError
from tests.geometry.mesh_checks import check_mesh
from tests.order import assert_order

MM = 1e-3
HEAD = rail_head("56E1")
BASE = CrossingMeshSpec.base
BAND = (-8 * MM, 12 * MM)
FINE = (-15 * MM, 21 * MM)
RANGE = (-45 * MM, 60 * MM)


class StraightRail:
    """The same rail at all x: its wing; no nose."""

    def wing_section(self, x):
        return HEAD.points

    def nose_section(self, x):
        return None


def rail_spec(size, **changes):
    body = {"x_range": RANGE, "fine_x": FINE, "band": BAND, "anchor": FINE[0]} | changes
    return CrossingMeshSpec(size, wing=BodyMeshSpec(**body))


@pytest.fixture(scope="module", params=[4 * MM, 2 * MM], ids=["4 mm", "2 mm"])
def rail(request):
    return request.param, mesh_crossing(StraightRail(), rail_spec(request.param))


@pytest.fixture(scope="module")
def crossing():
    """Wing and nose where the wheel goes from one to the other."""
    bodies = {
        "wing": BodyMeshSpec((0.28, 0.37), (0.30, 0.35), (0.030, 0.046)),
        "nose": BodyMeshSpec((0.30, 0.40), (0.32, 0.38), lambda x: nose_band(x)),
    }
    return mesh_crossing(CastCrossing(10.75), CrossingMeshSpec(3 * MM, **bodies))


def nose_band(x):
    """The middle of the nose's top, no wider than 12 mm."""
    outline = CastCrossing(10.75).nose_section(x)
    head = outline[outline[:, 1] > outline[:, 1].max() - 3 * MM, 0]
    centre, half = (head.min() + head.max()) / 2, min(np.ptp(head) / 2, 6 * MM)
    return centre - half, centre + half


def outline_nodes(mesh, stations):
    """Outline nodes (k, 2) of sections at the given x, seen along x, from the left foot to the right one: y, z."""
    nodes = mesh.points[np.unique(mesh.surface)]
    nodes = np.unique(nodes[np.isin(nodes[:, 0], stations)][:, 1:].round(12), axis=0)
    return nodes[np.argsort(-np.arctan2(nodes[:, 1] - BASE, nodes[:, 0] - nodes[:, 0].mean()))]


def polygon_area(points):
    y, z = points.T
    return 0.5 * abs(np.dot(y, np.roll(z, -1)) - np.dot(z, np.roll(y, -1)))


def test_mesh_is_valid_conforming_and_closed(rail):
    check_mesh(rail[1])


def test_every_outer_face_is_on_outline_base_or_ends(rail):
    """Hanging facets would be left over: outer faces are those of the surface, the base and the two ends, and no
    others."""
    _, mesh = rail
    faces, _ = boundary_faces(mesh.cells)
    x, z = mesh.points[faces][..., 0], mesh.points[faces][..., 2]
    ends = (np.abs(x - RANGE[0]) < 1e-12).all(axis=1) | (np.abs(x - RANGE[1]) < 1e-12).all(axis=1)
    base = (np.abs(z - BASE) < 1e-12).all(axis=1)
    assert ends.sum() + base.sum() + len(mesh.surface) == len(faces)
    assert np.array_equal(np.sort(mesh.clamp), np.flatnonzero(np.abs(mesh.points[:, 2] - BASE) < 1e-12))


class FlatRail(StraightRail):
    """A rail of plane faces with sharp edges."""

    def wing_section(self, x):
        return np.array([[-35.0, -36.0], [-35.0, 0.0], [35.0, 0.0], [35.0, -36.0]]) * MM


def test_volume_of_a_rail_of_plane_faces_is_exact():
    mesh = mesh_crossing(FlatRail(), rail_spec(4 * MM))
    check_mesh(mesh)
    section = np.concatenate([[[-0.035, BASE]], FlatRail().wing_section(0.0), [[0.035, BASE]]])
    assert cell_volume(mesh.points[mesh.cells]).sum() == pytest.approx(
        polygon_area(section) * (RANGE[1] - RANGE[0]), rel=1e-12
    )


def test_volume_lacks_no_more_than_the_segments_over_its_chords(rail):
    """The first section has the longest chords, all sections seen along x the shortest: the volume lies between the two
    polygons. Both are short of the section by circular segments, s^3 / 12 R of each chord s at most, R not below the
    head's smallest, 12.7 mm."""
    _, mesh = rail
    length = RANGE[1] - RANGE[0]
    volume = cell_volume(mesh.points[mesh.cells]).sum()
    coarsest, finest = outline_nodes(mesh, RANGE[:1]), outline_nodes(mesh, mesh.points[:, 0])
    feet = np.array([[HEAD.points[0, 0], BASE], [HEAD.points[-1, 0], BASE]])
    section = polygon_area(np.concatenate([feet[:1], HEAD.points, feet[1:]]))
    assert polygon_area(coarsest) < volume / length < polygon_area(finest) < section
    chords = np.linalg.norm(np.diff(coarsest, axis=0), axis=1)
    assert section - volume / length < (chords**3).sum() / 12 / 12.7e-3


def test_surface_volume_lack_falls_with_the_second_power_of_the_size():
    """In the fine block alone, where columns are equal: the segments' area, from the exact head between the block's
    edges."""
    lacks, sizes = [], np.array([4 * MM, 2 * MM, 1 * MM])
    curve = cut_at_base(HEAD.points, BASE, "head")
    ends = curve.band_arcs(BAND, "band")
    smooth = curve.at(np.linspace(*ends, 20001))
    for size in sizes:
        nodes = curve.at(lateral_columns(curve, *ends, round((BAND[1] - BAND[0]) / size)))
        lacks.append(trapezoid(smooth[:, 1], smooth[:, 0]) - trapezoid(nodes[:, 1], nodes[:, 0]))
    assert_order(sizes, lacks, 2)


def test_surface_nodes_lie_on_the_section_and_chords_within_their_sagitta(rail):
    size, mesh = rail
    nodes = mesh.points[np.unique(mesh.surface)]
    on_head = nodes[np.abs(nodes[:, 1]) < 30 * MM]
    assert (
        np.abs(on_head[:, 2] - np.interp(on_head[:, 1], *HEAD.points[np.abs(HEAD.points[:, 1]) < 33 * MM].T)).max()
        < 1e-12
    )
    quad = mesh.points[mesh.surface]
    centre, width = quad.mean(axis=1), np.linalg.norm(np.ptp(quad[..., 1:], axis=1), axis=1)
    band = (centre[:, 1] > BAND[0]) & (centre[:, 1] < BAND[1])
    depth = HEAD.height(centre[band, 1]) - centre[band, 2]
    assert (depth > -1e-9).all()  # the head is convex: facets are inside
    assert (depth < width[band] ** 2 / 8 / 80e-3 * 1.02 + 1e-9).all()  # R is 305 and 80 mm in the band


def test_asked_size_is_found_under_the_band_and_grades_away(rail):
    """Within a quarter laterally, along x exact to a whole number of slabs in groups of three; below and beside it
    cells only grow."""
    size, mesh = rail
    quad = mesh.points[mesh.surface]
    centre, extent = quad.mean(axis=1), np.ptp(quad, axis=1)
    inside = (
        (centre[:, 0] > FINE[0])
        & (centre[:, 0] < FINE[1])
        & (centre[:, 1] > BAND[0] + size / 2)
        & (centre[:, 1] < BAND[1] - size / 2)
    )
    assert inside.any()
    slabs = 3 * max(1, round((FINE[1] - FINE[0]) / size / 3))
    assert np.allclose(extent[inside, 0], (FINE[1] - FINE[0]) / slabs)
    assert 0.75 * size < extent[inside, 1].min() and extent[inside, 1].max() < 1.25 * size
    corner = mesh.points[mesh.cells]
    cell, volume = corner.mean(axis=1), cell_volume(corner)
    middle = (np.abs(cell[:, 0] - 3 * MM) < 15 * MM) & (np.abs(cell[:, 1] - 2 * MM) < 5 * MM)
    levels = [
        volume[middle & (cell[:, 2] > -top) & (cell[:, 2] <= -top + depth)]
        for top, depth in ((8 * MM, 8 * MM), (20 * MM, 12 * MM), (55 * MM, 25 * MM))
    ]
    means = [level.mean() for level in levels]
    assert means[0] < 1.6 * size**3 and means[0] < means[1] < means[2]
    below = mesh.points[:, 2].max() - cell[:, 2]
    assert (np.ptp(corner, axis=1).max(axis=1) < 2.2 * (8 * MM + DEEPER * np.maximum(below - DEEPER_FROM, 0))).all()


def test_a_length_along_the_rail_changes_the_slabs_and_nothing_across():
    """Twice as long: half the slabs over the fine zone, the same section, volume to the chords."""
    spec = rail_spec(2 * MM, anchor=1 * MM)
    square = mesh_crossing(StraightRail(), spec)
    long = mesh_crossing(StraightRail(), replace(spec, length=4 * MM))
    check_mesh(long)
    fine = [np.unique(np.round(mesh.points[:, 0], 9)) for mesh in (square, long)]
    steps = [np.diff(x[(x > FINE[0] - 1e-6) & (x < FINE[1] + 1e-6)]) for x in fine]
    np.testing.assert_allclose(steps[0], 2 * MM, rtol=0.05)
    np.testing.assert_allclose(steps[1], 4 * MM, rtol=1e-9)
    sections = [mesh.points[np.isclose(mesh.points[:, 0], mesh.points[:, 0].min()), 1:] for mesh in (square, long)]
    np.testing.assert_allclose(*(np.sort(section, axis=0) for section in sections), atol=1e-9)


def test_a_body_that_ends_just_behind_its_fine_slabs_ends_with_them():
    """Three slabs in a third of a millimetre are foil: cells between three slabs and one lean by more than that."""
    low, high = 1 * MM - 36 * MM, 1 * MM + 36 * MM  # fine slabs of 4 mm, three to a group, counted from the anchor
    spec = rail_spec(
        4 * MM, anchor=1 * MM, fine_x=(low + 20 * MM, high - 2 * MM), x_range=(low - 10 * MM, high + 0.3 * MM)
    )
    mesh = mesh_crossing(StraightRail(), spec)
    check_mesh(mesh)
    assert mesh.points[:, 0].max() == pytest.approx(high) and mesh.points[:, 0].min() == pytest.approx(low - 10 * MM)
    assert mesh_quality(mesh).worst_scaled_jacobian > 0.3


def test_a_band_that_moves_to_and_fro_is_meshed_within_steadier_edges(monkeypatch):
    """As a contact point does that is hardly determined, on a surface as flat as the wheel: 3 mm from slab to slab.
    Edges that follow it fold cells between three slabs and one; the next slope allowed holds them steady, and lies
    further out."""
    unsteady = lambda x: tuple(np.array(BAND) + 3 * MM * (round(x / (2 * MM)) % 2))
    spec = replace(rail_spec(MM, band=unsteady, anchor=0.0), length=2 * MM)
    mesh = mesh_crossing(StraightRail(), spec)
    check_mesh(mesh)
    assert mesh_quality(mesh).worst_scaled_jacobian > 0.2
    monkeypatch.setattr("geometry.meshing.crossing_mesh.SIDEWAYS", SIDEWAYS[:1])
    with pytest.raises(FoldedCellError, match="folded or flat cell"):
        mesh_crossing(StraightRail(), spec)


def test_slabs_beyond_fine_ones_of_an_eighth_of_a_millimetre_are_no_longer_than_their_ring_bears():
    """The ring in which three of them become one is half a millimetre thick: slabs of 2.7 mm, a third of the coarse
    size, make its cells flat (scaled Jacobian 0.064)."""
    body = BodyMeshSpec((0.280, 0.360), (0.318, 0.3185), (0.039, 0.041), fine_depth=MM)
    mesh = mesh_crossing(CastCrossing(10.75), CrossingMeshSpec(MM / 8, wing=body))
    check_mesh(mesh)
    assert mesh_quality(mesh).worst_scaled_jacobian > 0.15


def test_wing_and_nose_are_bodies_of_their_own(crossing):
    check_mesh(crossing)
    assert crossing.region_names == ("wing", "nose")
    nodes = [set(crossing.cells[crossing.region == i].ravel().tolist()) for i in (0, 1)]
    assert not nodes[0] & nodes[1] and len(nodes[0]) + len(nodes[1]) == len(crossing.points)
    for name, body in (("wing", 0), ("nose", 1)):
        points = crossing.points[np.unique(crossing.surface[crossing.surface_region == body])]
        for x in np.unique(points[:, 0])[::4]:
            outline = getattr(CastCrossing(10.75), f"{name}_section")(x)
            here = points[points[:, 0] == x][:, 1:]
            assert _distance(here[here[:, 1] > BASE + MM], outline).max() < 1e-9, (name, x)
    assert mesh_quality(crossing).worst_scaled_jacobian >= 0.1


def _distance(points, polyline):
    """Distances (n,) of points (n, 2) to a polyline (k, 2), or to the upright lines below its ends."""
    polyline = np.concatenate([[[polyline[0, 0], -1.0]], polyline, [[polyline[-1, 0], -1.0]]])
    start, edge = polyline[:-1], np.diff(polyline, axis=0)
    length = np.maximum((edge**2).sum(axis=1), 1e-30)
    share = np.clip(np.einsum("nki,ki->nk", points[:, None] - start, edge) / length, 0, 1)
    return np.linalg.norm(points[:, None] - start - share[..., None] * edge, axis=2).min(axis=1)


@pytest.mark.parametrize(
    "size, changes, message",
    [
        (50 * MM, {}, r"coarse size 8.00 mm is below the element size 50.00 mm.*fine_depth 8.00 mm.*smaller elements"),
        (
            50 * MM,
            {"coarse": 0.1, "fine_depth": 0.1},
            r"band is 20.\d\d mm wide, under two elements of 50.00 mm; widen it or take smaller elements",
        ),
        (
            4 * MM,
            {"band": (0.05, 0.07)},
            (
                r"band at x = .* from y = 50.00 to 70.00 mm is outside the section, which reaches from -3\d.\d\d to"
                r" 3\d.\d\d mm; move the band"
            ),
        ),
        (4 * MM, {"band": (0.01, -0.01)}, "is empty; give"),
    ],
)
def test_bad_spec_is_refused_with_place_size_and_remedy(size, changes, message):
    with pytest.raises(MeshError, match=message):
        mesh_crossing(StraightRail(), rail_spec(size, **changes))


def test_blocks_with_no_room_for_their_transition_are_refused():
    spec = CrossingMeshSpec(4 * MM, wing=BodyMeshSpec(RANGE, FINE, (-30 * MM, 30 * MM)), base=-3 * MM)
    with pytest.raises(
        MeshError,
        match=(
            r"with 12.00 mm of transition at each side do not fit on an outline of \d+.\d\d mm; narrow or move the"
            r" bands, or take smaller elements"
        ),
    ):
        mesh_crossing(StraightRail(), spec)


def test_an_empty_crossing_is_refused():
    with pytest.raises(MeshError, match="neither wing nor nose; specify at least one"):
        mesh_crossing(StraightRail(), CrossingMeshSpec(4 * MM))


def test_base_above_the_rail_is_refused():
    with pytest.raises(
        MeshError,
        match=(
            r"wing at x = -45.0 mm: the section's top at z = 0.00 mm is not above the base at 10.00 mm; lower the base"
        ),
    ):
        mesh_crossing(StraightRail(), CrossingMeshSpec(4 * MM, wing=BodyMeshSpec(RANGE, FINE, BAND), base=10 * MM))


def test_window_outside_the_crossing_is_refused_with_its_limits():
    crossing = CastCrossing(10.75)
    low, high = crossing.x_range
    spec = BodyMeshSpec((high - 0.05, high + 0.1), (high - 0.02, high + 0.05), (0.0, 0.02))
    with pytest.raises(
        CrossingError, match=rf"x = .* m is outside the modelled crossing 1:10.75, {low:g} to {high:g} m"
    ):
        mesh_crossing(crossing, CrossingMeshSpec(3 * MM, wing=spec))


def test_nose_where_there_is_none_is_refused():
    with pytest.raises(MeshError, match=r"the nose does not exist at x = -200.0 mm; start its x_range where it does"):
        mesh_crossing(
            CastCrossing(10.75), CrossingMeshSpec(3 * MM, nose=BodyMeshSpec((-0.2, -0.1), (-0.18, -0.12), (0.0, 0.02)))
        )
