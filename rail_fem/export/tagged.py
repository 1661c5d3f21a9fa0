"""A run's mesh and fields with the tags that other programs select parts by: bodies, contact surfaces, bases."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from geometry.meshing.hexmesh import boundary_faces, find_rows
from geometry.surfaces.bodies import REGIONS
from rail_fem.files.sealed import SealError, read_sealed
from rail_fem.result.fields import MESH, Fields, FieldsError, field_file, read_fields

CELL_TAGS = {body: i + 1 for i, body in enumerate(REGIONS)}
# contact: where wheel and crossing may touch; base: faces held by the foundation, of the wheel by its rigid web
FACET_TAGS = {
    f"{body} {part}": first + i for first, part in ((11, "contact"), (21, "base")) for i, body in enumerate(REGIONS)
}


@dataclass(frozen=True)
class TaggedFields:
    """Fields of a run, and the tags of its cells and outer faces.

    fields : see rail_fem.result.fields.Fields;  cell_tags : (m,) int32, CELL_TAGS
    facets : (k, 4) int64, corners in turn, outward by the right-hand rule;  facet_tags : (k,) int32, FACET_TAGS
    facet_cells : (k,) the cell of each facet
    """

    fields: Fields
    cell_tags: np.ndarray
    facets: np.ndarray
    facet_tags: np.ndarray
    facet_cells: np.ndarray


def read_tagged(folder: Path, frame: int | None = None) -> TaggedFields:
    """The last fields of a run (or frame number `frame`) with tags from its mesh. Errors: FieldsError."""
    fields = read_fields(field_file(folder, frame))
    path = Path(folder) / MESH
    try:
        stored, _ = read_sealed(path, {}, "its surfaces cannot be told; run the case again")
    except SealError as error:
        raise FieldsError(str(error)) from error
    if not np.array_equal(stored["cells"], fields.cells):
        raise FieldsError(
            f"{path}: has {len(stored['cells'])} hexahedra, {fields.source} has {len(fields.cells)} or others: the"
            " folder holds files of two runs; run the case again"
        )
    return tagged(fields, stored["surface"], stored["clamp"])


def tagged(fields: Fields, surface: np.ndarray, clamp: np.ndarray) -> TaggedFields:
    """Tags of the faces in `surface` (k, 4), and of the outer faces whose nodes are all in `clamp` (c,)."""
    faces, owner = boundary_faces(fields.cells)
    body = fields.region[owner]
    touches = find_rows(faces, surface) >= 0
    held = np.isin(faces, clamp).all(axis=1) & ~touches
    contact, base = FACET_TAGS[f"{REGIONS[0]} contact"], FACET_TAGS[f"{REGIONS[0]} base"]
    tags = np.where(touches, contact + body, np.where(held, base + body, 0)).astype(np.int32)
    kept = tags > 0
    return TaggedFields(fields, (fields.region + 1).astype(np.int32), faces[kept], tags[kept], owner[kept])
