"""The command line: check | run | show | compare | sweep | report | profile | doctor. Every command says what it found
and ends non-zero on a fault."""

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from rail_fem import launcher
from rail_fem.case.casefile import Case, CaseError, load_case
from rail_fem.case.variations import VariationError, read_settings
from rail_fem.commands import contact as pair
from rail_fem.commands import start
from rail_fem.commands.damage import damage
from rail_fem.commands.design import design
from rail_fem.commands.ending import say, stop, stop_run
from rail_fem.commands.export import export
from rail_fem.commands.measured import low_pass, measured
from rail_fem.commands.show_sweep import is_sweep, show_sweep, tell_sweep
from rail_fem.commands.study import study
from rail_fem.commands.sweep import SetOption, sweep
from rail_fem.output.versions import own_version

app = typer.Typer(
    help="What happens when a wheel passes a railway crossing.",
    no_args_is_help=True,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
)
app.command("list")(start.names)
app.command()(start.init)
app.command()(pair.contact)
app.command()(pair.patch)
app.command()(damage)
app.command()(sweep)
app.command()(design)
app.command()(measured)
app.command("low-pass")(low_pass)
app.command()(export)
app.command(context_settings={"allow_extra_args": True, "ignore_unknown_options": True, "help_option_names": []})(study)


def _version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"rail-fem {own_version()}")
        raise typer.Exit


@app.callback()
def _program(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="say the version and end")
    ] = False,
) -> None:
    """What happens when a wheel passes a railway crossing.

    Exit codes: 0 done, 1 a run failed, 2 refused: the input says why.
    """


CaseArgument = Annotated[Path, typer.Argument(metavar="CASE", help="case file (TOML), e.g. cases/nose_transfer.toml")]
ModelOption = Annotated[
    str | None, typer.Option("--model", help="which [run.MODEL] of the case; needed when it has several")
]


def read_case(path: Path, model: str | None, settings: list[str] | None = None) -> tuple[Case, str]:
    """The case with what --set changes and the name of the model to run; ends the program on a fault."""
    try:
        changes = read_settings(settings or ())
        case = launcher.on_root(lambda: load_case(path, changes))  # once for all ranks: they work on the same content
    except (CaseError, VariationError) as error:
        stop(str(error))
    if model is None and len(case.runs) > 1:
        stop(f"{path}: has [run.*] for {', '.join(case.runs)}: choose one with --model")
    if not case.runs:
        stop(f"{path}: has no table [run.MODEL], only [damage]: see 'rail-fem damage --help'")
    model = model or next(iter(case.runs))
    if model not in case.runs:
        stop(f"{path}: has no [run.{model}], only {', '.join(case.runs)}")
    return case, model


@app.command()
def check(
    case: CaseArgument,
    model: ModelOption = None,
    settings: SetOption = None,
    ranks: Annotated[int, typer.Option(help="ranks to estimate for", min=1)] = 2,
    draw: Annotated[Path | None, typer.Option(help="draw the crossing of the case into this PNG file")] = None,
) -> None:
    """Read a case file and say what it means, what it will cost, and what calls for a warning; nothing is meshed, and
    nothing written but a drawing that is asked for."""
    from rail_fem.show.report import case_report

    loaded, name = read_case(case, model, settings)
    report, errors = case_report(loaded, name, ranks)
    say(report)
    if draw is not None:
        _draw_crossing(loaded, draw)
    if errors:
        stop("\n  ".join([f"{case}: {len(errors)} input error(s)", *errors]))


def _draw_crossing(case: Case, path: Path) -> None:
    """Plan, long section and cross-sections; ends the program where that cannot be done."""
    from rail_fem.show.crossing import crossing_figure
    from rail_fem.show.style import lettering, save

    try:
        with lettering():
            say(f"drawn {save(crossing_figure(case.scene), path)}")
    except (ValueError, OSError) as error:
        stop(f"--draw {path}: {error}")


