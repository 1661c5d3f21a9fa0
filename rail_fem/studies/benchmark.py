"""Speed of the explicit model on this machine: its kernels, a step of its pass, ranks, a card. What a light pass costs
stands in its result.

    rail-fem study benchmark --out bench                                    kernels, and a step of the reference pass
    rail-fem study benchmark step --size 0.7 --aspect 2 --wheel-ratio 1.5   the step alone, on the main job's elements
    rail-fem study benchmark card --size 0.7 --aspect 2 --wheel-ratio 1.5   the main job's elements on a card
    mpirun -n 2 python -m mpi4py -m rail_fem study benchmark ranks --size 2 --steps 300

kernels  elements a second, on cubes in and beyond the cache, beside dolfinx's own assembly of the elastic force, and
         both limits of a core (the roofline of Williams, Waterman and Patterson, Comm. ACM 52 (2009) 65)
step     what a step consists of, from the static contact on: each part less its inner parts and what the clock takes
ranks    the critical path of a step: a step is work between messages, and all ranks must have come before a message
         ends, so that a stretch of work takes what the slowest rank takes and a message what the rank takes in it that
         came last. Steps of the pass shared by the ranks are taken in turn with those of the whole pass on each rank;
         medians over steps with the same messages. Efficiency: work of a step on one rank over ranks times the path
card     a step of the pass by a graphics card beside a core, and its limits; a sentence where there is none

All times are processor times, the least of several repeats where a row can be repeated: other programs on a machine
then change little.
"""

import logging
import platform
import time
from collections import defaultdict
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Annotated, Any, NamedTuple, cast

import numpy as np
import typer
from mpi4py import MPI

from rail_fem.case.casefile import load_case
from rail_fem.case.examples import example
from rail_fem.fe import dynamics as dynamics_module
from rail_fem.fe import supports as supports_module
from rail_fem.fe.contact import contact as contact_module
from rail_fem.fe.contact import forces as contact_kernels
from rail_fem.fe.contact.contact import Contact
from rail_fem.fe.contact.search import PairSearch
from rail_fem.fe.dynamics import Dynamics
from rail_fem.fe.halo import Halo
from rail_fem.fe.passage import build_passage
from rail_fem.fe.plan.travelling_window import with_window
from rail_fem.fe.recorder import Recorder
from rail_fem.fe.run import Run
from rail_fem.fe.running import running_of
from rail_fem.fe.structure import Structure
from rail_fem.fe.supports import Supports
from rail_fem.fe.window import TravellingWindow
from rail_fem.models.fe_full import positioned_mesh
from rail_fem.result.versions import versions
from rail_fem.settings.explicit import FeSettings
from rail_fem.show.table_and_figure import Table, publish
from rail_fem.studies import benchmark_kernels as kernels
from rail_fem.studies.benchmark_card import card_table
from rail_fem.studies.harness import OUT, QUICK

WAITING = "waiting for messages"
END_OF_STEP = "end of the step"
MESSAGES = {"Allreduce": "sum over the ranks", "allreduce": "sum of a few numbers", "allgather": "words of all ranks"}
TRIALS = 20000  # of the clock
TURN = 30  # steps of one pass before those of the other
# what is timed: part, owner, methods; time within an inner part is the inner part's
PARTS: tuple[tuple[str, Any, tuple[str, ...]], ...] = (
    ("kernels of wing and nose", Structure, ("add_internal_force",)),
    ("kernels of the wheel", Structure, ("_add_small_force",)),
    ("searches of contact", PairSearch, ("search",)),
    ("projections", PairSearch, ("project",)),
    ("positions of contact", Contact, ("ready", "pack")),
    ("pressures and forces of contact", Contact, ("add_forces",)),
    ("energies", Dynamics, ("_energies",)),
    ("rest of checks and rows", Dynamics, ("check",)),
    ("rest of checks and rows", Recorder, ("row",)),
    ("overlap", Contact, ("overlap",)),
    ("rigid groups, springs, dampers", Supports, ("advance", "drift")),
    ("travelling window", TravellingWindow, ("advance",)),
    ("travelling window", Dynamics, ("follow",)),
    ("sums of forces", Recorder, ("after_step",)),
    ("exchange of ghosts", Halo, ("sum_up",)),
    ("motion of the nodes", dynamics_module, ("kick", "drift", "drift_nodes")),
    ("motion of the nodes", contact_module, ("apply_contact",)),
    ("all else", Dynamics, ("step",)),
    ("all else", Run, ("_step",)),
    ("rigid groups, springs, dampers", supports_module, ("group_reactions", "impose_velocities")),
    ("projections", contact_kernels, ("predict",)),
)


