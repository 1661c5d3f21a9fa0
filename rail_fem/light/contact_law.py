"""Force and approach of a wheel on a body: Hertz' law, and what the steel gives way for good.

An approach d takes the force F that solves d = e(F) + p(F): Hertz' e = (F / stiffness)^(1 / exponent), and above the
yield load Y a plastic indentation p, either plastic_compliance * (F - Y), at once, or plastic_compliance * (F - Y e /
e(Y)), which comes after a time `lag`. F only grows with d.
"""

from dataclasses import dataclass

import numpy as np

from kernel_cache import njit

MOST_ITERATIONS = 100


@dataclass(frozen=True)
class ContactLaw:
    """Contacts at the ends and middles of m steps.

    height : (bodies, 2 m + 1) axle height at which the wheel comes into contact [m]; -inf out of reach
    stiffness : (bodies, 2 m + 1) [N/m^exponent]
    yield_load, plastic_compliance : (bodies, 2 m + 1) force at which plastic indentation begins [N] and its depth per
        force above [m/N]; None: elastic
    lag : (bodies, 2 m + 1) time in which the indentation follows the force [s], and with it the second form of the
        indentation; None: the first form, at once
    exponent : 1.5 (Hertz) or 1 (linear)
    """

    height: np.ndarray
    stiffness: np.ndarray
    yield_load: np.ndarray | None = None
    plastic_compliance: np.ndarray | None = None
    exponent: float = 1.5
    lag: np.ndarray | None = None

    @property
    def arrays(self) -> tuple:
        """What the kernels take: height, (stiffness, yield_load, plastic_compliance, lag), exponent."""
        none = np.zeros_like(self.stiffness)
        values = (self.stiffness, self.yield_load, self.plastic_compliance, self.lag)
        return self.height, np.stack([none if v is None else v for v in values], axis=-1), self.exponent


@njit(cache=True)
def contact_force(depth, law, exponent):
    """Force [N] at an approach [m] and its derivative; law: (stiffness, yield_load, plastic_compliance, lag).

    Beyond the limit by Newton's method from the limit up: the depth is a concave function of the force, so no iterate
    overshoots.
    """
    stiffness, yield_load, plastic_compliance, lag = law
    if depth <= 0:
        return 0.0, 0.0
    force = stiffness * depth**exponent
    if plastic_compliance == 0.0 or force <= yield_load:
        return force, exponent * force / depth
    force = max(yield_load, 1e-12)
    yielding = (force / stiffness) ** (1 / exponent)
    share, offset = (1 - plastic_compliance * force / yielding, 0.0) if lag > 0 else (1.0, yield_load)
    for _ in range(MOST_ITERATIONS):
        elastic = share * (force / stiffness) ** (1 / exponent)
        slope = elastic / (exponent * force) + plastic_compliance
        change = (depth - elastic - plastic_compliance * (force - offset)) / slope
        force += change
        if change <= 1e-14 * force:
            break
    return force, 1 / slope


@njit(cache=True)
def indentation(force, law, exponent):
    """Plastic indentation [m] that a force [N] makes in the end."""
    stiffness, yield_load, plastic_compliance, lag = law
    if plastic_compliance == 0.0 or force <= yield_load:
        return 0.0
    if lag == 0.0:
        return plastic_compliance * (force - yield_load)
    return plastic_compliance * (force - yield_load * (force / max(yield_load, 1e-12)) ** (1 / exponent))


@njit(cache=True)
def contact_forces(s, height, law, exponent, out):
    """Force of each body (bodies,) into `out`, and the derivative of their sum to s."""
    slope = 0.0
    for b in range(len(height)):
        out[b], stiffening = contact_force(height[b] - s, law[b], exponent)
        slope -= stiffening
    return slope


@njit(cache=True)
def contact_energy(s, height, law, exponent):
    """Work that bringing the contacts to distance s takes [J]; of a plastic indentation, this is not given back. Where
    the indentation lags it is part of the height, and the energy is elastic."""
    energy = 0.0
    for b in range(len(height)):
        stiffness, yield_load, plastic_compliance, lag = law[b]
        now = plastic_compliance if lag == 0.0 else 0.0
        force, _ = contact_force(height[b] - s, (stiffness, yield_load, now, 0.0), exponent)
        if force > 0:
            energy += force * (force / stiffness) ** (1 / exponent) / (1 + 1 / exponent) / exponent
            energy += now * max(force**2 - yield_load**2, 0.0) / 2
    return energy


@njit(cache=True)
def contact_energies(s, height, law, exponent):
    """contact_energy at each of the distances s (m,) with height (bodies, m) and law (bodies, m, 4)."""
    out = np.empty(len(s))
    for i in range(len(s)):
        out[i] = contact_energy(s[i], height[:, i], law[:, i], exponent)
    return out


@njit(cache=True)
def first_dents(force, law, exponent, dent):
    """Dents that lag, (bodies, m + 1), at the start: as deep as the forces there (bodies,) press them in the end."""
    for b in range(len(force)):
        dent[b, 0] = indentation(force[b], law[b], exponent) if law[b, 3] > 0 else 0.0


@njit(cache=True)
def lagging(dent, height, law, step, top, here):
    """Heights (bodies,) into `top` and laws (bodies, 4) into `here` with which the middle of a step closes: of a dent
    that lags, what the step's own force adds to it is plastic compliance, the rest lowers the height."""
    for b in range(len(dent)):
        lag = law[b, 3]
        follows = step / (step + 2 * lag)
        top[b], here[b] = height[b] - (1 - follows) * dent[b], law[b]
        here[b, 2] *= follows  # 1 where nothing lags


@njit(cache=True)
def follow(dent, i, force, law, exponent, step):
    """Dents (bodies, m + 1) after step i, by the middle's force: the midpoint rule on dp/dt = (p(F) - p) / lag."""
    for b in range(len(force)):
        lag = law[b, 3]
        if lag > 0:
            behind = indentation(force[b], law[b], exponent) - dent[b, i]
            dent[b, i + 1] = dent[b, i] + 2 * behind * step / (step + 2 * lag)
