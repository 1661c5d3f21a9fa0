"""What a solved contact tells: tractions, patches, forces, fields, warnings."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from bem.checks import point_text
from bem.plane.body import CondensedBody
from bem.plane.boundary import BoundarySolution
from bem.plane.coulomb import STICK, ContactState, ContactSystem, Control
from bem.plane.pairing import Interface
from bem.plane.zone import runs


@dataclass(frozen=True)
class PlanePatch:
    """begin, end (2,) [m] : edges, from pressure squared going linearly to zero; width [m]; max_pressure [Pa];
    force (2,) on the moving body [N/m]; nodes : indices into the interface
    """

    begin: np.ndarray
    end: np.ndarray
    width: float
    max_pressure: float
    force: np.ndarray
    nodes: np.ndarray


@dataclass
class ContactResult:
    """Load steps of a contact; arrays over the n nodes of `interface`, which lie on the carrier's boundary in its
    order.

    carrier : "moving" or "fixed", the body whose mesh carries the tractions; its normals and tangents are the
        interface's
    initial_approach : (2,) [m] translation of the moving body that brought it into contact before loading; coordinates
        are after it
    steps   : one ContactState per control: pressure, shear on the carrier along its tangent, gap, slip of the carrier
        over the other
    warnings : what to know before trusting it; seconds : time by stage
    """

    interface: Interface
    system: ContactSystem
    fixed: CondensedBody
    moving: CondensedBody
    carrier: str
    initial_approach: np.ndarray
    controls: list[Control]
    steps: list[ContactState]
    friction: float
    warnings: list[str] = field(default_factory=list)
    seconds: dict[str, float] = field(default_factory=dict)

    @property
    def last(self) -> ContactState:
        """State after the last control."""
        return self.steps[-1]

    @property
    def _sign(self) -> int:
        return 1 if self.carrier == "moving" else -1

    def force(self, step: int = -1) -> np.ndarray:
        """Force (x, y) [N/m] and moment about the origin [N] of the contact on the moving body."""
        state = self.steps[step]
        return self.system.forces @ np.r_[state.pressure, state.shear]

    def traction(self, step: int = -1) -> np.ndarray:
        """Traction (n, 2) on the moving body [Pa]."""
        return self._sign * self._on_carrier(step)

    def _on_carrier(self, step: int) -> np.ndarray:
        state, normal = self.steps[step], self.interface.normals
        tangent = np.column_stack([-normal[:, 1], normal[:, 0]])
        return -state.pressure[:, None] * normal + state.shear[:, None] * tangent

    def patches(self, step: int = -1) -> list[PlanePatch]:
        """Contact patches in the order of the carrier's boundary."""
        state, points = self.steps[step], self.interface.points
        force = self.traction(step) * self.interface.mass[:, None]
        found = []
        for run in runs(state.pressure > 0):
            begin = _edge(points, state.pressure, run[0], -1, len(run))
            end = _edge(points, state.pressure, run[-1], +1, len(run))
            width = float(np.hypot(*np.diff(np.vstack([begin, points[run], end]), axis=0).T).sum())
            found.append(PlanePatch(begin, end, width, float(state.pressure[run].max()), force[run].sum(axis=0), run))
        return found

    def stick_zones(self, step: int = -1) -> list[tuple[np.ndarray, np.ndarray]]:
        """Ends (2,), (2,) [m] of each run of sticking nodes, where the square of the friction's reserve goes linearly
        to zero, or the patch ends."""
        state, points = self.steps[step], self.interface.points
        sticks = (state.state == STICK) & (state.pressure > 0)
        bound = self.friction * state.pressure[sticks] if np.isfinite(self.friction) else np.inf
        reserve = np.zeros(len(points))
        reserve[sticks] = np.minimum(bound - np.abs(state.shear[sticks]), np.finfo(float).max ** 0.25)
        patches = self.patches(step)
        begin, end = {p.nodes[0]: p.begin for p in patches}, {p.nodes[-1]: p.end for p in patches}
        return [
            (
                begin.get(run[0], _edge(points, reserve, run[0], -1, len(run))),
                end.get(run[-1], _edge(points, reserve, run[-1], 1, len(run))),
            )
            for run in runs(sticks)
        ]

    def solution(self, body: str, step: int = -1) -> BoundarySolution:
        """Field of the "fixed" or the "moving" body at a step, for bem.plane.internal (without the initial approach
        translation)."""
        if body not in ("fixed", "moving"):
            raise ValueError(f"body {body!r}: there are 'fixed' and 'moving'")
        amplitude = self._on_carrier(step).T.ravel() * (1 if body == self.carrier else -1)
        if body == "fixed":
            return self.fixed.solution(amplitude)
        return self.moving.solution(amplitude, self.steps[step].motion)


def _edge(points: np.ndarray, pressure: np.ndarray, node: int, direction: int, count: int) -> np.ndarray:
    """Where the square of a quantity, linear over the last two nodes of a run, vanishes; at most one element
    outward."""
    outside, inside = node + direction, node - direction
    if not 0 <= outside < len(points) or pressure[outside] > 0:
        return points[node]
    fraction = 0.5
    if count > 1:
        one, two = pressure[node] ** 2, pressure[inside] ** 2
        span = np.hypot(*(points[node] - points[inside])) / np.hypot(*(points[outside] - points[node]))
        fraction = min(max(one / (two - one) * span, 0.0), 1.0) if two > one else 0.5
    return points[node] + fraction * (points[outside] - points[node])


_OVERLAP = 1e-8  # of the smaller body, above which an overlap is no round-off


def trust_warnings(result: ContactResult) -> list[str]:
    """What a reader should know before using the last step."""
    notes, last = [], result.last
    if not (last.pressure > 0).any():
        notes.append(f"the bodies do not touch: smallest gap at {len(last.gap)} nodes {last.gap.min():.4g} m")
    for patch in result.patches():
        if len(patch.nodes) < 6:
            notes.append(
                f"the patch at {point_text(patch.begin)} m has {len(patch.nodes)} nodes: below 6 its pressure is rough;"
                " ask for a smaller size"
            )
    overlap, controlled = -result.interface.gap.min(), not result.controls[-1].loaded[:2].any()
    if overlap > _OVERLAP * min(result.fixed.body.outline.size, result.moving.body.outline.size) and controlled:
        notes.append(
            f"the bodies overlap by {overlap:.4g} m as placed: with a motion prescribed, that presses them too"
        )
    young = min(result.fixed.body.material.young, result.moving.body.material.young)
    if last.pressure.max() > 0.05 * young:
        notes.append(
            f"largest pressure {last.pressure.max():.3g} Pa is {last.pressure.max() / young:.2g} of Young's modulus: "
            "small strains no longer hold"
        )
    return notes
