"""A cap rolls over a long block of which only what lies near it is computed: as over the whole block, with what it
leaves behind kept."""

from pathlib import Path

import numpy as np
import pytest
from mpi4py import MPI

from rail_fem.fe.checkpoint import load_checkpoint, save_checkpoint
from rail_fem.fe.slabs import Slabs
from rail_fem.fe.window import Extent, heaviest
from tests.fe.gathered import gather_cells
from tests.fe.rolling_job import BODY_MASS, MM, rolling, run
from tests.ranks import arrays_of_ranks

HALF, EARLY, STEPS = 9 * MM, 1350, 1650
DT = 9.5e-8  # below the stable step of the whole block [s]


@pytest.fixture(scope="module")
def whole():
    scene = rolling(MPI.COMM_SELF)
    return scene, run(scene, STEPS, DT)


@pytest.fixture(scope="module")
def windowed():
    """The window after EARLY steps and at the end: the states of all cells, shape relative to the base."""
    scene, states, parts = rolling(MPI.COMM_SELF, HALF, HALF), [], []
    for steps in (EARLY, STEPS - EARLY):
        parts.append(run(scene, steps, DT))
        scene.dynamics.bring_up()
        relative = scene.dynamics.structure.x.reshape(-1, 3) - scene.base.displacement
        states.append((gather_cells(scene.dynamics), relative.copy(), scene.window.active.copy()))
    return scene, parts, states


def test_the_window_feels_what_the_whole_block_feels(whole, windowed):
    """Held ends at 1.5 depths of the block, where what the load does has fallen to exp(-1.5 pi) of it (Saint-Venant):
    1 % of force and of the plastic strain."""
    force = np.concatenate([part.force for part in windowed[1]])
    scale = np.linalg.norm(whole[1].force[:, 2])
    assert np.linalg.norm(force[:, 2] - whole[1].force[:, 2]) < 0.01 * scale
    strain, there = gather_cells(whole[0].dynamics)[:, 6], windowed[2][-1][0][:, 6]
    assert strain.max() > 0.01
    assert np.abs(there - strain).max() < 0.01 * strain.max()


def test_what_has_left_stays_as_it_was(windowed):
    """To the last bit: stress and plastic strain of slabs behind; to round-off their shape relative to the base."""
    scene, _, ((early, shape, active), (late, late_shape, _)) = windowed
    mesh, slabs = scene.mesh, scene.slabs
    slab = slabs.of_cells(mesh.points[mesh.cells].mean(axis=1)[:, 0], mesh.region)
    behind = (mesh.region == 0) & (slab < active[0, 0])
    touched = slabs.planes[0][active[0, 0]]
    nodes = np.flatnonzero(scene.dynamics.domain.reference[::3] < touched - 1e-9)
    nodes = nodes[np.isin(nodes, scene.dynamics.domain.cells[scene.dynamics.domain.region == 0])]
    assert early[behind, 6].max() > 1e-4 and np.abs(early[behind, :6]).max() > 1e6
    assert np.array_equal(early[behind], late[behind])
    assert np.abs(shape[nodes] - late_shape[nodes]).max() < 1e-15
    assert np.abs(scene.base.displacement).max() > 1e-6  # the base itself has moved


def test_less_is_computed_and_nothing_of_it_flows_as_it_leaves(whole, windowed):
    window, dynamics = windowed[0].window, windowed[0].dynamics
    assert dynamics.updates < 0.6 * whole[0].dynamics.updates
    assert window.active[0, 0] > 1 and (window.active[0, 1] - window.active[0, 0]) * 3 * MM < 3 * HALF
    assert window.late_flow == 0.0


def test_energies_balance_over_slabs_that_enter_and_leave(windowed):
    """1 % of what the contact has done; elastic energy has left with the slabs."""
    energies = [row for part in windowed[1] for row in part.energies]
    balance = np.array([row["balance"] for row in energies])
    assert energies[-1]["left_elastic"] > 0
    assert np.ptp(balance) < 0.01 * energies[-1]["contact"]


