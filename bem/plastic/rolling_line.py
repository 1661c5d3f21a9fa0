"""A line contact that rolls over a half-space many times: plastic strain at every depth, pass by pass.

Under a contact that passes from far to far nothing depends on the position along the track but through time. Residual
stresses then act along x and y only (equilibrium), and residual strains along x and y vanish (compatibility), so each
depth is a point led by
    sigma_zz, sigma_xz: those of the elastic field;   eps_xx, eps_yy: those of the elastic field (eps_yy = 0),
exact for a load on an elastic half-space whose pressure the flow does not change, up to that the elastic field
redistributes with the flow of other depths during a pass (Merwin & Johnson's approximation: shakedown limits are exact,
the rate of ratchetting is not).

Source: Merwin & Johnson, Proc. Inst. Mech. Eng. 177 (1963) 676, as in Johnson, Contact Mechanics (1985), section 9.2.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bem.cycle_jumps import LEAST_FLOW, NO_JUMPS, VERDICTS, CycleHistory, JumpRule, run_cycles, verdict, verdict_words
from bem.exact.subsurface import line_stress
from bem.steel.cyclic_law import CyclicLaw, equivalent
from bem.steel.paths import PointState, at_rest, march

GIVEN = np.array([False, False, True, False, True, False])  # zz and xz as stresses; xx, yy, yz, xy as strains
REACH = 6.0  # half-widths before and behind the contact where a pass begins and ends


class NoEquilibriumError(ValueError):
    """The load is beyond what the steel carries."""


@dataclass(frozen=True)
class RollingHistory:
    """depth : (d,) [m];  plastic_strain : (passes, d) cumulated;  shear : (passes, d) residual shear strain gamma_xz,
    the surface's forward flow;  residual_xx, residual_yy : (passes, d) residual stresses [Pa], each after a pass

    With jumps: plastic_strain_error, shear_error : (passes, d) estimates, 0 without;  computed : (d,) passes computed,
    also those behind jumps that were taken back;  jumps : (d,) how many;  in a jump all are what extrapolated them.
    """

    depth: np.ndarray
    plastic_strain: np.ndarray
    shear: np.ndarray
    residual_xx: np.ndarray
    residual_yy: np.ndarray
    plastic_strain_error: np.ndarray
    shear_error: np.ndarray
    computed: np.ndarray
    jumps: np.ndarray

    @property
    def worst(self) -> int:
        """Number of the depth whose plastic strain grows most in the last pass; at rest, is largest."""
        added = np.diff(self.plastic_strain, axis=0, prepend=0.0)[-1]
        return int(np.argmax(added if added.max() > 0 else self.plastic_strain[-1]))

    def exponent(self) -> float:
        """e of a growth per pass that goes with the number of passes to the power of e, over the second half of the
        passes at the worst depth: 0 is a constant rate, below -1 all that is to come is finite; NaN at rest."""
        growth = np.diff(self.plastic_strain[:, self.worst], prepend=0.0)
        last, half = growth[-1], growth[len(growth) // 2 - 1]
        if len(growth) < 4 or min(last, half) <= 0:
            return float("nan")
        return float(np.log(last / half) / np.log(len(growth) / (len(growth) // 2)))

    def verdict(self, tolerance: float = LEAST_FLOW) -> str:
        """Of the depth that fares worst, see bem.cycle_jumps.verdict."""
        each = [verdict(*own, tolerance) for own in self._cycles()]
        return max(each, key=VERDICTS.index)

    def verdict_words(self) -> str:
        """The same with the growth on which it stands, that of the depth where most stays."""
        own, named = self._cycles(), self.verdict()
        return verdict_words(*max((c for c in own if verdict(*c) == named), key=lambda c: (c[1][-1], c[0][-1])))

    def _cycles(self) -> list[tuple[np.ndarray, np.ndarray]]:
        """Of each depth: growth of the equivalent plastic strain in each pass and what of it stays, (passes,) both."""
        flow = np.diff(self.plastic_strain, axis=0, prepend=0.0)
        stays = np.abs(np.diff(self.shear, axis=0, prepend=0.0)) / np.sqrt(3)
        return list(zip(flow.T, stays.T, strict=True))


def rolling_line_contact(
    law: CyclicLaw,
    half_width: float,
    max_pressure: float,
    traction_ratio: float,
    depth: np.ndarray,
    passes: int,
    steps: int = 400,
    jumps: JumpRule = NO_JUMPS,
) -> RollingHistory:
    """An elliptic line load that rolls over a half-space many times: plastic strain at each depth, pass by pass.

    Parameters
    ----------
    law : CyclicLaw
        Of the steel, `cyclic_law`.
    half_width, max_pressure : float
        Of the load [m, Pa].
    traction_ratio : float
        Of the traction along +x to the pressure.
    depth : (d,) array
        [m].
    passes : int
        How many.
    steps : int
        Of a pass over 2 REACH half-widths, finer beneath; the cost is some microseconds each, a depth and a pass.
    jumps : JumpRule
        By which passes are jumped over, at each depth by itself; all are computed by default.

    Returns
    -------
    RollingHistory

    Raises
    ------
    ValueError, NoEquilibriumError
        For bad numbers; where a point would have to carry more shear than it can.

    Examples
    --------
    >>> law = bem.cyclic_law(bem.STEEL.young, bem.STEEL.poisson, 300e6)
    >>> rolled = bem.rolling_line_contact(law, 1e-3, 500e6, 0.0, [0.78e-3], passes=2, steps=100)
    >>> bool(rolled.plastic_strain.any())  # below 1.79 times the yield stress: elastic
    False
    """
    depth = np.atleast_1d(np.asarray(depth, float))
    if not (half_width > 0 and np.isfinite(max_pressure) and max_pressure >= 0 and np.isfinite(traction_ratio)):
        raise ValueError(
            f"half-width {half_width!r} m, pressure {max_pressure!r} Pa, traction ratio {traction_ratio!r}: give finite"
            " numbers, the first above 0, the second not below"
        )
    if not (float(passes).is_integer() and passes >= 1 and float(steps).is_integer() and steps >= 20):
        raise ValueError(f"{passes} passes of {steps} steps: give whole numbers, at least 1 and 20")
    if depth.ndim > 1 or not depth.size or not (np.isfinite(depth) & (depth >= 0)).all():
        raise ValueError(f"depth = {depth} m: give one or more (d,), finite, >= 0")
    x = half_width * REACH * np.sinh(2 * np.linspace(1, -1, steps)) / np.sinh(2)  # from ahead of the point to behind it
    young = 9 * law.bulk * law.shear / (3 * law.bulk + law.shear)
    poisson = young / (2 * law.shear) - 1
    out, made = np.empty((6, passes, depth.size)), np.empty((2, depth.size), int)
    for d, z in enumerate(depth):
        xx, zz, xz = line_stress(x, np.full(steps, z), half_width, max_pressure, traction_ratio * max_pressure)
        path = np.zeros((steps + 1, 6))  # and back to no load
        path[:-1, 0] = ((1 - poisson**2) * xx - poisson * (1 + poisson) * zz) / young
        path[:-1, 2], path[:-1, 4] = zz, xz
        found = _Depth(law, z, path).run(passes, jumps)
        after, error = found.after_each()
        out[:4, :, d], out[4:, :, d] = after[:, :, 0].T, error.T
        made[:, d] = found.computed, len(found.jumps)
    return RollingHistory(depth, *out, *made)


class _Depth:
    """A point under the passes: its state as one vector, strains (they drift), then stresses (they settle)."""

    def __init__(self, law: CyclicLaw, depth: float, path: np.ndarray) -> None:
        self.law, self.depth, self.path = law, depth, path
        self._record = np.empty((len(path), 13))

    def run(self, passes: int, rule: JumpRule) -> CycleHistory:
        start = _vector(at_rest(self.law))
        return run_cycles(self.one_pass, start, passes, _measures, 7, rule, 2, self.admit, NoEquilibriumError)

    def one_pass(self, vector: np.ndarray, number: int) -> np.ndarray:
        state, path = _state(vector), self.path
        made = march(self.law, GIVEN, path, state, self._record)
        if made < len(path):
            raise NoEquilibriumError(
                f"depth {self.depth * 1e3:.3g} mm, pass {number}: no equilibrium at sigma_zz "
                f"{path[made, 2] * 1e-6:.0f}, sigma_xz {path[made, 4] * 1e-6:.0f} MPa: more than the steel carries in "
                "shear"
            )
        return _vector(state)

    def admit(self, vector: np.ndarray) -> np.ndarray:
        """Back stresses onto their bounds, the stress onto the yield surface by the law's own return at no load."""
        state = _state(vector)
        for back, modulus, recovery in zip(state.back, self.law.modulus, self.law.recovery, strict=True):
            size = equivalent(back)
            if recovery * size > modulus:
                back *= modulus / (recovery * size)
        if march(self.law, GIVEN, np.zeros((1, 6)), state, self._record) < 1:
            raise NoEquilibriumError(f"depth {self.depth * 1e3:.3g} mm: no equilibrium without a load")
        return _vector(state)


def _measures(vector: np.ndarray) -> np.ndarray:
    """(4, 1): plastic strain, shear strain, by which jumps are judged; residual stresses xx and yy [Pa]."""
    return np.array([[vector[0]], [2 * vector[5]], [vector[7]], [vector[8]]])


def _vector(state: PointState) -> np.ndarray:
    return np.concatenate([state.plastic_strain, state.strain, state.stress, state.back.ravel()])


def _state(vector: np.ndarray) -> PointState:
    new = vector.copy()
    return PointState(new[1:7], new[7:13], new[13:].reshape(-1, 6), new[:1])
