"""Something strikes a bar: exact forces, flying off and landing again, energy, and what is refused."""

import warnings

import numpy as np
import pytest

from bem.dynamic.body import DynamicsError, Inertial
from bem.dynamic.cells import fill_with_cells
from bem.dynamic.impact import ImpactWarning, Striker, StrikerOutline, Struck, strike
from bem.dynamic.marching import March, StepWarning
from bem.dynamic.pivoting import StepContact
from bem.dynamic.schemes import BACKWARD_EULER, TRAPEZOIDAL
from bem.plane.body import Body
from bem.plane.mesh import Sizing, mesh_outline
from bem.verification.bar import HEIGHT, LENGTH, MATERIAL, box

SPEED, MASS = 1e-3, 0.5  # of the striker; the bar's mass is 1/4, its wave speed and impedance per area 1


def struck_bar(gap: float = 0.0, yielding: bool = False) -> Struck:
    """The bar of the verification held left, a stiff block `gap` before its right end; impedance 1/4 in all."""
    outline, size = box(LENGTH, HEIGHT), HEIGHT / 4
    block = box(0.3, 0.35, held="right", face="left").moved(np.array([LENGTH + gap, -0.05]))
    mesh = mesh_outline(outline, Sizing(size / 2))
    cells, other = fill_with_cells(mesh, Sizing(size)), mesh_outline(block, Sizing(0.05))
    return Struck(
        Inertial(Body(outline, MATERIAL), mesh, cells, 1.0), StrikerOutline(Body(block, MATERIAL), other), 0.2, yielding
    )


@pytest.fixture(scope="module")
def bar():
    return struck_bar()


def hit(struck, scheme=TRAPEZOIDAL, share=0.25, until=6.0, **changes):
    options = {"mass": MASS, "velocity": -SPEED, "axis": (1.0, 0.0)} | changes
    march = March(struck.body, share * HEIGHT / 4, scheme)
    return strike(struck, Striker(**options), march, round(until / march.step), lambda k: k % 10 == 0)


def test_the_force_of_a_mass_on_a_bar_is_that_of_waves(bar):
    """F = rho c v H exp(-rho c H t / m) until the wave is back from the held end, after its first rise over a cell."""
    impact = hit(bar, BACKWARD_EULER)
    t = impact.time
    exact = HEIGHT * SPEED * np.exp(-HEIGHT * t / MASS)
    inner = (t > 0.3) & (t < 1.8)
    assert np.abs(impact.force - exact)[inner].mean() < 0.02 * HEIGHT * SPEED
    impulse = ((impact.force[1:] + impact.force[:-1]) / 2 * np.diff(t))[t[1:] < 1.8].sum()
    k = np.flatnonzero(t < 1.8)[-1]
    assert impulse == pytest.approx(MASS * SPEED * (1 - np.exp(-HEIGHT * t[k] / MASS)), rel=0.02)


def test_energy_stays_when_a_mass_strikes_flies_off_and_is_gone(bar):
    """The trapezoidal rule keeps what is in bar and mass while the contact is steady; opening and closing within a
    step cost what the step resolves."""
    impact = hit(bar, until=8.0)
    assert impact.contacts()
    assert impact.velocity[-1] > 0 and impact.force[-1] == 0
    assert np.abs(impact.imbalance).max() < 0.05
    finer = hit(bar, share=0.05, until=8.0)
    assert np.abs(finer.imbalance).max() < 0.01


def test_a_mass_under_a_load_flies_off_and_lands_again(bar):
    impact = hit(bar, BACKWARD_EULER, until=60.0, load=-2e-5)
    apart = [second[0] - first[1] for first, second in zip(impact.contacts()[:-1], impact.contacts()[1:])]
    assert max(apart) > 5  # a real flight, not a chatter
    up, force = impact.position, impact.force
    assert (up[force > 0] < 2e-3).all()


def test_a_prescribed_path_presses_as_the_static_bar_when_it_is_slow(bar):
    """A stiff block pushed in over forty periods: F = E H x / L."""
    driven = {"mass": None, "velocity": 0.0, "path": lambda t: -1e-3 * t / 160}
    with pytest.warns(StepWarning, match="waves are not resolved"):
        impact = hit(bar, BACKWARD_EULER, share=16.0, until=160.0, **driven)
    assert impact.force[-1] == pytest.approx(HEIGHT * 1e-3 / LENGTH, rel=0.02)


def test_after_the_release_nothing_presses(bar):
    impact = hit(bar, release=0.5)
    assert (impact.force[impact.time > 0.5] == 0).all() and impact.force[impact.time < 0.5].any()


