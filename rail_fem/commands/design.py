"""`rail-fem design`: search for a better crossing with a light model, and prove what is found by the explicit one."""

from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from rail_fem.commands.ending import RUN_FAILED, say, stop, tell
from rail_fem.commands.options import PoolOption, SetOption
from rail_fem.processes import launcher

if TYPE_CHECKING:
    from rail_fem.design.problem import Problem
    from rail_fem.processes.pool import Workers


def design(
    file: Annotated[Path, typer.Argument(metavar="DESIGN", help="design file, e.g. cases/design/leg_and_nose.toml")],
    out: Annotated[Path, typer.Option("--out", help="folder of the trials, the report and its figure")],
    workers: Annotated[int, typer.Option(help="trials, or runs that prove, at a time", min=1, max=1024)] = 2,
    pool: PoolOption = "processes",
    begin: Annotated[
        Path | None,
        typer.Option(
            help="folder of a search with other weights: begin with the best of its trials, make half as many"
        ),
    ] = None,
    prove: Annotated[
        int,
        typer.Option(
            help="run fe_full for the start, so many of the best trials, and the best that is worse nowhere",
            min=0,
            max=20,
        ),
    ] = 0,
    rounds: Annotated[
        int,
        typer.Option(
            help="with --prove: so many times search (or inversion) and proof, each corrected by the proofs before",
            min=1,
            max=20,
        ),
    ] = 1,
    settings: SetOption = None,
    finer: Annotated[
        list[str] | None,
        typer.Option(
            help='with --prove: the first pass of start and best at this element size, too, with bars: "2 mm"'
        ),
    ] = None,
    ranks: Annotated[int, typer.Option(help="with --prove: ranks of a run", min=1)] = 1,
    scenes: Annotated[
        int, typer.Option(help="of a file with observations: so many scenes of known truth are found again, too", min=0)
    ] = 0,
) -> None:
    """Vary a case's parameters within bounds and look for what is best over a set of wheels and speeds.

    Seeded; every trial is kept in OUT/trials.csv, and started again the search goes on where it was. --prove runs in
    OUT/proof, goes on there too, and leaves proof.md and proof.png; --set is for these runs alone. --rounds goes on
    from there with the light model's numbers corrected by what the proofs have found, and proves again.

    A file with observations in place of objectives is inverted: how likely each scene is by them, OUT/inversion.md and
    .png. --prove then runs its proven passes in the most likely scene, and corrects the light model by them; with
    --rounds trials go on where the corrected facts make scenes likely, and the most likely of these is proven, too.
    """
    from rail_fem.case.casefile import CaseError
    from rail_fem.case.variations import VariationError, read_settings
    from rail_fem.design.correction import search_and_prove
    from rail_fem.design.problem import DesignError, read_design
    from rail_fem.design.proof import check_proof
    from rail_fem.design.proof_report import write_proof
    from rail_fem.design.search import search, trials_of
    from rail_fem.design.search_report import write_report
    from rail_fem.processes.pool import Lost, PoolError, Workers
    from rail_fem.processes.stopping import AGAIN, last_words
    from rail_fem.result.runfolder import RunFolderError, held

    if launcher.rank_count() > 1:
        stop("design starts mpirun itself, run by run: leave mpirun out and give --ranks")
    if not prove and (settings or finer or rounds > 1):
        given = "--set" if settings else "--finer" if finer else "--rounds"
        stop(f"{given} is for the runs that prove: give --prove, too")
    by = Workers(workers, pool)
    try:
        with last_words(lambda: AGAIN), ExitStack() as holding:
            problem, changes = read_design(file), read_settings(settings or ())
            if prove:
                check_proof(problem, changes, finer or (), ranks)
            if problem.facts and (finer or begin is not None):
                stop("--finer and --begin are of a search: an inversion has neither")
            earlier = trials_of(problem, begin) if begin is not None else []
            holding.enter_context(held(out))
            if problem.facts:
                _invert(problem, out, by, rounds if prove else 0, changes, ranks, scenes)
                return
            if not prove:
                found = search(problem, out, by, say, None, earlier)
                say("\n" + write_report(problem, found, out).rstrip())
                return
            proofs = search_and_prove(problem, out, prove, rounds, by, changes, finer or (), ranks, say, tell, earlier)
            for found, runs in proofs:
                say("\n" + write_report(problem, found, out).rstrip())
                say("\n" + write_proof(problem, runs, out).rstrip())
    except Lost as error:
        stop(f"a task of the search is lost: {error}: start again, it goes on where it was", RUN_FAILED)
    except (PoolError, DesignError, CaseError, VariationError, RunFolderError, OSError) as error:
        stop(error)
    if any(run.fault for run in runs):
        raise typer.Exit(RUN_FAILED)


def _invert(
    problem: "Problem", out: Path, workers: "Workers", rounds: int, settings: dict[str, Any], ranks: int, scenes: int
) -> None:
    """Invert, `rounds` times prove the most likely scene and judge anew, and try scenes of known truth."""
    from rail_fem.design.inversion import covered, invert, judged
    from rail_fem.design.inversion_report import coverage_words, write_inversion
    from rail_fem.design.proof import ProofRun, ProvenShape, prove_design

    found = invert(problem, out, workers, say)
    runs: list[ProofRun] = []
    for number in range(rounds):
        if number:
            found = invert(problem, out, workers, say, found, runs)
        shape = ProvenShape(f"likely_{number}", f"most likely, round {number + 1}", found.likely)
        runs += prove_design(problem, [shape], out, settings=settings, ranks=ranks, say=tell, workers=workers)
        found = judged(problem, found.trials, found.late, found.start, runs)
    say("\n" + write_inversion(problem, found, out).rstrip())
    if scenes:
        say(coverage_words(problem, covered(problem, out, scenes, workers)).rstrip())
