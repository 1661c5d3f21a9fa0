"""A condensed body against the whole of it: statics and frequencies, of a bar and of a wheel."""

from dataclasses import replace

import numpy as np
import pytest
from scipy import sparse
from scipy.linalg import eigh
from scipy.sparse.linalg import eigsh

from bem.material import Elastic
from geometry.meshing.blocks import mesh_grid
from geometry.meshing.hexmesh import HexMesh
from rail_fem.case.casefile import load_case
from rail_fem.fe.condensed_body import Condensed
from rail_fem.fe.plan import kept_meshes
from rail_fem.models import fe_full
from rail_fem.passes.fourier_section import grid_section
from rail_fem.passes.wheel_modes import wheel_modes
from rail_fem.scene.wheel_body import WheelBody
from rail_fem.static_fe.condensed import Factor, Solid, condense
from rail_fem.static_fe.wheel_base import condensed_behind, faces_among, part_of, revolved, sector_of, wheel_mesh

STEEL, DENSITY = Elastic(201e9, 0.3), 7833.0  # of the wheel of cases/nose_transfer.toml
RADIUS, DEPTH, ANGLE = 0.425, 0.060, np.radians(15)
DEEP, DEEP_ANGLE = 0.120, np.radians(25)


def joined(front: Solid, interface: np.ndarray, values: np.ndarray, parts: tuple) -> tuple[sparse.csc_array, ...]:
    """Stiffness, mass and shape of a body `front` on a condensed one; shape (3 n, free + m) of the front's unknowns."""
    stiffness, mass = parts[:2]
    given = (3 * interface[:, None] + np.arange(3)).ravel()
    free = np.setdiff1d(np.arange(3 * len(front.nodes)), given)
    functions = np.zeros((3 * len(front.nodes), len(mass)))
    functions[given, : values.shape[2]] = values.reshape(len(given), -1)
    own = sparse.csc_array((np.ones(len(free)), (free, np.arange(len(free)))), shape=(len(functions), len(free)))
    shape = sparse.hstack([own, sparse.csc_array(functions)]).tocsc()
    behind = [sparse.block_diag([sparse.csc_array((len(free),) * 2), matrix]) for matrix in (stiffness, mass)]
    return (*((shape.T @ a @ shape + b).tocsc() for a, b in zip((front.stiffness, front.mass), behind)), shape)


def box(z: np.ndarray) -> HexMesh:
    return mesh_grid(np.linspace(0, 0.04, 4), np.linspace(0, 0.03, 3), z)


def test_a_bar_on_its_condensed_half_has_the_whole_bars_frequencies_from_above():
    """Rayleigh and Ritz: of fewer functions none is lower. Six motions of a plane section and its six lowest warpings
    hold the first ten modes, whose half waves are longer than the bar is wide, to 1 %."""
    z = np.linspace(0, 0.4, 21)
    whole, lower, upper = (Solid(box(part), STEEL, DENSITY, degree=1) for part in (z, z[:11], z[10:]))
    at = lambda solid, height: np.flatnonzero(np.abs(solid.nodes[:, 2] - height) < 1e-9)
    (low, high), y = (at(one, z[10]) for one in (lower, upper)), 1.0
    x, y = (upper.nodes[high, :2] - (0.02, 0.015)).T
    terms = np.stack([np.ones_like(x), x, y, x * y], axis=1)
    values = np.einsum("nk,cd->ncdk", terms, np.eye(3)).reshape(len(high), 3, 12)
    assert np.allclose(lower.nodes[low, :2], upper.nodes[high, :2])
    parts = condense(lower, at(lower, 0.0), low, values, 2 * np.pi * 60e3)
    stiffness, mass, _ = joined(upper, high, values, parts)
    held = (3 * at(whole, 0.0)[:, None] + np.arange(3)).ravel()
    free = np.setdiff1d(np.arange(3 * len(whole.nodes)), held)
    exact = eigsh(whole.stiffness[free][:, free].tocsc(), 10, whole.mass[free][:, free].tocsc(), sigma=0.0)[0]
    found = eigsh(stiffness, 10, mass, sigma=0.0)[0]
    ratio = np.sqrt(found / exact)
    assert ratio.min() > 1 - 1e-9 and ratio.max() < 1.01, ratio
    assert parts[3] == pytest.approx(DENSITY * 0.04 * 0.03 * 0.2, rel=1e-12)
    assert parts[2][0, [0, 4, 8]] == pytest.approx([parts[2][0, 0], 0, 0], abs=1e-9 * parts[3])


