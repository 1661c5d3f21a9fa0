"""A bar held at one end and loaded at the other, against d'Alembert's solution.

With Poisson's ratio zero a plane-strain bar with free sides carries plane waves of the speed sqrt(E / rho), without
dispersion, and the tip moves by

    u(t) = c / E [P(t) - 2 P(t - 2 L/c) + 2 P(t - 4 L/c) - ...],        P(t) the integral of the traction
"""

from collections.abc import Callable

import numpy as np

from bem.dynamic.body import DynamicBody, Inertial
from bem.dynamic.cells import fill_with_cells
from bem.material import Elastic
from bem.plane.body import Body
from bem.plane.boundary import cell_resultants
from bem.plane.mesh import Sizing, mesh_outline
from bem.plane.outline import Edge, Outline

LENGTH, HEIGHT = 1.0, 0.25  # of the bar [m]; modulus, density and so the wave speed are 1
MATERIAL = Elastic(1.0, 0.0)


def box(width: float, height: float, held: str = "left", face: str = "right") -> Outline:
    """A rectangle with the lower left corner at the origin and edges named left, right, top, bottom; two of them
    renamed "held" and "face"."""
    corners = np.array([[0, 0], [width, 0], [width, height], [0, height]], float)
    names = ["bottom", "right", "top", "left"]
    renamed = {held: "held", face: "face"}
    ends = np.roll(corners, -1, axis=0)
    return Outline([[Edge(np.array([a, b]), renamed.get(name, name)) for a, b, name in zip(corners, ends, names)]])


def edge_pattern(mesh, name: str, traction: tuple[float, float]) -> np.ndarray:
    """Forces (2n, 1) on the cells of a mesh of a uniform traction [Pa] on an edge."""
    chosen = np.flatnonzero(mesh.names == name)
    parts = [cell_resultants(mesh, chosen, lambda points, normals, value=value: value) for value in traction]
    return np.concatenate(parts)[:, None]


def bar(cells: int, boundary: float = 1.0, height: float = HEIGHT) -> DynamicBody:
    """The bar with so many cells over its height [m], boundary elements `boundary` times their side; its one pattern is
    a unit pull."""
    outline, size = box(LENGTH, height), height / cells
    mesh = mesh_outline(outline, Sizing(size * boundary))
    solid = Inertial(Body(outline, MATERIAL), mesh, fill_with_cells(mesh, Sizing(size)), 1.0)
    return DynamicBody(solid, edge_pattern(mesh, "face", (1.0, 0.0)))


def tip_displacement(time: np.ndarray, impulse: Callable[[np.ndarray], np.ndarray]) -> np.ndarray:
    """Exact displacement of the tip at times; impulse : time -> integral of the traction since the beginning."""
    time = np.asarray(time, float)
    moved = impulse(time)
    for k in range(1, int(time.max() / (2 * LENGTH)) + 1):
        late = time - 2 * LENGTH * k
        moved = moved + 2 * (-1) ** k * np.where(late > 0, impulse(np.maximum(late, 0.0)), 0.0)
    return moved


def pulse(duration: float) -> tuple[Callable, Callable]:
    """A pull sin^2 over `duration` and its impulse, both of time."""

    def pull(t):
        return np.where(np.asarray(t) < duration, np.sin(np.pi * np.asarray(t) / duration) ** 2, 0.0)

    def impulse(t):
        t = np.minimum(t, duration)
        return t / 2 - duration / (4 * np.pi) * np.sin(2 * np.pi * t / duration)

    return pull, impulse
