"""Hertz' line contact against explicit FE at rest: a cylinder on a block in plane strain."""

import numpy as np
import pytest
from mpi4py import MPI

from bem.exact.hertz import line_contact_of_width
from bem.material import Elastic, contact_modulus
from geometry.meshing.blocks import mesh_cap
from rail_fem.scene.steel import Steel
from rail_fem.studies import impact as study
from tests.bem.closed_forms import line_compression
from tests.order import assert_order

# cylinder of 500 mm on a flat, G 82 GPa, nu 0.28, half-width 1 mm: 178.896 N/mm and 113.889 MPa
BODY = Elastic.from_shear(82e9, 0.28)
EXACT = line_contact_of_width(1e-3, 0.5, contact_modulus(BODY, BODY))
DEPTH = 20e-3  # of each block: half-planes of 20 half-widths take 0.1 % off the pressure


def press(across: int, depth: float = DEPTH) -> tuple[float, float, np.ndarray]:
    """Relative errors of peak pressure and half-width with `across` elements over the contact, and the pressure's
    largest error over the peak."""
    size = 2 * EXACT.half_width / across
    fine = np.ceil(1.5 * EXACT.half_width / size) * size
    wheel, rail = (
        study.keep_positive(
            mesh_cap(
                radius, np.inf, (depth, size / 2), depth, size, (fine, size / 2, fine), facing=facing, name=facing
            ),
            (0,),
        )
        for radius, facing in ((0.5, "down"), (np.inf, "up"))
    )
    load = EXACT.force * size / 2
    approach = 2 * line_compression(EXACT, depth, BODY.poisson, BODY.plane_modulus)
    steel = Steel(BODY.young, BODY.poisson, 7850.0)
    frequency = np.sqrt(load / approach / (steel.density * depth**2 * size))
    dynamics = study.press(MPI.COMM_SELF, wheel, rail, load, frequency, 10.0, mirrors=(0,), still=(1,), steel=steel)
    study.settle(dynamics, load, load * approach, 5e-3)
    contact = dynamics.contact
    pressure, x = study.rail_pressure(contact), contact.surfaces.reference[: contact.surfaces.n_rail, 0]
    far = np.abs(np.abs(x) / EXACT.half_width - 1) > 2 * size / EXACT.half_width
    off = np.abs(pressure - EXACT.pressure(x))[far].max() / EXACT.max_pressure
    return pressure.max() / EXACT.max_pressure - 1, study.moment_axis(contact, 0, 1 / 4) / EXACT.half_width - 1, off


def test_pressure_and_width_of_a_line_contact_converge_to_hertz():
    assert [EXACT.force, EXACT.max_pressure] == pytest.approx([178.896e3, 113.889e6], rel=1e-5)
    across = np.array([4, 8, 16])
    pressure, width, profile = np.array([press(n) for n in across]).T
    assert abs(pressure[1]) < 0.03 and abs(width[1]) < 0.05
    assert profile[1] < 0.03
    assert_order(1 / across, width, expected=2)
    assert_order(1 / across, pressure, expected=2, slack=0.3)  # 0.1 % of the finest error of 0.16 % is the blocks' own


@pytest.mark.validate
def test_a_fine_line_contact_is_within_a_tenth_of_a_percent():
    pressure, width, profile = press(32, depth=30e-3)
    assert abs(pressure) < 1e-3 and abs(width) < 2e-3 and profile < 4e-3
