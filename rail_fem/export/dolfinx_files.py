"""dolfinx fields into the files that dolfinx and ParaView read: XDMF with tags, VTX where dolfinx has ADIOS2."""

from pathlib import Path

import mpi4py.MPI  # noqa: F401

from rail_fem.export.files import ExportError
from rail_fem.export.to_dolfinx import DolfinxFields
from rail_fem.fe.compat import discontinuous, fem, io, vtx_writer, write_tags


def write_by_dolfinx(path: Path, fields: DolfinxFields) -> list[Path]:
    """Write the fields in the format of the suffix, .xdmf or .bp; what was written. Collective.

    .xdmf (with a .h5 beside it): mesh, tags and all three Functions; `XDMFFile.read_mesh` and `read_meshtags` read mesh
        and tags back
    .bp: displacement; beside it NAME_plastic_strain.bp and NAME_stress.bp, discontinuous Functions of degree 1, equal
        at the corners of a cell: VTX takes none of degree 0 in dolfinx 0.9, and one element a file
    Errors: ExportError where dolfinx was built without ADIOS2.
    """
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    return _write_xdmf(path, fields) if path.suffix == ".xdmf" else _write_vtx(path, fields)


def _write_xdmf(path: Path, fields: DolfinxFields) -> list[Path]:
    with io.XDMFFile(fields.mesh.comm, str(path), "w") as file:
        file.write_mesh(fields.mesh)
        write_tags(file, fields.mesh, fields.cell_tags)
        write_tags(file, fields.mesh, fields.facet_tags)
        for function in (fields.displacement, fields.plastic_strain, fields.stress):
            file.write_function(function, fields.time)
    return [path, path.with_suffix(".h5")]


def _write_vtx(path: Path, fields: DolfinxFields) -> list[Path]:
    writer = vtx_writer()
    if writer is None:
        raise ExportError(f"--to {path}: this dolfinx was built without ADIOS2 and writes no .bp: use .xdmf or .vtu")
    written = {path: fields.displacement}
    for function in (fields.plastic_strain, fields.stress):
        raised = fem.Function(discontinuous(fields.mesh, 1, function.ufl_shape), name=function.name)
        raised.interpolate(function)
        written[path.with_name(f"{path.stem}_{function.name}.bp")] = raised
    for name, function in written.items():
        with writer(fields.mesh.comm, str(name), [function], engine="BP4") as file:
            file.write(fields.time)
    return list(written)
