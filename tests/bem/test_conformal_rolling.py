"""Rolling on patches laid along a rounding: creepages of strips, their limits, and CONTACT's conformal example."""

from dataclasses import dataclass, replace

import numpy as np
import pytest

from bem.creepage import LocalCreepage
from bem.halfspace.fastsim import elliptic_patch, fastsim
from bem.halfspace.normal import normal_contact
from bem.halfspace.rolled_ellipses import rolled_ellipses
from bem.halfspace.tangential import rolling_contact
from bem.material import STEEL, Elastic
from bem.patch import ContactInputError, Creepage, Grid
from tests.order import assert_order

SEMI_X, SEMI_Y, LOAD = 6e-3, 4e-3, 5e4
FLAT = Creepage(8e-4, -4e-4, 0.4)
Y = np.linspace(-5e-3, 5e-3, 31)

# CONTACT's example "conformal" (github.com/eve70a/CONTACT, examples/conformal.inp and conformal.ref_out, revision 2356;
# Vollebregt and Segal, VSD 52 suppl. 1 (2014) 455): a rail rounded by 10 mm under a wheel hollow by 10.2 mm, 460 mm
# radius, at 45 degrees; patch coordinate along the mean arc of 10.1 mm.
ARC, RADIUS, ANGLE = 10.1e-3, 0.46, np.pi / 4
STEEL_82 = Elastic(2 * 82e9 * 1.28, 0.28)
GRID = Grid(-10e-3, -7.6e-3, 0.4e-3, 0.4e-3, 51, 39)
PENETRATED = 1e-6 * np.array(  # gap at x = 0 from the middle outwards, every 0.4 mm, as given there [m]
    [-90.8860, -90.65786, -89.97365, -88.83393, -87.23969, -85.19227, -82.69341, -79.74523, -76.35024, -72.51131,
     -68.23168, -63.51499, -58.36522, -52.78672, -46.78420, -40.36271, -33.52765, -26.28477, -18.64015, -10.60019]
)  # fmt: skip


def on_arc(y: np.ndarray, radius: float = ARC, angle: float = ANGLE) -> tuple[np.ndarray, np.ndarray]:
    """Points and outward normals of a convex arc whose normal at y = 0 leans by -angle."""
    lean = angle - y / radius
    normals = np.column_stack([-np.sin(lean), np.cos(lean)])
    return radius * normals, normals


@dataclass(frozen=True)
class RigidMotion:
    """Of body 1 over body 2 per rolling speed, in the axes x, lateral, up: velocity (3,) at the origin of the section's
    frame [1], rotation (3,) [1/m]."""

    velocity: tuple[float, float, float] = (0.0, 0.0, 0.0)
    rotation: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def creepage(self, y: np.ndarray, points: np.ndarray, normals: np.ndarray) -> LocalCreepage:
        """Of strips at the patch's coordinate y (m,), at points (m, 2) [m] of the section with unit normals (m, 2) out
        of body 2 (bem.slices.coupled.SlicePatch has all three)."""
        (a, z), (n, up) = np.asarray(points, float).T, np.asarray(normals, float).T
        v, w = self.velocity, self.rotation
        return LocalCreepage(
            y, v[0] + w[1] * z - w[2] * a, v[1] * up - v[2] * n - w[0] * (a * n + z * up), w[1] * n + w[2] * up
        )


def wheel_motion(longitudinal: float, yaw: float) -> RigidMotion:
    """Of a wheel of RADIUS that has this longitudinal slip where the arc's y = 0 is."""
    height = ARC * np.cos(ANGLE)
    return RigidMotion((longitudinal - height / RADIUS, -yaw, 0.0), (0.0, 1 / RADIUS, 0.0))


def of_strips(creepage: Creepage, y: np.ndarray = Y) -> LocalCreepage:
    """The same creepage, strip by strip."""
    one = np.ones_like(y)
    return LocalCreepage(y, creepage.longitudinal - creepage.spin * y, creepage.lateral * one, creepage.spin * one)


