"""The pass of a scene: the same on any number of ranks, and after a restart."""

import json
import shutil
from pathlib import Path

import numpy as np
import pytest

from tests.fe.passage_job import main
from tests.ranks import printed_by_ranks, printed_here

JOB = Path(__file__).with_name("passage_job.py")
STEPS = 160


def run_job(ranks: int, *arguments: str) -> dict:
    if ranks == 1:
        printed = printed_here(main, STEPS, *map(Path, arguments[:1]), *arguments[1:])
    else:
        printed = printed_by_ranks(ranks, JOB, STEPS, *arguments)
    return json.loads(next(line for line in reversed(printed.splitlines()) if line.startswith("{")))


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> Path:
    return tmp_path_factory.mktemp("pass")


@pytest.fixture(scope="module")
def one_rank(folder) -> dict:
    return run_job(1, str(folder / "1"), "copy")


@pytest.fixture(scope="module")
def two_ranks(folder) -> dict:
    return run_job(2, str(folder / "2"), "copy")


def cut_off(folder: Path, ranks: int, into: Path) -> str:
    """A copy of what the pass on so many ranks had left half way."""
    assert not (folder / f"{ranks}_cut" / "fields" / "final.vtu").exists()
    return str(shutil.copytree(folder / f"{ranks}_cut", into / "cut"))


def assert_same(one: dict, other: dict, names: str) -> None:
    """Sums in another order: round-off, which a pass of 160 steps does not amplify beyond 1e-10."""
    for name in names.split():
        exact = np.array(one[name])
        assert np.abs(np.array(other[name]) - exact).max() <= 1e-10 * max(np.abs(exact).max(), 1e-12), name


@pytest.mark.mpi
@pytest.mark.parametrize("ranks", [2, pytest.param(3, marks=pytest.mark.validate)])
def test_pass_is_the_same_on_any_number_of_ranks(one_rank, ranks, request):
    found = request.getfixturevalue("two_ranks") if ranks == 2 else run_job(ranks)
    assert max(one_rank["force"]) > 1e3
    assert_same(one_rank, found, "force wheel_height energy_plastic energy_hourglass")


@pytest.mark.mpi
@pytest.mark.validate
@pytest.mark.parametrize(
    "kind, ranks, names",
    [
        ("small", 3, "force wheel_height energy_plastic energy_hourglass"),
        ("elastic", 3, "force wheel_height energy_plastic energy_springs"),
        ("foot", 3, "force wheel_height crossing_height energy_plastic energy_springs"),
        ("bearers", 3, "force wheel_height crossing_height energy_plastic"),
        ("full", 2, "force wheel_height energy_plastic"),
    ],
)
def test_pass_of_another_kind_is_the_same_on_more_ranks(kind, ranks, names, tmp_path):
    """Heavier small elements, an elastic wheel, an elastic casting, bearers, the full element: to round-off."""
    one, more = (run_job(count, str(tmp_path / str(count)), kind) for count in (1, ranks))
    assert_same(one, more, names)
    assert kind != "bearers" or np.ptp(one["crossing_height"]) > 1e-8
    assert kind != "full" or not np.any(one["energy_hourglass"])  # the wheel's small-displacement kernel has none here


@pytest.mark.parametrize("ranks", [pytest.param(1, marks=pytest.mark.validate), 2])
def test_restart_is_bitwise_the_same(folder, tmp_path, ranks, request):
    """From the restart file of half way, without anything that came later: every column of the history to the last
    bit."""
    whole = request.getfixturevalue("one_rank" if ranks == 1 else "two_ranks")
    assert run_job(ranks, cut_off(folder, ranks, tmp_path), "restart")["digest"] == whole["digest"]


def test_restart_on_another_number_of_ranks_goes_on(one_rank, two_ranks, folder, tmp_path):
    found = run_job(1, cut_off(folder, 2, tmp_path), "restart")
    assert np.allclose(found["force"], one_rank["force"], rtol=1e-9, atol=1e-4)


def test_the_wheel_runs_at_its_speed_along_the_track(one_rank):
    """75 mph towards +x from 300 mm on."""
    assert one_rank["time"][-1] > 0
    assert one_rank["x"] == pytest.approx(0.30 + 75 * 0.44704 * np.array(one_rank["time"]), abs=1e-12)


def test_on_the_wing_alone_the_wing_carries_all(one_rank):
    """60 mm before the transfer the nose is out of reach."""
    force = np.array(one_rank["force"])
    assert force.max() > 1e3
    assert np.array_equal(one_rank["force_wing"], force)
    assert not np.any(one_rank["force_nose"])


def test_energy_is_in_balance_over_the_first_contact(one_rank):
    """Bodies and contact together, after settling: what is lost is round-off and friction at work, far below the 3 kJ
    in the springs."""
    # settling ends before the third row: lumped masses change there, the count starts afresh
    balance = np.array(one_rank["energy_balance"])[2:]
    assert np.ptp(balance) < 0.05  # J, of 3 kJ in the springs
