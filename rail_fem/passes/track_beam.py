"""Rail and casting as a beam on bearers, by finite elements: what light models stand on where a scene names bearers.

Elements are exact in statics between their nodes (bearers, ends of the casting, and points between). The track that is
computed ends some way beyond the window; towards its ends the beam is damped more and more, so that waves that run out
do not come back. The beam's weight is in its position at rest.
"""

import functools
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.linalg import cho_solve_banded, cholesky_banded

from rail_fem.passes.beam_kernel import BeamBand, element_shape, heights_under, load_at
from rail_fem.scene.bearers import BeamSection, Bearers

FEWEST = 2  # bearers that hold a beam from turning
HALF_BAND = 4  # height, rotation, bearer, height, rotation
MERGED = 10e-3  # an end of the casting nearer to a bearer than this is moved there [m]
ABSORBED = 0.5  # outer share of the track beyond the window whose motion is damped
ABSORPTION = 3000.0  # damping over mass at the very end [1/s]
GAUSS = np.polynomial.legendre.leggauss(4)
DIFFERENCE = 1e-5  # of an element, for the slope of its shape


class Bearer(NamedTuple):
    """One bearer that is there: its number, x [m], degrees of freedom of rail and bearer, and its springs and dampers
    [N/m, N s/m]."""

    number: int
    x: float
    rail: int
    own: int
    pad: tuple[float, float]
    ballast: tuple[float, float]


class BeamMotion(NamedTuple):
    """A beam and its degrees of freedom and their rates (n,) at one time."""

    beam: "TrackBeam"
    position: np.ndarray
    velocity: np.ndarray

    def height(self, x: float) -> float:
        """Under x [m]."""
        return float(self.beam.force_at(x) @ self.position)

    def rise(self, x: float, speed: float) -> float:
        """Rate of the height under a wheel at x that moves along it [m/s]."""
        return float(self.beam.force_at(x) @ self.velocity + speed * self.beam.slope_at(x) @ self.position)


@dataclass(frozen=True, eq=False)
class TrackBeam:
    """A beam of k nodes on bearers, n degrees of freedom (all over its position at rest).

    x : (k,) nodes [m];  first : (k,) degree of freedom of each node's height;  shear : (k - 1,), as of BeamBand
    mass, damping, stiffness : (n, 5) symmetric bands;  sections : of each element;  bearers : that are there
    """

    x: np.ndarray
    first: np.ndarray
    shear: np.ndarray
    mass: np.ndarray
    damping: np.ndarray
    stiffness: np.ndarray
    sections: tuple[BeamSection, ...]
    bearers: tuple[Bearer, ...]

    def band(self, step: float) -> BeamBand:
        """What a march with steps of `step` [s] takes."""
        system = 2 / step * self.mass + self.damping + step / 2 * self.stiffness
        factor = np.ascontiguousarray(cholesky_banded(system.T, lower=True).T)
        factor[:, 0] = 1 / factor[:, 0]
        return BeamBand(self.mass, self.damping, self.stiffness, factor, self.x, self.first, self.shear)

    def static(self, load: np.ndarray) -> np.ndarray:
        """(n,) static deflection under forces and moments (n,)."""
        return cho_solve_banded((cholesky_banded(self.stiffness.T, lower=True), True), load)

    def under(self, load: float, x: float, speed: float) -> BeamMotion:
        """Static deflection under a force down [N] at x [m], in the motion that its travel along x [m/s] gives it."""
        return BeamMotion(self, self.static(-load * self.force_at(x)), self.static(-load * speed * self.slope_at(x)))

    def force_at(self, x: float) -> np.ndarray:
        """(n,) nodes' share of a force of 1 N up at x [m]."""
        return load_at(x, self.band_of_shape)

    def heights(self, position: np.ndarray, x: np.ndarray) -> np.ndarray:
        """(m,) height under x (m,) [m] for degrees of freedom (m, n)."""
        return heights_under(position, x, self.band_of_shape)

    @staticmethod
    def energy(band: np.ndarray, values: np.ndarray) -> np.ndarray:
        """(m,) half of values . band . values for (m, n): kinetic energy of velocities, elastic one of positions
        [J]."""
        total = np.einsum("mi,mi,i->m", values, values, band[:, 0]) / 2
        for d in range(1, band.shape[1]):
            total += np.einsum("mi,mi,i->m", values[:, d:], values[:, :-d], band[:-d, d])
        return total

    def slope_at(self, x: float) -> np.ndarray:
        """(n,) derivative of force_at to x [1/m]."""
        d = DIFFERENCE * float(np.min(np.diff(self.x)))
        return (self.force_at(x + d) - self.force_at(x - d)) / (2 * d)

    @functools.cached_property
    def band_of_shape(self) -> BeamBand:
        """A BeamBand without a factor, for shapes alone."""
        return BeamBand(self.mass, self.damping, self.stiffness, self.mass, self.x, self.first, self.shear)


