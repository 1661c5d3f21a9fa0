"""What `rail-fem export` writes is read back, by dolfinx, by meshio and by Gmsh, and holds the same numbers."""

from contextlib import contextmanager
from dataclasses import replace
from functools import partial

import meshio
import numpy as np
import pytest
from mpi4py import MPI
from dolfinx.io import XDMFFile

from geometry.axes import as_tensor
from geometry.meshing.mesh_file import read_mesh_file
from rail_fem.export.files import BY_MESHIO, ExportError, write_by_meshio
from rail_fem.export.tagged import CELL_TAGS, FACET_TAGS, read_tagged
from rail_fem.fe.compat import geometry_dofmap, vtx_writer
from rail_fem.fe.domain import VTK_TO_DOLFINX
from rail_fem.fe.hexahedron import volumes
from rail_fem.result.fields import VTK_ORDER
from tests.commands import call
from tests.export.folder import write_run


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("run")
    write_run(folder)
    return folder


@pytest.fixture(scope="module")
def run(folder):
    return read_tagged(folder)


command = partial(call, "export")


@contextmanager
def in_gmsh(path):
    """Gmsh with a file of this test in it."""
    import gmsh

    gmsh.initialize(interruptible=False)
    try:
        gmsh.open(str(path))
        yield gmsh
    finally:
        gmsh.finalize()


def ordered(values: np.ndarray, positions: np.ndarray) -> np.ndarray:
    """Rows in the order of their positions (n, 3): files number cells as they like."""
    return values[np.lexsort(np.round(positions, 9).T)]


def test_xdmf_gives_mesh_and_tags_back_to_dolfinx(folder, run, tmp_path):
    command(folder, "--to", tmp_path / "pass.xdmf")
    with XDMFFile(MPI.COMM_SELF, str(tmp_path / "pass.xdmf"), "r") as file:
        mesh = file.read_mesh()
        mesh.topology.create_connectivity(2, 3)
        bodies, surfaces = file.read_meshtags(mesh, "bodies"), file.read_meshtags(mesh, "surfaces")
    cells = geometry_dofmap(mesh)
    centres = mesh.geometry.x[cells].mean(axis=1)
    exact = run.fields.points[run.fields.cells].mean(axis=1)
    tags = np.zeros(len(cells), int)
    tags[bodies.indices] = bodies.values
    assert np.array_equal(ordered(tags, centres), ordered(run.cell_tags, exact))
    found = volumes(np.ascontiguousarray(mesh.geometry.x).ravel(), cells[:, VTK_TO_DOLFINX].astype(np.int64))
    kernel = volumes(run.fields.points.ravel(), run.fields.cells)
    assert np.abs(ordered(found, centres) / ordered(kernel, exact) - 1).max() < 1e-12
    for tag in FACET_TAGS.values():
        assert (surfaces.values == tag).sum() == (run.facet_tags == tag).sum() > 0


def test_xdmf_holds_the_fields_in_the_order_of_its_own_cells_and_nodes(folder, run, tmp_path):
    """Six components would have been written as node data in silence by dolfinx 0.5; nine are cell data."""
    command(folder, "--to", tmp_path / "pass.xdmf")
    h5py = pytest.importorskip("h5py")
    with h5py.File(tmp_path / "pass.h5", "r") as file:
        points, cells = np.array(file["Mesh/mesh/geometry"]), np.array(file["Mesh/mesh/topology"])
        stress, strain, moved = (
            np.array(next(iter(file[f"Function/{name}"].values())))
            for name in ("stress", "plastic_strain", "displacement")
        )
    centres, exact = points[cells].mean(axis=1), run.fields.points[run.fields.cells].mean(axis=1)
    tensor = as_tensor(run.fields.stress).reshape(-1, 9)
    assert np.array_equal(ordered(stress, centres), ordered(tensor, exact))
    assert np.array_equal(ordered(strain.ravel(), centres), ordered(run.fields.plastic_strain, exact))
    # dolfinx evaluates the Function at the nodes: to round-off
    assert np.abs(ordered(moved, points) - ordered(run.fields.displacement, run.fields.points)).max() < 1e-16
    text = (tmp_path / "pass.xdmf").read_text()
    assert text.count('Center="Cell"') >= 2 and '1.25e-03"' in text.replace("0.00125", "1.25e-03")


def test_vtx_is_written_where_dolfinx_can_and_refused_with_what_to_do_where_not(folder, run, tmp_path):
    if vtx_writer() is None:
        assert ".xdmf" in command(folder, "--to", tmp_path / "pass.bp", code=2).output
        return
    command(folder, "--to", tmp_path / "pass.bp")
    adios2 = pytest.importorskip("adios2")
    if not hasattr(adios2, "FileReader"):
        pytest.skip("the Python part of ADIOS2 is not installed (python3-adios2)")
    with adios2.FileReader(str(tmp_path / "pass_plastic_strain.bp")) as file:
        values, points = file.read("plastic_strain"), file.read("geometry")
    centres = points.reshape(-1, 8, 3).mean(axis=1)
    exact = run.fields.points[run.fields.cells].mean(axis=1)
    corners = ordered(np.asarray(values).reshape(-1, 8), centres)
    assert np.abs(corners - ordered(run.fields.plastic_strain, exact)[:, None]).max() < 1e-12


