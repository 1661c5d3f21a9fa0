"""Taylor's bar: a copper cylinder thrown at a rigid wall keeps a length and a mushroom that several codes agree on."""

import numpy as np
import pytest

from geometry.meshing.hexmesh import HexMesh
from rail_fem.fe.dynamics import Dynamics
from rail_fem.scene.steel import Steel
from tests.fe.bodies import at, structure_of

COPPER = Steel(117e9, 0.35, 8930.0, [0.0, 10.0], [400e6, 1400e6])
RADIUS, LENGTH, SPEED, DURATION = 3.2e-3, 32.4e-3, 227.0, 80e-6


def quarter_cylinder(core: int, ring: int, along: int) -> HexMesh:
    """A quarter of a cylinder about z on z = 0: a rounded square of core x core cells, `ring` layers around it, `along`
    the axis."""
    u, v = np.meshgrid(np.linspace(0, 1, core + 1), np.linspace(0, 1, core + 1), indexing="ij")
    square = 0.6 * RADIUS * np.stack([u * (1 - 0.2 * v**2), v * (1 - 0.2 * u**2)], axis=-1)
    angle, w = np.linspace(0, np.pi / 4, core + 1), np.linspace(0, 1, ring + 1)[:, None, None]
    right = (1 - w) * square[-1] + w * RADIUS * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    blocks = [square, right, right[::-1, :, ::-1]]
    points = np.concatenate([block.reshape(-1, 2) for block in blocks])
    corners, first = [], 0
    for block in blocks:
        number = first + np.arange(block.shape[0] * block.shape[1]).reshape(block.shape[:2])
        first = number.max() + 1
        corners.append(
            np.stack([number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]], axis=-1).reshape(-1, 4)
        )
    _, keep, merged = np.unique(np.round(points / RADIUS, 9), axis=0, return_index=True, return_inverse=True)
    section, quads = points[keep], merged.ravel()[np.concatenate(corners)]
    heights = np.linspace(0, LENGTH, along + 1)
    layers = [np.column_stack([section, np.full(len(section), z)]) for z in heights]
    cells = [np.hstack([quads + k * len(section), quads + (k + 1) * len(section)]) for k in range(along)]
    cells = np.concatenate(cells)
    return HexMesh(
        np.concatenate(layers),
        cells,
        np.zeros(len(cells), np.int8),
        ("bar",),
        quads[:0],
        np.zeros(0, np.int8),
        np.arange(0),
    )


def fly(core: int, ring: int, along: int, **options):
    """The structure after 80 us, and its energies before and after."""
    structure = structure_of(quarter_cylinder(core, ring, along), COPPER, **options)
    fixed = np.stack([at(structure, axis, 0.0) for axis in range(3)], axis=1)
    structure.v.reshape(-1, 3)[~fixed[:, 2], 2] = -SPEED
    dynamics = Dynamics(structure, fixed=fixed)
    before, step = dynamics.energies(), 0
    while dynamics.time < DURATION:
        if step % 20 == 0:  # cells at the wall shorten to a third within 15 us
            dynamics.check()
            dt = dynamics.stable_step(0.8)
        dynamics.step(min(dt, DURATION - dynamics.time + 1e-12))
        step += 1
    return structure, before, dynamics.energies()


def mushroom(structure) -> tuple[float, float]:
    """Largest radius on the wall and length [m]."""
    x = structure.x.reshape(-1, 3)
    return np.linalg.norm(x[at(structure, 2, 0.0), :2], axis=1).max(), x[:, 2].max()


def test_a_coarse_taylor_bar_spreads_and_shortens_as_published():
    """1600 cells; halving their size moves the radius by 0.9 % and the length by 0.3 %."""
    structure, before, after = fly(4, 3, 40)
    radius, length = mushroom(structure)
    assert radius == pytest.approx(7.22e-3, rel=0.01)
    assert length == pytest.approx(21.43e-3, rel=0.006)
    assert after["hourglass"] < 0.05 * after["plastic"]
    assert after["balance"] == pytest.approx(before["balance"], rel=0.01)
    assert after["kinetic"] < 0.01 * before["kinetic"]


@pytest.mark.validate
def test_a_fine_taylor_bar_meets_the_published_radius_and_length():
    structure, before, after = fly(6, 5, 80)
    radius, length = mushroom(structure)
    assert radius == pytest.approx(7.22e-3, rel=0.01)
    assert 21.42e-3 * (1 - 0.003) < length < 21.44e-3 * (1 + 0.003)
    assert after["balance"] == pytest.approx(before["balance"], rel=0.01)
