"""A user's own hexahedra: read from a .msh with physical groups, and refused where they cannot be run."""

import os

import numpy as np
import pytest

from geometry.meshing.hexmesh import MeshError, boundary_faces
from geometry.meshing.mesh_file import checked_mesh, read_mesh_file

SIZE = 0.01
FACES = {11: "wing contact", 12: "contact surface", 21: "base", 22: "wheel base"}


def block(nx: int, ny: int, nz: int, at=(0.0, 0.0, 0.0)) -> tuple[np.ndarray, np.ndarray]:
    """Points and hexahedra of a brick of cubes."""
    grid = np.stack(np.meshgrid(*(np.arange(n + 1) for n in (nx, ny, nz)), indexing="ij"), axis=-1)
    number = np.arange(grid.size // 3).reshape(grid.shape[:3])
    corners = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]
    cells = [number[i : nx + i, j : ny + j, k : nz + k].ravel() for i, j, k in corners]
    return grid.reshape(-1, 3) * SIZE + at, np.column_stack(cells)


def wing_and_wheel():
    """A wing below z = 0 and a wheel on it, with tagged faces: what `checked` takes."""
    wing, wheel = block(3, 2, 2, (0, 0, -2 * SIZE)), block(2, 2, 2, (0.5 * SIZE, 0, 0))
    points, cells = np.vstack([wing[0], wheel[0]]), np.vstack([wing[1], wheel[1] + len(wing[0])])
    region = np.repeat([0, 2], [len(wing[1]), len(wheel[1])]).astype(np.int8)
    outer, owner = boundary_faces(cells)
    height, of = points[outer][..., 2], region[owner]
    flat = lambda z, body: outer[(np.abs(height - z) < 1e-9).all(axis=1) & (of == body)]
    groups = {11: flat(0, 0), 12: flat(0, 2), 21: flat(-2 * SIZE, 0), 22: flat(2 * SIZE, 2)}
    quads, tag = np.vstack(list(groups.values())), np.repeat(list(groups), [len(g) for g in groups.values()])
    return [points, cells, region, quads, tag, dict(FACES)]


def checked(what, points, cells, region, quads, tag, names):
    return checked_mesh(what, points, cells, region, [(name, quads[tag == k]) for k, name in names.items()])


def write_msh(path) -> np.ndarray:
    """A .msh of wing_and_wheel in mm; its points [m]."""
    import meshio

    points, cells, region, quads, tag, _ = wing_and_wheel()
    volumes = {"wing": 1, "wheel": 3}
    data = meshio.Mesh(
        np.vstack([points, [[9.0, 9.0, 9.0]]]) * 1e3,  # in mm, with a node that no cell has
        [("hexahedron", cells), ("quad", quads[:, ::-1])],
        cell_data={name: [region + 1, tag] for name in ("gmsh:physical", "gmsh:geometrical")},
        field_data={
            **{n: np.array([t, 3]) for n, t in volumes.items()},
            **{n: np.array([t, 2]) for t, n in FACES.items()},
        },
    )
    meshio.write(path, data, file_format="gmsh22")
    return points


def test_a_mesh_with_groups_is_taken_as_it_is(tmp_path):
    path = tmp_path / "own.msh"
    points, region = write_msh(path), wing_and_wheel()[2]
    mesh = read_mesh_file(path, 1e-3)
    assert np.allclose(mesh.points, points) and np.array_equal(mesh.region, region)
    assert len(mesh.surface) == 6 + 4 and set(mesh.surface_region) == {0, 2}
    assert len(mesh.clamp) == 4 * 3 + 3 * 3
    corner = mesh.points[mesh.surface]
    normal = np.cross(corner[:, 2] - corner[:, 0], corner[:, 3] - corner[:, 1])[:, 2]
    assert (normal[mesh.surface_region == 0] > 0).all() and (normal[mesh.surface_region == 2] < 0).all()
    with pytest.raises(MeshError, match='".stl" is none'):
        read_mesh_file(tmp_path / "own.stl")
    path.write_bytes(path.read_bytes().replace(b'"wheel"', b'"frogs"'))
    with pytest.raises(MeshError, match="8 hexahedra are in no group wing, nose or wheel .*frogs, wing"):
        read_mesh_file(path, 1e-3)
    path.write_text("$MeshFormat\nnothing")
    with pytest.raises(MeshError, match="Gmsh cannot read it|holds no mesh"):
        read_mesh_file(path)


