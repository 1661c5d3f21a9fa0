"""Plane problems with an exact solution, and the boundary elements' error in each at a given fineness.

Closed bodies under given tractions (ring, Kirsch, Flamant): errors one element off the boundary. Contacts (Hertz,
Persson's pin, Cattaneo, Carter, Spence): errors of peak, profile, stick. bem/verification/orders.py tabulates all with
their observed orders; the tests hold them.
"""

import numpy as np

from bem.exact.conformal import pin_clearance, pin_pressure
from bem.exact.hertz import line_contact_of_width
from bem.exact.tangential import (
    carter_creepage,
    cattaneo_line_shear,
    cattaneo_line_stick,
    dundurs_beta,
    spence_line_stick,
)
from bem.material import STEEL, Elastic, contact_modulus
from bem.plane.body import Body
from bem.plane.boundary import BoundaryProblem, BoundarySolution, Condition, cell_resultants, solve_boundary
from bem.plane.contact import Settings, solve_contact
from bem.plane.contact_result import ContactResult
from bem.plane.coulomb import STICK, Control
from bem.plane.curve import arc
from bem.plane.internal import displacement_at, stress_at
from bem.plane.mesh import Sizing, Zone, mesh_outline
from bem.plane.outline import Edge, Outline
from bem.plane.rolling import solve_rolling

# of VERIFICATION's line contact: 178.896 N/mm and 113.889 MPa at a half-width of 1 mm
SOFT_STEEL = Elastic.from_shear(82e9, 0.28)
HALF_WIDTH, DISC_RADIUS = 1e-3, 1.0  # of the line contacts [m]; the relative radius is half the discs'
# [m]; Persson takes both radii as one: an error of clearance over radius, 4e-5
PIN_RADIUS, PIN_CLEARANCE = 0.05, 2e-6
FRICTION = 0.3
# for Spence: Dundurs' beta 0.069 leaves 0.5 % between theory and coupled solution
UNLIKE = Elastic(210e9, 0.3), Elastic(210e9, 0.4)


