"""Hexahedra of a wheel's rim against the surface of revolution: volume, surface, sizes, bad input."""

from dataclasses import replace

import numpy as np
import pytest

from geometry.meshing.cell_measures import cell_volume
from geometry.meshing.hexmesh import MeshError, boundary_faces
from geometry.meshing.quality import mesh_quality
from geometry.meshing.wheel import WheelMeshSpec, arc_stations, mesh_wheel
from geometry.profiles.wheel import wheel_profile
from tests.geometry.mesh_checks import check_mesh, hanging_facets

MM = 1e-3
RADIUS = 0.425
PROFILE = wheel_profile("P8")
SIZE = 4 * MM
SPEC = WheelMeshSpec(SIZE, bands=((-0.010, 0.014),), fine_half_length=18 * MM, half_angle=np.radians(12))


@pytest.fixture(scope="module")
def wheel():
    return mesh_wheel(PROFILE, RADIUS, SPEC)


def polar(points):
    """Angle from straight down, lateral position, distance from the axle of points (..., 3)."""
    x, y, z = np.moveaxis(points, -1, 0)
    return np.arctan2(x, RADIUS - z), y, np.hypot(x, RADIUS - z)


def test_mesh_is_valid_conforming_and_closed(wheel):
    check_mesh(wheel)
    assert wheel.region_names == ("wheel",)


def test_every_outer_face_is_on_profile_rim_or_cuts(wheel):
    """The surface is the profile's sweep; what else is outside is the inner rim, the two cuts and the upright sides of
    the rim, clamped at both ends: no face is left over inside."""
    angle, y, radius = polar(wheel.points)
    faces, _ = boundary_faces(wheel.cells)
    cuts = (np.abs(np.abs(angle[faces]) - SPEC.half_angle) < 1e-9).all(axis=1)
    rim = (np.abs(radius[faces] - RADIUS + SPEC.rim_depth) < 1e-9).all(axis=1)
    ends = PROFILE.points[[0, -1], 0]
    # one facet rounds the profile's end, from its last node on the profile to the first on the side
    on_profile = np.isin(faces, wheel.surface)
    sides = np.any([((np.abs(y[faces] - end) < 1e-9) | on_profile).all(axis=1) for end in ends], axis=0)
    surface = {frozenset(face) for face in wheel.surface.tolist()}
    known = cuts | rim | sides | np.array([frozenset(face) in surface for face in faces.tolist()])
    assert known.all() and not hanging_facets(wheel.points, faces).any()
    clamped = np.unique(faces[cuts | rim])
    assert np.array_equal(np.sort(wheel.clamp), clamped)


def test_surface_nodes_lie_on_the_surface_of_revolution(wheel):
    """The mesh takes the profile as drawn, a point every 0.1 mm: its chords are 0.1^2 / 8 R inside, R not below 13
    mm."""
    _, y, radius = polar(wheel.points[np.unique(wheel.surface)])
    tread = (y > -30 * MM) & (y < 55 * MM)
    assert tread.sum() > 100
    assert np.abs(radius[tread] - RADIUS + PROFILE.height(y[tread])).max() < (0.1 * MM) ** 2 / 8 / 0.013 + 1e-9


def test_facets_lie_within_their_sagitta_of_the_surface(wheel):
    """Two chords across each other: l^2 / 8 r along the circle, w^2 / 8 R across the tread, R not below 100 mm in the
    band (EN 13715)."""
    quad = wheel.points[wheel.surface]
    _, y, radius = polar(quad.mean(axis=1))
    extent = np.ptp(quad, axis=1)
    band = (y > SPEC.bands[0][0]) & (y < SPEC.bands[0][1])
    away = np.abs(radius - RADIUS + PROFILE.height(y))[band]
    along, across = np.hypot(extent[band, 0], extent[band, 2]), np.hypot(extent[band, 1], extent[band, 2])
    assert (away < along**2 / 8 / (RADIUS - 1 * MM) + across**2 / 8 / 0.1 + 1e-7).all()
    assert away.max() > 1e-7  # chords, not the surface itself


def test_volume_is_that_of_the_section_turned_about_the_axle(wheel):
    """A slab between planes d apart holds sin(d) times the section's first moment, sin(d) / d of the solid of
    revolution; where three slabs are one, sin(3 d) / 3 d. The section's moment is that of its end face, exactly."""
    angle, y, radius = polar(wheel.points)
    faces, _ = boundary_faces(wheel.cells)
    end = faces[(np.abs(angle[faces] - SPEC.half_angle) < 1e-9).all(axis=1)]
    moment = sum(_first_moment(y[face], radius[face]) for face in end)
    turned = 2 * SPEC.half_angle * moment
    volume = cell_volume(wheel.points[wheel.cells]).sum()
    widest = 3 * np.diff(arc_stations(RADIUS, SPEC)).max() / RADIUS
    # Sections inside a group have more nodes on the outline than the end face, so chords lie nearer to it: their area
    # counts too.
    nearer = 2 * SPEC.half_angle * RADIUS * _segments(y[wheel.surface], radius[wheel.surface])
    assert -(widest**2) / 6 * turned - nearer < volume - turned < nearer


