"""Speed of the explicit model's element kernels on one core, of dolfinx's own assembly of the same work, and both
limits of the core."""

import inspect
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np
import ufl
from mpi4py import MPI

from geometry.meshing.blocks import mesh_box
from kernel_cache import njit
from rail_fem.fe.blocks import ElementSettings
from rail_fem.fe.compat import fem, function_space
from rail_fem.fe.domain import Domain
from rail_fem.fe.structure import Structure
from rail_fem.scene.steel import GRADES, Steel
from rail_fem.show.table_and_figure import Table

Kernel = Literal["one-point", "full", "elastic", "rings"]
EDGE = 1e-3  # of an element [m]
STEEL = GRADES["Mn13"]
AS_SHIPPED = ("-O2", "-g0")  # dolfinx's own flags for assembled forms
TUNED = ("-O3", "-march=native", "-ffast-math")  # what numba gives our kernels
LINE = 4096  # numbers of the arithmetic loop: in the first cache
DEEP = 8  # multiply-adds on each of its eight numbers between load and store
NODAL = 4 * 24  # x and v read, force read and written, of a node [B]
NODAL_SMALL = 5 * 24 + 2 * 24  # x, reference, v read, u written and read; force read and written [B]
NODAL_RING = 3 * 24 + 2 * 24  # the same, with u in the cache [B]
RADIUS = 0.4  # of the cube bent into rings [m]


@dataclass(frozen=True)
class Effort:
    """How long to measure: repeats of which the fastest counts, each of at least `shortest` [s]; edges of the cubes in
    elements; numbers of each streamed array."""

    repeats: int = 7
    shortest: float = 0.1
    cubes: tuple[int, ...] = (12, 32, 64)
    streamed: int = 8_000_000


QUICK = Effort(1, 0.0, (4,), 1000)


def least_time(action: Callable[[], None], effort: Effort) -> float:
    """Seconds per call, the least of several repeats: other programs on the machine only ever add time. The first call
    is not timed."""
    action()
    start = time.process_time()
    action()
    calls = max(1, int(np.ceil(effort.shortest / max(time.process_time() - start, 1e-7))))
    best = np.inf
    for _ in range(effort.repeats):
        start = time.process_time()
        for _ in range(calls):
            action()
        best = min(best, (time.process_time() - start) / calls)
    return best


