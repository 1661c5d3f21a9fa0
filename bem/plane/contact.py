"""Frictional contact of two elastic bodies by boundary elements: initial contact, zone, meshes, condensation, load
steps, checks.

One body is fixed, the other moves; loads and motions are those of the moving body's holder. The softer of the two (the
moving one if they are alike) carries the tractions and has the finer mesh: it is the slave of the pairing. So every
wiggle that the tractions can make is felt by an elastic body, even if the other is rigid.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from bem.checks import refuse_unless_positive
from bem.plane.body import Body, CondensedBody
from bem.plane.boundary import MEMORY_LIMIT, EquilibriumError, check_memory
from bem.plane.contact_result import ContactResult, trust_warnings
from bem.plane.coulomb import (
    FORWARD,
    OPEN,
    STICK,
    ContactState,
    ContactSystem,
    Control,
    local_motion,
    refuse_bad_friction,
    solve_step,
)
from bem.plane.initial_contact import nearest_positions
from bem.plane.mesh import mesh_outline
from bem.plane.pairing import Interface, PairingError, pair
from bem.plane.zone import NARROWEST, EstimatedPatch, estimate_patches, peak_sharpness, runs, sizing
from bem.stages import StageClock


class LoadError(ValueError):
    """A load that does not press the bodies together."""


class SettingsError(ValueError):
    """A setting of the solution that is no number or out of its range."""


_PULLS = (
    "load ({0:.4g}, {1:.4g}) N/m on the moving body pulls it away from the fixed one: contact can only press; turn its"
    " sign, or exchange the bodies"
)


@dataclass(frozen=True)
class Settings:
    """size : element length [m] in the contact on the body that carries the tractions, or None: from `accuracy`
    accuracy : wanted relative error of the largest pressure (see element_size)
    other_ratio : element length of the other body over `size`; coarse : largest element over the body's size
    growth : of element size per distance from the patch; reach : largest gap considered [m], default half the moving
        body's size
    rounds : how often the mesh may be laid anew where contact was found
    """

    size: float | None = None
    accuracy: float = 0.01
    other_ratio: float = 1.25
    coarse: float = 0.05
    growth: float = 0.25
    reach: float | None = None
    rounds: int = 4
    memory_limit: float = MEMORY_LIMIT

    def __post_init__(self) -> None:
        for name in ("size", "reach"):
            if getattr(self, name) is not None:
                refuse_unless_positive(SettingsError, **{f"{name} [m]": getattr(self, name)})
        for name in ("accuracy", "other_ratio", "coarse", "growth", "rounds", "memory_limit"):
            refuse_unless_positive(SettingsError, **{name: getattr(self, name)})
        if not 1e-5 <= self.accuracy <= 0.2:
            raise SettingsError(f"accuracy = {self.accuracy!r}: ask for a relative error between 1e-5 and 0.2")
        if not isinstance(self.rounds, int):
            raise SettingsError(f"rounds = {self.rounds!r}: must be a whole number")


def element_size(half_width: float, accuracy: float) -> float:
    """Element length [m] for a relative error of the largest pressure: error = (size / half_width)^2 / 2, at most a
    third of it.

    half_width : of the half ellipse as sharp as the pressure's peak (bem.plane.zone.peak_sharpness)
    The law bounds what Hertz' contact shows (tests/bem/test_contact_hertz.py), and pins in holes, the case studies and
    a wheel on a rail keep to it (tests/bem/test_contact_accuracy.py).
    """
    return half_width * min(np.sqrt(2 * accuracy), 1 / 3)


def contact_system(interface: Interface, carrier: CondensedBody, other: CondensedBody, sign: int) -> ContactSystem:
    """Compliance of two condensed bodies at their interface, in gaps and slips; sign = +1 if the carrier is the one
    that moves."""
    carrier.condense(interface.on_slave)
    other.condense(interface.on_master)
    own = carrier.displacement(interface.points, interface.nodes) + other.displacement(interface.feet)
    n, (nx, ny) = len(interface.nodes), interface.normals.T

    def local_rows(rows: np.ndarray) -> np.ndarray:  # x, y -> along the normal, along the tangent (-ny, nx)
        return np.vstack(
            [nx[:, None] * rows[:n] + ny[:, None] * rows[n:], -ny[:, None] * rows[:n] + nx[:, None] * rows[n:]]
        )

    # tractions on the carrier are -p normal + q tangent, on the other the opposite: the displacements of both add up
    relative = local_rows(own)
    compliance = np.hstack(
        [-(relative[:, :n] * nx + relative[:, n:] * ny), relative[:, n:] * nx - relative[:, :n] * ny]
    )
    compliance[:n] *= -1  # gap = (other - carrier) along the normal
    motion = local_motion(interface.points, interface.normals) * sign
    return ContactSystem(interface.gap, compliance, motion, motion.T * np.r_[interface.mass, interface.mass])


def _refuse_pull(control: Control, system: ContactSystem) -> None:
    load = np.nan_to_num(control.load)
    if load[:2].any() and not (load[:2] @ system.forces[:2, : system.nodes]).min() < 0:
        raise LoadError(_PULLS.format(*load))


def _march(
    system: ContactSystem, controls: Sequence[Control], friction: float, start: np.ndarray | None
) -> list[ContactState]:
    """All load steps, each from the slips of the one before."""
    n = system.nodes
    steps, before, state = [], np.zeros(n), start
    for number, control in enumerate(controls, 1):
        if control.nothing:
            steps.append(ContactState.apart(system.gap.copy(), before.copy()))
            continue
        _refuse_pull(control, system)
        try:
            step = solve_step(system, control, friction, before, state)
        except EquilibriumError as failure:
            raise EquilibriumError(f"load step {number} of {len(controls)}: {failure}") from None
        steps.append(step)
        before, state = step.slip, step.state
    return steps


def ramp(control: Control, steps: int) -> list[Control]:
    """A control reached in steps from nothing, with the squares of equal shares: a smooth contact then grows evenly."""
    return [Control(control.motion * (k / steps) ** 2, control.load * (k / steps) ** 2) for k in range(1, steps + 1)]


def _load_steps(control: Control | Sequence[Control], steps: int | None, friction: float) -> list[Control]:
    """The controls one by one; refuses what is none."""
    if steps is not None and not (isinstance(steps, (int, np.integer)) and steps > 0):
        raise SettingsError(f"steps = {steps!r}: must be a positive whole number")
    if isinstance(control, Control):
        return ramp(control, steps or (1 if friction == 0 else 10))
    if not isinstance(control, Sequence) or not all(isinstance(each, Control) for each in control):
        raise EquilibriumError(
            f"control = {control!r}: give a Control (Control.of(force=(None, -1e6)), for one), or a list of them"
        )
    if not control:
        raise EquilibriumError("no load step was given")
    return list(control)


def _bring_into_contact(fixed: Body, moving: Body, controls: list[Control], reach: float):
    """Translate the moving body until it touches, so that only the deformation remains to be found; motions lose what
    it took.

    Bodies controlled by a motion that overlap as placed are left so: the overlap is part of the motion.
    Returns the body, the controls, the translation and the positions (m, 2) [m] where the bodies are nearest.
    """
    nothing = moving, controls, np.zeros(2), np.zeros((0, 2))
    last = next((d for d in reversed(controls) if not d.nothing), None)
    if last is None:
        return nothing
    by_load = bool(np.nan_to_num(last.load[:2]).any())
    direction = np.nan_to_num(last.load[:2] if by_load else last.motion[:2])
    if not direction.any():
        return nothing
    unit, travel = direction / np.hypot(*direction), float(np.hypot(*direction))
    positions = nearest_positions(fixed, moving, unit, reach)
    if by_load and not positions:
        _refuse_apart(fixed, moving, last, unit, reach)
    distance = positions[0][0] if positions else np.inf
    initial_approach = unit * (distance if by_load else min(max(distance, 0.0), travel))
    near = np.array([point for _, point in positions]).reshape(-1, 2) + initial_approach
    if not by_load:
        controls = [replace(d, motion=d.motion - np.r_[initial_approach, 0.0]) for d in controls]
    return moving.moved(initial_approach), controls, initial_approach, near


def _refuse_apart(fixed: Body, moving: Body, control: Control, direction: np.ndarray, reach: float) -> None:
    """Say why a load never brings the bodies together."""
    if nearest_positions(fixed, moving, -direction, reach):
        raise LoadError(_PULLS.format(*np.nan_to_num(control.load)))
    raise PairingError(
        f"moved along ({direction[0]:.3g}, {direction[1]:.3g}) the moving body's face {moving.face!r}, {_span(moving)},"
        f" never meets the fixed body's {fixed.face!r}, {_span(fixed)}, within {reach:g} m: check positions and the"
        " direction, or raise reach"
    )


def _span(body: Body) -> str:
    points = np.vstack([curve.points for curve in body.outline.edge_curves(body.face)])
    (low_x, low_y), (high_x, high_y) = points.min(axis=0), points.max(axis=0)
    return f"x {low_x:.4g} to {high_x:.4g} and y {low_y:.4g} to {high_y:.4g} m"


def solve_contact(
    fixed: Body,
    moving: Body,
    control: Control | Sequence[Control],
    friction: float = 0.0,
    settings: Settings = Settings(),
    steps: int | None = None,
) -> ContactResult:
    """Contact of two bodies in plane strain, under one control or a sequence of controls.

    Parameters
    ----------
    fixed, moving : Body
        Loads and motions are those of the moving body's holder; either may lie above.
    control : Control or sequence of Control
        Force [N/m] or motion [m] by component (bem.plane.coulomb).
    friction : float
        Coefficient [1].
    settings : Settings
        Element sizes and accuracy.
    steps : int, optional
        In which one control is reached: 1 without friction, 10 with.

    Returns
    -------
    ContactResult

    Raises
    ------
    PairingError, LoadError, EquilibriumError, ConvergenceError
        With what is wrong and what to do.

    Examples
    --------
    >>> from rail_fem.bem.verification.exact_problems import two_discs
    >>> below, above = two_discs(1.0, bem.STEEL, bem.STEEL)
    >>> found = bem.solve_contact(below, above, bem.Control.of(force=(None, -100e3))).last
    >>> exact = bem.line_contact(100e3, 0.5, bem.contact_modulus(bem.STEEL, bem.STEEL))
    >>> bool(abs(found.pressure.max() / exact.max_pressure - 1) < 0.02)
    True
    """
    refuse_bad_friction(friction)
    controls = _load_steps(control, steps, friction)
    clock = StageClock()
    reach = settings.reach or moving.outline.size / 2
    moving, controls, initial_approach, near = _bring_into_contact(fixed, moving, controls, reach)
    greatest = max((d for d in controls if not d.nothing), key=lambda d: np.nansum(np.abs(d.load)), default=None)
    patches = [] if greatest is None else estimate_patches(fixed, moving, greatest, friction, reach, near)
    clock.stop("zone")
    for _ in range(settings.rounds):
        result = _solve_on_mesh(fixed, moving, controls, friction, settings, patches, reach, clock)
        unresolved, patches = _unresolved(result, patches, settings)
        if not unresolved:
            break
    result.initial_approach, result.seconds = initial_approach, clock.seconds
    result.warnings += trust_warnings(result)
    if unresolved:
        result.warnings.append(f"{len(unresolved)} patches are coarser than asked for after {settings.rounds} rounds")
    for patch in patches if settings.size is None else []:
        if patch.sharpness <= NARROWEST * patch.half_width:
            result.warnings.append(
                f"the pressure peaks over {patch.sharpness:.3g} m or less of a patch of {2 * patch.half_width:.3g} m,"
                " as at an edge: the largest pressure may miss the accuracy asked for; give a size, and compare with"
                " half of it"
            )
    return result


def _solve_on_mesh(fixed, moving, controls, friction, settings, patches, reach, clock) -> ContactResult:
    carrier = "fixed" if fixed.material.plane_modulus < 0.999 * moving.material.plane_modulus else "moving"
    sizes = [settings.size or element_size(p.sharpness, settings.accuracy) for p in patches]
    # of the patches alone
    check_memory(2 * int(sum(2 * p.half_width / s for p, s in zip(patches, sizes))), settings.memory_limit)
    meshes = []
    for name, body in (("fixed", fixed), ("moving", moving)):
        ratio = 1.0 if name == carrier else settings.other_ratio
        wanted = sizing(
            body.outline, patches, [s * ratio for s in sizes], settings.coarse * body.outline.size, settings.growth
        )
        meshes.append(mesh_outline(body.outline, wanted))
    clock.stop("mesh")
    pillar, mover = (CondensedBody(body, mesh, settings.memory_limit) for body, mesh in zip((fixed, moving), meshes))
    clock.stop("factorise")
    slave, master = (mover, pillar) if carrier == "moving" else (pillar, mover)
    faces = slave.mesh, slave.body.face, master.mesh, master.body.face, master.body.outline
    interface = pair(*faces, reach, _share(slave.body, master.body))
    system = contact_system(interface, slave, master, 1 if carrier == "moving" else -1)
    clock.stop("condense")
    start = np.full(system.nodes, OPEN)
    for patch in patches:
        near = np.hypot(*(interface.points[:, None] - patch.points).T).min(axis=0) < 0.3 * patch.half_width
        start[near] = STICK if friction > 0 else FORWARD
    states = _march(system, controls, friction, start if (start != OPEN).any() else None)
    clock.stop("steps")
    return ContactResult(interface, system, pillar, mover, carrier, np.zeros(2), controls, states, friction)


def _share(slave: Body, master: Body) -> float:
    """Weight of the slave's normal: the deformed interface takes the shape of the stiffer body."""
    return slave.material.plane_modulus / (slave.material.plane_modulus + master.material.plane_modulus)


def _unresolved(result: ContactResult, patches: list[EstimatedPatch], settings: Settings):
    """Patches whose elements are coarser than wanted (with some grace), and the patches to lay the next mesh for."""
    points, coarse, found = result.interface.points, [], []
    spacing = np.r_[np.hypot(*np.diff(points, axis=0).T), 0.0]
    highest = np.max([state.pressure for state in result.steps], axis=0)
    for run in runs(highest > 0):
        half = max(spacing[run[:-1]].sum() + spacing[max(run[0] - 1, 0)] / 2 + spacing[run[-1]] / 2, 1e-300) / 2
        around = slice(max(run[0] - 1, 0), run[-1] + 2)
        sharpness = peak_sharpness(points[around], highest[around], half)
        wanted = settings.size or element_size(sharpness, settings.accuracy)
        found.append(EstimatedPatch(np.vstack([points[run], result.interface.feet[run]]), half, sharpness))
        if max(spacing[run[0] - 1] if run[0] else 0.0, spacing[run].max()) > 1.3 * wanted:
            coarse.append(found[-1])
    return coarse, (found or patches)