def test_mass_and_momentum_are_kept_where_nodes_join_the_base():
    """Made-up velocities, so that there is something to take up; what is lost of the kinetic energy is booked."""
    scene = rolling(MPI.COMM_SELF, HALF, HALF)
    d, w, base = scene.dynamics, scene.window, scene.base
    v, mass = d.structure.v.reshape(-1, 3), d.structure.mass
    base.velocity[2] = 0.3
    w.bring_up()
    d.impose()
    v[w.in_slabs & ~w.rigid] = np.random.default_rng(0).normal(size=((w.in_slabs & ~w.rigid).sum(), 3))
    d.contact.wheel.offset = 0.0

    def totals():
        free = w.in_slabs & ~w.rigid
        assert mass[free].sum() + base.mass == pytest.approx(BODY_MASS, rel=1e-12)
        moving = 0.5 * mass[free] @ (v[free] ** 2).sum(axis=1)
        return mass[free] @ v[free, 2] + base.mass * base.velocity[2], moving + 0.5 * base.mass * base.velocity[2] ** 2

    for offset in (3 * MM, 7 * MM, 19 * MM):
        (momentum, energy), booked = totals(), w.left_kinetic
        assert w.advance(offset)
        d.follow()
        after, kinetic = totals()
        assert after == pytest.approx(momentum, rel=1e-12)
        assert w.left_kinetic - booked == pytest.approx(energy - kinetic, rel=1e-9)
    assert w.left_kinetic > 0


def test_towards_minus_x_it_is_the_mirror_image():
    """Longer ahead than behind, so that a window that is turned round would be found; to round-off as it grows over 400
    steps."""
    there, back = (rolling(MPI.COMM_SELF, 12 * MM, 8 * MM, sign) for sign in (1.0, -1.0))
    before = there.window.active.copy()
    forth, mirrored = run(there, 400, DT).force, run(back, 400, DT).force
    assert np.abs(forth * [-1.0, 1.0, 1.0] - mirrored).max() < 1e-6 * np.abs(forth).max()
    count = there.slabs.counts[0]
    assert not np.array_equal(before, there.window.active)
    assert (count - there.window.active[0, ::-1]).tolist() == back.window.active[0].tolist()


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_the_heaviest_window_is_found(sign):
    """Against all positions of the wheel, 0.1 mm apart; slabs of one body only are heavy."""
    slabs = Slabs((np.linspace(0.0, 48 * MM, 17), np.linspace(20 * MM, 60 * MM, 9), np.empty(0)))
    masses = (np.arange(16) % 5 + 1.0, np.array([1.0, 9, 2, 2, 30, 1, 1, 1]), np.zeros(1))
    extent = Extent(5 * MM if sign > 0 else 55 * MM, sign, 12 * MM, 7 * MM)
    offsets = sign * np.arange(-0.02, 0.08, 1e-4)
    ranges = [slabs.near(*extent.ends(offset)) for offset in offsets]
    every = [sum(m[low:high].sum() for m, (low, high) in zip(masses, found)) for found in ranges]
    assert heaviest(slabs, extent, masses) == max(every)


def test_contact_at_an_end_of_the_window_stops_the_run():
    with pytest.raises(ArithmeticError, match=r"comes to the end of the travelling window .* longer than \d+ mm"):
        run(rolling(MPI.COMM_SELF, 3 * MM, 9 * MM), 50, DT)


def test_a_restart_between_two_slabs_changes_no_bit(tmp_path):
    """The state is saved before a slab leaves and one enters, and gone on with across that."""
    steps, more = 520, 150
    live = rolling(MPI.COMM_SELF, HALF, HALF)
    run(live, steps, DT)
    before = live.window.active.copy()
    save_checkpoint(tmp_path / "state.npz", live.dynamics, live.dynamics, {})
    found = run(live, more, DT)
    again = rolling(MPI.COMM_SELF, HALF, HALF)
    load_checkpoint(tmp_path / "state.npz", again.dynamics, again.dynamics, {})
    repeated = run(again, more, DT)
    assert not np.array_equal(before, live.window.active) and np.array_equal(live.window.active, again.window.active)
    assert np.array_equal(found.force, repeated.force) and found.energies == repeated.energies
    for name in ("x", "v", "force", "anchor"):
        assert np.array_equal(getattr(live.dynamics.structure, name), getattr(again.dynamics.structure, name)), name
    assert live.dynamics.updates == again.dynamics.updates


@pytest.mark.mpi
@pytest.mark.parametrize("ranks", [2, pytest.param(3, marks=pytest.mark.validate)])
def test_forces_and_state_are_the_same_on_any_number_of_ranks(windowed_on_one_rank, tmp_path, ranks):
    """Only the order of sums differs: 1e-9 of each quantity's largest value after slabs have entered and left."""
    other = job(ranks, tmp_path / "out.npz")
    for name, exact in windowed_on_one_rank.items():
        assert np.abs(other[name] - exact).max() <= 1e-9 * np.abs(exact).max(), name


@pytest.fixture(scope="module")
def windowed_on_one_rank(tmp_path_factory):
    return job(1, tmp_path_factory.mktemp("window") / "1.npz")


def job(ranks: int, out: Path) -> dict:
    """The run of rolling_job.py."""
    return arrays_of_ranks(ranks, out, "-m", "tests.fe.rolling_job", out, 700)
