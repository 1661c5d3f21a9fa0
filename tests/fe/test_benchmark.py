"""The benchmark measures what it says: the same work on both sides of a ratio, the state it names, the fastest repeat,
each part of a step without its inner parts."""

import numpy as np
import pytest
from mpi4py import MPI
from dolfinx import fem
from scipy.spatial import cKDTree

from geometry.meshing.blocks import mesh_box
from rail_fem.fe import trilinear
from rail_fem.fe.domain import Domain
from rail_fem.fe.structure import Structure
from rail_fem.studies import benchmark
from rail_fem.studies import benchmark_kernels as kernels
from rail_fem.studies.benchmark import Stopwatch
from rail_fem.studies.benchmark_kernels import EDGE, STEEL, Effort
from tests.fe.kernel_flops import Counted, counted, operations_of_kernels

QUICK = kernels.QUICK


@pytest.mark.parametrize("points", [1, 2])
def test_assembly_and_elastic_kernel_give_the_same_forces_for_an_affine_displacement(points):
    """Hourglass control does nothing in an affine motion and one point integrates it exactly on cubes; the kernel is
    linear in a displacement of any size. x - reference loses a factor of 10 of the roundings: 1e-12 is 1e3 of those."""
    domain = kernels.block_domain(3)
    gradient = 0.1 * np.array([[1.0, 0.5, -0.3], [0.2, -0.7, 0.4], [0.6, 0.1, 0.9]])
    s = Structure(domain, [STEEL], small=(0,))
    s.x += (s.x.reshape(-1, 3) @ gradient.T).ravel()
    s.add_internal_force(1e-7)
    form, u = kernels.elastic_form(domain, STEEL, points)
    u.interpolate(lambda x: gradient @ x)
    force = np.zeros(u.x.array.size)
    fem.assemble_vector(force, form)
    _, same = cKDTree(u.function_space.tabulate_dof_coordinates()).query(domain.reference.reshape(-1, 3))
    ours = s.force.reshape(-1, 3)
    np.testing.assert_allclose(ours, -force.reshape(-1, 3)[same], atol=1e-12 * np.abs(ours).max())
    assert np.abs(ours).max() > 1.0


@pytest.mark.parametrize("flowing, share", [(True, 1.0), (False, 0.0)])
def test_timed_elements_are_in_the_state_that_the_table_names(flowing, share):
    rate, flowed = kernels.finite_rate(kernels.block_domain(6), flowing, QUICK)
    assert flowed == share and rate > 0


def test_fastest_repeat_counts(monkeypatch):
    """A clock of our own: a trial call takes 1 s, so `shortest` 2 s asks for 2 calls a repeat, and repeats take 6, 2
    and 4 s."""
    now = iter([0.0, 1.0, 10.0, 16.0, 20.0, 22.0, 30.0, 34.0])
    monkeypatch.setattr(kernels.time, "process_time", lambda: next(now))
    calls = []
    assert kernels.least_time(lambda: calls.append(1), Effort(repeats=3, shortest=2.0)) == 1.0
    assert len(calls) == 2 + 3 * 2


def array_bytes(*holders) -> float:
    """Bytes of the arrays that objects hold as attributes, each counted once however many views look at it."""
    owners = {}
    for value in (value for holder in holders for value in vars(holder).values()):
        while isinstance(value, np.ndarray) and isinstance(value.base, np.ndarray):
            value = value.base
        if isinstance(value, np.ndarray):
            owners[id(value)] = value.nbytes
    return float(sum(owners.values()))


def test_solver_keeps_less_than_half_a_kilobyte_an_element():
    """State 160, nodes of blocks 32, cells 40, and 170 on nodes, of which a large block has one an element; ours has
    1.2."""
    box = mesh_box((16 * EDGE,) * 3, (16,) * 3)
    domain = Domain(MPI.COMM_SELF, box.points, box.cells, box.region)
    s = Structure(domain, [STEEL])
    assert 160 < array_bytes(domain, s, s.finite) / domain.m_global < 500


def test_elements_in_rings_move_less_than_half_of_the_bytes():
    """Blocks 12 across: three nodal vectors read and one changed, 5 x 24 B for 1.3 nodes an element, and some 8 B
    of numbers for each node on a line; others have 33 numbers of geometry each besides."""
    plain, rings = (kernels.structure_of(kernels.block_domain(12, bent), "elastic") for bent in (False, True))
    assert plain.small.n_cells == 12**3 and rings.small.n_cells == 0 < len(rings.small_cells)
    assert kernels.bytes_of_update(rings) < kernels.bytes_of_update(plain) / 2


@pytest.mark.parametrize("name, operations", [("dot", 5), ("cross", 9)])
def test_operations_are_counted_on_the_source(name, operations):
    """Three products and two sums; six products and three differences."""
    u, v = counted(np.array([1.0, 2.0, 3.0])), counted(np.array([4.0, 5.0, 6.0]))
    Counted.operations = 0
    found = getattr(trilinear, name).py_func(u, v)
    assert Counted.operations == operations
    np.testing.assert_array_equal(np.array(found, float), getattr(np, name)([1, 2, 3], [4, 5, 6]))


def test_flow_and_more_points_cost_operations_and_rings_save_some():
    """Eight points share the element's geometry and forces: less than eight times one point, more than twice. The
    benchmark's limits are told to three digits."""
    found = operations_of_kernels()
    flowing, still = found["flowing"], found["elastic state"]
    assert still["one-point"] < flowing["one-point"] and still["full"] < flowing["full"]
    assert still["elastic"] == flowing["elastic"] < still["one-point"] / 2
    assert still["rings"] == flowing["rings"] < still["elastic"]
    assert 2 < still["full"] / still["one-point"] < 8
    assert flowing == pytest.approx(kernels.OPERATIONS, rel=5e-3)


@pytest.mark.validate
def test_the_table_has_a_row_for_each_kernel_and_the_limits_of_ours():
    table = kernels.kernel_table(QUICK)
    assert len(table.rows) == 8 and all(len(row) == len(table.head) for row in table.rows)
    assert [row[2] != "-" for row in table.rows] == [True, False, True, True, True, False, False, False]
    assert all(row[1] > 0 for row in table.rows)


class Ticking:
    """A clock that goes on by one whenever it is read."""

    now = 0.0

    def process_time(self) -> float:
        self.now += 1
        return self.now


def test_a_part_has_its_own_time_alone(monkeypatch):
    """Three ticks of work in the inner part, called twice, five in the outer."""
    clock = Ticking()
    monkeypatch.setattr(benchmark, "time", clock)
    watch = Stopwatch()

    def work(ticks):
        clock.now += ticks

    inner = watch.timed("inner", lambda: work(3))

    def both():
        inner()
        work(5)
        inner()

    watch.timed("outer", both)()
    assert watch.spent["inner"] == pytest.approx(6) and watch.calls["inner"] == 2
    assert watch.spent["outer"] == pytest.approx(5, abs=1e-3) and watch.calls["outer"] == 1


def test_what_is_timed_is_there_to_be_timed():
    assert all(callable(getattr(owner, name)) for _, owner, names in benchmark.PARTS for name in names)
