"""Columns of a pass history: what each is, its SI unit inside, and the unit tables and plots show it in."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from rail_fem.scene.units import si_factor


@dataclass(frozen=True)
class Column:
    """unit: what tables and plots show; the arrays themselves are SI."""

    unit: str
    meaning: str


COLUMNS: dict[str, Column] = {
    "time": Column("ms", "time since the start of the run"),
    "x": Column("mm", "position of the wheel's centre along the running direction"),
    "force": Column("kN", "vertical contact force on the wheel"),
    "force_wing": Column("kN", "its share from wing rail and legs"),
    "force_nose": Column("kN", "its share from the nose"),
    "force_longitudinal": Column("kN", "contact force on the wheel along x"),
    "force_lateral": Column("kN", "contact force on the wheel along y"),
    "creep_longitudinal": Column(
        "%",
        "longitudinal creep: forward speed less spin times rolling radius, over the speed; + where the wheel is braked",
    ),
    "wheel_spin": Column("rad/s", "angular velocity of the wheel about its axle, + where it rolls towards +x"),
    "wheel_height": Column("mm", "height of the wheel's centre less the rolling radius"),
    "crossing_height": Column("mm", "height of the crossing's base against its position at rest without load"),
    "bending_moment": Column(
        "kN m", "bending moment of the beam on bearers under the wheel, + where its foot is in tension"
    ),
    "foot_stress": Column("MPa", "stress that it makes in the foot of rail or casting there, + tension"),
    "force_other": Column("kN", "vertical contact force on the other wheel of the wheelset"),
    "force_check": Column("kN", "force of the check rail on the other wheel's flange back, across the track"),
    "wheel_lateral": Column(
        "mm", "lateral position of the wheel at rail level against its centred position, + towards the field side"
    ),
    "wheel_roll": Column("mrad", "roll of the wheelset, + lifts this wheel"),
    "wheel_yaw": Column("mrad", "yaw of the wheelset, + heads towards the field side"),
    "contact_x": Column("mm", "force-weighted centre of contact along x"),
    "contact_y": Column("mm", "force-weighted centre of contact along y"),
    "contact_pressure": Column(
        "MPa", "mean contact pressure, weighted by the force; three quarters of the largest on an elastic ellipse"
    ),
    "energy_kinetic": Column(
        "J", "kinetic energy less the train's rigid forward motion and the wheel's rotation at the start"
    ),
    "energy_elastic": Column("J", "elastic strain energy"),
    "energy_plastic": Column("J", "plastic work"),
    "energy_hourglass": Column("J", "work of the hourglass control"),
    "energy_viscosity": Column("J", "work of the bulk viscosity"),
    "energy_damping": Column("J", "work of dampers, on the diverging route of the other wheel's creep too"),
    "energy_springs": Column("J", "energy in suspension and foundation springs"),
    "energy_contact": Column("J", "energy in the contact penalty"),
    "energy_friction": Column("J", "work of friction"),
    "energy_external": Column("J", "work of weight and of the prescribed forward motion"),
    "energy_contact_loss": Column(
        "J",
        "what the contact takes from the bodies beyond penalty, friction and prescribed motion: the error of the"
        " contact; no part of the sum below",
    ),
    "energy_balance": Column("J", "sum of the above against the work done from outside: 0 when nothing is lost"),
}


def complete_history(columns: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Check the columns and fill those that are not resolved with NaN.

    columns : name -> (n,) in SI; `time` and `x` are compulsory
    returns : every name of COLUMNS -> (n,), read-only copies
    Errors: ValueError for an unknown name, a missing axis, or unequal lengths.
    """
    unknown = sorted(set(columns) - set(COLUMNS))
    if unknown:
        raise ValueError(f"history: unknown column(s) {', '.join(unknown)}; known: {', '.join(COLUMNS)}")
    missing = {"time", "x"} - set(columns)
    if missing:
        raise ValueError(f"history: column(s) {', '.join(sorted(missing))} missing")
    length = np.size(columns["time"])
    complete, unresolved = {}, np.full(length, np.nan)
    for name in COLUMNS:
        values = np.array(columns.get(name, unresolved), dtype=float)
        if values.shape != (length,):
            raise ValueError(f"history: column {name} has shape {values.shape}, time has ({length},)")
        complete[name] = unresolved if np.isnan(values).all() else values  # one for all: of a light pass most are
        complete[name].flags.writeable = False
    return complete


def shown_table(history: Mapping[str, np.ndarray]) -> tuple[list[str], np.ndarray]:
    """Header with units and (n, columns) in those units, as CSV and plots show them."""
    header = [f"{name} [{column.unit}]" for name, column in COLUMNS.items()]
    table = np.column_stack([history[name] / si_factor(column.unit) for name, column in COLUMNS.items()])
    return header, table
