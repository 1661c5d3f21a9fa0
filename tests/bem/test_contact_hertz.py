"""Line contact of two discs by boundary elements against Hertz, in pressure, width, displacement and stress below."""

import numpy as np
import pytest

from bem.exact.hertz import line_contact_of_width
from bem.exact.subsurface import line_stress
from bem.material import STEEL, Elastic, contact_modulus
from bem.plane.contact import Settings, element_size, solve_contact
from bem.plane.coulomb import Control
from bem.plane.internal import displacement_at, field_at, stress_at
from bem.verification.exact_problems import SOFT_STEEL, disc, two_discs
from tests.bem.closed_forms import max_shear_plane

A = 1e-3  # half-width; the discs' radius is a thousand times that, the relative radius 0.5 m


def pressed(lower=SOFT_STEEL, upper=SOFT_STEEL, cells=12, **settings):
    hertz = line_contact_of_width(A, 0.5, contact_modulus(lower, upper))
    options = Settings(size=A / cells) if not settings else Settings(**settings)
    return solve_contact(*two_discs(1.0, lower, upper), Control.of(force=(None, -hertz.force)), settings=options), hertz


def test_line_contact_is_hertz_and_its_error_law_holds():
    """VERIFICATION D: 178.896 N/mm gives p0 113.889 MPa at a = 1 mm; gate 1 %. Error of p0 <= (h/a)^2 / 2, of the
    profile in L2 of order >= 1."""
    cells, profile = np.array([3, 6, 12, 24, 48]), []
    for n in cells:
        result, hertz = pressed(cells=n)
        state, x = result.last, result.interface.points[:, 0]
        # 1e-4 is left for the discs' finite radius and the phase of the nodes about the middle
        assert state.pressure.max() == pytest.approx(hertz.max_pressure, rel=0.5 / n**2 + 1e-4)
        miss, mass = state.pressure - hertz.pressure(x), result.interface.mass
        profile.append(np.sqrt(np.sum(mass * miss**2) / np.sum(mass * hertz.pressure(x) ** 2)))
    assert hertz.force == pytest.approx(178.896e3, rel=1e-5)
    assert profile[-1] < 0.02
    # the edge moves against the nodes, so single pairs scatter: the order is taken over all
    assert -np.polyfit(np.log(cells), np.log(profile), 1)[0] > 1.0


@pytest.mark.parametrize("cells", [6, 12, 24])
def test_contact_width_is_found_within_a_part_of_an_element(cells):
    result, _ = pressed(cells=cells)
    (patch,) = result.patches()
    assert patch.width / 2 == pytest.approx(A, abs=0.25 * A / cells)


def test_forces_balance_to_round_off():
    result, hertz = pressed()
    np.testing.assert_allclose(result.force()[:2], [0, hertz.force], atol=1e-11 * hertz.force)
    np.testing.assert_allclose(result.patches()[0].force, [0, hertz.force], atol=1e-11 * hertz.force)
    given, taken = result.interface.on_slave.sum(axis=0), result.interface.on_master.sum(axis=0)
    np.testing.assert_allclose(given, taken, atol=1e-12 * given.max())


def test_stress_below_a_line_contact():
    """VERIFICATION D: tau_max 0.30028 p0 at 0.786 a; von Mises 0.5575 p0 at 0.704 a for nu 0.3; gate 1 %."""
    result, hertz = pressed(STEEL, STEEL, cells=12)
    depth = np.linspace(0.3, 1.5, 241) * A
    field = field_at(result.solution("fixed"), np.column_stack([np.zeros_like(depth), -depth]))
    shear = max_shear_plane(*field.stress.T)
    assert shear.max() / hertz.max_pressure == pytest.approx(0.30028, rel=0.01)
    assert depth[shear.argmax()] / A == pytest.approx(0.786, abs=0.02)
    assert field.von_mises.max() / hertz.max_pressure == pytest.approx(0.5575, rel=0.01)
    assert depth[field.von_mises.argmax()] / A == pytest.approx(0.704, abs=0.02)


@pytest.mark.parametrize("body, side", [("fixed", -1), ("moving", 1)])
def test_stress_everywhere_below_a_line_contact(body, side):
    """From the surface to three half-widths: 1.5 % of p0 (the edge of the patch falls between nodes), 0.5 % below a
    quarter of a."""
    result, hertz = pressed(cells=12)
    x, depth = np.meshgrid(np.linspace(-1.5, 1.5, 31) * A, np.r_[0, 1e-3, 0.01, 0.05, 0.1, 0.25, 0.5, 1, 2, 3] * A)
    points = np.stack([x, side * (depth + x**2 / 2)], axis=-1)  # the surface of a disc of 1 m
    xx, zz, xz = line_stress(x, depth, A, hertz.max_pressure)
    miss = np.abs(
        stress_at(result.solution(body), points.reshape(-1, 2)).reshape(*x.shape, 3)
        - np.stack([xx, zz, -side * xz], axis=-1)
    )
    error = miss.max(axis=(1, 2)) / hertz.max_pressure
    assert error[depth[:, 0] >= 0.25 * A].max() < 0.005
    inner = miss[:, np.abs(x[0]) < 0.85 * A].max() / hertz.max_pressure
    assert inner < 0.015


