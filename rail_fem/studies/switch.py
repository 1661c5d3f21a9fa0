"""A wheelset through a switch, facing, as in the thesis' Fig. 3-12 in kind: contact goes from the stock rail to
the switch rail.

    rail-fem study switch --out switch [--wheel P8]        half a minute

The switch rail is parametric (geometry.surfaces.switch), not a drawing; the thesis' is not public. The wheelset is free
across the track and pushed outwards, as in a curve. Sections are looked at one by one as prismatic rails; against the
whole surface that is 15 um in height and 0.3 mm in place (tests/rail_fem/test_study_switch.py).
"""

from dataclasses import dataclass
from typing import Annotated

import numpy as np
import typer

from geometry.contact.prismatic_search import ContactSearch
from geometry.profiles.wheel import WHEEL_NAMES, wheel_profile
from geometry.surfaces.switch import Switch
from geometry.wheelset import Wheelset, WheelsetError
from rail_fem.contact.load_sharing import MISSED, LoadedWheelset, equilibrium_under
from rail_fem.files.atomic import write_text_atomically
from rail_fem.show.panels import Panel
from rail_fem.show.table_and_figure import Table, publish
from rail_fem.studies.harness import OUT, QUICK

MM = 1e-3
AXLE_LOAD = 200e3  # thesis 3.9 [N]
PUSH = 0.1  # lateral load outwards over the axle load
YAW, YAW_LENGTH = 8.55e-3, 1.0  # thesis 3.9: 0 to -8.55 mrad (its sign); reached after this length [rad, m]
BODIES = "stock rail", "switch rail"


@dataclass(frozen=True)
class SwitchPass:
    """What a wheelset does at x (n,) [m]: where it rests, and for each left point (k,) its index in x, y on the stock
    rail's axes [m], whether the switch rail carries it, its normal force [N], the vertical part of it (along the mean
    normal of its strip) [N], contact angle [rad]. failed : the stations that have no answer, and why."""

    x: np.ndarray
    states: tuple[LoadedWheelset, ...]
    index: np.ndarray
    position: np.ndarray
    on_switch_rail: np.ndarray
    force: np.ndarray
    vertical: np.ndarray
    angle: np.ndarray
    failed: tuple[str, ...] = ()

    def share(self, switch_rail: bool) -> np.ndarray:
        """(n,)  part of the left wheel's vertical load that one body carries."""
        mine = self.on_switch_rail == switch_rail
        return np.bincount(self.index[mine], self.vertical[mine], len(self.x)) / np.bincount(
            self.index, self.vertical, len(self.x)
        )

    def points(self) -> np.ndarray:
        """(n,)  carrying points on the left."""
        return np.bincount(self.index, minlength=len(self.x))


def run_through(switch: Switch, wheel: str = "P8", x: np.ndarray | None = None, push: float = PUSH) -> SwitchPass:
    """The wheelset at rest at each x under its axle load and a push outwards, yawed outwards as it enters; stations
    without an answer are left out and named. Raises WheelsetError where none has one."""
    x = np.arange(0, 4.001, 0.05) if x is None else x
    states: list[LoadedWheelset] = []
    rows, failed, passed = [], [], []
    for at in x:
        search = ContactSearch(Wheelset(wheel_profile(wheel)), switch.track(float(at)))
        try:
            found = equilibrium_under(
                search, (AXLE_LOAD / 2, AXLE_LOAD / 2), push * AXLE_LOAD, YAW * min(at / YAW_LENGTH, 1.0)
            )
        except WheelsetError as fault:
            failed.append(f"x = {at:.2f} m: {fault}")
            continue
        k = len(states)
        states.append(found)
        passed.append(at)
        switch_rail, contacts = switch.switch_rail(float(at)), found.left.contacts
        top = np.nan_to_num(switch_rail.height(contacts.rail_station), nan=-1.0)
        stock = np.nan_to_num(switch.stock.height(contacts.rail_station), nan=-1.0)
        rows += [
            (k, *row)
            for row in zip(
                contacts.rail_station, top > stock, found.left.normal_force, found.left.force[:, 2], contacts.angle
            )
        ]
    if not states:
        raise WheelsetError(f"no station has an answer; {failed[0]}")
    index, position, on_switch_rail, force, vertical, angle = (np.array(column) for column in zip(*rows))
    at = np.array(passed)
    return SwitchPass(
        at, tuple(states), index, position, on_switch_rail.astype(bool), force, vertical, angle, tuple(failed)
    )


