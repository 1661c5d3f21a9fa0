"""The study of speed against error on the crossing: finer sections err less, what is carried does not depend on the
stations, a figure."""

import numpy as np

from geometry.surfaces.crossing import CastCrossing
from rail_fem.studies.crossing_contact import MM, draw, speed_against_error


def test_errors_fall_with_the_sections_and_not_with_the_stations(tmp_path):
    """Against sections 2 mm apart. Most states stand on smooth parts, which sections 4 mm apart hold to 1e-6 mm; the
    largest errors are those on edges. At stations 1 mm apart one state of these has only one of two neighbouring
    points."""
    settings = ((16 * MM, 0.5 * MM), (4 * MM, 0.5 * MM), (4 * MM, 0.25 * MM))
    rows = speed_against_error(CastCrossing(9.25), "P8", 20, settings, (2 * MM, 0.25 * MM))
    coarse, fine, few = rows
    assert fine[3] < 1e-6 and fine[5] < 0.5 * coarse[5]
    assert fine[6] < 1e-8 and fine[7] < coarse[7] < 0.01
    assert np.allclose(few[3:], fine[3:], atol=1e-4)
    assert draw(tmp_path / "speed.png", rows, "short").stat().st_size > 10_000
