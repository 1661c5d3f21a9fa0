"""`rail-fem export`: a run's mesh, tags and fields in the file of another program."""

from pathlib import Path
from typing import Annotated

import typer

from rail_fem import launcher
from rail_fem.commands.ending import say, stop
from rail_fem.commands.options import not_a_runs


def export(
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="folder of a run of an explicit model")],
    to: Annotated[
        Path,
        typer.Option(
            "--to", callback=not_a_runs, help="file to write: .xdmf or .bp by dolfinx; .vtu .vtk .msh .inp by meshio"
        ),
    ],
    frame: Annotated[
        int | None, typer.Option(help="number of a field frame, from 0; default: the last fields", min=0)
    ] = None,
    deformed: Annotated[bool, typer.Option("--deformed", help="nodes where the displacement has brought them")] = False,
) -> None:
    """Mesh, bodies and surfaces as tags, displacement, stress and plastic strain of a run, for other programs."""
    from rail_fem.export.files import BY_DOLFINX, ExportError, write_by_meshio
    from rail_fem.export.tagged import read_tagged
    from rail_fem.output.fields import FieldsError

    try:
        if to.suffix in BY_DOLFINX:
            written = _by_dolfinx(folder, to, frame, deformed)
        else:
            launcher.on_root(lambda: write_by_meshio(to, read_tagged(folder, frame), deformed))
            written = [to]
    except (FieldsError, ExportError, OSError) as error:
        stop(error)
    say("written: " + ", ".join(map(str, written)))


def _by_dolfinx(folder: Path, to: Path, frame: int | None, deformed: bool) -> list[Path]:
    """Errors: ExportError where there is no dolfinx."""
    from rail_fem.export.entry import export_dolfinx
    from rail_fem.export.files import ExportError

    try:
        from rail_fem.export.dolfinx_files import write_by_dolfinx
    except ImportError as error:
        raise ExportError(f"--to {to}: needs dolfinx ({error}); .vtu, .msh and .inp need meshio alone") from error
    return write_by_dolfinx(to, export_dolfinx(folder, frame=frame, deformed=deformed))
