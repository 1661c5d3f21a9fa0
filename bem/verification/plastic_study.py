"""The plastic half-space by numbers: python -m bem.verification.plastic_study [PART ...], all parts without one.

newton : residuals of Newton's method with the consistent tangent, and how many steps the fixed point takes instead
sphere : a rigid sphere at 10 times the load of first yield, over the cells per Hertz radius, with CPU seconds
line   : rolling line contact: first yield and the limit of elastic shakedown, over the cells per half-width
speed  : 48 x 48 x 24 cells over eight Hertz radii, slope 2 GPa, 10 times the load of first yield in five steps
passes : an ellipse 1.4 times as long as wide, 4.2 times the yield stress in shear, a hundred times around a ring
"""

from __future__ import annotations

import sys
import time

import numpy as np

from bem.material import STEEL, Elastic, contact_modulus
from bem.patch import Grid
from bem.plastic.body import PlasticBody
from bem.plastic.contact import PlasticHalfSpace
from bem.plastic.hardening import Hardening
from bem.plastic.increment import solve_increment
from bem.plastic.influence import Cells, StressInfluence
from bem.plastic.return_map import PlasticState
from bem.plastic.rolling import PlasticTrack, repeat_passes
from bem.plastic.surface import LoadStress
from bem.verification.line_shakedown import line_limits

RIGID = Elastic(1e17, 0.3)
YIELD, RADIUS = 310e6, 0.1


def newton() -> None:
    """One step of Hertz' pressure, 1.5 times that of first yield, on virgin steel with slopes of 0 and 2 GPa."""
    cells = Cells(0.125e-3, 0.125e-3, 0.125e-3, 22, 22, 14)
    grid = Grid.over((-1.375e-3, 1.375e-3), (-1.375e-3, 1.375e-3), 22, 22)
    x, y = grid.points()
    pressure = 1.5 * 1.6 * YIELD * np.sqrt(np.maximum(1 - (x**2 + y**2) / 1e-6, 0))
    held, _ = LoadStress(grid, cells.depths, STEEL.poisson)((pressure,))
    influence = StressInfluence(cells, STEEL)
    for slope in (0.0, 2e9):
        for consistent in (True, False):
            state = PlasticState.virgin(cells.shape)
            hardening = Hardening.linear(YIELD, slope)
            found = solve_increment(influence, held, state, hardening, None, 1e-6, consistent)
            shown = " ".join(f"{residual:.1e}" for residual in found.residuals[:8])
            method = "consistent tangent" if consistent else "fixed point"
            print(
                f"slope {slope / 1e9:g} GPa, {method}: {len(found.residuals) - 1} steps, {found.products} products,"
                f" mismatch over yield stress {shown}"
            )


def sphere() -> None:
    """Mean pressure and area at 10 times first yield, perfectly plastic, in four load steps."""
    modulus = contact_modulus(RIGID, STEEL)
    first = np.pi**3 * RADIUS**2 * (1.6 * YIELD) ** 3 / (6 * modulus**2)
    radius = (7.5 * first * RADIUS / modulus) ** (1 / 3)
    print("cells per Hertz radius | area over Hertz | mean pressure over yield stress | largest strain | CPU s")
    for count in (4, 6, 8, 12):
        n = 4 * count
        grid = Grid.over((-2 * radius, 2 * radius), (-2 * radius, 2 * radius), n, n)
        x, y = grid.points()
        started = time.process_time()
        body = PlasticHalfSpace(grid, grid.dx, int(2.2 * count) + 2, RIGID, STEEL, Hardening.linear(YIELD))
        for share in (2.5, 5.0, 7.5, 10.0):
            found = body.press((x**2 + y**2) / (2 * RADIUS), share * first, 3e-4)
        area = found.patch.contact_area
        print(
            f"{count} | {area / np.pi / radius**2:.4f} | {10 * first / area / YIELD:.4f} | {found.state.peeq.max():.5f}"
            f" | {time.process_time() - started:.1f}",
            flush=True,
        )


def line() -> None:
    """Rolling line contact, perfectly plastic: first yield and shakedown limit over the cells per half-width."""
    print(
        "cells per half-width | first yield, p0 / Y | shakedown, p0 / k | by the largest shear in these cells | CPU s"
    )
    for cells in (6, 8, 12):
        started = time.process_time()
        found = line_limits(cells)
        print(
            f"{cells} | {found.first_yield:.4f} | {found.shakedown:.3f} | {found.by_shear:.3f} |"
            f" {time.process_time() - started:.0f}",
            flush=True,
        )


def speed() -> None:
    """The case of a published timing of another program (tamaas, 94 CPU s): pressure, area, strain, CPU seconds."""
    modulus = contact_modulus(RIGID, STEEL)
    first = np.pi**3 * RADIUS**2 * (1.6 * YIELD) ** 3 / (6 * modulus**2)
    radius = (7.5 * first * RADIUS / modulus) ** (1 / 3)
    grid = Grid.over((-4 * radius, 4 * radius), (-4 * radius, 4 * radius), 48, 48)
    x, y = grid.points()
    started = time.process_time()
    body = PlasticHalfSpace(grid, grid.dx, 24, RIGID, STEEL, Hardening.linear(YIELD, 2e9))
    for share in (2.0, 4.0, 6.0, 8.0, 10.0):
        found = body.press((x**2 + y**2) / (2 * RADIUS), share * first, 3e-4)
    spent, area = time.process_time() - started, found.patch.contact_area
    hertz = 1.5 * 10 * first / (np.pi * radius**2)
    print(
        f"48 x 48 x 24 cells, five load steps: {spent:.1f} CPU s; largest pressure"
        f" {found.patch.max_pressure / hertz:.3f} and area {area / np.pi / radius**2:.3f} of Hertz', largest strain"
        f" {found.state.peeq.max():.5f}"
    )


def passes() -> None:
    """Rolling passes of a given ellipse until the ring is at rest or steady, and CPU seconds of a hundred."""
    cells, started = 6, time.process_time()
    long, wide, nx, ny, nz = 1.4e-3, 1.0e-3, 34, 22, 13
    side = wide / cells
    grid = Grid(-(nx - 1) / 2 * side, -(ny - 1) / 2 * side, side, side, nx, ny)
    x, y = grid.points()
    shear_yield = YIELD / np.sqrt(3)
    pressure = 4.2 * shear_yield * np.sqrt(np.maximum(1 - (x / long) ** 2 - (y / wide) ** 2, 0))
    body = PlasticBody(grid, side, nz, STEEL, Hardening.linear(YIELD))
    deviator, _ = LoadStress(grid, body.depths, STEEL.poisson)((pressure,))
    track = PlasticTrack(body, 2 * nx, nx, periodic=True)
    found = repeat_passes(track, deviator, 100)
    print(
        f"100 passes of an ellipse, {nx} x {ny} x {nz} cells, ring of {2 * nx}: {found.verdict} after {found.solved},"
        f" largest strain {found.section.max():.5f}, {time.process_time() - started:.0f} CPU s"
    )


if __name__ == "__main__":
    parts = {"newton": newton, "sphere": sphere, "line": line, "speed": speed, "passes": passes}
    wanted = sys.argv[1:] or list(parts)
    if unknown := [name for name in wanted if name not in parts]:
        sys.exit(f"{', '.join(unknown)}: no such part; choose from {', '.join(parts)}")
    for name in wanted:
        parts[name]()
