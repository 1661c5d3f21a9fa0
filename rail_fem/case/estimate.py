"""What a run will cost, before anything is meshed: cells, steps, memory, time."""

import os
import resource
from dataclasses import dataclass, replace
from pathlib import Path

from rail_fem.contact.rigid import meshed_stretch
from rail_fem.fe.plan.kept_meshes import are_kept
from rail_fem.fe.plan.mass_scaling import CUBE, GAIN, SHARE, quasi_static_factor, quasi_static_step
from rail_fem.scene.scene import Frozen, Scene
from rail_fem.settings.explicit import TWIN_COST, FeSettings

# At the peak: 0.37 GB with 12,189 cells, 0.46 with 113,388, 0.68 with 326,591; Gmsh's own process is not in it.
BYTES_PER_CELL = 1010.0
BYTES_LIGHT = 220e6  # of a light model with its kernels; rigid_hertz 0.214 GB, bem_passage 0.217
BYTES_PER_RANK = 350e6  # Python with dolfinx and numba loaded, before any mesh
# Processor time of meshes, searches, the static start and figures, by the same (8, 20 and 42 s): as on the root alone;
# and what of it a mesh that is kept does not take (1, 5 and 17 s) [s]
PREPARATION, PREPARATION_PER_CELL = 6.9, 1.1e-4
MESHING, MESHING_PER_CELL = 0.7, 5e-5
TWIN_CELLS = 0.25  # of the twin that gives the error bars, over the run's own
FULL_BYTES_PER_CELL, FULL_COST = 1056.0, 3.0  # what eight points need beside that, and what an update of theirs costs
UPDATES_PER_SECOND = 1.1e7  # per core, everything in a step included
SHORTEST_EDGE = 0.5  # shortest cell edge over element_size, in graded and slanted cells

# Cells, fitted to meshes of 6 to 0.35 mm (each within a factor of 1.5): a column of the rail of length h holds
# RAIL_LINE / h, a fine block some layers deep and ever coarser rings below it; the wheel's fine patch has one extent
# whatever the window.
RAIL_LINE = 0.19
WHEEL_AREA, WHEEL_LINE = 27.3e-3, 6.65
# a control group's files of limit, use and statistics, and the cache that it would give back; of both versions
CGROUP = "memory.max", "memory.current", "memory.stat", "inactive_file"
CGROUP_1 = "memory.limit_in_bytes", "memory.usage_in_bytes", "memory.stat", "total_inactive_file"
END_MARGIN = 0.024  # of the rail beyond start and end
# Of the meshes over their depth, from 55 and 60 to 110 and 120 mm: crossing [kg/m2], wheel [kg/m]
RAIL_MASS, WHEEL_MASS = 740.0, 220.0
LIGHTER, FINE = 110.0, 0.8e-3  # read off meshes of 2, 1 and 0.5 mm: 16, 65 and 110
# The largest possible factor of mass scaling: of small elements by ALL_SMALL over their size more than of all. Meshes
# of 0.7 to 5 mm allowed 0.92 to 1.04 of it, of small elements 0.7 to 1.6; SURE times as large is refused unmeshed
ALL_SMALL, SURE = 25e-3, 5.0


@dataclass(frozen=True)
class Estimate:
    """Cells, steps, critical step [s], memory of all ranks [B], wall time and what of it comes before the steps [s];
    right to a factor of about two. Kernels that are not compiled yet take some minutes more, once."""

    cells: float
    steps: float
    step: float
    memory: float
    wall_time: float
    preparation: float


