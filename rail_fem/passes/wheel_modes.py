"""Vibration of a wheel on a rigid axle, as masses on springs that the light models carry beside the wheel's own mass.

The wheel is elastic (rail_fem.passes.fourier_section), the axle rigid: it holds the bore, and of half a wheelset it is
what the wheel itself does not weigh. Harmonic 1 moves it up and down; all others leave it at rest. Modes are those of
the free half wheelset, so that each is a mass of its own: the contact's height is the sum of the rigid motion and of
all of them. The wheel turns through its modes; at a turn in 80 ms that splits the frequency of harmonic n by n times 12
Hz and is left out, and so are the axle's own bending and lateral forces.
"""

import functools
from typing import NamedTuple

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import eigsh

from bem.material import Elastic
from rail_fem.passes.fourier_section import RingSection, grid_section, matrices
from rail_fem.passes.vertical_dynamics import SPRUNG, WHEEL, Masses
from rail_fem.scene.scene import GRAVITY, Scene, Vehicle
from rail_fem.scene.wheel_body import WheelBody

ELEMENT = 15e-3  # of the section [m]; tests/rail_fem/test_wheel_modes.py measures what that leaves
SHIFT = (2 * np.pi * 30.0) ** 2  # keeps a free body's system solvable [1/s^2]
EACH = 16  # modes of a harmonic that are looked at
MOST_HARMONICS = 60
LEAST = 1e-4  # of the softest mode's static deflection at the contact: less is left out


class WheelModes(NamedTuple):
    """Modes of half a wheelset that is free to move up and down, less that motion itself, softest first.

    harmonic (k,) around the axle;  frequency (k,) [Hz];  mass (k,) [kg] and axle (k,) [1]: of a mode that moves the
    contact up by 1, its modal mass, and how far it moves the axle up
    """

    harmonic: np.ndarray
    frequency: np.ndarray
    mass: np.ndarray
    axle: np.ndarray

    @property
    def stiffness(self) -> np.ndarray:
        """(k,) modal stiffness [N/m]."""
        return self.mass * (2 * np.pi * self.frequency) ** 2


def wheel_section(
    body: WheelBody, radius: float, contact: float, element: float = ELEMENT, within_rim: float | None = None
) -> RingSection:
    """The wheel's section with nodes at the contact, y = `contact` on the tread [m]. radius : at the tread datum [m];
    within_rim : depth below it of one more line of nodes [m]

    Errors: ValueError for a wheel whose rim reaches down to its hub.
    """
    inner = radius - body.rim_depth
    if not inner > body.hub_radius + element / 4:
        raise ValueError(
            f"scene.wheel_body: the rim ends at a radius of {inner * 1e3:g} mm, the hub at"
            f" {body.hub_radius * 1e3:g} mm: they leave no web"
        )
    back, middle, half = body.rim_back, body.web_position, body.hub_width / 2
    web = middle - body.web_thickness / 2, middle + body.web_thickness / 2
    rim, flange = (back, back + body.rim_width), (back, back + body.flange_thickness)
    if not flange[1] <= contact <= rim[1]:
        raise ValueError(
            f"scene.wheel_body: the contact at y = {contact * 1e3:g} mm from the tread datum is not on the tread, from"
            f" {flange[1] * 1e3:g} to {rim[1] * 1e3:g} mm there: give a wider rim_width"
        )
    r_lines = [body.bore_radius, body.hub_radius, inner, radius, radius + body.flange_height]
    r = _filled(r_lines + ([] if within_rim is None else [radius - within_rim]), element)
    y = _filled([middle - half, middle + half, *web, *rim, flange[1], contact], element)
    at_r, at_y = ((lines[1:] + lines[:-1]) / 2 for lines in (r, y))
    within = lambda lines, low, high: (lines > low) & (lines < high)
    parts = zip(zip(r_lines[:-1], r_lines[1:]), ((middle - half, middle + half), web, rim, flange))
    inside = sum((np.outer(within(at_r, *along), within(at_y, *across)) for along, across in parts)) > 0
    section = grid_section(r, y, inside)
    share = np.clip((inner - section.points[:, 0]) / (inner - body.hub_radius), 0, 1)
    section.points[:, 1] += body.web_offset * share**2 * (3 - 2 * share)
    return section


