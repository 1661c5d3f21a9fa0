"""`rail-fem doctor`: whether the installation works."""

import typer

from rail_fem.commands.options import JsonOption


def doctor(as_json: JsonOption = False) -> None:
    """Check this installation: versions, dolfinx, MPI on two ranks, gmsh, numba, rendering without a display."""
    from rail_fem.run.doctor import tell

    raise typer.Exit(tell(as_json))
