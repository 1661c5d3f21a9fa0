"""The mesh quality report: exact on one cube and one sheared cell, exact volumes and gradients on any cell."""

import tracemalloc

import numpy as np
import pytest

from geometry.meshing.blocks import mesh_box
from geometry.meshing.cell_measures import cell_volume, eigen_length, face_area, mean_gradient, scaled_jacobian
from geometry.meshing.hexmesh import HexMesh, MeshError
from geometry.meshing.quality import check_shapes, mesh_quality
from tests.geometry.mesh_checks import REFERENCE, gauss_volume

WAVE = 6000.0


def one_cell(points) -> HexMesh:
    box = mesh_box((1.0, 1.0, 1.0), (1, 1, 1))
    cube = (REFERENCE + 1) / 2
    return HexMesh(
        np.asarray(points, float) if points is not None else cube,
        np.arange(8)[None],
        box.region,
        box.region_names,
        box.surface,
        box.surface_region,
        box.clamp,
    )


def test_numbers_of_a_cube_are_exact():
    edge = 2e-3
    quality = mesh_quality(one_cell((REFERENCE + 1) / 2 * edge), WAVE)
    assert quality.worst_scaled_jacobian == pytest.approx(1.0, rel=1e-14)
    assert quality.shortest_edge == pytest.approx(edge, rel=1e-14) and quality.longest_edge == pytest.approx(
        edge, rel=1e-14
    )
    assert quality.worst_length == pytest.approx(edge, rel=1e-13) and quality.worst_step == pytest.approx(
        edge / WAVE, rel=1e-13
    )
    # All three directions in phase: 2 / omega = h / c sqrt((1 - nu) / (1 + nu)) for the one-point cube with lumped
    # mass.
    assert quality.worst_eigen_step == pytest.approx(edge / WAVE * np.sqrt(0.7 / 1.3), rel=1e-12)
    assert quality.cost == pytest.approx(WAVE / edge, rel=1e-13)
    assert quality.slowest.tolist() == [0] and quality.slowest_aspect[0] == pytest.approx(1.0)
    assert quality.slowest_volume[0] == pytest.approx(edge**3, rel=1e-13)
    assert np.allclose(quality.slowest_centre[0], edge / 2) and np.allclose(quality.worst_scaled_jacobian_at, edge / 2)
    assert quality.counts == {"cells in box": 1, "nodes": 8, "surface quads": 1, "clamped nodes": 4}


@pytest.mark.parametrize("shear", [0.5, 1.0, 3.0])
def test_numbers_of_a_sheared_cube_are_exact(shear):
    """x moved by shear times z: volume 1; the faces across x have area sqrt(1 + shear^2), the steep edges that
    length."""
    points = (REFERENCE + 1) / 2
    points = points + shear * points[:, 2:] * [1.0, 0.0, 0.0]
    quality, long = mesh_quality(one_cell(points), WAVE), np.sqrt(1 + shear**2)
    assert cell_volume(points[None])[0] == pytest.approx(1.0, rel=1e-14)
    assert sorted(face_area(points[None])[0]) == pytest.approx([1, 1, 1, 1, long, long], rel=1e-14)
    assert quality.worst_scaled_jacobian == pytest.approx(1 / long, rel=1e-13)
    assert quality.worst_length == pytest.approx(1 / long, rel=1e-13)
    assert (quality.shortest_edge, quality.longest_edge) == pytest.approx((1.0, long), rel=1e-14)
    assert quality.slowest_aspect[0] == pytest.approx(long, rel=1e-14)
    assert quality.worst_eigen_step < quality.worst_step < 1 / WAVE


def test_report_shows_the_numbers_in_their_units():
    text = mesh_quality(one_cell((REFERENCE + 1) / 2 * 2e-3), WAVE).report()
    for shown in (
        "1 cells in box",
        "worst scaled Jacobian 1.000 at (1.0, 1.0, 1.0) mm",
        "edges 2.000 to 2.0 mm",
        "3.333e-07 s",
        "V / A_max = 2.000 mm",
        "wave speed 6000 m/s",
    ):
        assert shown in text