class Stopwatch:
    """Processor time of nested parts, each without its inner ones and without what the clock itself takes [s]. calls :
    of each part"""

    def __init__(self) -> None:
        self.spent: dict[str, float] = defaultdict(float)
        self.calls: dict[str, int] = defaultdict(int)
        self._inner = [0.0]
        self.within = self.around = 0.0  # what a timed call takes of the clock's own, in it and in the caller [s]
        empty = self.timed("", lambda: None)
        start = time.process_time()
        for _ in range(TRIALS):
            empty()
        self.around = (time.process_time() - start) / TRIALS
        self.within = self.spent[""] / TRIALS
        self.clear()

    def timed(self, part: str, function: Callable) -> Callable:
        """The function with its time added to a part."""

        def run(*arguments, **options):
            start = time.process_time()
            self._inner.append(0.0)
            try:
                return function(*arguments, **options)
            finally:
                whole = time.process_time() - start
                self.spent[part] += whole - self._inner.pop() - self.within
                self._inner[-1] += whole - self.within + self.around
                self.calls[part] += 1

        return run

    def clear(self) -> None:
        self.spent.clear()
        self.calls.clear()
        self._inner[:] = [0.0]


class Stretch(NamedTuple):
    """Work of a rank up to a message, and what it takes in the message [s of the processor]."""

    message: str
    work: float
    inside: float


class Log:
    """Stretches of a rank, step by step."""

    def __init__(self) -> None:
        self.steps: list[list[Stretch]] = []
        self._since = 0.0

    def step(self, run: Run) -> None:
        """Take one, logged."""
        self.steps.append([])
        self._since = time.thread_time()
        run._step()
        self.steps[-1].append(Stretch(END_OF_STEP, time.thread_time() - self._since, 0.0))

    def timed(self, name: str, send: Callable) -> Callable:
        """A message, logged."""

        def run(*arguments, **options):
            start = time.thread_time()
            try:
                return send(*arguments, **options)
            finally:
                now = time.thread_time()
                self.steps[-1].append(Stretch(name, start - self._since, now - start))
                self._since = time.thread_time()

        return run


class Watched(MPI.Intracomm):
    """A communicator whose collective calls are timed: one of MPI's own takes no other calls than its own."""


def watch_messages(run: Run, watch: Stopwatch | Log, names: dict[str, str]) -> None:
    """Time the collective calls of this pass from now on."""
    dynamics, comm = run.dynamics, Watched(run.comm)
    for call, words in names.items():
        setattr(comm, call, watch.timed(words, getattr(comm, call)))
    dynamics.comm = dynamics.contact.surfaces.comm = comm
    if dynamics.window is not None:
        dynamics.window.comm = comm


class Stretches(NamedTuple):
    """Of steps with the same messages, medians [s]: how many steps; message at the end of each stretch; work of each
    rank (ranks, k), of the slowest (k,), and in the message (k,)."""

    steps: int
    messages: tuple[str, ...]
    work: np.ndarray
    slowest: np.ndarray
    inside: np.ndarray

    @property
    def length(self) -> float:
        """Of a step [s]: the slowest rank's work and the messages."""
        return float(self.slowest.sum() + self.inside.sum())


