"""`rail-fem export` and `rail-fem crossing`: a run's mesh, tags and fields, or the crossing of a case, in the files of
other programs."""

from pathlib import Path
from typing import Annotated

import typer

from rail_fem.commands.ending import refusing, say, stop
from rail_fem.commands.options import CaseArgument, SetOption, loaded_case, not_a_runs
from rail_fem.processes import launcher


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
    from rail_fem.result.fields import FieldsError

    with refusing(FieldsError, ExportError, OSError):
        if to.suffix in BY_DOLFINX:
            written = _by_dolfinx(folder, to, frame, deformed)
        else:
            launcher.on_root(lambda: write_by_meshio(to, read_tagged(folder, frame), deformed))
            written = [to]
    say("written: " + ", ".join(map(str, written)))


def _by_dolfinx(folder: Path, to: Path, frame: int | None, deformed: bool) -> list[Path]:
    """Errors: ExportError where there is no dolfinx."""
    from rail_fem.export.entry import export_dolfinx
    from rail_fem.export.files import ExportError

    try:
        from rail_fem.export.to_dolfinx import write_by_dolfinx
    except ImportError as error:
        raise ExportError(f"--to {to}: needs dolfinx ({error}); .vtu, .msh and .inp need meshio alone") from error
    return write_by_dolfinx(to, export_dolfinx(folder, frame=frame, deformed=deformed))


def crossing(
    case: CaseArgument,
    to: Annotated[
        Path,
        typer.Option(
            "--to", callback=not_a_runs, help="folder to write: one file a section, and stations.csv; or a .step file"
        ),
    ],
    start: Annotated[str | None, typer.Option(help='first section, e.g. "-1.2 m"; default: plain rail')] = None,
    end: Annotated[str | None, typer.Option(help='last section, e.g. "900 mm"; default: behind the nose')] = None,
    tolerance: Annotated[str, typer.Option(help="of the surface between sections")] = "10 um",
    settings: SetOption = None,
) -> None:
    """Write the crossing of a case as sections, as many as a tolerance asks for, or as STEP surfaces through them;
    families "sections" and "step" read them."""
    from geometry.profiles.profile import ProfileError
    from geometry.surfaces.bodies import CrossingError
    from geometry.surfaces.measured_crossing import measured_crossing
    from rail_fem.export.sections import crossing_sections, write_section_folder, write_step, written_range
    from rail_fem.scene.units import parse

    found = loaded_case(case, settings).scene.crossing
    with refusing():
        ends = [None if text is None else parse(text, "mm")[0] for text in (start, end)]
        away = parse(tolerance, "um")[0]
        if not away > 0:
            stop(f"--tolerance {tolerance}: must be more than 0")
        low, high = written_range(found.surface, *ends)
        x, sections = crossing_sections(found.surface, low, high, away)
        if to.suffix.lower() in (".step", ".stp"):
            write_step(to, found.surface, x)
        else:
            write_section_folder(to, x, sections, found.name)
    say(f"written {to}: {len(x)} sections from x = {1e3 * low:.0f} to {1e3 * high:.0f} mm")
    try:
        measured_crossing(x, sections)
    except (CrossingError, ProfileError) as error:
        say(f"""note: families "sections" and "step" cannot read them as they are: {error}""")