@pytest.fixture(scope="module")
def wheel():
    """The whole wheel, its sector, and that on the condensed rest that a pass takes."""
    case = load_case("nose_transfer")
    scene = case.scene.replace_si(wheel_body=WheelBody())
    condensed = fe_full.wheel_behind(scene, case.runs["fe_full"])
    mesh, in_sector = wheel_mesh(scene.wheel_body, RADIUS, DEPTH, ANGLE)
    sector = part_of(mesh, in_sector)
    front = Solid(sector, STEEL, DENSITY)
    shared = part_of(mesh, ~in_sector).points
    near = np.flatnonzero((np.abs(sector.points[:, None] - shared).max(axis=2) < 1e-9).any(axis=1))
    interface = front.nodes_on(faces_among(sector.cells, near))
    values = condensed.at(front.nodes[interface]).reshape(len(interface), 3, -1)
    parts = condensed.stiffness, condensed.mass
    return Solid(mesh, STEEL, DENSITY), mesh, front, interface, joined(front, interface, values, parts), condensed


def compliance(stiffness, solid: Solid, free: np.ndarray | None, shape, loads: np.ndarray) -> np.ndarray:
    """Of unit loads (3 n, k), each by its own."""
    kept = slice(None) if free is None else free
    of = loads[kept] if shape is None else shape.T @ loads
    return np.einsum("nk,nk->k", of, Factor(sparse.csr_matrix(stiffness))(np.ascontiguousarray(of)))


@pytest.mark.validate
def test_contact_gives_way_on_the_condensed_wheel_as_on_the_whole_wheel(wheel):
    """A vertical force on the tread, to the flange and to the field side: what the sector gains by not being held rigid
    is that of the whole mesh to 1 % of the approach of a wheel on a crossing under its static load, some 120 um of 86
    kN."""
    whole, mesh, front, interface, (stiffness, _, shape), _ = wheel
    y = -0.025, 0.0, 0.02, 0.04
    point = lambda solid, s: int(np.argmin(np.linalg.norm(solid.nodes - (0.0, s, 0.0), axis=1)))
    loads = []
    for solid in (whole, front):
        force = np.zeros((3 * len(solid.nodes), len(y)))
        force[[3 * point(solid, s) + 2 for s in y], np.arange(len(y))] = 1.0
        loads.append(force)
    held = whole.nodes_on(faces_among(mesh.cells, mesh.clamp))
    unknowns = lambda solid, nodes: np.setdiff1d(
        np.arange(3 * len(solid.nodes)), (3 * nodes[:, None] + np.arange(3)).ravel()
    )
    free, own = unknowns(whole, held), unknowns(front, interface)
    exact = compliance(whole.stiffness[free][:, free], whole, free, None, loads[0])
    rigid = compliance(front.stiffness[own][:, own], front, own, None, loads[1])
    found = compliance(stiffness, front, None, shape, loads[1])
    assert (86e3 * (exact - rigid)).min() > 20e-6  # there is something to be found
    assert np.abs(86e3 * (found - exact)).max() < 1.2e-6


@pytest.mark.validate
def test_the_condensed_wheels_frequencies_are_those_of_the_body_of_revolution(wheel):
    """The wheel on its held bore by harmonics around the axle (rail_fem.passes.wheel_modes), a second route: the
    first three frequencies, one-node, umbrella and two-node, to 1 %; from above, for the boundary moves by fewer
    functions."""
    *_, (stiffness, mass, _), condensed = wheel
    found = np.sqrt(np.sort(eigsh(stiffness, 12, mass, sigma=0.0)[0])) / (2 * np.pi)
    modes = wheel_modes(WheelBody(), RADIUS, 1e9, STEEL, DENSITY, 2e3)  # an axle that does not move
    for harmonic, frequency in sorted(zip(modes.harmonic, modes.frequency), key=lambda one: one[1])[:3]:
        nearest = found[np.abs(found - frequency).argmin()]
        assert 1 < nearest / frequency < 1.01, (harmonic, frequency, found)
    assert eigh(condensed.stiffness, condensed.mass, eigvals_only=True)[0] > 0


