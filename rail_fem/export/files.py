"""A run's fields into files of other programs: by dolfinx where it reads them itself, by meshio for all others."""

from pathlib import Path

import numpy as np

from geometry.axes import as_tensor
from rail_fem.export.tagged import CELL_TAGS, FACET_TAGS, TaggedFields
from rail_fem.files.atomic import write_atomically
from rail_fem.result.fields import VTK_ORDER

BY_DOLFINX = (".xdmf", ".bp")
BY_MESHIO = (".vtu", ".vtk", ".msh", ".inp")  # each read back whole in tests/export/test_files.py


class ExportError(ValueError):
    """A file that cannot be written as asked; the message says what can."""


def write_by_meshio(path: Path, run: TaggedFields, deformed: bool = False) -> None:
    """The hexahedra with their fields [SI] in the format of the suffix; whole or not at all.

    .msh (Gmsh 2.2): bodies and surfaces as named physical groups, which dolfinx.io.gmshio reads; fields as views, which
        Gmsh reads and meshio itself does not
    .inp (Abaqus): bodies as element sets, surfaces as node sets; the format holds no fields
    .vtu .vtk: tags of the bodies and fields as data of nodes and cells
    Errors: ExportError for another suffix, or what meshio lacks for one of these; OSError.
    """
    import meshio

    path = Path(path)
    if path.suffix not in BY_MESHIO:
        known = ", ".join([*BY_DOLFINX, *BY_MESHIO])
        raise ExportError(
            f"--to {path}: '{path.suffix}' is not among {known}; 'meshio convert' makes others from a .vtu"
        )
    mesh = {".msh": gmsh_mesh, ".inp": mesh_with_sets}.get(path.suffix, plain_mesh)(run, deformed)
    options = {"file_format": "gmsh22"} if path.suffix == ".msh" else {}
    path.parent.mkdir(parents=True, exist_ok=True)
    try:
        write_atomically(path, lambda temporary: meshio.write(temporary, mesh, **options))
    except (meshio.WriteError, ImportError) as error:
        raise ExportError(f"--to {path}: meshio cannot write this mesh so ({error}); try .vtu or .msh") from error


def _points(run: TaggedFields, deformed: bool) -> np.ndarray:
    return run.fields.points + run.fields.displacement if deformed else run.fields.points


def plain_mesh(run: TaggedFields, deformed: bool):
    """Hexahedra with displacement at nodes, tags, plastic strain and stress (VTK's order) in cells."""
    import meshio

    fields = run.fields
    data = {"body": run.cell_tags, "plastic_strain": fields.plastic_strain, "stress": fields.stress[:, VTK_ORDER]}
    return meshio.Mesh(
        _points(run, deformed),
        [("hexahedron", fields.cells)],
        point_data={"displacement": fields.displacement},
        cell_data={name: [values] for name, values in data.items()},
    )


def gmsh_mesh(run: TaggedFields, deformed: bool):
    """Hexahedra, and the tagged faces as quadrilaterals with the values of their cells; stress as nine numbers."""
    import meshio

    fields, tensor = run.fields, as_tensor(run.fields.stress).reshape(-1, 9)
    tags = [run.cell_tags, run.facet_tags]
    data = {
        "gmsh:physical": tags,
        "gmsh:geometrical": tags,
        "plastic_strain": [fields.plastic_strain, fields.plastic_strain[run.facet_cells]],
        "stress": [tensor, tensor[run.facet_cells]],
    }
    names = {name: np.array([tag, 3]) for name, tag in CELL_TAGS.items() if (run.cell_tags == tag).any()}
    names |= {name: np.array([tag, 2]) for name, tag in FACET_TAGS.items() if (run.facet_tags == tag).any()}
    return meshio.Mesh(
        _points(run, deformed),
        [("hexahedron", fields.cells), ("quad", run.facets)],
        point_data={"displacement": fields.displacement},
        cell_data=data,
        field_data=names,
    )


def mesh_with_sets(run: TaggedFields, deformed: bool):
    """Hexahedra, bodies as sets of cells and surfaces as sets of nodes."""
    import meshio

    bodies = {name: [np.flatnonzero(run.cell_tags == tag)] for name, tag in CELL_TAGS.items()}
    surfaces = {
        name.replace(" ", "_"): np.unique(run.facets[run.facet_tags == tag])
        for name, tag in FACET_TAGS.items()
        if (run.facet_tags == tag).any()
    }
    return meshio.Mesh(
        _points(run, deformed), [("hexahedron", run.fields.cells)], point_sets=surfaces, cell_sets=bodies
    )
