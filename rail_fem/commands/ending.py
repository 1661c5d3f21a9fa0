"""How a command speaks and ends: on rank 0 alone, as loudly as asked for, with one of the exit codes below."""

import contextlib
import io
import os
import sys
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, NoReturn

import typer

from rail_fem.processes import launcher
from rail_fem.processes.progress import print_on

DONE, RUN_FAILED, REFUSED = 0, 1, 2
EXIT_CODES = {
    DONE: "done",
    RUN_FAILED: "a run failed, or doctor found a fault",
    REFUSED: "refused: the input or the arguments are at fault, nothing was run; the message says why",
    130: "stopped by Ctrl-C (143: by a queue's SIGTERM); 'run --restart' goes on",
}


@dataclass
class Manner:
    """What is said: the answer always; what goes on unless quiet; more when verbose; as_json: the answer as one JSON
    object on standard output and all else on standard error."""

    quiet: bool = False
    verbose: bool = False
    as_json: bool = False


MANNER = Manner()


def begin(quiet: bool, verbose: bool) -> None:
    """Each command begins anew."""
    MANNER.quiet, MANNER.verbose, MANNER.as_json = quiet, verbose and not quiet, False
    if isinstance(sys.stdout, io.TextIOWrapper):  # a file's name may hold what no text can
        sys.stdout.reconfigure(errors="backslashreplace")


def choose_json(wanted: bool) -> bool:
    """Callback of --json."""
    MANNER.as_json = wanted
    return wanted


def say(text: str) -> None:
    """The answer, in words; where JSON is asked for `emit` gives it."""
    if launcher.rank() == 0 and not MANNER.as_json:
        print_on(sys.stdout, text, BrokenPipeError)


def tell(text: str) -> None:
    """What goes on: not said when quiet."""
    if launcher.rank() == 0 and not MANNER.quiet:
        print_on(sys.stderr if MANNER.as_json else sys.stdout, text)


def warn(text: str) -> None:
    """What is doubtful, on standard error, also when quiet."""
    if launcher.rank() == 0:
        typer.echo(text, err=True)


def explain(text: str) -> None:
    """More about it, on standard error: said when verbose only."""
    if launcher.rank() == 0 and MANNER.verbose:
        typer.echo(text, err=True)


def emit(answer: Mapping[str, Any]) -> None:
    """The answer as one JSON object, where it is asked for: strict, null for what is not known."""
    from rail_fem.files.strict_json import dumps

    if launcher.rank() == 0 and MANNER.as_json:
        print_on(sys.stdout, dumps(answer), BrokenPipeError)


@contextlib.contextmanager
def aside() -> Iterator[None]:
    """What is printed meanwhile goes to standard error where the answer is JSON, nowhere when quiet."""
    if not (MANNER.as_json or MANNER.quiet):
        yield
    elif MANNER.quiet:
        with open(os.devnull, "w", encoding="utf-8") as nowhere, contextlib.redirect_stdout(nowhere):
            yield
    else:
        with contextlib.redirect_stdout(sys.stderr):
            yield


def stop(fault: str | Exception, code: int = REFUSED) -> NoReturn:
    """End with a fault that all ranks have met: its words on rank 0's standard error, the same exit code on every
    rank; {"fault": text, "exit_code": code} on standard output where JSON is asked for."""
    text = in_words(fault)
    if launcher.rank() == 0:
        typer.echo(text, err=True)
    emit({"fault": text, "exit_code": code})
    launcher.end_together()
    raise typer.Exit(code)


class refusing:
    """`with refusing(): ...`: a fault of these kinds, a ValueError or OSError where none are named, ends the program as
    `stop` does."""

    def __init__(self, *kinds: type[Exception]):
        self.kinds = kinds or (ValueError, OSError)

    def __enter__(self) -> None:
        """Nothing is held."""

    def __exit__(self, kind: Any, error: BaseException | None, trace: Any) -> None:
        if isinstance(error, self.kinds):
            stop(error)


def in_words(fault: str | Exception) -> str:
    """Its sentence; of a file that the system refuses "FILE: No such file or directory", without the number."""
    if isinstance(fault, OSError) and fault.filename and fault.strerror:
        return f"{fault.filename}: {fault.strerror}"
    return str(fault)


def stop_run(text: str) -> NoReturn:
    """End after a fault in the run, with this rank's words: when all ranks meet it the root ends the job before the
    others speak."""
    typer.echo(text if launcher.rank() == 0 else f"rank {launcher.rank()}: {text}", err=True)
    raise typer.Exit(RUN_FAILED)
