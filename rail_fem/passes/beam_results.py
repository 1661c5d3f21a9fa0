"""What a pass over a beam on bearers asks of it: bending moment and foot stress along it, forces and movement of each
bearer."""

from dataclasses import dataclass

import numpy as np

from rail_fem.passes.beam_kernel import shape_at
from rail_fem.passes.track_beam import TrackBeam, element_stiffness
from rail_fem.result.result import BearerSummary, Peak
from rail_fem.scene.bearers import Bearers

ROWS = 500  # worked on at once


@dataclass(frozen=True)
class Moments:
    """Bending moment [N m], + where the foot is in tension, and foot stress [Pa], at both ends of each element (m, e,
    2), and under the load (m,)."""

    ends: np.ndarray
    foot: np.ndarray
    under: np.ndarray
    under_foot: np.ndarray


def moments(beam: TrackBeam, position: np.ndarray, force: np.ndarray, x: np.ndarray) -> Moments:
    """Of a beam with degrees of freedom (m, n) under forces (m,) down at x (m,).

    From the forces at the ends of each element, as they are with the load where it is: exact in statics, but for
    inertia within an element.
    """
    dofs = np.stack([beam.first[:-1], beam.first[:-1] + 1, beam.first[1:], beam.first[1:] + 1], axis=1)
    length = np.diff(beam.x)
    stiffness = np.array([element_stiffness(*of) for of in zip(beam.sections, length, beam.shear)])
    ends = np.einsum("eij,mej->mei", stiffness, position[:, dofs])
    under, loaded = np.empty(len(x)), np.empty(len(x), int)
    for m in range(len(x)):
        i, weights = shape_at(x[m], beam.band_of_shape)
        ends[m, i] += force[m] * weights
        loaded[m], under[m] = i, ends[m, i, 0] * (x[m] - beam.x[i]) - ends[m, i, 1]
    lever = np.array([section.foot_depth / section.second_moment for section in beam.sections])
    moment = np.stack([-ends[..., 1], ends[..., 3]], axis=-1)
    return Moments(moment, moment * lever[:, None], under, under * lever[loaded])


@dataclass(frozen=True)
class BeamResults:
    """moment, stress : (m,) under the wheel [N m, Pa];  peaks : the largest along the whole beam"""

    moment: np.ndarray
    stress: np.ndarray
    peaks: dict[str, Peak]


def beam_results(
    beam: TrackBeam, position: np.ndarray, force: np.ndarray, x: np.ndarray, time: np.ndarray
) -> BeamResults:
    """Of a pass; arguments as of `moments`, and time (m,) [s]."""
    parts, found = [], []
    for k in range(0, len(x), ROWS):
        rows = slice(k, k + ROWS)
        part = moments(beam, position[rows], force[rows], x[rows])
        parts.append((part.under, part.under_foot))
        found.append(_peaks(beam, part, x[rows], time[rows]))
    largest = {name: max((one[name] for one in found), key=lambda peak: abs(peak.value)) for name in found[0]}
    moment, stress = (np.concatenate(of) for of in zip(*parts))
    return BeamResults(moment, stress, largest)


def _peaks(beam: TrackBeam, part: Moments, x: np.ndarray, time: np.ndarray) -> dict[str, Peak]:
    """Largest sagging and hogging moment and foot stress at nodes or under the wheel, each where it is."""
    at = np.concatenate([np.stack([beam.x[:-1], beam.x[1:]], axis=1).ravel()[None].repeat(len(x), 0), x[:, None]], 1)
    moment = np.concatenate([part.ends.reshape(len(x), -1), part.under[:, None]], axis=1)
    stress = np.concatenate([part.foot.reshape(len(x), -1), part.under_foot[:, None]], axis=1)
    found = {}
    for name, unit, values, pick in (
        ("bending_moment", "N m", moment, np.argmax),
        ("bending_moment_hogging", "N m", moment, np.argmin),
        ("foot_stress", "Pa", stress, np.argmax),
    ):
        row, column = np.unravel_index(int(pick(values)), values.shape)
        found[name] = Peak(float(values[row, column]), unit, x=float(at[row, column]), time=float(time[row]))
    return found


def ballast_force(beam: TrackBeam, position: np.ndarray) -> np.ndarray:
    """(m,) of the springs of all ballast [N], for positions (m, n)."""
    return -sum(bearer.ballast[0] * position[:, bearer.own] for bearer in beam.bearers)


def bearer_table(
    beam: TrackBeam, bearers: Bearers, position: np.ndarray, velocity: np.ndarray, low: float, high: float
) -> tuple[BearerSummary, ...]:
    """What each bearer within two spacings of low..high [m] has carried. position, velocity : (m, n) of the beam"""
    rows = []
    for one in beam.bearers:
        if not low - 2 * bearers.spacing <= one.x <= high + 2 * bearers.spacing:
            continue
        down, sinking = -position[:, one.own], -velocity[:, one.own]
        pad = one.pad[0] * (-position[:, one.rail] - down) + one.pad[1] * (-velocity[:, one.rail] - sinking)
        ballast = one.ballast[0] * down + one.ballast[1] * sinking
        state = "voided" if one.number in bearers.voided else "unlike" if one.number in bearers.unlike else ""
        largest = (pad.max(), max(0.0, -pad.min()), ballast.max(), down.max())
        rows.append(BearerSummary(one.number, one.x, state, *map(float, largest)))
    return tuple(rows)
