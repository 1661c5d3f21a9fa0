"""Plane elastodynamics against exact solutions, with observed orders: rail-fem study verification --only waves.

bar    : held at one end, a step load at the other, twenty periods (bem.verification.bar), by inertia in cells
cavity : a circular hole in the infinite plane under a step pressure, by convolution quadrature, no cells
Lamb   : a pulse of normal line load on a half-plane, by convolution quadrature; the surface beside it while the
         dilatational, the shear and the Rayleigh wave pass

Errors are largest ones over the time shown, of the largest displacement in it; the bar's also as root mean squares.
Sources: the cavity's transform is a textbook's (Achenbach, Wave Propagation in Elastic Solids (1973), section 4.4, from
memory; it meets Navier's equation and its boundary condition, `cavity_transform`); Lamb, Phil. Trans. A 203 (1904) 1,
from memory: derived here by Cagniard's method and held to Flamant's solution at rest and to the wave equation's
transform (tests/bem/dynamic/test_waves.py).
"""

from collections.abc import Callable, Sequence
from functools import cached_property
from typing import NamedTuple

import numpy as np
from scipy.integrate import quad
from scipy.optimize import brentq
from scipy.special import kve

from bem.dynamic.body import Waves
from bem.dynamic.convolution import Conditions, LaplaceBody, convolve, transfer
from bem.dynamic.marching import March, respond
from bem.dynamic.schemes import TRAPEZOIDAL
from bem.material import Elastic
from bem.plane.curve import arc
from bem.plane.mesh import Sizing, mesh_outline
from bem.plane.outline import Edge, Outline
from bem.verification.bar import LENGTH, bar, pulse, tip_displacement

ROCK = Elastic.from_shear(1.0, 0.25)  # of density 1: the shear wave's speed is 1, the dilatational one's sqrt(3)
PERIODS = 20
PULSE = 1.5  # duration of Lamb's load [s]
STATION, UNTIL = 1.0, 2.7  # distance from the load [m] and time [s] up to which it is watched


class BarErrors(NamedTuple):
    """Of the tip over the largest displacement: root mean square in the first and in the last period, largest in the
    last; energy beyond the work done, largest, over the largest energy."""

    first: float
    last: float
    largest: float
    energy: float


def bar_errors(cells: int) -> BarErrors:
    """A thin bar (a sixteenth as high as long) with so many cells over its height, steps of h / (2 c)."""
    height = LENGTH / 16
    body = bar(cells, height=height)
    per_period = round(8 * LENGTH * cells / height)
    history = respond(March(body, 4 * LENGTH / per_period, TRAPEZOIDAL), lambda t: [1.0], PERIODS * per_period)
    exact = tip_displacement(history.time, lambda t: t)
    off = (history.q[:, 0] / height - exact) / exact.max()
    mean = lambda part: float(np.sqrt(np.mean(part**2)))
    return BarErrors(
        mean(off[:per_period]), mean(off[-per_period:]), float(np.abs(off[-per_period:]).max()),
        float(np.abs(history.imbalance).max()),
    )  # fmt: skip


def cavity(elements: int) -> LaplaceBody:
    """The plane of ROCK around a circular hole of radius 1."""
    circle = Outline([[Edge(arc((0, 0), 1.0, 0, 2 * np.pi, 721))]], infinite=True)
    return LaplaceBody(mesh_outline(circle, Sizing(2 * np.pi / elements)), ROCK, 1.0)


def cavity_pressure(body: LaplaceBody) -> Conditions:
    """A unit pressure on the whole boundary."""
    mesh = body.mesh
    force = -mesh.normals * mesh.cell_length[:, None]
    return Conditions(np.zeros((mesh.densities, 2), bool), force.T.reshape(-1, 1))


def cavity_transform(s: complex, r: float) -> complex:
    """Radial displacement around a cavity of radius 1 in ROCK under a unit pressure: u = B K1(k r), with the radial
    stress (lambda + 2 G) u' + lambda u / r = -1 at r = 1."""
    stiff = ROCK.shear * 2 * (1 - ROCK.poisson) / (1 - 2 * ROCK.poisson)
    k, lame = s / np.sqrt(stiff), stiff - 2 * ROCK.shear
    slope = -k * kve(0, k) - kve(1, k)  # d/dr K1(k r) at r = 1; every function times exp of its argument
    return -kve(1, k * r) * np.exp(k * (1 - r)) / (stiff * slope + lame * kve(1, k))