def test_a_rigid_motion_slips_along_the_arc_as_its_velocity_does():
    """At random places: components of v + w x r along x and along the tangent; d longitudinal / dy = -spin."""
    motion = RigidMotion((0.01, -0.02, 0.03), (0.5, -0.7, 0.9))
    points, normals = on_arc(Y)
    local = motion.creepage(Y, points, normals)
    for x, j in ((0.0, 3), (2e-3, 10), (-4e-3, 25)):
        place = np.array([x, *points[j]])
        velocity = np.array(motion.velocity) + np.cross(motion.rotation, place)
        tangent = np.array([0.0, normals[j, 1], -normals[j, 0]])
        assert local.rigid_slip(np.array(x), Y[j]) == pytest.approx([velocity[0], velocity @ tangent], abs=1e-15)
    fine = np.linspace(Y[0], Y[-1], 4001)
    strips = motion.creepage(fine, *on_arc(fine)).strips(fine)
    np.testing.assert_allclose(np.gradient(strips[:, 0], fine, edge_order=2), -strips[:, 2], atol=1e-6)


def hertz(cells: int):
    return elliptic_patch(SEMI_X, SEMI_Y, LOAD, (cells, cells))


@pytest.mark.parametrize("direction", [1, -1])
def test_strips_of_one_creepage_are_the_plane_patch(direction):
    """FASTSIM and half-space, field by field to round-off; a row of ellipses too."""
    for solve in (fastsim, rolling_contact):
        one, other = (
            solve(hertz(24), STEEL, STEEL, 0.3, c, direction=direction, estimate=False) for c in (FLAT, of_strips(FLAT))
        )
        scale = one.pressure.max()
        np.testing.assert_allclose(other.traction, one.traction, atol=1e-9 * scale)
        np.testing.assert_allclose(other.slip, one.slip, atol=1e-10)
        assert other.local_creepage is not None and one.local_creepage is None
    semi, rows = np.array([[SEMI_X, SEMI_Y]]), np.array([[FLAT.longitudinal, FLAT.lateral, FLAT.spin]])
    y = hertz(24).grid.y
    row = rolled_ellipses(
        semi,
        np.array([LOAD]),
        STEEL,
        STEEL,
        0.3,
        rows,
        (24, 24),
        direction=direction,
        strips=of_strips(FLAT).strips(y)[None],
    )
    alone = fastsim(hertz(24), STEEL, STEEL, 0.3, FLAT, direction=direction, estimate=False)
    np.testing.assert_allclose(row.traction[0], alone.traction, atol=1e-9 * alone.pressure.max())


def test_a_flat_arc_becomes_the_plane_patch_in_first_order_of_its_curvature():
    """A wheel on arcs of 1, 2 and 4 m, all in stick: the change of tractions by the spin across the patch is of 1/R."""
    change, radii = [], np.array([1.0, 2.0, 4.0])
    rolled = lambda creepage: fastsim(hertz(24), STEEL, STEEL, 1e3, creepage, estimate=False).traction
    want = rolled(Creepage(2e-4, 0.0, np.sin(0.3) / RADIUS))
    for radius in radii:
        points, normals = on_arc(Y, radius, -0.3)
        motion = RigidMotion((2e-4 - points[15, 1] / RADIUS, 0.0, 0.0), (0.0, 1 / RADIUS, 0.0))
        change.append(np.linalg.norm(rolled(motion.creepage(Y, points, normals)) - want))
    assert_order(1 / radii, change, expected=1, slack=0.02)


