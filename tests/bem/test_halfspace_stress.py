"""Stress below the patch against point loads, Hertz, balance of forces."""

import numpy as np
import pytest
from scipy.integrate import dblquad

from bem.exact.hertz import point_contact
from bem.exact.subsurface import von_mises
from bem.halfspace.fastsim import elliptic_patch
from bem.halfspace.normal import normal_contact
from bem.halfspace.stress import rectangle_stress, subsurface_stress
from bem.halfspace.tangential import rolling_contact
from bem.material import STEEL, Elastic
from bem.patch import ContactInputError, Creepage
from bem.slices.coupled import SlicePatch
from tests.bem.closed_forms import ellipse_axis_stress


def boussinesq(x, y, z, nu):
    """xx yy zz yz xz xy by a unit force along +z (into the body); Johnson (1985), eq. 3.19."""
    square, r = x**2 + y**2, np.sqrt(x**2 + y**2 + z**2)
    side = (1 - 2 * nu) / square
    xx = side * ((1 - z / r) * (x**2 - y**2) / square + z * y**2 / r**3) - 3 * z * x**2 / r**5
    yy = side * ((1 - z / r) * (y**2 - x**2) / square + z * x**2 / r**3) - 3 * z * y**2 / r**5
    xy = side * (2 * (1 - z / r) * x * y / square - x * y * z / r**3) - 3 * x * y * z / r**5
    return np.array([xx, yy, -3 * z**3 / r**5, -3 * y * z**2 / r**5, -3 * x * z**2 / r**5, xy]) / (2 * np.pi)


def cerruti(x, y, z, nu):
    """The same by a unit force along +x; Johnson (1985), eq. 3.76."""
    r = np.sqrt(x**2 + y**2 + z**2)
    a, b = 1 / (r * (r + z) ** 2), (3 * r + z) / (r**3 * (r + z) ** 3)
    k = 1 - 2 * nu
    xx = -3 * x**3 / r**5 + k * (x / r**3 - 3 * x * a + x**3 * b)
    yy = -3 * x * y**2 / r**5 + k * (x / r**3 - x * a + x * y**2 * b)
    xy = -3 * x**2 * y / r**5 + k * (-y * a + x**2 * y * b)
    return np.array([xx, yy, -3 * x * z**2 / r**5, -3 * x * y * z / r**5, -3 * x**2 * z / r**5, xy]) / (2 * np.pi)


@pytest.mark.parametrize("load", [0, 1, 2])
@pytest.mark.parametrize("depth", [0.15, 0.7])
def test_loaded_rectangle_is_the_integral_of_point_loads(load, depth):
    nu, edges = 0.28, (0.2, 0.5, -0.3, 0.4)
    found = rectangle_stress(load, np.array(edges[:2]), np.array(edges[2:]), depth, nu)[:, 0, 0]

    def point(x, y):
        if load == 0:
            return boussinesq(x, y, depth, nu)
        if load == 1:
            return cerruti(x, y, depth, nu)
        return cerruti(y, x, depth, nu)[[1, 0, 2, 4, 3, 5]]

    exact = [dblquad(lambda y, x, n=n: point(x, y)[n], *edges, epsabs=1e-9)[0] for n in range(6)]
    np.testing.assert_allclose(found, exact, atol=1e-8)


def round_patch(cells):
    return normal_contact(
        lambda x, y: (x**2 + y**2) / 0.6,
        STEEL,
        STEEL,
        load=1e5,
        window=((-0.03, 0.03), (-0.03, 0.03)),
        cells=cells,
        estimate=False,
    )


def test_hertz_circle_peaks_of_the_verification_table():
    """Von Mises 0.6200 p0; largest shear 0.3100 p0 at 0.481 a (nu 0.3): 1 %."""
    exact = point_contact(1e5, 0.3, 0.3, STEEL.plane_modulus / 2)
    patch = round_patch(45)
    depths = np.linspace(0.46, 0.50, 9) * exact.semi_x
    stress = subsurface_stress(patch, depths, 0.3)
    found = von_mises(stress)
    k, i, j = np.unravel_index(found.argmax(), found.shape)
    assert found.max() == pytest.approx(0.6200 * exact.max_pressure, rel=2e-3)
    assert depths[k] == pytest.approx(0.481 * exact.semi_x, rel=1e-2)
    assert (i, j) == (22, 22)
    middle = stress[k, i, j]
    assert (middle[0] - middle[2]) / 2 == pytest.approx(0.3100 * exact.max_pressure, rel=2e-3)


