"""Operations of an element update, counted and not estimated: the kernels' own source runs in Python, uncompiled, on
numbers that count what is done with them.

    NUMBA_DISABLE_JIT=1 python -m tests.fe.kernel_flops

prints one line of JSON: operations per element of each kernel. Additions, subtractions, multiplications, divisions and
roots count one each, comparisons and changes of sign nothing. The compiler may save a few (reassociation, common
factors). `operations_of_kernels` starts this in a process of its own. The benchmark keeps what flows:
rail_fem.studies.benchmark_kernels.OPERATIONS.
"""

from __future__ import annotations

import json
import math
import os
import subprocess
import sys
from collections.abc import Callable
from functools import partial
from types import SimpleNamespace

import numpy as np

LONGEST = 300  # of the job [s]
EDGE, STEP = 1e-3, 1e-7


class Counted:
    """A number that counts the operations on all of its kind."""

    __slots__ = ("value",)
    operations = 0

    def __init__(self, value: float):
        self.value = value

    def __float__(self) -> float:
        return self.value

    def __pow__(self, exponent: int) -> Counted:
        Counted.operations += exponent - 1
        return Counted(self.value**exponent)

    def __neg__(self) -> Counted:
        return Counted(-self.value)


def _operation(of: Callable[[float, float], float]) -> Callable[[Counted, float], Counted]:
    def counted(self: Counted, other: Counted | float) -> Counted:
        Counted.operations += 1
        return Counted(of(self.value, float(other)))

    return counted


def _reversed(of: Callable[[float, float], float]) -> Callable[[float, float], float]:
    return lambda a, b: of(b, a)


def _comparison(of: Callable[[float, float], bool]) -> Callable[[Counted, float], bool]:
    return lambda self, other: of(self.value, float(other))


for _name, _of in {
    "add": lambda a, b: a + b,
    "sub": lambda a, b: a - b,
    "mul": lambda a, b: a * b,
    "truediv": lambda a, b: a / b,
}.items():
    setattr(Counted, f"__{_name}__", _operation(_of))
    setattr(Counted, f"__r{_name}__", _operation(_reversed(_of)))
for _name, _test in {
    "lt": lambda a, b: a < b,
    "le": lambda a, b: a <= b,
    "gt": lambda a, b: a > b,
    "ge": lambda a, b: a >= b,
}.items():
    setattr(Counted, f"__{_name}__", _comparison(_test))


def counted(values: np.ndarray) -> np.ndarray:
    """The same array of counting numbers."""
    out = np.empty(values.shape, object)
    out.ravel()[:] = [Counted(float(value)) for value in values.ravel()]
    return out


def root(value: Counted) -> Counted:
    Counted.operations += 1
    return Counted(math.sqrt(value.value))


def count_in(*modules) -> None:
    """Let kernels of these modules allocate counting arrays and take counting roots."""
    arrays = SimpleNamespace(inf=math.inf, empty=lambda n: counted(np.zeros(n)), zeros=lambda n: counted(np.zeros(n)))
    for module in modules:
        module.np, module.math = arrays, SimpleNamespace(sqrt=root)


def operations_each(strain: float) -> dict[str, float]:
    """Operations per element of one block of slightly irregular cubes whose strain in a step is about `strain`."""
    from geometry.meshing.blocks import mesh_box
    from rail_fem.fe import elastic, finite_strain, hexahedron, hexahedron_full, plasticity, rings
    from rail_fem.fe.blocks import ElementSettings, material_table
    from rail_fem.fe.state import LANES, N_STATE, N_STATE_FULL, POINT_STATE, YIELD
    from rail_fem.scene.steel import GRADES

    rng, table = np.random.default_rng(1), material_table([GRADES["Mn13"]], ElementSettings())
    cube = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]])
    points = EDGE * (cube[None] + rng.uniform(-0.05, 0.05, (LANES, 8, 3)))
    velocity = strain * EDGE / STEP * rng.uniform(-1, 1, points.shape)
    nodes = np.arange(8 * LANES).reshape(LANES, 8).T.ravel()
    filled, kind = np.array([LANES]), np.array([0])
    rows, x, v = counted(table.rows), counted(points.ravel()), counted(velocity.ravel())
    curve = {name: counted(getattr(table, name)) for name in ("curve_strain", "curve_stress")}
    steels = table._replace(rows=rows, **curve)
    count_in(elastic, finite_strain, hexahedron, hexahedron_full, plasticity)
    found = {}

    def count(name: str, action: Callable[[], object]) -> None:
        Counted.operations = 0
        action()
        found[name] = Counted.operations / LANES

    for name, update, entries, stride in (
        ("one-point", hexahedron.update_elements, N_STATE, N_STATE),
        ("full", hexahedron_full.update_full_elements, N_STATE_FULL, POINT_STATE),
    ):
        state = np.zeros((entries, LANES))
        state[YIELD::stride] = table.curve_stress[0]
        state, force, work = counted(state.ravel()), counted(np.zeros(points.size)), counted(np.zeros(3))
        arguments = np.array([0]), nodes, filled, kind, steels, state, np.empty(0), force, work
        count(name, partial(update, x, v, Counted(STEP), *arguments))
    geometry, _ = elastic.fixed_geometry(x, nodes, filled, kind, rows)
    places = nodes // LANES * 3 * LANES + nodes % LANES
    u, force = (counted(np.zeros(3 * LANES * (1 + points.size // (3 * LANES)))) for _ in range(2))
    count("elastic", lambda: elastic.add_elastic_force(u, places, filled, kind, rows, geometry, force))
    box, cells = mesh_box((EDGE, EDGE, 1.0), (1, 1, LANES - 1)), LANES - 1
    radius, angle = 1.0 + box.points[:, 0], EDGE * LANES * box.points[:, 2]
    turned = np.column_stack([radius * np.sin(angle), box.points[:, 1], -radius * np.cos(angle)])
    arc, _ = rings.find_rings(turned, box.cells, np.zeros(cells, int), table.rows, (0.0, 0.0))
    arc = arc._replace(**{name: counted(getattr(arc, name)) for name in ("sections", "arcs", "u", "f")})
    x, still, force = (counted(values) for values in (turned.ravel(), np.zeros(turned.size), np.zeros(turned.size)))
    count_in(rings)

    def ring() -> None:
        rings.take_lines(x, still, still, Counted(STEP), arc)
        rings.add_ring_force(arc)
        rings.give_lines(arc, force)

    count("rings", ring)
    found["rings"] *= LANES / cells
    rings.np = np  # rings are found with all of it
    return found


def operations_of_kernels() -> dict[str, dict[str, float]]:
    """Operations per element: "flowing" and "elastic state", each by kernel. Starts a
    process without compiled kernels. Errors: RuntimeError with its last words."""
    command = [sys.executable, "-m", "tests.fe.kernel_flops"]
    answer = subprocess.run(
        command, capture_output=True, text=True, timeout=LONGEST, env=os.environ | {"NUMBA_DISABLE_JIT": "1"}
    )
    if answer.returncode != 0:
        raise RuntimeError(f"{' '.join(command)} ended with {answer.returncode}: {answer.stderr.strip()[-500:]}")
    return json.loads(answer.stdout.splitlines()[-1])


if __name__ == "__main__":
    print(json.dumps({"flowing": operations_each(2e-2), "elastic state": operations_each(1e-9)}))
