"""Friction that falls or rises with slip, and follows it over a length.

    mu(s) = mu_k + (mu_s - mu_k) exp(-s / s0)                    steady friction at a slip s per metre rolled
    d mu / dx = -max(s, s0) / l (mu - mu(s))                     friction of a point that rolls on by x, mu_s at first

At a speed v, s0 is the decay speed over v; l is the memory, a length that is slid. In a cell that slides the traction
follows its own slip, s = L (|q'| - mu p) / h: q' the traction that it would reach without a bound, L / h its
flexibility over the length h marched.
Without memory friction that falls has no limit under finer cells: once mu falls by s faster than the surface springs
back a point can stick as well as slide, and the length of the cells decides which. From l = (1 + e^-2) L p (mu_s -
mu_k) on, of the order of the surface's elastic displacement (10 to 50 um under wheels), there is one slip everywhere:
then 1 + L p d[max(s, s0) (mu(s) - mu)]/ds / l > 0 for every mu. That least memory of a patch is taken where none longer
is given: the law nearest to steady friction that has a limit.
Error of the force without spin at 44 cells: 0.1 %, second order; where friction rises at once, 0.4 %, first order;
spin leaves what it leaves under constant friction (tests/bem/test_slip_dependent_friction.py).
Source of the steady law: Polach, Wear 258 (2005) 992, with A = mu_k / mu_s and B = 1 / decay speed; of several
solutions and of friction with a memory: Vollebregt and Schuttelaars, J. Sound Vib. 331 (2012) 2141 (both recalled, not
opened).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bem.patch import ContactInputError
from kernel_cache import njit

ROUNDS = 100
CLOSE = 1e-14  # of the traction without a bound: what may be left of the equation of a slip
LEAST = 1 + np.exp(-2)  # memory over L p (mu_s - mu_k) from which there is one slip: largest of 1 - e^-r + r e^-r


@dataclass(frozen=True)
class SlipDependentFriction:
    """static : coefficient without slip;  kinetic : at large slip, below or above `static`;  decay : slip per metre
    rolled over which the difference falls to 1/e [1];  memory : length slid over which friction follows its slip [m],
    or the least that the patch needs, where that is longer."""

    static: float
    kinetic: float
    decay: float
    memory: float = 0.0

    def __post_init__(self) -> None:
        finite = np.isfinite([self.static, self.kinetic]).all()
        if not (finite and self.kinetic >= 0 and (self.static > 0 or self.static == self.kinetic)):
            raise ContactInputError(
                f"friction: static {self.static!r} and kinetic {self.kinetic!r}: give finite numbers of 0 or more, and"
                " a static one above 0 for a kinetic one that is"
            )
        if not self.decay > 0:
            raise ContactInputError(f"friction: decay {self.decay!r} slip per metre: give a number above 0")
        if not 0 <= self.memory < np.inf:
            raise ContactInputError(f"friction: memory {self.memory!r} m: give a finite length of 0 or more")

    @classmethod
    def at_speed(cls, static: float, kinetic: float, decay_speed: float, speed: float) -> SlipDependentFriction:
        """decay_speed : slip velocity over which the difference falls to 1/e [m/s];  speed : of rolling [m/s]."""
        return cls(static, kinetic, decay_speed / abs(speed))

    @property
    def ratio(self) -> float:
        """kinetic over static coefficient."""
        return self.kinetic / self.static if self.static > 0 else 1.0

    def at(self, slip: np.ndarray) -> np.ndarray:
        """Steady coefficient at slips per metre rolled."""
        return self.kinetic + (self.static - self.kinetic) * np.exp(-np.asarray(slip) / self.decay)

    @property
    def law(self) -> tuple[float, float, float]:
        """ratio, decay and memory, for the kernels."""
        return self.ratio, self.decay, self.memory


@njit(cache=True)
def share_after(slip, share, length, law):
    """Friction over that without slip once `length` [m] was rolled at a slip, from a share before; law : ratio, decay,
    memory."""
    ratio, decay, memory = law
    steady = ratio + (1.0 - ratio) * np.exp(-slip / decay)
    return steady + (share - steady) * np.exp(-max(slip, decay) * length / memory) if memory > 0 else steady


@njit(cache=True)
def sliding_share(slid, bound, flexibility, share, length, law):
    """The same of a cell that slides, whose traction would be `slid` [Pa], where `bound` [Pa] holds it without slip;
    flexibility : L [m/Pa]. By Illinois: at the ends of the bracket the cell sticks, or carries nothing."""
    if law[0] == 1.0 or law[1] == np.inf:
        return 1.0
    compliance = flexibility / length
    low, high, side, after = 0.0, compliance * slid, 0, share
    under, over = compliance * (share_after(0.0, share, length, law) * bound - slid), compliance * bound
    for _ in range(ROUNDS):
        slip = (low * over - high * under) / (over - under)
        after = share_after(slip, share, length, law)
        miss = slip - compliance * (slid - after * bound)
        if abs(miss) <= CLOSE * compliance * slid:
            break
        if miss < 0:
            under, over, low, side = miss, (0.5 * over if side < 0 else over), slip, -1
        else:
            over, under, high, side = miss, (0.5 * under if side > 0 else under), slip, 1
    return after
