"""Topology of hexahedra: boundary, orientation, bodies put together."""

import dataclasses
import tracemalloc

import numpy as np
import pytest

from geometry.meshing.blocks import cap_height, mesh_box, mesh_cap
from geometry.meshing.cell_measures import cell_volume, scaled_jacobian
from geometry.meshing.hexmesh import MeshError, boundary_faces, merge_bodies, orient
from tests.geometry.mesh_checks import check_mesh, hanging_facets


@pytest.mark.parametrize("counts", [(1, 1, 1), (3, 2, 4)])
def test_boundary_of_a_box_is_its_six_sides(counts):
    mesh = mesh_box((1.0, 2.0, 3.0), counts)
    check_mesh(mesh)
    nx, ny, nz = counts
    faces, owner = boundary_faces(mesh.cells)
    assert len(faces) == 2 * (nx * ny + ny * nz + nz * nx)
    p = mesh.points[faces]
    area = 0.5 * np.cross(p[:, 2] - p[:, 0], p[:, 3] - p[:, 1])
    assert np.linalg.norm(area, axis=1).sum() == pytest.approx(22.0, rel=1e-13)
    away = p.mean(axis=1) - mesh.points[mesh.cells[owner]].mean(axis=1)
    assert (np.einsum("ij,ij->i", area, away) > 0).all()  # outward of the cell that owns it
    assert cell_volume(mesh.points[mesh.cells]).sum() == pytest.approx(6.0, rel=1e-13)
    assert (mesh.points[mesh.surface][..., 2] == 3.0).all() and (mesh.points[mesh.clamp][:, 2] == 0.0).all()


def test_face_of_three_cells_is_refused_with_its_nodes():
    cell = mesh_box((1.0, 1.0, 1.0), (1, 1, 1)).cells
    with pytest.raises(MeshError, match=r"face \[.*\] of cell \d belongs to 3 cells; at most 2"):
        boundary_faces(np.concatenate([cell, cell, cell]))


def test_faces_of_a_body_are_found_in_little_memory():
    """The figures of a fine run were its peak: 700 bytes a cell."""
    cells = mesh_box((1.0, 1.0, 1.0), (20, 20, 20)).cells
    tracemalloc.start()
    boundary_faces(cells)
    assert tracemalloc.get_traced_memory()[1] < 450 * len(cells)
    tracemalloc.stop()


def test_a_hanging_facet_is_seen_by_the_check_of_these_tests():
    """Two half cells on one whole cell, nodes shared where they meet: three faces inside the body, which no two cells
    share."""
    whole, halves = mesh_box((1.0, 1.0, 1.0), (1, 1, 1)), mesh_box((1.0, 1.0, 1.0), (2, 1, 1))
    points, number = np.unique(
        np.concatenate([whole.points, halves.points + [0, 0, 1.0]]).round(9), axis=0, return_inverse=True
    )
    faces, _ = boundary_faces(number.ravel()[np.concatenate([whole.cells, halves.cells + 8])])
    assert hanging_facets(points, faces).sum() == 3
    faces, _ = boundary_faces(halves.cells)
    assert not hanging_facets(halves.points, faces).any()


def test_mirrored_cells_are_turned_and_right_ones_left():
    mesh = mesh_box((1.0, 1.0, 1.0), (2, 2, 2))
    mixed = mesh.cells.copy()
    mixed[::2] = mixed[::2][:, [4, 5, 6, 7, 0, 1, 2, 3]]
    turned = orient(mesh.points, mixed)
    assert (scaled_jacobian(mesh.points[mixed]) < 0).any()
    assert np.array_equal(turned, mesh.cells)
    assert np.allclose(scaled_jacobian(mesh.points[turned]), 1.0)


def test_bodies_put_together_keep_points_sets_and_names():
    one, two = mesh_box((1.0, 1.0, 1.0), (2, 1, 1), name="a"), mesh_box((1.0, 1.0, 2.0), (1, 1, 3), name="b")
    both = merge_bodies([one, dataclasses.replace(two, points=two.points + [0, 0, 5.0])])
    check_mesh(both)
    assert both.region_names == ("a", "b")
    assert np.array_equal(both.region, [0, 0, 1, 1, 1]) and np.array_equal(both.surface_region, [0, 0, 1])
    assert (both.points[both.surface[both.surface_region == 1]][..., 2] == 7.0).all()
    assert not set(both.cells[both.region == 0].ravel()) & set(both.cells[both.region == 1].ravel())


def test_names_asked_for_number_the_bodies_also_those_that_are_not_there():
    wheel, nose = mesh_box((1.0, 1.0, 1.0), (2, 1, 1), name="wheel"), mesh_box((1.0, 1.0, 1.0), (1, 1, 1), name="nose")
    both = merge_bodies([nose, wheel], ("wing", "nose", "wheel"))
    assert both.region_names == ("wing", "nose", "wheel")
    assert np.array_equal(both.region, [1, 2, 2]) and np.array_equal(both.surface_region, [1, 2, 2])
    assert both.region.dtype == both.surface_region.dtype == np.int8
    with pytest.raises(MeshError, match="not all among the region names .* add the missing"):
        merge_bodies([nose, wheel], ("nose",))


def test_two_bodies_of_one_name_are_refused():
    box = mesh_box((1.0, 1.0, 1.0), (1, 1, 1))
    with pytest.raises(MeshError, match="two have the same name; give each its own"):
        merge_bodies([box, box])


@pytest.mark.parametrize("facing", ["down", "up"])
@pytest.mark.parametrize("radii", [(0.4, 0.3), (0.4, np.inf)])
def test_cap_lies_on_its_exact_surface(facing, radii):
    sign = 1 if facing == "down" else -1
    mesh = mesh_cap(*radii, (0.02, 0.02), 0.02, 2e-3, (4e-3, 4e-3, 4e-3), facing=facing)
    check_mesh(mesh)
    x, y, z = mesh.points[np.unique(mesh.surface)].T
    assert np.abs(sign * z - cap_height(x, y, *radii)).max() < 1e-15
    p = mesh.points[mesh.surface]
    # outward: down where the cap faces down
    assert (sign * np.cross(p[:, 2] - p[:, 0], p[:, 3] - p[:, 1])[:, 2] < 0).all()
    assert np.allclose(mesh.points[mesh.clamp][:, 2], sign * 0.02)


@pytest.mark.parametrize(
    "make, message",
    [
        (lambda: mesh_cap(0.4, 0.4, (0.02, 0.02), 0.02, 0.0, (4e-3,) * 3), "size 0.0 m must be positive"),
        (lambda: mesh_cap(0.4, 0.4, (0.02, 0.02), 0.02, 2e-3, (0.03,) * 3), "must be ordered and lie in the range"),
        (
            lambda: mesh_cap(0.02, 0.02, (0.03, 0.03), 0.05, 2e-3, (4e-3,) * 3),
            "outside the ellipsoid.*narrow the block",
        ),
        (
            lambda: mesh_cap(0.02, 0.02, (0.013, 0.013), 0.01, 2e-3, (4e-3,) * 3),
            "over 0.8 of its height.*narrow or raise",
        ),
        (lambda: mesh_cap(0.4, 0.4, (0.02, 0.02), 0.02, -2e-3, (4e-3,) * 3), "size -0.002 m must be positive"),
    ],
)
def test_block_that_cannot_be_is_refused_with_the_remedy(make, message):
    with pytest.raises(MeshError, match=message):
        make()
