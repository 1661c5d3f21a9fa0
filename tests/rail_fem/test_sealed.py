"""Sealed files: what was written comes back; whatever else lies there is refused by name, with the remedy."""

import io

import numpy as np
import pytest

from rail_fem.files.sealed import SealError, read_sealed, write_sealed

ARRAYS = {
    "points": np.random.default_rng(1).normal(size=(500, 3)),
    "cells": np.arange(800).reshape(100, 8),
    "none": np.empty((0, 3)),
    "one": np.float64(3.5),
}
IDENTITY = {"case": "a1", "mesh": "b2"}


@pytest.fixture
def path(tmp_path):
    write_sealed(tmp_path / "mesh.npz", ARRAYS, IDENTITY)
    return tmp_path / "mesh.npz"


def rewrite(path, change):
    """As one who opens the file with NumPy and saves it again."""
    with np.load(path) as stored:
        arrays = dict(stored)
    change(arrays)
    np.savez(path, **arrays)


def test_arrays_come_back_to_the_bit_and_one_seal_means_one_content(path, tmp_path):
    arrays, seal = read_sealed(path, {"mesh": "b2"}, "")
    for name, array in ARRAYS.items():
        assert (
            arrays[name].dtype == array.dtype
            and arrays[name].shape == array.shape
            and arrays[name].tobytes() == array.tobytes()
        )
    assert write_sealed(tmp_path / "again.npz", arrays, IDENTITY) == seal
    moved = arrays | {"points": arrays["points"] + np.eye(500, 3) * 1e-16}
    assert write_sealed(tmp_path / "moved.npz", moved, IDENTITY) != seal
    assert [p.name for p in sorted(tmp_path.iterdir())] == ["again.npz", "mesh.npz", "moved.npz"]


def text(path):
    path.write_text("years of work")


def array_file(path):
    buffer = io.BytesIO()
    np.save(buffer, np.arange(3.0))
    path.write_bytes(buffer.getvalue())


def folder(path):
    path.unlink()
    path.mkdir()


def zeroed(path):
    data = bytearray(path.read_bytes())
    data[len(data) // 2 : len(data) // 2 + 64] = bytes(64)
    path.write_bytes(data)


def directory_lost(path):
    data = path.read_bytes()
    path.write_bytes(data[:-40] + bytes(40))


DAMAGE = {
    "empty": lambda path: path.write_bytes(b""),
    "text": text,
    "an array": array_file,
    "a folder": folder,
    "cut": lambda path: path.write_bytes(path.read_bytes()[: path.stat().st_size // 2]),
    "zeroed": zeroed,
    "directory lost": directory_lost,
    "array missing": lambda path: rewrite(path, lambda a: a.pop("cells")),
    "array added": lambda path: rewrite(path, lambda a: a.update(more=np.ones(3))),
    "seal missing": lambda path: rewrite(path, lambda a: a.pop("seal")),
    "seal of another kind": lambda path: rewrite(path, lambda a: a.update(seal=np.frombuffer(b"[1, 2]", np.uint8))),
    "type": lambda path: rewrite(path, lambda a: a.update(cells=a["cells"].astype(np.int32))),
    "shape": lambda path: rewrite(path, lambda a: a.update(cells=a["cells"].reshape(200, 4))),
    "index out of range": lambda path: rewrite(path, lambda a: a["cells"].__setitem__((3, 2), 10**9)),
    "not a number": lambda path: rewrite(path, lambda a: a["points"].__setitem__((3, 2), np.nan)),
    "points moved": lambda path: rewrite(path, lambda a: a["points"].__iadd__(1e-9)),
}


@pytest.mark.parametrize("how", DAMAGE)
def test_damaged_file_is_named_with_its_remedy(path, how):
    DAMAGE[how](path)
    with pytest.raises(SealError, match=r"mesh\.npz: .*: begin again") as message:
        read_sealed(path, IDENTITY, "begin again")
    assert len(str(message.value)) < 500


@pytest.mark.parametrize(
    "identity, said",
    [
        ({"case": "a2"}, "another case"),
        ({"case": "a1", "mesh": "b3"}, "another mesh"),
        ({"case": "", "mesh": ""}, "another case and another mesh"),
    ],
)
def test_file_of_another_run_says_whose(path, identity, said):
    with pytest.raises(SealError, match=f"belongs to {said}: begin again"):
        read_sealed(path, identity, "begin again")
