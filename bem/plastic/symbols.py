"""Fields of an eigenstrain in a half-space as polynomials of the partial Fourier space, derived by the machine.

Axes of this room: x, y along the surface, z the depth, positive into the body. In a plane of constant depth d/dx = X
and d/dy = Y with X^2 + Y^2 = -q^2; every field of a point at depth z' is a polynomial in X, Y, 1/q, z, z' times
exp(-q eta), eta = |z - z'| in the full space, times exp(-q (z + z')) in the part that the free surface adds.
A polynomial is a dict {(a, b, c, m, n): coefficient} for X^a Y^b q^c w^m z'^n, w = eta or z, with b = 0 or 1.

Full space: u_i = -G_ij,l P_jl, P = C : strain, G_ij = (delta_ij / R - R_,ij / (4 (1 - nu))) / (4 pi mu).
Surface: its tractions on z = 0 are taken back by (A + z beta (X, Y, -q)) exp(-q z), which satisfies Navier's equation
for beta = A . (X, Y, -q) / (q (3 - 4 nu)).
Source: Mura, Micromechanics of Defects in Solids (1987), section 2 and 11 (the method); all terms derived here and held
to Mindlin's solution by quadrature (tests/bem/plastic/test_cuboid.py).
"""

from __future__ import annotations

import functools

import numpy as np

from bem.material import Elastic
from bem.plastic.corners import COUNT, NUMBER

Polynomial = dict[tuple[int, int, int, int, int], float]

PAIRS = ((0, 0), (1, 1), (2, 2), (1, 2), (0, 2), (0, 1))  # VOIGT: xx yy zz yz xz xy


def _add(*terms: Polynomial) -> Polynomial:
    total: Polynomial = {}
    for term in terms:
        for key, value in term.items():
            total[key] = total.get(key, 0.0) + value
    return {key: value for key, value in total.items() if abs(value) > 1e-14}


def _times(term: Polynomial, factor: float, shift: tuple[int, int, int, int, int] = (0, 0, 0, 0, 0)) -> Polynomial:
    """A factor times a monomial; Y^2 is replaced by -q^2 - X^2."""
    moved: Polynomial = {}
    for key, value in term.items():
        for new, part in _canonical(tuple(k + s for k, s in zip(key, shift))):
            moved[new] = moved.get(new, 0.0) + factor * value * part
    return _add(moved)


def _canonical(key: tuple) -> list[tuple[tuple, float]]:
    a, b, c, m, n = key
    if b < 2:
        return [(key, 1.0)]
    lower = _canonical((a, b - 2, c + 2, m, n)) + _canonical((a + 2, b - 2, c, m, n))
    return [(new, -value) for new, value in lower]


_X, _Y, _Q, _W = (1, 0, 0, 0, 0), (0, 1, 0, 0, 0), (0, 0, 1, 0, 0), (0, 0, 0, 1, 0)


def _derivative(term: Polynomial, axis: int, side: int) -> Polynomial:
    """d/dx, d/dy, or d/dz of term exp(-q w), w growing with z (side 1) or falling (-1)."""
    if axis < 2:
        return _times(term, 1.0, (_X, _Y)[axis])
    falling = _times(term, -1.0, _Q)
    power = {(a, b, c, m - 1, n): m * value for (a, b, c, m, n), value in term.items() if m}
    return _times(_add(falling, power), float(side))


def _strain_source(component: int, poisson: float) -> dict[tuple[int, int], float]:
    """P_jl / mu of a unit tensor component of the eigenstrain."""
    j, l = PAIRS[component]
    source = {(j, l): 2.0, (l, j): 2.0}
    if j == l:
        for k in range(3):
            source[k, k] = source.get((k, k), 0.0) + 2 * poisson / (1 - 2 * poisson)
    return source


def _green(poisson: float, side: int) -> list[list[Polynomial]]:
    """mu G_ij of the full space."""
    radius = {(0, 0, -3, 0, 0): 1.0, (0, 0, -2, 1, 0): 1.0}
    kappa = 1 / (8 * (1 - poisson))
    green = [[_times(_derivative(_derivative(radius, i, side), j, side), kappa) for j in range(3)] for i in range(3)]
    for i in range(3):
        green[i][i] = _add(green[i][i], {(0, 0, -1, 0, 0): 0.5})
    return green


def _full_displacement(component: int, poisson: float, side: int) -> list[Polynomial]:
    green, source = _green(poisson, side), _strain_source(component, poisson)
    return [
        _add(*(_times(_derivative(green[i][j], l, side), -value) for (j, l), value in source.items())) for i in range(3)
    ]


def _stress(displacement: list[Polynomial], poisson: float, side: int) -> list[Polynomial]:
    """Stress over mu, order VOIGT."""
    slope = [[_derivative(displacement[i], j, side) for j in range(3)] for i in range(3)]
    volume = _times(_add(*(slope[k][k] for k in range(3))), 2 * poisson / (1 - 2 * poisson))
    return [_add(slope[i][j], slope[j][i], volume if i == j else {}) for i, j in PAIRS]


