"""The static finite element contact in three dimensions on its own: exact strain, its preconditioner, Hertz' ellipse,
what it refuses."""

import numpy as np
import pytest

from bem.exact.hertz import point_contact
from bem.material import STEEL, Elastic, contact_modulus
from bem.patch import ContactInputError
from bem.steel.hardening import Hardening
from geometry.meshing.blocks import mesh_block, mesh_box
from geometry.meshing.hexmesh import MeshError
from rail_fem.result.extrapolation import extrapolated
from rail_fem.static_fe.box_inverse import BoxInverse
from rail_fem.static_fe.small_strain import HeldMotions, solid
from rail_fem.static_fe.solid_blocks import BlockPair, FineZone, facing_blocks
from rail_fem.static_fe.solid_contact import finite_patch

WHEEL, RAIL, LOAD, HALF = 0.46, 0.30, 1e5, 0.08


def ellipse(lower_steel=STEEL) -> tuple[BlockPair, object]:
    """Wheel radius 460 on rail radius 300 mm, blocks 160 mm wide and 80 mm deep, and Hertz' answer."""
    pair = BlockPair(
        lambda x, s: -(s**2) / (2 * RAIL) + 0 * x,
        lambda x, s: x**2 / (2 * WHEEL) + 0 * s,
        (-HALF, HALF),
        (-HALF, HALF),
        HALF,
        HALF,
        lower_steel,
    )
    return pair, point_contact(LOAD, WHEEL, RAIL, contact_modulus(STEEL, lower_steel))


def test_a_pulled_bar_of_solids_flows_along_its_curve():
    """Uniaxial stress: s = Y + H p with p = e - s / E, so the end's force is that of s = (Y + H e) / (1 + H / E)."""
    limit, slope, strain = 300e6, 5e9, 5e-3
    bar = mesh_box((2.0, 1.0, 1.0), (2, 1, 1))
    body = solid(bar, STEEL, Hardening.linear(limit, slope), mean_dilatation=True)
    x, y, z = bar.points.T
    end, still = 3 * np.flatnonzero(x == 2.0), [3 * np.flatnonzero(x == 0), 3 * np.flatnonzero(y == 0) + 1]
    dofs = np.r_[np.concatenate([*still, 3 * np.flatnonzero(z == 0) + 2]), end]
    held = HeldMotions.still(dofs, body.count)
    held.target[-len(end) :] = 2.0 * strain
    found = body.equilibrium(held, body.at_rest())
    exact = (limit + slope * strain) / (1 + slope / STEEL.young)
    assert found.force[end].sum() == pytest.approx(exact, rel=1e-9)
    assert found.answer.plastic.peeq == pytest.approx(strain - exact / STEEL.young, rel=1e-9)


def zone(exact, across: float) -> FineZone:
    """`across` elements over the smaller semi-axis; outer elements grow by 1.4 at 4 across and the slower the finer
    they are."""
    size = exact.semi_y / across
    along, half, down = (
        np.ceil(reach / size) * size for reach in (1.15 * exact.semi_x, 1.15 * exact.semi_y, 0.5 * exact.semi_y)
    )
    return FineZone(along, (-half, half), down, size, size, 1 + 1.6 / across)


def hertz_errors(across: float) -> tuple[float, float, float, float]:
    """Relative errors of pressure, area, length and width."""
    pair, exact = ellipse()
    patch = finite_patch(pair, LOAD, zone(exact, across))
    assert patch.normal_force == pytest.approx(LOAD, rel=1e-5)
    return (
        patch.max_pressure / exact.max_pressure - 1,
        patch.contact_area / exact.area - 1,
        patch.extent[0] / (2 * exact.semi_x) - 1,
        patch.extent[1] / (2 * exact.semi_y) - 1,
    )


def test_a_linear_displacement_needs_no_inner_forces_on_a_warped_block():
    x, s, z = np.array([0, 1.0, 3]), np.array([-1.0, 0, 2, 3]), np.array([0, 1.0, 2])
    mesh = mesh_block(lambda x, s: 0.1 * x**2 - 0.3 * s, x, s, z, "up", "block")
    gradient = np.array([[1e-3, 3e-4, 0], [2e-4, -5e-4, 1e-4], [0, 4e-4, 2e-4]])
    force = (solid(mesh, STEEL).stiffness() @ (mesh.points @ gradient.T).ravel()).reshape(-1, 3)
    inner = (mesh.points[:, 0] == 1) & np.isin(mesh.points[:, 1], [0, 2])
    inner &= np.bincount(mesh.cells.ravel()) == 8
    assert inner.any() and np.abs(force[inner]).max() < 1e-12 * np.abs(force).max()


def test_the_preconditioner_knows_its_own_face():
    x, s, z = np.array([0, 1.0, 3]), np.array([0, 1.0, 1.5, 4]), np.array([0, 0.5, 2])
    inverse = BoxInverse(x, s, z, STEEL)
    i, j = np.array([1, 2, 0]), np.array([3, 1, 0])
    for component in range(3):
        at = 3 * ((i * 4 + j) * 3) + component
        whole = np.array([inverse(np.eye(108)[position])[at] for position in at])
        np.testing.assert_allclose(inverse.between_face_nodes(component, i, j), whole, atol=1e-12 * np.abs(whole).max())


