"""Unilateral contact with Coulomb friction between points whose compliance is known: one load step.

At each node: pressure p and shear traction q on the slave, gap g and slip s (slave over master, along the tangent).

    [g; s] = [gap_0; 0] + compliance [p; q] + rigid motion            motion: (x, y, rotation) of the slave
    p >= 0, g >= 0, p g = 0;   |q| <= mu p;   q = -mu p sign(s - s_before) where they differ
    forces [p; q] + load = 0 for the components of the motion that are controlled by a load

The states (open, stick, slip forward or backward) are found by block principal pivoting: all nodes that contradict
their state change together; when that no longer makes progress, one at a time (Judice and Pires 1994, for friction
without their proof of an end). The linear systems are exact, so forces balance to round-off.
"""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from numbers import Real

import numpy as np
from scipy.linalg import LinAlgError, lu_factor, lu_solve

from bem.checks import refuse_unless_finite
from bem.plane.boundary import EquilibriumError

OPEN, STICK, FORWARD, BACKWARD = 0, 2, 1, -1  # FORWARD: q = +mu p, the slave slips backward


class FrictionError(ValueError):
    """A coefficient of friction below zero, or no number."""


class ConvergenceError(RuntimeError):
    """No consistent set of open, sticking and slipping nodes was found."""


def refuse_bad_friction(friction: float) -> None:
    """Raise FrictionError for what is no coefficient of friction."""
    if not isinstance(friction, (Real, np.number)) or not friction >= 0:
        raise FrictionError(f"friction = {friction!r}: must be zero or positive (inf: nothing slides)")


@dataclass(frozen=True)
class ContactSystem:
    """What a load step needs to know of two condensed bodies; n nodes.

    gap (n,) [m]; compliance (2n, 2n) [m/Pa]: pressures then shears -> gaps then slips
    motion (2n, 3): rigid motion of the slave (x, y [m], rotation) -> gaps then slips
    forces (3, 2n): pressures then shears -> force (x, y) [N/m] and moment [N] on the slave
    """

    gap: np.ndarray
    compliance: np.ndarray
    motion: np.ndarray
    forces: np.ndarray

    @property
    def nodes(self) -> int:
        """Number of nodes of the interface."""
        return len(self.gap)


