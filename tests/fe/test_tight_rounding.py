"""Wheels that run on a tight rounding: their passes are meshed like the others, and nodes on it keep their pairs."""

import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from geometry.meshing.crossing_mesh import mesh_crossing
from geometry.meshing.quality import mesh_quality
from rail_fem.case.casefile import load_case
from rail_fem.fe.contact.pairs import Pairs
from rail_fem.fe.contact.projection import project_pairs
from rail_fem.fe.contact.surface import edge_neighbours
from rail_fem.fe.plan.fine_zone import crossing_spec
from rail_fem.fe.running import running_of
from rail_fem.settings.explicit import FeSettings

ROOT = Path(__file__).resolve().parents[2]
MM = 1e-3


@pytest.mark.validate
@pytest.mark.parametrize(
    "name, size, start, end",
    [("thesis/case_08", "1 mm", "95 mm", "125 mm"), ("nose_transfer", "0.5 mm", "360 mm", "395 mm")],
)
def test_long_elements_are_meshed_where_the_contact_jumps_sideways(name, size, start, end):
    """Twice as long along the rail as across it. A P1's contact jumps to and fro on the wing, which is as flat as it
    is; the side of the nose's band jumps where a point of the outline comes into it."""
    keys = {"element_size": size, "element_aspect": 2, "start": start, "end": end}
    case = load_case(f"{name}", {f"run.fe_full.{key}": value for key, value in keys.items()})
    settings = case.settings(FeSettings)
    crossing, path = case.scene.crossing.surface, running_of(case.scene, settings).path
    spec = crossing_spec(crossing, path, settings.start, settings.end, settings)
    assert mesh_quality(mesh_crossing(crossing, spec)).worst_scaled_jacobian > 0.15


@pytest.mark.parametrize(
    "name, trial, size",
    [("worn P8", 1, "3 mm"), ("P8", 1, "2 mm"), ("P8", 1, "5 mm"), ("P1", 1, "3 mm"), ("hollow P8", 0, "4 mm")],
)
def test_noses_of_the_proven_design_are_meshed_at_any_size(name, trial, size):
    """A nose so high that its corners meet in a ridge; one whose body ends 1.2 mm before its fine slabs (hollow)."""
    table = tomllib.loads((ROOT / "cases" / "design" / "leg_and_nose.toml").read_text())
    wheel = next(one["set"] for one in table["pass"] if one["name"] == name)
    keys = table["proof"] | wheel | (table["guess"] if trial else {}) | {"run.fe_full.element_size": size}
    case = load_case("whole_crossing", keys)
    settings = case.settings(FeSettings)
    crossing, path = case.scene.crossing.surface, running_of(case.scene, settings).path
    spec = replace(crossing_spec(crossing, path, settings.start, settings.end, settings), wing=None)
    assert mesh_quality(mesh_crossing(crossing, spec)).worst_scaled_jacobian > 0.2


def test_a_nose_that_carries_from_its_begin_is_meshed_from_there():
    """Under a wing 4.1 mm lower a new P8 is near the nose just behind its begin, and fine slabs reach 26 mm ahead."""
    keys = {
        "scene.wheel.profile": "P8",
        "scene.gauge": "1435.89 mm",
        "scene.crossing.wing_raise": "-4.128 mm",
        "scene.crossing.cast_slope": "25.391 mrad",
        "scene.crossing.topping_slope": "16.785 mrad",
        "scene.crossing.topping_depth": "6.861 mm",
    }
    case = load_case("whole_crossing", keys)
    settings = case.settings(FeSettings)
    crossing, path = case.scene.crossing.surface, running_of(case.scene, settings).path
    nose = crossing_spec(crossing, path, settings.start, settings.end, settings).nose
    assert nose.x_range[0] >= crossing.nose_x and nose.fine_x[0] >= crossing.nose_x


def projected(points, quads, node, start):
    """Pair of a node over the facets, from the middle of facet `start`."""
    quads = np.array(quads)
    every = np.vstack([points, [node]])
    pairs = Pairs.over(
        quads, edge_neighbours(quads), np.ones(len(quads), bool), np.array([len(points)]), np.array([start]),
        np.zeros((1, 2)),
    )  # fmt: skip
    project_pairs(every, pairs)
    return pairs


@pytest.mark.parametrize("start", [0, 1])
@pytest.mark.parametrize("depth", [1e-5, 1e-4, 3e-4])
def test_a_node_sunk_into_the_groove_between_two_facets_keeps_its_pair(start, depth):
    """Facets 2 mm wide fall at 1 : 2 from both sides to an edge; a node lies straight below it, where each facet says
    that it is the other's. The closest point is on the edge, `depth` away, at an angle of atan(1/2) from both
    normals."""
    side = 2e-3
    points = [[-side, 0, side / 2], [0, 0, 0], [0, side, 0], [-side, side, side / 2], [side, 0, side / 2]]
    points = np.array([*points, [side, side, side / 2]])
    pairs = projected(points, [[0, 1, 2, 3], [1, 4, 5, 2]], [0.0, 0.6 * side, -depth], start)
    assert pairs.facets[0] in (0, 1)
    assert pairs.gap[0] == pytest.approx(-depth * 2 / np.sqrt(5), rel=1e-9)


def test_a_node_keeps_its_pair_between_facets_far_from_parallelograms():
    """Two facets beside a band, where three columns become one, and a node 3 um deep near their edge: from the middle
    of either one step of Newton leads to the other."""
    points = MM * np.array(
        [
            [95.9984, 29.6435, 1.4549], [95.9985, 21.6537, 1.0425], [97.9968, 25.2488, 1.2361],
            [97.9970, 29.6432, 1.4577], [101.9982, 21.9669, 1.0532], [99.9961, 25.2489, 1.2456],
        ]
    )  # fmt: skip
    node = MM * np.array([96.9162, 23.1716, 1.1211])
    found = [projected(points, [[0, 1, 2, 3], [2, 1, 4, 5]], node, start) for start in (0, 1)]
    for pairs in found:
        assert pairs.facets[0] >= 0 and -4e-6 < pairs.gap[0] < -1e-6
    assert found[0].gap[0] == pytest.approx(found[1].gap[0], rel=1e-2)


def test_a_node_beyond_the_end_of_a_surface_has_no_pair():
    points = MM * np.array([[0.0, 0, 0], [2, 0, 0], [2, 2, 0], [0, 2, 0], [4, 0, 1], [4, 2, 1]])
    assert projected(points, [[0, 1, 2, 3], [1, 4, 5, 2]], MM * np.array([2.0, 2.3, -0.1]), 0).facets[0] < 0
