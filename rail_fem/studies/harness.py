"""What all studies share: their options, and how long something takes."""

import time
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, TypeVar

import typer

OUT = Annotated[Path | None, typer.Option("--out", help="folder for tables (.md, .csv) and figure (.png)")]
QUICK = Annotated[bool, typer.Option("--quick", help="a look in short time")]

Answer = TypeVar("Answer")


def spent(action: Callable[[], Answer]) -> tuple[float, Answer]:
    """Processor time of this process for it [s], and its answer."""
    began = time.process_time()
    answer = action()
    return time.process_time() - began, answer


def least(action: Callable[[], Answer], rounds: int = 3, budget: float = 0.0) -> tuple[float, Answer]:
    """The least of so many rounds or more, as many as come within a budget [s], and the last answer."""
    times: list[float] = []
    while len(times) < rounds or sum(times) < budget:
        seconds, answer = spent(action)
        times.append(seconds)
    return min(times), answer