@app.command()
def run(
    case: CaseArgument,
    out: Annotated[Path, typer.Option("--out", help="folder for everything the run writes")],
    model: ModelOption = None,
    settings: SetOption = None,
    restart: Annotated[bool, typer.Option("--restart", help="go on with the run in the folder")] = False,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="remove the run in the folder first")] = False,
    expected: Annotated[
        str | None, typer.Option("--digest", hidden=True, help="refuse a case of another digest")
    ] = None,
) -> None:
    """Run a case; with mpirun in front, on several ranks. The folder must be empty, or see --restart and
    --overwrite."""
    from rail_fem.output.runfolder import digest, fingerprint
    from rail_fem.run.job import JobError, run_case

    loaded, name = read_case(case, model, settings)
    if expected and expected != digest(fingerprint(name, loaded.scene, loaded.runs[name])):
        stop(f"{case}: the case or its profile file has changed since it was read for this run: start again")
    try:
        failure = run_case(loaded, name, out, restart, overwrite, say)
    except JobError as error:
        stop(str(error))
    if failure:
        stop_run(f"{case}: the run failed: {failure}")


class Figures(StrEnum):
    """Which figures `show` draws."""

    missing = "missing"
    anew = "anew"
    none = "none"


@app.command()
def show(
    folder: Annotated[
        Path, typer.Argument(metavar="DIR", help="folder of a run, or of a sweep, or one that holds runs")
    ],
    figures: Annotated[
        Figures, typer.Option(help="draw those that are missing, all anew, or none (nothing is written then)")
    ] = Figures.missing,
    quantity: Annotated[
        str | None, typer.Option(help="of a sweep: draw this, e.g. 'first impact', against --against")
    ] = None,
    against: Annotated[str | None, typer.Option(help="of a sweep: what varies, e.g. scene.speed or speed")] = None,
    model: Annotated[list[str] | None, typer.Option("--model", help="of a sweep: only this model")] = None,
    out: Annotated[
        Path | None, typer.Option(help="of a sweep: PNG for the figure; default: DIR/figures/QUANTITY_against_KEY.png")
    ] = None,
) -> None:
    """Say what a run or a sweep found, or how far it is; draw figures that are missing, or a quantity against what
    varies."""
    from rail_fem.show.report import folder_report

    if quantity or against:
        show_sweep(folder, quantity, against, model or [], out)
        return
    try:
        if figures != Figures.none and (folder / "result.json").is_file():
            _draw_figures(folder, figures)
        if is_sweep(folder):
            tell_sweep(folder)
        else:
            say(folder_report(folder))
    except (ValueError, OSError) as error:
        stop(str(error))


def _draw_figures(folder: Path, figures: Figures) -> None:
    """Draw; where nothing can be written say so and go on."""
    from rail_fem.show.figures import draw_run

    try:
        draw_run(folder, missing_only=figures == Figures.missing)
    except OSError as error:
        say(f"no figures drawn: {error}")


@app.command()
def compare(
    folders: Annotated[
        list[Path], typer.Argument(metavar="DIR...", help="folders of runs of one scene, or folders that hold such")
    ],
    reference: Annotated[
        Path | None, typer.Option(help="the run that the others are held against; default: the most expensive model")
    ] = None,
    within: Annotated[str | None, typer.Option(help="name the least expensive run within this error, e.g. 5%")] = None,
    quantity: Annotated[str, typer.Option(help="error of what, for --within")] = "first impact",
    out: Annotated[Path | None, typer.Option(help="folder for compare.md and compare.png")] = None,
) -> None:
    """Cost against error of several models of one scene."""
    from rail_fem.show.style import lettering, save
    from rail_fem.sweeps import compare as side_by_side
    from rail_fem.sweeps.cost_figure import cost_figure

    if quantity not in side_by_side.QUANTITIES:
        stop(f"--quantity {quantity}: choose one of {', '.join(side_by_side.QUANTITIES)}")
    limit = None if within is None else share(within, "--within")
    try:
        found = side_by_side.compare(folders, reference)
        text = side_by_side.table(found)
        words = (
            [text]
            + ([side_by_side.advice(found, limit, quantity) + "\n"] if limit is not None else [])
            + [side_by_side.warnings(found)]
        )
        say("\n".join(words).rstrip())
        if out is not None:
            out.mkdir(parents=True, exist_ok=True)
            (out / "compare.md").write_text("\n".join(words), encoding="utf-8")
            with lettering():
                say(str(save(cost_figure(found), out / "compare.png")))
    except (FileNotFoundError, ValueError, OSError) as error:
        stop(str(error))


def share(text: str, option: str) -> float:
    """A relative number above 0, as 5% or 0.05."""
    try:
        value = float(text.removesuffix("%")) / (100 if text.endswith("%") else 1)
    except ValueError:
        stop(f"{option} {text}: not a number; write 5% or 0.05")
    if not 0 < value < 1:
        stop(f"{option} {text}: must lie between 0 and 100 %")
    return value


