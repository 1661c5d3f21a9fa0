"""J2 plasticity through the element kernel: closed forms and the yield surface."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import brentq

from bem.exact.subsurface import von_mises
from geometry.meshing.blocks import mesh_box
from rail_fem.scene.steel import MN13, cyclic_steel
from tests.fe.bodies import NO_VISCOSITY, STEEL, place, plastic, structure_of
from tests.order import assert_order


class Coupon:
    """One cube pulled along x, its sides free: each pull finds the side that leaves no lateral stress."""

    def __init__(self, steel, settings=NO_VISCOSITY):
        self.structure = structure_of(mesh_box((1.0, 1.0, 1.0), (1, 1, 1)), steel, settings=settings)
        self.corners = self.structure.x.reshape(-1, 3).copy()
        self.stretch, self.side, self.strain = 1.0, 1.0, 0.0

    def pull(self, stretch):
        """Axial stress [Pa] after stretching to `stretch`; `strain` adds up the kernel's own increments, 2 (b - a) / (b
        + a)."""
        structure = self.structure
        kept = structure.x, structure.finite.state, structure.finite.back, structure.block_work
        saved = [array.copy() for array in kept]

        def lateral_stress(side):
            for array, before in zip(kept, saved, strict=True):
                array[:] = before
            place(structure, self.corners * [stretch, side, side], 1.0)
            return structure.finite.stress()[0, 1]

        change = abs(stretch - self.stretch)
        self.side = brentq(lateral_stress, self.side - change, self.side + change, xtol=1e-16, rtol=1e-15)
        lateral_stress(self.side)
        self.strain += 2 * (stretch - self.stretch) / (stretch + self.stretch)
        self.stretch = stretch
        return structure.finite.stress()[0, 0]


@pytest.mark.parametrize("steps", [1, 7])
def test_cyclic_uniaxial_loading_follows_the_closed_form(steps):
    """Isotropic linear hardening: |trial| beyond the yield stress returns by dp = (|trial| - yield) / (E + H), whatever
    the steps."""
    yield_stress, hardening, modulus = 300e6, 10e9, STEEL.youngs_modulus
    coupon = Coupon(plastic(STEEL, yield_stress, hardening))
    stress, strain, p = 0.0, 0.0, 0.0
    for turn in (1.005, 0.994, 1.008, 0.990, 1.0):
        for stretch in np.linspace(coupon.stretch, turn, steps + 1)[1:]:
            computed = coupon.pull(stretch)
        trial = stress + modulus * (coupon.strain - strain)
        dp = max(abs(trial) - (yield_stress + hardening * p), 0.0) / (modulus + hardening)
        stress, strain, p = trial - np.sign(trial) * modulus * dp, coupon.strain, p + dp
        assert computed == pytest.approx(stress, rel=1e-8)
        assert coupon.structure.finite.plastic_strain()[0] == pytest.approx(p, rel=1e-8)
    assert p > 0.03


def linear_kinematic(law: str, yield_stress: float, hardening: float):
    """The steel whose elastic range moves by H dp: by its curve, or by one back stress without recovery."""
    if law == "curve":
        return replace(plastic(STEEL, yield_stress, hardening), hardening="kinematic")
    constants = {"yield_stress": yield_stress, "modulus": [hardening], "recovery": [0.0]}
    return cyclic_steel(STEEL.youngs_modulus, STEEL.poisson, STEEL.density, **constants)


@pytest.mark.parametrize("law", ["curve", "back stress"])
@pytest.mark.parametrize("steps", [1, 7])
def test_cyclic_uniaxial_loading_with_kinematic_hardening_follows_the_closed_form(steps, law):
    """Linear hardening: the elastic range keeps its size 2 yield and its centre moves by H dp, |trial - centre| beyond
    it returns by dp."""
    yield_stress, hardening, modulus = 300e6, 10e9, STEEL.youngs_modulus
    coupon = Coupon(linear_kinematic(law, yield_stress, hardening))
    stress, centre, strain, p = 0.0, 0.0, 0.0, 0.0
    for turn in (1.005, 0.994, 1.008, 0.990, 1.0):
        for stretch in np.linspace(coupon.stretch, turn, steps + 1)[1:]:
            computed = coupon.pull(stretch)
        trial = stress + modulus * (coupon.strain - strain)
        side = np.sign(trial - centre)
        dp = max(abs(trial - centre) - yield_stress, 0.0) / (modulus + hardening)
        stress, centre, strain, p = trial - side * modulus * dp, centre + side * hardening * dp, coupon.strain, p + dp
        assert computed == pytest.approx(stress, rel=1e-8)
        assert coupon.structure.finite.plastic_strain()[0] == pytest.approx(p, rel=1e-8)
    assert p > 0.03


@pytest.mark.parametrize("rule", ["isotropic", "kinematic"])
@pytest.mark.parametrize("plane", [(0, 1), (1, 2), (2, 0)])
def test_plastic_work_in_shear_is_the_area_under_the_curve(rule, plane):
    """Y p + H p^2 / 2 a volume, in shear as in tension, p = (sqrt(3) G g - Y) / (3 G + H) at a shear angle g; the
    steps' ends add 1 / steps of the rise."""
    yield_stress, shear, angle, steps = 1e5, STEEL.elastic.shear, 2e-5, 200
    hardening = 3 * shear
    structure = structure_of(
        mesh_box((1.0, 1.0, 1.0), (1, 1, 1)),
        replace(plastic(STEEL, yield_stress, hardening), hardening=rule),
        settings=NO_VISCOSITY,
    )
    start, sheared = structure.x.reshape(-1, 3).copy(), np.zeros((3, 3))
    sheared[plane] = sheared[plane[::-1]] = angle / 2
    for k in range(1, steps + 1):
        place(structure, start + start @ sheared * k / steps, 1.0)
    p = (np.sqrt(3) * shear * angle - yield_stress) / (3 * shear + hardening)
    assert structure.finite.plastic_strain()[0] == pytest.approx(p, rel=1e-4)  # strains of 1e-5
    assert hardening * p > 5 * yield_stress
    assert structure.work[0] == pytest.approx(yield_stress * p + hardening * p**2 / 2, rel=1 / steps)


