"""Few masses on springs and dampers, loaded by one wheel on several contacts: the time step of the light models.

All contacts act along one coordinate, s = coupling . q (wheel less track). A body at distance s is approached by d =
height - s and pushes with the force F that solves d = (F / stiffness)^(1 / exponent) + plastic_compliance * max(F -
yield_load, 0): Hertz' law, and a plastic indentation above the yield load. F only grows with d, so each step closes
with one equation for s that has exactly one root. Scheme: implicit midpoint rule, second order, symplectic where
nothing damps, unconditionally stable.

The wheel may run on a beam (rail_fem.light.track_beam) instead of a mass: s is then coupling . q less the beam's height
under the wheel, which moves on along it.
Source: Hairer, Lubich, Wanner, Geometric Numerical Integration (2006), section II.1.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from kernel_cache import njit
from rail_fem.light.beam_kernel import BeamBand, band_solve, band_times, height_under, load_at

MOST_ITERATIONS = 100
CLOSED = 1e-15  # to which s is found [m]


class Masses(NamedTuple):
    """Linear part of the system of n masses: mass (n,) [kg], stiffness (n, n) [N/m], damping (n, n) [N s/m], load (n,)
    [N].

    coupling : (n,)  +1 for the wheel, -1 for the body under it, 0 else; a positive contact force F acts as coupling * F
    """

    mass: np.ndarray
    stiffness: np.ndarray
    damping: np.ndarray
    load: np.ndarray
    coupling: np.ndarray


class VerticalMotion(NamedTuple):
    """What came out, at the m + 1 ends of the steps but for `force`.

    position, velocity : (m + 1, n) [m, m/s];  force : (bodies, m) mean over each step [N]
    path_work : (m,) work of each step done by moving the path under the wheel [J];
    loss : (m,) work of each step in the dampers [J]
    beam_position, beam_velocity : (m + 1, k) of a beam's degrees of freedom; None without one
    """

    position: np.ndarray
    velocity: np.ndarray
    force: np.ndarray
    path_work: np.ndarray
    loss: np.ndarray
    beam_position: np.ndarray | None = None
    beam_velocity: np.ndarray | None = None


class BeamStart(NamedTuple):
    """A beam under the wheel when a march begins: its matrices for this step, position and velocity (k,), and where
    the wheel is at the ends and middles of the steps, x (2 m + 1,) [m]."""

    band: BeamBand
    position: np.ndarray
    velocity: np.ndarray
    x: np.ndarray


@dataclass(frozen=True)
class ContactLaw:
    """Contacts at the ends and middles of m steps.

    height : (bodies, 2 m + 1) axle height at which the wheel comes into contact [m]; -inf out of reach
    stiffness : (bodies, 2 m + 1) [N/m^exponent]
    yield_load, plastic_compliance : (bodies, 2 m + 1) force at which plastic indentation begins [N] and its depth per
        force above [m/N]; None: elastic
    exponent : 1.5 (Hertz) or 1 (linear)
    """

    height: np.ndarray
    stiffness: np.ndarray
    yield_load: np.ndarray | None = None
    plastic_compliance: np.ndarray | None = None
    exponent: float = 1.5

    @property
    def arrays(self) -> tuple:
        """What the kernels take: height, (stiffness, yield_load, plastic_compliance), exponent."""
        none = np.zeros_like(self.stiffness)
        yield_load, plastic_compliance = (
            none if self.yield_load is None else self.yield_load,
            none if self.plastic_compliance is None else self.plastic_compliance,
        )
        return self.height, np.stack([self.stiffness, yield_load, plastic_compliance], axis=-1), self.exponent


def integrate(
    masses: Masses,
    position: np.ndarray,
    velocity: np.ndarray,
    step: float,
    law: ContactLaw,
    beam: BeamStart | None = None,
) -> VerticalMotion:
    """March from the start (n,), (n,) [m, m/s] over m steps of `step` [s], on a beam where one is given.

    Error: second order in the step (tests/rail_fem/test_vertical_dynamics.py).
    Errors: ValueError for shapes that do not fit, FloatingPointError when the motion is not finite.
    """
    times = law.height.shape[1]
    if law.height.shape != law.stiffness.shape or times % 2 == 0 or times < 3:
        raise ValueError(
            f"vertical dynamics: heights {law.height.shape} and stiffnesses {law.stiffness.shape} must agree and hold"
            " an odd number >= 3 of times"
        )
    if not (np.isfinite(step) and step > 0):
        raise ValueError(f"vertical dynamics: step {step!r} s must be positive")
    inverse = np.linalg.inv(2 / step * np.diag(masses.mass) + masses.damping + step / 2 * masses.stiffness)
    start = np.array(position, float), np.array(velocity, float)
    found = _march(masses, inverse, *start, step, *law.arrays, *(beam or (None,) * 4))
    if not np.isfinite(found.position).all():
        bad = int(np.argmin(np.isfinite(found.position).all(axis=1)))
        raise FloatingPointError(
            f"vertical dynamics: the motion is not finite from step {bad} of {len(found.position) - 1} on, t ="
            f" {bad * step:.4g} s"
        )
    return found


@njit(cache=True)
def contact_force(depth, law, exponent):
    """Force [N] at an approach [m] and its derivative; law: (stiffness, yield_load, plastic_compliance).

    Beyond the limit by Newton's method from the limit up: the depth is a concave function of the force, so no iterate
    overshoots.
    """
    stiffness, yield_load, plastic_compliance = law
    if depth <= 0:
        return 0.0, 0.0
    force = stiffness * depth**exponent
    if plastic_compliance == 0.0 or force <= yield_load:
        return force, exponent * force / depth
    force = max(yield_load, 1e-12)
    for _ in range(MOST_ITERATIONS):
        elastic = (force / stiffness) ** (1 / exponent)
        slope = elastic / (exponent * force) + plastic_compliance
        change = (depth - elastic - plastic_compliance * (force - yield_load)) / slope
        force += change
        if change <= 1e-14 * force:
            break
    return force, 1 / slope


@njit(cache=True)
def contact_forces(s, height, law, exponent, out):
    """Force of each body (bodies,) into `out`, and the derivative of their sum to s."""
    slope = 0.0
    for b in range(len(height)):
        out[b], stiffening = contact_force(height[b] - s, law[b], exponent)
        slope -= stiffening
    return slope


@njit(cache=True)
def solve_distance(unloaded, compliance, height, law, exponent, out):
    """Root s of s = free + compliance * sum of forces(s); `out` (bodies,) holds the forces there.

    Newton's method, held between the bounds that are known: the forces fall with s and are 0 at the highest body.
    """
    low, high, s = unloaded, max(unloaded, height.max()), unloaded
    for _ in range(MOST_ITERATIONS):
        slope = contact_forces(s, height, law, exponent, out)
        residual = unloaded + compliance * out.sum() - s
        low, high = (s, high) if residual >= 0 else (low, s)
        new = s + residual / (1.0 - compliance * slope)
        if not low <= new <= high:
            new = (low + high) / 2
        change, s = new - s, new
        if abs(change) <= CLOSED:
            break
    contact_forces(s, height, law, exponent, out)
    return s


@njit(cache=True)
def contact_energy(s, height, law, exponent):
    """Work that bringing the contacts to distance s takes [J]; of a plastic indentation, this is not given back."""
    energy = 0.0
    for b in range(len(height)):
        force, _ = contact_force(height[b] - s, law[b], exponent)
        if force > 0:
            stiffness, yield_load, plastic_compliance = law[b]
            energy += force * (force / stiffness) ** (1 / exponent) / (1 + 1 / exponent) / exponent
            energy += plastic_compliance * max(force**2 - yield_load**2, 0.0) / 2
    return energy


@njit(cache=True)
def contact_energies(s, height, law, exponent):
    """contact_energy at each of the distances s (m,) with height (bodies, m) and law (bodies, m, 3)."""
    out = np.empty(len(s))
    for i in range(len(s)):
        out[i] = contact_energy(s[i], height[:, i], law[:, i], exponent)
    return out


@njit(cache=True)
def _march(masses, inverse, q, v, step, height, law, exponent, beam, u, w, x):
    coupling = masses.coupling
    steps = (height.shape[1] - 1) // 2
    position, velocity = np.empty((steps + 1, len(q))), np.empty((steps + 1, len(q)))
    force, path_work, loss = np.empty((height.shape[0], steps)), np.empty(steps), np.empty(steps)
    now = np.empty(height.shape[0])
    position[0], velocity[0] = q, v
    beam_position, beam_velocity = _beam_history(steps, u, w)
    reply = inverse @ coupling
    compliance = step / 2 * (coupling @ reply)
    before = after = 0.0
    for i in range(steps):
        still = inverse @ (2 / step * masses.mass * v - masses.stiffness @ q + masses.load)
        unloaded = coupling @ (q + step / 2 * still)
        soft = compliance
        if beam is not None:
            beam_still = band_solve(beam.factor, 2 / step * band_times(beam.mass, w) - band_times(beam.stiffness, u))
            beam_reply = band_solve(beam.factor, load_at(x[2 * i + 1], beam))
            unloaded -= height_under(u + step / 2 * beam_still, x[2 * i + 1], beam)
            soft += step / 2 * height_under(beam_reply, x[2 * i + 1], beam)
        s = solve_distance(unloaded, soft, height[:, 2 * i + 1], law[:, 2 * i + 1], exponent, now)
        middle = still + reply * now.sum()
        q = q + step * middle
        v = 2 * middle - v
        position[i + 1], velocity[i + 1] = q, v
        force[:, i] = now
        loss[i] = step * (middle @ (masses.damping @ middle))
        if beam is not None:
            beam_middle = beam_still - beam_reply * now.sum()
            mean = u + step / 2 * beam_middle
            under = height_under(mean, x[2 * i + 1], beam)
            before = under - height_under(mean, x[2 * i], beam)
            after = under - height_under(mean, x[2 * i + 2], beam)
            u = u + step * beam_middle
            w = 2 * beam_middle - w
            beam_position[i + 1], beam_velocity[i + 1] = u, w
            loss[i] += step * (beam_middle @ band_times(beam.damping, beam_middle))
        path_work[i] = _path_work(s + before, s + after, height, law, exponent, i)
    return VerticalMotion(position, velocity, force, path_work, loss, beam_position, beam_velocity)


@njit(cache=True)
def _beam_history(steps, u, w):
    """Arrays (m + 1, k) that begin with u and w (k,); None without a beam."""
    if u is None:
        return None, None
    beam_position, beam_velocity = np.empty((steps + 1, len(u))), np.empty((steps + 1, len(u)))
    beam_position[0], beam_velocity[0] = u, w
    return beam_position, beam_velocity


@njit(cache=True)
def _path_work(before, after, height, law, exponent, i):
    """Work done on the contacts by moving the path on during step i, at the distances that the masses' middle leaves
    at both ends: the same, but on a beam, which is as high elsewhere as it is inclined."""
    energy = contact_energy(after, height[:, 2 * i + 2], law[:, 2 * i + 2], exponent)
    return energy - contact_energy(before, height[:, 2 * i], law[:, 2 * i], exponent)


def static_distance(load: float, law: ContactLaw) -> float:
    """Distance s [m] at which the contacts carry `load` [N] at the first of the law's times, to round-off."""
    heights, laws, exponent = law.arrays
    height, at, out = heights[:, 0], laws[:, 0], np.empty(len(heights))
    best = int(np.argmax(height))
    stiffness, yield_load, plastic_compliance = at[best]
    high = float(height[best])
    low = high - (load / stiffness) ** (1 / exponent) - plastic_compliance * max(load - yield_load, 0.0)
    while (low + high) / 2 not in (low, high):
        middle = (low + high) / 2
        contact_forces(middle, height, at, exponent, out)
        low, high = (middle, high) if out.sum() > load else (low, middle)
    return (low + high) / 2
