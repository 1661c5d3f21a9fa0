"""A thick ring that yields, by radial finite elements: the reference where Poisson's ratio is not one half.

One displacement per radius, linear elements with one point each, so second order: `count` of 800 leaves 1e-5 (held to
the closed form at Poisson's ratio near one half, tests/bem/plane_plastic/test_plastic_ring.py). The return map is that
of the package (tests/bem/plastic/test_return_map.py).
"""

from dataclasses import dataclass

import numpy as np
from scipy.linalg import solve_banded

from bem.material import Elastic
from bem.plane_plastic.influence import OF_STRAIN, TO_PLANE
from bem.plane_plastic.section import flat, unflat
from bem.steel.hardening import YieldLaw
from bem.steel.return_map import PlasticState, advanced, radial_return


@dataclass
class RadialState:
    """r (k,) [m] middles of elements; radial, hoop (k,) [Pa]; peeq (k,); wall : displacement [m] inside."""

    r: np.ndarray
    radial: np.ndarray
    hoop: np.ndarray
    peeq: np.ndarray
    wall: float


def radial_ring(
    inner: float, outer: float, elastic: Elastic, hardening: YieldLaw, pressures: np.ndarray, count: int = 800
) -> list[RadialState]:
    """The states after each internal pressure [Pa] of a sequence."""
    nodes = np.linspace(inner, outer, count + 1)
    length, r = np.diff(nodes), (nodes[1:] + nodes[:-1]) / 2
    shear, bulk = elastic.shear, elastic.young / (3 * (1 - 2 * elastic.poisson))
    state, u, states = PlasticState.virgin((count, 3, 1, 1), hardening.back_stresses), np.zeros(count + 1), []
    slope = np.stack([np.stack([-1 / length, 1 / length]), np.stack([0.5 / r, 0.5 / r])])  # (strain, end, element)
    for pressure in pressures:
        for _ in range(40):
            strain = np.zeros((3, count))
            strain[0], strain[1] = np.diff(u) / length, (u[1:] + u[:-1]) / (2 * r)
            whole = 2 * shear * (OF_STRAIN @ strain)
            held = whole - 2 * shear * flat(state.strain).reshape(3, -1)
            found = radial_return(unflat(held.ravel()), state, hardening, shear)
            deviator = held - 2 * shear * flat(found.increment).reshape(3, -1)
            stress = (TO_PLANE @ deviator)[:2] + bulk * (strain[0] + strain[1])
            force = np.einsum("sk,sek->ek", stress * r * length, slope)
            left = np.zeros(count + 1)
            left[:-1] += force[0]
            left[1:] += force[1]
            left[0] -= pressure * inner
            if np.abs(left).max() <= 1e-11 * hardening.first_yield * inner:
                break
            normal = found.direction[:, :, 0, 0]
            along, across = found.along[:, 0, 0], found.across[:, 0, 0]
            kept = (1 - across)[:, None, None] * np.eye(3)
            kept -= (along - across)[:, None, None] * normal[:, :, None] * normal[:, None, :]
            moduli = 2 * shear * np.einsum("ac,kcd,db->kab", TO_PLANE, kept, OF_STRAIN)[:, :2, :2] + bulk
            block = np.einsum("sek,kst,tfk,k->efk", slope, moduli, slope, r * length)
            band = np.zeros((3, count + 1))
            band[1, :-1] += block[0, 0]
            band[1, 1:] += block[1, 1]
            band[0, 1:], band[2, :-1] = block[0, 1], block[1, 0]
            u = u - solve_banded((1, 1), band, left)
        state = advanced(state, found, hardening)
        states.append(RadialState(r, stress[0], stress[1], state.peeq[:, 0, 0].copy(), float(u[0])))
    return states
