"""Few masses on springs and dampers, loaded by one wheel on several contacts: the time step of the light models.

All contacts act along one coordinate, s = coupling . q (wheel less track). A body at distance s is approached by d =
height - s and pushes with a force F that only grows with d (rail_fem.contact.contact_law), so each step closes with one
equation for s that has exactly one root. A plastic indentation p that lags behind the force is a state of its own,
dp/dt = (p(F) - p) / lag. Scheme: implicit midpoint rule, second order, symplectic where nothing damps, unconditionally
stable.

The wheel may run on a beam (rail_fem.passes.track_beam) instead of a mass: s is then coupling . q less the beam's
height under the wheel, which moves on along it.
Source: Hairer, Lubich, Wanner, Geometric Numerical Integration (2006), section II.1.
"""

from typing import NamedTuple

import numpy as np

from kernel_cache import njit
from rail_fem.contact.contact_law import (
    MOST_ITERATIONS,
    ContactLaw,
    contact_energy,
    contact_forces,
    first_dents,
    follow,
    indentation,
    lagging,
    put,
)
from rail_fem.passes.beam_kernel import BeamBand, band_solve, band_times, height_under, load_at

SPRUNG, WHEEL, TRACK = range(3)  # of the masses of a pass
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


class PassMotion(NamedTuple):
    """What came out of m steps, at their m + 1 ends but for `force` and the works.

    position, velocity : (m + 1, n) [m, rad; a second];  force : (c, m) of each contact, mean over each step [N]
    path_work, loss : (m,) work of each step done by moving the path under the wheel, in the dampers [J]
    dent : (c, m + 1) plastic indentation that lags behind the force [m]; 0 where it does not lag
    friction : (m,) work of each step in creep [J]; None without creep
    beam_position, beam_velocity : (m + 1, k) of a beam's degrees of freedom; None without one
    """

    position: np.ndarray
    velocity: np.ndarray
    force: np.ndarray
    path_work: np.ndarray
    loss: np.ndarray
    dent: np.ndarray
    friction: np.ndarray | None = None
    beam_position: np.ndarray | None = None
    beam_velocity: np.ndarray | None = None


class BeamStart(NamedTuple):
    """A beam under the wheel when a march begins: its matrices for this step, position and velocity (k,), and where
    the wheel is at the ends and middles of the steps, x (2 m + 1,) [m]."""

    band: BeamBand
    position: np.ndarray
    velocity: np.ndarray
    x: np.ndarray


@njit(cache=True)
def begun(q, v, contacts, steps, friction, beam_position, beam_velocity):
    """A PassMotion that stands at q, v (n,), of so many contacts and steps."""
    motion = PassMotion(
        np.empty((steps + 1, len(q))),
        np.empty((steps + 1, len(q))),
        np.empty((contacts, steps)),
        np.empty(steps),
        np.empty(steps),
        np.zeros((contacts, steps + 1)),
        friction,
        beam_position,
        beam_velocity,
    )
    put(motion.position[0], q)
    put(motion.velocity[0], v)
    return motion


def integrate(
    masses: Masses,
    position: np.ndarray,
    velocity: np.ndarray,
    step: float,
    law: ContactLaw,
    beam: BeamStart | None = None,
) -> PassMotion:
    """March from the start (n,), (n,) [m, m/s] over m steps of `step` [s], on a beam where one is given.

    Error: second order in the step (tests/rail_fem/test_vertical_dynamics.py).
    Errors: FloatingPointError when the motion is not finite.
    """
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
def solve_distance(unloaded, compliance, height, law, out):
    """Root s of s = free + compliance * sum of forces(s); `out` (bodies,) holds the forces there.

    Newton's method, held between the bounds that are known: the forces fall with s and are 0 at the highest body.
    """
    low, high, s = unloaded, max(unloaded, height.max()), unloaded
    for _ in range(MOST_ITERATIONS):
        slope = contact_forces(s, height, law, out)
        residual = unloaded + compliance * out.sum() - s
        low, high = (s, high) if residual >= 0 else (low, s)
        new = s + residual / (1.0 - compliance * slope)
        if not low <= new <= high:
            new = (low + high) / 2
        change, s = new - s, new
        if abs(change) <= CLOSED:
            break
    contact_forces(s, height, law, out)
    return s


