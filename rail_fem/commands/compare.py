"""`rail-fem compare`: cost against error of several models of one scene."""

from pathlib import Path
from typing import Annotated

import typer

from rail_fem.commands.ending import MANNER, emit, refusing, say, stop
from rail_fem.commands.options import JsonOption


def compare(
    folders: Annotated[
        list[Path], typer.Argument(metavar="DIR...", help="folders of runs of one scene, or folders that hold such")
    ],
    reference: Annotated[
        Path | None, typer.Option(help="the run that the others are held against; default: the most expensive model")
    ] = None,
    within: Annotated[str | None, typer.Option(help="name the least expensive run within this error, e.g. 5%")] = None,
    quantity: Annotated[str, typer.Option(help="error of what, for --within")] = "impact on the wheel",
    passes: Annotated[
        str, typer.Option(metavar="PART", help="wearing in or ratchetting of leg, wing or nose: runs of several passes")
    ] = "",
    out: Annotated[Path | None, typer.Option(help="folder for compare.md and compare.png")] = None,
    as_json: JsonOption = False,
) -> None:
    """Cost against error of several models of one scene; damage studies side by side; passes over the same steel."""
    from rail_fem.damage.side_by_side import is_begun
    from rail_fem.show.table_and_figure import write_table_and_figure
    from rail_fem.sweeps import compare as side_by_side
    from rail_fem.sweeps.compare_report import comparison_facts, comparison_text
    from rail_fem.sweeps.cost_figure import cost_figure

    if any(is_begun(folder) for folder in folders):
        compare_studies(folders, out)
        return
    if passes:
        from rail_fem.sweeps.compare_passes import compare_passes

        with refusing():
            compare_passes(folders, passes, out)
        return
    if quantity not in side_by_side.QUANTITIES:
        stop(f"--quantity {quantity}: choose one of {', '.join(side_by_side.QUANTITIES)}")
    limit = None if within is None else share(within, "--within")
    with refusing():
        found = side_by_side.compare(folders, reference)
        text = comparison_text(found, limit, quantity)
        say(text.rstrip())
        if out is not None:
            title = f"# {len(found.names)} runs held against {found.names[found.results.index(found.reference)]}\n"
            drawn = out / "compare.png"
            write_table_and_figure(out / "compare.md", f"{title}\n{text}", drawn, lambda: cost_figure(found))
            say(str(drawn))
        if MANNER.as_json:
            emit(comparison_facts(found, limit, quantity))


def compare_studies(folders: list[Path], out: Path | None) -> None:
    """Damage studies side by side, two of one crossing also by position."""
    from rail_fem.damage.side_by_side import compare_pair, studies_facts, studies_table
    from rail_fem.show.table_and_figure import write_table_and_figure

    with refusing():
        table = studies_table(folders)
        say(table)
        if out is not None:
            write_table_and_figure(out / "compare.md", table)
        if MANNER.as_json:
            emit(studies_facts(folders))
        elif len(folders) == 2 and all(facts["site"] == "crossing" for facts in studies_facts(folders).values()):
            try:
                compare_pair(folders[0], folders[1], out)
            except ValueError as error:
                say(f"not by position: {error}")


def share(text: str, option: str) -> float:
    """A relative number above 0, as 5% or 0.05."""
    from rail_fem.scene.units import QuantityError, parse

    with refusing(QuantityError):
        value, _ = parse(text, "")
    if not 0 < value < 1:
        stop(f"{option} {text}: must lie between 0 and 100 %; write 5% or 0.05")
    return value
