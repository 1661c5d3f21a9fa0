"""Friction that falls with slip: mu(s) = mu_k + (mu_s - mu_k) exp(-s / s0), s the slip per metre rolled.

At a speed v, s0 is the decay speed over v. In a cell that slides the traction follows its own slip,

    s = L (|q'| - mu(s) p) / h,

q' the traction that the cell would reach without a bound, L / h its flexibility over the length marched. Where friction
falls faster than the surface springs back there are several such s; the smallest is taken, which a cell that begins to
slide meets first. Substituted again and again from s = 0 the right-hand side climbs to it from below.
Source of the law: Polach, Wear 258 (2005) 992, with A = mu_k / mu_s and B = 1 / decay speed (recalled, not opened).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bem.patch import ContactInputError
from kernel_cache import njit

ROUNDS = 200
CLOSE = 1e-12  # relative, of a slip that counts as met


@dataclass(frozen=True)
class FallingFriction:
    """static : coefficient without slip;  kinetic : at large slip, at most `static`;  decay : slip per metre rolled
    over which the difference falls to 1/e [1]."""

    static: float
    kinetic: float
    decay: float

    def __post_init__(self) -> None:
        if not (np.isfinite([self.static, self.kinetic]).all() and 0 <= self.kinetic <= self.static):
            raise ContactInputError(
                f"friction: static {self.static!r} and kinetic {self.kinetic!r}: give finite numbers, 0 <= kinetic <="
                " static"
            )
        if not self.decay > 0:
            raise ContactInputError(f"friction: decay {self.decay!r} slip per metre: give a number above 0")

    @classmethod
    def constant(cls, friction: float) -> FallingFriction:
        """Coulomb's; any number, whose range the solver checks."""
        law = object.__new__(cls)
        for name, value in (("static", friction), ("kinetic", friction), ("decay", np.inf)):
            object.__setattr__(law, name, value)
        return law

    @classmethod
    def at_speed(cls, static: float, kinetic: float, decay_speed: float, speed: float) -> FallingFriction:
        """decay_speed : slip velocity over which the difference falls to 1/e [m/s];  speed : of rolling [m/s]."""
        return cls(static, kinetic, decay_speed / abs(speed))

    @property
    def ratio(self) -> float:
        """kinetic over static coefficient."""
        return self.kinetic / self.static if self.static > 0 else 1.0

    def at(self, slip: np.ndarray) -> np.ndarray:
        """Coefficient at slips per metre rolled."""
        return self.kinetic + (self.static - self.kinetic) * np.exp(-np.asarray(slip) / self.decay)


@njit(cache=True)
def friction_share(slid, bound, compliance, falling):
    """mu(s) over that without slip, for a cell whose traction would be `slid` [Pa] where `bound` [Pa] holds it without
    slip; compliance : L / h [1/Pa]; falling : ratio and decay of FallingFriction."""
    ratio, decay = falling
    if ratio == 1.0 or decay == np.inf:
        return 1.0
    share, slip = 1.0, 0.0
    for _ in range(ROUNDS):
        before = slip
        slip = compliance * (slid - share * bound)
        share = ratio + (1.0 - ratio) * np.exp(-slip / decay)
        if slip - before <= CLOSE * slip:
            break
    return share
