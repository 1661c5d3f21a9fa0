"""Field files as VTK reads them: components by name, principal stresses, time; the same bytes from any number of ranks,
whole or not at all."""

import json
import re
import subprocess
import sys

import meshio
import numpy as np
import pytest

from bem.exact.subsurface import von_mises
from geometry.axes import as_tensor
from geometry.meshing.blocks import mesh_box
from rail_fem.fe.dynamics import Dynamics
from rail_fem.fe.fields import VTK_ORDER, write_frame
from rail_fem.files.sealed import CHUNK
from rail_fem.files.vtu_layout import HEXAHEDRON, VtuArray, compressed, lay_out, read_arrays
from rail_fem.result.fields import FieldsError, read_fields
from tests.fe.bodies import distort, place, structure_of
from tests.fe.fields_job import OFFSET, TIME, bodies, motion
from tests.fe.gathered import gather_cells
from tests.ranks import HANGS, printed_by_ranks, run_on_ranks

READ = """
import json, sys, vtk
from vtk.util.numpy_support import vtk_to_numpy
reader = vtk.vtkXMLUnstructuredGridReader()
reader.SetFileName(sys.argv[1])
reader.Update()
grid = reader.GetOutput()
stress = grid.GetCellData().GetArray("stress")
fields = grid.GetFieldData()
principal = vtk.vtkTensorPrincipalInvariants()
principal.SetInputData(grid)
principal.SetInputArrayToProcess(0, 0, 0, vtk.vtkDataObject.FIELD_ASSOCIATION_CELLS, "stress")
principal.Update()
cells = principal.GetOutput().GetCellData()
print(json.dumps({
    "components": [stress.GetComponentName(i) for i in range(6)], "stress": vtk_to_numpy(stress).tolist(),
    "principal": [vtk_to_numpy(cells.GetArray(f"stress - Sigma {i}")).tolist() for i in (1, 2, 3)],
    "von_mises": vtk_to_numpy(cells.GetArray("von_mises")).tolist(),
    "time": fields.GetArray("TimeValue").GetValue(0),
    "points": vtk_to_numpy(grid.GetPoints().GetData()).tolist(),
    "corners": vtk_to_numpy(grid.GetCells().GetConnectivityArray()).reshape(-1, 8).tolist(),
}))
"""


@pytest.fixture(scope="module")
def frame(tmp_path_factory):
    """A block distorted at random, so that every cell has another stress with all six components; read back by VTK in a
    process of its own."""
    mesh = distort(mesh_box((1.0, 1.0, 1.0), (3, 3, 3)), 0.08, seed=5)
    structure = structure_of(mesh)
    start = structure.x.reshape(-1, 3).copy()
    place(structure, start + np.random.default_rng(6).uniform(-1e-4, 1e-4, start.shape), 1e-7)
    dynamics = Dynamics(structure)
    dynamics.time = 1.25e-3
    path = tmp_path_factory.mktemp("fields") / "frame.vtu"
    write_frame(path, dynamics, 0.0)
    write_frame(path.with_name("single.vtu"), dynamics, 0.0, "f4")
    answer = subprocess.run([sys.executable, "-c", READ, str(path)], capture_output=True, text=True, timeout=HANGS)
    assert answer.returncode == 0, answer.stderr
    return gather_cells(dynamics)[:, :6], json.loads(answer.stdout), path


def test_components_are_named_and_stand_where_vtk_expects_them(frame):
    stress, read, _ = frame
    assert read["components"] == ["XX", "YY", "ZZ", "XY", "YZ", "XZ"]
    exact = as_tensor(stress)
    column = {"X": 0, "Y": 1, "Z": 2}
    for i, (a, b) in enumerate(read["components"]):
        np.testing.assert_array_equal(np.array(read["stress"])[:, i], exact[:, column[a], column[b]])


def test_principal_stresses_by_vtk_are_the_eigenvalues_of_the_tensor(frame):
    """Shears exchanged would change them; the trace alone would not tell. VTK works in double precision."""
    stress, read, _ = frame
    exact = np.sort(np.linalg.eigvalsh(as_tensor(stress)), axis=1)[:, ::-1]
    found = np.sort(np.array(read["principal"]).T, axis=1)[:, ::-1]
    assert np.abs(found - exact).max() < 1e-9 * np.abs(exact).max()
    exchanged = np.linalg.eigvalsh(as_tensor(stress[:, [0, 1, 2, 5, 3, 4]]))[:, ::-1]
    assert np.abs(exchanged - exact).max() > 0.01 * np.abs(exact).max()
    np.testing.assert_allclose(read["von_mises"], von_mises(stress), rtol=1e-12)


