"""The histories of a pass: forces averaged over each interval, heights, position of contact, energies."""

from __future__ import annotations

import math

import numpy as np

from rail_fem.fe.node_kernels import add_motion, add_step
from rail_fem.fe.passage import Passage
from rail_fem.processes.launcher import on_root

FORCES = ("force", "force_wing", "force_nose", "force_longitudinal", "force_lateral")


class Recorder:
    """Call `after_step` each step and `row` when an interval is over. Rows are replicated, sums since the last one are
    those of the contact's owners; `row` is collective."""

    STATE = ("rows", "beam", "contact_work", "deforming", "overlap", "exchanged", "total", "moment", "steps")

    def __init__(self, passage: Passage):
        self.passage = passage
        self.rows: list[dict[str, float]] = []
        self.contact_work: list[float] = []  # on the bodies, at each row [J]
        self.deforming: list[float] = []  # kinetic energy of the meshes beyond rigid motion, at each row [J]
        self._beam: list[np.ndarray] = []
        self.exchanged = 0.0  # energy that came with other lumped masses and velocities where settling ended [J]
        self.overlap: list[list[float]] = []  # Contact.overlap at each row
        self._clear()

    @property
    def beam(self) -> np.ndarray:
        """(rows, 2, n) position and velocity of a beam on bearers at each row, joined when asked for."""
        n = 0 if self.passage.track is None else len(self.passage.track.position)
        return np.array(self._beam).reshape(len(self._beam), 2, n)

    @beam.setter
    def beam(self, rows: np.ndarray) -> None:
        self._beam = list(rows)

    def _clear(self) -> None:
        self.total, self.moment, self.steps = np.zeros(5), np.zeros(4), 0

    def after_step(self) -> None:
        """Add the contact forces of the step, on the ranks that compute them."""
        c = self.passage.dynamics.contact
        self.steps += 1
        if not c.is_owner:
            return
        add_step(
            c.force,
            c.normal_force,
            c.search.position,
            c.surfaces.area,
            c.watched,
            c.surfaces.n_rail,
            self.passage.rail_region,
            self.total,
            self.moment,
        )

    def row(self, energies: dict[str, float]) -> None:
        """Close an interval."""
        p, d = self.passage, self.passage.dynamics
        self.total, self.moment = on_root(lambda: (self.total, self.moment), d.comm)
        row = dict(zip(FORCES, self.total / max(self.steps, 1)))
        normal_force = self.moment[0]
        *centre, pressure = self.moment[1:] / normal_force if normal_force > 0 else np.full(3, np.nan)
        row |= {
            "time": d.time,
            "x": p.running.start + d.contact.wheel.offset,
            "wheel_height": p.datum_height + p.axle.displacement[2],
            "crossing_height": p.crossing.displacement[2] + d.contact.search.raised - p.static_deflection,
            "wheel_spin": d.contact.wheel.spin,
            "contact_x": centre[0],
            "contact_y": centre[1],
            "contact_pressure": pressure,
            "energy_kinetic": energies["kinetic"] + energies["lumped_kinetic"] + energies["rotation"],
            "energy_elastic": energies["elastic"],
            "energy_plastic": energies["plastic"],
            "energy_hourglass": energies["hourglass"],
            "energy_viscosity": energies["viscous"],
            "energy_damping": energies["dampers"]
            + energies["wheel_damping"]
            + energies["mass_damping"]
            + energies["left_kinetic"],
            "energy_springs": energies["springs"],
            "energy_contact": energies["contact_penalty"],
            "energy_friction": energies["friction"],
            "energy_external": energies["loads"] - energies["prescribed_motion"],
        }
        if p.guide is not None:
            row |= {"wheel_lateral": p.guide.across(), "force_check": p.guide.check_force()}
        stored = math.fsum(v for name, v in row.items() if name.startswith("energy_") and name != "energy_external")
        row["energy_balance"] = stored - row["energy_external"] - self.exchanged
        row["energy_contact_loss"] = energies["contact_loss"]
        self.rows.append(row)
        self.contact_work.append(energies["contact"])
        self.deforming.append(self._deforming())
        self.overlap.append(d.contact.overlap())
        if p.track is not None:
            self._beam.append(np.array([p.track.position, p.track.velocity]))
        self._clear()

    def _deforming(self) -> float:
        """Kinetic energy of the meshes beyond that of each body's mean velocity [J]. Collective."""
        d, motion = self.passage.dynamics, np.zeros((2, 5))
        add_motion(d.structure.v, d.structure.mass, self.passage.on_wheel.view(np.uint8), d.owned_runs, motion)
        if d.window is not None:
            motion[0] += d.window.motion_outside  # of the crossing
        motion = d.comm.allreduce(motion)
        return float((motion[:, 4] - 0.5 * (motion[:, 1:4] ** 2).sum(axis=1) / motion[:, 0]).sum())

    def history(self) -> dict[str, np.ndarray]:
        """Columns (n,) in the names of rail_fem.result.history."""
        if not self.rows:
            return {"time": np.empty(0), "x": np.empty(0)}
        columns = {name: np.array([row[name] for row in self.rows]) for name in self.rows[0]}
        columns["creep_longitudinal"] = self.passage.running.creep(columns["wheel_spin"], columns["contact_y"])
        # springs hold energy from the start, which nobody has put in
        columns["energy_balance"] -= columns["energy_balance"][0]
        return columns
