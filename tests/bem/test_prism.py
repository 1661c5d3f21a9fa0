"""An elastic prism under waves along it: kernels against quadrature, the section's solver against fields known
exactly."""

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.special import k0, k1

from bem.material import STEEL
from bem.plane.curve import arc
from bem.plane.mesh import Sizing, mesh_outline
from bem.plane.outline import Edge, Outline, block_behind
from bem.slices.prism import PrismSection
from bem.slices.prism_kernel import bessel_remainders
from tests.order import assert_order

MU, NU = STEEL.shear, STEEL.poisson
SOURCE, FORCE = np.array([0.011, 0.016]), np.array([1e5, 2e5, -0.7e5])
_GAUSS, _WEIGHTS = np.polynomial.legendre.leggauss(4)


def line_field(away, k):
    """Kelvin's line force (p, 2) away: displacement (p, 3, 3), written down apart from the code."""
    c, r = 1 / (4 * (1 - NU)), np.hypot(away[..., 0], away[..., 1])
    zero, one = k0(k * r), k1(k * r)
    u = np.zeros((*r.shape, 3, 3))
    for a in range(2):
        for b in range(2):
            u[..., a, b] = (1 - c) * zero * (a == b) + c * k * one / r * away[..., a] * away[..., b]
        u[..., 2, a] = c * k * zero * away[..., a]
        u[..., a, 2] = -u[..., 2, a]
    u[..., 2, 2] = zero - c * k * r * one
    return u / (2 * np.pi * MU)


def line_traction(away, normal, k):
    """Traction (p, 3) of the field by Hooke's law on central differences of the displacement."""
    step = 1e-7
    u = line_field(away, k) @ FORCE
    slope = [
        (line_field(away + step * e, k) @ FORCE - line_field(away - step * e, k) @ FORCE) / (2 * step)
        for e in np.eye(2)
    ]
    lam = 2 * MU * NU / (1 - 2 * NU)
    swelling = slope[0][..., 0] + slope[1][..., 1] + k * u[..., 2]
    t = np.zeros_like(u)
    for g in range(2):
        for a in range(2):
            t[..., a] += normal[..., g] * (lam * swelling * (a == g) + MU * (slope[g][..., a] + slope[a][..., g]))
        t[..., 2] += normal[..., g] * MU * (slope[g][..., 2] - k * u[..., g])
    return t


def cell_forces(mesh, k):
    force = np.zeros((3, mesh.densities))
    step = mesh.vertices[mesh.following] - mesh.vertices
    normal = np.column_stack([step[:, 1], -step[:, 0]]) / mesh.lengths[:, None]
    for cell, offset in ((mesh.first, 0.0), (mesh.last, 0.5)):
        for position, weight in zip(_GAUSS, _WEIGHTS):
            t = line_traction(mesh.vertices + step * (offset + (1 + position) / 4) - SOURCE, normal, k)
            for c in range(3):
                np.add.at(force[c], cell, t[:, c] * weight / 4 * mesh.lengths)
    return force.reshape(-1, 1)


def section_error(outline, size, k, held_edge=None, inside=lambda points: np.ones(len(points), bool)):
    mesh = mesh_outline(outline, Sizing(size))
    held = np.zeros(mesh.densities, bool)
    if held_edge:
        held[mesh.of_edge(held_edge)] = True
    targets = mesh.middles[inside(mesh.middles)]
    prescribed = np.moveaxis(line_field(mesh.middles[held] - SOURCE, k) @ FORCE, -1, 0)[..., None]
    found = PrismSection(mesh, STEEL, held, targets).respond(k, cell_forces(mesh, k), prescribed)[..., 0]
    exact = np.moveaxis(line_field(targets - SOURCE, k) @ FORCE, -1, 0)
    return np.abs(found - exact).max() / np.abs(exact).max()


def test_bessel_remainders_keep_their_digits():
    for z in (1e-6, 1e-3, 0.3, 1.99):
        zero, one = bessel_remainders(z)
        assert zero == pytest.approx(k0(z) + np.log(z / 2), abs=1e-14)
        assert one == pytest.approx(z * k1(z) - 1, abs=1e-14)
    for z in (2.01, 4.0, 20.0):
        zero, one = bessel_remainders(z)
        assert zero - np.log(z / 2) == pytest.approx(k0(z), rel=3e-7, abs=1e-14)
        assert one + 1 == pytest.approx(z * k1(z), rel=3e-7, abs=1e-14)


def test_line_field_is_the_sum_of_kelvins_point_forces():
    """Kelvin's solution integrated over 6 m of the wave, whose tail beyond is of the order 1 / (k (3 m)^2)."""
    away, position, k = np.array([0.004, -0.007]), 0.003, 150.0
    panels = np.linspace(-3, 3, 301)

    def kelvin(i, j, x):
        r = np.linalg.norm(x)
        return ((3 - 4 * NU) * (i == j) / r + x[i] * x[j] / r**3) / (16 * np.pi * MU * (1 - NU))

    field = line_field(away, k)
    for i, j in ((0, 0), (0, 1), (2, 1), (0, 2), (2, 2)):
        wave = np.cos if j < 2 else np.sin
        total = sum(
            quad(lambda t: kelvin(i, j, np.array([*away, position - t])) * wave(k * t), a, b)[0]
            for a, b in zip(panels, panels[1:])
        )
        here = np.cos(k * position) if i < 2 else np.sin(k * position)
        assert total == pytest.approx(here * field[i, j], abs=0.01 * field[0, 0])


@pytest.mark.parametrize("k", [20.0, 200.0, 1000.0])
def test_free_cylinder_finds_the_field_of_a_line_force_outside(k):
    """Only tractions given, all three components; second order in the element."""
    disc = Outline([[Edge(arc((0, 0), 0.012, 0, 2 * np.pi, 361), "face")]])
    sizes = [1e-3, 0.5e-3, 0.25e-3]
    errors = [section_error(disc, h, k) for h in sizes]
    assert errors[-1] < 1e-3
    assert_order(sizes, errors, expected=2, slack=0.4)


@pytest.mark.parametrize("k", [0.5, 20.0, 1000.0])
def test_held_block_finds_it_too_away_from_its_corners(k):
    """Held edge below, free sides: the middle of the face to 1e-3 with 24 elements across; the corners' error stays
    there."""
    block = block_behind(np.column_stack([np.linspace(-0.01, 0.01, 11), np.zeros(11)]), -0.015)
    error = section_error(block, 0.8e-3, k, "held", lambda p: (np.abs(p[:, 0]) < 0.006) & (p[:, 1] > -1e-9))
    assert error < 1e-3
