"""A bar with inertia in cells against d'Alembert's solution, and the balance of its energy."""

import numpy as np
import pytest

from bem.dynamic.body import DynamicBody, DynamicsError, Inertial, Waves
from bem.dynamic.cells import CellError, fill_with_cells
from bem.dynamic.marching import March, StepWarning, respond
from bem.dynamic.schemes import BACKWARD_EULER, TRAPEZOIDAL, Scheme, generalised_alpha
from bem.material import STEEL
from bem.plane.body import Body
from bem.plane.boundary import TooLargeError
from bem.plane.mesh import Sizing, mesh_outline
from bem.plane.outline import Edge, Outline
from bem.verification.bar import HEIGHT, LENGTH, MATERIAL, bar, box, edge_pattern, pulse, tip_displacement
from tests.order import assert_order


@pytest.fixture(scope="module")
def bars():
    return {cells: bar(cells) for cells in (2, 4, 8)}


def pulse_error(body, cells: int, scheme, share: float = 0.5) -> float:
    """Largest error of the tip under a smooth pulse over four transits, relative to the largest displacement."""
    pull, impulse = pulse(1.0)
    march = March(body, share * HEIGHT / cells, scheme)
    history = respond(march, lambda t: [pull(t)], round(4 * LENGTH / march.step))
    exact = tip_displacement(history.time, impulse)
    return np.abs(history.q[:, 0] / HEIGHT - exact).max() / np.abs(exact).max()


@pytest.mark.parametrize(("scheme", "order"), [(TRAPEZOIDAL, 2), (generalised_alpha(0.8), 2), (BACKWARD_EULER, 1)])
def test_the_tip_converges_to_dalembert(bars, scheme, order):
    sizes = [HEIGHT / cells for cells in bars]
    assert_order(sizes, [pulse_error(body, cells, scheme) for cells, body in bars.items()], order, 0.35)


def test_the_body_has_the_frequency_of_a_quarter_wave(bars):
    """omega = pi c / 2 L of waves along the bar; the cells' error is of second order: (pi h / 2 L)^2 / 12 = 2e-4."""
    inverse = bars[8].inverse_frequencies
    assert np.abs(inverse / (4 * LENGTH**2 / np.pi**2) - 1).min() < 5e-4


def test_a_body_in_free_fall_falls():
    """g t^2 / 2 at the tip of a bar let go across its length, until the wave from the held end comes: the sign of the
    inertia force."""
    body = bar(4)
    weight = 1e-3 * body.mass
    weight[len(body.cells) :] = 0
    march = March(body, 0.02, force=weight)
    state = march.start()
    rest = type(state)(0.0, 0 * state.u, state.v, weight / body.mass, 0 * state.phi, state.t, 0 * state.q)
    for _ in range(25):
        rest = march.advance(rest, np.zeros(1))
    last = int(np.argmax(body.cells.centre[:, 0]))
    assert rest.u[last] == pytest.approx(0.5 * 1e-3 * rest.time**2, rel=0.01)


@pytest.mark.parametrize("share", [0.3, 0.6, 1.0, 2.0])
def test_the_energy_keeping_scheme_keeps_it_over_a_thousand_steps(bars, share):
    """A step load: what is there is what the load has done, to round-off, at any step."""
    history = respond(March(bars[4], share * HEIGHT / 4), lambda t: [1.0], 1000)
    assert np.abs(history.imbalance).max() < 1e-9


def test_twenty_periods_under_a_step_load_do_not_grow(bars):
    """The tip swings between 0 and 2 sigma L / E; the kinks of the triangle ring by less than a cell's share."""
    march = March(bars[4], HEIGHT / 8)
    history = respond(march, lambda t: [1.0], round(20 * 4 * LENGTH / march.step))
    tip = history.q[:, 0] / HEIGHT
    period = round(4 * LENGTH / march.step)
    last = tip[-period:]
    assert last.max() < 2.05 and last.min() > -0.05
    assert last.max() - last.min() > 1.7


def test_dissipation_only_takes_energy(bars):
    """After a pull has ended nothing works on the bar."""
    for scheme in (BACKWARD_EULER, generalised_alpha(0.5)):
        history = respond(March(bars[4], 0.03, scheme), lambda t: [np.sin(9 * t) * (t < 1)], 300)
        total = history.energy[40:, 0] + history.energy[40:, 1]
        assert np.diff(total[::10]).max() < 0 and total[-1] < 0.97 * total[0]