@app.command()
def report(
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="folder of a sweep: DIR/CASE/MODEL")],
    groups: Annotated[
        Path, typer.Option(help="TOML file of groups of cases and trends, e.g. cases/thesis/trends.toml")
    ],
    out: Annotated[
        Path | None, typer.Option("--out", help="folder for report.md and its figures; default: DIR/report")
    ] = None,
    digest: Annotated[
        Path | None,
        typer.Option(help="instead: this one Markdown file, with the figures named by --show beside it, small"),
    ] = None,
    show: Annotated[
        list[str] | None,
        typer.Option("--show", help="figure of the digest, by its name in the report; may be given several times"),
    ] = None,
) -> None:
    """The page of a sweep: tables, trends in words checked on every model with reasons and controls, figures of each
    group."""
    from rail_fem.sweeps.sweep_page import write_digest, write_page

    try:
        if digest is None:
            say(str(write_page(folder, groups, out or folder / "report")))
        else:
            say(str(write_digest(folder, groups, digest, tuple(show or ()))))
    except (ValueError, OSError) as error:
        stop(str(error))


@app.command()
def profile(
    file: Annotated[
        Path, typer.Argument(metavar="FILE", help="profile: .prw .prr .whl .ban .mpt .slcs or two columns")
    ],
    kind: Annotated[str | None, typer.Option(help="rail or wheel, where the file does not say")] = None,
    unit: Annotated[str | None, typer.Option(help="mm, cm, m or inch, where the file does not say")] = None,
    number: Annotated[int, typer.Option(help="which profile of an .mpt file, which section of a .slcs")] = 1,
    smooth: Annotated[bool, typer.Option(help="take out scatter above 5 um")] = True,
    smoothing: Annotated[
        float | None, typer.Option(help="scatter to take out [um]; default: what the points show")
    ] = None,
    mirror: Annotated[
        bool | None,
        typer.Option(
            "--mirror/--no-mirror",
            help=(
                "of a rail: exchange its sides, or keep them; default: kept, with a warning where its shape speaks"
                " against it"
            ),
        ),
    ] = None,
    flange_back: Annotated[float | None, typer.Option(help="of a wheel: y of its flange back in the file [mm]")] = None,
    origin: Annotated[
        str,
        typer.Option(
            help="of a rail, what becomes (0, 0): crown (height only), file (its own zero), or y,z in the file [mm]"
        ),
    ] = "crown",
    picture: Annotated[Path | None, typer.Option(help="draw it into this file")] = None,
    write: Annotated[Path | None, typer.Option(help="write the repaired profile: .prr .prw .txt .csv")] = None,
) -> None:
    """Profile doctor: what a profile file holds, what was repaired, what is refused; with a picture where one is asked
    for."""
    from geometry.profiles.doctor import examine
    from geometry.profiles.figure import draw_diagnosis
    from geometry.profiles.formats.by_suffix import read_raw, write_profile
    from geometry.profiles.formats.units import UNITS

    if unit is not None and unit not in UNITS:
        stop(f"--unit {unit}: known are {', '.join(UNITS)}")
    try:
        found = examine(
            read_raw(file, kind, UNITS.get(unit), number),
            smooth,
            smoothing=None if smoothing is None else smoothing * 1e-6,
            mirror=mirror,
            flange_back=None if flange_back is None else flange_back * 1e-3,
            origin=origin_of(origin),
        )
        say(f"{file}\n{found.report()}")
        if picture is not None:
            say(f"  drawn   {draw_diagnosis(found, picture)}")
        if write is not None:
            write_profile(write, found.profile.points, found.kind, f"from {file.name}")
            say(f"  written {write}")
    except (ValueError, OSError) as error:
        stop(f"refused: {error}")


def origin_of(text: str) -> str | tuple[float, float]:
    """--origin as geometry.profiles.doctor.examine takes it: a word, or two numbers in mm as a position in m."""
    words = text.split(",")
    if len(words) != 2:
        return text
    try:
        return float(words[0]) * 1e-3, float(words[1]) * 1e-3
    except ValueError:
        stop(f"--origin {text}: crown, file, or two numbers in mm such as 35,-14")


@app.command()
def doctor() -> None:
    """Check this installation: versions, dolfinx, MPI on two ranks, gmsh, numba, rendering without a display."""
    from rail_fem.run.doctor import tell

    raise typer.Exit(tell())


def main() -> None:
    app(prog_name="rail-fem")