def test_accuracy_asked_for_is_reached():
    """The mesh is chosen from the estimate of the patch; the error of p0 then stays below what was asked."""
    for accuracy in (0.03, 0.01, 0.002):
        result, hertz = pressed(accuracy=accuracy)
        assert abs(result.last.pressure.max() / hertz.max_pressure - 1) < accuracy
        assert not result.warnings


def test_unlike_materials_share_the_load_as_the_contact_modulus_says():
    """No friction: pressure depends on E* alone; E 210 on 190 GPa and steel on a rigid body, either way round."""
    for lower, upper in (
        (STEEL, Elastic(190e9, 0.3)),
        (Elastic(190e9, 0.3), STEEL),
        (STEEL, Elastic(210e15, 0.3)),
        (Elastic(210e15, 0.3), STEEL),
    ):
        result, hertz = pressed(lower, upper)
        assert result.last.pressure.max() == pytest.approx(hertz.max_pressure, rel=0.005)
        assert result.patches()[0].width / 2 == pytest.approx(A, rel=0.02)


def test_displacement_is_hertz_up_to_a_constant():
    """VERIFICATION D: only differences count. Inside the patch both surfaces meet: their sum is x^2 / 2R plus a
    constant."""
    result, hertz = pressed()
    x = np.linspace(-0.8, 0.8, 17) * A
    surface = np.column_stack([x, np.zeros_like(x)])
    curve = x**2 / 2
    lower = displacement_at(result.solution("fixed"), surface - np.column_stack([0 * x, curve]))[:, 1]
    upper = displacement_at(result.solution("moving"), surface + np.column_stack([0 * x, curve]))[:, 1]
    gap = upper - lower + 2 * curve
    assert np.abs(gap).max() < 0.002 * A**2  # of a^2/2R = a^2: interpolation between nodes (h/a)^2 / 8
    assert lower[8] - lower[0] == pytest.approx(-curve[0], rel=0.01)  # the interface of equal bodies is flat


def test_load_order_and_place_do_not_matter():
    """The same discs, 5 mm apart, touching, or overlapping by 1 um and 1 mm before the load: one answer, without
    friction."""
    lower, upper = two_discs(1.0, STEEL, STEEL)
    hertz = line_contact_of_width(A, 0.5, contact_modulus(STEEL, STEEL))
    answers = [
        solve_contact(
            lower,
            upper.moved(np.array([0.0, lift])),
            Control.of(force=(None, -hertz.force)),
            settings=Settings(size=A / 6),
        )
        for lift in (5e-3, 0.0, -1e-6, -1e-3)
    ]
    np.testing.assert_allclose([answer.initial_approach[1] for answer in answers], [-5e-3, 0, 1e-6, 1e-3], atol=1e-9)
    for answer in answers[1:]:
        assert answer.last.pressure.max() == pytest.approx(answers[0].last.pressure.max(), rel=1e-6)


def test_motion_driven_contact_finds_the_load_of_the_load_driven_one():
    lower, upper = two_discs(1.0, STEEL, STEEL)
    by_load = solve_contact(lower, upper, Control.of(force=(None, -3e5)), settings=Settings(size=A / 6))
    by_motion = solve_contact(
        lower,
        upper.moved(np.array([0, 1e-6])),
        Control.of(motion=(None, by_load.last.motion[1] - 1e-6)),
        settings=Settings(size=A / 6),
    )
    # the meshes differ a little, and with them the log-like approach
    assert by_motion.force()[1] == pytest.approx(3e5, rel=0.01)


def test_element_size_follows_the_law():
    assert element_size(1.0, 0.005) == pytest.approx(0.1)
    assert element_size(1.0, 0.2) == pytest.approx(1 / 3)


def test_wheel_on_its_hub_is_hertz_too():
    """A disc of 0.46 m held at its axle on a disc of 0.3 m: relative radius 0.18158 m, E* of steel."""
    lower, upper = disc((0, -0.3), 0.3, STEEL, top=False, points=2001), disc((0, 0.46), 0.46, STEEL, points=2001)
    result = solve_contact(lower, upper, Control.of(force=(None, -1e6)), settings=Settings(accuracy=0.002))
    radius = 1 / (1 / 0.3 + 1 / 0.46)
    assert result.last.pressure.max() == pytest.approx(
        np.sqrt(1e6 * contact_modulus(STEEL, STEEL) / (np.pi * radius)), rel=0.002
    )
