"""Contact that is hard to solve, and input that must be refused: an answer with a warning, or an error that says
why."""

import numpy as np
import pytest

from bem.material import STEEL, Elastic
from bem.plane.body import Body
from bem.plane.boundary import EquilibriumError, TooLargeError
from bem.plane.contact import LoadError, Settings, solve_contact
from bem.plane.coulomb import Control, ConvergenceError, solve_step
from bem.plane.internal import field_at, grid_below
from bem.plane.mesh import Sizing, mesh_outline
from bem.plane.outline import OutlineError, block_behind
from bem.plane.pairing import PairingError, pair
from bem.verification.cases import CASES, LOAD, blocks, conformal, non_conformal, two_point

COARSE = Settings(size=0.4e-3)
FLAT = np.array([[-0.005, 0.0], [0.005, 0.0]])
WIDE = np.array([[-0.05, 0.0], [0.05, 0.0]])


def healthy(result):
    last = result.last
    assert np.all(np.isfinite(last.pressure)) and np.all(last.pressure >= -1e-9 * last.pressure.max())
    assert last.gap.min() > -1e-10 * np.ptp(result.interface.points[:, 0])
    return result


@pytest.mark.parametrize("case", CASES.values(), ids=list(CASES))
def test_the_three_cases_converge(case):
    """Largest pressure at 0.2 mm within 0.5 % of 0.05 mm, displacement within 0.2 %."""
    fine, no_slip = (healthy(solve_contact(*case(), LOAD, settings=Settings(size=size))) for size in (0.1e-3, 0.2e-3))
    assert no_slip.last.pressure.max() == pytest.approx(fine.last.pressure.max(), rel=0.005)
    assert no_slip.last.motion[1] == pytest.approx(fine.last.motion[1], rel=0.002)
    assert not no_slip.warnings
    assert no_slip.force()[1] == pytest.approx(10e6, rel=1e-11)


@pytest.mark.parametrize("left, right", [(0.8e-3, 0.4e-3), (0.4e-3, 0.8e-3)])
def test_a_punch_within_one_element_is_pressed_where_the_node_meets_it(left, right):
    """At the face's edge, whose node lies within its element: neither end of that has the punch before it, and its
    force goes to the half of the punch that the node is at."""
    slave = mesh_outline(block_behind(WIDE / 5, -10e-3), Sizing(4e-3))
    x = slave.middles[slave.of_edge("face"), 0].max()
    punch = block_behind(np.array([[x - left, 0.0], [x + right, 0.0]]), 10e-3)
    master = mesh_outline(punch, Sizing(2e-3))
    found = pair(slave, "face", master, "face", punch, 1e-3)
    (pressed,) = np.flatnonzero(found.on_master[: master.densities, 0])
    assert len(found.nodes) == 1 and abs(master.middles[pressed, 0] - x) < 0.2e-3 < abs(right - left)


def test_two_patches_share_the_load_equally():
    left, right = healthy(solve_contact(*two_point(), LOAD, settings=COARSE)).patches()
    assert left.force[1] == pytest.approx(5e6, rel=1e-3) and right.force[1] == pytest.approx(5e6, rel=1e-3)
    assert left.force[0] == pytest.approx(-right.force[0], rel=1e-3)
    assert left.force[0] != 0  # the patches are inclined


def test_a_second_patch_that_closes_under_load_is_found_and_resolved():
    """One side of the saddle is 20 um lower: light load on one patch, heavy load on both."""
    fixed, moving = two_point()
    tilted = Body(fixed.outline.moved(np.zeros(2)), fixed.material)
    lower = tilted.outline.edge_curves("face")[0].points[::-1].copy()
    lower[:, 1] -= np.where(lower[:, 0] > 0, 20e-6, 0.0) * np.clip(lower[:, 0] / 1e-3, 0, 1)
    fixed = blocks(np.array([[-1, 1], [1, 1.0]]), lower)[0]
    light = healthy(solve_contact(fixed, moving, Control.of(force=(None, -1e5)), settings=Settings(size=0.1e-3)))
    heavy = healthy(solve_contact(fixed, moving, LOAD, settings=Settings(size=0.1e-3)))
    assert len(light.patches()) == 1 and len(heavy.patches()) == 2
    for patch in heavy.patches():
        step = np.hypot(*np.diff(heavy.interface.points[patch.nodes], axis=0).T)
        assert step.max() < 1.3 * 0.1e-3


