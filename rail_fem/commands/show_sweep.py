"""`rail-fem show` of a sweep: its table, and a figure of any reported quantity against anything that varies."""

from pathlib import Path

from rail_fem.commands.ending import say, stop


def is_sweep(folder: Path) -> bool:
    """Whether results lie two folders below: DIR/CASE/MODEL."""
    own = any((folder / name).is_file() for name in ("result.json", "status.json"))
    return not own and not any(folder.glob("*/result.json")) and any(folder.glob("*/*/result.json"))


def tell_sweep(folder: Path) -> None:
    """Print the table. Errors: ValueError, OSError as reading them."""
    from rail_fem.sweeps.results import load_sweep

    found = load_sweep(folder)
    runs = sum(len(found[case]) for case in found)
    varied = ", ".join(found.varied) or "nothing"
    say("\n".join([f"{folder}: {len(found)} cases, {runs} runs; varies: {varied}", "", found.to_markdown().rstrip()]))
    for sentence in found.unusable:
        say(f"left out: {sentence}")


def show_sweep(folder: Path, quantity: str | None, against: str | None, models: list[str], out: Path | None) -> None:
    """Draw a quantity against what varies; ends the program where one of the two is missing or unknown."""
    from rail_fem.show.style import lettering, save
    from rail_fem.sweeps.results import load_sweep

    if not quantity or not against:
        stop("give both --quantity and --against")
    name = f"{quantity}_against_{against}.png".replace(" ", "_").replace("/", "_")
    try:
        with lettering():
            figure = load_sweep(folder).plot(quantity, against, tuple(models))
            say(str(save(figure, out or folder / "figures" / name)))
    except (ValueError, OSError) as error:
        stop(str(error))
