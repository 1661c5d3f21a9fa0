"""Speed of the explicit model on this machine: its kernels, a step of its pass, a card. What a light pass costs
stands in its result.

    rail-fem study benchmark --out bench                                    kernels, and a step of the reference pass
    rail-fem study benchmark step --size 0.7 --aspect 2 --wheel-ratio 1.5   the step alone, on the main job's elements
    rail-fem study benchmark card --size 0.7 --aspect 2 --wheel-ratio 1.5   the main job's elements on a card
    mpirun -n 2 python -m mpi4py -m rail_fem study benchmark step --size 2  a step of two ranks, with their waiting

kernels  elements a second, on cubes in and beyond the cache, beside dolfinx's own assembly of the elastic force, and
         both limits of a core (the roofline of Williams, Waterman and Patterson, Comm. ACM 52 (2009) 65)
step     what a step consists of, from the static contact on: each part less its inner parts and what the clock takes,
         of all ranks together; efficiency of n ranks: a step on one over that
card     a step of the pass by a graphics card beside a core, and its limits; a sentence where there is none

All times are processor times, the least of several repeats where a row can be repeated: other programs on a machine
then change little.
"""

import platform
import time
from collections import defaultdict
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any, NamedTuple, cast

import typer
from mpi4py import MPI

from rail_fem.case.casefile import load_case
from rail_fem.case.examples import example
from rail_fem.fe import dynamics as dynamics_module
from rail_fem.fe import supports as supports_module
from rail_fem.fe.contact import contact as contact_module
from rail_fem.fe.contact import forces as contact_kernels
from rail_fem.fe.contact.contact import Contact
from rail_fem.fe.contact.messages import ContactMessages
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
TRIALS = 20000  # of the clock
# what is timed: part, owner, methods; time within an inner part is the inner part's
PARTS: tuple[tuple[str, Any, tuple[str, ...]], ...] = (
    ("kernels of wing and nose", Structure, ("add_finite_force",)),
    ("kernels of the wheel", Structure, ("_add_small_force",)),
    ("searches of contact", PairSearch, ("search",)),
    ("projections", PairSearch, ("project",)),
    ("positions and forces of contact between ranks", Contact, ("ready", "begin", "end")),
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
    (WAITING, ContactMessages, ("send", "take", "sent")),
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


class Watched(MPI.Intracomm):
    """A communicator whose collective calls are timed: one of MPI's own takes no other calls than its own."""


def watch_messages(run: Run, watch: Stopwatch) -> None:
    """Time the collective calls of this pass from now on."""
    dynamics, comm = run.dynamics, Watched(run.comm)
    for call in ("Allreduce", "allreduce", "allgather"):
        setattr(comm, call, watch.timed(WAITING, getattr(comm, call)))
    dynamics.comm = dynamics.contact.surfaces.comm = comm
    if dynamics.window is not None:
        dynamics.window.comm = comm


class TimedPass(NamedTuple):
    """Which pass: size of its elements, in the wheel over that in the rail, along over across; steps that are not
    timed and that are."""

    case: Path
    size: float
    aspect: float
    wheel_ratio: float
    before: int
    steps: int

    def at_rest(self) -> Run:
        """In its static contact at x = 290 mm, no step taken. Collective."""
        case = load_case(self.case)
        changes = {"element_size": self.size, "element_aspect": self.aspect, "wheel_element_ratio": self.wheel_ratio}
        changes |= {"start": 0.29, "end": 0.43}
        settings = cast(FeSettings, case.runs["fe_full"]).model_copy(update=changes)
        settings = with_window(case.scene, settings)
        running = running_of(case.scene, settings)
        mesh, _, datum, _ = positioned_mesh(case.scene, settings, running, None, False, {})
        comm = MPI.COMM_WORLD
        passage = build_passage(comm, case.scene, settings, running, mesh, datum)
        run = Run(comm, case.scene, settings, passage, None, None)
        run.begin()
        for _ in range(self.before):
            run._step()
        return run


def step_table(chosen: TimedPass) -> Table:
    """Of each part the processor time of all ranks and its share of a step, waiting for other ranks apart.
    Collective."""
    world, watch, run = MPI.COMM_WORLD, Stopwatch(), chosen.at_rest()
    for part, owner, names in PARTS:
        for name in names:
            setattr(owner, name, watch.timed(part, getattr(owner, name)))
    if world.size > 1:
        watch_messages(run, watch)
    dynamics, pairs = run.dynamics, 0
    watch.clear()
    updates = dynamics.updates
    for _ in range(chosen.steps):
        run._step()
        pairs += sum(len(side.slaves) for side in dynamics.contact.pairs)
    parts = list(dict.fromkeys(part for part, *_ in PARTS))
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


def main(
    part: Annotated[str, typer.Argument(help="kernels, step or card; none: kernels and step")] = "",
    case: Annotated[Path | None, typer.Option(help="case of the pass; none: the shipped nose transfer")] = None,
    size: Annotated[float, typer.Option(help="of the pass' elements [mm]", min=0.1)] = 4.0,
    aspect: Annotated[float, typer.Option(help="length of an element over its size")] = 1.0,
    wheel_ratio: Annotated[float, typer.Option(help="size in the wheel over that in the rail")] = 1.0,
    before: Annotated[int, typer.Option(help="steps that are not timed")] = 50,
    steps: Annotated[int, typer.Option(help="steps that are timed")] = 600,
    quick: QUICK = False,
    out: OUT = None,
) -> None:
    """Speed of the explicit model on this machine: kernels, a step of a pass, a card."""
    if part not in ("", "kernels", "step", "card"):
        raise typer.BadParameter(f"{part}: no such part; there are kernels, step, card")
    chosen = TimedPass(
        case or example("nose_transfer"), 1e-3 * (6.0 if quick else size), aspect, wheel_ratio, before,
        60 if quick else steps,
    )  # fmt: skip
    makers: dict[str, Callable[[], Table]] = {
        "kernels": lambda: kernels.kernel_table(kernels.QUICK if quick else kernels.Effort()),
        "step": lambda: step_table(chosen),
        "card": lambda: card_table(chosen.at_rest, chosen.steps),
    }
    tables = [makers[name]() for name in ([part] if part else ["kernels", "step"])]
    if MPI.COMM_WORLD.rank == 0:
        found = versions()
        told = ", ".join(f"{name} {found[name]}" for name in ("python", "numpy", "numba", "dolfinx"))
        publish("benchmark", out, tables, note=f"{platform.processor() or platform.machine()}, {told}. Float64.")
