"""Wheels that run on a tight rounding: their passes are meshed and run like the others."""

from pathlib import Path

import pytest

from geometry.meshing.crossing import mesh_crossing
from geometry.meshing.quality import mesh_quality
from rail_fem.case.casefile import load_case
from rail_fem.fe.passage import running_of
from rail_fem.light.fine_zone import crossing_spec
from rail_fem.settings.explicit import FeSettings

ROOT = Path(__file__).resolve().parents[2]


@pytest.mark.parametrize(
    "name, size, start, end",
    [
        ("thesis/case_08", "1 mm", "95 mm", "125 mm"),
        pytest.param("nose_transfer", "0.5 mm", "360 mm", "395 mm", marks=pytest.mark.validate),
    ],
)
def test_long_elements_are_meshed_where_the_contact_jumps_sideways(name, size, start, end):
    """Twice as long along the rail as across it. A P1's contact jumps to and fro on the wing, which is as flat as it
    is; the side of the nose's band jumps where a point of the outline comes into it."""
    keys = {"element_size": size, "element_aspect": 2, "start": start, "end": end}
    case = load_case(ROOT / "cases" / f"{name}.toml", {f"run.fe_full.{key}": value for key, value in keys.items()})
    settings = case.settings(FeSettings)
    crossing, path = case.scene.crossing.surface, running_of(case.scene, settings).path
    spec = crossing_spec(crossing, path, settings.start, settings.end, settings)
    assert mesh_quality(mesh_crossing(crossing, spec)).worst_scaled_jacobian > 0.15