def talbot(transform: Callable[[complex], complex], moment: float) -> float:
    """Inverse Laplace transform at a time by Talbot's contour (Abate and Valko 2004, from memory)."""
    nodes = 24
    theta = np.arange(1, nodes) * np.pi / nodes
    r = 2 * nodes / (5 * moment)
    cot = 1 / np.tan(theta)
    s = r * theta * (cot + 1j)
    sigma = theta + (theta * cot - 1) * cot
    total = 0.5 * np.exp(r * moment) * transform(r) + sum(
        (np.exp(moment * s) * np.array([transform(each) for each in s]) * (1 + 1j * sigma)).tolist()
    )
    return float((r / nodes * total).real)


class CavityErrors(NamedTuple):
    """Over the largest value: of the wall's displacement at any time, and of displacement and hoop stress there from
    one radius over the dilatational speed on. The load's jump makes the first steps wrong by a third of a step."""

    ever: float
    later: float
    hoop: float


def cavity_errors(elements: int, step: float, until: float = 8.0) -> CavityErrors:
    """A step pressure in a cavity, followed up to a time [s]."""
    body, count = cavity(elements), round(until / step)
    point = np.array([[1.0 + 1e-9, 0.0]])
    followed = lambda s: transfer(body, cavity_pressure(body), s, point)
    answer = convolve(followed, np.ones((count, 1)), step, "BDF2")[:, 0]
    moment = step * np.arange(1, count + 1)
    exact = np.array([talbot(lambda s: cavity_transform(s, 1.0) / s, t) for t in moment])
    later = moment * body.waves.dilatational >= 1.0
    nu = ROCK.poisson
    hoop = 2 * ROCK.shear / (1 - nu) * exact - nu / (1 - nu)  # of the hoop strain u and a radial stress of -1
    off = np.abs(answer - exact)
    return CavityErrors(
        float(off.max() / exact.max()), float(off[later].max() / exact.max()),
        float(2 * ROCK.shear / (1 - nu) * off[later].max() / np.abs(hoop).max()),
    )  # fmt: skip


class LambPulse:
    """Vertical displacement of the surface of a half-plane under a line force sin^2 (pi t / T) [N/m], t < T.

    With the slowness q = t / x the response to an impulse at the distance x is -Im g(i q + 0) / (pi G x),
        g(p) = a / c2^2 / [(2 p^2 + 1 / c2^2)^2 - 4 p^2 a b],    a, b = sqrt(p^2 + 1 / c1^2), sqrt(p^2 + 1 / c2^2)
    with a pole at Rayleigh's slowness, in whose neighbourhood the principal value holds.
    """

    def __init__(self, material: Elastic, density: float) -> None:
        self.material, self.waves, self.pull = material, Waves.of(material, density), pulse(PULSE)[0]

    def _parts(self, q: float) -> tuple[complex, complex]:
        """Numerator and denominator of g(i q + 0)."""
        one, two = self.waves.dilatational**-2, self.waves.shear**-2
        a, b = (np.sqrt(complex(square - q**2, 1e-300)) for square in (one, two))
        return two * a, (two - 2 * q**2) ** 2 + 4 * q**2 * a * b

    @cached_property
    def rayleigh(self) -> float:
        """Speed of the Rayleigh wave [m/s]."""
        slow = 1 / self.waves.shear
        return 1 / brentq(lambda q: self._parts(q)[1].real, slow * (1 + 1e-9), slow * 2, xtol=1e-15)

    def impulse_response(self, x: float, moment: float) -> float:
        """Displacement [m] at a distance x [m] into the body per impulse of 1 N s/m along it."""
        over, under = self._parts(moment / x)
        return -(over / under).imag / (np.pi * self.material.shear * x)

    def displacement(self, x: float, moment: float) -> float:
        """Displacement [m] at a distance x > 0 [m] and a time [s] into the body."""
        begin = max(x / self.waves.dilatational, moment - PULSE)
        second, pole = x / self.waves.shear, x / self.rayleigh
        near, far = (second + pole) / 2, 2 * pole - (second + pole) / 2  # the pole lies in the middle
        value = lambda tau: float(self.pull(moment - tau)) * self.impulse_response(x, tau)
        total = 0.0
        for low, high in ((0.0, second), (second, near), (far, np.inf)):
            low, high = max(low, begin), min(high, moment)
            if high > low:
                total += quad(value, low, high, limit=200)[0]
        low, high = max(near, begin), min(far, moment)
        if high > low:
            total += quad(lambda tau: value(tau) * (tau - pole), low, high, weight="cauchy", wvar=pole)[0]
        return total

    def strip(self, x: float, width: float, moment: float) -> float:
        """The same where the force is spread evenly over a width [m]."""
        points, weights = np.polynomial.legendre.leggauss(4)
        return float(sum(w / 2 * self.displacement(x + width / 2 * p, moment) for p, w in zip(points, weights)))