def test_functions_of_an_interface_are_their_polynomials():
    body = Condensed(np.array([(0, 0, 0), (1, 0, 1)]), 2.0, np.ones((2, 3, 1)), *np.zeros((3, 1, 1)), 0.0)
    assert body.at(np.array([(4.0, 9.0, 6.0)])).ravel() == pytest.approx([7.0] * 3)


def deep_wheel(monkeypatch, scene, settings, behind=None, deep=False):
    """A pass on a wheel's sector that is rigid at its boundary, on a condensed rest, or on a mesh as deep as that."""
    if deep:
        spec = kept_meshes.wheel_spec
        wide = lambda *given: replace(spec(*given), half_angle=DEEP_ANGLE)
        monkeypatch.setattr(kept_meshes, "wheel_spec", wide)
    monkeypatch.setattr(fe_full, "wheel_behind", lambda scene, settings: behind)
    held = WheelBody(damping_ratio=0.0) if behind else None
    depth = {"wheel_depth": DEEP if deep else DEPTH}
    approaches, begin = [], fe_full.Run.begin

    def begin_and_tell(run):
        begin(run)
        approaches.append(run.static_approach)

    monkeypatch.setattr(fe_full.Run, "begin", begin_and_tell)
    result = fe_full.solve(scene.replace_si(wheel_body=held), settings.model_copy(update=depth))
    monkeypatch.undo()
    return approaches[0], result


@pytest.mark.validate
def test_a_pass_on_a_condensed_rest_is_that_on_a_mesh_of_the_whole_body(monkeypatch):
    """A rim held 120 mm below the tread and 25 degrees to both sides, all of it meshed, or a sector on the condensed
    rest of it: approach at rest to 1 %, first impact to 0.5 %; a sector held at its own boundary misses both."""
    case = load_case("nose_transfer")
    scale = {"mass_scaling": 20.0, "error_twin": False, "field_frames": 1, "start": 0.31, "end": 0.42}
    size = {"element_size": 4e-3, "element_aspect": 1.0, "wheel_element_ratio": 1.0}
    settings = case.runs["fe_full"].model_copy(update=scale | size)
    steel = case.scene.materials.wheel.steel()
    r, y = np.r_[np.linspace(RADIUS - DEEP, RADIUS - DEPTH, 4), RADIUS - 0.03, RADIUS], np.linspace(-0.070, 0.065, 7)
    section = grid_section(r, y, np.ones((len(r) - 1, len(y) - 1), bool))
    mesh = revolved(section, np.radians([-25, -20, *range(-15, 16, 5), 20, 25]), RADIUS, closed=False)
    x, _, z = mesh.points.T
    at = np.hypot(x, z - RADIUS), np.abs(np.arctan2(x, RADIUS - z))
    held = np.flatnonzero((at[0] < RADIUS - DEEP + 1e-9) | (at[1] > DEEP_ANGLE - 1e-9))
    elastic = Elastic(steel.youngs_modulus, steel.poisson)
    sector = sector_of(mesh, RADIUS, DEPTH, ANGLE)
    clamped = replace(mesh, clamp=held)
    behind = condensed_behind(clamped, sector, RADIUS, RADIUS * ANGLE, elastic, steel.density, 20e3)
    found = {
        "held": deep_wheel(monkeypatch, case.scene, settings),
        "condensed": deep_wheel(monkeypatch, case.scene, settings, behind),
        "meshed": deep_wheel(monkeypatch, case.scene, settings, deep=True),
    }
    approach = {name: one for name, (one, _) in found.items()}
    impact = {name: result.peaks["first_impact_on_nose"].value for name, (_, result) in found.items()}
    print(approach, impact)
    assert abs(approach["condensed"] / approach["meshed"] - 1) < 0.01 < abs(approach["held"] / approach["meshed"] - 1)
    assert abs(impact["condensed"] / impact["meshed"] - 1) < 0.005
