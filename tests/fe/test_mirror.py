"""A left-hand crossing seen in a mirror is a right-hand one: the explicit model gives the same pass, lateral forces
turned about."""

from dataclasses import replace

import numpy as np
import pytest

from geometry.meshing.hexmesh import HexMesh
from rail_fem.case.casefile import load_case
from rail_fem.models import fe_full

STEPS = 1500
UPSIDE = [4, 5, 6, 7, 0, 1, 2, 3]  # corners of a hexahedron whose mirror image keeps a positive volume


def mirrored(mesh: HexMesh) -> HexMesh:
    """The mesh seen in the plane y = 0."""
    return replace(
        mesh, points=mesh.points * [1, -1, 1], cells=mesh.cells[:, UPSIDE], surface=mesh.surface[:, ::-1].copy()
    )


def short_pass(monkeypatch=None):
    """The first steps of the reference pass over the transfer, coarse; in the mirror when a monkeypatch is given."""
    case = load_case("nose_transfer")
    settings = case.runs["fe_full"].model_copy(
        update={
            "max_steps": STEPS,
            "element_size": 5e-3,
            "element_aspect": 1.0,
            "wheel_element_ratio": 1.0,
            "start": 0.345,
            "end": 0.42,
            "settle_time": 5e-5,
            "mass_scaling": 1.0,
            "error_twin": False,
            "element": "one-point",
            "window_ahead": None,
            "window_behind": None,
            "history_interval": 2e-5,
            "field_frames": 1,
        }
    )
    if monkeypatch is not None:
        make, running_of = fe_full.make_mesh, fe_full.running_of

        def make_mirrored(scene, settings, running):
            mesh, *numbers = make(scene, settings, replace(running, datum_y=-running.datum_y))
            return mirrored(mesh), *numbers

        monkeypatch.setattr(fe_full, "make_mesh", make_mirrored)
        monkeypatch.setattr(
            fe_full,
            "running_of",
            lambda scene, settings: replace(running_of(scene, settings), datum_y=-scene.wheel_datum_y),
        )
    return fe_full.solve(case.scene, settings)


def test_a_crossing_of_the_other_hand_gives_the_same_pass(monkeypatch):
    """Other corner numbers and signs change the order of sums: round-off, which the steps amplify to 1e-9 of the force
    at most."""
    one, other = short_pass(), short_pass(monkeypatch)
    force = one.history["force"]
    assert force.max() > 10e3 and np.abs(one.history["force_lateral"]).max() > 10.0
    for name in ("force", "force_wing", "force_nose", "force_longitudinal"):
        np.testing.assert_allclose(
            other.history[name], one.history[name], rtol=0, atol=1e-9 * force.max(), err_msg=name
        )
    np.testing.assert_allclose(
        other.history["force_lateral"], -one.history["force_lateral"], rtol=0, atol=1e-9 * force.max()
    )
    np.testing.assert_allclose(other.history["contact_y"], -one.history["contact_y"], rtol=0, atol=1e-9, equal_nan=True)
    for name in ("wheel_height", "crossing_height"):
        np.testing.assert_allclose(other.history[name], one.history[name], rtol=0, atol=1e-13)
    assert other.energies["plastic"] == pytest.approx(one.energies["plastic"], rel=1e-9, abs=1e-9)