@pytest.mark.parametrize("suffix", [suffix for suffix in BY_MESHIO if suffix not in (".msh", ".inp")])
def test_what_meshio_writes_it_reads_back_with_tags_and_fields(run, tmp_path, suffix):
    write_by_meshio(tmp_path / f"pass{suffix}", run)
    read = meshio.read(tmp_path / f"pass{suffix}")
    assert np.array_equal(read.cells_dict["hexahedron"], run.fields.cells)
    assert np.abs(read.points - run.fields.points).max() == 0
    assert np.array_equal(np.ravel(read.cell_data["body"][0]), run.cell_tags)
    assert np.array_equal(np.ravel(read.cell_data["plastic_strain"][0]), run.fields.plastic_strain)
    assert np.array_equal(np.reshape(read.cell_data["stress"][0], (-1, 6)), run.fields.stress[:, VTK_ORDER])
    assert np.array_equal(read.point_data["displacement"], run.fields.displacement)


def test_abaqus_gets_bodies_as_element_sets_and_surfaces_as_node_sets(folder, run, tmp_path):
    command(folder, "--to", tmp_path / "new" / "pass.inp", "--deformed")
    read = meshio.read(tmp_path / "new" / "pass.inp")
    assert np.abs(read.points - run.fields.points - run.fields.displacement).max() < 1e-13
    assert np.array_equal(read.cells_dict["hexahedron"], run.fields.cells)
    for name, tag in CELL_TAGS.items():
        assert np.array_equal(np.sort(read.cell_sets[name][0]), np.flatnonzero(run.cell_tags == tag))
    for name, tag in FACET_TAGS.items():
        nodes = np.unique(run.facets[run.facet_tags == tag])
        assert np.array_equal(np.sort(read.point_sets[name.replace(" ", "_")]), nodes)


def test_msh_comes_back_with_its_bodies_and_surfaces_and_through_gmshio_with_their_tags(folder, run, tmp_path):
    """As a case's own mesh, and in dolfinx."""
    command(folder, "--to", tmp_path / "pass.msh")
    try:
        from dolfinx.io import gmshio
    except ImportError:
        from dolfinx.io import gmsh as gmshio
    with in_gmsh(tmp_path / "pass.msh") as gmsh:  # read_from_msh of dolfinx 0.5 fails
        _, bodies, surfaces = gmshio.model_to_mesh(gmsh.model, MPI.COMM_SELF, 0)[:3]
    for tags, written in ((bodies, run.cell_tags), (surfaces, run.facet_tags)):
        assert np.array_equal(np.sort(tags.values), np.sort(written))
    back = read_mesh_file(tmp_path / "pass.msh", 0.01)  # this one is of metres, a crossing of mm
    back = replace(back, points=back.points / 0.01)
    kernel = volumes(run.fields.points.ravel(), run.fields.cells)
    found = volumes(back.points.ravel(), back.cells)
    centres, exact = back.points[back.cells].mean(axis=1), run.fields.points[run.fields.cells].mean(axis=1)
    assert np.abs(ordered(found, centres) / ordered(kernel, exact) - 1).max() < 1e-12
    assert np.array_equal(ordered(back.region, centres), ordered(run.fields.region, exact))
    contact = run.facet_tags < 20
    middle, there = back.points[back.surface].mean(axis=1), run.fields.points[run.facets[contact]].mean(axis=1)
    assert np.array_equal(ordered(back.surface_region, middle), ordered(run.facet_tags[contact] - 11, there))
    corner = back.points[back.surface]
    up = np.cross(corner[:, 2] - corner[:, 0], corner[:, 3] - corner[:, 1])[:, 2] > 0
    assert np.array_equal(up, back.surface_region < 2)  # the crossing's look up, the wheel's down
    assert len(back.clamp) == len(np.unique(run.facets[~contact]))


def test_gmsh_reads_the_fields_of_the_msh_on_cells_and_faces(run, tmp_path):
    write_by_meshio(tmp_path / "pass.msh", run)
    with in_gmsh(tmp_path / "pass.msh") as gmsh:
        data = {gmsh.view.option.getString(tag, "Name"): gmsh.view.getModelData(tag, 0) for tag in gmsh.view.getTags()}
        strain = np.array([row[0] for row in data["plastic_strain"][2]])
        stress = np.array(data["stress"][2])
    count = len(run.fields.cells)
    assert np.array_equal(strain[:count], run.fields.plastic_strain)
    assert np.array_equal(strain[count:], run.fields.plastic_strain[run.facet_cells])
    assert np.array_equal(stress[:count], as_tensor(run.fields.stress).reshape(-1, 9))


def test_what_cannot_be_is_said_in_a_sentence(folder, run, tmp_path):
    with pytest.raises(ExportError, match="meshio convert"):
        write_by_meshio(tmp_path / "pass.stl", run)
    refused = [
        (folder, "--to", tmp_path / "pass"),
        (tmp_path, "--to", tmp_path / "pass.vtu"),
        (folder, "--to", tmp_path / "pass.vtu", "--frame", 3),
        (folder, "--to", "/proc/pass.vtu"),
    ]
    for words in refused:
        answer = command(*words, code=2)
        assert "Traceback" not in answer.output and answer.output.strip()
    assert not list(tmp_path.glob(".*partial*"))
