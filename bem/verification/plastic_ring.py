"""A thick ring under internal pressure by boundary elements with yielding cells, held to an exact solution.

python -m bem.verification.plastic_ring            error against cell size, Newton's residuals, the limit load
"""

from __future__ import annotations

import time

import numpy as np

from bem.exact.plastic_ring import PlasticRing
from bem.material import Elastic
from bem.plane.boundary import Condition
from bem.plane.curve import arc
from bem.plane.mesh import mesh_outline
from bem.plane.outline import Edge, Outline
from bem.plane_plastic.cells import polar_cells
from bem.plane_plastic.loading import PlasticBoundaryBody
from bem.plastic.hardening import Hardening
from bem.plastic.increment import NoEquilibriumError
from bem.verification.radial_ring import radial_ring

YIELD, SHEAR = 300e6, 80e9
POISSON = 0.3


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


def ring_errors(size: float, slope: float, front: float = 1.5, steps: int = 4, kinematic: bool = False):
    """Relative errors of wall displacement, hoop stress, radial stress, plastic strain (of its largest, at every cell)
    and residual hoop stress, against radial finite elements of 800 layers; the body and its last loaded step."""
    hardening, scale = Hardening.linear(YIELD, slope, kinematic), ring(slope)
    pressure, first = scale.pressure(front), scale.first_pressure
    pressures = first + np.linspace(0, 1, steps + 1)[1:] * (pressure - first)
    *_, loaded, unloaded = radial_ring(
        1.0, 2.0, Elastic.from_shear(SHEAR, POISSON), hardening, np.append(pressures, 0.0)
    )
    body = ring_body(size, hardening)
    for each in pressures:
        done = body.go_to(each)
    moved = np.hypot(*body.displacement(np.array([[1.0 + 1e-9, 0.0]]))[0])
    r, radial, hoop = polar_means(body, body.stress())

    def worst(found: np.ndarray, exact: np.ndarray) -> float:
        return np.abs(found - np.interp(r, loaded.r, exact)).max() / np.abs(exact).max()

    errors = [
        moved / loaded.wall - 1, worst(hoop, loaded.hoop), worst(radial, loaded.radial), worst(done.peeq, loaded.peeq),
    ]  # fmt: skip
    body.go_to(0.0)
    errors.append(worst(polar_means(body, body.stress())[2], unloaded.hoop))
    return np.abs(errors), body, done


def main() -> None:
    print("slope | size | cells | wall, hoop, radial, plastic strain, residual hoop: error [%] | CPU s")
    for slope in (0.0, 20e9):
        for size in (0.14, 0.1, 0.07, 0.05):
            started = time.process_time()
            errors, body, done = ring_errors(size, slope)
            print(
                f"{slope / 1e9:g} GPa | {size:g} | {done.active} of {body.section.cells.count} | "
                + ", ".join(f"{100 * e:.3f}" for e in errors)
                + f" | {time.process_time() - started:.2f} | "
                + " ".join(f"{r:.0e}" for r in done.residuals),
                flush=True,
            )
    for size in (0.14, 0.1, 0.07):
        exact, body = ring(), ring_body(size, Hardening.linear(YIELD))
        body.go_to(0.9 * exact.limit_pressure)
        try:
            body.go_to(1.2 * exact.limit_pressure)
        except NoEquilibriumError as failure:
            print(f"limit load at size {size:g}: {body.load / exact.limit_pressure:.4f} of the exact; {failure}")


if __name__ == "__main__":
    main()
