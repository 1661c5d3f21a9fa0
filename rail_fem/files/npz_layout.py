"""Where the arrays of an .npz file lie, so that several processes can write and read their parts of it.

An .npz file is a ZIP archive of .npy files. Stored uncompressed, every number has its position before a byte is
written; the checksum of an array follows from those of its parts. Sizes and positions are always those of ZIP64.

Source: PKWARE, APPNOTE.TXT (ZIP file format); crc32_combine of zlib. numpy.load and zipfile read what comes out
(tests/rail_fem/test_npz_layout.py).
"""

from __future__ import annotations

import io
import struct
import zipfile
import zlib
from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

import numpy as np

POLYNOMIAL = 0xEDB88320  # of CRC-32, bits reversed
VERSION, STORED, DATE, HERE = 45, 0, 0x21, 0xFFFFFFFF  # ZIP64; 1 January 1980; sizes stand in the extra field


class Member(NamedTuple):
    """An array in the file: at : position of its ZIP header;  data : of its first number;  header : of its .npy file,
    before the data [bytes]"""

    name: str
    dtype: np.dtype
    shape: tuple[int, ...]
    at: int
    data: int
    header: bytes

    @property
    def size(self) -> int:
        """Of the numbers [bytes]."""
        return self.dtype.itemsize * int(np.prod(self.shape, dtype=np.int64))

    @property
    def row(self) -> int:
        """Bytes of one entry along the first axis."""
        return self.dtype.itemsize * int(np.prod(self.shape[1:], dtype=np.int64))


def lay_out(arrays: Mapping[str, tuple[np.dtype, tuple[int, ...]]]) -> tuple[list[Member], int]:
    """Where arrays of these types and shapes stand, one after the other; and where the directory begins [bytes]."""
    members, at = [], 0
    for name, (dtype, shape) in arrays.items():
        buffer = io.BytesIO()
        described = {"descr": np.lib.format.dtype_to_descr(np.dtype(dtype)), "fortran_order": False, "shape": shape}
        np.lib.format.write_array_header_1_0(buffer, described)
        data = at + 30 + len(f"{name}.npy".encode()) + 20 + len(buffer.getvalue())
        members.append(Member(name, np.dtype(dtype), tuple(shape), at, data, buffer.getvalue()))
        at = data + members[-1].size
    return members, at


def head(member: Member, checksum: int) -> bytes:
    """What stands before the numbers of an array. checksum : CRC-32 of the numbers alone"""
    name, size = f"{member.name}.npy".encode(), len(member.header) + member.size
    crc = joined(zlib.crc32(member.header), checksum, member.size)
    fixed = struct.pack("<4s5H3I2H", b"PK\3\4", VERSION, 0, STORED, 0, DATE, crc, HERE, HERE, len(name), 20)
    return fixed + name + struct.pack("<2H2Q", 1, 16, size, size) + member.header


def directory(members: list[Member], checksums: list[int], at: int) -> bytes:
    """The end of the file, from position `at` on."""
    out = b""
    for member, checksum in zip(members, checksums):
        name, size = f"{member.name}.npy".encode(), len(member.header) + member.size
        crc = joined(zlib.crc32(member.header), checksum, member.size)
        fixed = (VERSION, VERSION, 0, STORED, 0, DATE, crc, HERE, HERE, len(name), 28, 0, 0, 0, 0, HERE)
        out += struct.pack("<4s6H3I5H2I", b"PK\1\2", *fixed) + name
        out += struct.pack("<2H3Q", 1, 24, size, size, member.at)
    count = len(members)
    end = struct.pack("<4sQ2H2I4Q", b"PK\6\6", 44, VERSION, VERSION, 0, 0, count, count, len(out), at)
    locator = struct.pack("<4sIQI", b"PK\6\7", 0, at + len(out), 1)
    return out + end + locator + struct.pack("<4s4H2IH", b"PK\5\6", 0, 0, 0xFFFF, 0xFFFF, HERE, HERE, 0)


def members_of(path: Path) -> dict[str, Member]:
    """The arrays of an .npz file that is not compressed. Errors: OSError, ValueError, zipfile.BadZipFile and what NumPy
    raises on a damaged header."""
    out = {}
    with zipfile.ZipFile(path) as archive, path.open("rb") as stream:
        for entry in archive.infolist():
            if entry.compress_type != zipfile.ZIP_STORED:
                raise ValueError(f"{entry.filename} is compressed")
            stream.seek(entry.header_offset)
            fixed = stream.read(30)
            if fixed[:4] != b"PK\3\4":
                raise ValueError(f"{entry.filename} has no header")
            start = entry.header_offset + 30 + sum(struct.unpack("<2H", fixed[26:30]))
            stream.seek(start)
            version = np.lib.format.read_magic(stream)
            if version != (1, 0):
                raise ValueError(f"{entry.filename}: format {version} of .npy files")
            shape, fortran, dtype = np.lib.format.read_array_header_1_0(stream)
            if fortran or dtype.hasobject:
                raise ValueError(f"{entry.filename} is not an array by rows")
            name, data = entry.filename.removesuffix(".npy"), stream.tell()
            out[name] = Member(name, dtype, shape, entry.header_offset, data, b"")
            if data + out[name].size != start + entry.file_size:
                raise ValueError(f"{entry.filename} has not the size that it states")
    return out


def joined(first: int, second: int, length: int) -> int:
    """CRC-32 of two parts one after the other, from those of each and the length of the second [bytes]."""
    return _product(_power(8 * length), first) ^ second


def _product(a: int, b: int) -> int:
    """a times b modulo the polynomial, bits reversed; a not 0."""
    out, bit = 0, 1 << 31
    while True:
        if a & bit:
            out ^= b
            if not a & (bit - 1):
                return out
        bit >>= 1
        b = (b >> 1) ^ POLYNOMIAL if b & 1 else b >> 1


def _power(n: int) -> int:
    """x to the power n modulo the polynomial."""
    out, square = 1 << 31, 1 << 30
    while n:
        if n & 1:
            out = _product(square, out)
        square, n = _product(square, square), n >> 1
    return out
