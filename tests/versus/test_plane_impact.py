"""A stiff cylinder strikes a block: boundary elements with inertia in cells against implicit finite elements."""

import numpy as np
import pytest

from bem.dynamic.body import Inertial
from bem.dynamic.cells import fill_with_cells
from bem.dynamic.impact import Striker, StrikerOutline, Struck, TangentialMotion, strike
from bem.dynamic.marching import March
from bem.dynamic.schemes import TRAPEZOIDAL, generalised_alpha
from bem.material import STEEL
from bem.plane.body import Body
from bem.plane.internal import field_at
from bem.plane.mesh import Sizing, Zone, mesh_outline
from bem.plane.outline import block_behind
from rail_fem.static_fe.plane_impact import finite_impact
from rail_fem.static_fe.plane_strain import Fineness
from rail_fem.static_fe.small_strain import SmallStrainError

MM, US = 1e-3, 1e-6
RADIUS, DENSITY, SPEED, MASS = 0.3, 7800.0, 1.0, 300.0
SIZE, STEP, STEPS = 0.25 * MM, 0.5 * US, 60  # of the elements; a wave is back from the base after 13 us


def bodies() -> tuple[Body, Body]:
    """A block 60 by 40 mm held below, and a stiff cylinder that touches it."""
    x = np.linspace(-0.05, 0.05, 2001)
    cylinder = np.column_stack([x, RADIUS - np.sqrt(RADIUS**2 - x**2)])
    return (
        Body(block_behind(np.array([[-0.03, 0.0], [0.03, 0.0]]), -0.04), STEEL),
        Body(block_behind(cylinder, 0.06), STEEL),
    )


def striker() -> Striker:
    return Striker(mass=MASS, velocity=-SPEED)


@pytest.fixture(scope="module")
def boundary():
    block, cylinder = bodies()
    middle = np.zeros((1, 2))
    sizing = Sizing(3 * MM, [Zone(middle, SIZE, 5 * MM)], 0.3)
    mesh = mesh_outline(block.outline, sizing)
    cells = fill_with_cells(mesh, Sizing(3 * MM, [Zone(middle, 1 * MM, 5 * MM)], 0.3))
    struck = Struck(
        Inertial(block, mesh, cells, DENSITY),
        StrikerOutline(cylinder, mesh_outline(cylinder.outline, sizing)),
        0.1 * MM,
    )
    return strike(struck, striker(), March(struck.body, STEP), STEPS, lambda k: k % 20 == 0)


@pytest.fixture(scope="module")
def finite():
    block, cylinder = bodies()
    fineness = Fineness(np.zeros((1, 2)), SIZE, 5 * MM, 3 * MM, 0.3)
    return finite_impact(
        block, cylinder.outline.edge_curves("face"), striker(), DENSITY, STEP, STEPS, fineness, (-6 * MM, 6 * MM),
        keep=lambda k: k % 20 == 0, reach=0.1 * MM,
    )  # fmt: skip


def test_the_forces_are_one(boundary, finite):
    """Once the patch has a dozen elements; before, both see it by a few nodes."""
    late = boundary.time > 8 * US
    assert finite.force[late].min() > 0.1 * finite.force.max()
    assert np.abs(boundary.force - finite.force)[late].max() < 0.03 * finite.force.max()
    assert boundary.velocity[-1] == pytest.approx(finite.velocity[-1], rel=2e-3)


def test_the_stresses_below_the_patch_are_one(boundary, finite):
    """At 1 mm depth and more, at the points where the finite elements give them."""
    for k in (40, 60):
        points, stress = finite.von_mises(k)
        inner = np.flatnonzero((np.hypot(*points.T) < 8 * MM) & (points[:, 1] < -1 * MM))
        ours = field_at(boundary.solution(k), points[inner]).von_mises
        assert np.abs(ours - stress[inner]).max() < 0.03 * stress[inner].max()


def test_the_reference_keeps_its_energy(finite):
    total = finite.energy.sum(axis=1)
    assert np.abs(total / total[0] - 1).max() < 0.01


def test_the_reference_refuses_what_it_does_not_take():
    block, cylinder = bodies()
    curves = cylinder.outline.edge_curves("face")
    with pytest.raises(SmallStrainError, match="schemes"):
        finite_impact(
            block, curves, striker(), DENSITY, STEP, 1, Fineness(np.zeros((1, 2)), MM, MM, 5 * MM), (-MM, MM),
            generalised_alpha(0.5),
        )  # fmt: skip
    with pytest.raises(SmallStrainError, match="along y"):
        finite_impact(
            block, curves, Striker(mass=1.0, axis=(1.0, 0.0)), DENSITY, STEP, 1,
            Fineness(np.zeros((1, 2)), MM, MM, 5 * MM), (-MM, MM), TRAPEZOIDAL,
        )  # fmt: skip


@pytest.mark.parametrize("velocity", [0.2, 3.0])
def test_with_friction_the_forces_are_one_too(velocity):
    """A slide that the patch partly holds, and one that slides all over; the drag, too, and what the striker loses."""
    block, cylinder = bodies()
    middle = np.zeros((1, 2))
    sizing = Sizing(4 * MM, [Zone(middle, 0.4 * MM, 5 * MM)], 0.3)
    mesh = mesh_outline(block.outline, sizing)
    cells = fill_with_cells(mesh, Sizing(4 * MM, [Zone(middle, 1.2 * MM, 5 * MM)], 0.3))
    outline = StrikerOutline(cylinder, mesh_outline(cylinder.outline, sizing))
    struck = Struck(Inertial(block, mesh, cells, DENSITY), outline, 0.1 * MM, friction=True)
    sliding = TangentialMotion(0.3, velocity, MASS)
    ours = strike(struck, striker(), March(struck.body, STEP), STEPS, sliding=sliding)
    judge = finite_impact(
        block, cylinder.outline.edge_curves("face"), striker(), DENSITY, STEP, STEPS,
        Fineness(middle, 0.4 * MM, 5 * MM, 4 * MM, 0.3), (-6 * MM, 6 * MM), reach=0.1 * MM, sliding=sliding,
    )  # fmt: skip
    # the trapezoidal rule lets the shear of sticking nodes alternate from step to step: means of two
    force, drag, theirs, there = (
        (one[1:] + one[:-1]) / 2 for one in (ours.force, ours.drag, judge.force, judge.slide[:, 2])
    )
    late = ours.time[1:] > 8 * US
    assert np.abs(force - theirs)[late].max() < 0.04 * theirs.max()
    assert np.abs(drag - there)[late].max() < 0.04 * np.abs(there).max()
    assert ours.slide_velocity[-1] - velocity == pytest.approx(judge.slide[-1, 1] - velocity, rel=0.03)
    assert (np.abs(there) < 0.29 * theirs)[late].any() == (velocity < 1)
