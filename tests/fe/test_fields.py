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
from rail_fem.output.sealed import CHUNK
from rail_fem.output.vtu_layout import HEXAHEDRON, VtuArray, compressed, lay_out
from tests.fe.bodies import distort, place, structure_of
from tests.fe.fields_job import OFFSET, TIME, bodies, motion
from tests.fe.gathered import gather_cells
from tests.ranks import printed_by_ranks, run_on_ranks

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
    answer = subprocess.run([sys.executable, "-c", READ, str(path)], capture_output=True, text=True, timeout=120)
    assert answer.returncode == 0, answer.stderr
    return gather_cells(dynamics)[:, :6], json.loads(answer.stdout), meshio.read(path)


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


def test_file_says_its_time_and_meshio_reads_it_too(frame):
    stress, read, by_meshio = frame
    assert read["time"] == 1.25e-3 and by_meshio.field_data["TimeValue"].tolist() == [1.25e-3]
    np.testing.assert_array_equal(by_meshio.cell_data["stress"][0], stress[:, VTK_ORDER])


JOB = "tests/fe/fields_job.py"


@pytest.fixture(scope="module")
def one(tmp_path_factory):
    """The file of one rank, of more than one chunk of rows."""
    folder = tmp_path_factory.mktemp("one")
    assert json.loads(printed_by_ranks(1, JOB, folder)) == [None]
    return folder / "frame.vtu"


@pytest.mark.mpi
def test_file_of_one_rank_holds_the_input_mesh_in_its_order(one):
    found, mesh = meshio.read(one), bodies()
    assert len(mesh.cells) > CHUNK and len(mesh.points) > CHUNK
    placed = mesh.points.copy()
    placed[np.unique(mesh.cells[mesh.region == 2]), 0] += OFFSET
    np.testing.assert_array_equal(found.points, placed)
    np.testing.assert_array_equal(found.cells_dict["hexahedron"], mesh.cells)
    np.testing.assert_array_equal(found.cell_data["region"][0], mesh.region)
    np.testing.assert_allclose(found.point_data["displacement"], motion(mesh.points), rtol=0, atol=1e-14)
    strain, stress = found.cell_data["plastic_strain"][0], found.cell_data["stress"][0]
    assert (strain[mesh.region == 2] == 0).all() and 0.1 < (strain[mesh.region < 2] > 0).mean() < 1
    tensor = np.empty_like(stress)
    tensor[:, VTK_ORDER] = stress
    np.testing.assert_array_equal(found.cell_data["von_mises"][0], von_mises(tensor))
    assert np.abs(stress[mesh.region == 2]).max() > 1e6 and found.field_data["TimeValue"] == [TIME]


@pytest.mark.mpi
def test_vtk_reads_a_file_of_several_chunks_as_meshio_does(one):
    answer = subprocess.run([sys.executable, "-c", READ, str(one)], capture_output=True, text=True, timeout=120)
    assert answer.returncode == 0, answer.stderr
    read, found = json.loads(answer.stdout), meshio.read(one)
    np.testing.assert_array_equal(read["stress"], found.cell_data["stress"][0])
    np.testing.assert_array_equal(read["von_mises"], found.cell_data["von_mises"][0])
    np.testing.assert_array_equal(read["points"], found.points)
    np.testing.assert_array_equal(read["corners"], found.cells_dict["hexahedron"])


@pytest.mark.mpi
@pytest.mark.parametrize("ranks", [2, 3])
def test_any_number_of_ranks_writes_the_same_bytes(one, ranks, tmp_path):
    assert json.loads(printed_by_ranks(ranks, JOB, tmp_path)) == [None] * ranks
    assert (tmp_path / "frame.vtu").read_bytes() == one.read_bytes()
    assert [path.name for path in tmp_path.iterdir()] == ["frame.vtu"]


@pytest.mark.mpi
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
    answer = subprocess.run(command, capture_output=True, text=True, timeout=300)
    assert answer.returncode == 0, answer.stderr
    cells, points, found = json.loads(answer.stdout)
    assert cells == total
    np.testing.assert_array_equal(points, mesh.points)
    np.testing.assert_array_equal(found, stress)
