"""`rail-fem list`, `rail-fem init` and `rail-fem doctor`: what there is to choose from, a case file to begin with, and
whether the installation works."""

from pathlib import Path
from typing import Annotated, Any

import typer

from rail_fem.commands.ending import emit, say, stop
from rail_fem.commands.options import JsonOption, not_a_runs


def names(
    schema: Annotated[
        Path | None,
        typer.Option(
            callback=not_a_runs, help="instead: write the JSON Schema of case files into this file, for editors"
        ),
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """What there is: models, wheels, rails, steels, studies."""
    if schema is not None:
        from rail_fem.case.schema import write_schema

        try:
            write_schema(schema)
        except OSError as error:
            stop(f"{schema}: cannot be written: {error.strerror}")
        say(f"{schema}: named in the first line of a case file, #:schema ./{schema.name}, editors complete by it")
        emit({"schema": schema})
        return
    there = choices()
    lines = ["models, from the least to the most expensive"]
    for one in there["models"]:
        lines.append(f"  {one['name']:14s} {one['meaning']}{'; on several ranks' if one['parallel'] else ''}")
    lines += [
        f"wheels     {', '.join(there['wheels'])}, or the path of a profile file",
        f"rails      {', '.join(there['rails'])}, or the path of a profile file",
        f"steels     {', '.join(there['steels'])}",
        "crossings  UK-cast 1:6 to 1:32 (scene.crossing.ratio), or any by its sections or STEP; rail joints",
        *(f"examples   {names} in {folder}" for folder, names in _by_folder(there["examples"]).items()),
        "studies",
        *(f"  {one['name']:18s} {one['meaning']}" for one in there["studies"]),
    ]
    say("\n".join(lines))
    emit(there)


def _by_folder(examples: dict[str, Path]) -> dict[Path, str]:
    """Folder -> names of what lies in it."""
    folders = dict.fromkeys(path.parent for path in examples.values())
    return {folder: ", ".join(n for n, p in examples.items() if p.parent == folder) for folder in folders}


def choices() -> dict[str, Any]:
    """Everything that can be chosen by name."""
    from geometry.profiles.rail import HEADS
    from rail_fem.case.examples import examples
    from rail_fem.case.keys import section_keys
    from rail_fem.commands.study import STUDIES
    from rail_fem.hierarchy import MODELS
    from rail_fem.scene.input_errors import choices_of
    from rail_fem.scene.scene import Crossing
    from rail_fem.scene.steel import GRADES
    from rail_fem.scene.wheel_profile import WHEEL_NAMES

    ratio = next(key for key in section_keys(Crossing) if key.name == "ratio")
    return {
        "models": [{"name": n, "meaning": m.meaning, "parallel": m.parallel} for n, m in MODELS.items()],
        "wheels": list(WHEEL_NAMES),
        "rails": list(HEADS),
        "steels": list(GRADES),
        "crossings": list(choices_of(Crossing.model_fields["family"].annotation)),
        "crossing_ratio": ratio.allowed,
        "examples": examples(),
        "studies": [{"name": name, "meaning": meaning} for name, meaning in STUDIES.items()],
    }


def init(
    file: Annotated[Path, typer.Argument(callback=not_a_runs, help="case file to write")] = Path("case.toml"),
    model: Annotated[
        list[str], typer.Option("--model", help="models to write sections for; may be given several times")
    ] = ["rigid_hertz", "fe_full"],  # noqa: B006
) -> None:
    """Write a case file to begin with: every key with unit, range, default and meaning; what has a default is commented
    out. Beside it rail-fem.schema.json, by which editors complete keys."""
    from rail_fem.case.schema import SCHEMA_FILE, write_schema
    from rail_fem.case.template import template
    from rail_fem.files.atomic import write_text_atomically
    from rail_fem.hierarchy import MODELS

    unknown = [name for name in model if name not in MODELS]
    if unknown:
        stop(f"no model {', '.join(unknown)}: choose from {', '.join(MODELS)}")
    try:
        if file.exists():
            stop(f"{file} is there already: remove it or give another name")
        write_text_atomically(file, "\n".join([f"#:schema ./{SCHEMA_FILE}", *template(model)]) + "\n")
        write_schema(file.parent / SCHEMA_FILE)
    except OSError as error:
        stop(f"{file}: cannot be written: {error.strerror}")
    say(
        f"{file}: change it, then 'rail-fem check {file}' and 'rail-fem run {file} --model {model[0]} --out"
        f" runs/{file.stem}'"
    )


def doctor(as_json: JsonOption = False) -> None:
    """Check this installation: versions, dolfinx, MPI on two ranks, gmsh, numba, rendering without a display."""
    from rail_fem.run.doctor import tell

    raise typer.Exit(tell(as_json))