def _first_moment(y, r):
    """Integral of r over a plane quad with corners (4,)."""
    following = np.roll(np.arange(4), -1)
    cross = y * r[following] - y[following] * r
    return abs(np.sum(cross * (r + r[following])) / 6)


def _segments(y, r):
    """Area of the outline's circular segments over one section's chords, at most: s^3 / 12 R, R at least 10 mm (flange
    tip)."""
    width = np.hypot(np.ptp(y, axis=1), np.ptp(r, axis=1)).max()
    return (PROFILE.points[-1, 0] - PROFILE.points[0, 0] + 0.15) / width * width**3 / 12 / 10e-3


def test_asked_size_is_found_in_the_patch_and_grades_away(wheel):
    quad = wheel.points[wheel.surface]
    centre, extent = quad.mean(axis=1), np.ptp(quad, axis=1)
    low, high = SPEC.bands[0]
    patch = (np.abs(centre[:, 0]) < SPEC.fine_half_length) & (centre[:, 1] > low) & (centre[:, 1] < high)
    slabs = 3 * round(2 * SPEC.fine_half_length / SIZE / 3)
    assert np.allclose(extent[patch, 0], 2 * SPEC.fine_half_length / slabs, rtol=1e-2)
    assert 0.75 * SIZE < extent[patch, 1].min() and extent[patch, 1].max() < 1.25 * SIZE
    corner = wheel.points[wheel.cells]
    _, y, radius = polar(corner.mean(axis=1))
    here = (np.abs(corner.mean(axis=1)[:, 0]) < 10 * MM) & (y > low) & (y < high)
    depth, volume = RADIUS - radius, cell_volume(corner)
    means = [
        volume[here & (depth > a) & (depth < b)].mean()
        for a, b in ((0.0, 8 * MM), (10 * MM, 25 * MM), (30 * MM, 60 * MM))
    ]
    assert means[0] < 1.6 * SIZE**3 and means[0] < means[1] < means[2]
    far = np.abs(centre[:, 0]) > 0.9 * RADIUS * np.sin(SPEC.half_angle)
    assert extent[far, 0].min() > 1.1 * SIZE


def test_two_bands_make_two_fine_patches():
    bands = (-0.036, -0.016), (0.026, 0.046)
    spec = WheelMeshSpec(5 * MM, bands=bands, fine_half_length=15 * MM, half_angle=np.radians(10))
    mesh = mesh_wheel(PROFILE, RADIUS, spec)
    check_mesh(mesh)
    quad = mesh.points[mesh.surface]
    centre, width = quad.mean(axis=1), np.ptp(quad, axis=1)[:, 1]
    for low, high in spec.bands:
        inside = (np.abs(centre[:, 0]) < 10 * MM) & (centre[:, 1] > low) & (centre[:, 1] < high)
        assert inside.any() and width[inside].max() < 1.3 * 5 * MM


def test_slabs_beyond_fine_ones_are_no_longer_than_their_ring_bears():
    """As on the rails: of 3.3 mm beside a ring of 0.6 mm its cells are flat (scaled Jacobian 0.064)."""
    fine = WheelMeshSpec(0.15 * MM, bands=((0.0, 2 * MM),), fine_half_length=MM, fine_depth=MM)
    assert mesh_quality(mesh_wheel(PROFILE, RADIUS, fine)).worst_scaled_jacobian > 0.15


@pytest.mark.parametrize(
    "radius, changes, message",
    [
        (
            RADIUS,
            {"element_size": 20 * MM},
            (r"coarse size 10.00 mm is below the element size 20.00 mm: take smaller elements"),
        ),
        (RADIUS, {"rim_depth": 0.4}, r"rim_depth 400.0 mm must be below 0.9 of the radius 425.0 mm"),
        (RADIUS, {"fine_half_length": 0.2}, r"fine_half_length 200.0 mm must lie in the sector of \+-12.0 degrees"),
        (RADIUS, {"half_angle": 2.0}, r"within \+-90"),
        (RADIUS, {"bands": ()}, "at least one range"),
        (RADIUS, {"bands": ((0.01, 0.0),)}, "y0 < y1"),
        (RADIUS, {"bands": ((-0.01, 0.01), (0.0, 0.02))}, "in order and apart"),
        (
            RADIUS,
            {"bands": ((0.10, 0.12),)},
            (
                r"the wheel's band from y = 100.00 to 120.00 mm is outside the section, which reaches from -70.00 to"
                r" 65.00 mm; move the band"
            ),
        ),
        (
            RADIUS,
            {"bands": ((0.0, 0.006),)},
            r"6.\d\d mm wide, under two elements of 4.00 mm; widen it or take smaller elements",
        ),
    ],
)
def test_bad_spec_is_refused_with_place_size_and_remedy(radius, changes, message):
    with pytest.raises(MeshError, match=message):
        mesh_wheel(PROFILE, radius, replace(SPEC, **changes))