def _filled(lines: list[float], element: float) -> np.ndarray:
    """Lines and those between them, at most `element` apart; such as lie together are one."""
    found = np.unique(np.round(lines, 9))
    parts = [np.linspace(a, b, int(np.ceil((b - a) / element - 1e-9)) + 1)[:-1] for a, b in zip(found[:-1], found[1:])]
    return np.r_[np.concatenate(parts), found[-1]]


@functools.lru_cache(maxsize=16)
def wheel_modes(
    body: WheelBody,
    radius: float,
    unsprung: float,
    steel: Elastic,
    density: float,
    highest: float,
    element: float = ELEMENT,
) -> WheelModes:
    """Modes up to a frequency `highest` [Hz]. unsprung : mass of half a wheelset [kg].

    Errors: ValueError for a wheel that weighs as much as that, and those of `wheel_section`.
    """
    section = wheel_section(body, radius, 0.0, element)
    axle_mass = unsprung - weighed(section, unsprung, steel, density)
    at_contact = int(np.argmin(np.hypot(section.points[:, 0] - radius, section.points[:, 1])))
    found: list[tuple] = []
    for n in range(MOST_HARMONICS):
        own = _harmonic(section, n, steel, density, axle_mass, at_contact, highest)
        found += own
        if n > 2 and not own:
            break
    found.sort(key=lambda mode: mode[2] * mode[1] ** 2)
    harmonic, frequency, modal, axle = (np.array(column) for column in (zip(*found) if found else ((),) * 4))
    softness = 1 / (modal * frequency**2) if len(modal) else modal
    keep = softness > LEAST * softness.max(initial=0.0)
    return WheelModes(harmonic[keep], frequency[keep], modal[keep], axle[keep])


def weighed(section: RingSection, unsprung: float, steel: Elastic, density: float) -> float:
    """What the wheel weighs [kg]. Errors: ValueError where that is as much as half a wheelset."""
    _, mass = matrices(section, 1, steel, density)
    up = _upward(section)
    wheel_mass = float(up @ (mass @ up))
    if not wheel_mass < unsprung:
        raise ValueError(
            f"scene.wheel_body: the wheel weighs {wheel_mass:.0f} kg, half a wheelset {unsprung:.0f} kg: make it"
            " lighter"
        )
    return wheel_mass


def _upward(section: RingSection) -> np.ndarray:
    """(3 k,)  unknowns of harmonic 1 for a motion of 1 up; the angle counts from the lowest point."""
    return np.tile([-1.0, 1.0, 0.0], len(section.points))


def _harmonic(
    section: RingSection, n: int, steel: Elastic, density: float, axle: float, at_contact: int, highest: float
) -> list[tuple]:
    """Harmonic, frequency [Hz], modal mass [kg] and axle's part of each mode below `highest` that moves the contact."""
    stiffness, mass = matrices(section, n, steel, density)
    bore = np.flatnonzero(section.points[:, 0] < section.points[:, 0].min() + 1e-9)
    held = np.unique(np.r_[np.concatenate([3 * bore, 3 * bore + 1, 3 * bore + 2]), _torsion(section, n)])
    free = np.setdiff1d(np.arange(stiffness.shape[0]), held)
    rows, columns, values = free, np.arange(len(free)), np.ones(len(free))
    if n == 1:  # the bore goes up and down with the axle
        rows, columns = np.r_[rows, held], np.r_[columns, np.full(len(held), len(free))]
        values = np.r_[values, _upward(section)[held]]
    shape = sparse.csc_array((values, (rows, columns)), shape=(stiffness.shape[0], columns.max() + 1))
    own_stiffness, own_mass = (shape.T @ matrix @ shape for matrix in (stiffness, mass))
    if n == 1:
        last = own_mass.shape[0] - 1
        own_mass = own_mass + sparse.csc_array(([axle], ([last], [last])), shape=own_mass.shape)
    square, vectors = eigsh(own_stiffness.tocsc(), k=EACH, M=own_mass.tocsc(), sigma=-SHIFT, which="LM")
    found = []
    for value, vector in zip(square, vectors.T):
        frequency = np.sqrt(max(value, 0.0)) / (2 * np.pi)
        at = -float((shape @ vector)[3 * at_contact])
        rigid = n == 1 and frequency < 1.0
        if rigid or frequency > highest or abs(at) < 1e-12:
            continue
        found.append((n, frequency, 1 / at**2, float(vector[-1]) / at if n == 1 else 0.0))
    return found


