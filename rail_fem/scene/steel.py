"""Steel as the solvers see it, and the grades of the reference cases."""

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from bem.material import Elastic, MaterialError, first_loading, refuse_yield_curve
from bem.steel.cyclic_law import CyclicLaw, cyclic_law

# plastic strains at which the curve of a cyclic law is tabulated
MONOTONIC = np.concatenate([[0.0], np.geomspace(1e-6, 2.0, 150)])


@dataclass(frozen=True, eq=False)
class Steel:
    """Isotropic elastic steel with an optional tabulated hardening curve.

    youngs_modulus   [Pa]
    poisson          [1]
    density          [kg/m^3]
    hardening_strain : (k,) equivalent plastic strain, from 0, strictly increasing   [1]
    hardening_stress : (k,) true yield stress, positive, never falling               [Pa]
    hardening        : "isotropic", the yield surface grows along the curve; "kinematic", it moves along it (Prager)
    cyclic           : law with back stresses in place of the curve, for those who can take it (`cyclic_steel`); the
        curve is then its first loading

    An empty curve means elastic. Errors: ValueError when a value cannot be a steel's.
    """

    youngs_modulus: float
    poisson: float
    density: float
    hardening_strain: np.ndarray = field(default_factory=lambda: np.empty(0))
    hardening_stress: np.ndarray = field(default_factory=lambda: np.empty(0))
    hardening: str = "isotropic"
    cyclic: CyclicLaw | None = None

    def __post_init__(self):
        for name in ("hardening_strain", "hardening_stress"):
            curve = np.array(getattr(self, name), dtype=float)
            curve.flags.writeable = False
            object.__setattr__(self, name, curve)
        self._check_curve()

    def _check_curve(self) -> None:
        if self.hardening_strain.shape == self.hardening_stress.shape == (0,):
            return
        try:
            refuse_yield_curve(self.hardening_strain, self.hardening_stress)
        except MaterialError as error:
            raise ValueError(f"steel: hardening_strain and hardening_stress: {error}") from None

    @property
    def is_elastic(self) -> bool:
        """It never yields."""
        return self.hardening_strain.size == 0

    @property
    def elastic(self) -> Elastic:
        """Its elastic constants."""
        return Elastic(self.youngs_modulus, self.poisson)

    @property
    def wave_speed(self) -> float:
        """Speed of the dilatational wave, sqrt((K + 4/3 G) / rho) [m/s]."""
        return float(np.sqrt((self.elastic.bulk + 4 / 3 * self.elastic.shear) / self.density))

    def yield_stress(self, plastic_strain: np.ndarray) -> np.ndarray:
        """Yield stress [Pa] at the equivalent plastic strain, linear between the points, constant behind the last; inf
        when elastic."""
        if self.is_elastic:
            return np.full(np.shape(plastic_strain), np.inf)
        return np.interp(plastic_strain, self.hardening_strain, self.hardening_stress)

    def scaled(self, factor: float) -> "Steel":
        """The same steel with all stresses of its curve, or of its cyclic law, times `factor` (400 % of Mn13 yields at
        4 * 310 MPa)."""
        law = self.cyclic
        if law is not None:
            stresses = {name: factor * getattr(law, name) for name in ("yield_stress", "hardening", "modulus")}
            law = law._replace(**stresses)
        return replace(self, hardening_stress=factor * self.hardening_stress, cyclic=law)


def cyclic_steel(youngs_modulus: float, poisson: float, density: float, **constants: Any) -> Steel:
    """A steel by its law over cycles; constants : those of bem.steel.cyclic_law.cyclic_law, which the elements follow.

    Errors: ValueError that names the constant; for a law whose first loading softens.
    """
    law = cyclic_law(youngs_modulus, poisson, **constants)
    curve = first_loading(law, MONOTONIC)
    rising = np.maximum.accumulate(curve)  # a saturated curve falls by round-off
    curve = rising if np.allclose(rising, curve, rtol=1e-9) else curve
    return Steel(youngs_modulus, poisson, density, MONOTONIC, curve, cyclic=law)


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


def from_tensile_test(proof: float, strength: float, uniform: float, density: float = 7850.0) -> Steel:
    """A steel of E = 210 GPa from proof stress, tensile strength [Pa] and uniform elongation [1] of a tensile test.

    True stress over plastic strain as Ludwik's curve through the proof stress at 0.2 % and, at the uniform elongation,
    through the tensile strength, both as true values; behind it straight on to 50 % with Considere's slope there, which
    is the true stress itself.
    """
    end, last = np.log(1 + uniform), strength * (1 + uniform)
    exponent = 0.35  # of pearlitic rail steels: steep at first
    first = (proof - last * (0.002 / end) ** exponent) / (1 - (0.002 / end) ** exponent)
    strain = np.concatenate([[0.0], np.geomspace(0.0005, end, 9), [0.2, 0.5]])
    rising = lambda e: first + (last - first) * (np.minimum(e, end) / end) ** exponent
    return Steel(210e9, 0.3, density, strain, rising(strain) + last * np.maximum(strain - end, 0.0))


def prestrained(steel: Steel, strain: float) -> Steel:
    """The same steel after a monotonic plastic strain: its curve begins there."""
    keep = steel.hardening_strain > strain
    beyond = np.r_[0.0, steel.hardening_strain[keep] - strain]
    stress = np.r_[steel.yield_stress(np.array(strain)), steel.hardening_stress[keep]]
    return replace(steel, hardening_strain=beyond, hardening_stress=stress, cyclic=None)


# Mn13 with its running surface hardened by explosives: some 200 HB as cast become 400 HB at the surface and more than
# as cast to 30 mm depth (a hardener's own figures: multiclad.com.br, "endurecimento nucleo ferroviario", read; 320 to
# 370 HB from memory, not verified). The flow stress behind 350 HB by Tabor's rule, hardness = 3 times the flow stress
# after a further strain of 8 %, is that of as-cast Mn13 strained by 20 %; as cast the rule gives 196 HB. Here it is the
# same all through: no depth profile.
MN13_HARDENED = prestrained(MN13, 0.20)

# Rail steels. Hardness 260 to 300 and 350 to 390 HBW for R260 and R350HT: EN 13674-1 as quoted by tkgftgleistechnik.de
# (read). Least tensile strengths 880, 1175, 1280 MPa: EN 13674-1, from memory, not verified; so are the proof stresses,
# the uniform elongations and everything of the bainitic steel (of the class of 1400 MPa). Scatter some 8 %. Where a
# mill's own test is at hand, give hardening_strain and hardening_stress.
R260 = from_tensile_test(480e6, 880e6, 0.09)
R350HT = from_tensile_test(780e6, 1175e6, 0.08)
R400HT = from_tensile_test(880e6, 1280e6, 0.07)
BAINITIC = from_tensile_test(1000e6, 1400e6, 0.06)

GRADES = {
    "Mn13": MN13,
    "Mn13-hardened": MN13_HARDENED,
    "R260": R260,
    "R350HT": R350HT,
    "R400HT": R400HT,
    "bainitic": BAINITIC,
    "R8T": R8T,
}
FROM_MEMORY = ("Mn13-hardened", "R260", "R350HT", "R400HT", "bainitic")  # curves of which a part was not verified
