"""What is installed, whether it works, and how to repair it. Each probe runs in a process of its own: a crash is a
finding."""

import json
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path

from rail_fem.processes import launcher
from rail_fem.result.versions import HOW_TO_GET, versions
from rail_fem.run.installation import LIGHT, NEEDED, PICTURES, made_by_setup, missing, numpy_mismatch

PROBE_SECONDS = 120


@dataclass(frozen=True)
class PartFinding:
    """One thing that was looked at; `remedy` is said when it is not well, or absent: not there, and not needed by the
    light models."""

    subject: str
    well: bool
    found: str
    remedy: str = ""
    absent: bool = False

    def line(self) -> str:
        """The finding as a line of the table, with the remedy of a fault."""
        mark = "-    " if self.absent else "ok   " if self.well else "FAULT"
        remedy = "" if self.well and not self.absent else f"\n      -> {self.remedy}"
        return f"{mark} {self.subject:<12}{self.found}{remedy}"


PROBES: dict[str, tuple[str, str]] = {
    "dolfinx": (
        """
from mpi4py import MPI
import dolfinx, dolfinx.mesh
box = dolfinx.mesh.create_unit_cube(MPI.COMM_SELF, 2, 2, 2, dolfinx.mesh.CellType.hexahedron)
cells = box.topology.index_map(3).size_local
print(dolfinx.__version__, f"makes a mesh of {cells} cells")
raise SystemExit(cells != 8)
""",
        "sudo apt-get install python3-dolfinx, then ./setup.sh",
    ),
    "numba": (
        """
import warnings
warnings.simplefilter("error", RuntimeWarning)  # a cache that is not the user's own
import numba
import kernel_cache
from geometry.hermite import cubic_between
right = cubic_between(0.5, 1.0, 0.0, 1.0, 0.0, 0.0).value == 0.5
kept = "read from" if sum(cubic_between.stats.cache_hits.values()) else "compiled and kept in"
print(numba.__version__, f"works, kernels are {kept} {kernel_cache.folder()}")
raise SystemExit(not right)
""",
        "./setup.sh; if it is the folder of compiled kernels that is named, remove that",
    ),
    "gmsh": (
        """
import gmsh
gmsh.initialize(interruptible=False)
gmsh.option.setNumber("General.Terminal", 0)
gmsh.model.occ.addBox(0, 0, 0, 1, 1, 1)
gmsh.model.occ.synchronize()
gmsh.model.mesh.generate(3)
nodes = len(gmsh.model.mesh.getNodes()[0])
print(gmsh.__version__, f"makes a mesh of {nodes} nodes")
raise SystemExit(nodes < 8)
""",
        "sudo apt-get install libglu1-mesa libxcursor1 libxinerama1 libxft2, then ./setup.sh",
    ),
    "rendering": (
        """
import sys, numpy, pyvista
plotter = pyvista.Plotter(off_screen=True, window_size=(64, 64))
plotter.add_mesh(pyvista.Sphere(), color="white")
image = plotter.screenshot(sys.argv[1], return_img=True)
print("pyvista", pyvista.__version__, f"renders without a display, {len(numpy.unique(image))} grey levels")
raise SystemExit(len(numpy.unique(image)) < 8)
""",
        "sudo apt-get install libgl1 libegl1, then ./setup.sh",
    ),
    "card": (
        """
from rail_fem.fe.card.device import card_facts, missing
why = missing()
if why:
    print(f"cores make all steps: {why}")
else:
    card = card_facts()
    capability = ".".join(map(str, card.capability))
    room = f"{card.free / 1e9:.3g} GB free"
    print(f"{card.name}, capability {capability}, CUDA {card.driver}, {room}; {card.double_words}")
""",
        'leave out device = "cuda", or install NVIDIA\'s driver (CUDA 12.1 or newer)',
    ),
}

RANKS_PROBE = """
from mpi4py import MPI
total = MPI.COMM_WORLD.allreduce(MPI.COMM_WORLD.rank + 1)
if MPI.COMM_WORLD.rank == 0:
    print(f"{MPI.COMM_WORLD.size} ranks, their sum is {total}")
raise SystemExit(total != 3)
"""


