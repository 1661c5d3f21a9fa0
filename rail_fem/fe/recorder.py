"""The histories of a pass: forces averaged over each interval, heights, place of contact, energies."""

from __future__ import annotations

import numpy as np

from rail_fem.fe.passage import Passage

FORCES = ("force", "force_wing", "force_nose", "force_longitudinal", "force_lateral")


class Recorder:
    """Call `after_step` each step and `row` when an interval is over. All numbers replicated; `row` is collective."""

    def __init__(self, passage: Passage):
        self.passage = passage
        self.rows: list[dict[str, float]] = []
        self.contact_work: list[float] = []  # on the bodies, at each row [J]
        self.deepest = 0.0
        self._clear()

    def _clear(self) -> None:
        self.total, self.moment, self.weight, self.steps = np.zeros(5), np.zeros(2), 0.0, 0

    def after_step(self) -> None:
        """Add the contact forces of the step. Replicated."""
        contact, p = self.passage.dynamics.contact, self.passage
        self.steps += 1
        rail = contact.slaves[0]
        if not len(contact.watched):
            return
        watched = contact.watched[: np.searchsorted(contact.watched, contact.n_rail)]
        on_rail = contact.force[watched]
        along, across, total = -on_rail.sum(axis=0)
        nose = -float(on_rail[:, 2] @ p.rail_region[watched])
        self.total += (total, total - nose, nose, along, across)
        carried = contact.carried[rail]
        self.weight += float(carried.sum())
        self.moment += carried @ contact.position[rail, :2]

    def row(self, energies: dict[str, float]) -> None:
        """Close an interval."""
        p, d = self.passage, self.passage.dynamics
        row = dict(zip(FORCES, self.total / max(self.steps, 1)))
        carries = self.weight > 0
        centre = self.moment / self.weight if carries else (np.nan, np.nan)
        row |= {
            "time": d.time,
            "x": p.running.start + d.contact.offset,
            "wheel_height": p.datum_height + p.axle.displacement[2],
            "crossing_height": p.crossing.displacement[2] - p.static_deflection,
            "contact_x": centre[0],
            "contact_y": centre[1],
            "energy_kinetic": energies["kinetic"] + energies["lumped_kinetic"],
            "energy_elastic": energies["elastic"],
            "energy_plastic": energies["plastic"],
            "energy_hourglass": energies["hourglass"],
            "energy_viscosity": energies["viscous"],
            "energy_damping": energies["dampers"] + energies["wheel_damping"] + energies["mass_damping"],
            "energy_springs": energies["springs"],
            "energy_contact": energies["contact_penalty"],
            "energy_friction": energies["friction"],
            "energy_external": energies["loads"] - energies["drive"],
        }
        stored = sum(value for name, value in row.items() if name.startswith("energy_") and name != "energy_external")
        row["energy_balance"] = stored - row["energy_external"]
        self.rows.append(row)
        self.contact_work.append(energies["contact"])
        self.deepest = max(self.deepest, d.contact.deepest_penetration)
        self._clear()

    def history(self) -> dict[str, np.ndarray]:
        """Columns (n,) in the names of rail_fem.history."""
        if not self.rows:
            return {"time": np.empty(0), "x": np.empty(0)}
        return {name: np.array([row[name] for row in self.rows]) for name in self.rows[0]}

    def state(self) -> dict:
        """For a restart: all rows so far and the interval that is open."""
        return {"rows": self.rows, "contact_work": self.contact_work, "deepest": self.deepest, "total": self.total.tolist(), "moment": self.moment.tolist(), "weight": self.weight, "steps": self.steps}

    def restore(self, state: dict) -> None:
        self.rows, self.contact_work, self.deepest, self.weight, self.steps = state["rows"], state["contact_work"], state["deepest"], state["weight"], state["steps"]
        self.total, self.moment = np.array(state["total"]), np.array(state["moment"])