def test_back_stress_turns_with_the_body():
    """Strained beyond yield, then turned by 90 degrees in 2000 steps: the centre of the elastic range turned too, so
    nothing yields."""
    structure = structure_of(
        mesh_box((1.0, 1.0, 1.0), (1, 1, 1)),
        replace(plastic(STEEL, 300e6, 10e9), hardening="kinematic"),
        settings=NO_VISCOSITY,
    )
    place(structure, structure.x.reshape(-1, 3) * [1.01, 0.995, 0.995], 1.0)
    p, stress, start = (
        structure.finite.plastic_strain()[0],
        structure.finite.stress()[0],
        structure.x.reshape(-1, 3).copy(),
    )
    for angle in np.linspace(0, np.pi / 2, 2001)[1:]:
        c, s = np.cos(angle), np.sin(angle)
        place(structure, start @ np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]]), 1.0)
    assert p > 5e-3 and structure.finite.plastic_strain()[0] == pytest.approx(p, rel=1e-9)
    assert structure.finite.stress()[0] == pytest.approx(stress[[1, 0, 2, 4, 3, 5]], abs=1e-6 * abs(stress).max())


def test_a_tensile_test_gives_back_the_tabulated_curve():
    """Mn13: strain = stress / E + plastic strain, stress = the curve at that plastic strain, across its corners."""
    coupon = Coupon(MN13)
    for stretch in np.linspace(1.0, 1.3, 40)[1:]:
        stress = coupon.pull(stretch)
        p = coupon.structure.finite.plastic_strain()[0]
        assert p == pytest.approx(coupon.strain - stress / MN13.youngs_modulus, abs=1e-9)
        assert stress == pytest.approx(MN13.yield_stress(p), rel=1e-8) or p == 0.0


