"""Impact with Coulomb friction on a bar's end: bounds, limits, momentum, energy."""

import numpy as np
import pytest

from bem.dynamic.body import DynamicsError, Inertial
from bem.dynamic.cells import fill_with_cells
from bem.dynamic.impact import Striker, StrikerOutline, Struck, TangentialMotion, strike
from bem.dynamic.marching import March
from bem.dynamic.schemes import TRAPEZOIDAL
from bem.plane.body import Body
from bem.plane.coulomb import FrictionError
from bem.plane.mesh import Sizing, mesh_outline
from bem.verification.bar import HEIGHT, LENGTH, MATERIAL, box

SPEED, MASS = 1e-3, 0.5
STRIKER = Striker(mass=MASS, velocity=-SPEED, axis=(1.0, 0.0))


def struck_bar(friction: bool, yielding: bool = False) -> Struck:
    """A bar held left, and a block wider than its right end that touches it."""
    outline, size = box(LENGTH, HEIGHT), HEIGHT / 4
    block = box(0.3, 0.35, held="right", face="left").moved(np.array([LENGTH, -0.05]))
    mesh = mesh_outline(outline, Sizing(size / 2))
    cells, other = fill_with_cells(mesh, Sizing(size)), mesh_outline(block, Sizing(0.05))
    return Struck(
        Inertial(Body(outline, MATERIAL), mesh, cells, 1.0), StrikerOutline(Body(block, MATERIAL), other), 0.2,
        yielding, friction=friction,
    )  # fmt: skip


@pytest.fixture(scope="module")
def rough():
    return struck_bar(True)


@pytest.fixture(scope="module")
def smooth():
    return struck_bar(False)


def march(struck: Struck, share: float = 0.25) -> March:
    return March(struck.body, share * HEIGHT / 4, TRAPEZOIDAL)


def slide(struck: Struck, sliding: TangentialMotion, steps: int = 100, share: float = 0.25):
    return strike(struck, STRIKER, march(struck, share), steps, sliding=sliding)


def test_without_friction_it_is_the_impact_of_before(rough, smooth):
    """The same pressures by the other solver to round-off."""
    plain = strike(smooth, STRIKER, march(smooth), 100)
    assert plain.pressure.any() and not plain.shear.size and not plain.drag.any()
    other = slide(rough, TangentialMotion(0.0, 1e-3))
    assert np.abs(other.pressure - plain.pressure).max() < 1e-9 * plain.pressure.max()
    assert not other.shear.any() and not other.heat.any()


def test_much_friction_lets_nothing_slide(rough):
    """Sticking nodes do not move along the striker's face, so nothing turns into heat, and ten times as much friction
    changes nothing."""
    one, other = slide(rough, TangentialMotion(50.0, 1e-4)), slide(rough, TangentialMotion(500.0, 1e-4))
    assert np.abs(one.shear).max() > 0
    assert np.nanmean(one.sticking) > 0.95 and abs(one.heat[-1]) < 1e-3 * one.energy[0, 2]
    assert np.abs(one.drag - other.drag).max() < 0.01 * np.abs(other.drag).max()


@pytest.mark.parametrize("velocity", [2e-4, -2e-4, 1.0])
def test_friction_never_pulls_more_than_its_bound(rough, velocity):
    """At every node and instant, so the impulse along the face is at most the coefficient times the normal one; all of
    it where everything slides, and against the slide."""
    found = slide(rough, TangentialMotion(0.3, velocity, mass=MASS))
    assert (np.abs(found.shear) <= 0.3 * found.pressure * (1 + 1e-9) + 1e-12 * found.pressure.max()).all()
    normal, along = found.force.sum(), found.drag.sum()
    assert abs(along) <= 0.3 * normal * (1 + 1e-9) and along * velocity < 0
    if velocity == 1.0:
        assert along == pytest.approx(-0.3 * normal, rel=1e-9) and np.nanmax(found.sticking) == 0
    else:
        assert abs(along) < 0.299 * normal and np.nanmax(found.sticking) > 0


def test_the_striker_loses_the_momentum_that_friction_takes(rough):
    """By the trapezoidal rule, which is the scheme's own."""
    found = slide(rough, TangentialMotion(0.3, 2e-4, mass=MASS))
    step = found.time[1] - found.time[0]
    impulse = step * np.r_[0.0, np.cumsum((found.drag[1:] + found.drag[:-1]) / 2)]
    assert np.allclose(MASS * (found.slide_velocity - 2e-4), impulse, atol=1e-10 * MASS * 2e-4)


@pytest.mark.parametrize("mass", [None, MASS])
def test_energy_becomes_heat(rough, mass):
    """Energy, heat and work balance but for what opening within a step costs, less with shorter steps."""
    coarse, fine = (slide(rough, TangentialMotion(0.3, 5e-4, mass), round(25 / share), share) for share in (0.25, 0.05))
    assert fine.heat[-1] > 1e-3 * fine.energy[0, 2]
    assert np.diff(fine.heat).min() > -1e-3 * fine.heat[-1]
    assert np.abs(coarse.imbalance).max() < 0.05
    assert np.abs(fine.imbalance).max() < 0.01


def test_a_slide_the_other_way_is_the_mirror_image(rough):
    one, other = (slide(rough, TangentialMotion(0.3, velocity)) for velocity in (2e-4, -2e-4))
    assert np.allclose(one.drag, -other.drag, atol=1e-6 * np.abs(one.drag).max())
    assert np.allclose(one.force, other.force, atol=1e-6 * one.force.max())


def test_a_striker_that_yields_takes_friction_too():
    found = slide(struck_bar(True, True), TangentialMotion(0.3, 1.0), 20)
    assert found.drag[found.force > 0] == pytest.approx(-0.3 * found.force[found.force > 0], rel=1e-6)


@pytest.mark.parametrize(
    ("options", "error", "words"),
    [
        ({"friction": -0.1}, FrictionError, "zero or positive"),
        ({"friction": np.nan}, FrictionError, "zero or positive"),
        ({"friction": np.inf}, DynamicsError, "friction"),
        ({"friction": 0.3, "velocity": np.inf}, DynamicsError, "velocity along the face"),
        ({"friction": 0.3, "mass": 0.0}, DynamicsError, "mass along the face"),
    ],
)
def test_slides_that_are_none_are_refused(options, error, words):
    with pytest.raises(error, match=words):
        TangentialMotion(**options)


def test_friction_on_a_body_that_knows_pressures_only_is_refused(smooth, rough):
    with pytest.raises(DynamicsError, match="friction=True"):
        slide(smooth, TangentialMotion(0.3))
    with pytest.raises(DynamicsError, match="friction=True"):
        strike(rough, STRIKER, march(rough), 3)
