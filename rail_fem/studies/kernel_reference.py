"""Speed of the hot paths on one core: element kernels, dolfinx's own assembly of the same work, contact.

Each time is processor time of this process, the least of several repeats: other programs on the machine then change it
little.
"""

from __future__ import annotations

import inspect
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
import ufl
from mpi4py import MPI

from geometry.meshing.blocks import mesh_box, mesh_cap
from geometry.meshing.hexmesh import merge_bodies
from rail_fem.fe.blocks import ElementSettings
from rail_fem.fe.compat import fem, function_space
from rail_fem.fe.contact.contact import Contact, ContactSettings
from rail_fem.fe.contact.pairs import N_ACTIVE
from rail_fem.fe.contact.surface import Surface
from rail_fem.fe.domain import Domain
from rail_fem.fe.structure import Structure
from rail_fem.scene.steel import GRADES, Steel
from rail_fem.studies.kernel_flops import Kernel

EDGE = 1e-3  # of an element [m]
STEEL = GRADES["Mn13"]
AS_SHIPPED = ("-O2", "-g0")  # dolfinx's own flags for assembled forms
TUNED = ("-O3", "-march=native", "-ffast-math")  # what numba gives our kernels


@dataclass(frozen=True)
class Effort:
    """How long to measure: repeats of which the fastest counts, each of at least `shortest` [s]."""

    repeats: int = 7
    shortest: float = 0.1


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


def block_domain(across: int) -> Domain:
    """A cube of across^3 elements of 1 mm on this rank alone, with the node numbers that dolfinx gives."""
    box = mesh_box((across * EDGE,) * 3, (across,) * 3)
    return Domain(MPI.COMM_SELF, box.points, box.cells, box.region, keep_mesh=True)


def structure_of(domain: Domain, kernel: Kernel) -> Structure:
    """The body on the kernel "one-point" or "full" of finite strain, or on the small-displacement one, "elastic"."""
    if kernel == "elastic":
        return Structure(domain, [STEEL], small=(0,))
    return Structure(domain, [STEEL], settings=ElementSettings(kernel))


def finite_rate(
    domain: Domain, flowing: bool, effort: Effort, element: Literal["one-point", "full"] = "one-point"
) -> tuple[float, float]:
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
class ContactCost:
    """pairs watched and active; seconds of a step's contact forces and of a search (every `refresh` steps)."""

    pairs: int
    active: int
    forces: float
    search: float
    refresh: int


def contact_cost(across: int, effort: Effort) -> ContactCost:
    """Two blocks with `across`^2 facets each, half an element and a twist apart, overlapping by 1 um: every pair is
    active, with friction."""
    side = across * EDGE
    rail = mesh_box((side, side, 2 * EDGE), (across, across, 2), name="rail")
    rail = replace(rail, points=rail.points - [side / 2, side / 2, 2 * EDGE])
    wheel = mesh_cap(
        np.inf,
        np.inf,
        (0.45 * side, 0.45 * side),
        2 * EDGE,
        1.1 * EDGE,
        (0.45 * side, 0.45 * side, 2 * EDGE),
        name="wheel",
    )
    turn = np.array([[np.cos(0.1), -np.sin(0.1), 0], [np.sin(0.1), np.cos(0.1), 0], [0, 0, 1]])
    wheel = replace(wheel, points=wheel.points @ turn.T + [0.3 * EDGE, 0.2 * EDGE, -1e-6])
    mesh = merge_bodies([rail, wheel])
    structure = Structure(Domain(MPI.COMM_SELF, mesh.points, mesh.cells, mesh.region), [STEEL] * 2, small=(0, 1))
    rail_surface, wheel_surface = (Surface.from_quads(mesh.surface[mesh.surface_region == body]) for body in (0, 1))
    refresh = 50
    settings = ContactSettings(1e15, friction=0.3, refresh=refresh)
    contact = Contact(structure, rail_surface, wheel_surface, settings, speed=30.0, spin=70.0, axle=(0.0, 0.0, 0.42))
    contact.search(1e-7)

    def forces():
        contact.steps_to_search = refresh
        contact.pack(1e-7)
        contact.add_forces(1e-7)

    seconds = least_time(forces, effort)
    pairs = sum(len(pairs.slaves) for pairs in contact.pairs)
    return ContactCost(
        pairs, int(contact.sums[N_ACTIVE]), seconds, least_time(lambda: contact.search(1e-7), effort), refresh
    )