@pytest.mark.parametrize("radius", [0.0701, 0.07001, 0.07, 0.0699])
def test_radii_close_equal_and_crossed_over(radius):
    """Upper 70 mm in a lower of almost its radius, or below it: contact over the whole width, load balanced."""
    x = np.linspace(-0.015, 0.015, 241)
    upper, lower = (np.column_stack([x, r - np.sqrt(r**2 - x**2)]) for r in (0.07, radius))
    result = healthy(solve_contact(*blocks(upper, lower), LOAD, settings=COARSE))
    assert result.force()[1] == pytest.approx(10e6, rel=1e-10)
    assert sum(patch.width for patch in result.patches()) > 0.028


def test_an_upper_radius_below_the_lowers_touches_at_two_edges():
    x = np.linspace(-0.015, 0.015, 241)
    upper, lower = (np.column_stack([x, r - np.sqrt(r**2 - x**2)]) for r in (0.07, 0.06))
    left, right = healthy(solve_contact(*blocks(upper, lower), LOAD, settings=COARSE)).patches()
    assert right.begin[0] > 0.009 and left.end[0] < -0.009 or left.begin[0] > 0.009 and right.end[0] < -0.009


def test_rigid_punch_with_edges_is_sadowskys():
    """Rigid flat punch on a wide block held 50 mm away: p = P / (pi sqrt(a^2 - x^2)) away from the edges. The block's
    size changes it by order (a / 50 mm)^2 = 1 %, the punch's edge within an element of the block by h / a = 2 %."""
    result = healthy(
        solve_contact(
            *blocks(FLAT, WIDE, Elastic(210e13, 0.3), Elastic(210e9, 0.3), height=0.05),
            LOAD,
            settings=Settings(size=0.1e-3),
        )
    )
    x, inner = result.interface.points[:, 0], np.abs(result.interface.points[:, 0]) < 0.0045
    exact = 10e6 / (np.pi * np.sqrt(0.005**2 - x[inner] ** 2))
    np.testing.assert_allclose(result.last.pressure[inner], exact, rtol=0.03)


@pytest.mark.parametrize("upper, lower", [(FLAT, WIDE), (WIDE, FLAT)])
def test_flat_punch_balances_whichever_body_is_narrow(upper, lower):
    result = healthy(solve_contact(*blocks(upper, lower), LOAD, settings=COARSE))
    assert result.force()[1] == pytest.approx(10e6, rel=1e-10)
    assert result.patches()[0].width == pytest.approx(0.010, abs=1e-3)


@pytest.mark.parametrize("load", [1e-6, 1.0, 1e3, 1e9])
def test_any_positive_load_is_borne(load):
    result = healthy(solve_contact(*non_conformal(), Control.of(force=(None, -load))))
    assert result.force()[1] == pytest.approx(load, rel=1e-9)
    if load == 1e9:
        assert any("small strains" in note for note in result.warnings)
    else:
        assert len(result.patches()[0].nodes) >= 10  # the mesh follows the patch down to nanometres


def test_no_load_gives_an_empty_answer_that_says_so():
    result = solve_contact(*non_conformal(), Control.of(force=(None, 0.0)))
    assert not result.last.pressure.any() and not result.patches()
    assert any("do not touch: smallest gap at" in note and "nodes" in note for note in result.warnings)
    assert np.all(field_at(result.solution("fixed"), np.array([[0.0, -0.01]])).stress == 0)


def test_a_patch_smaller_than_the_elements_is_warned_of():
    result = healthy(solve_contact(*non_conformal(), Control.of(force=(None, -1e-3)), settings=COARSE))
    assert any("rough" in note for note in result.warnings)