@pytest.mark.parametrize("seed", range(5))
def test_volume_and_mean_gradient_of_any_trilinear_cell(seed):
    """Volume against Gauss points, which are exact; the gradient against its definition: it sums to zero, reproduces
    linear fields exactly, and is the derivative of the volume (a cubic of one node's position, so differences of +-1
    are exact)."""
    random = np.random.default_rng(seed)
    corner = REFERENCE / 2 + random.uniform(-0.2, 0.2, (20, 8, 3))
    volume, gradient = cell_volume(corner), mean_gradient(corner)
    assert np.allclose(volume, gauss_volume(corner), rtol=1e-13)
    assert np.abs(gradient.sum(axis=1)).max() < 1e-13
    assert np.allclose(np.einsum("mia,mib->mab", corner, gradient), np.eye(3), atol=1e-13)
    for node, axis in ((0, 0), (3, 1), (6, 2)):
        moved = np.zeros((8, 3))
        moved[node, axis] = 1.0
        # linear in one coordinate of one node: a central difference of any step is exact
        assert np.allclose(
            (cell_volume(corner + moved) - cell_volume(corner - moved)) / 2,
            gradient[:, node, axis] * volume,
            atol=1e-12,
        )


def test_the_eigenvalue_bound_is_that_of_the_whole_strain_operator():
    """Largest eigenvalue of C (B B^T), 6 x 6 with shears, of any cells, by LAPACK."""
    corner = REFERENCE / 2 + np.random.default_rng(3).uniform(-0.2, 0.2, (50, 8, 3))
    ratio, gradient = 0.3 / 0.7, mean_gradient(corner)
    stiffness = np.diag([1 - ratio] * 3 + [(1 - ratio) / 2] * 3)
    stiffness[:3, :3] += ratio
    strain = np.zeros((len(corner), 6, 8, 3))
    for row, (i, j) in enumerate([(0, 0), (1, 1), (2, 2), (1, 2), (0, 2), (0, 1)]):
        strain[:, row, :, i] += gradient[:, :, j]
        if i != j:
            strain[:, row, :, j] += gradient[:, :, i]
    strain = strain.reshape(len(corner), 6, 24)
    largest = np.linalg.eigvals(stiffness @ strain @ strain.transpose(0, 2, 1)).real.max(axis=1)
    assert np.allclose(eigen_length(corner), 2 / np.sqrt(8 * largest), rtol=1e-12)


def test_turning_moving_and_stretching_a_cell_change_what_they_should():
    random = np.random.default_rng(7)
    corner = REFERENCE / 2 + random.uniform(-0.2, 0.2, (10, 8, 3))
    turn, _ = np.linalg.qr(random.standard_normal((3, 3)))
    turn *= np.sign(np.linalg.det(turn))
    moved = 3.0 * corner @ turn.T + [5.0, -2.0, 1.0]
    assert np.allclose(scaled_jacobian(moved), scaled_jacobian(corner), rtol=1e-11)
    assert np.allclose(cell_volume(moved), 27 * cell_volume(corner), rtol=1e-11)
    assert np.allclose(eigen_length(moved), 3 * eigen_length(corner), rtol=1e-10)


def test_flat_and_folded_cells_are_refused_with_body_place_and_remedy():
    points = (REFERENCE + 1) / 2 * 1e-3
    points[6] = points[0] + [1e-4, 1e-4, 1e-4]
    with pytest.raises(
        MeshError,
        match=r"the box's mesh has a folded or flat cell \(scaled Jacobian -?\d\.\d+\) at \(.*\) mm: take care",
    ):
        check_shapes(one_cell(points), "take care")
    check_shapes(one_cell((REFERENCE + 1) / 2), "take care")


@pytest.mark.parametrize("edge", [(0, 1), (3, 4), (5, 6), (6, 7), (7, 4)])
def test_a_cell_with_two_corners_in_one_place_is_refused(edge):
    points = (REFERENCE + 1) / 2
    points[edge[1]] = points[edge[0]]
    assert not scaled_jacobian(points[None])[0] > 0
    with pytest.raises(MeshError, match="folded or flat cell"):
        check_shapes(one_cell(points), "take care")


def test_judging_a_mesh_takes_little_beside_the_mesh():
    """Some cells at a time: of all at once 120 MB."""
    mesh = mesh_box((1.0, 1.0, 1.0), (40, 40, 40))
    tracemalloc.start()
    quality = mesh_quality(mesh, WAVE)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert quality.worst_length == pytest.approx(1 / 40, rel=1e-12) and peak < 25e6
