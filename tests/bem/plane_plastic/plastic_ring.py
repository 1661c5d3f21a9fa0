"""A thick ring under internal pressure by boundary elements with yielding cells, held to an exact solution."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from bem.exact.plastic_ring import PlasticRing
from bem.material import Elastic
from bem.plane.boundary import Condition
from bem.plane.curve import arc
from bem.plane.mesh import mesh_outline
from bem.plane.outline import Edge, Outline
from bem.plane_plastic.cells import polar_cells
from bem.plane_plastic.loading import PlasticBoundaryBody, Step
from bem.plastic.hardening import Hardening
from tests.bem.plane_plastic.radial_ring import radial_ring

YIELD, SHEAR = 300e6, 80e9
POISSON = 0.3
NAMES = "wall", "hoop stress", "radial stress", "plastic strain", "residual hoop stress"


def ring(slope: float = 0.0) -> PlasticRing:
    """Radii 1 and 2 m; incompressible: it gives the scale of pressures."""
    return PlasticRing(1.0, 2.0, SHEAR, YIELD, slope)


def ring_body(size: float, hardening: Hardening, poisson: float = POISSON, radius: float = 2.0) -> PlasticBoundaryBody:
    """Elements and cells of `size` [m] at the inner wall, growing with the radius, cells out to a radius [m]; load
    factor 1 is 1 Pa inside."""
    begin, end = 0.0, 2 * np.pi
    outline = Outline(
        [[Edge(arc((0, 0), 2, begin, end, 721), "outer")], [Edge(arc((0, 0), 1, begin, end, 721), "inner")]]
    )
    mesh = mesh_outline(outline, lambda points: size * np.hypot(*points.T))
    rows = max(round(np.log(2) / size), 2)
    radii = 2.0 ** (np.arange(rows + 1) / rows)
    cells = polar_cells(mesh, "inner", radii[radii <= radius * (1 + 1e-9)])
    conditions = {"inner": Condition(traction=(-1.0, None), local=True)}
    return PlasticBoundaryBody(mesh, Elastic.from_shear(SHEAR, poisson), hardening, conditions, cells)


def polar_means(body: PlasticBoundaryBody, stress: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Radius, radial and hoop stress (m,) of the cells' stress (m, 4)."""
    x, y = body.section.cells.centers.T
    r, c, s = np.hypot(x, y), x / np.hypot(x, y), y / np.hypot(x, y)
    xx, yy, _, xy = stress.T
    radial = xx * c**2 + yy * s**2 + 2 * xy * c * s
    return r, radial, xx + yy - radial


class RingErrors(NamedTuple):
    """Relative errors (5,) of wall displacement, hoop stress, radial stress, plastic strain and residual hoop stress.

    largest : at any cell, over the largest of the field;  mean : root mean square over the cells by their area, over
    that of the field (the wall is one number: the same in both)
    """

    largest: np.ndarray
    mean: np.ndarray


def ring_errors(
    size: float, slope: float, front: float = 1.5, steps: int = 4, kinematic: bool = False, poisson: float = POISSON
) -> tuple[RingErrors, PlasticBoundaryBody, Step]:
    """Errors under the pressure that yields out to about `front` [m], and after it has gone, against radial finite
    elements of 800 layers; the body and its last loaded step."""
    hardening, scale = Hardening.linear(YIELD, slope, kinematic), ring(slope)
    pressure, first = scale.pressure(front), scale.first_pressure
    pressures = first + np.linspace(0, 1, steps + 1)[1:] * (pressure - first)
    *_, loaded, unloaded = radial_ring(
        1.0, 2.0, Elastic.from_shear(SHEAR, poisson), hardening, np.append(pressures, 0.0)
    )
    body = ring_body(size, hardening, poisson)
    for each in pressures:
        done = body.go_to(each)
    moved = np.hypot(*body.displacement(np.array([[1.0 + 1e-9, 0.0]]))[0])
    r, radial, hoop = polar_means(body, body.stress())
    areas = body.section.cells.areas

    def off(found: np.ndarray, reference: np.ndarray) -> tuple[float, float]:
        exact = np.interp(r, loaded.r, reference)
        mean = np.sqrt((areas * (found - exact) ** 2).sum() / (areas * exact**2).sum())
        return np.abs(found - exact).max() / np.abs(reference).max(), float(mean)

    wall = abs(moved / loaded.wall - 1)
    errors = [(wall, wall), off(hoop, loaded.hoop), off(radial, loaded.radial), off(done.peeq, loaded.peeq)]
    body.go_to(0.0)
    errors.append(off(polar_means(body, body.stress())[2], unloaded.hoop))
    return RingErrors(*np.array(errors).T), body, done