def test_a_striker_that_yields_presses_less_at_first(bar):
    soft = struck_bar(yielding=True)
    values = np.linalg.eigvalsh(soft.local)
    assert values[0] > -1e-2 * values[-1]  # positive but for the unlike meshes' transfer; the bar's own adds to it
    stiff, yields = hit(bar, BACKWARD_EULER), hit(soft, BACKWARD_EULER)
    assert yields.force[1:3].max() < 0.9 * stiff.force[1:3].max()


def test_the_dynamic_compliance_is_positive_at_any_step(bar):
    """What makes the contact problem one with one solution."""
    for share in (0.01, 0.3, 2.0):
        values = np.linalg.eigvalsh(March(bar.body, share * HEIGHT / 4).compliance)
        assert values.min() > 0


def test_a_striker_that_never_arrives_is_warned_of():
    with pytest.warns(ImpactWarning, match="never touches"):
        hit(struck_bar(gap=0.1), velocity=0.01, until=1.0)


@pytest.mark.parametrize("beside, force", [(0.0, 1.30 * 1.10), (0.5, 1.30)])
def test_a_flat_striker_counts_its_width_or_says_so(beside, force):
    """Eight elements under a punch that moves into the middle of a block's side: the mean force over the time in which
    a wave runs from a quarter to the whole of its width w, in units of rho c v w. On 4, 8 and 16 elements, edges on
    nodes or a quarter or half an element beside them, it comes to 1.30."""
    size, wide = HEIGHT / 16, HEIGHT / 2
    mesh = mesh_outline(box(HEIGHT, HEIGHT), Sizing(size))
    punch = box(0.3, wide, held="right", face="left").moved(np.array([HEIGHT, HEIGHT / 4 + beside * size]))
    solid = Inertial(Body(box(HEIGHT, HEIGHT), MATERIAL), mesh, fill_with_cells(mesh, Sizing(size)), 1.0)
    struck = Struck(solid, StrikerOutline(Body(punch, MATERIAL), mesh_outline(punch, Sizing(size))), 0.05)
    march = March(struck.body, wide / 64, BACKWARD_EULER)
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always", ImpactWarning)
        impact = strike(struck, Striker(path=lambda t: -SPEED * t, axis=(1.0, 0.0)), march, 64)
    assert impact.force[16:].mean() / (SPEED * wide) == pytest.approx(force, rel=0.015)
    assert [("0.125 m wide" in str(one.message)) for one in said] == ([] if beside else [True])


def test_contact_solves_a_complementarity_problem():
    rng = np.random.default_rng(3)
    for size in (1, 5, 30):
        root = rng.normal(size=(size, size))
        matrix, free = root @ root.T + 0.1 * np.eye(size), rng.normal(size=size)
        pressure = StepContact(matrix).solve(free)[0]
        gap = free + matrix @ pressure
        assert pressure.min() >= 0 and gap.min() > -1e-9 and np.abs(pressure * gap).max() < 1e-9
    near = np.arange(20)  # the other nodes have nothing above them
    beside = StepContact(matrix).solve(np.where(np.arange(size) < 20, free, np.inf))[0]
    assert not beside[20:].any() and beside[:20] == pytest.approx(
        StepContact(matrix[np.ix_(near, near)]).solve(free[:20])[0]
    )


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"mass": 0.0}, "mass of the striker"),
        ({"mass": -1.0}, "mass of the striker"),
        ({"mass": np.nan}, "mass of the striker"),
        ({}, "either a mass"),
        ({"mass": 1.0, "path": lambda t: 0.0}, "either a mass"),
        ({"mass": 1.0, "axis": (1.0, 1.0)}, "unit vector"),
        ({"mass": 1.0, "velocity": np.inf}, "velocity"),
    ],
)
def test_strikers_that_are_none_are_refused(options, words):
    with pytest.raises(DynamicsError, match=words):
        Striker(**options)


@pytest.mark.parametrize("steps", [0, -3, 2.5])
def test_a_number_of_steps_that_is_none_is_refused(bar, steps):
    with pytest.raises(DynamicsError, match="steps"):
        strike(bar, Striker(mass=1.0), March(bar.body, 0.1), steps)


def test_an_instant_that_was_not_kept_is_refused(bar):
    impact = hit(bar, until=0.5)
    assert np.isfinite(impact.solution(10).density).all()
    with pytest.raises(DynamicsError, match="not kept"):
        impact.solution(11)