def estimate_run(scene: Scene, settings: FeSettings, ranks: int = 1) -> Estimate:
    """Estimate without meshing. Error: within a factor of two of the mesher's count
    (tests/rail_fem/test_estimate.py)."""
    low, high = meshed_stretch(scene, settings)
    length = high - low + 2 * END_MARGIN
    rail, wheel = _crossing_cells(settings, length), _wheel_cells(settings)
    active, cells = _crossing_cells(settings, min(length, sum(settings.window_lengths))), rail + wheel
    step = critical_step(scene, settings)
    duration = settings.settle_time + scene.travel_time(settings.start, settings.end)
    steps = min(duration / step, settings.max_steps or float("inf"))
    memory, updates = cells * BYTES_PER_CELL + ranks * BYTES_PER_RANK, active + wheel
    if settings.element == "full":
        memory += rail * FULL_BYTES_PER_CELL
        updates += active * (FULL_COST - 1)
    preparation = PREPARATION + PREPARATION_PER_CELL * cells * (1 + (TWIN_CELLS if settings.has_twin else 0.0))
    updates *= settings.passes * (1 + (TWIN_COST if settings.has_twin else 0.0))
    stepping = updates * steps / (UPDATES_PER_SECOND * ranks)
    return Estimate(cells, steps, step, memory, preparation + stepping, preparation)


def memory_of(scene: Scene, settings: Frozen, ranks: int = 1) -> float:
    """That a run of any model needs at its peak [B], at most a factor of two off."""
    return estimate_run(scene, settings, ranks).memory if isinstance(settings, FeSettings) else BYTES_LIGHT


def foretold(scene: Scene, settings: FeSettings, ranks: int = 1) -> Estimate:
    """The estimate, less what meshes take where an earlier run on the same shapes has left them."""
    found = estimate_run(scene, settings, ranks)
    try:
        if settings.mesh or not are_kept(scene, settings):
            return found
    except ValueError:  # no path beyond the window's ends: the run says why it cannot be meshed
        return found
    twin = settings.has_twin
    saved = MESHING * (1 + twin) + MESHING_PER_CELL * found.cells * (1 + TWIN_CELLS * twin)
    return replace(found, wall_time=found.wall_time - saved, preparation=found.preparation - saved)


def critical_step(scene: Scene, settings: FeSettings) -> float:
    """Courant number times shortest edge over the fastest wave, mass scaling included [s]."""
    fastest = max(steel.wave_speed for steel in scene.materials.steels())
    smallest = min(settings.element_size, settings.along)
    steel = settings.courant * SHORTEST_EDGE * smallest / fastest
    if settings.mass_scaling == "auto" and settings.scaled_elements == "small":
        body = _heaviest_factor(scene, settings)
        heaviest = min(SHARE * body, 1 + GAIN * body) * _lighter(settings)
        wanted = settings.courant * quasi_static_step(scene, CUBE * smallest, settings.wave_ratio)
        return max(steel, min(wanted, steel * heaviest**0.5))
    return steel * _mass_factor(scene, settings) ** 0.5


def _mass_factor(scene: Scene, settings: FeSettings) -> float:
    """Of mass scaling, with masses of the meshes by rule where it is "auto"."""
    if settings.mass_scaling != "auto":
        return float(settings.mass_scaling)
    return max(1.0, min(quasi_static_factor(scene), SHARE * _heaviest_factor(scene, settings)))


def _heaviest_factor(scene: Scene, settings: FeSettings) -> float:
    """With which a mesh, all its elements scaled, weighs what its body does."""
    length = min(abs(settings.end - settings.start) + 2 * END_MARGIN, sum(settings.window_lengths))
    rail = RAIL_MASS * settings.rail_depth * length
    track = scene.foundation.track_mass / rail if settings.track_mass else 1.0
    wheel = scene.vehicle.wheel_unsprung_mass / (WHEEL_MASS * settings.wheel_depth)
    return min(track if settings.foundation and not settings.stands_on_beam(scene) else float("inf"), wheel)


def _lighter(settings: FeSettings) -> float:
    """What a mesh weighs with all elements scaled over what it does with small ones alone, for the same step."""
    return max(1.0, LIGHTER * min(1.0, (FINE / settings.element_size) ** 2))


def _crossing_cells(settings: FeSettings, length: float) -> float:
    return length / settings.along * RAIL_LINE / settings.element_size


def _wheel_cells(settings: FeSettings) -> float:
    cells = WHEEL_AREA / settings.wheel_size**2 + WHEEL_LINE / settings.wheel_size
    return cells * settings.wheel_size / settings.along