def critical_paths(logs: list[list[list[Stretch]]]) -> list[Stretches]:
    """Paths of each kind of step, the most frequent first. logs : of each rank, of each step, its stretches. Errors:
    ValueError where ranks have not the same messages."""
    kinds: dict[tuple[str, ...], list[np.ndarray]] = defaultdict(list)
    for of_ranks in zip(*logs):
        names = {tuple(s.message for s in stretches) for stretches in of_ranks}
        if len(names) > 1:
            raise ValueError(f"ranks have not the same messages in a step: {' / '.join(map(str, names))}")
        kinds[names.pop()].append(np.array([[[s.work, s.inside] for s in stretches] for stretches in of_ranks]))
    out = []
    for messages, steps in sorted(kinds.items(), key=lambda kind: -len(kind[1])):
        times = np.array(steps)  # (steps, ranks, k, 2)
        slowest, inside = np.median(times[..., 0].max(axis=1), axis=0), np.median(times[..., 1].min(axis=1), axis=0)
        out.append(Stretches(len(steps), messages, np.median(times[..., 0], axis=0), slowest, inside))
    return out


def mean_length(paths: list[Stretches]) -> float:
    """Of a step, over all kinds [s]."""
    return sum(path.steps * path.length for path in paths) / sum(path.steps for path in paths)


def length_of_work(paths: list[Stretches]) -> float:
    """Mean work of a rank in a step, over all kinds [s]."""
    return sum(path.steps * path.work.sum(axis=1).mean() for path in paths) / sum(path.steps for path in paths)


class TimedPass(NamedTuple):
    """Which pass: size of its elements, in the wheel over that in the rail, along over across; steps that are not
    timed and that are."""

    case: Path
    size: float
    aspect: float
    wheel_ratio: float
    before: int
    steps: int

    def at_rest(self, comm: MPI.Intracomm) -> Run:
        """In its static contact at x = 290 mm, no step taken. Collective on the world."""
        case = load_case(self.case)
        changes = {"element_size": self.size, "element_aspect": self.aspect, "wheel_element_ratio": self.wheel_ratio}
        changes |= {"start": 0.29, "end": 0.43}
        settings = cast(FeSettings, case.runs["fe_full"]).model_copy(update=changes)
        settings = with_window(case.scene, settings)
        running = running_of(case.scene, settings)
        mesh, _, datum, _ = positioned_mesh(case.scene, settings, running, None, False, {})
        if comm.size < MPI.COMM_WORLD.size:
            mesh = MPI.COMM_WORLD.bcast(mesh)
        run = Run(
            comm, case.scene, settings, build_passage(comm, case.scene, settings, running, mesh, datum), None, None
        )
        run.begin()
        for _ in range(self.before):
            run._step()
        return run


def step_table(chosen: TimedPass) -> Table:
    """Of each part the processor time of all ranks and its share of a step, waiting for other ranks apart.
    Collective."""
    world, watch, run = MPI.COMM_WORLD, Stopwatch(), chosen.at_rest(MPI.COMM_WORLD)
    for part, owner, names in PARTS:
        for name in names:
            setattr(owner, name, watch.timed(part, getattr(owner, name)))
    if world.size > 1:
        watch_messages(run, watch, dict.fromkeys(("Allreduce", "allreduce", "allgather"), WAITING))
    dynamics, pairs = run.dynamics, 0
    watch.clear()
    updates = dynamics.updates
    for _ in range(chosen.steps):
        run._step()
        pairs += sum(len(side.slaves) for side in dynamics.contact.pairs)
    parts = [*dict.fromkeys(part for part, *_ in PARTS), WAITING]
    spent = {part: 1e6 * world.allreduce(watch.spent[part]) / chosen.steps for part in parts}
    total = sum(spent.values())
    searches = chosen.steps / max(watch.calls["searches of contact"], 1)
    title = (
        f"A step on {world.size} rank(s): {total:.0f} us, {(dynamics.updates - updates) / chosen.steps:.0f} elements"
        f" computed, {pairs / chosen.steps:.0f} pairs, {searches:.1f} steps from search to search"
    )
    return Table(
        ["part", "us a step, all ranks", "share"], [[p, v, f"{v / total:.1%}"] for p, v in spent.items()], title
    )