def test_pressure_and_area_close_on_hertz():
    """3 and 6 elements over the smaller semi-axis: pressure second order, at most 0.06 (element / semi-axis)^2; area
    first order, since its edge lies between two nodes: a sixth of an element all around; length and width a seventh of
    an element."""
    coarse, fine = np.array([hertz_errors(n) for n in (3, 6)])
    assert abs(fine[0]) < abs(coarse[0]) / 4 and abs(coarse[0]) < 0.06 / 3**2 and abs(fine[0]) < 0.06 / 6**2
    assert 0 < fine[1] < 2 / 6 / 6 and np.abs(fine[2:]).max() < 1 / (7 * 6)


@pytest.mark.validate
def test_hertz_to_fourteen_elements():
    """Pressure 0.05 % at 8 elements, 0.02 % beyond; area within a sixth of an element all around."""
    for across, asked in ((8, 5e-4), (8 * np.sqrt(2), 2e-4), (14, 2e-4)):
        pressure, area, length, width = hertz_errors(across)
        assert abs(pressure) < asked and 0 < area < 2 / 6 / across
        assert max(abs(length), abs(width)) < 1 / (7 * across)


def test_a_nose_with_two_free_sides_is_solved_to_balance_and_mirrors():
    """Edges 4 and 6 mm from the initial contact: the load is met, the same nose mirrored has the mirrored patch."""
    low, high = -4e-3, 6e-3
    crown, wheel = (lambda x, s: -(s**2) / 0.6 + 0 * x), (lambda x, s: x**2 / 0.92 + 0 * s)
    patches = [
        finite_patch(BlockPair(crown, wheel, sides, (-0.03, 0.03)), 5e4, FineZone(8e-3, sides, 3e-3, 1e-3, 1e-3, 1.4))
        for sides in ((low, high), (-high, -low))
    ]
    for patch in patches:
        assert patch.normal_force == pytest.approx(5e4, rel=1e-5) and patch.cost.iterations < 40 * patch.sets
    np.testing.assert_allclose(patches[0].pressure, patches[1].pressure[:, ::-1], atol=1e-4 * patches[0].max_pressure)


def test_linear_steps_do_not_grow_with_the_mesh_nor_with_unequal_sides():
    steps = []
    for across, growth in ((3, 1.2), (6, 1.6)):
        pair, exact = ellipse()
        patch = finite_patch(
            pair, LOAD, FineZone(9e-3, (-7e-3, 7e-3), 3e-3, exact.semi_y / across, exact.semi_y / across, growth)
        )
        steps.append(patch.cost.iterations / patch.sets)
    assert max(steps) < 30


def test_a_softer_rail_presses_by_the_common_modulus():
    pair, exact = ellipse(Elastic(70e9, 0.33))
    patch = finite_patch(pair, LOAD, zone(exact, 5))
    assert patch.max_pressure == pytest.approx(exact.max_pressure, rel=5e-3)


def test_nothing_overlaps_or_pulls_and_both_halves_are_alike():
    pair, exact = ellipse()
    patch = finite_patch(pair, LOAD, zone(exact, 4))
    assert patch.pressure.min() >= 0 and patch.overlap <= 1e-5 * patch.approach
    np.testing.assert_array_equal(patch.pressure, patch.pressure[::-1])
    np.testing.assert_allclose(patch.pressure, patch.pressure[:, ::-1], atol=1e-5 * exact.max_pressure)


def test_blocks_share_the_nodes_of_the_face_they_have_in_common():
    pair = BlockPair(lambda x, s: 0 * x * s, lambda x, s: x**2 + s**2, (-0.02, 0.004), (-0.02, 0.02))
    lower, upper, s = facing_blocks(pair, FineZone(5e-3, (-5e-3, 8e-3), 3e-3, 1e-3, 1e-3))
    assert (s[0], s[-1]) == (-0.02, 0.004) and upper.s[-1] == pytest.approx(0.02) and len(upper.s) > len(lower.s)
    i, j = np.array([0, 3]), np.array([2, len(s) - 1])
    np.testing.assert_allclose(
        upper.mesh.points[upper.face(i, j), :2], lower.mesh.points[lower.face(i, j), :2], atol=1e-12
    )


def test_the_limit_of_a_series_is_found():
    sizes = np.array([1.0, 0.7, 0.5])
    assert extrapolated(sizes, 3 + 0.2 * sizes**2, 2.0) == (pytest.approx(3.0), pytest.approx(0.025))
    assert np.isnan(extrapolated(sizes[:1], [2.0], 1.0)[1])


def test_what_it_cannot_solve_is_refused():
    pair, exact = ellipse()
    for load in (0.0, -1.0, np.nan):
        with pytest.raises(ContactInputError, match="give a positive one"):
            finite_patch(pair, load, zone(exact, 3))
    with pytest.raises(ContactInputError, match="leaves the fine zone.*widen it"):
        finite_patch(pair, LOAD, FineZone(3e-3, (-3e-3, 3e-3), 3e-3, 1.5e-3, 1.5e-3, 1.4))
    with pytest.raises(MeshError, match="lies beside"):
        finite_patch(pair, LOAD, FineZone(3e-3, (0.2, 0.3), 3e-3, 1.5e-3, 1.5e-3))
    with pytest.raises(MeshError, match="no height at x"):
        holed = BlockPair(pair.lower, lambda x, s: np.where(s > 0.05, np.nan, x**2), (-HALF, HALF), (-HALF, HALF))
        finite_patch(holed, LOAD, zone(exact, 3))