def test_file_says_its_time_and_is_read_back(frame):
    stress, read, path = frame
    arrays, time = read_arrays(path)
    assert read["time"] == time == 1.25e-3
    np.testing.assert_array_equal(arrays["CellData/stress"], stress[:, VTK_ORDER])
    single, _ = read_arrays(path.with_name("single.vtu"))
    for name, exact in arrays.items():
        np.testing.assert_allclose(single[name], exact, rtol=1e-7)
    assert path.with_name("single.vtu").stat().st_size < 0.8 * path.stat().st_size


@pytest.mark.skipif(sys.version_info >= (3, 13), reason="meshio 5.3 reads on beyond the end of raw arrays")
def test_meshio_reads_it_too(frame):
    stress, _, path = frame
    by_meshio = meshio.read(path)
    single = meshio.read(path.with_name("single.vtu"))
    np.testing.assert_array_equal(single.cell_data["stress"][0], stress[:, VTK_ORDER].astype("f4"))
    assert by_meshio.field_data["TimeValue"].tolist() == [1.25e-3]
    np.testing.assert_array_equal(by_meshio.cell_data["stress"][0], stress[:, VTK_ORDER])


@pytest.mark.parametrize("kept", [0.3, 0.95])
def test_a_file_that_was_cut_off_is_refused(frame, tmp_path, kept):
    content = frame[2].read_bytes()
    (tmp_path / "cut.vtu").write_bytes(content[: int(kept * len(content))])
    with pytest.raises(FieldsError, match="cut.vtu: cannot be read .* run the case again"):
        read_fields(tmp_path / "cut.vtu")


JOB = "tests/fe/fields_job.py"


@pytest.fixture(scope="module")
def one(tmp_path_factory):
    """The file of one rank, of more than one chunk of rows."""
    folder = tmp_path_factory.mktemp("one")
    assert json.loads(printed_by_ranks(1, JOB, folder)) == [None]
    return folder / "frame.vtu"


def points_of(arrays):
    """The positions of the nodes, whatever their name."""
    return next(array for key, array in arrays.items() if key.startswith("Points/"))


@pytest.mark.mpi
def test_file_of_one_rank_holds_the_input_mesh_in_its_order(one):
    (found, time), mesh = read_arrays(one), bodies()
    assert len(mesh.cells) > CHUNK and len(mesh.points) > CHUNK
    placed = mesh.points.copy()
    placed[np.unique(mesh.cells[mesh.region == 2]), 0] += OFFSET
    np.testing.assert_array_equal(points_of(found), placed)
    np.testing.assert_array_equal(found["Cells/connectivity"].reshape(-1, 8), mesh.cells)
    np.testing.assert_array_equal(found["CellData/region"].ravel(), mesh.region)
    np.testing.assert_allclose(found["PointData/displacement"], motion(mesh.points), rtol=0, atol=1e-14)
    strain, stress = found["CellData/plastic_strain"].ravel(), found["CellData/stress"]
    assert (strain[mesh.region == 2] == 0).all() and 0.1 < (strain[mesh.region < 2] > 0).mean() < 1
    tensor = np.empty_like(stress)
    tensor[:, VTK_ORDER] = stress
    np.testing.assert_array_equal(found["CellData/von_mises"].ravel(), von_mises(tensor))
    assert np.abs(stress[mesh.region == 2]).max() > 1e6 and time == TIME


@pytest.mark.mpi
def test_vtk_reads_a_file_of_several_chunks_as_this_program_does(one):
    answer = subprocess.run([sys.executable, "-c", READ, str(one)], capture_output=True, text=True, timeout=HANGS)
    assert answer.returncode == 0, answer.stderr
    read, found = json.loads(answer.stdout), read_arrays(one)[0]
    np.testing.assert_array_equal(read["stress"], found["CellData/stress"])
    np.testing.assert_array_equal(read["von_mises"], found["CellData/von_mises"].ravel())
    np.testing.assert_array_equal(read["points"], points_of(found))
    np.testing.assert_array_equal(read["corners"], found["Cells/connectivity"].reshape(-1, 8))


@pytest.mark.mpi
@pytest.mark.parametrize("ranks", [pytest.param(2, marks=pytest.mark.validate), 3])
def test_any_number_of_ranks_writes_the_same_bytes(one, ranks, tmp_path):
    assert json.loads(printed_by_ranks(ranks, JOB, tmp_path)) == [None] * ranks
    assert (tmp_path / "frame.vtu").read_bytes() == one.read_bytes()
    assert [path.name for path in tmp_path.iterdir()] == ["frame.vtu"]


