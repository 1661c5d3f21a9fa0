"""Model bem_plastic: plastic flow along wing and nose from the forces of rigid_hertz, on an elastoplastic half-space.

The pass itself (forces, motion, transfer) is that of rigid_hertz with plastic indentation. Its normal forces then roll
over the true surfaces of wing and nose: at every position the contact is solved on the true gap, changed by what was
pressed before, together with J2 plasticity below it (bem.plastic). Resolves plastic strain, residual stress, the new
surface, and plastic patches. The forces do not feel the flow beyond what rigid_hertz' indentation law gives. Blind to
edges, friction, waves and large strain, which it flags. Asked for `passes`, it rolls as many wheels, all under the
forces of the first, over the steel that the one before has left, and stops where the steel is at rest.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path

import numpy as np

from bem.cycle_jumps import CELL_ERROR, LEAST_FLOW, verdict_words
from bem.plastic.contact import LARGE_STRAIN, pressure_warnings
from bem.plastic.influence import Cells
from bem.steel.hardening import Hardening, YieldLaw
from bem.steel.nonlinear_kinematic import NonlinearKinematic
from geometry.surfaces.bodies import BODIES
from kernel_cache import working_time
from rail_fem.contact.contact_pairs import crossing_surface
from rail_fem.contact.contact_table import ContactTable, TableKey, contact_table, every_second, table_key
from rail_fem.models.bem_passage import pair_of
from rail_fem.passes.pass_result import light_result, patch_steps, patches_at
from rail_fem.passes.plastic_fields import metal_of, write_archive, write_vtu
from rail_fem.passes.plastic_indentation import contacts_of
from rail_fem.passes.plastic_rolling import Flow, Station, flow_in, roll_along, strip_along
from rail_fem.passes.repeated_wheels import Wheels
from rail_fem.passes.validity import Flag, flag
from rail_fem.passes.vertical_pass import LightPass, run_pass, run_with_errors
from rail_fem.result.parts import CrossingPart, parts_between
from rail_fem.result.quantities import reported
from rail_fem.result.result import PassResult, Peak
from rail_fem.result.runfolder import digest, fingerprint
from rail_fem.scene.scene import Scene
from rail_fem.scene.steel import Steel
from rail_fem.settings.light import BemPlasticSettings

CARRIES = 0.05  # of the static load, from which a body is rolled over
MOST_FALL = 0.1  # of the surface beside the patch over the zone's depth: a rounding of five depths
COARSER = 2.0  # cells of the error estimate over the run's


def solve(
    scene: Scene, settings: BemPlasticSettings, folder: Path | None = None, restart: bool = False, progress=None
) -> PassResult:
    """One pass. Error: forces as rigid_hertz; plastic strain of about first order in the cell, by twice the side.

    Errors: those of rigid_hertz, ContactInputError, NoEquilibriumError where a force cannot be carried, SealError of a
    restart file.
    """
    window = settings.window(scene)
    key, table = table_key(scene, *window, settings.path_spacing), contact_table(scene, *window, settings.path_spacing)
    started = working_time()
    contacts, sparse = (contacts_of(scene, settings, one) for one in (table, every_second(table)))
    run, errors = run_with_errors(scene, settings, contacts, sparse)
    steels = {body: getattr(scene.materials, body).steel() for body in BODIES}
    parts = parts_between(run.x[0], run.x[-1], scene.crossing.leg_end)
    flows: dict[str, Flow] = {}
    pieces: dict[str, Flow] = {}
    metal: dict[str, dict] = {}
    bars: dict[str, float] = {}
    flags: list[Flag] = []
    of_case = digest(fingerprint("bem_plastic", scene, settings))
    for b, body in enumerate(BODIES):
        stations = stations_of(key, table, run, b, settings.step, CARRIES * scene.static_wheel_load)
        if not stations or steels[body].is_elastic:
            flags += [flag("elastic", f"{body}: its steel has no yield curve, nothing flows")] if stations else []
            continue
        surface, mine = crossing_surface(key.crossing, body), [p for p in parts if p.body == b]

        def tell(flow: Flow, mine=mine, stations=stations, surface=surface) -> dict[str, float]:
            return strain_values(_pieces(mine, flow, stations), surface)

        kept = folder / f"restart_{body}.npz" if folder is not None else None
        wheels = Wheels(settings.passes, tell, kept, {"case": of_case, "body": body}, restart)
        told = (
            nullcontext() if progress is None else progress.part(b / 2, (b + 1) / 2, f"plastic flow along the {body}")
        )
        with told:
            report = _reporter(progress, len(stations), abs(run.x[-1] - run.x[0]) / scene.speed)
            flow = flow_of(stations, key, b, steels[body], settings, settings.cell_size, report, wheels)
        flows[body] = flow
        flags += passes_flags(body, flow, settings.passes)
        found = _pieces(mine, flow, stations)
        left = {name: metal_of(piece, surface) for name, piece in found.items()}
        if settings.error_estimate and left:
            twin = Wheels(settings.passes)
            coarse_flow = flow_of(stations, key, b, steels[body], settings, COARSER * settings.cell_size, wheels=twin)
            there = _pieces(mine, coarse_flow, stations)
            for name in left:
                bars |= strain_bars(name, left[name], metal_of(there[name], surface) if name in there else {})
        for name, piece in found.items():
            flags += flow_flags(name, piece)
        metal, pieces = metal | left, pieces | found
    patches = patches_at(table, run, patch_steps(table, run, scene.static_wheel_load))
    errors |= {
        f"plastic_strain_{name}": bars[f"block_{name}"] / left["values"]["block"]
        for name, left in metal.items()
        if f"block_{name}" in bars and left["values"]["block"] > 0
    }
    result = light_result("bem_plastic", scene, settings, table, run, errors, flags, started, patches)
    result = replace(result, metal=metal, error_bars=bars)
    if settings.passes > 1:
        result = replace(result, passes=passes_of(result, list(flows.values()), settings.passes))
    return _with_flow(result, flows, pieces, run, folder, key)


def window_cells(scene: Scene, settings: BemPlasticSettings) -> list[Cells]:
    """The windows that travel along wing and nose under the forces of the pass, before any of them has to grow.
    Errors: those of the search and the pass."""
    window = settings.window(scene)
    pairs = table_key(scene, *window, settings.path_spacing), contact_table(scene, *window, settings.path_spacing)
    run, found = run_pass(scene, settings, contacts_of(scene, settings, pairs[1])), []
    for b, material in enumerate((scene.materials.wing, scene.materials.nose)):
        stations = stations_of(*pairs, run, b, settings.step, CARRIES * scene.static_wheel_load)
        if stations and not material.steel().is_elastic:
            law = hardening_of(material.steel(), settings.kinematic)
            cell = settings.cell_aspect * settings.cell_size, settings.cell_size
            found.append(strip_along(stations, law, cell).window)
    return found


def strain_values(pieces: dict[str, Flow], surface) -> dict[str, float]:
    """Plastic strain of leg, wing and nose by the names of rail_fem.result.quantities; surface : z(x, y) [m]."""
    left = {name: metal_of(piece, surface) for name, piece in pieces.items()}
    return {f"{name}_{part}": value for part, metal in left.items() for name, value in metal["values"].items()}


def passes_of(result: PassResult, flows: list[Flow], count: int) -> tuple[dict[str, float], ...]:
    """What each wheel reports: the forces of the first, the strain after it; as before once the steel is at rest."""
    forces = {name: value for name, value in reported(result).items() if not name.endswith(("_wing", "_nose", "_leg"))}
    forces |= {name: value for name, value in reported(result).items() if name.startswith("largest_force")}
    told = [{**forces} for _ in range(count)]
    for flow in flows:
        for number, report in enumerate(told):
            report.update(flow.reports[min(number, len(flow.reports) - 1)] if flow.reports else {})
    return tuple(told)


def passes_flags(body: str, flow: Flow, count: int) -> Iterator[Flag]:
    """What repeated wheels came to: rest, or what the last one added."""
    if count == 1:
        return
    what = verdict_words(np.array(flow.grown), np.array(flow.stays), error=CELL_ERROR)
    words = f"at rest after wheel {len(flow.grown)} of {count}: {what}"
    if flow.grown[-1] > LEAST_FLOW:
        words = f"{what}, in the cell to which wheel {count} adds most (the first added {flow.grown[0]:.2g})"
    forces = "; the forces of all are those of the first, which do not feel the changed shape"
    yield flag("repeated wheels", f"{body}: {words}{forces}")


def _pieces(parts: list[CrossingPart], flow: Flow, stations: list[Station]) -> dict[str, Flow]:
    """The flow of a body by the names of its parts that have yielded."""
    found = {part.name: flow_in(part, flow, stations) for part in parts}
    return {name: piece for name, piece in found.items() if piece is not None}


def strain_bars(part: str, left: dict, coarse: dict) -> dict[str, float]:
    """Error bars by the names of rail_fem.result.quantities from cells COARSER times as large: at first order, what
    is left is as much as the two are apart."""
    there = coarse.get("values", {})
    return {
        f"{name}_{part}": abs(value - there[name]) / (COARSER - 1)
        for name, value in left["values"].items()
        if name in there and np.isfinite(value - there[name]) and (value or there[name])
    }


def stations_of(
    key: TableKey, table: ContactTable, run: LightPass, body: int, step: float, least: float
) -> list[Station]:
    """Positions about every `step` [m] where a body carries more than `least` [N], in the order of the pass."""
    force, (low, high) = run.force[body], sorted((run.x[0], run.x[-1]))
    wanted = np.linspace(low, high, max(2, int(np.ceil((high - low) / step)) + 1))
    nearest = np.unique([int(np.argmin(np.abs(run.x - x))) for x in wanted])
    stations = []
    for i in nearest:
        if force[i] < least or not np.isfinite(table.point[body, :, 0]).any():
            continue
        near = table.touching(body, float(run.x[i]))
        pair = pair_of(key, table, body, near, float(run.x[i]))
        normal = pair.normal_force(float(force[i]))
        axes = table.semi_axes(body, near, normal)
        stations.append(Station(float(run.time[i]), pair, normal, (float(axes[0]), float(axes[1]))))
    return stations


def hardening_of(steel: Steel, kinematic: bool) -> YieldLaw:
    """The yield curve of a steel, or its law over many cycles, as bem.plastic takes it; a law without back stresses is
    the isotropic curve of its first loading."""
    law = steel.cyclic
    if law is not None and law.modulus.size:
        return NonlinearKinematic(
            law.yield_stress, law.modulus, law.recovery, law.mixing, law.hardening, law.hardening_rate
        )
    return Hardening(steel.hardening_strain, steel.hardening_stress, kinematic or steel.hardening == "kinematic")


def flow_of(
    stations: list[Station],
    key: TableKey,
    body: int,
    steel: Steel,
    settings: BemPlasticSettings,
    side: float,
    report: Callable[[float], None] = lambda share: None,
    wheels: Wheels = Wheels(),
) -> Flow:
    """Plastic flow of one body (0 wing, 1 nose) of that steel, with cells of `side` [m] across and in depth."""
    cell, hardening = (settings.cell_aspect * side, side), hardening_of(steel, settings.kinematic)
    return roll_along(stations, (key.steels[2], key.steels[body]), hardening, cell, settings.agreement, report, wheels)


def _reporter(progress, stations: int, duration: float) -> Callable[[float], None]:
    """Tells how far the steel has flowed along the path: number of the station, and the time at which the wheel is
    there of `duration` [s]."""
    if progress is None:
        return lambda share: None
    return lambda share: progress.update(round(stations * share), duration * share, duration)


def flow_flags(part: str, flow: Flow) -> Iterator[Flag]:
    """Where a half-space in small strain must not be believed, of leg, wing rail or nose."""
    strain, x, _, _ = flow.worst()
    if flow.edge_distance < flow.zone_depth:
        yield flag(
            "edge",
            f"{part}: the plastic zone, {flow.zone_depth * 1e3:.1f} mm deep, comes within"
            f" {flow.edge_distance * 1e3:.1f} mm of where the body has no surface: true flow there is larger",
        )
    if flow.fall > MOST_FALL:
        yield flag(
            "corner",
            f"{part}: beside the patch the surface falls by {flow.fall * flow.zone_depth * 1e3:.1f} mm over the plastic"
            f" zone's depth of {flow.zone_depth * 1e3:.1f} mm (a radius of {1 / (2 * flow.fall):.1f} depths;"
            f" {1 / (2 * MOST_FALL):g} at least): the half-space is stiffer, true flow is larger",
            x,
        )
    if strain > LARGE_STRAIN:
        yield flag(
            "large strain",
            f"{part}: plastic strain up to {strain:.1%}; above {LARGE_STRAIN:.0%} the half-space of small strain is an"
            " approximation",
            x,
        )
    highest = max(flow.stations, key=lambda station: station.over_yield, default=None)
    if highest is not None:
        for words in pressure_warnings(highest.over_yield):
            yield flag("stiff cells", f"{part}: {words}", highest.x)
    yield flag("no friction", f"{part}: creep forces are left out; they raise the flow near the surface and shift it")


def _with_flow(
    result: PassResult,
    flows: dict[str, Flow],
    pieces: dict[str, Flow],
    run: LightPass,
    folder: Path | None,
    key: TableKey,
) -> PassResult:
    """flows : of wing and nose;  pieces : of leg, wing rail and nose."""
    peaks, trust = dict(result.peaks), dict(result.trust)
    notes: tuple[str, ...] = ()
    for name, flow in pieces.items():
        strain, x, y, depth = flow.worst()
        size = float(np.cbrt(flow.length * flow.side**2))
        peaks[f"plastic_strain_{name}"] = Peak(strain, "1", x=x, y=y, z=-depth, size=size)
        if flow.stations:
            worst = max(flow.stations, key=lambda station: station.max_pressure)
            peaks[f"pressure_{name}"] = Peak(worst.max_pressure, "Pa", x=worst.x)
        trust[f"plastic_flow_{name}"] = {
            "zone_depth": flow.zone_depth,
            "edge_distance": flow.edge_distance,
            "surface_fall": flow.fall,
            "deepest_groove": float(flow.lowered.max()),
            "highest_lip": float(-flow.lowered.min()),
            "stations": len(flow.stations),
        }
    if folder is not None and flows:
        write_archive(folder, flows)
        heights = {body: crossing_surface(key.crossing, body) for body in flows}
        if not write_vtu(folder, flows, heights):
            notes = ("no fields/final.vtu: meshio is not installed (it comes with the explicit models)",)
    cost = replace(result.cost, elements=sum(int(np.count_nonzero(flow.peeq)) for flow in flows.values()))
    return replace(result, peaks=peaks, trust=trust, cost=cost, warnings=result.warnings + notes)