def local_motion(points: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """Gaps then slips (2n, 3) of nodes at points (n, 2) [m] by unit motions x, y and rotation of their body; normals
    (n, 2) out of it."""
    (x, y), (nx, ny) = points.T, normals.T
    return np.vstack([np.column_stack([-nx, -ny, nx * y - ny * x]), np.column_stack([-ny, nx, ny * y + nx * x])])


@dataclass(frozen=True)
class Control:
    """What controls the slave: in each of x, y and rotation either a motion or a load.

    Parameters
    ----------
    motion : (3,) array
        [m, m, rad]; nan where a load is given.
    load : (3,) array
        [N/m, N/m, N]; nan where a motion is given.

    Raises
    ------
    EquilibriumError
        For a component with both or neither.

    Examples
    --------
    >>> bem.Control.of(force=(None, -100e3)).load
    array([     nan, -100000.,      nan])
    """

    motion: np.ndarray
    load: np.ndarray

    def __post_init__(self) -> None:
        motion, load = np.asarray(self.motion, float), np.asarray(self.load, float)
        if motion.shape != (3,) or load.shape != (3,):
            raise EquilibriumError(
                f"motion and load have the shapes {motion.shape} and {load.shape}: give three components each, x, y and"
                " rotation (Control.of does)"
            )
        if np.any(np.isnan(motion) == np.isnan(load)) or np.isinf([motion, load]).any():
            raise EquilibriumError(
                f"motion {motion}, load {load}: in each component one must be a finite number and the other nan"
            )

    @classmethod
    def of(
        cls, force=(None, None), motion=(None, None), rotation: float | None = 0.0, moment: float | None = None
    ) -> Control:
        """Control from components; what has neither force nor motion is kept from moving."""
        if any(not isinstance(pair, (tuple, list, np.ndarray)) or len(pair) != 2 for pair in (force, motion)):
            raise EquilibriumError(f"force {force!r}, motion {motion!r}: give (x, y), each a number or None")
        loads = [*force, moment]
        if moment is not None and rotation == 0.0:
            rotation = None
        motions = [0.0 if m is None and f is None else m for f, m in zip(loads, [*motion, rotation])]
        for name, f, m in zip(("x", "y", "rotation"), loads, motions):
            if f is not None and m is not None:
                raise EquilibriumError(f"{name}: both a load ({f}) and a motion ({m}) are prescribed; choose one")
        for kind, values in (("motion", motions), ("load", loads)):
            for name, value in zip(("x", "y", "rotation"), values):
                if value is not None:
                    refuse_unless_finite(EquilibriumError, **{f"{kind} of {name}": value})
        return cls(*(np.array([np.nan if v is None else float(v) for v in values]) for values in (motions, loads)))

    @property
    def loaded(self) -> np.ndarray:
        """(3,) bool: controlled by a load."""
        return np.isnan(self.motion)

    @property
    def nothing(self) -> bool:
        """Whether it asks for no contact at all: a load of nothing, and no motion."""
        asked = np.nan_to_num(self.load).any() or np.nan_to_num(self.motion).any()
        return bool(self.loaded.any() and not asked)


@dataclass(frozen=True)
class ContactState:
    """Pressure, shear [Pa], gap, slip [m] (n,), state (n,), motion of the slave (3,), iterations used."""

    pressure: np.ndarray
    shear: np.ndarray
    gap: np.ndarray
    slip: np.ndarray
    state: np.ndarray
    motion: np.ndarray
    iterations: int

    @classmethod
    def apart(cls, gap: np.ndarray, slip: np.ndarray) -> ContactState:
        """Bodies that do not touch."""
        none = np.zeros(len(gap))
        return cls(none, none, gap, slip, np.full(len(gap), OPEN), np.zeros(3), 0)


def _solve_regular(matrix: np.ndarray, right: np.ndarray) -> np.ndarray:
    """Solution of a linear system; LinAlgError when it is singular to round-off."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # an exact zero pivot is reported below
        factors = lu_factor(matrix, overwrite_a=True, check_finite=False)
    pivots = np.abs(np.diag(factors[0]))
    if not pivots.min() > 1e-13 * pivots.max():
        raise LinAlgError("singular")
    return lu_solve(factors, right, overwrite_b=True, check_finite=False)


def solve_linear(system: ContactSystem, control: Control, friction: np.ndarray, offset: np.ndarray, state: np.ndarray):
    """Pressures, shears (n, ...) and motion (3, ...) for given states (n,), friction (n,) and gaps and slips without
    tractions (2n, ...); equations are scaled so that all unknowns are of one size."""
    n, more = system.nodes, offset.shape[1:]
    closed, stick = np.flatnonzero(state != OPEN), np.flatnonzero(state == STICK)
    loaded = np.flatnonzero(control.loaded)
    known = np.nan_to_num(control.motion)
    pressure, shear, motion = np.zeros((n, *more)), np.zeros((n, *more)), np.zeros((3, *more))
    motion.T[...] = known
    if not len(closed) and not len(loaded):
        return pressure, shear, motion
    unit = np.abs(np.diag(system.compliance)[:n]).mean()
    sliding = np.where(np.abs(state) == 1, state * np.where(np.isinf(friction), 0.0, friction), 0.0)[closed]
    columns, force = (
        np.hstack([of[:, closed] + of[:, n + closed] * sliding, of[:, n + stick]])
        for of in (system.compliance, system.forces)
    )
    rows = np.r_[closed, n + stick]
    arm = np.maximum(np.abs(system.motion).max(axis=0), 1e-300)[loaded]
    strength = np.abs(system.forces).max() * arm
    a, b = len(rows), len(loaded)
    matrix = np.zeros((a + b, a + b))
    matrix[:a, :a] = columns[rows] / unit
    matrix[:a, a:] = system.motion[np.ix_(rows, loaded)] / arm
    matrix[a:, :a] = force[loaded] / strength[:, None]
    right = np.empty((a + b, *more))
    right[:a] = -(offset.T + system.motion @ known).T[rows] / unit
    right[a:].T[...] = -control.load[loaded] / strength
    answer = _solve_regular(matrix, right)
    pressure[closed] = answer[: len(closed)]
    shear[closed] = (sliding * answer[: len(closed)].T).T
    shear[stick] = answer[len(closed) : a]
    motion[loaded] = (answer[a:].T * unit / arm).T
    return pressure, shear, motion


def _contradictions(pressure, shear, gap, slipped, state, friction, unit):
    """State each node should have, and by how much [Pa] it contradicts the one it has."""
    scale = max(np.abs(pressure).max(), 1e-300)
    tolerance = 1e-11 * scale
    wanted, size = state.copy(), np.zeros(len(state))
    pull = (state != OPEN) & (pressure < -tolerance)
    # a sticking node that is pulled first slips: its shear, not its pressure, may be what is wrong
    no_slip = np.isinf(friction)
    against = np.where(no_slip, STICK, np.where(slipped > 0, BACKWARD, FORWARD))
    wanted[pull] = np.where((state == STICK) & (shear != 0) & ~no_slip, np.where(shear > 0, FORWARD, BACKWARD), OPEN)[
        pull
    ]
    size[pull] = -pressure[pull]
    overlap = (state == OPEN) & (-gap / unit > tolerance)
    wanted[overlap], size[overlap] = against[overlap], -gap[overlap] / unit
    excess = np.abs(shear) - np.where(no_slip, 0.0, friction) * np.maximum(pressure, 0)
    slide = (state == STICK) & ~pull & ~no_slip & (excess > tolerance)
    wanted[slide], size[slide] = np.where(shear > 0, FORWARD, BACKWARD)[slide], excess[slide]
    along = np.where(np.abs(state) == 1, state, 0) * slipped / unit
    back = (along > tolerance) & ~pull & (friction > 0)
    wanted[back], size[back] = STICK, along[back]
    return wanted, size


def solve_step(
    system: ContactSystem,
    control: Control,
    friction: float | np.ndarray,
    before: np.ndarray | None = None,
    state: np.ndarray | None = None,
    limit: int = 0,
) -> ContactState:
    """One load step to its exact end.

    friction : coefficient, a number or (n,), inf where nothing slides; before : (n,) slip at the end of the last step
        [m]
    state    : (n,) states to start from, default all closed; limit : iterations allowed, default 60 + 4 n
    Raises EquilibriumError when no contact can balance the load, ConvergenceError when no consistent states are found.
    """
    friction = np.broadcast_to(np.asarray(friction, float), system.nodes)
    try:
        return _pivot(system, control, friction, before, state, limit)
    except ConvergenceError:
        if not 1 < friction.max() < np.inf:
            raise
        no_slip = _pivot(system, control, np.where(friction > 1, np.inf, friction), before, state, limit)
        # high friction: from where nothing slides
        return _pivot(system, control, friction, before, no_slip.state, limit)


def _pivot(
    system: ContactSystem,
    control: Control,
    friction: np.ndarray,
    before: np.ndarray | None,
    state: np.ndarray | None,
    limit: int,
) -> ContactState:
    """Block principal pivoting from given states; friction (n,)."""
    n = system.nodes
    before = np.zeros(n) if before is None else before
    closed = np.where(friction > 0, STICK, FORWARD)
    state = closed.copy() if state is None else state.copy()
    if control.loaded.any() and not (state != OPEN).any():
        state = closed.copy()
    unit = np.abs(np.diag(system.compliance)[:n]).mean()
    fewest, patience = 3 * n + 1, 8
    limit = limit or 60 + 4 * n
    for iteration in range(1, limit + 1):
        pressure, shear, motion = _attempt(system, control, friction, before, state)
        moved = system.compliance @ np.r_[pressure, shear] + system.motion @ motion
        gap, slip = system.gap + moved[:n], moved[n:]
        wanted, size = _contradictions(pressure, shear, gap, slip - before, state, friction, unit)
        wrong = np.flatnonzero(wanted != state)
        if not len(wrong):
            return ContactState(pressure, shear, gap, slip, state, motion, iteration)
        if len(wrong) < fewest:
            fewest, patience = len(wrong), 8
        else:
            patience -= 1
        change = wrong if patience > 0 else wrong[[np.argmax(size[wrong])]]
        following = state.copy()
        following[change] = wanted[change]
        state = _keep_hold(following, state, pressure, control)
    remedy = (
        f"lower the friction {friction.max():g}" if friction.max() <= 1 else "give the friction of dry bodies, below 1"
    )
    raise ConvergenceError(
        f"{len(wrong)} of {n} nodes still change between open, stick and slip after {limit} iterations (worst by "
        f"{size.max():.3g} Pa): apply the load in more steps, or {remedy}"
    )


def _attempt(system, control, friction, before, state):
    try:
        return solve_linear(system, control, friction, np.r_[system.gap, -before], state)
    except LinAlgError:
        loads = ", ".join(
            f"{name} {value:.4g} {unit}"
            for name, value, unit, loaded in zip(
                ("x", "y", "moment"), control.load, ("N/m", "N/m", "N"), control.loaded
            )
            if loaded
        )
        raise EquilibriumError(
            f"load ({loads}) cannot be balanced: {(state != OPEN).sum()} of {system.nodes} nodes touch and"
            f" {(state == STICK).sum()} stick with friction {friction.max():g}; hold the direction that slides"
            " (prescribe its motion), or reduce the tangential load or the moment"
        ) from None


def _keep_hold(state, former, pressure, control):
    """Load-controlled bodies must touch somewhere: if every node would open, keep the one that is pressed most."""
    if control.loaded.any() and not (state != OPEN).any():
        state[np.argmax(pressure)] = former[np.argmax(pressure)]
    return state