def test_no_mesh_file_runs_a_command(tmp_path):
    """Gmsh takes what does not begin as a mesh for a script, and reads options from beside a mesh: both call commands.
    A loop of a script and a pipe without a writer would hold the program for ever."""
    done = tmp_path / "done"
    script = f'SystemCall "touch {done}";'
    path = tmp_path / "own.msh"
    for text in (script, "\n$MeshFormat\n" + script, "For i In {1:1000000000}\nEndFor\n"):
        path.write_text(text)
        with pytest.raises(MeshError, match="own.msh: .* does not begin with [$]MeshFormat"):
            read_mesh_file(path)
    write_msh(path)
    (tmp_path / "own.msh.opt").write_text(script)
    assert len(read_mesh_file(path, 1e-3).cells) and not done.exists()
    for suffix in (".msh", ".vtu", ".inp"):
        os.mkfifo(tmp_path / f"pipe{suffix}")
        with pytest.raises(MeshError, match=f"pipe{suffix}: cannot be read: it is no file"):
            read_mesh_file(tmp_path / f"pipe{suffix}")


def of_other_program(suffix: str, region, cells, quads, tag):
    """The same mesh as meshio writes it, with groups as that format has them."""
    import meshio

    blocks = [("hexahedron", cells), ("quad", quads)]
    points = wing_and_wheel()[0]
    outside = lambda members: [members, np.zeros(0, np.int64)]
    if suffix == ".inp":  # cells by sets, faces by sets of nodes
        sets = {name: outside(np.flatnonzero(region == body)) for name, body in (("wing", 0), ("wheel", 2))}
        nodes = {name: np.unique(quads[tag == number]) for number, name in FACES.items()}
        return meshio.Mesh(points, blocks[:1], cell_sets={k: v[:1] for k, v in sets.items()}, point_sets=nodes)
    data = {name: [(region == body) * 1, 0 * tag] for name, body in (("wing", 0), ("wheel", 2))}
    data |= {name: [0 * region.astype(int), (tag == number) * 1] for number, name in FACES.items()}
    if suffix == ".med":
        names = {-1: ["wing"], -2: ["wheel"]} | {-number: [name] for number, name in FACES.items()}
        mesh = meshio.Mesh(points, blocks, cell_data={"cell_tags": [-1 - (region == 2).astype(int), -tag]})
        mesh.cell_tags = names
        return mesh
    return meshio.Mesh(points, blocks, cell_data=data)


@pytest.mark.parametrize("suffix", [".inp", ".vtu", ".med"])
def test_a_mesh_of_another_program_is_the_same_mesh(tmp_path, suffix):
    parts = wing_and_wheel()
    path = tmp_path / f"own{suffix}"
    of_other_program(suffix, *(parts[k] for k in (2, 1, 3, 4))).write(path)
    mesh, own = read_mesh_file(path), checked("own", *parts)
    assert np.allclose(mesh.points, own.points, atol=1e-9) and np.array_equal(mesh.region, own.region)
    assert np.array_equal(mesh.cells, own.cells)
    assert {tuple(sorted(face)) for face in mesh.surface} == {tuple(sorted(face)) for face in own.surface}
    assert np.array_equal(np.sort(mesh.clamp), np.sort(own.clamp))


