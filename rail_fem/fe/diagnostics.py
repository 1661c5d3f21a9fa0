"""What a finished pass found: the facts of its trust report, the peaks and where, the transfer, how well it met the
static load."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from geometry.meshing.cell_measures import cell_volume
from geometry.meshing.quality import MeshQuality
from rail_fem.fe import trust
from rail_fem.fe.fields import cell_rows
from rail_fem.fe.parts import cells_of, parts_of
from rail_fem.fe.plan.fine_zone import PATCH_REACH
from rail_fem.fe.run import Run
from rail_fem.fe.running import Running
from rail_fem.fe.state import HOURGLASS_WORK, PLASTIC_WORK
from rail_fem.passes.beam_results import ballast_force, beam_results, bearer_table
from rail_fem.result.events import peak_at
from rail_fem.result.history import complete_history
from rail_fem.result.result import BearerSummary, Peak
from rail_fem.result.trust import largest_internal, numerical_shares

LEVEL = 2e-4  # change of the rigid path's slope up to which running counts as steady [1]


def trust_facts(run: Run, history: dict[str, np.ndarray], quality: MeshQuality, initial_clearance: float) -> dict:
    """Facts for `trust.report_rows`, replicated. Collective.

    quality : of the mesh;  initial_clearance : of the meshes before initial positioning [m]
    """
    dynamics, settled, scaling = run.dynamics, run.settings.settle_time, run.passage.scaling
    work = trust.impact_work(np.array(run.recorder.contact_work)[history["time"] > settled])
    path = float(np.ptp(history["x"][history["time"] > settled])) if (history["time"] > settled).any() else 0.0
    scale = trust.balance_scale(work, run.scene.static_wheel_load, path)
    return {
        "shares": numerical_shares(complete_history(history), settled, scale),
        "impact_work": work,
        "balance_scale": scale,
        "internal_energy": float(np.nanmax(largest_internal(complete_history(history)), initial=0.0)),
        "hourglass_zone": zone_hourglass(run),
        "deforming": deforming_share(run, history, settled),
        "penetration": penetration(np.array(run.recorder.overlap).reshape(-1, 3)[history["time"] > settled]),
        "approach": run.static_approach if run.static_approach > 0 else float("nan"),
        "initial_clearance": initial_clearance,
        "resting": run.passage.start.resting,
        "transfers": len(run.passage.running.transfers) > 0,
        "static_error": static_error(history, run.passage.static_load, settled, run.passage.running),
        "step": run.dt,
        "limit": run.limit,
        "step_ratio": run.dt / run.limit,
        "element_limit": quality.worst_step * scaling.factor**0.5,
        "scaling": scaling,
        "rechecks": run.rechecks,
        "chatter": trust.chatter(history, run.element_time, settled),
        "penalty_factor": run.settings.penalty,
        "window": window_facts(run),
        "outside": 1.0 - run.comm.allreduce(dynamics.kernel_time) / run.comm.size / max(run.loop_time, 1e-9),
    }


def window_facts(run: Run) -> dict[str, float] | None:
    """Energies that left with slabs, plastic work in slabs as they left and in all [J], share of elements computed;
    None without a travelling window. Collective."""
    d = run.dynamics
    if d.window is None:
        return None
    return {
        "left_kinetic": d.window.left_kinetic,
        "left_elastic": d.window.left_elastic,
        "late_flow": d.window.late_flow,
        "plastic": float(run.comm.allreduce(d.structure.work[PLASTIC_WORK])),
        "share": d.updates / max(d.step_count, 1) / d.domain.m_global,
    }


def penetration(rows: np.ndarray) -> tuple[float, float]:
    """Largest overlap, and its mean weighted by the force, over rows (n, 3) of fe.contact.contact.Contact.overlap [m];
    NaN without contact."""
    force = rows[:, 2].sum()
    return (float(rows[:, 0].max()), float(rows[:, 1].sum() / force)) if force > 0 else (float("nan"), float("nan"))


def deforming_share(run: Run, history: dict[str, np.ndarray], settled: float) -> tuple[float, float]:
    """Kinetic energy of deformation over internal energy after settling: mean of the one over mean of the other, and
    largest over largest; NaN without rows. What is quasi-static has little of it.

    Internal energy is counted from 0 or its lowest: steel that an earlier pass has left under stress gives some back.
    """
    after = history["time"] > settled
    moving, internal = (
        np.array(run.recorder.deforming)[after],
        (history["energy_elastic"] + history["energy_plastic"])[after] if after.any() else np.empty(0),
    )
    internal = internal - internal.min(initial=0.0)
    if not len(moving) or not internal.mean() > 0:
        return float("nan"), float("nan")
    return float(moving.mean() / internal.mean()), float(moving.max() / internal.max())


def zone_hourglass(run: Run) -> float:
    """Hourglass work over plastic work in the blocks of elements that yielded. Collective."""
    work = run.dynamics.structure.block_work
    yielded = work[:, PLASTIC_WORK] > 0
    plastic, hourglass = run.comm.allreduce(
        np.array([work[yielded, PLASTIC_WORK].sum(), work[yielded, HOURGLASS_WORK].sum()])
    )
    return float(hourglass / plastic) if plastic > 0 else 0.0


def strain_peaks(run: Run) -> dict[str, Peak]:
    """Largest plastic strain of leg, wing and nose; of equal ones that of the first cell. Collective, replicated."""
    domain, rows = run.dynamics.domain, cell_rows(run.dynamics)
    found = {}
    for part in parts_of(run):
        mine = cells_of(part, domain)
        own = None
        if len(mine):
            worst = mine[np.lexsort((domain.cell_input[mine], -rows[mine, 6]))[0]]
            corners = domain.reference.reshape(-1, 3)[domain.cells[worst]]
            own = -float(rows[worst, 6]), int(domain.cell_input[worst]), corners
        every = [other for other in run.comm.allgather(own) if other is not None]
        if every:
            value, _, corners = min(every, key=lambda other: other[:2])
            x, y, z = map(float, corners.mean(axis=0))
            size = float(np.cbrt(cell_volume(corners[None])[0]))
            found[f"plastic_strain_{part.name}"] = Peak(-value, "1", x, y, z, size=size)
    return found


class OnBeam(NamedTuple):
    """What a crossing on bearers has gone through: columns of the history, peaks, and each bearer near the window."""

    columns: dict[str, np.ndarray]
    peaks: dict[str, Peak]
    bearers: tuple[BearerSummary, ...]


def outcome_on_beam(run: Run, history: dict[str, np.ndarray]) -> OnBeam:
    """From the force and the mean position of the beam over each row's interval since the wheel was let go; nothing on
    a rigid mass. Replicated."""
    track, bearers = run.passage.track, run.scene.bearers
    free = history["time"] > run.settings.settle_time
    if track is None or bearers is None or not free.any():
        return OnBeam({}, {}, ())
    ends = np.concatenate([[[track.start.position, track.start.velocity]], run.recorder.beam])
    position, velocity = ((ends[1:] + ends[:-1]) / 2)[free].swapaxes(0, 1)
    x = ((np.r_[run.passage.running.start, history["x"][:-1]] + history["x"]) / 2)[free]
    time, force = history["time"][free], history["force"][free]
    found = beam_results(track.beam, position, force, x, time)
    columns = {name: np.full(len(free), np.nan) for name in ("bending_moment", "foot_stress")}
    columns["bending_moment"][free], columns["foot_stress"][free] = found.moment, found.stress
    of_track = {"time": time, "x": x, "foundation": ballast_force(track.beam, position)}
    foundation = peak_at(of_track, "foundation", int(np.argmax(of_track["foundation"])))
    ends_of_path = sorted((run.passage.running.start, run.passage.running.end))
    table = bearer_table(track.beam, bearers, position, velocity, *ends_of_path)
    return OnBeam(columns, found.peaks | {"force_foundation": foundation}, table)


def slowest_elements(quality: MeshQuality) -> list[str]:
    """The elements with the smallest stable step, in words."""
    return [
        f"element {i} at ({c[0] * 1e3:.1f}, {c[1] * 1e3:.1f}, {c[2] * 1e3:.1f}) mm: V / A_max = {length * 1e3:.3f} mm"
        for i, c, length in zip(quality.slowest, quality.slowest_centre, quality.slowest_length)
    ]


def static_error(history: dict[str, np.ndarray], static_load: float, settled: float, running: Running) -> float:
    """Mean force between the end of settling and the first bend of the rigid path, against the static load; NaN when
    there is no such stretch."""
    if not len(history["time"]):
        return float("nan")
    slope = running.slope(history["x"])
    steady = (history["time"] > settled) & (np.abs(slope - running.slope(running.start)) < LEVEL)
    ends = np.flatnonzero(~steady & (history["time"] > settled))
    last = history["x"][ends[0]] if len(ends) else history["x"][-1]
    steady &= (last - history["x"]) * running.sign > PATCH_REACH  # the patch reaches ahead of the axle
    if steady.sum() < 3:
        return float("nan")
    return float(history["force"][steady].mean() / static_load - 1)