@pytest.mark.parametrize("solve", [fastsim, rolling_contact])
def test_what_holds_for_any_strips(solve):
    """Mirror of the section turns lateral forces; no slip gives no traction; friction only takes energy; in full
    sliding the tractions' lengths sum to mu N."""
    points, normals = on_arc(Y)
    local = wheel_motion(-1e-3, 2e-3).creepage(Y, points, normals)
    patch = hertz(20)
    one = solve(patch, STEEL, STEEL, 0.3, local, estimate=False)
    seen = LocalCreepage(Y, local.longitudinal[::-1], -local.lateral[::-1], -local.spin[::-1])
    other = solve(patch, STEEL, STEEL, 0.3, seen, estimate=False)
    np.testing.assert_allclose(other.traction[:, ::-1] * [1, -1], one.traction, atol=1e-4 * one.pressure.max())
    none = solve(patch, STEEL, STEEL, 0.3, of_strips(Creepage()), estimate=False)
    assert not none.traction.any() and none.frictional_power == 0
    lost = -(one.traction * one.slip).sum(axis=-1)
    assert lost.min() >= -1e-9 * one.pressure.max() and one.frictional_power > 0
    fast = wheel_motion(-0.05, 0.2).creepage(Y, points, normals)
    slid = solve(patch, STEEL, STEEL, 0.3, fast, estimate=False)
    carried = np.linalg.norm(slid.traction, axis=-1).sum() * patch.grid.cell_area
    assert carried == pytest.approx(0.3 * LOAD, rel=1e-6)


@pytest.mark.parametrize(
    "rows, said",
    [
        ((Y, Y), "four of one length"),
        ((Y[::-1],) * 4, "must rise"),
        ((Y[:1],) * 4, ">= 2"),
        ((Y, np.full_like(Y, np.nan), Y, Y), "finite"),
    ],
)
def test_strips_that_are_none_are_refused(rows, said):
    with pytest.raises((ContactInputError, TypeError), match=said if len(rows) == 4 else "missing"):
        LocalCreepage(*rows)


def test_a_lateral_force_of_strips_is_refused():
    with pytest.raises(ContactInputError, match="strips of their own normals"):
        rolling_contact(hertz(10), STEEL, STEEL, 0.3, of_strips(FLAT), (None, 1e3))
    with pytest.raises(ContactInputError, match="strips of shape"):
        rolled_ellipses(
            np.ones((1, 2)) * 1e-3,
            np.ones(1),
            STEEL,
            STEEL,
            0.3,
            np.zeros((1, 3)),
            (12, 12),
            strips=np.zeros((1, 3, 3)),
        )


@pytest.fixture(scope="module")
def conformal():
    """Half-space pressure of the example at its approach."""
    rows = np.concatenate([PENETRATED[:0:-1], PENETRATED])
    gap = rows[None, :] + np.cos(ANGLE) / (2 * RADIUS) * GRID.x[:, None] ** 2
    return normal_contact(gap, STEEL_82, STEEL_82, approach=0.0, grid=GRID, estimate=False)


def test_conformal_example_of_contact_on_the_half_space(conformal):
    """Its cases 2 (one creepage) and 4 (of each strip): normal force, largest pressure, forces, spin moment, power at
    30 m/s, printed with four digits. Strips' slip is given there at the cells' centres: 0.05 %. Of one creepage it is
    not said where: half a cell's spin is 1 %, so 0.2 % of mu N."""
    bound = 0.3 * conformal.normal_force
    assert conformal.normal_force == pytest.approx(91.84e3, rel=5e-4)
    assert conformal.max_pressure == pytest.approx(1012e6, rel=5e-4)
    local = wheel_motion(-4e-3, 14e-3).creepage(GRID.y, *on_arc(GRID.y))
    local = replace(local, lateral=local.lateral - local.spin * GRID.dx / 4)
    rolled = rolling_contact(conformal, STEEL_82, STEEL_82, 0.3, local, estimate=False)
    assert rolled.tangential_force == pytest.approx([10500, 22510], rel=5e-4)
    assert rolled.moment[2] == pytest.approx(32.27, rel=5e-4)
    assert rolled.frictional_power * 30 == pytest.approx(9726, rel=5e-4)
    flat = rolling_contact(conformal, STEEL_82, STEEL_82, 0.3, Creepage(-4e-3, -9.8995e-3, -1.5372), estimate=False)
    assert flat.tangential_force == pytest.approx([8959, 24170], abs=2e-3 * bound)
    assert flat.moment[2] == pytest.approx(26.76, rel=1e-2)
    assert flat.frictional_power * 30 == pytest.approx(9466, rel=5e-3)