@pytest.mark.parametrize("header", [32, 64])
@pytest.mark.parametrize("encoded", [False, True], ids=["raw", "base64"])
@pytest.mark.parametrize("compressor", ["None", "ZLib", "LZMA"])
def test_a_vtu_as_vtk_writes_it_is_the_same_mesh(tmp_path, header, encoded, compressor):
    """Arrays behind the XML, ParaView's default; raw ones with 32-bit headers came out as other numbers."""
    pytest.importorskip("vtk")
    parts = wing_and_wheel()
    vtk_file(tmp_path, parts, header, encoded, compressor)
    mesh, own = read_mesh_file(tmp_path / "vtk.vtu"), checked("own", *parts)
    assert np.array_equal(mesh.points, own.points) and np.array_equal(mesh.cells, own.cells)
    assert np.array_equal(mesh.region, own.region) and np.array_equal(np.sort(mesh.clamp), np.sort(own.clamp))
    assert {tuple(sorted(face)) for face in mesh.surface} == {tuple(sorted(face)) for face in own.surface}


def test_a_vtu_that_is_compressed_otherwise_or_cut_off_is_refused(tmp_path):
    pytest.importorskip("vtk")
    vtk_file(tmp_path, wing_and_wheel(), 64, False, "LZ4")
    with pytest.raises(MeshError, match="compressed by vtkLZ4DataCompressor, which is not read: save it with zlib"):
        read_mesh_file(tmp_path / "vtk.vtu")
    for compressor in ("None", "ZLib"):
        vtk_file(tmp_path, wing_and_wheel(), 64, False, compressor)
        whole = (tmp_path / "vtk.vtu").read_bytes()
        (tmp_path / "cut.vtu").write_bytes(whole[: int(0.8 * len(whole))])
        with pytest.raises(MeshError, match="meshio cannot read it .*cut off"):
            read_mesh_file(tmp_path / "cut.vtu")


def vtk_file(folder, parts, header: int, encoded: bool, compressor: str) -> None:
    """vtk.vtu as VTK itself writes it."""
    from vtkmodules.vtkIOXML import vtkXMLUnstructuredGridReader, vtkXMLUnstructuredGridWriter

    of_other_program(".vtu", *(parts[k] for k in (2, 1, 3, 4))).write(folder / "inline.vtu")
    reader, writer = vtkXMLUnstructuredGridReader(), vtkXMLUnstructuredGridWriter()
    reader.SetFileName(str(folder / "inline.vtu"))
    writer.SetInputConnection(reader.GetOutputPort())
    writer.SetFileName(str(folder / "vtk.vtu"))
    writer.SetDataModeToAppended()
    writer.SetEncodeAppendedData(encoded)
    getattr(writer, f"SetHeaderTypeToUInt{header}")()
    getattr(writer, f"SetCompressorTypeTo{compressor}")()
    assert writer.Write() == 1


def test_a_mesh_of_another_program_that_cannot_be_run_is_refused(tmp_path):
    import meshio

    parts = wing_and_wheel()
    bare = meshio.Mesh(parts[0], [("hexahedron", parts[1])])
    bare.write(tmp_path / "bare.vtu")
    with pytest.raises(MeshError, match="20 hexahedra are in no group wing, nose or wheel .volume groups: none"):
        read_mesh_file(tmp_path / "bare.vtu")
    meshio.Mesh(np.eye(4, 3), [("tetra", np.array([[0, 1, 2, 3]]))]).write(tmp_path / "t.vtu")
    with pytest.raises(MeshError, match="1 cells of type tetra: linear tetrahedra lock under plastic flow"):
        read_mesh_file(tmp_path / "t.vtu")
    (tmp_path / "broken.inp").write_text("*NODE\n1, 0, nothing\n")
    with pytest.raises(MeshError, match="meshio cannot read it"):
        read_mesh_file(tmp_path / "broken.inp")
    (tmp_path / "broken.vtu").write_text("<VTK")
    with pytest.raises(MeshError, match="meshio cannot read it"):
        read_mesh_file(tmp_path / "broken.vtu")


def test_tetrahedra_are_refused_with_the_reason(tmp_path):
    import meshio

    mesh = meshio.Mesh(np.eye(4, 3), [("tetra", np.array([[0, 1, 2, 3]]))])
    meshio.write(tmp_path / "t.msh", mesh, file_format="gmsh22")
    with pytest.raises(MeshError, match="1 cells of type Tetrahedron 4: linear tetrahedra lock under plastic flow"):
        read_mesh_file(tmp_path / "t.msh")


