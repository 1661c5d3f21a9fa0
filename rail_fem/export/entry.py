"""The export to dolfinx, importable where there is no dolfinx."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rail_fem.export.to_dolfinx import DolfinxFields


def export_dolfinx(
    folder: Path | str, comm: Any = None, frame: int | None = None, deformed: bool = False
) -> DolfinxFields:
    """Mesh, tags and fields of a run as dolfinx knows them, on the ranks of an MPI communicator. Collective.

    folder : of a run of an explicit model;  comm : None for MPI.COMM_WORLD
    frame : number of a field frame, from 0; None for the last fields
    deformed : nodes where the displacement has brought them; else where they were. Cauchy's stress belongs to the
        deformed body: integrals over the other are wrong by the order of the strain.
    Errors: rail_fem.result.fields.FieldsError on every rank; ImportError where dolfinx is not installed.
    """
    from mpi4py import MPI

    from rail_fem.export.to_dolfinx import from_folder

    return from_folder(Path(folder), MPI.COMM_WORLD if comm is None else comm, frame, deformed)
