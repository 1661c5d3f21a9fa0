"""A file whose arrays are laid out beforehand is what NumPy and zipfile read, checksums and all."""

import zipfile
import zlib

import numpy as np
import pytest

from rail_fem.files.npz_layout import directory, head, joined, lay_out, members_of

ARRAYS = {
    "nodal/x": np.random.default_rng(1).normal(size=(50, 3)),
    "cells": np.arange(80).reshape(10, 8),
    "none": np.empty((0, 3)),
    "one": np.float64(3.5),
    "words": np.frombuffer(b"{}", np.uint8),
    "flag": np.array([True, False]),
}


def written(path):
    members, end = lay_out({name: (np.asarray(a).dtype, np.asarray(a).shape) for name, a in ARRAYS.items()})
    sums = [zlib.crc32(np.asarray(a).tobytes()) for a in ARRAYS.values()]
    with path.open("wb") as stream:
        for member, checksum in zip(members, sums):
            stream.seek(member.at)
            stream.write(head(member, checksum))
            assert stream.tell() == member.data
            stream.write(np.asarray(ARRAYS[member.name]).tobytes())
        assert stream.tell() == end
        stream.write(directory(members, sums, end))
    return members


def test_numpy_and_zipfile_read_it(tmp_path):
    written(tmp_path / "a.npz")
    with zipfile.ZipFile(tmp_path / "a.npz") as archive:
        assert archive.testzip() is None
    with np.load(tmp_path / "a.npz") as stored:
        assert list(stored) == list(ARRAYS)
        for name, array in ARRAYS.items():
            assert np.array_equal(stored[name], array) and stored[name].dtype == np.asarray(array).dtype


@pytest.mark.parametrize("by", ["us", "numpy"])
def test_every_array_is_found_where_it_lies(tmp_path, by):
    path = tmp_path / "a.npz"
    if by == "us":
        written(path)
    else:
        np.savez(path, **ARRAYS)
    found = members_of(path)
    for name, array in ARRAYS.items():
        m = found[name]
        assert (m.dtype, m.shape) == (np.asarray(array).dtype, np.asarray(array).shape)
        assert path.read_bytes()[m.data : m.data + m.size] == np.asarray(array).tobytes()


def test_checksums_of_parts_join_to_that_of_the_whole():
    """Against zlib's of the whole; lengths from none to a few thousand bytes, and one beyond 2^32 in theory: zeros
    appended twice are zeros appended at once."""
    data = np.random.default_rng(2).integers(0, 256, 5000).astype(np.uint8).tobytes()
    for cut in (0, 1, 7, 2500, 4999, 5000):
        assert joined(zlib.crc32(data[:cut]), zlib.crc32(data[cut:]), 5000 - cut) == zlib.crc32(data)
    twice = joined(joined(1234567, 0, 3 << 32), 0, 5 << 32)
    assert twice == joined(1234567, 0, 8 << 32)


def test_compressed_and_foreign_members_are_refused(tmp_path):
    np.savez_compressed(tmp_path / "a.npz", x=np.zeros(3))
    with pytest.raises(ValueError, match=r"x.npy is compressed"):
        members_of(tmp_path / "a.npz")