@functools.lru_cache(maxsize=16)
def track_beam(bearers: Bearers, low: float, high: float, element: float, reach: float) -> TrackBeam:
    """The track from `reach` before `low` to `reach` behind `high` [m], elements at most `element` long [m]. Errors:
    ValueError where less than two bearers carry it."""
    numbers = np.arange(
        np.floor((low - reach - bearers.position) / bearers.spacing),
        np.ceil((high + reach - bearers.position) / bearers.spacing) + 1,
    ).astype(int)
    if (carry := sum(bearers.factors(int(number))[2] > 0 for number in numbers)) < FEWEST:
        raise ValueError(
            f"{carry} of {len(numbers)} bearers carry the track of scene.bearers from {low - reach:.1f} to"
            f" {high + reach:.1f} m, at least {FEWEST} must: leave them out of voided, missing and unlike_ballast = 0"
        )
    x, at_bearer = nodes(bearers, numbers, element)
    sections = tuple(bearers.section(float(middle)) for middle in (x[1:] + x[:-1]) / 2)
    there = [(n, k) for n, k in zip(numbers, at_bearer) if bearers.factors(int(n))[0] > 0]
    has_bearer = np.zeros(len(x), int)
    has_bearer[[k for _, k in there]] = 1
    first = np.r_[0, np.cumsum(2 + has_bearer)]
    size, first = int(first[-1]), first[:-1]
    mass, damping, stiffness = np.zeros((3, size, HALF_BAND + 1))
    shear = np.empty(len(sections))
    absorption = absorbing(x, low, high, reach)
    for i, section in enumerate(sections):
        length = float(x[i + 1] - x[i])
        shear[i] = 12 * section.bending_stiffness / (section.shear_stiffness * length**2)
        dofs = np.r_[first[i], first[i] + 1, first[i + 1], first[i + 1] + 1]
        own = element_mass(section, length, shear[i])
        _add(mass, dofs, own)
        _add(damping, dofs, absorption[i] * own)
        _add(stiffness, dofs, element_stiffness(section, length, shear[i]))
    found = []
    for number, k in there:
        pad, weight, ballast = bearers.factors(int(number))
        bearer = Bearer(
            int(number),
            float(x[k]),
            int(first[k]),
            int(first[k]) + 2,
            (pad * bearers.pad_stiffness, pad * bearers.pad_damping),
            (ballast * bearers.ballast_stiffness, ballast * bearers.ballast_damping),
        )
        mass[bearer.own, 0] += weight * bearers.mass
        for band, spring, ground in zip((stiffness, damping), bearer.pad, bearer.ballast):
            _add(band, np.array([bearer.rail, bearer.own]), spring * np.array([[1.0, -1.0], [-1.0, 1.0]]))
            band[bearer.own, 0] += ground
        found.append(bearer)
    return TrackBeam(x, first, shear, mass, damping, stiffness, sections, tuple(found))


def nodes(bearers: Bearers, numbers: np.ndarray, element: float) -> tuple[np.ndarray, np.ndarray]:
    """Nodes (k,) [m], growing, and which of them are those of the bearers `numbers` (b,)."""
    at = bearers.position + bearers.spacing * numbers
    casting = bearers.casting
    ends = np.array([] if casting is None else [casting.start, casting.end])
    ends = ends[(ends > at[0]) & (ends < at[-1])]
    ends = ends[[np.abs(at - end).min() > MERGED for end in ends]] if len(ends) else ends
    fixed = np.unique(np.r_[at, ends])
    parts = [np.linspace(a, b, int(np.ceil((b - a) / element - 1e-9)) + 1)[:-1] for a, b in zip(fixed[:-1], fixed[1:])]
    x = np.r_[np.concatenate(parts), fixed[-1]]
    return x, np.searchsorted(x, at - 1e-9)


def absorbing(x: np.ndarray, low: float, high: float, reach: float) -> np.ndarray:
    """(k - 1,)  damping over mass [1/s] of each element: 0 near the window, growing with the square towards the
    ends."""
    middle = (x[1:] + x[:-1]) / 2
    beyond = np.maximum(np.maximum(low - middle, middle - high), 0.0) / reach
    return ABSORPTION * np.clip((beyond - (1 - ABSORBED)) / ABSORBED, 0.0, None) ** 2


def element_stiffness(section: BeamSection, length: float, shear: float) -> np.ndarray:
    """(4, 4)  of an element: height and rotation at both ends [N/m, N, N m]."""
    half, near, far = 6 * length, (4 + shear) * length**2, (2 - shear) * length**2
    return (
        section.bending_stiffness
        / ((1 + shear) * length**3)
        * np.array([[12, half, -12, half], [half, near, -half, far], [-12, -half, 12, -half], [half, far, -half, near]])
    )


def element_mass(section: BeamSection, length: float, shear: float) -> np.ndarray:
    """(4, 4)  consistent mass of an element, with rotary inertia where there is shear; exact quadrature."""
    share, weight = (GAUSS[0] + 1) / 2, GAUSS[1] / 2 * length
    mass = np.zeros((4, 4))
    for t, w in zip(share, weight):
        height = element_shape(t, length, shear)
        turn = element_rotation(t, length, shear)
        mass += w * (section.mass * np.outer(height, height) + section.rotary_inertia * np.outer(turn, turn))
    return mass


def element_rotation(t: float, length: float, shear: float) -> np.ndarray:
    """(4,)  weights of an element's ends for the rotation of its section at the share t."""
    bow = 6 * t * (t - 1) / length
    near, far = 1 + shear - (4 + shear) * t + 3 * t**2, (shear - 2) * t + 3 * t**2
    return np.array([bow, near, -bow, far]) / (1 + shear)


def _add(band: np.ndarray, dofs: np.ndarray, values: np.ndarray) -> None:
    """Add a symmetric matrix (m, m) at degrees of freedom (m,), growing, to a band."""
    for i, row in enumerate(dofs):
        for j, column in enumerate(dofs[: i + 1]):
            band[column, row - column] += values[i, j]