@pytest.mark.parametrize("friction", [1e-4, 0.3, 10.0, np.inf])
def test_any_friction_is_borne(friction):
    result = healthy(solve_contact(*conformal(), Control.of(force=(None, -10e6)), friction, COARSE, steps=5))
    if np.isfinite(friction):
        assert np.all(np.abs(result.last.shear) <= friction * result.last.pressure * (1 + 1e-9) + 1e-3)
    assert result.force()[1] == pytest.approx(10e6, rel=1e-10)


def test_a_wheel_that_may_tilt_and_one_that_is_held_aslant():
    """Free to turn, an eccentric block turns until the pressure's centre is under the load."""
    fixed, moving = non_conformal()
    result = healthy(
        solve_contact(
            fixed, moving.moved(np.array([1e-3, 0.0])), Control.of(force=(None, -10e6), moment=0.0), settings=COARSE
        )
    )
    assert abs(result.force()[2]) < 1e-9 * 10e6 * 0.015
    assert result.last.motion[2] != 0
    held = healthy(solve_contact(fixed, moving, Control.of(force=(None, -10e6), rotation=1e-4), settings=COARSE))
    assert abs(held.force()[2]) > 1.0


def test_soft_on_hard_takes_the_soft_bodys_mesh():
    fixed, moving = non_conformal()
    result = healthy(
        solve_contact(fixed, Body(moving.outline, Elastic(1e7, 0.49)), Control.of(force=(None, -1e3)), settings=COARSE)
    )
    assert result.carrier == "moving"
    assert (
        healthy(
            solve_contact(
                Body(fixed.outline, Elastic(1e7, 0.49)), moving, Control.of(force=(None, -1e3)), settings=COARSE
            )
        ).carrier
        == "fixed"
    )


def test_bodies_may_be_exchanged():
    """Which body moves is a matter of names."""
    fixed, moving = non_conformal()
    one = solve_contact(fixed, moving, LOAD, settings=Settings(size=0.2e-3))
    other = solve_contact(moving, fixed, Control.of(force=(None, 10e6)), settings=Settings(size=0.2e-3))
    assert one.last.pressure.max() == pytest.approx(other.last.pressure.max(), rel=1e-3)
    assert one.last.motion[1] == pytest.approx(-other.last.motion[1], rel=1e-3)


def test_mirror_image_gives_the_mirror_answer():
    x = np.linspace(-0.015, 0.015, 241)
    upper, lower = np.column_stack([x, x**2 / 0.2 + 0.2 * x**3]), np.column_stack([x, -(x**2) / 0.8 - 5 * x**3])
    one = solve_contact(*blocks(upper, lower), LOAD, settings=COARSE)
    two = solve_contact(*blocks(upper * [-1, 1], lower * [-1, 1]), LOAD, settings=COARSE)
    assert one.last.pressure.max() == pytest.approx(two.last.pressure.max(), rel=1e-6)
    np.testing.assert_allclose(one.patches()[0].begin * [-1, 1], two.patches()[0].end, atol=1e-8)


def test_noisy_profile_still_carries_the_load():
    """20 um of noise every 0.5 mm on the lower face: many patches, all balanced."""
    x = np.linspace(-0.015, 0.015, 61)
    noise = np.random.default_rng(3).normal(0, 20e-6, 61)
    upper = np.column_stack([x, 0.1 - np.sqrt(0.1**2 - x**2)])
    result = healthy(solve_contact(*blocks(upper, np.column_stack([x, noise - x**2 / 0.8])), LOAD, settings=COARSE))
    assert result.force()[1] == pytest.approx(10e6, rel=1e-9)


def test_internal_grid_follows_the_face():
    result = solve_contact(*conformal(), LOAD, settings=COARSE)
    grid = grid_below(result.fixed.body.outline, "face", np.zeros(2), 0.010, 0.015, 0.5e-3)
    assert grid.shape == (31, 41, 2)
    field = field_at(result.solution("fixed"), grid)
    assert np.all(np.isfinite(field.von_mises))
    # the surface row carries the pressure: at the middle of the patch sigma_yy = -p
    assert field.stress[0, 20, 1] == pytest.approx(-result.last.pressure.max(), rel=0.02)


