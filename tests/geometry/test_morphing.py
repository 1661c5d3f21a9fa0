"""How a section's inner nodes follow its outline: exact for what is linear, the same in every direction."""

import numpy as np
import pytest

from geometry.meshing.sweep.carry import ElasticMorph, _follow

ALONG, ACROSS = 6, 4


def grid(distortion=0.2, seed=0):
    """Nodes of a distorted grid, its quads anticlockwise, which nodes lie on its edge, and the random numbers that go
    on."""
    rng = np.random.default_rng(seed)
    i, j = np.meshgrid(np.arange(ALONG + 1), np.arange(ACROSS + 1), indexing="ij")
    points = np.column_stack([i.ravel(), j.ravel()]) + distortion * rng.uniform(-1, 1, (i.size, 2))
    number = np.arange(i.size).reshape(i.shape)
    quads = np.stack([number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]], axis=-1).reshape(-1, 4)
    edge = ((i % ALONG == 0) | (j % ACROSS == 0)).ravel()
    return points, quads, edge, rng


@pytest.mark.parametrize(
    "distortion, strain", [(0.2, 0.0), (0.0, 1.0)], ids=["turned and shifted", "strained, quads of one size"]
)
def test_a_linear_motion_of_the_outline_is_that_of_all_nodes(distortion, strain):
    """Without strain there is no stress, whatever the moduli; one strain and one modulus give one stress."""
    points, quads, edge, rng = grid(distortion)
    motion = points @ ([[0.0, 0.4], [-0.4, 0.0]] + strain * rng.uniform(-1, 1, (2, 2))) + [0.3, -0.7]
    carried = ElasticMorph(points, quads, edge).carry(np.where(edge[:, None], motion, 0.0))
    assert np.abs(carried - motion).max() < 1e-12


def test_a_section_seen_with_its_axes_exchanged_is_carried_as_before():
    """An isotropic law knows no direction."""
    points, quads, edge, rng = grid()
    shift = np.where(edge[:, None], rng.uniform(-0.3, 0.3, points.shape), 0.0)
    carried = ElasticMorph(points, quads, edge).carry(shift)
    exchanged = ElasticMorph(points[:, ::-1], quads[:, ::-1], edge).carry(shift[:, ::-1])
    assert np.abs(carried[~edge]).max() > 0.05
    assert np.abs(exchanged[:, ::-1] - carried).max() < 1e-12


@pytest.mark.parametrize("shift", [(0.5, 0.0), (-0.2, 1.5)])
def test_an_outline_moved_as_a_whole_takes_its_inner_nodes_along(shift):
    points, quads, edge, _ = grid()
    outline = np.where(edge[:, None], points + shift, points)
    moved = _follow(None, ElasticMorph(points, quads, edge), points, outline, edge)
    assert np.abs(moved - points - shift).max() < 1e-12