def report(found: SwitchPass) -> str:
    """Where the switch rail begins to carry, where it carries half and all, and where two or more points carry."""
    share, several = found.share(True), found.x[found.points() > 1]
    first = lambda least: f"{found.x[np.argmax(share >= least)]:.2f} m" if (share >= least).any() else "never"
    spans = (
        f"{several.min():.2f} to {several.max():.2f} m, at most {found.points().max()} at once"
        if len(several)
        else "nowhere"
    )
    missed = [f"x = {x:.2f} m: {s.left.warnings[-1]}" for x, s in zip(found.x, found.states) if s.imbalance > MISSED]
    return "\n".join(
        [
            f"switch rail carries from {first(1e-3)}, half of the wheel load from {first(0.5)}, all from"
            f" {first(0.999)}\nseveral points on the left wheel: {spans}\nsteepest contact on the switch rail"
            f" {np.degrees(found.angle[found.on_switch_rail].max(initial=0.0)):.1f} degrees",
            *missed,
            *(f"no answer at {line}" for line in found.failed),
        ]
    )


def point_table(found: SwitchPass, switch: Switch) -> Table:
    """One row a point that carries; on the switch rail: 1."""
    k = found.index
    shift, height = (np.array([getattr(s.state, name) for s in found.states]) / MM for name in ("y", "z"))
    columns = {
        "x [m]": found.x[k], "y on the stock rail [mm]": found.position / MM,
        "on the switch rail": found.on_switch_rail, "normal force [kN]": found.force / 1e3,
        "angle [degrees]": np.degrees(found.angle), "shift [mm]": shift[k],
        "axle height [mm]": (height - height[0])[k],
        "switch rail's width [mm]": np.array([switch.width(x) / MM for x in found.x[k]]),
        "its top [mm]": np.array([switch.top(x) / MM for x in found.x[k]]),
    }  # fmt: skip
    return Table(list(columns), np.column_stack(list(columns.values())).tolist())


def panels(switch: Switch, found: SwitchPass) -> list[Panel]:
    """Top view in the stock rail's axes with the contact points, and the load that either rail carries."""
    x = np.linspace(found.x[0], found.x[-1], 200)
    edge = np.array([switch.gauge_line - switch.width(v) for v in x]) / MM
    plan: dict[str, tuple] = {
        "gauge line of the stock rail": (x, np.full(len(x), switch.gauge_line / MM)),
        "gauge line of the switch rail": (x, edge),
    }
    shares: dict[str, tuple] = {"points that carry, times 10": (found.x, 10 * found.points(), "o")}
    for switch_rail, name in enumerate(BODIES):
        mine = found.on_switch_rail == bool(switch_rail)
        plan[f"contact on the {name}"] = (found.x[found.index[mine]], found.position[mine] / MM, "o")
        shares[f"load on the {name}"] = (found.x, 100 * found.share(bool(switch_rail)))
    from_toe = "x from the toe [m]"
    return [Panel(from_toe, "y on the stock rail [mm]", plan), Panel(from_toe, "share of the wheel load [%]", shares)]


def main(
    wheel: Annotated[str, typer.Option(help=f"one of {', '.join(WHEEL_NAMES)}")] = "P8",
    quick: QUICK = False,
    out: OUT = None,
) -> None:
    """A wheelset through a switch: where contact goes from the stock rail to the switch rail."""
    switch = Switch()
    found = run_through(switch, wheel, np.arange(0, 4.001, 0.25) if quick else None)
    title = f"{wheel} through a parametric switch (R {switch.radius:g} m), axle load {AXLE_LOAD / 1e3:g} kN, facing"
    publish("switch", out, [], panels(switch, found), title, report(found), columns=1)
    if out is not None:
        write_text_atomically(out / "switch.csv", point_table(found, switch).csv())