def ranks_table(chosen: TimedPass) -> Table:
    """Critical path of a plain step, and the efficiency. Collective."""
    world = MPI.COMM_WORLD
    shared, alone = chosen.at_rest(world), chosen.at_rest(MPI.COMM_SELF)
    of_shared, of_alone = Log(), Log()
    watch_messages(shared, of_shared, MESSAGES)
    exchange = "sum_up"
    setattr(shared.dynamics.halo, exchange, of_shared.timed(exchange, shared.dynamics.halo.sum_up))
    for _ in range(0, chosen.steps, TURN):
        for run, log in ((shared, of_shared), (alone, of_alone)):
            world.barrier()
            for _ in range(TURN):
                log.step(run)
    paths = critical_paths(world.allgather(of_shared.steps))
    return path_table(paths, world.allreduce(mean_length(critical_paths([of_alone.steps]))) / world.size, world.size)


def path_table(paths: list[Stretches], alone: float, ranks: int) -> Table:
    """alone : mean work of a step on one rank [s], mean of the ranks"""
    plain, length = paths[0], mean_length(paths)
    columns = [*plain.work, plain.slowest, plain.inside]
    rows = [[name, *(1e6 * float(own[k]) for own in columns)] for k, name in enumerate(plain.messages)]
    rows.append(["together", *(1e6 * float(own.sum()) for own in columns)])
    head = ["work up to [us]", *(f"rank {rank}" for rank in range(ranks)), "slowest", "in the message"]
    title = (
        f"{plain.steps} of {sum(path.steps for path in paths)} steps are plain. A step of all kinds:"
        f" {1e6 * length:.0f} us on {ranks} rank(s), {1e6 * alone:.0f} us on one, efficiency"
        f" {alone / (ranks * length):.1%}; without what is"
        f" waited for the slowest rank {alone / (ranks * length_of_work(paths)):.1%}"
    )
    return Table(head, rows, title)


def main(
    part: Annotated[str, typer.Argument(help="kernels, step, ranks or card; none: kernels and step")] = "",
    case: Annotated[Path | None, typer.Option(help="case of the pass; none: the shipped nose transfer")] = None,
    size: Annotated[float, typer.Option(help="of the pass' elements [mm]", min=0.1)] = 4.0,
    aspect: Annotated[float, typer.Option(help="length of an element over its size")] = 1.0,
    wheel_ratio: Annotated[float, typer.Option(help="size in the wheel over that in the rail")] = 1.0,
    before: Annotated[int, typer.Option(help="steps that are not timed")] = 50,
    steps: Annotated[int, typer.Option(help="steps that are timed")] = 600,
    quick: QUICK = False,
    out: OUT = None,
) -> None:
    """Speed of the explicit model on this machine: kernels, a step of a pass, ranks."""
    logging.disable(logging.INFO)  # the compiler's own account of the assembled forms
    if part not in ("", "kernels", "step", "ranks", "card"):
        raise typer.BadParameter(f"{part}: no such part; there are kernels, step, ranks, card")
    chosen = TimedPass(
        case or example("nose_transfer"), 1e-3 * (6.0 if quick else size), aspect, wheel_ratio, before,
        2 * TURN if quick else steps,
    )  # fmt: skip
    makers: dict[str, Callable[[], Table]] = {
        "kernels": lambda: kernels.kernel_table(kernels.QUICK if quick else kernels.Effort()),
        "step": lambda: step_table(chosen),
        "ranks": lambda: ranks_table(chosen),
        "card": lambda: card_table(partial(chosen.at_rest, MPI.COMM_SELF), chosen.steps),
    }
    tables = [makers[name]() for name in ([part] if part else ["kernels", "step"])]
    if MPI.COMM_WORLD.rank == 0:
        found = versions()
        told = ", ".join(f"{name} {found[name]}" for name in ("python", "numpy", "numba", "dolfinx"))
        publish("benchmark", out, tables, note=f"{platform.processor() or platform.machine()}, {told}. Float64.")
