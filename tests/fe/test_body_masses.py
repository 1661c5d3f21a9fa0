"""Each body of a pass weighs what the case says, its mesh included, whatever the mesh."""

from pathlib import Path

import numpy as np
import pytest
from mpi4py import MPI

from rail_fem.case.casefile import load_case
from rail_fem.fe.meshing import make_mesh
from rail_fem.fe.passage import build_passage, end_settling, running_of
from rail_fem.settings.explicit import FeSettings

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture(scope="module")
def scene():
    return load_case(ROOT / "cases" / "nose_transfer.toml").scene


def passage_of(scene, **settings):
    """A passage with its wheel let go, and what the wheel and the crossing weigh: nodes and added masses [kg]."""
    settings = FeSettings(**settings)
    running = running_of(scene, settings)
    mesh, _, datum = make_mesh(scene, settings, running)
    passage = build_passage(MPI.COMM_SELF, scene, settings, running, mesh, datum)
    end_settling(passage, scene, settings)
    domain = passage.dynamics.domain
    of_wheel = np.zeros(domain.n_nodes, bool)
    of_wheel[domain.cells[domain.region == 2].ravel()] = True
    mass = passage.dynamics.structure.mass
    return passage, mass[of_wheel].sum() + passage.axle.added_mass, mass[~of_wheel].sum() + passage.crossing.added_mass


@pytest.mark.parametrize(("size", "start", "end"), [(5e-3, 0.31, 0.40), (5e-3, 0.22, 0.42), (4e-3, 0.31, 0.40)])
def test_wheel_and_crossing_weigh_what_the_case_says(scene, size, start, end):
    """To round-off, at any window and element size: half the wheelset, and the lumped track mass."""
    passage, wheel, crossing = passage_of(scene, element_size=size, start=start, end=end)
    assert wheel == pytest.approx(scene.vehicle.wheel_unsprung_mass, rel=1e-12)
    assert crossing == pytest.approx(scene.foundation.track_mass, rel=1e-12)
    assert passage.axle.mesh_mass > 1.5 * passage.axle.node_mass > 0  # clamped nodes alone are not the mesh


def test_a_mesh_heavier_than_its_body_is_refused(scene):
    """A track mass below the steel that is modelled: with both masses, and what to do."""
    light = scene.model_copy(update={"foundation": scene.foundation.model_copy(update={"track_mass": 2.0})})
    with pytest.raises(
        ValueError, match=r"mesh of the crossing weighs \d+\.\d kg, more than the 2\.0 kg .* shorter window"
    ):
        passage_of(light, element_size=5e-3, start=0.31, end=0.40)
    passage, _, crossing = passage_of(light, element_size=5e-3, start=0.31, end=0.40, track_mass=False)
    assert passage.crossing.added_mass == 0.0 and crossing == pytest.approx(passage.crossing.mesh_mass, rel=1e-12)