def half_plane(size: float) -> LaplaceBody:
    """The plane below a long flat hole: until a wave has come to the hole's end and back, a half-plane. Elements of
    `size` [m] along it, four times as long around its other sides."""
    waves = Waves.of(ROCK, 1.0)
    reach, high = (waves.dilatational * UNTIL + STATION) / 2 + 0.1, 0.8
    corners = np.array([[-reach, 0], [reach, 0], [reach, high], [-reach, high]])
    names = ("surface", "end", "back", "end")
    edges = [Edge(np.array([a, b]), name) for a, b, name in zip(corners, np.roll(corners, -1, axis=0), names)]
    grown = lambda points: np.minimum(size + 0.3 * points[:, 1], 4 * size)
    return LaplaceBody(mesh_outline(Outline([edges], infinite=True), grown), ROCK, 1.0)


class LambRun(NamedTuple):
    """Times [s], displacement into the body found and exact [m] (k,); largest error over the largest displacement."""

    moment: np.ndarray
    found: np.ndarray
    exact: np.ndarray

    @property
    def error(self) -> float:
        """Largest error over the largest exact value."""
        return float(np.abs(self.found - self.exact).max() / np.abs(self.exact).max())


def lamb_run(size: float, step: float) -> LambRun:
    """A pulse of force on one cell of the surface, watched at the cell nearest to STATION from it."""
    body, lamb = half_plane(size), LambPulse(ROCK, 1.0)
    mesh = body.mesh
    surface = mesh.of_edge("surface")
    loaded, watched = (surface[np.argmin(np.abs(mesh.middles[surface, 0] - x))] for x in (0.0, STATION))
    forces = np.zeros((2 * mesh.densities, 1))
    forces[mesh.densities + loaded] = -1.0
    conditions = Conditions(np.zeros((mesh.densities, 2), bool), forces)
    point = mesh.middles[[watched]] - [[0.0, 1e-9]]
    moment = step * np.arange(1, round(UNTIL / step) + 1)
    answer = convolve(lambda s: transfer(body, conditions, s, point), lamb.pull(moment)[:, None], step, "trapezoidal")
    distance, width = float(point[0, 0] - mesh.middles[loaded, 0]), float(mesh.cell_length[loaded])
    exact = np.array([lamb.strip(distance, width, t) for t in moment])
    return LambRun(moment, -answer[:, 1], exact)


def order_rows(what: str, sizes: Sequence[tuple], errors_of: Callable, quantities: Sequence[str]) -> list[list[str]]:
    """Errors over sizes (coarse to fine) with the orders of neighbours: rows of what, of which quantity, size, error,
    order."""
    errors = np.array([np.atleast_1d(errors_of(*size))[: len(quantities)] for size in sizes])
    steps = np.log([size[0] for size in sizes])
    orders = np.diff(np.log(errors), axis=0) / np.diff(steps)[:, None]
    told = lambda column, factor, style: ", ".join(f"{factor * value:{style}}" for value in column)
    return [
        [what, name, told(np.exp(steps), 1, ".4g"), told(errors[:, k], 100, ".2f"), told(orders[:, k], 1, ".1f")]
        for k, name in enumerate(quantities)
    ]


WAVE_HEAD = ["waves", "error of", "size", "error [%] at each", "order between them"]


def wave_rows(few: int = 4) -> list[list[str]]:
    """Bar, cavity and Lamb's problem at so many sizes."""
    bars = [(1 / 16 / cells, cells) for cells in (1, 2, 4)][:few]
    of_bar = "rms of the first period", "of the last", "largest of the last", "energy"
    of_cavity = "displacement at any time", "from t = R / c1 on", "hoop stress"
    return [
        *order_rows(f"bar, {PERIODS} periods", bars, lambda size, cells: bar_errors(cells), of_bar),
        *order_rows(
            "cavity, step pressure, 24 elements", [(h,) for h in (0.2, 0.1, 0.05, 0.025)][:few],
            lambda step: cavity_errors(24, step), of_cavity,
        ),
        *order_rows(
            "Lamb's line load, steps of half an element", [(h,) for h in (0.4, 0.2, 0.1)][:few],
            lambda size: lamb_run(size, size / 2).error, ("surface displacement",),
        ),
    ]  # fmt: skip