def spectral_radius(scheme: Scheme, stiffness: np.ndarray) -> np.ndarray:
    """Largest amplification (k,) in a step of modes with (omega h)^2 = stiffness (k,), which may be complex."""
    z = np.asarray(stiffness, complex)
    after, before = np.zeros((len(z), 3, 3), complex), np.zeros((len(z), 3, 3), complex)
    after[:, 0, 0] = after[:, 1, 1] = 1
    after[:, 0, 2], after[:, 1, 2] = -scheme.after_u, -scheme.after_v
    after[:, 2, 0], after[:, 2, 2] = (1 - scheme.alpha_f) * z, 1 - scheme.alpha_m
    before[:, 0] = 1, 1, scheme.before_u
    before[:, 1] = 0, 1, scheme.before_v
    before[:, 2, 0], before[:, 2, 2] = -scheme.alpha_f * z, -scheme.alpha_m
    scale = 1 / np.maximum(np.abs(z), 1)  # the equilibrium of stiff modes, scaled to the size of the others
    after[:, 2] *= scale[:, None]
    before[:, 2] *= scale[:, None]
    return np.abs(np.linalg.eigvals(np.linalg.solve(after, before))).max(axis=1)


@pytest.mark.parametrize("radius", [0.0, 0.5, 1.0])
def test_generalised_alpha_has_the_dissipation_asked_for(radius):
    scheme = generalised_alpha(radius)
    slow, fast = spectral_radius(scheme, np.array([1e-6, 1e12]))
    assert slow == pytest.approx(1.0, abs=1e-4)
    assert fast == pytest.approx(radius, abs=1e-3 if radius else 0.05)
    assert spectral_radius(scheme, np.logspace(-4, 6, 60)).max() < 1 + 1e-9


def test_a_step_in_which_a_wave_crosses_the_body_is_warned_of(bars):
    with pytest.warns(StepWarning, match="travels 500 mm in it, 2 of the body"):
        March(bars[2], 0.5)


@pytest.mark.parametrize("step", [0.0, -1e-3, np.nan, np.inf])
def test_a_step_that_is_none_is_refused(bars, step):
    with pytest.raises(DynamicsError, match="step"):
        March(bars[2], step)


@pytest.mark.parametrize("density", [0.0, -1.0, np.nan])
def test_a_body_without_mass_is_refused(density):
    with pytest.raises(DynamicsError, match="density"):
        Waves.of(STEEL, density)


def test_a_million_cells_are_refused_with_their_number_before_anything_is_allocated():
    mesh = mesh_outline(box(LENGTH, HEIGHT), Sizing(HEIGHT / 4))
    with pytest.raises(CellError, match="more than 20000"):
        fill_with_cells(mesh, Sizing(5e-4))


def test_matrices_too_large_say_their_memory_before_they_are_made():
    outline, size = box(LENGTH, HEIGHT), HEIGHT / 8
    mesh = mesh_outline(outline, Sizing(size))
    solid = Inertial(Body(outline, MATERIAL), mesh, fill_with_cells(mesh, Sizing(size)), 1.0)
    with pytest.raises(TooLargeError, match="256 cells need .* GB"):
        DynamicBody(solid, edge_pattern(mesh, "face", (1.0, 0.0)), memory_limit=1e6)


def test_flat_slivers_of_cells_leave_the_frequencies_where_they_are():
    """A step in the upper side, just above a line of the quadtree, leaves slivers of a hundredth of a square."""
    corners = np.array([[0, 0], [1.0, 0], [1.0, 0.5], [0.9, 0.5], [0.5, 0.376], [0, 0.376]])
    names = ("bottom", "face", "top", "top", "top", "held")
    edges = [Edge(np.array([a, b]), name) for a, b, name in zip(corners, np.roll(corners, -1, axis=0), names)]
    slowest, flattest = [], []
    for size in (0.125, 0.0625):
        outline = Outline([edges])
        mesh = mesh_outline(outline, Sizing(size / 2))
        cells = fill_with_cells(mesh, Sizing(size))
        solid = Inertial(Body(outline, MATERIAL), mesh, cells, 1.0)
        inverse = DynamicBody(solid, edge_pattern(mesh, "face", (1.0, 0.0))).inverse_frequencies
        assert inverse.min() > 0 and cells.area.sum() == pytest.approx(0.4132, rel=1e-3)
        slowest.append(inverse[0])
        flattest.append((cells.area / cells.side**2).min())
    assert min(flattest) < 0.05
    assert slowest[0] == pytest.approx(slowest[1], rel=0.03)
