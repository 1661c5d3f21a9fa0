"""What is read from a finished pass's history: static load, mesh noise, chatter; on histories with known answers."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from mpi4py import MPI

from geometry.meshing.blocks import mesh_box
from geometry.meshing.hexmesh import boundary_faces, merge_bodies
from rail_fem.fe.diagnostics import PATCH_REACH, static_error, strain_peaks
from rail_fem.fe.dynamics import Dynamics
from rail_fem.fe.metal import metal
from rail_fem.fe.trust import BAD, GOOD, WARN, _chatter_row, chatter, mesh_noise
from tests.fe.bodies import NO_VISCOSITY, STEEL, place, plastic, structure_of

X = np.linspace(0.2, 0.4, 401)
SPEED, SIZE = 20.0, 2e-3
PASSES = SIZE / SPEED  # of one element [s]
TIME = np.arange(0.0, 0.01, PASSES / 20)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_static_load_is_judged_between_settling_and_the_first_bend(sign):
    """3 % too much there; settling before it and the bend after it hold other forces, which must not count."""
    x = X if sign > 0 else X[::-1]
    distance = np.abs(x - x[0])
    running = SimpleNamespace(
        sign=sign, start=x[0], slope=lambda at: np.where(np.abs(np.asarray(at) - x[0]) > 0.1, 1e-2, 0.0)
    )
    force = np.where(distance < 0.02, 9e5, np.where(distance < 0.1 - 0.9 * PATCH_REACH, 1.03e5, 5e5))
    found = {"time": distance / SPEED, "x": x, "force": force}
    assert static_error(found, 1e5, 0.0201 / SPEED, running) == pytest.approx(0.03, rel=1e-12)
    assert np.isnan(static_error(found, 1e5, 1.0, running))
    assert np.isnan(static_error({"time": np.empty(0), "x": np.empty(0)}, 1e5, 0.0, running))


@pytest.mark.parametrize("share", [0.02, 0.2])
def test_mesh_noise_is_the_part_that_repeats_with_each_element(share):
    """A constant force with two harmonics of the element's passage: their crest, over the largest force, to the
    sampling's second order."""
    phase = 2 * np.pi * TIME / PASSES
    force = 1e5 * (1 + share * (np.cos(phase) + 0.5 * np.cos(2 * phase)))
    assert mesh_noise({"time": TIME, "force": force}, PASSES, 0.0) == pytest.approx(
        1.5 * share / (1 + 1.5 * share), rel=1e-6
    )


def test_smooth_peak_is_hardly_mesh_noise_and_falls_with_the_square_of_the_size():
    """Crest of a cosine over a window h / V: 1 - sin(a) / a, a = w h / 2 V."""
    w = 2 * np.pi / 4e-3
    force = 1e5 * (1 + np.cos(w * (TIME - 4e-3)))
    for size in (SIZE, SIZE / 2):
        a = w * size / SPEED / 2
        assert mesh_noise({"time": TIME, "force": force}, size / SPEED, 0.0) == pytest.approx(
            (1 - np.sin(a) / a) / 2, rel=0.05
        )


def test_noise_and_chatter_that_the_rows_cannot_show_are_nan():
    coarse = {"time": TIME[::20], "force": np.ones(len(TIME[::20]))}
    for judge in (mesh_noise, chatter):
        assert np.isnan(judge(coarse, PASSES, 0.0)).all()
        assert np.isnan(judge({"time": TIME, "force": np.ones(len(TIME))}, PASSES, 1.0)).all()
        assert np.isnan(judge({"time": np.empty(0), "force": np.empty(0)}, PASSES, 0.0)).all()


@pytest.mark.parametrize("times, share, high", [(0.25, 0.0, 0.0), (2.0, 1.0, 0.01 / np.sqrt(2))])
def test_chatter_is_what_happens_above_half_the_mesh_frequency(times, share, high):
    """A wave of 1 % of the mean: all of the variance and 1 % / sqrt(2) of the mean when above, nothing when below."""
    force = 1e5 + 1e3 * np.cos(2 * np.pi * times * TIME / PASSES)
    assert chatter({"time": TIME, "force": force}, PASSES, 0.0) == pytest.approx((share, high), abs=1e-3, rel=0.01)


@pytest.mark.parametrize(
    "share, force, verdict",
    [(0.6, 0.005, GOOD), (0.005, 0.2, GOOD), (0.05, 0.03, WARN), (0.6, 0.2, BAD), (np.nan, np.nan, GOOD)],
)
def test_chatter_counts_when_it_matters_against_the_force_and_its_changes(share, force, verdict):
    """Steady running has no variance but the mesh's: a share of 60 % of next to nothing is no fault."""
    row = _chatter_row(share, force, 1.0)
    assert row.verdict == verdict
    assert ("try penalty = 0.33" in row.shown) == (verdict != GOOD)