def tell(as_json: bool = False) -> int:
    """Print what `examine` finds; 0 where all is well, else 1."""
    found = []
    for finding in examine():
        found.append(finding)
        if not as_json:
            print(finding.line(), flush=True)
    broken = sum(not finding.well for finding in found)
    if as_json:
        print(json.dumps({"faults": broken, "findings": [asdict(finding) for finding in found]}, indent=1))
    else:
        absent = ", ".join(finding.subject for finding in found if finding.absent)
        well = "all well" + (f"; not installed: {absent}" if absent else "")
        print(f"{broken} fault(s)" if broken else well)
    return 1 if broken else 0


def examine() -> Iterator[PartFinding]:
    """Look at one thing after the other."""
    found = versions()
    well = sys.version_info >= (3, 11)
    yield PartFinding(
        "python", well, f"{found['python']} at {sys.executable}", "use Debian 12 or 13, whose python3 is 3.11 or newer"
    )
    mismatch = numpy_mismatch()
    yield PartFinding(
        "numpy",
        not mismatch,
        mismatch or found["numpy"],
        "./setup.sh, which puts the distribution's back; the rest can only be looked at then",
    )
    if mismatch:
        return
    gone = missing([*NEEDED] if made_by_setup() else [*LIGHT])
    shown = ", ".join(
        f"{name} {found[name]}"
        for name in found
        if name not in ("python", "system", "git") and found[name] != "not installed"
    )
    yield PartFinding(
        "packages",
        not gone,
        f"missing: {', '.join(gone)}" if gone else shown,
        "./setup.sh" if made_by_setup() else f"pip install {' '.join(gone)}",
    )
    for subject, (code, remedy) in PROBES.items():
        yield _absent(subject) or _probe(subject, code, remedy)
    yield _absent("mpi") or _ranks()


# what a subject needs, beyond the light models' packages, and what goes without it
OPTIONAL = {
    "dolfinx": (("dolfinx", "mpi4py"), "no explicit models", HOW_TO_GET),
    "gmsh": (("gmsh",), "no explicit models", HOW_TO_GET),
    "rendering": (tuple(PICTURES), "no pictures in 3D", "pip install pyvista"),
    "card": (("numba_cuda",), "no steps on a graphics card", "pip install '.[cuda]'"),
    "mpi": (("mpi4py",), "no explicit models", HOW_TO_GET),
}


def _absent(subject: str) -> PartFinding | None:
    """What is said of a part that is not installed and may be so."""
    needs, without, remedy = OPTIONAL.get(subject, ((), "", ""))
    gone = [] if made_by_setup() and subject != "card" else missing([*needs])
    return (
        PartFinding(subject, True, f"not installed: {', '.join(gone)}; {without}", remedy, absent=True)
        if gone
        else None
    )


def _probe(subject: str, code: str, remedy: str, before: tuple[str, ...] = ()) -> PartFinding:
    with tempfile.TemporaryDirectory() as folder:
        command = [*before, sys.executable, "-P", "-c", code, str(Path(folder) / "probe.png")]
        try:
            answer = subprocess.run(
                command, capture_output=True, text=True, timeout=PROBE_SECONDS, stdin=subprocess.DEVNULL, cwd=folder
            )
        except subprocess.TimeoutExpired:
            return PartFinding(subject, False, f"no answer in {PROBE_SECONDS} s", remedy)
    said = (answer.stdout.strip() or answer.stderr.strip()).splitlines()[-1:] or ["no output"]
    if answer.returncode != 0:
        said = answer.stderr.strip().splitlines()[-1:] or said
        return PartFinding(subject, False, f"exit code {answer.returncode}: {said[0]}", remedy)
    return PartFinding(subject, True, said[0])


def _ranks() -> PartFinding:
    try:
        return _probe(
            "mpi", RANKS_PROBE, "sudo apt-get install openmpi-bin python3-mpi4py", tuple(launcher.mpi_command(2))
        )
    except FileNotFoundError as error:
        return PartFinding("mpi", False, "no mpirun", str(error))
