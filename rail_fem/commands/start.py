"""`rail-fem list` and `rail-fem init`: what there is to choose from, and a case file to begin with."""

from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Any

import typer

from geometry.profiles.rail import HEADS
from rail_fem.atomic import write_text_atomically
from rail_fem.case.examples import examples
from rail_fem.case.keys import Key, section_keys
from rail_fem.commands.study import STUDIES
from rail_fem.hierarchy import MODELS
from rail_fem.scene.scene import Scene
from rail_fem.scene.steel import GRADES
from rail_fem.scene.wheel_profile import WHEEL_NAMES

EXAMPLES = {
    "profile": '"P8"',
    "vehicle_sprung_mass": '"66.25 t"',
    "wheelset_unsprung_mass": '"1 t"',
    "stiffness": '"80 kN/mm"',
    "speed": '"75 mph"',
    "direction": '"facing"',
    "grade": '"Mn13"',
}


def names() -> None:
    """What there is: models, wheels, rails, steels, studies."""
    typer.echo("models, from the least to the most expensive")
    for name, model in MODELS.items():
        typer.echo(f"  {name:14s} {model.meaning}{'; on several ranks' if model.parallel else ''}")
    typer.echo(f"wheels     {', '.join(WHEEL_NAMES)}, or the path of a profile file")
    typer.echo(f"rails      {', '.join(HEADS)}, or the path of a profile file")
    typer.echo(f"steels     {', '.join(GRADES)}")
    typer.echo('crossings  UK-cast 1:6 to 1:32 (scene.crossing.ratio), or any by its sections (family = "sections")')
    for name, path in examples().items():
        typer.echo(f"example    {name}: {path}")
    typer.echo("studies")
    for name, study in STUDIES.items():
        typer.echo(f"  {name:18s} {study.meaning}")


def init(
    file: Annotated[Path, typer.Argument(help="case file to write")] = Path("case.toml"),
    model: Annotated[
        list[str], typer.Option("--model", help="models to write sections for; may be given several times")
    ] = ["rigid_hertz", "fe_full"],  # noqa: B006
) -> None:
    """Write a case file to begin with: every key with unit, range, default and meaning; what has a default is commented
    out."""
    unknown = [name for name in model if name not in MODELS]
    if unknown:
        typer.echo(f"no model {', '.join(unknown)}: choose from {', '.join(MODELS)}", err=True)
        raise typer.Exit(2)
    if file.exists():
        typer.echo(f"{file} is there already: remove it or give another name", err=True)
        raise typer.Exit(2)
    try:
        write_text_atomically(file, "\n".join(template(model)) + "\n")
    except OSError as error:
        typer.echo(f"{file}: cannot be written: {error.strerror}", err=True)
        raise typer.Exit(2) from None
    typer.echo(
        f"{file}: change it, then 'rail-fem check {file}' and 'rail-fem run {file} --model {model[0]} --out"
        f" runs/{file.stem}'"
    )


def template(models: list[str]) -> Iterator[str]:
    """Lines of a case file with every key of the scene and of these models."""
    yield 'version = 1\ntitle = "a worn wheel passes a crossing"'
    yield from _section("scene", Scene)
    for model in models:
        yield from _section(f"run.{model}", MODELS[model].settings)


def _section(name: str, section: type, values: Any = None) -> Iterator[str]:
    keys = list(section_keys(section, values))
    yield f"\n[{name}]"
    for key in keys:
        if key.section is None:
            yield _line(key)
    for key in keys:
        if key.section is not None and key.required:
            yield from _section(f"{name}.{key.name}", key.section)
        elif key.section is not None:
            lines = _section(f"{name}.{key.name}", key.section, key.table)
            yield from (line.replace("\n[", "\n# [") if line.startswith(("#", "\n")) else f"# {line}" for line in lines)


def _line(key: Key) -> str:
    about = f"  # {key.meaning}" + (f"; {key.allowed}" if key.allowed else "")
    if key.required and key.default == "required":
        return f"{key.name} = {EXAMPLES[key.name]}{about}"
    plain = key.default in ("true", "false") or (not key.unit and key.default.replace(".", "", 1).isdigit())
    value = key.default if plain else f'"{key.default}"'
    return f"# {key.name} = {value}{about}"
