"""A body with inertia, step by step: one factorisation for all steps of one length.

With u1 = predicted + h^2 after_u a1 and the balance of schemes.py, the flexibility equation u1 = D phi1 + L t1 becomes

    (D + k M^-1) phi1 = u* - L t1,        k = Scheme.flexibility(h)

where u* is where a step without phi1 would end. So each step is one solution with a constant matrix, symmetric and
positive as D is, and the loads see the body through its dynamic compliance C - L' (D + k M^-1)^-1 L.
"""

import warnings
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.linalg import LinAlgError, cho_factor, cho_solve

from bem.checks import refuse_unless_positive
from bem.dynamic.body import DynamicBody, DynamicsError
from bem.dynamic.schemes import TRAPEZOIDAL, Scheme


class StepWarning(UserWarning):
    """A step so long that what it shows is no wave."""


@dataclass(frozen=True)
class State:
    """Of the cells, all x then all y: displacement u [m], velocity v [m/s], acceleration a [m/s^2], elastic force phi
    [N/m] (2N,); amplitudes t and displacements q (m,) of the load patterns; time [s]."""

    time: float
    u: np.ndarray
    v: np.ndarray
    a: np.ndarray
    phi: np.ndarray
    t: np.ndarray
    q: np.ndarray


@dataclass(frozen=True)
class Energy:
    """Per metre of thickness [J/m]: kinetic, strain, and the work of all loads since the beginning."""

    kinetic: float
    strain: float
    work: float


def check_step(body: DynamicBody, step: float) -> None:
    """Raise DynamicsError for a step that is none; warn where a wave crosses the body in one."""
    refuse_unless_positive(DynamicsError, **{"step [s]": step})
    extent = np.ptp(body.mesh.vertices, axis=0)
    share = body.waves.dilatational * step / extent.min()
    if share > 0.5:
        warnings.warn(
            f"a step of {step:.3g} s: a dilatational wave of {body.waves.dilatational:.0f} m/s travels"
            f" {body.waves.dilatational * step * 1e3:.3g} mm in it, {share:.2g} of the body's {extent.min() * 1e3:.3g}"
            " mm; waves are not resolved, only the slow swing of the whole body is",
            StepWarning,
            stacklevel=3,
        )


class March:
    """Steps of one length and scheme of a body; `force` (2N,) [N/m] acts on its cells all the time (a weight)."""

    def __init__(
        self, body: DynamicBody, step: float, scheme: Scheme = TRAPEZOIDAL, force: np.ndarray | None = None
    ) -> None:
        check_step(body, step)
        self.body, self.step, self.scheme = body, step, scheme
        self.force = np.zeros(len(body.mass)) if force is None else force
        self._root = np.sqrt(body.mass)
        self._factors = self._factorise()
        self._answer = self._solve(body.reach)
        compliance = body.compliance - body.reach.T @ self._answer
        self.compliance = (compliance + compliance.T) / 2

    def _factorise(self):
        matrix, more = self.body.scaled_flexibility, self.scheme.flexibility(self.step)
        matrix[np.diag_indices_from(matrix)] += more
        try:
            return cho_factor(matrix, overwrite_a=True, check_finite=False)
        except LinAlgError:
            lowest = self.body.inverse_frequencies[-1]
            raise DynamicsError(
                f"the flexibility's lowest eigenvalue is {lowest:.3g} s^2 and a step of {self.step:.3g} s adds only"
                f" {more:.3g}: refine the boundary mesh to the cells' size, or take a longer step"
            ) from None

    def _solve(self, right: np.ndarray) -> np.ndarray:
        """(D + k / M)^-1 times right (2N, ...)."""
        root = self._root if right.ndim == 1 else self._root[:, None]
        return root * cho_solve(self._factors, root * right, check_finite=False)

    def start(self) -> State:
        """At rest in static equilibrium with the constant force."""
        phi = self.force.copy()
        n, m = len(phi), len(self.body.compliance)
        u = self.body.flexibility @ phi
        return State(0.0, u, np.zeros(n), np.zeros(n), phi, np.zeros(m), self.body.reach.T @ phi)

    def free(self, state: State) -> tuple[np.ndarray, np.ndarray]:
        """Elastic force (2N,) and displacement (m,) of the patterns after a step in which no pattern acts."""
        phi = self._solve(self._moved(state, self.force)[0])
        return phi, self.body.reach.T @ phi

    def _moved(self, state: State, after: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """u, v and a after a step at whose end the force (2N,) acts on the cells."""
        before = self.force - state.phi
        return self.scheme.moved(self.step, self.body.mass, state.u, state.v, state.a, before, after)

    def advance(self, state: State, amplitude: np.ndarray, free: tuple[np.ndarray, np.ndarray] | None = None) -> State:
        """The state after a step at whose end the patterns have the amplitude (m,); `free`, where known, of this
        state."""
        phi, q = self.free(state) if free is None else free
        phi = phi - self._answer @ amplitude
        moved = self._moved(state, self.force - phi)
        return State(state.time + self.step, *moved, phi, amplitude, q + self.compliance @ amplitude)

    def energy(self, state: State, before: tuple[State, Energy] | None = None) -> Energy:
        """Energies of a state; work since the state before it by the trapezoidal rule of loads over displacements."""
        kinetic = 0.5 * float(self.body.mass @ state.v**2)
        strain = 0.5 * float(state.phi @ state.u + state.t @ state.q)
        if before is None:
            return Energy(kinetic, strain, kinetic + strain)
        former, energy = before
        work = 0.5 * float((former.t + state.t) @ (state.q - former.q)) + float(self.force @ (state.u - former.u))
        return Energy(kinetic, strain, energy.work + work)


@dataclass(frozen=True)
class History:
    """Of k + 1 instants: time (k+1,) [s], displacement q (k+1, m) of the patterns [m], energies (k+1, 3) kinetic,
    strain, work [J/m]."""

    time: np.ndarray
    q: np.ndarray
    energy: np.ndarray

    @property
    def imbalance(self) -> np.ndarray:
        """Kinetic and strain energy beyond the work done (k+1,), over the largest total so far."""
        total = self.energy[:, 0] + self.energy[:, 1]
        return (total - self.energy[:, 2]) / np.maximum(np.maximum.accumulate(total), 1e-300)


def respond(march: March, load: Callable[[float], np.ndarray], steps: int) -> History:
    """March under loads: time [s] -> amplitudes (m,) of the patterns."""
    if not isinstance(steps, (int, np.integer)) or steps < 1:
        raise DynamicsError(f"steps = {steps!r}: must be a positive whole number")
    states = [march.start()]
    energies = [march.energy(states[0])]
    for _ in range(steps):
        state = states[-1]
        states.append(march.advance(state, np.atleast_1d(np.asarray(load(state.time + march.step), float))))
        energies.append(march.energy(states[-1], (state, energies[-1])))
    return History(
        np.array([s.time for s in states]),
        np.array([s.q for s in states]),
        np.array([[e.kinetic, e.strain, e.work] for e in energies]),
    )
