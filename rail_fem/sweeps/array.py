"""The tasks of a sweep as a list, as one table that fills while they run, and as a job array of a cluster's queue: each
task is this program's call for one case of the folder that all share, with memory, ranks and time as `check` foretells.
"""

import json
import math
import os
import shlex
import sys
from collections.abc import Sequence
from pathlib import Path

from rail_fem.case.estimate import estimate_run, memory_of
from rail_fem.files.atomic import write_text_atomically
from rail_fem.hierarchy import MODELS
from rail_fem.processes.progress import STATUS_FILE, duration, read_status
from rail_fem.result.result import PassResult, load
from rail_fem.settings.explicit import FeSettings
from rail_fem.sweeps.sweep import Job

TASKS = "tasks.json"
FACTOR = 2.0  # by which an estimate may be off
FIRST = 1800.0  # for kernels that are not compiled yet, and for a light model's pass [s]
QUEUES = {
    "slurm": (
        "sbatch",
        "SLURM_ARRAY_TASK_ID",
        "#SBATCH --array=1-{count}\n#SBATCH --ntasks={ranks}\n#SBATCH --cpus-per-task=1\n#SBATCH --mem={memory}M\n"
        "#SBATCH --time={time}\n#SBATCH --output={out}/array-%a.log\n",
    ),
    "pbs": (
        "qsub",
        "PBS_ARRAY_INDEX",
        "#PBS -J 1-{count}\n#PBS -l select=1:ncpus={ranks}:mpiprocs={ranks}:mem={memory}mb\n#PBS -l walltime={time}\n"
        "#PBS -j oe\n#PBS -o {out}/array-^array_index^.log\n",
    ),
}


def write_tasks(jobs: Sequence[Job], out: Path) -> None:
    """The folders of all jobs, beside those that the folder's list has already, for `show --follow`."""
    known = read_tasks(out)
    write_text_atomically(out / TASKS, json.dumps(sorted({*known, *(_words(job) for job in jobs)}), indent=0) + "\n")


def read_tasks(out: Path) -> list[str]:
    """CASE/MODEL of each; none where no sweep has begun there."""
    path = Path(out) / TASKS
    return json.loads(path.read_text(encoding="utf-8")) if path.is_file() else []


def table_so_far(out: Path, known: dict[str, str]) -> tuple[list[str], int]:
    """Lines: how many tasks there are, those that run, those that ended, the last first; and how many have not ended.
    known : CASE/MODEL -> line of what was finished at the last look. Errors: ValueError of a damaged result."""
    tasks, waiting = read_tasks(out), 0
    running: list[str] = []
    ended: list[str] = []
    for name in tasks:
        folder = Path(out) / name
        if name not in known and (folder / "result.json").is_file():
            known[name] = f"{name:<40} finished   {_forces(load(folder))}"
        if name not in known and (folder / STATUS_FILE).is_file():
            told = read_status(folder)
            eta = "" if told["eta"] is None else f", {duration(told['eta'])} left"
            line = f"{name:<40} {told['state']:<10} {told['percent']:.0f} %{eta}  {told['message']}"
            (running if told["state"] == "running" else ended).append(line)
        elif name not in known:
            waiting += 1
    done = [known[name] for name in reversed(known)]
    head = f"{len(tasks)} tasks: {len(done)} finished, {len(ended)} ended, {len(running)} running, {waiting} waiting"
    return [head, *running, *ended, *done], len(running) + waiting


def _forces(result: PassResult) -> str:
    """Impact and largest force, as far as it has them."""
    wanted = {name: result.peaks[name] for name in ("impact_on_wheel", "largest_force") if name in result.peaks}
    return ", ".join(f"{name.replace('_', ' ')} {peak.value / 1e3:.1f} kN" for name, peak in wanted.items())


def write_array(jobs: Sequence[Job], out: Path, queue: str, ranks: int, limit: float, words: Sequence[str]) -> Path:
    """OUT/array.sh. limit : of a run [s];  words : arguments of the sweep, to which each task adds its number"""
    cases = list(dict.fromkeys(job.case.name for job in jobs))
    parallel = any(MODELS[job.model].parallel for job in jobs)
    memory = max(memory_of(job.case.scene, job.case.runs[job.model], ranks) for job in jobs)
    wall = max(sum(_time(job, ranks, limit) for job in jobs if job.case.name == case) for case in cases)
    submit, number, head = QUEUES[queue]
    where = Path(out).resolve()
    asked = head.format(
        count=len(cases),
        ranks=ranks if parallel else 1,
        memory=math.ceil(FACTOR * memory / 1e6),
        time=f"{int(wall // 3600):02d}:{int(wall % 3600 // 60):02d}:00",
        out=shlex.quote(str(where)),
    )
    call = shlex.join([sys.executable, "-P", "-m", "rail_fem", "sweep", *words])
    text = (
        f"#!/bin/bash\n# {submit} {shlex.quote(str(where / 'array.sh'))}: a task for each of {len(cases)} cases; what"
        f" is finished is passed over. Its tables afterwards, and a fleet's proofs:\n#   {call}\n{asked}"
        f'set -euo pipefail\ncd {shlex.quote(os.getcwd())}\nexec {call} --only "${number}"\n'
    )
    write_text_atomically(out / "array.sh", text)
    return out / "array.sh"


def _words(job: Job) -> str:
    return f"{job.case.name}/{job.model}"


def _time(job: Job, ranks: int, limit: float) -> float:
    """For which a queue is asked [s]."""
    settings = job.case.runs[job.model]
    if limit < math.inf:
        return limit + FIRST
    told = estimate_run(job.case.scene, settings, ranks).wall_time if isinstance(settings, FeSettings) else 0.0
    return FIRST + FACTOR * told