FIXED, MOVING = non_conformal()


@pytest.mark.parametrize(
    "error, message, call",
    [
        (LoadError, "pulls it away", lambda: solve_contact(FIXED, MOVING, Control.of(force=(None, 1e6)))),
        (
            PairingError,
            "x 0.085 to 0.115 .* never meets .* x -0.015 to 0.015",
            lambda: solve_contact(FIXED, MOVING.moved(np.array([0.1, 0.0])), LOAD),
        ),
        (
            EquilibriumError,
            r"x 1e\+06 N/m, y -1e\+07 N/m\) cannot be balanced",
            lambda: solve_contact(FIXED, MOVING, Control.of(force=(1e6, -10e6)), settings=COARSE),
        ),
        (
            EquilibriumError,
            "load step 2 of 2: load .* cannot be balanced",
            lambda: solve_contact(
                FIXED, MOVING, [Control.of(force=(0, -10e6)), Control.of(force=(4e6, -10e6))], 0.3, COARSE
            ),
        ),
        (EquilibriumError, "finite", lambda: Control.of(force=(None, np.nan))),
        (EquilibriumError, "both a load", lambda: Control.of(force=(None, -1.0), motion=(None, -1.0))),
        (EquilibriumError, "no load step", lambda: solve_contact(FIXED, MOVING, [])),
        (ValueError, "friction", lambda: solve_contact(FIXED, MOVING, LOAD, friction=-0.1)),
        (ValueError, "friction", lambda: solve_contact(FIXED, MOVING, LOAD, friction=np.nan)),
        (ValueError, "size", lambda: Settings(size=0.0)),
        (ValueError, "accuracy", lambda: Settings(accuracy=0.0)),
        (TooLargeError, "GB", lambda: solve_contact(FIXED, MOVING, LOAD, settings=Settings(size=1e-7))),
        (OutlineError, "hub", lambda: Body(FIXED.outline, STEEL, held=None)),
        (OutlineError, "no edge is called", lambda: Body(FIXED.outline, STEEL, face="tread")),
    ],
)
def test_what_has_no_answer_is_refused_with_the_reason(error, message, call):
    with pytest.raises(error, match=message):
        call()


def test_states_that_never_settle_are_an_error_and_not_a_hang():
    control = Control.of(force=(0.6e6, -10e6))
    result = solve_contact(*non_conformal(), control, 0.3, COARSE)
    with pytest.raises(ConvergenceError, match="more steps"):
        solve_step(result.system, control, 0.3, limit=1)


def test_elements_that_no_memory_holds_are_refused_before_they_are_laid():
    with pytest.raises(TooLargeError, match="GB"):
        solve_contact(*non_conformal(), LOAD, settings=Settings(size=1e-7))


def test_stick_zones_of_a_contact_in_which_nothing_slides():
    result = solve_contact(*non_conformal(), Control.of(force=(1e5, -1e7)), np.inf, settings=COARSE)
    zones = result.stick_zones()
    assert len(zones) == len(result.patches()) == 1 and np.isfinite(zones).all()


@pytest.mark.parametrize("scale", [1e-6, 1.0, 1e3])
def test_an_overlap_is_judged_by_the_bodies_size(scale):
    """An overlap of a hundred-thousandth of the body is said at any scale where a motion presses; where a load does, it
    is none."""
    x = np.linspace(-0.015, 0.015, 241)
    lower, upper = blocks(
        scale * np.column_stack([x, x**2 / 0.2]), scale * np.column_stack([x, -(x**2) / 0.8]), height=0.02 * scale
    )
    upper = upper.moved(np.array([0.0, -1e-6 * scale]))
    by_motion = solve_contact(
        lower, upper, Control.of(motion=(None, -1e-6 * scale)), settings=Settings(size=0.4e-3 * scale)
    )
    by_load = solve_contact(
        lower, upper, Control.of(force=(None, -1e7 * scale)), settings=Settings(size=0.4e-3 * scale)
    )
    assert any("overlap" in note for note in by_motion.warnings) and not any(
        "overlap" in note for note in by_load.warnings
    )
