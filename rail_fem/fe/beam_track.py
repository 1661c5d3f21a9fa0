"""A crossing on bearers under the explicit model: rail and casting as the beam of rail_fem.passes.track_beam, which the
contact force loads and whose height under the wheel lifts and lowers the crossing's mesh.

The mesh rests on its rigid base in a frame that moves with the beam under the wheel. Its steel has the inertia of its
motion in that frame alone: that of the frame is the beam's, whose sections hold all of the casting, so that nothing is
weighed twice whatever is meshed, scaled or inside a travelling window. Left out is the momentum that the deforming
steel has in the frame, some tenths of a kilogram that move by the approach. As the Lagrangian of beam and mesh has no
other coupling than the contact, the beam carries the contact force, and energies balance.

The force acts under the wheel's centre, a few millimetres from the patch: 10 mm along the beam move the reference
pass' force history by 0.06 %.

Beam and wheel march together: rates half a step behind, as those of the nodes. The height that contact looks ahead to
goes on as in the last step; what this step's force adds to it is (step)^2 times force over the beam's mass there, some
nanometres at most.
"""

from __future__ import annotations

import numpy as np

from rail_fem.fe.contact.contact import Contact
from rail_fem.fe.contact.pairs import CARRIED
from rail_fem.fe.dynamics_part import DynamicsPart
from rail_fem.passes.beam_kernel import band_times, leap
from rail_fem.passes.track_beam import BeamMotion


class BeamTrack(DynamicsPart):
    """The beam under a wheel that is at x [m] when it is let go, or `free` is set.

    contact : its frame of the rail is the beam's under the wheel

    Attributes: position, velocity (n,) of the beam's degrees of freedom, rates half a step behind;  height : under the
    wheel over the track without load [m];  work : of the contact force on the beam, towed : on the beam's slope as the
    wheel moves on, lost : in dampers [J];  all replicated
    """

    STATE = ("position", "velocity", "free", "step", "height", "work", "towed", "lost")
    SCRATCH = ("change",)

    def __init__(self, start: BeamMotion, x: float, contact: Contact):
        self.beam, self.start, self.contact, self.free = start.beam, start, contact, False
        self.position, self.velocity = start.position.copy(), start.velocity.copy()
        self.height = start.height(x)
        self.wheel = x - contact.wheel.offset  # where it is at no offset of the contact [m]
        self.work = self.towed = self.lost = 0.0
        self.change = np.empty(len(self.position))
        self.step = 0.0  # none yet [s]
        self.after_restore()

    def after_restore(self) -> None:
        """What follows from step and velocity. Replicated."""
        self.band = self.beam.band(self.step) if self.step else self.beam.band_of_shape
        self.damped = band_times(self.beam.damping, self.velocity)

    def let_go(self, speed: float) -> None:
        """From now on the beam moves. speed : of the wheel along x [m/s]"""
        self.free = True
        self.contact.search.rise = self.start.rise(self.wheel + self.contact.wheel.offset, speed)

    def drift(self, dt: float) -> None:
        """The beam under the contact force of the step, and the frame where the wheel is now."""
        if not self.free:
            return
        if dt != self.step:
            self.step = dt
            self.after_restore()
        contact = self.contact
        push, at = -contact.sums[CARRIED], self.wheel + contact.wheel.offset
        before = self.height
        work, lost, self.height = leap(
            *(self.position, self.velocity, self.damped, self.change),
            *(push, at - dt * contact.wheel.speed, at, dt, self.band),
        )
        moved = self.height - before
        contact.search.raised += moved
        contact.search.rise = moved / dt
        self.work += work
        self.towed += push * moved - work
        self.lost += lost

    def energies(self) -> dict[str, float]:
        """Half a step before the positions, where the scheme keeps them to round-off."""
        middle = self.position - 0.5 * self.step * self.velocity
        return {
            "lumped_kinetic": float(self.beam.energy(self.beam.mass, self.velocity[None])[0]),
            "springs": float(self.beam.energy(self.beam.stiffness, middle[None])[0]),
            "dampers": self.lost,
            "prescribed_motion": self.towed,
        }

    def shares(self) -> tuple[float, float]:
        return 0.0, self.work if self.contact.surfaces.comm.rank == 0 else 0.0
