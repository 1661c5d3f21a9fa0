"""What a step of a pass consists of: time of its parts, over a stretch of steps from the static contact on.

    python -m rail_fem.studies.step_shares --size 4 --steps 600
    mpirun -n 2 python -m mpi4py -m rail_fem.studies.step_shares --size 2 --steps 300 [--rounds 8]

Prints a Markdown table: of each part the processor time of all ranks, waiting for other ranks apart, and its share of a
step. --rounds: in place of that, steps of the pass shared by the ranks and of the whole pass on each of them, without a
word to the others, in turn, so many rounds; and the ratio of their times, which is the efficiency against what the
machine can do when all its cores work. --mesh DIR keeps the mesh there for the next time.
"""

from __future__ import annotations

import argparse
import json
import statistics
import sys
import time
from collections import defaultdict
from collections.abc import Callable
from pathlib import Path
from typing import cast

from mpi4py import MPI

from rail_fem.case.casefile import load_case
from rail_fem.fe import dynamics as dynamics_module
from rail_fem.fe.contact import forces as contact_kernels
from rail_fem.fe.contact.contact import Contact
from rail_fem.fe.domain import Domain
from rail_fem.fe.dynamics import Dynamics
from rail_fem.fe.passage import build_passage
from rail_fem.fe.recorder import Recorder
from rail_fem.fe.run import Run
from rail_fem.fe.running import running_of
from rail_fem.fe.structure import Structure
from rail_fem.fe.supports import Supports
from rail_fem.fe.window import TravellingWindow
from rail_fem.models.fe_full import positioned_mesh
from rail_fem.output.markdown import markdown_table
from rail_fem.settings.explicit import FeSettings

