"""Force and approach of a wheel on a body: a power law, Hertz' or another, and what the steel gives way for good.

An approach d takes the force F that solves d = e(F) + p(F): e = (F / stiffness)^(1 / exponent), and where it is
positive a plastic indentation p = plastic_compliance * (F - yield_load) - relief * e, at once, or after a time `lag`.
F only grows with d, and p / e with F.
"""

from dataclasses import dataclass, fields

import numpy as np

from kernel_cache import njit

MOST_ITERATIONS = 100


@dataclass(frozen=True)
class ContactLaw:
    """Contacts at the ends and middles of m steps; what is an array may also be one value for all.

    height : (bodies, 2 m + 1) axle height at which the wheel comes into contact [m]; -inf out of reach
    stiffness : (bodies, 2 m + 1) [N/m^exponent]
    exponent : (bodies, 2 m + 1) 1.5 (Hertz), 1 (linear)
    yield_load, plastic_compliance, relief : (bodies, 2 m + 1) of the plastic indentation [N, m/N, 1]
    lag : (bodies, 2 m + 1) time in which the indentation follows the force [s]; where it does not lag, relief is 0
    """

    height: np.ndarray
    stiffness: np.ndarray
    exponent: float | np.ndarray = 1.5
    yield_load: float | np.ndarray = 0.0
    plastic_compliance: float | np.ndarray = 0.0
    relief: float | np.ndarray = 0.0
    lag: float | np.ndarray = 0.0

    def beside(self, other: "ContactLaw") -> "ContactLaw":
        """Both laws' contacts, this one's first."""
        values = (
            [np.broadcast_to(getattr(law, f.name), law.height.shape) for law in (self, other)] for f in fields(self)
        )
        return ContactLaw(*map(np.concatenate, values))

    @property
    def arrays(self) -> tuple[np.ndarray, np.ndarray]:
        """What the kernels take: height, and the others as (bodies, 2 m + 1, 6), in their order above."""
        values = self.stiffness, self.exponent, self.yield_load, self.plastic_compliance, self.relief, self.lag
        return self.height, np.stack([np.broadcast_to(v, self.height.shape) for v in values], axis=-1)


@njit(cache=True)
def contact_force(depth, law):
    """Force [N] at an approach [m] and its derivative; law: as of ContactLaw.arrays.

    With an indentation by Newton's method, from below: as p / e grows with F, the elastic force at depth / (1 + p / e)
    with the p / e of the elastic force is less.
    """
    stiffness, exponent, yield_load, plastic_compliance, relief, _ = law
    if depth <= 0:
        return 0.0, 0.0
    force = stiffness * depth**exponent
    dent = indentation(force, law)
    if dent == 0.0:
        return force, exponent * force / depth
    force = stiffness * (depth / (1 + dent / depth)) ** exponent
    for _ in range(MOST_ITERATIONS):
        elastic = (1 - relief) * (force / stiffness) ** (1 / exponent)
        slope = elastic / (exponent * force) + plastic_compliance
        change = (depth - elastic - plastic_compliance * (force - yield_load)) / slope
        force += change
        if abs(change) <= 1e-14 * force:
            break
    return force, 1 / slope


@njit(cache=True)
def indentation(force, law):
    """Plastic indentation [m] that a force [N] makes in the end."""
    stiffness, exponent, yield_load, plastic_compliance, relief, _ = law
    if force <= 0.0:
        return 0.0
    return max(plastic_compliance * (force - yield_load) - relief * (force / stiffness) ** (1 / exponent), 0.0)


@njit(cache=True)
def contact_forces(s, height, law, out):
    """Force of each body (bodies,) into `out`, and the derivative of their sum to s."""
    slope = 0.0
    for b in range(len(height)):
        out[b], stiffening = contact_force(height[b] - s, law[b])
        slope -= stiffening
    return slope


@njit(cache=True)
def contact_energy(s, height, law):
    """Work that bringing the contacts to distance s takes [J]; of a plastic indentation, this is not given back. Where
    the indentation lags it is part of the height, and the energy is elastic."""
    energy = 0.0
    for b in range(len(height)):
        stiffness, exponent, yield_load, plastic_compliance, _, lag = law[b]
        now = plastic_compliance if lag == 0.0 else 0.0
        force, _ = contact_force(height[b] - s, (stiffness, exponent, yield_load, now, 0.0, 0.0))
        if force > 0:
            energy += force * (force / stiffness) ** (1 / exponent) / (1 + 1 / exponent) / exponent
            energy += now * max(force**2 - yield_load**2, 0.0) / 2
    return energy


@njit(cache=True)
def contact_energies(s, height, law):
    """contact_energy at each of the distances s (m,) with height (bodies, m) and law (bodies, m, 6)."""
    out = np.empty(len(s))
    for i in range(len(s)):
        out[i] = contact_energy(s[i], height[:, i], law[:, i])
    return out


@njit(cache=True)
def first_dents(force, law, dent):
    """Dents that lag, (bodies, m + 1), at the start: as deep as the forces there (bodies,) press them in the end."""
    for b in range(len(force)):
        dent[b, 0] = indentation(force[b], law[b]) if law[b, 5] > 0 else 0.0


@njit(cache=True)
def put(row, values):
    """`row[:] = values`, which brings numba's words on shapes that do not fit: three seconds to compile."""
    for i in range(len(row)):
        row[i] = values[i]


@njit(cache=True)
def lagging(dent, height, law, step, top, here):
    """Heights (bodies,) into `top` and laws (bodies, 6) into `here` with which the middle of a step closes: of a dent
    that lags, what the step's own force adds to it is its indentation, the rest lowers the height."""
    for b in range(len(dent)):
        lag = law[b, 5]
        follows = step / (step + 2 * lag)
        top[b] = height[b] - (1 - follows) * dent[b]
        put(here[b], law[b])
        here[b, 3] *= follows  # 1 where nothing lags
        here[b, 4] *= follows


@njit(cache=True)
def follow(dent, i, force, law, step):
    """Dents (bodies, m + 1) after step i, by the middle's force: the midpoint rule on dp/dt = (p(F) - p) / lag."""
    for b in range(len(force)):
        lag = law[b, 5]
        if lag > 0:
            behind = indentation(force[b], law[b]) - dent[b, i]
            dent[b, i + 1] = dent[b, i] + 2 * behind * step / (step + 2 * lag)
