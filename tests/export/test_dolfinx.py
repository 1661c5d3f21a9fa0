"""A run folder as dolfinx knows it: every node, cell, face and value where it was."""

import numpy as np
import pytest
import ufl
from mpi4py import MPI
from dolfinx import fem

import rail_fem
from geometry.axes import as_tensor
from geometry.meshing.hexmesh import boundary_faces, find_rows
from rail_fem.export.files import ExportError
from rail_fem.export.tagged import CELL_TAGS, FACET_TAGS
from rail_fem.export.to_dolfinx import write_by_dolfinx
from rail_fem.fe.compat import discontinuous, geometry_dofmap, original_cells
from rail_fem.fe.domain import VTK_TO_DOLFINX
from rail_fem.fe.hexahedron import volumes
from rail_fem.result.fields import FieldsError
from tests.export.folder import OFFSET, SIDES, bend, write_run
from tests.ranks import printed_by_ranks


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("run")


@pytest.fixture(scope="module")
def written(folder):
    mesh, cells = write_run(folder)
    mesh.points[np.unique(mesh.cells[mesh.region == 2]), 0] += OFFSET
    return mesh, cells


@pytest.fixture(scope="module")
def found(folder, written):
    return rail_fem.export_dolfinx(folder, MPI.COMM_SELF)


def in_each_cell(form) -> np.ndarray:
    """Integrals over each cell, from a form with the test function of cell constants."""
    vector = fem.assemble_vector(fem.form(form))
    return np.asarray(vector.array if hasattr(vector, "array") else vector)


def test_hexahedra_have_the_corners_that_the_run_gave_them_in_dolfinx_order(found, written):
    mesh, _ = written
    inputs = np.asarray(found.mesh.geometry.input_global_indices)[geometry_dofmap(found.mesh)]
    assert np.array_equal(inputs, mesh.cells[original_cells(found.mesh)][:, VTK_TO_DOLFINX])
    assert np.array_equal(found.mesh.geometry.x[geometry_dofmap(found.mesh)], mesh.points[inputs])


def test_volumes_by_ufl_are_those_of_the_element_kernel(found, written):
    """A wrong order of corners folds the cell and changes its volume; quadrature of degree 5 is exact here."""
    mesh, _ = written
    test = ufl.TestFunction(discontinuous(found.mesh, 0))
    by_form = in_each_cell(test * ufl.dx(metadata={"quadrature_degree": 5}))
    exact = volumes(np.ascontiguousarray(mesh.points).ravel(), mesh.cells)[original_cells(found.mesh)]
    assert np.abs(by_form / exact - 1).max() < 1e-13
    for body, tag in CELL_TAGS.items():
        mine = found.cell_tags.indices[found.cell_tags.values == tag]
        assert by_form[mine].sum() == pytest.approx(np.prod(SIDES[body]), rel=1e-13)


def test_an_affine_displacement_has_its_gradient_everywhere(tmp_path):
    """Nodal values at the wrong corner would bend it."""
    slope = np.array([[1.0, 2.0, -1.0], [0.5, -1.5, 1.0], [-2.0, 0.3, 0.7]]) * 1e-4
    write_run(tmp_path, lambda points: points @ slope.T)
    found = rail_fem.export_dolfinx(tmp_path, MPI.COMM_SELF)
    away = ufl.grad(found.displacement) - ufl.as_matrix(slope.tolist())
    test = ufl.TestFunction(discontinuous(found.mesh, 0))
    squares = in_each_cell(test * ufl.inner(away, away) * ufl.dx(metadata={"quadrature_degree": 4}))
    assert np.sqrt(squares.max()) < 1e-13 * np.abs(slope).max() * 1e2  # coordinates of up to 6 m


def test_fields_stand_in_their_cells_and_at_their_nodes(found, written):
    """By dolfinx's own evaluation at the cells' centres, not by the arrays that were filled."""
    mesh, rows = written
    source = original_cells(found.mesh)
    centres, cells = mesh.points[mesh.cells[source]].mean(axis=1), np.arange(len(source), dtype=np.int32)
    stress = found.stress.eval(centres, cells).reshape(-1, 3, 3)
    assert np.array_equal(stress, as_tensor(rows[source, :6]))
    assert np.array_equal(found.plastic_strain.eval(centres, cells).ravel(), rows[source, 6])
    assert (rows[:, 6] > 0).mean() > 0.5 and np.ptp(rows[:, 6]) > 0
    moved = bend(
        mesh.points - [OFFSET, 0, 0] * np.isin(np.arange(len(mesh.points)), mesh.cells[mesh.region == 2])[:, None]
    )
    mean = found.displacement.eval(centres, cells)  # the trilinear map's centre: the mean of the corners
    assert np.abs(mean - moved[mesh.cells[source]].mean(axis=1)).max() < 1e-15


def test_contact_surfaces_and_bases_are_tagged_with_their_areas(found):
    """The boxes' tops and bottoms are planes, so their areas are whole numbers of m2."""
    ds = ufl.Measure("ds", domain=found.mesh, subdomain_data=found.facet_tags)
    test = ufl.TestFunction(discontinuous(found.mesh, 0))
    for name, tag in FACET_TAGS.items():
        nx, ny, _ = SIDES[name.split()[0]]
        assert found.facet(name) == tag
        assert in_each_cell(test * ds(tag)).sum() == pytest.approx(nx * ny, rel=1e-13)


