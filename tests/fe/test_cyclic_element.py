"""The elements of a steel with a law over cycles: the law's own point, rotation, neighbours of other laws, state."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from bem.steel.cyclic_law import update
from geometry.axes import as_tensor
from geometry.meshing.blocks import mesh_box
from geometry.meshing.hexmesh import merge_bodies
from rail_fem.fe.blocks import ElementSettings
from rail_fem.fe.checkpoint import element_state, restore_elements
from rail_fem.fe.state import LANES
from rail_fem.scene.steel import MN13, cyclic_steel
from tests.fe.bodies import STEEL, place, structure_of
from tests.fe.test_plasticity import Coupon
from tests.order import assert_order
from tests.ranks import arrays_of_ranks

QUIET = {"linear_viscosity": 0.0, "quadratic_viscosity": 0.0}
ONE, FULL = ElementSettings(**QUIET), ElementSettings(element="full", **QUIET)
CHABOCHE = {"yield_stress": 300e6, "modulus": [100e9, 20e9, 3e9], "recovery": [2000.0, 300.0, 20.0]}
LAWS = {
    "Chaboche": CHABOCHE | {"hardening": 80e6, "hardening_rate": 30.0},
    "Ohno-Wang": CHABOCHE | {"mixing": 0.0},
    "between": CHABOCHE | {"mixing": [1.0, 0.2, 0.0], "hardening": 60e6, "hardening_rate": 50.0},
}


def steel_by(law: str):
    return cyclic_steel(STEEL.youngs_modulus, STEEL.poisson, STEEL.density, **LAWS[law])


def back_stresses(structure, count):
    """(points, k, 6) of the first element [Pa]."""
    rows = structure.finite.back.reshape(-1, structure.finite.back_rows, LANES)[0, :, 0]
    return rows.reshape(structure.finite.points, -1, 6)[:, :count]


@pytest.mark.parametrize("settings", [ONE, FULL], ids=["one-point", "full"])
@pytest.mark.parametrize("law", LAWS)
def test_an_element_in_uniaxial_cycles_is_the_point_law(law, settings):
    """The same strain increments through both: stress, back stresses, plastic strain to 1e-8; the work booked is the
    sum of stress times plastic strain."""
    steel = steel_by(law)
    coupon = Coupon(steel, settings)
    stress, back, p, work, largest = np.zeros(6), np.zeros((3, 6)), 0.0, 0.0, 0.0
    for turn in (1.005, 0.994, 1.008, 0.992, 1.001):
        for stretch in np.linspace(coupon.stretch, turn, 7)[1:]:
            before = np.array([coupon.stretch, coupon.side])
            computed = coupon.pull(stretch)
            after = np.array([coupon.stretch, coupon.side])
            axial, lateral = 2 * (after - before) / (after + before)
            elastic = computed - stress[0]
            p = update(steel.cyclic, np.array([axial, lateral, lateral, 0, 0, 0]), stress, back, p)
            work += computed * (axial - elastic / STEEL.youngs_modulus) * after[0] * after[1] ** 2
            assert coupon.structure.finite.stress()[0] == pytest.approx(stress, abs=1e-8 * 300e6)
            assert coupon.structure.finite.plastic_strain()[0] == pytest.approx(p, rel=1e-8, abs=1e-14)
            for own in back_stresses(coupon.structure, 3):
                assert own == pytest.approx(back, abs=1e-8 * 300e6)
            largest = max(largest, np.abs(back).max())
    assert p > 0.02 and largest > 30e6
    assert coupon.structure.work[0] == pytest.approx(work, rel=1e-6)


def test_without_back_stresses_the_law_is_the_isotropic_one():
    flat = cyclic_steel(STEEL.youngs_modulus, STEEL.poisson, STEEL.density, yield_stress=300e6, modulus=[], recovery=[])
    curve = type(STEEL)(STEEL.youngs_modulus, STEEL.poisson, STEEL.density, [0.0, 1.0], [300e6, 300e6])
    rng = np.random.default_rng(0)
    pair = [structure_of(mesh_box((40.0, 1.0, 1.0), (40, 1, 1)), steel, settings=ONE) for steel in (flat, curve)]
    for _ in range(20):
        moved = pair[0].x.reshape(-1, 3) + 2e-3 * rng.standard_normal((len(pair[0].x) // 3, 3))
        for structure in pair:
            place(structure, moved, 1e-6)
    one, other = pair
    assert one.finite.plastic_strain().max() > 0.03
    assert one.finite.state == pytest.approx(other.finite.state, rel=1e-9, abs=1e-3)
    assert one.work == pytest.approx(other.work, rel=1e-10)


def sheared(law: str, angle: float, steps: int, settings) -> np.ndarray:
    """Stress (6,) after simple shear u = angle z along x."""
    structure = structure_of(mesh_box((1.0, 1.0, 1.0), (1, 1, 1)), steel_by(law), settings=settings)
    start = structure.x.reshape(-1, 3).copy()
    for k in range(1, steps + 1):
        place(structure, start + np.outer(start[:, 2], [angle * k / steps, 0, 0]), 1.0)
    return structure.finite.stress()[0]


def sheared_exactly(law, angle: float) -> np.ndarray:
    """The same by Runge and Kutta on the rate equations in tensors: Jaumann rates, the flow rule, each back stress."""
    gradient = np.zeros((3, 3))
    gradient[0, 2] = 1.0
    rate, spin = (gradient + gradient.T) / 2, (gradient - gradient.T) / 2
    turned = lambda a: spin @ a - a @ spin
    size = lambda a: np.sqrt(1.5 * (a * a).sum())
    k = law.modulus.size

    def rates(_, y):
        stress, back, p = y[:9].reshape(3, 3), y[9:-1].reshape(k, 3, 3), y[-1]
        normal = (stress - back.sum(axis=0)) / size(stress - back.sum(axis=0))
        isotropic = law.hardening * law.hardening_rate * np.exp(-law.hardening_rate * p)
        recovered = sum(m * g * 1.5 * (normal * b).sum() for m, g, b in zip(law.mixing, law.recovery, back))
        dp = 3 * law.shear * (normal * rate).sum() / (3 * law.shear + law.modulus.sum() - recovered + isotropic)
        grown = law.modulus[:, None, None] * normal * dp - (law.mixing * law.recovery)[:, None, None] * back * dp
        d_stress = 2 * law.shear * (rate - 1.5 * dp * normal) + turned(stress)
        return np.concatenate([d_stress.ravel(), (grown + np.array([turned(b) for b in back])).ravel(), [dp]])

    # up to yield the shear stress grows alone, but for its own turning, which the elastic rates give
    reached = law.yield_stress / np.sqrt(3) / law.shear
    elastic = lambda _, y: (2 * law.shear * rate + turned(y.reshape(3, 3))).ravel()
    until = lambda t, y: size(y.reshape(3, 3)) - law.yield_stress
    until.terminal = True
    first = solve_ivp(elastic, (0, 2 * reached), np.zeros(9), events=until, method="DOP853", rtol=1e-12, atol=1e-3)
    y = np.concatenate([first.y[:, -1], np.zeros(9 * k + 1)])
    found = solve_ivp(rates, (first.t[-1], angle), y, method="DOP853", rtol=1e-11, atol=1e-2).y[:9, -1]
    return found.reshape(3, 3)


@pytest.mark.parametrize("settings", [ONE, FULL], ids=["one-point", "full"])
def test_simple_shear_with_large_rotation_is_that_of_the_rate_equations(settings):
    """Three back stresses that turn, to a shear of 2 (the material turns by 45 degrees and more): first order in the
    step; extrapolated to 2e-4 of the yield stress. The shear stress stays below the law's bound."""
    law, angle = steel_by("Chaboche").cyclic, 2.0
    exact = sheared_exactly(law, angle)
    steps = np.array([500, 1000, 2000])
    found = [as_tensor(sheared("Chaboche", angle, int(n), settings)) for n in steps]
    found = [one - np.eye(3) * np.trace(one) / 3 for one in found]
    assert_order(1 / steps, [np.abs(one - exact).max() for one in found], expected=1)
    assert np.abs(2 * found[2] - found[1] - exact).max() < 2e-4 * law.yield_stress
    bound = (law.yield_stress + law.hardening + (law.modulus / law.recovery).sum()) / np.sqrt(3)
    assert 0.9 * bound < found[2][0, 2] < bound