@pytest.mark.parametrize(
    "steel, stretches",
    [
        (replace(STEEL, hardening_strain=(0.0, 0.01), hardening_stress=(300e6, 400e6)), np.linspace(1.0, 1.03, 7)),
        (MN13, np.geomspace(1.0, 2.0, 40)),
    ],
    ids=["a table that ends at 1 %", "Mn13, whose table ends at 50 %"],
)
def test_beyond_the_end_of_its_hardening_table_a_bar_flows_at_the_last_stress(steel, stretches):
    """All strain beyond the end is plastic, stress the table's last; the isotropic and the kinematic return alike. The
    bar's axes do not turn, so that its increments add up: no error but round-off and the search for its side."""
    last, end = steel.hardening_stress[-1], steel.hardening_strain[-1]
    for rule in ("isotropic", "kinematic"):
        coupon = Coupon(replace(steel, hardening=rule))
        for stretch in stretches[1:]:
            stress = coupon.pull(stretch)
        p = coupon.structure.finite.plastic_strain()[0]
        assert p > 1.2 * end and stress == pytest.approx(last, rel=1e-8)
        assert p == pytest.approx(coupon.strain - last / steel.youngs_modulus, abs=1e-9)


def corner_error(steps):
    """Sheared to yield, then stretched at constant volume: error of the angle between stress and strain rate."""
    yield_stress, shear = 1e5, STEEL.elastic.shear
    structure = structure_of(mesh_box((1.0, 1.0, 1.0), (1, 1, 1)), plastic(STEEL, yield_stress), settings=NO_VISCOSITY)
    start = structure.x.reshape(-1, 3).copy()
    gamma = yield_stress / np.sqrt(3) / shear
    sheared = np.array([[0.0, gamma / 2, 0.0], [gamma / 2, 0.0, 0.0], [0.0, 0.0, 0.0]])
    place(structure, start + start @ sheared, 1.0)
    strain = yield_stress / shear / 2
    for k in range(1, steps + 1):
        place(structure, start + start @ (sheared + strain * k / steps * np.diag([1.0, -0.5, -0.5])), 1.0)
    stress = structure.finite.stress()[0]
    angle = np.arccos(1.5 * (stress[0] - stress[:3].mean()) / yield_stress)
    exact = 2 * np.arctan(np.exp(-2 * shear * np.sqrt(1.5) * strain / (np.sqrt(2 / 3) * yield_stress)))
    return angle - exact


def test_a_corner_in_the_strain_path_converges_with_first_order():
    """Perfect plasticity at constant strain rate: tan(angle / 2) falls as exp(-2 G e / R) (Krieg & Krieg, J. Press.
    Vessel Technol. 99 (1977) 510)."""
    steps = np.array([20, 40, 80])
    assert_order(1 / steps, [corner_error(n) for n in steps], expected=1)


@pytest.mark.parametrize("seed", range(5))
def test_stress_never_leaves_the_yield_surface(seed):
    """Random affine increments of up to 5 % in 64 cubes: von Mises <= yield stress, plastic strain and work never
    fall."""
    rng = np.random.default_rng(seed)
    structure = structure_of(mesh_box((64.0, 1.0, 1.0), (64, 1, 1)), MN13)
    size, p, work = 10.0 ** rng.uniform(-2.5, np.log10(0.05)), np.zeros(64), 0.0
    for _ in range(50):
        points = structure.x.reshape(-1, 3)
        place(
            structure,
            points @ (np.eye(3) + size * rng.uniform(-1, 1, (3, 3))) + 0.2 * size * rng.standard_normal(points.shape),
            1e-6,
        )
        grown, booked = structure.finite.plastic_strain(), structure.work[0]
        assert (von_mises(structure.finite.stress()) <= MN13.yield_stress(grown) * (1 + 1e-12)).all()
        assert (grown >= p).all() and booked >= work
        p, work = grown, booked
    assert p.max() > 0
