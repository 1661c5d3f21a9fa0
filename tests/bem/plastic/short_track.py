"""A short track under a sphere's pressure, for the tests that hold it against one body."""

import numpy as np

from bem.material import STEEL
from bem.patch import Grid
from bem.plastic.body import PlasticBody
from bem.plastic.rolling import PlasticTrack
from bem.plastic.surface import LoadStress
from bem.steel.hardening import Hardening
from tests.bem.plastic.line_shakedown import SHEAR_YIELD, YIELD


def short_track() -> tuple[Grid, PlasticTrack, np.ndarray]:
    """Grid of the window, the track, and the deviator of the elastic stresses under a peak pressure of 6 k."""
    grid = Grid.over((-4e-3, 4e-3), (-4e-3, 4e-3), 16, 16)
    x, y = grid.points()
    body = PlasticBody(grid, grid.dx, 10, STEEL, Hardening.linear(YIELD, 5e9))
    pressure = 6 * SHEAR_YIELD * np.sqrt(np.maximum(1 - (x**2 + y**2) / 2e-3**2, 0))
    deviator, _ = LoadStress(grid, body.depths, STEEL.poisson)((pressure,))
    track = PlasticTrack(body, 22, 22)
    return grid, track, deviator
