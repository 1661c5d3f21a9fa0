"""Residual stress with its hydrostatic part: a strained layer in closed form, the free surface, a track as one body."""

import numpy as np
import pytest

from bem.material import STEEL, Elastic
from bem.plastic.influence import Cells, StressInfluence
from bem.steel.deviator import FROM_DEVIATOR, TO_DEVIATOR, stress_of
from bem.steel.hardening import Hardening
from tests.bem.plastic.cuboid import Cuboid, cuboid_stress
from tests.bem.plastic.line_shakedown import YIELD, one_pass, rolling_line
from tests.bem.plastic.short_track import short_track


def whole_stress(cells: Cells, strain: np.ndarray, elastic: Elastic) -> np.ndarray:
    influence = StressInfluence(cells, elastic)
    return stress_of(influence.deviator(strain), influence.mean(strain))


@pytest.mark.parametrize("poisson", [0.0, 0.3, 0.45])
def test_a_strained_layer_is_held_by_its_neighbours(poisson):
    """One cell 1e4 times as broad as deep: stress in the layer -E / (1 - nu^2) (e_xx + nu e_yy) along and likewise
    across, none on planes along the surface and none in the layers below; what the far ends add falls with depth
    over breadth."""
    elastic, cells = Elastic(210e9, poisson), Cells(1e4, 1e4, 1.0, 1, 1, 3)
    tensor = 1e-3 * np.array([1.0, 0.4, -1.4, 0.3, -0.6, 0.25])
    strain = np.zeros(cells.shape)
    strain[1, :, 0, 0] = TO_DEVIATOR @ tensor
    stress = whole_stress(cells, strain, elastic)[:, 0, 0]
    modulus = elastic.young / (1 - poisson**2)
    xx, yy = -modulus * (tensor[0] + poisson * tensor[1]), -modulus * (tensor[1] + poisson * tensor[0])
    held = np.array([xx, yy, 0.0, 0.0, 0.0, -2 * elastic.shear * tensor[5]])
    np.testing.assert_allclose(stress[1], held, atol=1e-3 * abs(xx))
    np.testing.assert_allclose(stress[[0, 2]], 0.0, atol=1e-3 * abs(xx))


def test_the_whole_stress_of_a_cuboid_is_its_closed_form():
    """A single cell at the middle of others: means over cells beside it against Gauss points of the closed form (3 x 3
    as the cells have, 6 in depth), deviator and hydrostatic part together."""
    cells = Cells(1e-3, 1.3e-3, 0.7e-3, 4, 3, 3)
    strain = np.zeros(cells.shape)
    strain[1, :, 1, 1] = 1e-3 * np.array([1.0, -0.7, 0.3, 0.5, -0.4])
    found = whole_stress(cells, strain, STEEL)
    cuboid = Cuboid((0.5 * cells.dx, 1.5 * cells.dx), (0.5 * cells.dy, 1.5 * cells.dy), (cells.dz, 2 * cells.dz))
    flat, deep = np.polynomial.legendre.leggauss(3), np.polynomial.legendre.leggauss(6)
    for k, i, j in ((0, 0, 0), (2, 0, 2), (1, 3, 2), (0, 3, 1)):
        expected = np.zeros(6)
        for a, u in zip(*flat):
            for b, v in zip(*flat):
                points = [
                    [(i + a / 2) * cells.dx, (j + b / 2) * cells.dy, (k + 0.5 + c / 2) * cells.dz] for c in deep[0]
                ]
                stress = cuboid_stress(np.array(points), cuboid, FROM_DEVIATOR @ strain[1, :, 1, 1], STEEL)
                expected += u * v / 8 * (deep[1] @ stress)
        np.testing.assert_allclose(found[k, i, j], expected, atol=2e-4 * np.abs(expected).max())


def test_the_surface_is_free_of_the_residual_stress():
    """A smooth plastic strain that reaches the surface: zz, xz and yz of the uppermost cells, means over them, fall
    with their thickness."""
    sizes, down, along = (8, 16), [], []
    for layers in sizes:
        cells = Cells(1 / 8, 1 / 8, 1.0 / layers, 16, 16, layers)
        x = (np.arange(16) - 7.5) / 8
        depth = (np.arange(layers) + 0.5) / layers
        shape = np.cos(np.pi * x / 2)[None, :, None] ** 2 * np.cos(np.pi * x / 2)[None, None, :] ** 2
        shape = shape * np.cos(np.pi * depth / 2)[:, None, None] ** 2
        strain = 1e-3 * shape[:, None] * np.array([0.5, -1.0, 0.4, 0.3, 0.2])[None, :, None, None]
        stress = whole_stress(cells, strain, STEEL)
        size = np.abs(stress[..., :2]).max()
        down.append(np.abs(stress[0, ..., 2]).max() / size)
        along.append(np.abs(stress[0, ..., 3:5]).max() / size)
    assert down[1] < 0.02 and along[1] < 0.1
    assert np.log2(down[0] / down[1]) > 0.9 and np.log2(along[0] / along[1]) > 0.8


def test_a_track_knows_its_whole_residual_stress_as_one_body_would():
    """Mean stress of a short track under a sphere's pressure against the influence of all its cells at once, also three
    cells farther than the steps needed; the deviator is not changed by knowing more."""
    grid, track, deviator = short_track()
    assert not track.know_around(3, 2) and not track.mean_residual().any()
    one_pass(track, deviator, stride=2)
    box, before = track.known, track.residual.copy()
    assert track.know_around(3, 2)
    wider = track.known
    assert wider.layers == min(box.layers + 2, 10) and wider.y.stop - wider.y.start > box.y.stop - box.y.start
    inside = slice(0, box.layers), slice(None), slice(None), box.y
    np.testing.assert_allclose(track.residual[inside], before[inside], atol=2e-5 * np.abs(before).max())
    cells = Cells(grid.dx, grid.dy, grid.dx, 22, wider.y.stop - wider.y.start, wider.layers)
    part = np.ascontiguousarray(track.state.strain[: wider.layers, :, :, wider.y])
    whole = StressInfluence(cells, STEEL).mean(part)
    found = track.mean_residual()[: wider.layers, :, wider.y]
    assert np.abs(whole - found).max() < 1e-9 * np.abs(whole).max() and np.abs(whole).max() > 0.1 * YIELD


def test_behind_a_rolled_line_contact_stress_acts_along_and_across_alone():
    """Nothing changes along the track, so equilibrium leaves xx and yy. On a ring of eight half-widths the stress of
    a step is felt over three half-widths ahead and behind; the rest is left out, (1.2 / 3)^2 / 4 of it at most."""
    track, deviator = rolling_line(3.4, 6, depth=1.6, hardening=Hardening.linear(YIELD, 4e10))
    for _ in range(3):
        one_pass(track, deviator, stride=2)
    stress = stress_of(track.residual, track.mean_residual())[: track.known.layers, :, 0].mean(axis=1)
    held = np.abs(stress[:, :2]).max()
    assert held > 0.05 * YIELD
    assert np.abs(stress[:, 2:]).max() < 0.04 * held