@njit(cache=True)
def _march(masses, inverse, q, v, step, height, law, beam, u, w, x):
    coupling = masses.coupling
    steps = (height.shape[1] - 1) // 2
    motion = begun(q, v, height.shape[0], steps, None, *_beam_history(steps, u, w))
    now, top, here = np.empty(height.shape[0]), np.empty(height.shape[0]), law[:, 0].copy()
    position, velocity, force = motion.position, motion.velocity, motion.force
    dent, loss, path_work = motion.dent, motion.loss, motion.path_work
    reply = inverse @ coupling
    compliance = step / 2 * (coupling @ reply)
    before = after = 0.0
    start = coupling @ q - (0.0 if beam is None else height_under(u, x[0], beam))
    contact_forces(start, height[:, 0], law[:, 0], now)
    first_dents(now, law[:, 0], dent)
    for i in range(steps):
        still = inverse @ (2 / step * masses.mass * v - masses.stiffness @ q + masses.load)
        unloaded = coupling @ (q + step / 2 * still)
        soft = compliance
        if beam is not None:
            beam_still = band_solve(beam.factor, 2 / step * band_times(beam.mass, w) - band_times(beam.stiffness, u))
            beam_reply = band_solve(beam.factor, load_at(x[2 * i + 1], beam))
            unloaded -= height_under(u + step / 2 * beam_still, x[2 * i + 1], beam)
            soft += step / 2 * height_under(beam_reply, x[2 * i + 1], beam)
        lagging(dent[:, i], height[:, 2 * i + 1], law[:, 2 * i + 1], step, top, here)
        s = solve_distance(unloaded, soft, top, here, now)
        follow(dent, i, now, law[:, 2 * i + 1], step)
        middle = still + reply * now.sum()
        q = q + step * middle
        v = 2 * middle - v
        put(position[i + 1], q)
        put(velocity[i + 1], v)
        put(force[:, i], now)
        loss[i] = step * (middle @ (masses.damping @ middle))
        if beam is not None:
            beam_middle = beam_still - beam_reply * now.sum()
            mean = u + step / 2 * beam_middle
            under = height_under(mean, x[2 * i + 1], beam)
            before = under - height_under(mean, x[2 * i], beam)
            after = under - height_under(mean, x[2 * i + 2], beam)
            u = u + step * beam_middle
            w = 2 * beam_middle - w
            put(motion.beam_position[i + 1], u)
            put(motion.beam_velocity[i + 1], w)
            loss[i] += step * (beam_middle @ band_times(beam.damping, beam_middle))
        path_work[i] = _path_work(s + before, s + after, height, dent, law, i)
    return motion


@njit(cache=True)
def _beam_history(steps, u, w):
    """Arrays (m + 1, k) that begin with u and w (k,); None without a beam."""
    if u is None:
        return None, None
    beam_position, beam_velocity = np.empty((steps + 1, len(u))), np.empty((steps + 1, len(u)))
    put(beam_position[0], u)
    put(beam_velocity[0], w)
    return beam_position, beam_velocity


@njit(cache=True)
def _path_work(before, after, height, dent, law, i):
    """Work done on the contacts by moving the path on during step i, dents that lag with it, at the distances that the
    masses' middle leaves at both ends: the same, but on a beam, which is as high elsewhere as it is inclined."""
    energy = contact_energy(after, height[:, 2 * i + 2] - dent[:, i + 1], law[:, 2 * i + 2])
    return energy - contact_energy(before, height[:, 2 * i] - dent[:, i], law[:, 2 * i])


def static_distance(load: float, law: ContactLaw) -> float:
    """Distance s [m] at which the contacts carry `load` [N] at the first of the law's times, to round-off."""
    heights, laws = law.arrays
    height, at, out = heights[:, 0], laws[:, 0], np.empty(len(heights))
    best = int(np.argmax(height))
    high = float(height[best])
    low = high - (load / at[best, 0]) ** (1 / at[best, 1]) - indentation(load, at[best])
    while (low + high) / 2 not in (low, high):
        middle = (low + high) / 2
        contact_forces(middle, height, at, out)
        low, high = (middle, high) if out.sum() > load else (low, middle)
    return (low + high) / 2
