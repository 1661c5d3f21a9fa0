"""Steel as the solvers see it, and the grades of the reference cases."""

from dataclasses import dataclass, field

import numpy as np


@dataclass(frozen=True, eq=False)
class Steel:
    """Isotropic elastic steel with an optional tabulated hardening curve.

    youngs_modulus   [Pa]
    poisson          [1]
    density          [kg/m^3]
    hardening_strain : (k,) equivalent plastic strain, from 0, strictly increasing   [1]
    hardening_stress : (k,) true yield stress, positive, never falling               [Pa]
    hardening        : "isotropic", the yield surface grows along the curve; "kinematic", it moves along it (Prager)

    An empty curve means elastic. Errors: ValueError when a value cannot be a steel's.
    """

    youngs_modulus: float
    poisson: float
    density: float
    hardening_strain: np.ndarray = field(default_factory=lambda: np.empty(0))
    hardening_stress: np.ndarray = field(default_factory=lambda: np.empty(0))
    hardening: str = "isotropic"

    def __post_init__(self):
        for name in ("hardening_strain", "hardening_stress"):
            curve = np.array(getattr(self, name), dtype=float)
            curve.flags.writeable = False
            object.__setattr__(self, name, curve)
        self._check_elasticity()
        self._check_curve()

    def _check_elasticity(self) -> None:
        for name in ("youngs_modulus", "density"):
            value = getattr(self, name)
            if not (np.isfinite(value) and value > 0):
                raise ValueError(f"steel: {name} is {value!r}, must be positive and finite")
        if not -1 < self.poisson < 0.5:
            raise ValueError(f"steel: poisson is {self.poisson!r}, must be between -1 and 0.5")

    def _check_curve(self) -> None:
        strain, stress = self.hardening_strain, self.hardening_stress
        if self.hardening not in ("isotropic", "kinematic"):
            raise ValueError(f"steel: hardening is {self.hardening!r}, must be 'isotropic' or 'kinematic'")
        if strain.ndim != 1 or strain.shape != stress.shape:
            raise ValueError(
                f"steel: hardening_strain has shape {strain.shape}, hardening_stress {stress.shape}: give two lists of"
                " equal length"
            )
        if strain.size == 0:
            return
        if not (np.isfinite(strain).all() and np.isfinite(stress).all()):
            raise ValueError("steel: the hardening curve holds a value that is not finite")
        if strain[0] != 0 or (np.diff(strain) <= 0).any():
            raise ValueError("steel: hardening_strain must start at 0 and increase strictly")
        if stress[0] <= 0 or (np.diff(stress) < 0).any():
            raise ValueError(
                "steel: hardening_stress must be positive and must not fall (softening has no mesh-independent answer)"
            )

    @property
    def is_elastic(self) -> bool:
        return self.hardening_strain.size == 0

    @property
    def shear_modulus(self) -> float:
        return self.youngs_modulus / (2 * (1 + self.poisson))

    @property
    def bulk_modulus(self) -> float:
        return self.youngs_modulus / (3 * (1 - 2 * self.poisson))

    @property
    def wave_speed(self) -> float:
        """Speed of the dilatational wave, sqrt((K + 4/3 G) / rho) [m/s]."""
        return float(np.sqrt((self.bulk_modulus + 4 / 3 * self.shear_modulus) / self.density))

    def yield_stress(self, plastic_strain: np.ndarray) -> np.ndarray:
        """Yield stress [Pa] at the equivalent plastic strain, linear between the points, constant behind the last; inf
        when elastic."""
        if self.is_elastic:
            return np.full(np.shape(plastic_strain), np.inf)
        return np.interp(plastic_strain, self.hardening_strain, self.hardening_stress)

    def scaled(self, factor: float) -> "Steel":
        """The same steel with all stresses of its curve times `factor` (400 % of Mn13 yields at 4 * 310 MPa)."""
        return Steel(
            self.youngs_modulus,
            self.poisson,
            self.density,
            self.hardening_strain,
            factor * self.hardening_stress,
            self.hardening,
        )


# Cast austenitic manganese steel, 11 to 14 % Mn. Elasticity, density and first yield: Coleman's thesis, table 7-3.
# True stress over plastic strain: a typical monotonic curve of as-cast Hadfield steel anchored at that yield; castings
# scatter by 15 %.
MN13 = Steel(
    190.772e9,
    0.3,
    7433.0,
    np.array([0, 0.002, 0.005, 0.01, 0.02, 0.05, 0.10, 0.15, 0.20, 0.30, 0.40, 0.50]),
    1e6 * np.array([310, 345, 370, 400, 445, 550, 700, 835, 960, 1185, 1380, 1550]),
)

# Wheel steel R8T of UIC 812-3, elastic. Coleman's thesis, table 7-3.
R8T = Steel(201.0e9, 0.3, 7833.0)

GRADES = {"Mn13": MN13, "R8T": R8T}
