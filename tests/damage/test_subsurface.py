"""Subsurface fatigue: smallest spheres, paths with answers in closed form, a rolling line contact by two routes."""

import numpy as np
import pytest
from scipy.optimize import minimize

from bem.exact.subsurface import line_stress
from bem.halfspace.fastsim import elliptic_patch, fastsim
from bem.material import STEEL
from bem.patch import Creepage
from rail_fem.damage.subsurface import (
    SubsurfaceSteel,
    dang_van_stress,
    enclosing_sphere,
    jiang_sehitoglu,
    plane_normals,
    subsurface_fatigue,
)

RNG = np.random.default_rng(8)
PHASE = np.linspace(0, 2 * np.pi, 64, endpoint=False)


def path(**components):
    """(64, 6) of xx, yy, zz, yz, xz, xy by name."""
    names = ("xx", "yy", "zz", "yz", "xz", "xy")
    return np.column_stack([np.broadcast_to(components.get(name, 0.0), PHASE.shape) for name in names]).astype(float)


def sphere(points):
    """Centre and radius."""
    centre = np.empty(points.shape[1])
    return centre, enclosing_sphere(points, centre)


def test_sphere_of_a_regular_simplex_and_of_two_points():
    corners = np.eye(5)
    centre, radius = sphere(corners)
    assert centre == pytest.approx(np.full(5, 0.2), abs=1e-4) and radius == pytest.approx(np.sqrt(0.8), rel=2e-5)
    centre, radius = sphere(np.array([[1.0, 0, 0], [3.0, 0, 0], [2.0, 0.5, 0]]))
    assert centre == pytest.approx([2, 0, 0], abs=1e-5) and radius == pytest.approx(1, rel=1e-5)
    assert sphere(np.ones((4, 3)))[1] == 0


@pytest.mark.parametrize("seed", range(4))
def test_spheres_hold_all_points_and_are_no_larger_than_brute_force_finds(seed):
    points = np.random.default_rng(seed).normal(size=(40, 6)) * [3, 1, 1, 1, 0.1, 2]
    centre, radius = sphere(points)
    far = lambda c: np.linalg.norm(points - c, axis=1).max()
    assert far(centre) <= radius * (1 + 1e-12)
    best = minimize(far, centre, method="Nelder-Mead", options={"xatol": 1e-9, "fatol": 1e-10, "maxiter": 4000}).fun
    assert radius <= best * (1 + 3e-5)


def test_dang_van_of_paths_with_an_answer():
    """Shear +-t: t. Shear that turns: t. Pulsating tension s: s/4 + c s/3. Reversed tension: s/2 + c s/3. Still: 0 +
    c sigma_h."""
    t = 100e6
    assert dang_van_stress(path(xz=t * np.sin(PHASE)), 0.3) == pytest.approx(t, rel=2e-3)
    assert dang_van_stress(path(xz=t * np.sin(PHASE), yz=t * np.cos(PHASE)), 0.3) == pytest.approx(t, rel=1e-4)
    pulse = t * (1 - np.cos(PHASE)) / 2
    assert dang_van_stress(path(xx=pulse), 0.4) == pytest.approx(t / 4 + 0.4 * t / 3, rel=1e-4)
    assert dang_van_stress(path(xx=-t * np.cos(PHASE)), 0.4) == pytest.approx(t / 2 + 0.4 * t / 3, rel=1e-4)
    still = path(xx=-t, yy=-t, zz=-4 * t, xy=2 * t)
    assert dang_van_stress(still, 0.3) == pytest.approx(-0.3 * 2 * t, rel=1e-9)


def test_dang_van_does_not_feel_a_constant_deviator_or_turned_axes():
    random = RNG.normal(size=(64, 6)) * 1e8
    base = dang_van_stress(random, 0.3)
    assert dang_van_stress(random + [5e7, -2e7, -3e7, 4e7, 1e7, -6e7], 0.3) == pytest.approx(base, rel=1e-4)
    turn, _ = np.linalg.qr(RNG.normal(size=(3, 3)))
    xx, yy, zz, yz, xz, xy = random.T
    tensor = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]).transpose(2, 0, 1)
    new = np.einsum("ij,tjk,lk->til", turn, tensor, turn)
    turned = np.column_stack([new[:, a, b] for a, b in ((0, 0), (1, 1), (2, 2), (1, 2), (0, 2), (0, 1))])
    assert dang_van_stress(turned, 0.3) == pytest.approx(base, rel=1e-4)


def test_jiang_sehitoglu_of_paths_with_an_answer():
    """Shear +-t: the plane of the shear, J (2 t)^2 / G, for J so large that the normal part does not win. Tension 0 to
    s with J = 0: the plane across it, s (s/E)/2."""
    young, poisson, t = 210e9, 0.3, 100e6
    shear = young / (2 * (1 + poisson))
    found = jiang_sehitoglu(path(xz=t * np.sin(PHASE)), 1.0, young, poisson, plane_normals())
    assert found == pytest.approx(4 * t**2 / shear, rel=5e-3)
    pulse = t * (1 - np.cos(PHASE)) / 2
    assert jiang_sehitoglu(path(zz=pulse), 0.0, young, poisson, plane_normals()) == pytest.approx(
        t * t / young / 2, rel=1e-6
    )
    assert jiang_sehitoglu(path(zz=-pulse), 0.0, young, poisson, plane_normals()) == 0


@pytest.mark.parametrize("traction", [0.0, 0.2])
def test_a_long_patch_is_a_line_contact(traction):
    """Middle of an ellipse forty times as wide as long, by rectangles and FFT, against McEwen's closed form: the same
    criterion on histories found by two routes, to what the ends still do (1 %)."""
    a, p0, depth = 1e-3, 1e9, np.array([0.5e-3, 0.7e-3, 1e-3])
    patch = elliptic_patch(a, 40 * a, 2 / 3 * np.pi * a * 40 * a * p0, (40, 81))
    if traction:
        patch = fastsim(patch, STEEL, STEEL, traction, Creepage(0.5), bound="elliptic", estimate=False)
    steel = SubsurfaceSteel(dang_van=0.3, poisson=0.3)
    found = subsurface_fatigue(patch, steel, depth)
    x = a * np.linspace(-4, 4, 400)
    for z, own in zip(depth, found.dang_van[:, 40], strict=True):
        xx, zz, xz = line_stress(x, np.full(400, z), a, p0, traction * p0)
        none = np.zeros(400)
        exact = dang_van_stress(np.column_stack([xx, 0.3 * (xx + zz), zz, none, xz, none]), 0.3)
        assert own == pytest.approx(exact, rel=0.015)


def test_residual_compression_helps_and_loads_add_up():
    patch = elliptic_patch(6e-3, 4e-3, 80e3, (24, 24))
    base = subsurface_fatigue(patch)
    helped = subsurface_fatigue(patch, SubsurfaceSteel(hydrostatic=-100e6))
    assert helped.dang_van.max() == pytest.approx(base.dang_van.max() - 0.3 * 100e6, rel=1e-3)
    double = subsurface_fatigue(elliptic_patch(6e-3, 4e-3, 160e3, (24, 24)))
    assert double.worst[0] == pytest.approx(2 * base.worst[0], rel=1e-6) and double.worst[1] == base.worst[1]
    assert 0.2 < base.worst[1] / 4e-3 < 1.2
