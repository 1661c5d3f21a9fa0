"""Where the arrays of a VTU file of hexahedra lie, so that several processes can write their parts of it.

Arrays stand behind the XML as raw bytes, each with a header of its own and compressed by zlib in chunks of CHUNK rows
(rail_fem.files.sealed): who holds whole chunks compresses and writes them alone, and what the file holds does not
depend on who held which. Sizes and positions are 64-bit numbers: files may be larger than 4 GB.

Source: VTK file formats, "XML File Formats" of the VTK user's documentation (docs.vtk.org). VTK reads what comes out
(tests/fe/test_fields.py), and so does meshio 5.3 under Python up to 3.12: it turns raw arrays into base64 and reads on
beyond the end of each, which later ones refuse. What the program reads itself it reads here.
"""

from __future__ import annotations

import zlib
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple
from xml.etree import ElementTree
from xml.sax.saxutils import quoteattr

import numpy as np

from rail_fem.files.sealed import CHUNK

LEVEL = 1  # of zlib, 1 fast to 9 small: 4 takes 1.4 times as long for 4 % fewer bytes
SECTIONS = ("Points", "Cells", "PointData", "CellData")
HEXAHEDRON = 12  # VTK's number of the cell type
RAW = '<AppendedData encoding="raw">\n_'  # what stands before the first byte of the arrays
KINDS = {"f8": "Float64", "f4": "Float32", "i8": "Int64", "i4": "Int32", "u1": "UInt8"}


class VtuArray(NamedTuple):
    """An array of the file.

    section : Points, Cells, PointData or CellData;  dtype : of one number, little-endian;  width : numbers of a row
    total : rows;  components : names of the numbers of a row, or none
    """

    section: str
    name: str
    dtype: str
    width: int
    total: int
    components: tuple[str, ...] = ()

    @property
    def row(self) -> int:
        """Bytes of a row."""
        return np.dtype(self.dtype).itemsize * self.width

    @property
    def chunks(self) -> int:
        """Number of pieces that are compressed by themselves."""
        return -(-self.total // CHUNK)

    def tag(self, offset: int) -> str:
        """The element that names the array; offset : of its bytes in the appended data."""
        names = "".join(f" ComponentName{i}={quoteattr(name)}" for i, name in enumerate(self.components))
        width = f' NumberOfComponents="{self.width}"' if self.width > 1 and self.section != "Cells" else ""
        return (
            f'<DataArray type="{KINDS[self.dtype]}" Name={quoteattr(self.name)}{width}{names}'
            f' format="appended" offset="{offset}"/>'
        )


def compressed(column: VtuArray, rows: np.ndarray) -> list[bytes]:
    """Chunks of the rows (b, width), which begin with a chunk."""
    little = np.ascontiguousarray(rows, dtype=np.dtype(column.dtype).newbyteorder("<"))
    return [zlib.compress(little[at : at + CHUNK].data, LEVEL) for at in range(0, len(little), CHUNK)]


class Layout(NamedTuple):
    """head, tail : bytes at the beginning and from position `end` on;  headers : of each array and where it stands;
    data : (chunks,) where each array's chunks stand [bytes]"""

    head: bytes
    headers: list[tuple[int, bytes]]
    data: list[np.ndarray]
    tail: bytes
    end: int


def lay_out(columns: Sequence[VtuArray], sizes: Sequence[Sequence[int]], time: float) -> Layout:
    """The file of these arrays. sizes : of the compressed chunks of each [bytes];  time : of the fields [s]"""
    offsets, headers = [], []
    at = 0
    for column, of_chunks in zip(columns, sizes):
        partial = (column.total % CHUNK) * column.row  # 0: the last chunk is whole
        header = np.array([column.chunks, CHUNK * column.row, partial, *of_chunks], "<u8").tobytes()
        offsets.append(at)
        headers.append(header)
        at += len(header) + int(sum(of_chunks))
    head = _xml(columns, offsets, time).encode()
    starts = [len(head) + offset for offset in offsets]
    first = [start + len(header) for start, header in zip(starts, headers)]
    data = [begin + np.cumsum([0, *of_chunks[:-1]], dtype=np.int64) for begin, of_chunks in zip(first, sizes)]
    return Layout(head, list(zip(starts, headers)), data, b"\n</AppendedData>\n</VTKFile>\n", len(head) + at)


def _xml(columns: Sequence[VtuArray], offsets: Sequence[int], time: float) -> str:
    """All up to the first byte of the arrays."""
    rows = {column.section: column.total for column in columns}
    lines = [
        '<?xml version="1.0"?>',
        '<VTKFile type="UnstructuredGrid" version="1.0" byte_order="LittleEndian" header_type="UInt64"'
        ' compressor="vtkZLibDataCompressor">',
        "<UnstructuredGrid>",
        '<FieldData><DataArray type="Float64" Name="TimeValue" NumberOfTuples="1"'
        f' format="ascii">{float(time)!r}</DataArray></FieldData>',
        f'<Piece NumberOfPoints="{rows["Points"]}" NumberOfCells="{rows["Cells"]}">',
    ]
    for section in SECTIONS:
        tags = [column.tag(offset) for column, offset in zip(columns, offsets) if column.section == section]
        lines += [f"<{section}>", *tags, f"</{section}>"]
    return "\n".join([*lines, "</Piece>", "</UnstructuredGrid>", RAW])


def read_arrays(path: Path) -> tuple[dict[str, np.ndarray], float] | None:
    """The arrays of such a file by section and name, "PointData/displacement", with a row for each point, cell or
    number (rows, width), and the time [s]; None for a file that is laid out in another way.

    Errors: OSError; ElementTree.ParseError, ValueError or zlib.error for a damaged file.
    """
    content = Path(path).read_bytes()
    head, mark, data = content.partition(RAW.encode())
    if not mark:
        return None
    root = ElementTree.fromstring(head.decode() + "</VTKFile>")
    kinds = {kind: dtype for dtype, kind in KINDS.items()}
    arrays = {}
    for section in SECTIONS:
        for tag in root.findall(f"./UnstructuredGrid/Piece/{section}/DataArray"):
            flat = _decompressed(data, int(tag.attrib["offset"]), kinds[tag.attrib["type"]])
            arrays[f"{section}/{tag.attrib['Name']}"] = flat.reshape(-1, int(tag.get("NumberOfComponents", 1)))
    time = root.find("./UnstructuredGrid/FieldData/DataArray[@Name='TimeValue']")
    return arrays, float("nan") if time is None else float(time.text or "nan")


def _decompressed(data: bytes, offset: int, dtype: str) -> np.ndarray:
    """The numbers of the array whose header begins at the offset."""
    count, whole, partial = (int(n) for n in np.frombuffer(data, "<u8", 3, offset))
    sizes = np.frombuffer(data, "<u8", count, offset + 24)
    ends = offset + 24 + 8 * count + np.cumsum(sizes, dtype=np.int64)
    chunks = [zlib.decompress(data[end - int(size) : end]) for size, end in zip(sizes, ends)]
    expected = [whole] * (count - 1) + [partial or whole] if count else []
    if [len(chunk) for chunk in chunks] != expected:
        raise ValueError(f"chunks of {[len(chunk) for chunk in chunks]} bytes where {expected} are said")
    numbers = np.frombuffer(b"".join(chunks), np.dtype(dtype).newbyteorder("<"))
    return numbers.astype("f8" if dtype == "f4" else dtype)
