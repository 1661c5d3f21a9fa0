"""Rolling contact fatigue from a solved patch: T gamma and its damage function, surface fatigue index, shakedown map.

All are empirical or elastic criteria of plain line; on a crossing they say where to look, not when it cracks.
"""

from dataclasses import dataclass

import numpy as np

from bem.exact.subsurface import line_stress
from rail_fem.damage.wear import Patches, WearError
from rail_fem.settings.damage import DamageSettings

REGIONS = ("none", "fatigue", "mixed", "wear")


@dataclass(frozen=True)
class WholeLifeRail:
    """Damage by one axle against T gamma: 0 to `onset`, rising to `height` at `peak`, falling through 0 at `balance`,
    and on below 0, where wear takes cracks away. 1 is a visible crack.

    Corners [N]: 15, 65, 175 as published; the thesis prints 75 for the second (2.3.3). Height: 1e-5 per axle.
    Fitted to curves of plain line in grade 220 rail; not to manganese castings (thesis 4.6, item 4).
    Source: Burstow, Whole life rail model application and development, RSSB T115 (2003), not opened. 65 N, 175 N and
    the height as a public code has them (github.com/aliSaleh123/railway_project, crack_initiation/create_di_df.py:
    2.22e-7 T gamma - 4.44e-6 to 65 N, 1.59e-5 - 9.09e-8 T gamma to 175 N), which begins at 20 N; 15 N is recalled.
    """

    onset: float = 15.0
    peak: float = 65.0
    balance: float = 175.0
    height: float = 1e-5

    def damage(self, tgamma: np.ndarray) -> np.ndarray:
        """Damage per axle at T gamma [N]; below 0 where wear wins."""
        x = np.asarray(tgamma, float)
        rise = self.height * (x - self.onset) / (self.peak - self.onset)
        fall = self.height * (self.balance - x) / (self.balance - self.peak)
        return np.where(x <= self.onset, 0.0, np.minimum(rise, fall))

    def region(self, tgamma: float) -> str:
        """none, fatigue (rising), mixed (falling, above 0) or wear."""
        corners = np.array([self.onset, self.peak, self.balance])
        return REGIONS[int(np.searchsorted(corners, tgamma, side="left"))]


def fatigue_of(settings: DamageSettings) -> WholeLifeRail:
    """Its damage function."""
    return WholeLifeRail(settings.onset, settings.peak, settings.balance)


@dataclass(frozen=True)
class ShakedownPoint:
    """Where a patch lies on the shakedown map. load : largest pressure over shear yield stress p0/k;  traction :
    tangential over normal force;  index : surface fatigue index of Ekberg, traction - 2 pi a b k / (3 N)"""

    load: float
    traction: float
    index: float


def shakedown_point(patch: Patches, shear_yield: float) -> ShakedownPoint:
    """Point of a rolling patch, or points of a row, for a shear yield stress k [Pa] of the hardened surface.

    On a Hertz ellipse p0 = 3 N / (2 pi a b), so that the index is traction - k / p0: the map's right border
    p0/k = 1/mu.
    """
    normal = patch.normal_force
    if np.any(normal <= 0):
        raise WearError("a patch without force has no position on the shakedown map")
    force = patch.tangential_force
    traction = np.hypot(force[..., 0], force[..., 1]) / normal
    pressure = 1.5 * normal / patch.contact_area
    return ShakedownPoint(pressure / shear_yield, traction, traction - shear_yield / pressure)


def shakedown_limits(traction: np.ndarray, line: bool = False) -> np.ndarray:
    """p0/k at the limit of elastic shakedown over the traction coefficient.

    line : contact of a cylinder (plane strain), whose border is computed here from the elastic field of a half-space
    under p0 sqrt(1 - x^2) and mu times it: below the surface by Melan's theorem, where the largest orthogonal shear
    stress reaches k, at 4.0 without traction. Otherwise of a circular point contact: 4.7 without traction (recalled,
    not opened), falling as that of a line does. For both the surface limit 1 / mu.
    Source: Johnson, Contact Mechanics (1985), sections 4.1, 7.2 and 9.2.
    """
    mu = np.asarray(traction, float)
    with np.errstate(divide="ignore"):
        surface = 1 / mu
    sheared = np.reshape([_orthogonal_shear(float(m)) for m in np.ravel(mu)], mu.shape)
    below = 1 / sheared if line else 4.7 * _orthogonal_shear(0.0) / sheared
    return np.minimum(below, surface)


def _orthogonal_shear(mu: float) -> float:
    """Largest |tau_xz| below the surface over p0, of a sliding line contact.

    tau_xz changes its sign along x without traction; residual stresses cannot take its amplitude away, so that Melan's
    limit is its half range where the range is symmetric, and with traction the largest over depth of the mean-free part
    plus what the mean cannot be balanced: residual tau_xz must vanish in equilibrium, so that max |tau_xz| counts.
    """
    x, depth = np.meshgrid(np.linspace(-3, 3, 601), np.linspace(0.01, 2.5, 250), indexing="ij")
    return float(np.abs(line_stress(x, depth, 1.0, 1.0, mu)[2]).max())
