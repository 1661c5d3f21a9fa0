"""The numbers asked of the damage part, as the command measures them: those of patches, points and creep curves."""

import re

from rail_fem.studies.damage_numbers import creep_numbers, patch_numbers, plastic_numbers


def values(row):
    """The numbers of a row's last column."""
    return [float(v) for v in re.findall(r"[-+]?\d+\.?\d*(?:e[-+]?\d+)?", row.found)]


def test_numbers_of_a_patch_are_those_asked():
    """Tolerances are those asked, or the digits printed."""
    work, grid, cells, regions, energy, laws = patch_numbers()
    assert abs(values(work)[0] - 74.0) < 0.15 and abs(values(work)[1] - 73.7) < 1.0
    assert max(values(grid)) < 1.0  # per cent
    assert 1e-4 < values(cells)[0] < 1e-3 < values(cells)[1]
    assert regions.found.startswith("none (+0.0e+00), wear (-")
    assert values(energy)[0] < 1e-12
    for found, asked in zip(values(laws), (0.77, 1.7, 0.92, 5.3, 6.2), strict=True):
        assert abs(found / asked - 1) < 0.01


def test_numbers_of_points_and_of_rolling_are_those_asked():
    ratchetting, elastic, rolled = plastic_numbers()
    assert values(ratchetting)[0] < 2.0 and values(ratchetting)[-1] < 1e-3
    assert abs(values(elastic)[0] - 3.33) < 0.01 and abs(values(elastic)[1] - 4.0) < 0.01
    assert abs(values(rolled)[0] - 3.10) < 0.021 and abs(values(rolled)[1] - 4.0) < 0.021


def test_creep_curves_lie_by_polachs():
    """The bend from adhesion to sliding is the formula's own: 6 % of the friction; ends and largest value agree."""
    for row in creep_numbers():
        apart, _, ours, _, published, _ = values(row)
        assert apart < 7.0 and abs(ours / published - 1) < 0.1