def _torsion(section: RingSection, n: int) -> np.ndarray:
    return 3 * np.arange(len(section.points)) + 1 if n == 0 else np.empty(0, int)


def modes_of(body: WheelBody, scene: Scene, highest: float) -> WheelModes:
    """Of the scene's wheel with that body, up to `highest` [Hz]. Errors: as wheel_modes."""
    return wheel_modes(body, *_of_scene(scene), highest)


def _of_scene(scene: Scene) -> tuple[float, float, Elastic, float]:
    """Radius, unsprung mass, steel and density of its wheel."""
    steel = scene.materials.wheel.steel()
    return scene.wheel.radius, scene.vehicle.wheel_unsprung_mass, steel.elastic, steel.density


def refuse_impossible(body: WheelBody, scene: Scene) -> None:
    """Errors: as wheel_modes, of the scene's wheel with that body, in a tenth of a second."""
    radius, unsprung, steel, density = _of_scene(scene)
    weighed(wheel_section(body, radius, 0.0), unsprung, steel, density)


def with_modes(masses: Masses, vehicle: Vehicle, modes: WheelModes, damping_ratio: float) -> Masses:
    """The same masses with a mass on a spring for each mode behind them; the suspension holds the axle, which they
    move, too."""
    count, more = len(masses.mass), len(modes.mass)
    grow = lambda matrix: np.pad(matrix, (0, more))
    axle = np.zeros(count + more)
    axle[SPRUNG], axle[WHEEL], axle[count:] = 1.0, -1.0, -modes.axle
    before = np.where(np.arange(count + more) < count, axle, 0.0)
    coupled = np.outer(axle, axle) - np.outer(before, before)
    own = np.r_[np.zeros(count), modes.stiffness]
    damping = np.r_[np.zeros(count), 2 * damping_ratio * np.sqrt(modes.stiffness * modes.mass)]
    return Masses(
        np.r_[masses.mass, modes.mass],
        grow(masses.stiffness) + vehicle.primary_stiffness * coupled + np.diag(own),
        grow(masses.damping) + vehicle.primary_damping * coupled + np.diag(damping),
        np.r_[masses.load, np.zeros(more)],
        np.r_[masses.coupling, np.ones(more)],
    )


def static_deflections(scene: Scene, modes: WheelModes) -> np.ndarray:
    """(k,) of each mode under the static load, the suspension's part pressing on the axle [m]."""
    sprung = scene.vehicle.wheel_sprung_mass * GRAVITY
    return (scene.static_wheel_load - modes.axle * sprung) / modes.stiffness


def bent(scene: Scene, modes: WheelModes, position: np.ndarray) -> np.ndarray:
    """Heights (n,) of a rigid wheel at rest as those (n + k,) of one whose modes give way under the static load: the
    contact stays where it is, the suspension as long as it is."""
    deflection = static_deflections(scene, modes)
    rigid = position.copy()
    rigid[WHEEL] -= deflection.sum()
    rigid[SPRUNG] += modes.axle @ deflection - deflection.sum()
    return np.r_[rigid, deflection]
