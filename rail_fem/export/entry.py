"""The export to dolfinx, importable where there is no dolfinx."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from rail_fem.processes.launcher import on_root

if TYPE_CHECKING:
    from rail_fem.export.to_dolfinx import DolfinxFields


def export_dolfinx(
    folder: Path | str, comm: Any = None, frame: int | None = None, deformed: bool = False
) -> DolfinxFields:
    """Mesh, tags and fields of a run as dolfinx knows them, on the ranks of an MPI communicator. Collective.

    Parameters
    ----------
    folder : Path or str
        Of a run of an explicit model.
    comm : mpi4py.MPI.Comm, optional
        None for MPI.COMM_WORLD.
    frame : int or None
        Number of a field frame, from 0; None for the last fields.
    deformed : bool
        Nodes where the displacement has brought them; else where they were. Cauchy's stress belongs to the deformed
        body: integrals over the other are wrong by the order of the strain.

    Returns
    -------
    DolfinxFields
        Mesh, cell and facet tags, Functions.

    Raises
    ------
    rail_fem.result.fields.FieldsError
        On every rank.
    ImportError
        Where dolfinx is not installed.

    Examples
    --------
    >>> fields = rail_fem.export_dolfinx("runs/nose_transfer")  # doctest: +SKIP
    >>> fields.plastic_strain.x.array.max()  # doctest: +SKIP
    """
    from mpi4py import MPI

    from rail_fem.export.tagged import read_tagged
    from rail_fem.export.to_dolfinx import to_dolfinx

    comm = MPI.COMM_WORLD if comm is None else comm
    return to_dolfinx(on_root(lambda: read_tagged(Path(folder), frame), comm), comm, deformed)
