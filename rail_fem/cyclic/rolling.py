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

from bem.exact.subsurface import line_stress
from rail_fem.cyclic.law import CyclicLaw
from rail_fem.cyclic.paths import at_rest, march

GIVEN = np.array([False, False, True, False, True, False])  # zz and xz as stresses; xx, yy, yz, xy as strains
REACH = 6.0  # half-widths before and behind the contact where a pass begins and ends
VERDICTS = ("elastic", "elastic shakedown", "plastic shakedown", "ratchetting")


class NoEquilibriumError(ValueError):
    """The load is beyond what the steel carries."""


@dataclass(frozen=True)
class RollingHistory:
    """depth : (d,) [m];  plastic_strain : (passes, d) cumulated;  shear : (passes, d) residual shear strain gamma_xz,
    the surface's forward flow;  residual_xx, residual_yy : (passes, d) residual stresses [Pa], each after a pass"""

    depth: np.ndarray
    plastic_strain: np.ndarray
    shear: np.ndarray
    residual_xx: np.ndarray
    residual_yy: np.ndarray

    def verdict(self, tolerance: float = 1e-7) -> str:
        """Of the depth that fares worst, by its last pass: does plastic strain still grow by more than `tolerance`, and
        does it run away in one direction (ratchetting) or close on itself (plastic shakedown)?"""
        if self.plastic_strain[-1].max() <= tolerance:
            return VERDICTS[0]
        before = self.plastic_strain[-2] if len(self.plastic_strain) > 1 else np.zeros_like(self.depth)
        sheared = self.shear[-2] if len(self.shear) > 1 else np.zeros_like(self.depth)
        flow = self.plastic_strain[-1] - before
        worst = int(np.argmax(flow))
        if flow[worst] <= tolerance:
            return VERDICTS[1]
        run_away = abs(self.shear[-1, worst] - sheared[worst]) / np.sqrt(3)
        return VERDICTS[3] if run_away > 0.01 * flow[worst] else VERDICTS[2]


def rolling_line_contact(
    law: CyclicLaw,
    half_width: float,
    max_pressure: float,
    traction_ratio: float,
    depth: np.ndarray,
    passes: int,
    steps: int = 400,
) -> RollingHistory:
    """`passes` of an elliptic line load with tractions traction_ratio times the pressure along +x over each depth.

    half_width [m], max_pressure [Pa];  depth : (d,) [m];  steps : of a pass over 2 REACH half-widths, finer beneath
    Errors: ValueError for bad numbers, NoEquilibriumError where a point would have to carry more shear than it can.
    Cost: proportional to passes, depths and steps (some microseconds each).
    """
    depth = np.atleast_1d(np.asarray(depth, float))
    if not (half_width > 0 and np.isfinite(max_pressure) and max_pressure >= 0 and np.isfinite(traction_ratio)):
        raise ValueError(
            f"half-width {half_width!r} m, pressure {max_pressure!r} Pa, traction ratio {traction_ratio!r}"
        )
    if passes < 1 or steps < 20 or (depth < 0).any():
        raise ValueError(f"{passes} passes of {steps} steps, least depth {depth.min():g} m: at least 1, 20 and 0")
    x = half_width * REACH * np.sinh(2 * np.linspace(1, -1, steps)) / np.sinh(2)  # from ahead of the point to behind it
    young = 9 * law.bulk * law.shear / (3 * law.bulk + law.shear)
    poisson = young / (2 * law.shear) - 1
    out = np.empty((4, passes, depth.size))
    for d, z in enumerate(depth):
        xx, zz, xz = line_stress(x, np.full(steps, z), half_width, max_pressure, traction_ratio * max_pressure)
        path = np.zeros((steps + 1, 6))  # and back to no load
        path[:-1, 0] = ((1 - poisson**2) * xx - poisson * (1 + poisson) * zz) / young
        path[:-1, 2], path[:-1, 4] = zz, xz
        state, record = at_rest(law), np.empty((steps + 1, 13))
        for n in range(passes):
            made = march(law, GIVEN, path, state, record)
            if made <= steps:
                raise NoEquilibriumError(
                    f"depth {z * 1e3:.3g} mm, pass {n + 1}: no equilibrium at sigma_zz {path[made, 2] * 1e-6:.0f}, "
                    f"sigma_xz {path[made, 4] * 1e-6:.0f} MPa: more than the steel carries in shear"
                )
            out[:, n, d] = state.plastic_strain[0], 2 * state.strain[4], state.stress[0], state.stress[1]
    return RollingHistory(depth, *out)