@pytest.mark.parametrize("settings", [ONE, FULL], ids=["one-point", "full"])
def test_back_stresses_turn_with_the_body(settings):
    """Strained beyond yield, then turned by 90 degrees in 2000 steps: nothing yields, all of them turned."""
    structure = structure_of(mesh_box((1.0, 1.0, 1.0), (1, 1, 1)), steel_by("Chaboche"), settings=settings)
    place(structure, structure.x.reshape(-1, 3) * [1.01, 0.995, 0.995], 1.0)
    p, stress = structure.finite.plastic_strain()[0], structure.finite.stress()[0]
    backs, start = back_stresses(structure, 3).copy(), structure.x.reshape(-1, 3).copy()
    for angle in np.linspace(0, np.pi / 2, 2001)[1:]:
        c, s = np.cos(angle), np.sin(angle)
        place(structure, start @ np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]]), 1.0)
    assert p > 5e-3 and structure.finite.plastic_strain()[0] == pytest.approx(p, rel=1e-9)
    turned = [1, 0, 2, 4, 3, 5]
    assert structure.finite.stress()[0] == pytest.approx(stress[turned], abs=1e-6 * abs(stress).max())
    assert back_stresses(structure, 3) == pytest.approx(backs[..., turned], abs=1e-6 * abs(backs).max())