def polar(stress: np.ndarray, angle: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Radial, hoop and shear stress of stress (m, 3) xx, yy, xy at polar angles [rad]."""
    c, s = np.cos(angle), np.sin(angle)
    xx, yy, xy = stress.T
    radial = xx * c**2 + yy * s**2 + 2 * xy * c * s
    return radial, xx + yy - radial, (yy - xx) * c * s + xy * (c**2 - s**2)


def ring() -> Outline:
    """A thick ring of radii 1 and 2 m, edges "inner" and "outer"."""
    return Outline([[Edge(arc((0, 0), 2, 0, 2 * np.pi), "outer")], [Edge(arc((0, 0), 1, 0, 2 * np.pi), "inner")]])


def ring_errors(size: float) -> tuple[float, float]:
    """Ring under inner pressure (Lame): error of stress one element off both walls over the largest stress, of radial
    displacement."""
    solution = solve_boundary(
        mesh_outline(ring(), Sizing(size)), STEEL, {"inner": Condition(traction=(-1e6, None), local=True)}
    )
    r, angle = np.array([1 + size, 1.5, 2 - size]), 0.3
    points = np.column_stack([r * np.cos(angle), r * np.sin(angle)])
    radial, hoop, shear = polar(stress_at(solution, points), angle)
    level = 1e6 / 3
    u = displacement_at(solution, points) @ [np.cos(angle), np.sin(angle)]
    exact_u = 1.3 / 210e9 * level * (0.4 * r + 4 / r)
    worst = np.abs(np.r_[radial - level * (1 - 4 / r**2), hoop - level * (1 + 4 / r**2), shear]).max() / (5 * level)
    return float(worst), float(np.abs(u / exact_u - 1).max())


def kirsch_error(size: float) -> float:
    """Hole of 1 m under remote tension: error of stress one element off it, over the largest stress."""
    outline = Outline([[Edge(arc((0, 0), 1, 0, 2 * np.pi), "hole")]], infinite=True)
    load = Condition(traction=(lambda points, normals: -1e6 * normals[:, 0], None))
    solution = solve_boundary(mesh_outline(outline, Sizing(size)), STEEL, {"hole": load})
    angle, r = np.linspace(0, np.pi / 2, 19), 1 + size
    # plus the remote tension
    stress = stress_at(solution, np.column_stack([r * np.cos(angle), r * np.sin(angle)])) + [1e6, 0, 0]
    q, double = 1 / r**2, np.cos(2 * angle)
    exact = (
        0.5e6 * (1 - q + (1 - 4 * q + 3 * q**2) * double),
        0.5e6 * (1 + q - (1 + 3 * q**2) * double),
        -0.5e6 * (1 + 2 * q - 3 * q**2) * np.sin(2 * angle),
    )
    return float(max(np.abs(a - b).max() for a, b in zip(polar(stress, angle), exact)) / 3e6)


def flamant_stress(points: np.ndarray, force: float = 1e6) -> np.ndarray:
    """Stress (m, 3) [Pa] at points (m, 2), y up, below a force [N/m] pressing on a half-plane at the origin."""
    x, depth = points[:, 0], -points[:, 1]
    factor = -2 * force / (np.pi * (x**2 + depth**2) ** 2)
    return np.column_stack([factor * x**2 * depth, factor * depth**3, -factor * x * depth**2])


def flamant_error(size: float) -> float:
    """A box of half-plane whose other sides carry Flamant's tractions, the force given to the cell beneath it: error of
    stress one element below the surface and across the box, over the largest there."""
    corners, top = np.array([[1, 0], [-1, 0], [-1, -1], [1, -1.0]]), np.array([[1, 0], [0, 0], [-1, 0.0]])
    sides = [corners[1:3], corners[2:4], corners[[3, 0]]]
    edges = [Edge(side, "top") for side in (top[:2], top[1:])] + [Edge(side, "remainder") for side in sides]
    outline = Outline([edges])
    mesh = mesh_outline(outline, Sizing(size, [Zone(corners, size / 10)], growth=0.4))

    def traction(of_x: int, of_y: int):
        def value(points, normals):
            stress = flamant_stress(points)
            return stress[:, of_x] * normals[:, 0] + stress[:, of_y] * normals[:, 1]

        return value

    n, element = mesh.densities, np.flatnonzero(mesh.names == "remainder")
    problem = BoundaryProblem(mesh, STEEL, np.zeros((n, 2), bool), np.zeros(n, bool))
    force = np.r_[cell_resultants(mesh, element, traction(0, 2)), cell_resultants(mesh, element, traction(2, 1))]
    (under,) = np.flatnonzero(np.hypot(*mesh.positions().T) < 1e-9)
    force[n + under] -= 1e6
    density, shift = problem.solve(force[:, None], np.zeros((2 * n, 1)))
    solution = BoundarySolution(mesh, STEEL, density[:, 0].reshape(2, n).T, shift[:, 0])
    x = np.linspace(-0.8, 0.8, 33)
    beside = x[np.abs(x) > 0.25]
    points = np.vstack(
        [np.column_stack([x, np.full_like(x, -0.4)]), np.column_stack([beside, np.full_like(beside, -size)])]
    )
    exact = flamant_stress(points)
    return float(np.abs(stress_at(solution, points) - exact).max() / np.abs(exact).max())


def disc(center: tuple[float, float], radius: float, material: Elastic, top: bool = True, points: int = 1441) -> Body:
    """Disc on a hub at its centre; its boundary begins at the top or at the bottom, opposite to the contact."""
    begin = np.pi / 2 if top else -np.pi / 2
    edge = Edge(arc(center, radius, begin, begin + 2 * np.pi, points), "face")
    return Body(Outline([[edge]]), material, hub=(center[0], center[1]))


def two_discs(radius: float, lower: Elastic, upper: Elastic) -> tuple[Body, Body]:
    """Two equal discs that touch at the origin, the fixed one below: relative radius radius / 2.

    Their stresses differ from half-planes' by the order of P / (pi R), 1/2000 of p0 at a half-width of R / 1000.
    """
    return disc((0.0, -radius), radius, lower, top=False), disc((0.0, radius), radius, upper)


def pin_and_hole(radius: float, clearance: float, material: Elastic) -> tuple[Body, Body]:
    """A pin, loaded at its centre, in a hole of an infinite plate."""
    hole = Body(Outline([[Edge(arc((0, 0), radius, np.pi / 2, 2.5 * np.pi, 721), "face")]], infinite=True), material)
    return hole, disc((0.0, 0.0), radius - clearance, material, points=721)


def _profile_error(result: ContactResult, found: np.ndarray, exact: np.ndarray) -> float:
    mass = result.interface.mass
    return float(np.sqrt(np.sum(mass * (found - exact) ** 2) / np.sum(mass * exact**2)))


def hertz_errors(cells: float) -> tuple[float, float]:
    """Line contact of two discs with `cells` elements to the half contact: error of largest pressure, and of the
    profile in L2."""
    hertz = line_contact_of_width(HALF_WIDTH, DISC_RADIUS / 2, contact_modulus(SOFT_STEEL, SOFT_STEEL))
    bodies = two_discs(DISC_RADIUS, SOFT_STEEL, SOFT_STEEL)
    result = solve_contact(*bodies, Control.of(force=(None, -hertz.force)), settings=Settings(size=HALF_WIDTH / cells))
    pressure = result.last.pressure
    return (
        abs(pressure.max() / hertz.max_pressure - 1),
        _profile_error(result, pressure, hertz.pressure(result.interface.points[:, 0])),
    )


def pin_errors(cells: float, semi_angle: float) -> tuple[float, float]:
    """Pin in a hole, contact over +- semi_angle [rad], `cells` elements to the half contact: errors of largest pressure
    and profile."""
    load = contact_modulus(STEEL, STEEL) * PIN_CLEARANCE / pin_clearance(semi_angle)
    settings = Settings(size=PIN_RADIUS * semi_angle / cells, coarse=0.25)
    result = solve_contact(
        *pin_and_hole(PIN_RADIUS, PIN_CLEARANCE, STEEL), Control.of(force=(None, -load)), settings=settings
    )
    points, pressure = result.interface.points, result.last.pressure * PIN_RADIUS / load
    exact = pin_pressure(np.arctan2(points[:, 0], -points[:, 1]), semi_angle)
    return abs(pressure.max() / pin_pressure(0.0, semi_angle) - 1), _profile_error(result, pressure, exact)


def pressed_discs(cells: float, shares: list[float]) -> tuple[ContactResult, float, float]:
    """Discs pressed by the Hertz load, then pushed along x by shares of the friction limit; the limit [N/m] and mu p0
    [Pa]."""
    hertz = line_contact_of_width(HALF_WIDTH, DISC_RADIUS / 2, contact_modulus(SOFT_STEEL, SOFT_STEEL))
    limit = FRICTION * hertz.force
    controls = [Control.of(force=(share * limit, -hertz.force)) for share in shares]
    result = solve_contact(
        *two_discs(DISC_RADIUS, SOFT_STEEL, SOFT_STEEL), controls, FRICTION, Settings(size=HALF_WIDTH / cells)
    )
    return result, limit, FRICTION * hertz.max_pressure


def cattaneo_errors(cells: float, share: float = 0.75) -> tuple[float, float]:
    """Partial slip under a share of the friction limit: error of the stick width over the half-width, and of the shear
    in L2."""
    result, limit, level = pressed_discs(cells, [0.0, share])
    stick = cattaneo_line_stick(share * limit, limit)
    ((begin, end),) = result.stick_zones()
    exact = -cattaneo_line_shear(result.interface.points[:, 0], HALF_WIDTH, level, stick)
    return abs(abs(end[0] - begin[0]) / 2 / HALF_WIDTH - stick), _profile_error(result, result.last.shear, exact)


def carter_errors(cells: float, share: float = 0.64) -> tuple[float, float]:
    """Steady rolling at the creepage of a share of the friction limit: error of the force over that share, and of the
    stick half-width over the half-width."""
    result, limit, _ = pressed_discs(cells, [0.0])
    state, _ = solve_rolling(result, FRICTION, creepage=carter_creepage(share, HALF_WIDTH, DISC_RADIUS / 2, FRICTION))
    force = (result.system.forces @ np.r_[state.pressure, state.shear])[0] / limit
    stuck = np.sum(result.interface.mass[state.state == STICK])
    return abs(force / share - 1), abs(stuck / (2 * HALF_WIDTH) - np.sqrt(1 - share))


def spence_friction() -> float:
    """Friction at which half of the contact of UNLIKE bodies sticks: K'(c)/K(c) = beta / mu is 1.27924 at c = 1/2."""
    return dundurs_beta(*UNLIKE) / 1.27924


def spence_ratios(cells: float, steps: int) -> np.ndarray:
    """Stick width over contact width after each of the load steps of UNLIKE discs; nan where there is no single stick
    zone."""
    hertz = line_contact_of_width(HALF_WIDTH, DISC_RADIUS / 2, contact_modulus(*UNLIKE))
    bodies, control = two_discs(DISC_RADIUS, *UNLIKE), Control.of(force=(None, -hertz.force))
    settings = Settings(size=HALF_WIDTH / cells)
    result = solve_contact(*bodies, control, spence_friction(), settings, steps=steps)
    ratios = []
    for step in range(steps):
        zones = result.stick_zones(step)
        ratios.append(
            abs(zones[0][1][0] - zones[0][0][0]) / result.patches(step)[0].width if len(zones) == 1 else np.nan
        )
    return np.array(ratios)


def spence_error(cells: float) -> float:
    """Error of the stick ratio after loading in cells / 2 steps."""
    exact = spence_line_stick(dundurs_beta(*UNLIKE), spence_friction())
    return float(abs(spence_ratios(cells, int(cells) // 2)[-1] / exact - 1))