@pytest.mark.mpi
@pytest.mark.validate
@pytest.mark.parametrize("how", ["full", "lost"])
def test_a_rank_that_cannot_write_its_part_leaves_the_file_of_before(how, tmp_path):
    (tmp_path / "frame.vtu").write_text("of before")
    done = run_on_ranks(2, JOB, tmp_path, how)
    assert (tmp_path / "frame.vtu").read_text() == "of before"
    if how == "full":
        assert json.loads(done.stdout) == [f"cannot write {tmp_path / 'frame.vtu'}: no space left on device"] * 2
        assert [path.name for path in tmp_path.iterdir()] == ["frame.vtu"]
    else:
        assert done.returncode != 0


def test_positions_beyond_4_gb_are_whole_numbers_of_64_bits():
    """Of chunks as large as they are without compression: 40 million cells."""
    total = 40_000_000
    columns = [
        VtuArray("Points", "Points", "f8", 3, total),
        VtuArray("Cells", "connectivity", "i8", 8, total),
        VtuArray("CellData", "stress", "f8", 6, total),
    ]
    sizes = [[min(CHUNK, total - at) * column.row for at in range(0, total, CHUNK)] for column in columns]
    layout = lay_out(columns, sizes, 0.0)
    offsets = list(map(int, re.findall(rb'offset="(\d+)"', layout.head)))
    for (at, header), offset, column, size, data in zip(layout.headers, offsets, columns, sizes, layout.data):
        numbers = np.frombuffer(header, "<u8")
        assert numbers[:3].tolist() == [len(size), CHUNK * column.row, total % CHUNK * column.row]
        assert at == len(layout.head) + offset and data[0] == at + len(header)
        assert data[-1] - data[0] == sum(size[:-1]) and numbers[3:].tolist() == size
    assert layout.end == data[-1] + size[-1] > 2**32 and b'header_type="UInt64"' in layout.head


SPARSE = """
import json, sys, vtk
from vtk.util.numpy_support import vtk_to_numpy
reader = vtk.vtkXMLUnstructuredGridReader()
reader.SetFileName(sys.argv[1])
reader.UpdateInformation()
reader.GetCellDataArraySelection().DisableArray("hole")
reader.Update()
grid = reader.GetOutput()
print(json.dumps([grid.GetNumberOfCells(), vtk_to_numpy(grid.GetPoints().GetData()).tolist(),
                  vtk_to_numpy(grid.GetCellData().GetArray("stress")).tolist()]))
"""


@pytest.mark.validate
def test_vtk_reads_arrays_that_lie_beyond_4_gb(tmp_path):
    """Behind a hole of 5 GB in a sparse file, which stands for an array that is not asked for."""
    mesh = bodies()
    total, stress = len(mesh.cells), np.random.default_rng(3).normal(size=(len(mesh.cells), 6))
    numbers = np.arange(total)[:, None]
    arrays = [
        (VtuArray("CellData", "hole", "f8", 1, total), None),
        (VtuArray("Points", "Points", "f8", 3, len(mesh.points)), mesh.points),
        (VtuArray("Cells", "connectivity", "i8", 8, total), mesh.cells),
        (VtuArray("Cells", "offsets", "i8", 1, total), 8 * (numbers + 1)),
        (VtuArray("Cells", "types", "u1", 1, total), np.full_like(numbers, HEXAHEDRON)),
        (VtuArray("CellData", "stress", "f8", 6, total), stress),
    ]
    chunks = [[] if rows is None else compressed(column, rows) for column, rows in arrays]
    sizes = [list(map(len, mine)) or [5 << 30, 8] for mine in chunks]
    layout = lay_out([column for column, _ in arrays], sizes, 0.0)
    assert layout.data[-1][0] > 5 << 30
    with (tmp_path / "large.vtu").open("wb") as stream:
        pieces = [(0, layout.head), (layout.end, layout.tail), *layout.headers]
        for at, data in pieces + [(at[0], b"".join(mine)) for at, mine in zip(layout.data, chunks) if mine]:
            stream.seek(int(at))
            stream.write(data)
    command = [sys.executable, "-c", SPARSE, str(tmp_path / "large.vtu")]
    answer = subprocess.run(command, capture_output=True, text=True, timeout=HANGS)
    assert answer.returncode == 0, answer.stderr
    cells, points, found = json.loads(answer.stdout)
    assert cells == total
    np.testing.assert_array_equal(points, mesh.points)
    np.testing.assert_array_equal(found, stress)