def test_stress_on_the_axis_of_an_ellipse_converges_in_second_order():
    """Hertz pressure in the cells: the middle converges with h^2, the stairs of the edge disturb single pairs."""
    exact = point_contact(1e5, 0.46, 0.05, STEEL.plane_modulus / 2)
    depths = np.linspace(0.3, 3, 12) * exact.semi_y
    reference = np.array(ellipse_axis_stress(depths, exact.semi_x, exact.semi_y, exact.max_pressure, 0.3)).T
    errors, cells = [], (11, 23, 47, 95)
    for count in cells:
        patch = elliptic_patch(exact.semi_x, exact.semi_y, 1e5, (count, count))
        found = subsurface_stress(patch, depths, 0.3)[:, count // 2, count // 2, :3]
        errors.append(np.linalg.norm(found - reference) / np.linalg.norm(reference))
    scaled = np.array(errors) * np.array(cells) ** 2
    assert errors[-1] < 1e-3 and scaled.max() < 1.5 * scaled[0], (errors, scaled)


def test_planes_below_the_patch_carry_the_load():
    """Sums over a plane at depth d balance the loads, up to what lies beyond the plane's square of half-width w: a
    share of (d/w)^3 of the normal load (3 d^3/(2 pi r^5)), 1.5 d/w of the shears (3 x^2 d/(2 pi r^5)), both times 1 +
    patch/w."""
    patch = elliptic_patch(5e-3, 4e-3, 1e5, (40, 40))
    rolled = rolling_contact(patch, STEEL, STEEL, 0.3, Creepage(3e-3, 1e-3), estimate=False)
    depth, width = 0.5e-3, 6 * 4e-3
    stress = subsurface_stress(_on_wide_grid(rolled, 7), [depth], 0.3)[0]
    area = patch.grid.cell_area
    assert -stress[..., 2].sum() * area == pytest.approx(1e5, rel=1.5 * (depth / width) ** 3 + 1e-6)
    force = -rolled.tangential_force
    assert stress[..., 4].sum() * area == pytest.approx(force[0], rel=2 * depth / width)
    assert stress[..., 3].sum() * area == pytest.approx(force[1], rel=2 * depth / width)


def _on_wide_grid(patch, times):
    """The patch in the middle of a grid so many times as wide."""
    from dataclasses import replace

    grid, extra = patch.grid, [count * (times - 1) // 2 for count in patch.grid.shape]
    wide = replace(
        grid,
        x_first=grid.x_first - extra[0] * grid.dx,
        y_first=grid.y_first - extra[1] * grid.dy,
        nx=grid.nx + 2 * extra[0],
        ny=grid.ny + 2 * extra[1],
    )
    margin = [(count, count) for count in extra]
    return replace(
        patch,
        grid=wide,
        pressure=np.pad(patch.pressure, margin),
        traction=np.pad(patch.traction, [*margin, (0, 0)]),
        slip=None,
        stick=None,
    )


def test_both_bodies_are_mirror_images_under_pressure_and_opposite_under_shear():
    rolled = rolling_contact(
        elliptic_patch(5e-3, 4e-3, 1e5, (20, 20)), STEEL, STEEL, 0.3, Creepage(3e-3), estimate=False
    )
    below, above = (subsurface_stress(rolled, [1e-3], 0.3, body)[0] for body in (2, 1))
    pressed = elliptic_patch(5e-3, 4e-3, 1e5, (20, 20))
    below_0, above_0 = (subsurface_stress(pressed, [1e-3], 0.3, body)[0] for body in (2, 1))
    signs = np.array([1, 1, 1, -1, -1, 1])
    np.testing.assert_allclose(above_0, below_0 * signs, atol=1.0)
    np.testing.assert_allclose(above - above_0, -(below - below_0) * signs, atol=1.0)


def test_surface_shear_is_the_traction():
    """Just below the surface xz in body 2 carries the traction on body 1: sigma_xz = t_x of body 2's face, whose normal
    is +z, = -q_x; to the depth over the cell."""
    rolled = rolling_contact(
        elliptic_patch(5e-3, 4e-3, 1e5, (20, 20)), STEEL, STEEL, 0.3, Creepage(3e-3, 1e-3), estimate=False
    )
    stress = subsurface_stress(rolled, [1e-6], 0.3)[0]
    scale = np.abs(rolled.traction).max()
    np.testing.assert_allclose(stress[..., 4], -rolled.traction[..., 0], atol=0.02 * scale)
    np.testing.assert_allclose(stress[..., 3], -rolled.traction[..., 1], atol=0.02 * scale)
    np.testing.assert_allclose(stress[..., 2], -rolled.pressure, atol=0.02 * rolled.max_pressure)


def test_von_mises_of_known_states():
    assert von_mises(np.array([3.0, 0, 0, 0, 0, 0])) == pytest.approx(3.0)
    assert von_mises(np.array([1.0, 1, 1, 0, 0, 0])) == pytest.approx(0.0)
    assert von_mises(np.array([0.0, 0, 0, 2.0, 0, 0])) == pytest.approx(2 * np.sqrt(3))


@pytest.mark.parametrize("depth", [0.0, -1e-3, np.nan])
def test_depths_outside_the_body_are_refused(depth):
    with pytest.raises(ContactInputError, match="depths"):
        subsurface_stress(elliptic_patch(5e-3, 4e-3, 1e5, (8, 8)), [depth], 0.3)


def test_patches_along_a_curved_face_and_no_depths_are_refused():
    patch = round_patch(12)
    with pytest.raises(ContactInputError, match="empty"):
        subsurface_stress(patch, [], 0.3)
    with pytest.raises(ContactInputError, match=r"shape \(1, 2\)"):
        subsurface_stress(patch, [[1e-3, 2e-3]], 0.3)
    face = np.column_stack([patch.grid.y, -(patch.grid.y**2)])
    curved = SlicePatch(
        patch.grid,
        patch.gap,
        patch.pressure,
        patch.approach,
        "2.5D slices",
        points=face,
        normals=np.tile([0.0, 1.0], (len(face), 1)),
        direction=np.array([0.0, -1.0]),
        initial_approach=np.zeros(2),
    )
    for patch in (curved, rolling_contact(curved, STEEL, STEEL, 0.3, Creepage(1e-3))):
        with pytest.raises(ContactInputError, match="curved face"):
            subsurface_stress(patch, [1e-3], 0.3)


@pytest.mark.parametrize("poisson", [2.0, -1.0, float("nan"), Elastic(210e9, 0.3)])
def test_a_poissons_ratio_that_no_material_has_is_refused(poisson):
    with pytest.raises(ContactInputError, match="Poisson"):
        subsurface_stress(elliptic_patch(5e-3, 4e-3, 1e4, (10, 10)), [1e-3], poisson)