def block_domain(across: int, in_rings: bool = False) -> Domain:
    """A cube of across^3 elements of 1 mm, or about as many in rings about y, arcs of 30 as a wheel's, on this rank
    alone, with the node numbers that dolfinx gives."""
    along = 30 * max(1, across // 30) if in_rings else across
    box = mesh_box((across * EDGE, across * EDGE, along * EDGE), (across, across, along))
    x, y, z = box.points.T
    bent = np.column_stack([(RADIUS + x) * np.sin(z / RADIUS), y, -(RADIUS + x) * np.cos(z / RADIUS)])
    return Domain(MPI.COMM_SELF, bent if in_rings else box.points, box.cells, box.region, keep_mesh=True)


def structure_of(domain: Domain, kernel: Kernel) -> Structure:
    """The body on the kernel "one-point" or "full" of finite strain, or on the small-displacement one, "elastic", in
    "rings" where the domain is."""
    if kernel == "elastic" or kernel == "rings":
        return Structure(domain, [STEEL], small=(0,))
    return Structure(domain, [STEEL], settings=ElementSettings(kernel))


def finite_rate(domain: Domain, flowing: bool, effort: Effort, element: Kernel = "one-point") -> tuple[float, float]:
    """Updates per second of the finite-strain kernel, and the share of the elements that flowed in the last one.

    flowing : the body is first strained to yield (a few tenths of a percent) at rates that differ from element to
        element, then on at
    steps of 1e-6 strain, so that all elements take the plastic branch at every step; else the strain stays near 1e-7.
    """
    s = structure_of(domain, element)
    step, direction = 1e-7, np.random.default_rng(1).uniform(-1, 1, domain.n_nodes * 3)
    if flowing:
        s.v[:] = direction * 2e-3 * EDGE / step  # strains of about 1e-3 a step
        for _ in range(8):
            s.add_internal_force(step)
    s.v[:] = direction * (2e-6 if flowing else 1e-12) * EDGE / step
    seconds = least_time(lambda: s.add_internal_force(step), effort)
    before = s.finite.plastic_strain()
    s.add_internal_force(step)
    return domain.m_global / seconds, float((s.finite.plastic_strain() > before).mean())


def elastic_rate(domain: Domain, effort: Effort) -> float:
    """Updates per second of the small-displacement kernel."""
    s = structure_of(domain, "elastic")
    s.damping = 1e-9
    s.v[:] = np.random.default_rng(1).uniform(-1, 1, s.v.size)
    s.x += 1e-7 * s.v
    return domain.m_global / least_time(lambda: s.add_internal_force(1e-7), effort)


def elastic_form(domain: Domain, steel: Steel, points: int, flags: tuple[str, ...] = TUNED):
    """dolfinx's form of the internal force with points^3 Gauss points, compiled with `flags`, and the displacement that
    it reads."""
    space = function_space(domain.mesh, domain.mesh.ufl_domain().ufl_coordinate_element())
    u, test = fem.Function(space), ufl.TestFunction(space)
    shear = steel.youngs_modulus / (2 * (1 + steel.poisson))
    lame = 2 * shear * steel.poisson / (1 - 2 * steel.poisson)
    strain = ufl.sym(ufl.grad(u))
    stress = 2 * shear * strain + lame * ufl.tr(strain) * ufl.Identity(3)
    work = ufl.inner(stress, ufl.sym(ufl.grad(test))) * ufl.dx(metadata={"quadrature_degree": 2 * points - 1})
    # its name changed with the versions
    options = next(name for name in inspect.signature(fem.form).parameters if name.startswith("jit"))
    return fem.form(work, **{options: {"cffi_extra_compile_args": list(flags)}}), u


def assembly_rate(domain: Domain, points: int, effort: Effort, flags: tuple[str, ...] = TUNED) -> float:
    """Cells per second of dolfinx's assembly of the elastic internal force, a new displacement packed each time."""
    form, u = elastic_form(domain, STEEL, points, flags)
    u.x.array[:] = 1e-7 * np.random.default_rng(1).uniform(-1, 1, u.x.array.size)
    force = np.zeros(u.x.array.size)

    def assemble():
        force[:] = 0.0
        fem.assemble_vector(force, form)

    return domain.m_global / least_time(assemble, effort)


@dataclass(frozen=True)
class Limits:
    """Of one core: multiply-adds in the first cache, counted as two operations each [1/s]; memory read and written by
    an update in place of arrays far larger than the caches [B/s]."""

    operations: float
    bytes: float


@njit(cache=True, fastmath=True, error_model="numpy")
def multiply_add(y, a, b, repeats):
    """Eight independent chains, DEEP multiply-adds long, over y (8 n,)."""
    n = y.size // 8
    for _ in range(repeats):
        for i in range(n):
            t0, t1, t2, t3 = y[i], y[i + n], y[i + 2 * n], y[i + 3 * n]
            t4, t5, t6, t7 = y[i + 4 * n], y[i + 5 * n], y[i + 6 * n], y[i + 7 * n]
            for _ in range(DEEP):
                t0, t1, t2, t3 = t0 * a + b, t1 * a + b, t2 * a + b, t3 * a + b
                t4, t5, t6, t7 = t4 * a + b, t5 * a + b, t6 * a + b, t7 * a + b
            y[i], y[i + n], y[i + 2 * n], y[i + 3 * n] = t0, t1, t2, t3
            y[i + 4 * n], y[i + 5 * n], y[i + 6 * n], y[i + 7 * n] = t4, t5, t6, t7


@njit(cache=True, fastmath=True, error_model="numpy")
def update_in_place(y, a, x):
    for i in range(y.size):
        y[i] = a * y[i] + x[i]


def machine_limits(effort: Effort) -> Limits:
    """Measured now."""
    line, repeats = np.ones(LINE), 200
    arithmetic = 2.0 * DEEP * LINE * repeats / least_time(lambda: multiply_add(line, 0.999, 1e-3, repeats), effort)
    y, x = np.ones(effort.streamed), np.ones(effort.streamed)
    return Limits(arithmetic, 24.0 * effort.streamed / least_time(lambda: update_in_place(y, 0.999, x), effort))


def bytes_of_update(structure: Structure) -> float:
    """Least bytes that an update of an element moves, mean over the elements."""
    finite, small, nodes = structure.finite, structure.small, structure.domain.n_nodes
    moved = 2 * (finite.state.nbytes + finite.back.nbytes) + finite.nodes.nbytes
    moved += small.nodes.nbytes + structure.geometry.nbytes
    moved += sum(part.nbytes for part in structure.rings[:5])
    nodal = NODAL if finite.n_cells else NODAL_SMALL if small.n_cells else NODAL_RING
    return (moved + nodal * nodes) / len(structure.domain.cells)


# of an element update when it flows, counted on the kernels' own source: tests/fe/kernel_flops.py
OPERATIONS: dict[Kernel, float] = {"one-point": 1460, "full": 5599, "elastic": 638, "rings": 572}
NAMES: dict[Kernel, str] = {
    "one-point": "finite strain, J2, hourglass: everything flows",
    "full": "finite strain, J2, 2x2x2 points: everything flows",
    "elastic": "small displacement, elastic, hourglass",
    "rings": "the same in rings",
}


def kernel_table(effort: Effort) -> Table:
    """Million updates a second on each cube, and what bounds them."""
    rates: dict[str, list[float]] = {}
    for across in effort.cubes:
        domain, bent = block_domain(across), block_domain(across, in_rings=True)
        found = {
            NAMES["one-point"]: finite_rate(domain, True, effort)[0],
            "finite strain, J2, hourglass: nothing yields": finite_rate(domain, False, effort)[0],
            NAMES["full"]: finite_rate(domain, True, effort, "full")[0],
            NAMES["elastic"]: elastic_rate(domain, effort),
            NAMES["rings"]: elastic_rate(bent, effort),
            "dolfinx assembly, elastic, 1 point, no hourglass": assembly_rate(domain, 1, effort),
            "dolfinx assembly, the same as shipped": assembly_rate(domain, 1, effort, AS_SHIPPED),
            "dolfinx assembly, elastic, 2x2x2 points": assembly_rate(domain, 2, effort),
        }
        for name, rate in found.items():
            rates.setdefault(name, []).append(1e-6 * rate)
    limits = machine_limits(effort)
    bounds = {}
    for kernel, name in NAMES.items():
        moved = bytes_of_update(structure_of(bent if kernel == "rings" else domain, kernel))
        allowed = limits.operations / OPERATIONS[kernel], limits.bytes / moved
        bounds[name] = [OPERATIONS[kernel], moved, *(1e-6 * rate for rate in allowed)]
    rows = [[name, *own, *bounds.get(name, ["-"] * 4)] for name, own in rates.items()]
    title = (
        f"Million updates a second; the core has {1e-9 * limits.operations:.3g} 10^9 operations/s and"
        f" {1e-9 * limits.bytes:.3g} GB/s"
    )
    head = ["what", *(f"{across**3} elements" for across in effort.cubes), "operations", "bytes"]
    return Table([*head, "limit by arithmetic", "limit by memory"], rows, title)
