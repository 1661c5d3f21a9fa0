"""The wheel as contact meets it: its mesh moves along x, its material flows through the mesh as it turns."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass
class RollingWheel:
    """speed : of the mesh along x [m/s];  spin : of the material about the y axis through `axle` (reference
    coordinates) [rad/s];  inertia : about the axle, of all that turns with it [kg m2], None: the spin is held
    yaw : small angle by which the axle heads to +y: only the material's velocity knows of it [rad]

    offset : how far the mesh has moved [m];  towed : work of what keeps up speed, and a spin that is held;
    rotation : energy that a free rotation has gained since the start [J]
    """

    speed: float = 0.0
    spin: float = 0.0
    axle: tuple[float, float, float] = (0.0, 0.0, 0.0)
    inertia: float | None = None
    yaw: float = 0.0
    offset: float = 0.0
    towed: float = 0.0
    rotation: float = 0.0

    STATE = ("offset", "spin", "towed", "rotation")

    def kick(self, moment: float, force: float, dt: float) -> None:
        """Spin after a step, where it is free, from the moment about the axle [N m] and the force along x [N] of the
        contact.

        The step's forces went with the spin at its start; the work goes with the mean, so it is the change of the
        rotation's energy exactly.
        """
        before = self.spin
        if self.inertia is not None:
            self.spin += dt * moment / self.inertia
        work = dt * moment * 0.5 * (before + self.spin)
        self.towed += dt * self.speed * force
        if self.inertia is None:
            self.towed += work
        else:
            self.rotation += work

    def drift(self, dt: float) -> None:
        self.offset += dt * self.speed