def test_outward_normals_of_the_contact_surfaces_point_up_and_the_wheels_down(found):
    ds = ufl.Measure("ds", domain=found.mesh, subdomain_data=found.facet_tags)
    test = ufl.TestFunction(discontinuous(found.mesh, 0))
    flux = test * ufl.FacetNormal(found.mesh)[2]
    assert in_each_cell(flux * ds(11) + flux * ds(13)).sum() == pytest.approx(6 - 6, abs=1e-12)
    assert in_each_cell(flux * ds(11) + flux * ds(12)).sum() == pytest.approx(6 + 4, rel=1e-13)


def test_the_deformed_mesh_is_moved_by_the_displacement(folder, found, written):
    moved = rail_fem.export_dolfinx(folder, MPI.COMM_SELF, deformed=True)
    nodes = np.argsort(np.asarray(found.mesh.geometry.input_global_indices))
    others = np.argsort(np.asarray(moved.mesh.geometry.input_global_indices))
    shift = moved.mesh.geometry.x[others] - found.mesh.geometry.x[nodes]
    mesh, _ = written
    start = mesh.points.copy()
    start[np.unique(mesh.cells[mesh.region == 2]), 0] -= OFFSET
    assert np.abs(shift - bend(start)).max() < 1e-14


JOB = """
import sys, numpy as np, ufl, rail_fem
from dolfinx import fem
from mpi4py import MPI
found = rail_fem.export_dolfinx(sys.argv[1])
dx = ufl.Measure("dx", domain=found.mesh, subdomain_data=found.cell_tags, metadata={"quadrature_degree": 5})
ds = ufl.Measure("ds", domain=found.mesh, subdomain_data=found.facet_tags)
work = found.plastic_strain + 1e-9 * found.stress[0, 1] + 1e3 * found.displacement[2]
forms = [work * dx(2), work * ds(11), work * ds(23)]
values = [MPI.COMM_WORLD.allreduce(fem.assemble_scalar(fem.form(form))) for form in forms]
if MPI.COMM_WORLD.rank == 0:
    print([float(value) for value in values], flush=True)
"""


@pytest.mark.mpi
def test_integrals_do_not_depend_on_the_number_of_ranks(folder, written, tmp_path):
    (tmp_path / "job.py").write_text(JOB)
    values = []
    for ranks in (1, 3):
        printed = printed_by_ranks(ranks, tmp_path / "job.py", folder)
        line = next(line for line in printed.splitlines() if line.startswith("["))
        values.append([float(word.strip("' ")) for word in line[1:-1].split(",")])
    assert np.all(np.abs(values[0]) > 0)
    np.testing.assert_allclose(values[1], values[0], rtol=1e-12)


def test_rows_are_found_whatever_the_order_of_their_numbers():
    rows = np.array([[3, 1, 2], [7, 8, 9], [4, 5, 6]])
    assert find_rows(rows, np.array([[6, 5, 4], [2, 3, 1]])).tolist() == [1, -1, 0]
    assert find_rows(rows, np.empty((0, 3), int)).tolist() == [-1, -1, -1]
    assert find_rows(np.empty((0, 3), int), rows).tolist() == []


def test_every_tagged_face_is_an_outer_face_with_an_outward_normal(written, folder):
    from rail_fem.export.tagged import read_tagged

    run = read_tagged(folder)
    faces, _ = boundary_faces(run.fields.cells)
    assert (find_rows(run.facets, faces) >= 0).all() and len(run.facets) == 2 * (6 + 4 + 6)
    corner = run.fields.points[run.facets]
    away = corner.mean(axis=1) - run.fields.points[run.fields.cells[run.facet_cells]].mean(axis=1)
    normal = np.cross(corner[:, 2] - corner[:, 0], corner[:, 3] - corner[:, 1])
    assert ((away * normal).sum(axis=1) > 0).all()


def test_a_file_that_hdf5_cannot_make_is_refused_with_its_name(found, tmp_path):
    (tmp_path / "own.h5").mkdir()
    with pytest.raises(ExportError, match="own.xdmf: cannot be written"):
        write_by_dolfinx(tmp_path / "own.xdmf", found)


def test_what_is_no_run_or_of_two_runs_is_refused_with_its_file(tmp_path):
    with pytest.raises(FieldsError, match="no final.vtu.* the folder of a run .*light ones leave no fields"):
        rail_fem.export_dolfinx(tmp_path, MPI.COMM_SELF)
    write_run(tmp_path)
    with pytest.raises(FieldsError, match="frame_0007.vtu"):
        rail_fem.export_dolfinx(tmp_path, MPI.COMM_SELF, frame=7)
    with np.load(tmp_path / "mesh.npz") as stored:
        arrays = dict(stored)
    from rail_fem.files.sealed import write_sealed

    arrays.pop("seal")
    write_sealed(tmp_path / "mesh.npz", arrays | {"cells": arrays["cells"][:-1]}, {})
    with pytest.raises(FieldsError, match="two runs"):
        rail_fem.export_dolfinx(tmp_path, MPI.COMM_SELF)
    (tmp_path / "mesh.npz").write_bytes(b"no mesh")
    with pytest.raises(FieldsError, match="damaged"):
        rail_fem.export_dolfinx(tmp_path, MPI.COMM_SELF)
    (tmp_path / "mesh.npz").unlink()
    with pytest.raises(FieldsError, match="mesh.npz"):
        rail_fem.export_dolfinx(tmp_path, MPI.COMM_SELF)
