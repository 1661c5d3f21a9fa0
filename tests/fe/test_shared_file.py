"""Files that all ranks write and read: one content on any number of ranks, whole or not at all, refused if changed."""

import json

import numpy as np
import pytest
from mpi4py import MPI

from rail_fem.fe.shared_file import SharedReader
from rail_fem.files.atomic import remove_partial
from rail_fem.files.sealed import read_sealed
from tests.fe.shared_job import CELLS, IDENTITY, OWN, fields
from tests.ranks import printed_by_ranks, run_on_ranks

pytestmark = pytest.mark.mpi
JOB = "tests/fe/shared_job.py"


@pytest.fixture(scope="module")
def one(tmp_path_factory):
    folder = tmp_path_factory.mktemp("one")
    return folder / "state.npz", printed_by_ranks(1, JOB, folder)


def test_what_a_rank_writes_numpy_and_the_reader_of_sealed_files_read(one):
    arrays, _ = read_sealed(one[0], IDENTITY, "begin again")
    points, cells = fields()
    cells[:100] = 0
    assert np.array_equal(arrays["points"], points) and np.array_equal(arrays["cells"], cells)
    assert arrays["sums"].tolist() == OWN["sums"].tolist()
    assert json.loads(one[1]) == [f"{one[0]}: belongs to another case: begin again"]


@pytest.mark.parametrize("ranks", [pytest.param(2, marks=pytest.mark.validate), 3])
def test_ranks_write_the_same_bytes_and_read_what_one_wrote(one, tmp_path, ranks):
    (tmp_path / "one.npz").write_bytes(one[0].read_bytes())
    refused = json.loads(printed_by_ranks(ranks, JOB, tmp_path))
    assert (tmp_path / "state.npz").read_bytes() == one[0].read_bytes()
    assert refused == [f"{tmp_path / 'state.npz'}: belongs to another case: begin again"] * ranks
    assert sorted(path.name for path in tmp_path.iterdir()) == ["one.npz", "state.npz"]


def test_a_rank_that_cannot_write_leaves_the_file_of_before_and_all_say_so(tmp_path):
    (tmp_path / "state.npz").write_text("of before")
    said = json.loads(printed_by_ranks(2, JOB, tmp_path, "full"))
    assert said == [f"cannot write {tmp_path / 'state.npz'}: no space left on device"] * 2
    assert [p.name for p in tmp_path.iterdir()] == ["state.npz"]
    assert (tmp_path / "state.npz").read_text() == "of before"


def test_a_rank_that_is_killed_while_it_writes_leaves_the_file_of_before(tmp_path):
    (tmp_path / "state.npz").write_text("of before")
    assert run_on_ranks(2, JOB, tmp_path, "lost").returncode != 0
    assert (tmp_path / "state.npz").read_text() == "of before"
    remove_partial(tmp_path)
    assert [p.name for p in tmp_path.iterdir()] == ["state.npz"]


def changed(path, at: int, to: bytes) -> None:
    data = bytearray(path.read_bytes())
    data[at : at + len(to)] = to
    path.write_bytes(data)


DAMAGE = {
    "a number of the nodes": (lambda p: changed(p, p.stat().st_size // 2, b"\x01\x02\x03"), "changed after"),
    "cut": (lambda p: p.write_bytes(p.read_bytes()[: p.stat().st_size // 2]), "damaged"),
    "directory lost": (lambda p: p.write_bytes(p.read_bytes()[:-40] + bytes(40)), "damaged"),
    "empty": (lambda p: p.write_bytes(b""), "damaged"),
    "missing": (lambda p: p.unlink(), "damaged"),
    "as numpy saves it without a seal": (lambda p: np.savez(p, points=np.zeros((3, 3))), "damaged"),
    "an array added": (lambda p: added(p), "changed after"),
    "of fewer rows": (lambda p: added(p, points=np.zeros((CELLS, 3))), "changed after"),
    "of another kind": (lambda p: added(p, points=np.zeros((CELLS, 3), np.float32)), "changed after"),
    "of earlier versions": (lambda p: relabelled(p), "damaged"),
}


def added(path, **more) -> None:
    with np.load(path) as stored:
        arrays = dict(stored)
    np.savez(path, **arrays | (more or {"more": np.ones(2)}))


def relabelled(path) -> None:
    with np.load(path) as stored:
        label = json.loads(bytes(stored["seal"]).decode())
    del label["chunk"]
    added(path, seal=np.frombuffer(json.dumps(label).encode(), np.uint8))


@pytest.mark.parametrize("how", DAMAGE)
def test_a_file_that_is_damaged_or_changed_is_refused_with_the_remedy(one, tmp_path, how):
    path = tmp_path / "state.npz"
    path.write_bytes(one[0].read_bytes())
    spoil, said = DAMAGE[how]
    spoil(path)
    with pytest.raises(ValueError, match=rf"state.npz: .*{said}.*: begin again"):
        SharedReader(MPI.COMM_SELF, path, IDENTITY, ("points", "cells"), "begin again")
