"""A cylinder along a yielding ridge, plane strain: Hertz on the flat, and what free sides beside the contact change."""

import numpy as np
import pytest

from bem.material import STEEL, contact_modulus
from bem.steel.hardening import Hardening
from rail_fem.static_fe.pressed_ridge import Ridge, press_ridge
from rail_fem.static_fe.small_strain import SmallStrainError
from rail_fem.studies.plastic_ridge import RIGID, panels, rows_of, table

ELASTIC = STEEL, Hardening.linear(1e15)
CURVATURE = 10.0


def test_an_elastic_flat_is_hertz_line():
    """Load at a half-width: the edge lies a part of an element inside the last node, so the load is low by a first
    order that two sizes show; limit pi E* b^2 / (4 R) to 1 %."""
    half = 1e-3
    exact = np.pi / 4 * contact_modulus(RIGID, STEEL) * CURVATURE * half**2
    coarse, fine = (press_ridge(Ridge(), CURVATURE, half, count, *ELASTIC).load[-1] / exact for count in (8, 16))
    assert abs(1 - fine) < 0.6 * abs(1 - coarse) < 0.12
    assert 2 * fine - coarse == pytest.approx(1, abs=0.01)


def test_a_ridge_of_large_radius_is_the_flat_and_a_sharp_one_is_softer():
    """Elastic: 500 half-widths change nothing to 1 %; free sides close by let the approach grow, and the load that
    makes the same half-width is smaller."""
    half = 1e-3
    flat, blunt, sharp = (
        press_ridge(ridge, CURVATURE, half, 8, *ELASTIC).load[-1]
        for ridge in (Ridge(), Ridge(0.5, fall=5e-3), Ridge(1e-3, fall=5e-3))
    )
    assert blunt == pytest.approx(flat, rel=0.01)
    assert sharp < 0.98 * flat


def test_a_yielding_ridge_flows_more_the_sharper_it_is():
    """Under the force of three times the yield stress (Hertz) radii of 2 and 0.5 depths of the flat's zone: strain over
    the section grows in that order; the flat's zone is deeper than where an elastic line contact yields first."""
    flat, (blunt, sharp) = rows_of(3.0, [2.0, 0.5], [5])
    assert 1 < blunt.value["integral"] < sharp.value["integral"]
    assert 1 <= blunt.value["half_width"] < sharp.value["half_width"]
    assert flat["zone_depth"] > 0.7 and 0 < flat["max_strain"] < 0.05
    assert "| 3 | flat |" in table({3.0: flat}, [blunt, sharp]).markdown() and len(panels([blunt, sharp])) == 2


def test_what_is_no_ridge_is_refused_in_words():
    for wrong in (
        {"radius": 0.0},
        {"radius": -1e-3},
        {"flank": 2.0},
        {"radius": 1e-3, "fall": np.nan},
        {"radius": 1e-3},
    ):
        with pytest.raises(SmallStrainError, match="ridge of radius"):
            Ridge(**wrong)