@pytest.mark.parametrize("settings", [ONE, FULL], ids=["one-point", "full"])
def test_every_body_follows_its_own_law_beside_others(settings):
    """Bodies by two laws over cycles, a curve that moves and one that grows, in one structure: each to the last bit as
    alone."""
    moving = type(MN13)(
        *(getattr(MN13, n) for n in ("youngs_modulus", "poisson", "density", "hardening_strain")),
        MN13.hardening_stress,
        "kinematic",
    )
    one_back = cyclic_steel(210e9, 0.3, 7850.0, yield_stress=250e6, modulus=[50e9], recovery=[200.0])
    steels = [steel_by("Chaboche"), moving, one_back, MN13]
    boxes = [mesh_box((40.0, 1.0, 1.0), (40, 1, 1), name=f"box {k}") for k in range(4)]
    together = structure_of(merge_bodies(boxes), *steels, settings=settings)
    alone = [structure_of(box, steel, settings=settings) for box, steel in zip(boxes, steels)]
    rng, count = np.random.default_rng(1), len(boxes[0].points)
    for _ in range(6):
        motion = 2e-3 * rng.standard_normal((4 * count, 3))
        place(together, together.x.reshape(-1, 3) + motion[together.domain.node_input], 1e-6)
        for k, own in enumerate(alone):
            place(own, own.x.reshape(-1, 3) + motion[k * count + own.domain.node_input], 1e-6)
    rows = np.empty((160, together.finite.rows + together.finite.back_rows))
    rows[together.domain.cell_input] = element_state(together.finite)
    for k, own in enumerate(alone):
        theirs = np.empty((40, own.finite.rows + own.finite.back_rows))
        theirs[own.domain.cell_input] = element_state(own.finite)
        width, mine = theirs.shape[1], rows[40 * k : 40 * k + 40]
        assert np.array_equal(mine[:, :width], theirs) and not mine[:, width:].any(), k
    assert together.finite.plastic_strain().min() > 0


def test_back_stresses_come_back_from_their_rows():
    """What a restart file and the next pass take: the same blocks, filled from rows of elements."""
    made = [structure_of(mesh_box((40.0, 1.0, 1.0), (40, 1, 1)), steel_by("Chaboche"), settings=ONE) for _ in range(2)]
    rng = np.random.default_rng(2)
    place(made[0], made[0].x.reshape(-1, 3) + 5e-3 * rng.standard_normal((len(made[0].x) // 3, 3)), 1e-6)
    restore_elements(made[1].finite, element_state(made[0].finite))
    assert np.array_equal(element_state(made[1].finite), element_state(made[0].finite))
    assert np.abs(made[1].finite.back).max() > 1e6


def test_slabs_outside_the_window_keep_their_back_stresses():
    """Strained as a whole, then with the middle slab alone active: the others keep every bit."""
    mesh = mesh_box((96.0, 1.0, 1.0), (96, 1, 1))
    slab = np.repeat([0, 1, 2], 32)
    structure = structure_of(mesh, steel_by("Chaboche"), settings=ONE, slab=slab)
    rng = np.random.default_rng(4)
    shake = lambda: place(structure, structure.x.reshape(-1, 3) + 5e-3 * rng.standard_normal((97 * 4, 3)), 1e-6)
    shake()
    before = element_state(structure.finite)
    structure.compute([(1, 2)])
    shake()
    after = element_state(structure.finite)
    middle = structure.finite.cell_of[LANES : 2 * LANES]
    outside = np.setdiff1d(np.arange(96), middle)
    assert np.array_equal(after[outside], before[outside]) and before[outside][:, structure.finite.rows :].any()
    assert (after[middle][:, structure.finite.rows :] != before[middle][:, structure.finite.rows :]).any()


@pytest.mark.validate
def test_a_run_is_the_same_on_two_ranks(tmp_path):
    """Only the order of sums differs: 1e-10 of each quantity's largest value."""
    one, two = (
        arrays_of_ranks(n, tmp_path / f"{n}.npz", "tests/fe/rank_job.py", tmp_path / f"{n}.npz", "cyclic")
        for n in (1, 2)
    )
    assert one["peeq"].max() > 1e-3 and two["ranks"] == 2
    for name in ("force", "x", "v", "peeq", "stress"):
        assert np.abs(two[name] - one[name]).max() <= 1e-10 * np.abs(one[name]).max(), name
