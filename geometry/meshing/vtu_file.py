"""VTU files whose arrays stand behind the XML, as VTK and ParaView write them unless told otherwise, for meshio.

meshio 5.3 reads on beyond the end of such an array: numbers of a raw, uncompressed one with 32-bit headers come out
wrong without a word, and Python 3.13 refuses what earlier ones let pass. So the arrays are taken out of the file here
and set into its XML, one by one and uncompressed, which meshio reads as it should.

Source: VTK file formats, "XML File Formats" of the VTK user's documentation (docs.vtk.org), and files of VTK 9.7: an
array is its length in bytes and the bytes, or, compressed, the number of blocks, their length, that of the last, the
compressed length of each, and the blocks; in base64 the head of a compressed array stands by itself.
"""

import base64
import binascii
import lzma
import zlib
from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, NamedTuple
from xml.etree import ElementTree

import numpy as np

from geometry.meshing.hexmesh import MeshError

DECOMPRESS: dict[str, Callable[[bytes], bytes]] = {
    "vtkZLibDataCompressor": zlib.decompress,
    "vtkLZMADataCompressor": lzma.decompress,
}


def read_vtu(path: Path) -> Any:
    """The meshio.Mesh of a VTU file. Errors: MeshError for a compression that is not read, those of meshio."""
    import meshio

    text = inlined(path)
    if text is None:
        return meshio.read(path)
    with TemporaryDirectory() as folder:
        inline = Path(folder) / "inline.vtu"
        inline.write_bytes(text)
        return meshio.read(inline)


def inlined(path: Path) -> bytes | None:
    """The file with all arrays in its XML; None where they are there already.

    Errors: OSError; MeshError for a compression that is not read; ElementTree.ParseError, ValueError, zlib.error,
    lzma.LZMAError, IndexError or KeyError for a damaged file.
    """
    head, appended, rest = path.read_bytes().partition(b"<AppendedData")
    root = ElementTree.fromstring(head + b"</VTKFile>" if appended else head)
    name = root.attrib.pop("compressor", "")
    stored = [array for array in root.iter("DataArray") if array.get("format", "ascii") != "ascii"]
    if stored and name and name not in DECOMPRESS:
        raise MeshError(
            f"{path}: is compressed by {name}, which is not read: save it with zlib or uncompressed (ParaView:"
            " Compressor Type)"
        )
    if not appended and name in ("", *DECOMPRESS):
        return None
    declared, _, data = rest.partition(b">") if appended else (b"", b"", b"_")
    order = "<" if root.get("byte_order", "LittleEndian") == "LittleEndian" else ">"
    number = np.dtype({"UInt32": "u4", "UInt64": "u8"}[root.get("header_type", "UInt32")]).newbyteorder(order)
    behind = _Arrays(data[data.index(b"_") + 1 :], b"raw" in declared, number, name)
    for array in stored:
        own = _Arrays("".join((array.text or "").split()).encode(), False, number, name)
        values = behind.at(int(array.attrib.pop("offset"))) if array.get("format") == "appended" else own.at(0)
        array.set("format", "binary")
        array.text = base64.b64encode(np.array([len(values)], number).tobytes() + values).decode()
    return ElementTree.tostring(root)


class _Arrays(NamedTuple):
    """Arrays one behind the other. raw : bytes, or else base64;  number : of their heads;  compressor : VTK's name"""

    data: bytes
    raw: bool
    number: np.dtype
    compressor: str

    def at(self, offset: int) -> bytes:
        """The bytes of the array that begins there."""
        size = self.number.itemsize
        if not self.compressor:
            length, alone = self._numbers(offset, 1), self._end(offset, size)
            if not self.raw and self.data[:alone].count(b"=", offset) != -size % 3:
                return self._bytes(offset, size + int(length[0]))[size:]
            return self._bytes(alone, int(length[0]))
        count = int(self._numbers(offset, 1)[0])
        sizes = self._numbers(offset, 3 + count)[3:].astype(int)
        blocks = self._bytes(self._end(offset, (3 + count) * size), int(sizes.sum()))
        ends = np.cumsum(sizes)
        return b"".join(DECOMPRESS[self.compressor](blocks[end - of : end]) for end, of in zip(ends, sizes))

    def _numbers(self, offset: int, count: int) -> np.ndarray:
        return np.frombuffer(self._bytes(offset, count * self.number.itemsize), self.number)

    def _end(self, offset: int, count: int) -> int:
        """Where `count` bytes end that were stored by themselves."""
        return offset + (count if self.raw else 4 * -(-count // 3))

    def _bytes(self, offset: int, count: int) -> bytes:
        stored = self.data[offset : self._end(offset, count)]
        found = (stored if self.raw else binascii.a2b_base64(stored))[:count]
        if len(found) != count:
            raise ValueError(f"{len(found)} bytes of an array where {count} are said: the file is cut off")
        return found