CASE = Path("cases/nose_transfer.toml")
KERNELS = (
    ("rigid groups, springs, dampers", dynamics_module, ("group_reactions", "impose_velocity")),
    ("projections", contact_kernels, ("predict",)),
)
WAITING = "waiting for messages"
TRIALS = 20000  # of the clock
# what is timed: part, owner, methods; time within an inner part is the inner part's
PARTS: tuple[tuple[str, type, tuple[str, ...]], ...] = (
    ("element kernels", Structure, ("add_internal_force",)),
    ("searches of contact", Contact, ("search",)),
    ("projections", Contact, ("_project",)),
    ("positions of contact", Contact, ("pack",)),
    ("pressures and forces of contact", Contact, ("add_forces",)),
    ("energies", Dynamics, ("_energies",)),
    ("rest of checks and rows", Dynamics, ("check",)),
    ("rest of checks and rows", Recorder, ("row",)),
    ("overlap", Contact, ("overlap",)),
    ("rigid groups, springs, dampers", Supports, ("advance", "drift")),
    ("rigid groups, springs, dampers", Dynamics, ("_give_group_velocities",)),
    ("travelling window", TravellingWindow, ("advance",)),
    ("travelling window", Dynamics, ("_follow_window",)),
    ("sums of forces", Recorder, ("after_step",)),
    ("exchange of ghosts", Domain, ("sum_to_owner", "copy_to_ghosts")),
    ("motion of the nodes, all else", Dynamics, ("step",)),
    ("motion of the nodes, all else", Run, ("_step",)),
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
        whole = (time.process_time() - start) / TRIALS
        self.within = self.spent[""] / TRIALS
        self.around = whole
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


class Waiting(MPI.Intracomm):
    """A communicator whose sums are timed as waiting."""

    watch: Stopwatch

    def Allreduce(self, *arguments, **options):
        return self.watch.timed(WAITING, super().Allreduce)(*arguments, **options)

    def allreduce(self, *arguments, **options):
        return self.watch.timed(WAITING, super().allreduce)(*arguments, **options)


def watched(watch: Stopwatch) -> None:
    """Time the PARTS from now on."""
    for part, owner, names in PARTS:
        for name in names:
            setattr(owner, name, watch.timed(part, getattr(owner, name)))
    for part, module, names in KERNELS:
        for name in names:
            setattr(module, name, watch.timed(part, getattr(module, name)))


def pass_at_rest(arguments: argparse.Namespace, comm: MPI.Intracomm) -> Run:
    """The pass in its static contact, no step taken. Collective on the world."""
    case = load_case(arguments.case)
    changes = {
        "element_size": arguments.size * 1e-3,
        "element_aspect": arguments.aspect,
        "wheel_element_ratio": arguments.wheel_ratio,
        "start": arguments.start * 1e-3,
        "end": arguments.end * 1e-3,
    }
    settings = cast(FeSettings, case.runs["fe_full"]).model_copy(update=changes)
    running = running_of(case.scene, settings)
    identity = {"case": json.dumps(changes, sort_keys=True)}
    mesh, _, datum, _ = positioned_mesh(case.scene, settings, running, arguments.mesh, True, identity)
    if comm.size < MPI.COMM_WORLD.size:
        mesh = MPI.COMM_WORLD.bcast(mesh)
    run = Run(comm, case.scene, settings, build_passage(comm, case.scene, settings, running, mesh, datum), None, None)
    run.begin()
    return run


def measure(arguments: argparse.Namespace) -> dict[str, object]:
    """Times of the steps, of all ranks [s]. Collective."""
    world, watch = MPI.COMM_WORLD, Stopwatch()
    run = pass_at_rest(arguments, world)
    for _ in range(arguments.before):
        run._step()
    watched(watch)
    Waiting.watch = watch
    d = run.dynamics
    if run.comm.size > 1:
        d.comm = d.contact.comm = Waiting(run.comm)
    pairs = 0
    watch.clear()
    world.barrier()
    start, updates = time.perf_counter(), d.updates
    for _ in range(arguments.steps):
        run._step()
        pairs += sum(len(side.slaves) for side in d.contact.pairs)
    wall = world.allreduce(time.perf_counter() - start, op=MPI.MAX)
    searches = watch.calls["searches of contact"]
    parts = {part: world.allreduce(watch.spent[part]) / arguments.steps for part in dict.fromkeys(p for p, *_ in PARTS)}
    parts[WAITING] = world.allreduce(watch.spent[WAITING]) / arguments.steps
    return {
        "ranks": world.size,
        "wall": wall / arguments.steps,
        "elements": (d.updates - updates) / arguments.steps,
        "pairs": pairs / arguments.steps,
        "steps_between_searches": arguments.steps / max(searches, 1),
        "parts": parts,
        "force": float(d.contact.force[: d.contact.n_rail, 2].sum()),
    }


def efficiencies(arguments: argparse.Namespace) -> dict[str, list[float]]:
    """Of each round the wall time of a step [s], shared by all ranks and of the whole pass on each rank at once, and
    the efficiency. Collective."""
    world = MPI.COMM_WORLD
    shared, alone = pass_at_rest(arguments, world), pass_at_rest(arguments, MPI.COMM_SELF)
    found: dict[str, list[float]] = {"shared": [], "alone": [], "efficiency": []}
    for _ in range(arguments.rounds):
        for name, run in (("shared", shared), ("alone", alone)):
            world.barrier()
            start = time.perf_counter()
            for _ in range(arguments.steps // arguments.rounds):
                run._step()
            mine = (time.perf_counter() - start) / (arguments.steps // arguments.rounds)
            found[name].append(world.allreduce(mine) / world.size)
        found["efficiency"].append(found["alone"][-1] / (world.size * found["shared"][-1]))
    return found


def report(found: dict) -> str:
    total = sum(found["parts"].values())
    rows = [[part, f"{1e6 * spent:.1f}", f"{spent / total:.1%}"] for part, spent in found["parts"].items()]
    head = (
        f"{found['ranks']} rank(s), {found['elements']:.0f} elements computed, {found['pairs']:.0f} pairs,"
        f" {found['steps_between_searches']:.1f} steps from search to search, wall time of a step"
        f" {1e6 * found['wall']:.0f} us, force {found['force']:.6f} N"
    )
    lines = markdown_table(["part", "us a step, all ranks", "share"], rows)
    return "\n".join([head, "", *lines])


def arguments_of(*words: str) -> argparse.Namespace:
    """What the command line says."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--case", type=Path, default=CASE)
    parser.add_argument("--size", type=float, default=4.0, help="of the elements [mm]")
    parser.add_argument("--aspect", type=float, default=1.0, help="length of an element over its size")
    parser.add_argument("--wheel-ratio", type=float, default=1.0, help="size in the wheel over that in the rail")
    parser.add_argument("--start", type=float, default=290.0, help="x of the wheel [mm]")
    parser.add_argument("--end", type=float, default=430.0, help="x of the wheel where the mesh need not go on [mm]")
    parser.add_argument("--before", type=int, default=50, help="steps that are not timed")
    parser.add_argument("--steps", type=int, default=600)
    parser.add_argument("--rounds", type=int, default=0)
    parser.add_argument("--mesh", type=Path, default=None)
    return parser.parse_args(words)


def main() -> None:
    arguments = arguments_of(*sys.argv[1:])
    if arguments.rounds:
        rounds = efficiencies(arguments)
        lines = [
            f"{name}: median {statistics.median(values):.4g}, all {' '.join(f'{value:.4g}' for value in values)}"
            for name, values in rounds.items()
        ]
    else:
        lines = [report(measure(arguments))]
    if MPI.COMM_WORLD.rank == 0:
        print("\n".join(lines))


if __name__ == "__main__":
    main()