def available_memory() -> float:
    """Memory that this process can still get [B]: what the kernel calls available, or what the control groups over it
    or the shell's limits (ulimit -v, -d) leave if that is less."""
    free = _kilobytes("/proc/meminfo", "MemAvailable", os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") / 1024)
    groups = Path("/proc/self/cgroup")
    left = [free, group_memory(groups.read_text(encoding="utf-8") if groups.exists() else "", Path("/sys/fs/cgroup"))]
    for limit, size in ((resource.RLIMIT_AS, "VmSize"), (resource.RLIMIT_DATA, "VmData")):
        most = resource.getrlimit(limit)[0]
        if most != resource.RLIM_INFINITY:
            left.append(max(most - _kilobytes("/proc/self/status", size, 0.0), 0.0))
    return float(min(left))


def _kilobytes(path: str, name: str, default: float) -> float:
    """The entry `name` of a list of the kernel's, and what stands for it where there is none [kB], in bytes."""
    lines = Path(path).read_text(encoding="utf-8").splitlines() if Path(path).exists() else []
    return 1024.0 * next((float(line.split()[1]) for line in lines if line.startswith(f"{name}:")), default)


def group_memory(groups: str, root: Path) -> float:
    """The least that the control groups of a process leave it [B]: limit less what is used and not cache; a job's step
    is some folders down. groups : /proc/self/cgroup;  root : where their folders lie"""
    left = float("inf")
    for line in groups.splitlines():
        _, kinds, path = line.split(":", 2)
        if kinds not in ("", "memory"):
            continue
        top, names = (root, CGROUP) if not kinds else (root / kinds, CGROUP_1)
        lowest = top / path.lstrip("/")
        for folder in (lowest, *(above for above in lowest.parents if above == top or top in above.parents)):
            limit, used, stat = (folder / name for name in names[:3])
            if not limit.exists() or (text := limit.read_text(encoding="ascii").strip()) == "max":
                continue
            taken = float(used.read_text(encoding="ascii")) if used.exists() else 0.0
            lines = stat.read_text(encoding="ascii").splitlines() if stat.exists() else []
            taken -= sum(float(entry.split()[1]) for entry in lines if entry.split()[0] == names[3])
            left = min(left, max(float(text) - taken, 0.0))
    return left


def impossible(scene: Scene, settings: FeSettings, ranks: int = 1, model: str = "fe_full") -> list[str]:
    """Faults that stop a run before anything is meshed: too little memory, more ranks than cells, mass scaling far
    beyond what the bodies weigh."""
    estimate, free = estimate_run(scene, settings, ranks), available_memory()
    size = f"{settings.element_size * 1e3:g} mm"
    errors = []
    if estimate.memory > free:
        errors.append(
            f"run.{model}.element_size: {size} makes about {estimate.cells:.2g} cells on {ranks} rank(s), which need"
            f" {estimate.memory / 1e9:.3g} GB; {free / 1e9:.3g} GB are free:"
            f" {_size_that_fits(scene, settings, ranks, free)}"
        )
    if ranks > estimate.cells:
        errors.append(f"run.{model}: {ranks} ranks for about {estimate.cells:.0f} cells of {size}: start fewer ranks")
    small = settings.scaled_elements == "small"
    most = max(1.0, _heaviest_factor(scene, settings) * (ALL_SMALL / settings.element_size if small else 1.0))
    if not isinstance(settings.mass_scaling, str) and settings.mass_scaling > SURE * most and not settings.mesh:
        errors.append(
            f"run.{model}.mass_scaling: with {settings.mass_scaling:g} the meshes weigh more than their bodies in the"
            f' case: about {most:.2g} is possible here; "auto" takes what is'
        )
    return errors


def _size_that_fits(scene: Scene, settings: FeSettings, ranks: int, free: float) -> str:
    for tenths in range(1, 200):
        larger = settings.model_copy(update={"element_size": max(tenths * 1e-4, settings.element_size)})
        if estimate_run(scene, larger, ranks).memory <= free:
            return f"{larger.element_size * 1e3:g} mm fits"
    return "start fewer ranks"