def test_the_largest_plastic_strain_is_that_of_its_own_body_and_place():
    """Wing, nose and wheel as bars apart; the fourth cell of the nose is pulled by 4 %, the second of the wing by 2 %,
    the wheel by more: it does not count."""
    bars = [mesh_box((6.0, 1.0, 1.0), (6, 1, 1), name=name) for name in ("wing", "nose", "wheel")]
    mesh = merge_bodies([replace(bar, points=bar.points + [0.0, 5.0 * k, 0.0]) for k, bar in enumerate(bars)])
    structure = structure_of(mesh, *[plastic(STEEL, 1e6)] * 3, settings=NO_VISCOSITY)
    x, y, _ = structure.domain.reference.reshape(-1, 3).T
    pulled = np.where(y < 2, 0.02 * (x > 1.5), np.where(y < 8, 0.04 * (x > 3.5), 0.08 * (x > 0.5)))
    place(structure, structure.domain.reference.reshape(-1, 3) + pulled[:, None] * [1.0, 0.0, 0.0], 1.0)
    passage = SimpleNamespace(running=SimpleNamespace(start=0.0, end=6.0))
    run = SimpleNamespace(dynamics=Dynamics(structure), passage=passage, comm=MPI.COMM_SELF, scene=with_leg_until(0.0))
    peaks = strain_peaks(run)
    assert peaks.keys() == {"plastic_strain_wing", "plastic_strain_nose"}
    wing, nose = peaks["plastic_strain_wing"], peaks["plastic_strain_nose"]
    assert (wing.x, wing.y, wing.z) == pytest.approx((1.5, 0.5, 0.5)) and (nose.x, nose.y, nose.z) == pytest.approx(
        (3.5, 5.5, 0.5)
    )
    # uniaxial strain e: the equivalent plastic strain of perfect plasticity is 2/3 e less the yield strain, 2/3 of 3e-6
    assert (wing.value, nose.value) == pytest.approx((2 / 3 * 0.02 / 1.01, 2 / 3 * 0.04 / 1.02), rel=1e-3)
    run.scene = with_leg_until(3.0)  # which the wheel now runs over: the wing's second cell is the leg's
    parts = strain_peaks(run)
    assert parts.keys() == {"plastic_strain_leg", "plastic_strain_wing", "plastic_strain_nose"}
    leg = parts["plastic_strain_leg"]
    assert (leg.value, leg.x, leg.y, leg.z) == (wing.value, wing.x, wing.y, wing.z)
    assert parts["plastic_strain_wing"].x > 3.0


def with_leg_until(x: float) -> SimpleNamespace:
    return SimpleNamespace(crossing=SimpleNamespace(leg_end=x))


def test_what_is_left_in_the_metal_is_that_of_each_body():
    """Bars of cells of 4 mm as above, four cells strained in each: their integral. The nose stands where the crossing
    took it; the wing's surface has fallen by 0.3 mm more; strips by the wheel do not count."""
    size = 4e-3
    bars = [mesh_box((6 * size, 2 * size, 2 * size), (6, 2, 2), name=name) for name in ("wing", "nose", "wheel")]
    mesh = merge_bodies([replace(bar, points=bar.points + [0.0, 5 * size * k, 0.0]) for k, bar in enumerate(bars)])
    faces, owner = boundary_faces(mesh.cells)
    mesh = replace(mesh, surface=faces, surface_region=mesh.region[owner])
    structure = structure_of(mesh, *[plastic(STEEL, 1e6)] * 3, settings=NO_VISCOSITY)
    x, y, _ = structure.domain.reference.reshape(-1, 3).T / size
    pulled = size * np.where(y < 3, 0.02 * (x > 1.5), np.where(y < 8, 0.04 * (x > 3.5), 0.08 * (x > 0.5)))
    fall = np.where(y < 3, 0.3e-3, 0.0) + 1e-3
    moved = pulled[:, None] * [1.0, 0.0, 0.0] - fall[:, None] * [0.0, 0.0, 1.0]
    place(structure, structure.domain.reference.reshape(-1, 3) + moved, 1.0)
    dynamics, relative = Dynamics(structure), structure.x.reshape(-1, 3) + [0.0, 0.0, 1e-3]
    dynamics.contact = SimpleNamespace(wheel=SimpleNamespace(offset=0.05))
    running = SimpleNamespace(start=0.0, end=6 * size)
    nodes = np.unique(mesh.surface)
    rail = dict(rail_nodes=nodes, rail_region=np.digitize(mesh.points[nodes, 1], [4 * size, 9 * size]))
    passage = SimpleNamespace(**rail, running=running, relative=relative)
    run = SimpleNamespace(dynamics=dynamics, passage=passage, comm=MPI.COMM_SELF, scene=with_leg_until(0.0))
    found = metal(run)
    assert found.keys() == {"wing", "nose"}
    wing, nose = found["wing"], found["nose"]
    assert wing["values"]["integral"] == pytest.approx(4 * size**3 * 2 / 3 * 0.02 / 1.01, rel=1e-3)
    assert nose["values"]["worst_100"] == pytest.approx(2 / 3 * 0.04 / 1.02, rel=1e-3)
    assert nose["values"]["volume_1"] == pytest.approx(4 * size**3) and nose["values"]["volume_3"] == 0.0
    assert nose["size"] == pytest.approx(size) and nose["position"][0] == pytest.approx(3.5 * size)
    assert max(wing["surface"]["fall"]) == pytest.approx(0.3e-3) and not nose["unloaded"] and wing["unloaded"]
    assert max(nose["surface"]["fall"]) == pytest.approx(0.0, abs=1e-12)
    assert max(wing["surface"]["x"]) < 0.01 < max(x) * size
    run.scene = with_leg_until(3 * size)  # all that has yielded of the wing lies on the leg now
    parts = metal(run)
    leg, behind = parts["leg"], parts["wing"]
    assert parts["nose"]["values"] == nose["values"] and leg["position"][0] < 3 * size < behind["position"][0]
    shares = [part["values"]["integral"] / wing["values"]["integral"] for part in (leg, behind)]
    assert shares == pytest.approx([1.0, 0.0])
    assert max(leg["surface"]["x"]) < 3 * size + 5e-3 and parts.keys() == {"leg", "wing", "nose"}