def _surface_displacement(component: int, poisson: float) -> list[Polynomial]:
    """What the free surface adds: w is now z, the source's depth z' counts in n."""
    stress = _stress(_full_displacement(component, poisson, -1), poisson, -1)
    traction = [
        _times({(a, b, c, 0, m): value for (a, b, c, m, _), value in stress[k].items()}, -1.0) for k in (4, 3, 2)
    ]
    along = _times(_add(_times(traction[0], 1.0, _X), _times(traction[1], 1.0, _Y)), 1.0, (0, 0, -2, 0, 0))
    normal = _times(traction[2], 1.0, (0, 0, -1, 0, 0))
    beta = _add(_times(normal, 0.5), _times(along, -0.5))
    sink = _add(_times(normal, -0.5), _times(beta, -(1 - 2 * poisson)))
    both = _add(beta, sink)
    even = [
        _times(_add(_times(both, 1.0, step), _times(traction[k], -1.0)), 1.0, (0, 0, -1, 0, 0))
        for k, step in enumerate((_X, _Y))
    ] + [sink]
    growing = [_times(_times(beta, sign, step), 1.0, _W) for sign, step in ((1.0, _X), (1.0, _Y), (-1.0, _Q))]
    return [_add(even[k], growing[k]) for k in range(3)]


def _over_depth(term: Polynomial, power: int) -> Polynomial:
    """Antiderivative, sign reversed, over eta (power 3 of the key) or z' (4): the field of a layer is its value at the
    layer's nearer face less that at the farther one."""
    parts = []
    for key, value in term.items():
        a, b, c, m, n = key
        one = {(a, b, c - 1, m, n): value}
        if key[power]:
            lower = (a, b, c - 2, m - (power == 3), n - (power == 4))
            one = _add(one, {lower: value})
        parts.append(one)
    return _add(*parts)


def _corner_form(term: Polynomial) -> Polynomial:
    """Divided by X Y (integrated over x and y), in the monomials that bem.plastic.corners knows."""
    parts = []
    for (a, b, c, m, n), value in term.items():
        a, b = a - 1, b - 1
        if b == -1 and a >= 2:
            parts += [{(a - 2, -1, c + 2, m, n): -value}, {(a - 2, 1, c, m, n): -value}]
        else:
            parts.append({(a, b, c, m, n): value})
    return _add(*parts)


@functools.lru_cache(maxsize=16)
def layer_polynomials(poisson: float) -> dict[str, list[list[Polynomial]]]:
    """Fields [of component][by eigenstrain component] of a quarter-infinite layer, at its corner.

    "full stress", "full displacement" : powers of eta; for z > z'. Below the source a component with an odd number of
        indices z (field and eigenstrain together) changes its sign.
    "surface stress", "surface displacement" : powers of z and z'
    "full layer stress", "surface layer stress" : the same integrated over the observer's depth once more, sign
        reversed, for the mean over a layer
    Stresses over mu. Multiply by 1 / (2 pi); add what `facing_layers` says inside.
    """
    tables: dict[str, list[list[Polynomial]]] = {}
    for part in ("full", "surface"):
        fields = [
            _full_displacement(k, poisson, 1) if part == "full" else _surface_displacement(k, poisson) for k in range(6)
        ]
        depth = 3 if part == "full" else 4
        form = lambda term: _corner_form(_over_depth(term, depth))
        stresses = [_stress(field, poisson, 1) for field in fields]
        tables[f"{part} displacement"] = [[form(fields[k][i]) for k in range(6)] for i in range(3)]
        tables[f"{part} stress"] = [[form(stresses[k][i]) for k in range(6)] for i in range(6)]
        twice = lambda term: _corner_form(_over_depth(_over_depth(term, depth), 3))
        tables[f"{part} layer stress"] = [[twice(stresses[k][i]) for k in range(6)] for i in range(6)]
    return tables


@functools.lru_cache(maxsize=16)
def coefficient_tables(poisson: float) -> dict[str, np.ndarray]:
    """Of each field of `layer_polynomials`: (components, 6, 36, 2, 2) factors of corner function, power of eta or z,
    power of z'."""
    tables = {}
    for name, rows in layer_polynomials(poisson).items():
        table = np.zeros((len(rows), 6, COUNT, 2, 2))
        for i, row in enumerate(rows):
            for k, term in enumerate(row):
                for (a, b, c, m, n), value in term.items():
                    table[i, k, NUMBER[a, b, c], m, n] += value
        tables[name] = table / (2 * np.pi)
    return tables


def facing_layers(strain: np.ndarray, elastic: Elastic) -> np.ndarray:
    """(6,) what the stress inside a uniform layer has more than that in a thin slit of the same layer [Pa]: in the
    plane the eigenstrain stretches the layer alone, tractions on its faces are continuous."""
    xx, yy, xy = strain[0], strain[1], strain[5]
    nu, modulus = elastic.poisson, elastic.plane_modulus
    return -modulus * np.array([xx + nu * yy, yy + nu * xx, 0.0, 0.0, 0.0, (1 - nu) * xy])


def depth_parity(field: tuple[int, ...], component: int) -> int:
    """+1 or -1: what a full-space field does when the observer goes to the other side of the source."""
    return (-1) ** sum(index == 2 for index in (*field, *PAIRS[component]))
