"""What a wheel's modes and bearers change: tracks of one stiffness, rows of both tables."""

import pytest

from rail_fem.studies.flexible_parts import (
    BODY,
    HEAD,
    TRACKS,
    case_of,
    equally_stiff,
    run,
    static_stiffness,
    track_table,
    wheel_table,
)

SHORT = {"run.rigid_hertz.start": "290 mm", "run.rigid_hertz.end": "420 mm", "run.rigid_hertz.path_spacing": "10 mm"}


def test_tracks_are_compared_at_the_stiffness_of_the_foundation():
    """Also that the beam is stiffer than its ballast: several bearers carry."""
    for name in ("rail, the nose between bearers", "casting, the nose over a bearer"):
        scene = case_of({"scene.bearers": equally_stiff(TRACKS[name], 160e6)}).scene
        assert static_stiffness(scene) == pytest.approx(160e6, rel=1e-4)
        assert scene.bearers.ballast_stiffness < 160e6


def test_each_wheel_and_track_has_a_row():
    found = {"rigid": run(case_of(SHORT)), "default": run(case_of({**SHORT, BODY: {}}))}
    wheels = wheel_table(found)
    assert "(1), " in wheels[3] and "(0), " in wheels[3] and "(2)" in wheels[3]  # axle, all around, two waves
    assert wheels[2].endswith("| - |") and len(wheels) == 4
    stiff = equally_stiff(TRACKS["casting, the nose between bearers"], 160e6)
    tracks = track_table({"today": found["rigid"], "casting": run(case_of({**SHORT, "scene.bearers": stiff}))})
    assert len(tracks) == 4 and all(words in tracks[0] for words in HEAD)
    assert "| 160.0 |" in tracks[2] and "| 160.0 |" in tracks[3]
