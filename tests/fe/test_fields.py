"""Field files as VTK reads them: components by name, principal stresses, time."""

import json
import subprocess
import sys

import meshio
import numpy as np
import pytest

from bem.exact.subsurface import von_mises
from geometry.axes import as_tensor
from geometry.meshing.blocks import mesh_box
from rail_fem.fe.dynamics import Dynamics
from rail_fem.fe.fields import VTK_ORDER, gather_cells, write_frame
from tests.fe.bodies import distort, place, structure_of

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
    write_frame(path, dynamics, mesh, 0.0)
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