def _inside_out(parts):
    parts[1][0] = parts[1][0][[4, 5, 6, 7, 0, 1, 2, 3]]


def _flat(parts):
    parts[0][parts[1][0, 6]] = parts[0][parts[1][0, 0]]


def _hanging(parts):
    half, cells = block(1, 1, 1, (3 * SIZE, 0.0, -2 * SIZE))
    points = np.vstack([parts[0], half * [1, 0.5, 0.5] + [0, 0, -SIZE]])
    cells = cells + len(parts[0])
    parts[0], parts[1] = points, np.vstack([parts[1], cells])
    parts[2] = np.append(parts[2], np.int8(0))
    corner = np.argmin(np.linalg.norm(parts[0] - [3 * SIZE, 0, -2 * SIZE], axis=1))
    near = np.argmin(np.linalg.norm(points[cells[0]] - points[corner], axis=1))
    parts[1][-1, near] = corner  # joined at one corner, its others lie in the middle of edges


def _split(parts):
    """The brick's second half has its own nodes, but for one row, where the first ends."""
    middle = np.flatnonzero((np.abs(parts[0][:, 0] - 2 * SIZE) < 1e-9) & (parts[0][:, 2] < -0.5 * SIZE))
    middle = middle[parts[0][middle, 1] < 1.5 * SIZE]
    own = np.arange(len(parts[0]))
    own[middle] = len(parts[0]) + np.arange(len(middle))
    behind = (parts[0][parts[1], 0].mean(axis=1) > 2 * SIZE) & (parts[2] == 0)
    parts[0] = np.vstack([parts[0], parts[0][middle]])
    parts[1][behind] = own[parts[1][behind]]


def _twice(parts):
    parts[1], parts[2] = np.vstack([parts[1], parts[1][:2]]), np.append(parts[2], parts[2][:2])


def _nowhere(parts):
    parts[0][3] = np.nan


def _high(parts):
    parts[0][:, 2] += 0.3


def _piece(parts):
    more, cells = block(1, 1, 1, (0.2, 0.0, -SIZE))
    parts[0], parts[1] = np.vstack([parts[0], more]), np.vstack([parts[1], cells + len(parts[0])])
    parts[2] = np.append(parts[2], np.int8(0))


def _joined(parts):
    wheel = parts[1][-8]
    wheel[0] = parts[1][0, 4]


def _without(number):
    def harm(parts):
        parts[5].pop(number)

    return harm


def _inner_face(parts):
    parts[3] = np.vstack([parts[3], parts[1][0, [1, 2, 6, 5]]])
    parts[4] = np.append(parts[4], 12)


@pytest.mark.parametrize(
    "harm, complaint",
    [
        (_inside_out, "folded or flat cell .* inside out"),
        (_flat, "folded or flat cell"),
        (_hanging, r"the wing has \d+ hanging node\(s\), one at \("),
        (_split, r"the wing has 4 pair\(s\) of nodes at one position, one at \(20.0,.* merge the nodes"),
        (_twice, "2 hexahedra are there twice"),
        (_high, "reaches 300 mm from rail level, at most 250 mm is meant: is mesh_unit right"),
        (_nowhere, "1 node.s. have no finite position"),
        (_piece, r"the wing is in 2 pieces .* of 1 hexahedra at \(205.0, 5.0, -5.0\) mm"),
        (_joined, "wing and wheel share 1 node"),
        (_without(11), 'the wing has no contact surface: .* "wing contact"'),
        (_without(12), 'the wheel has no contact surface: .* "wheel contact"'),
        (_without(21), 'the wing has no base: .* "wing base"'),
        (_without(22), "the wheel has no base"),
        (_inner_face, "1 face.s. of the contact surface are no outer face"),
    ],
)
def test_what_cannot_be_run_is_refused_with_the_place(harm, complaint):
    parts = wing_and_wheel()
    checked("own.msh", *parts)
    parts[1] = parts[1].copy()
    harm(parts)
    with pytest.raises(MeshError, match=complaint):
        checked("own.msh", *parts)
