"""Contact of two plane bodies of which one yields: pressure, contact status and plastic strain in one Newton iteration.

At any plastic strain the contact is solved exactly (bem.plane.coulomb) on gaps changed by the residual displacement; of
the states found there follows how pressures answer to plastic strain, and that belongs to the consistent tangent. So
Newton's method runs over plastic strain alone, and stays quadratic once the states of the contact no longer change.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from bem.plane.body import Body, CondensedBody
from bem.plane.boundary import MEMORY_LIMIT, EquilibriumError
from bem.plane.contact import Settings, solve_contact
from bem.plane.contact_result import ContactResult
from bem.plane.coulomb import (
    OPEN,
    STICK,
    ContactState,
    ContactSystem,
    Control,
    ConvergenceError,
    solve_linear,
    solve_step,
)
from bem.plane.point_load import PointLoad
from bem.plane_plastic.cells import CellError, cells_below
from bem.plane_plastic.increment import Increment, Tangent
from bem.plane_plastic.influence import OF_STRAIN, strain_of_stress
from bem.plane_plastic.loading import Step, accepted, reach, section_stress, unseen
from bem.plane_plastic.section import PlasticSection
from bem.plastic.increment import NoEquilibriumError
from bem.steel.hardening import YieldLaw


@dataclass(frozen=True)
class Region:
    """Where a body may yield.

    Parameters
    ----------
    half_width, depth : float
        Along its face about the first patch, and below it [m].
    size : float
        Of the cells [m].

    Examples
    --------
    >>> bem.Region(half_width=6e-3, depth=6e-3, size=1e-3).size
    0.001
    """

    half_width: float
    depth: float
    size: float


@dataclass
class ContactStep:
    """contact : pressures, gaps and motion; step : of the plastic body; stress (m, 4) xx yy zz xy [Pa] of its cells."""

    contact: ContactState
    step: Step
    stress: np.ndarray


class PlasticContact:
    """Two bodies in contact, one of them with yielding cells; loads come one after the other.

    Parameters
    ----------
    fixed, moving : Body
        As of `solve_contact`.
    greatest : Control
        That meshes and cells are laid for.
    hardening : Hardening or NonlinearKinematic
        Of the body that yields.
    region : Region
        Of its cells.
    friction : float
        Coulomb's coefficient.
    settings : Settings
        Of the elastic contact.
    yields : str
        "fixed" or "moving".
    memory_limit : float
        Of the matrices [bytes].

    Raises
    ------
    CellError, TooLargeError
        And the errors of `solve_contact`.

    Examples
    --------
    >>> from rail_fem.bem.verification.exact_problems import two_discs
    >>> pressed = bem.Control.of(force=(None, -5e6))
    >>> steel, region = bem.Hardening.linear(300e6, 1e9), bem.Region(9e-3, 9e-3, 1.5e-3)
    >>> contact = bem.PlasticContact(*two_discs(1.0, bem.STEEL, bem.STEEL), pressed, steel, region)
    >>> bool(contact.go_to(pressed).step.peeq.max() > 1e-4)
    True
    """

    def __init__(
        self,
        fixed: Body,
        moving: Body,
        greatest: Control,
        hardening: YieldLaw,
        region: Region,
        friction: float = 0.0,
        settings: Settings = Settings(),
        yields: str = "fixed",
        memory_limit: float = MEMORY_LIMIT,
    ) -> None:
        if yields not in ("fixed", "moving"):
            raise CellError(f"yields = {yields!r}: there are 'fixed' and 'moving'")
        self.elastic: ContactResult = solve_contact(fixed, moving, greatest, friction, settings)
        self.friction = friction
        self.body: CondensedBody = getattr(self.elastic, yields)
        self.carries = self.elastic.carrier == yields
        patches = self.elastic.patches()
        if not patches:
            raise CellError("the bodies do not touch under the greatest load: nothing yields")
        middle = (patches[0].begin + patches[-1].end) / 2
        cells = cells_below(self.body.mesh, self.body.body.face, middle, region.half_width, region.depth, region.size)
        self.section = PlasticSection(self.body.problem, cells, hardening, memory_limit)
        n = self.elastic.system.nodes
        self.control = Control(0.0 * greatest.motion, 0.0 * greatest.load)
        self.slip, self.state = np.zeros(n), self.elastic.last.state
        self.steps: list[ContactStep] = []

    def go_to(self, control: Control, tolerance: float = 1e-8) -> ContactStep:
        """Bring the bodies from the last control to another.

        Errors: NoEquilibriumError with the load reached (the state is that of it), CellError, EquilibriumError.
        """
        begin = self.control
        if (np.isnan(begin.load) != np.isnan(control.load)).any():
            raise EquilibriumError(
                f"load {control.load}, motion {control.motion}: each component is controlled by what the greatest"
                f" control gave, a load or a motion, now load {begin.load} and motion {begin.motion}"
            )

        def between(share: float) -> Control:
            one, two = (begin.motion, begin.load), (control.motion, control.load)
            return Control(*(a + share * (b - a) for a, b in zip(one, two)))

        def accept(share: float, done: Increment, load: _Pressed) -> None:
            load(done.plastic, False)
            step = accepted(self.section, done, share)
            self.control, self.slip, self.state = between(share), load.last.slip, load.last.state
            stress = section_stress(self.section, load.density, load.loads)
            step.warnings += unseen(self.section, stress)
            self.steps.append(ContactStep(load.last, step, stress))

        def describe(share: float) -> str:
            here = between(share)
            return f"force {np.nan_to_num(here.load[:2])} N/m, motion {np.nan_to_num(here.motion[:2])} m"

        pressed = lambda share: _Pressed(self, between(share), self.slip, self.state)
        reach(self.section, pressed, accept, describe, tolerance)
        return self.steps[-1]

    def elastic_strains(self, controls: Sequence[Control]) -> list[np.ndarray]:
        """Per control 2 G strain (3, m) at the middles of all cells, as deviators [Pa], with nothing yielding."""
        slip, state, found = np.zeros(self.elastic.system.nodes), None, []
        for control in controls:
            load = _Pressed(self, control, slip, state)
            load.press(np.zeros(2 * load.nodes))
            slip, state = load.last.slip, load.last.state
            nothing = np.zeros(3 * len(self.section.active))
            found.append(self.section.strain_at(self.section.cells.centers, load.density, nothing, load.loads))
        return found


class _Pressed:
    """The load of the contact under a control: its 2 G strain in the cells, which answers to their plastic stress."""

    def __init__(self, contact: PlasticContact, control: Control, slip: np.ndarray, state: np.ndarray | None) -> None:
        self.contact, self.control = contact, control
        self.slip, self.state, self.active = slip, state, -1
        self.last: Any = None
        self.loads: tuple[PointLoad, ...] = ()
        self.density = np.zeros(2 * contact.body.mesh.densities)
        n, normal = contact.elastic.system.nodes, contact.elastic.interface.normals
        sign = 1 if contact.carries else -1
        nx, ny = np.diag(normal[:, 0]), np.diag(normal[:, 1])
        self.amplitude = sign * np.block([[-nx, -ny], [-ny, nx]])  # pressures, shears -> tractions x, y on this body
        self.nodes = n

    def _prepare(self) -> None:
        """Matrices for the cells that take part now."""
        section, body, found = self.contact.section, self.contact.body, self.contact.elastic
        if self.active == len(section.active):
            return
        self.active = len(section.active)
        self.by_traction = section.from_layers @ (body.density @ self.amplitude)
        if body.hub_units:
            points = section.cells.points(section.active)
            for unit, reaction in zip(body.hub_units, body.reaction @ self.amplitude):
                stress = unit.stress(points, section.elastic).reshape(-1, 4, 3).mean(axis=1)
                strain = OF_STRAIN @ strain_of_stress(stress.T.copy(), section.elastic.poisson)
                self.by_traction += np.outer(strain, reaction)
        points = found.interface.points if self.contact.carries else found.interface.feet
        moved = section.displacement_matrix(points)
        (nx, ny), n = found.interface.normals.T[:, :, None], self.nodes
        sign = 1 if self.contact.carries else -1
        x, y = moved[:n], moved[n:]
        self.opening = sign * np.vstack([-(nx * x + ny * y), -ny * x + nx * y])

    def press(self, opened: np.ndarray) -> ContactSystem:
        """Solve the contact with gaps and slips (2 n,) [m] added: states and densities. Returns its system."""
        n, contact = self.nodes, self.contact
        system = replace(contact.elastic.system, gap=contact.elastic.system.gap + opened[:n])
        if self.control.nothing:
            self.last = ContactState.apart(system.gap, self.slip)
        else:
            try:
                last = solve_step(system, self.control, contact.friction, self.slip - opened[n:], self.state)
            except ConvergenceError as failure:
                raise NoEquilibriumError(str(failure)) from None
            self.last, self.state = replace(last, slip=last.slip + opened[n:]), last.state
        body, amplitude = contact.body, self.amplitude @ np.r_[self.last.pressure, self.last.shear]
        self.density = body.density @ amplitude
        self.loads = body.hub_loads(amplitude)
        return system

    def __call__(self, plastic: np.ndarray, tangent: bool) -> tuple[np.ndarray, Tangent | None]:
        self._prepare()
        system = self.press(self.opening @ plastic)
        strain = self.by_traction @ np.r_[self.last.pressure, self.last.shear]
        if not tangent or self.control.nothing:
            return strain, None
        answer, rows = traction_tangent(system, self.control, self.contact.friction, self.last.state)
        return strain, (self.by_traction @ answer, self.opening[rows])


def traction_tangent(
    system: ContactSystem, control: Control, friction: float, state: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Change (2 n, r) [Pa/m] of pressures and shears by changes of gaps and slips, the states (n,) kept; and which r of
    the gaps and slips count."""
    rows = np.r_[np.flatnonzero(state != OPEN), system.nodes + np.flatnonzero(state == STICK)]
    changes = np.zeros((2 * system.nodes, len(rows)))
    changes[rows, np.arange(len(rows))] = 1.0
    still = Control(0.0 * control.motion, 0.0 * control.load)
    pressure, shear, _ = solve_linear(system, still, np.broadcast_to(friction, system.nodes), changes, state)
    return np.vstack([pressure, shear]), rows
