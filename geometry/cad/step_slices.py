"""Sections of the faces of a STEP file at planes x = const. Runs in Gmsh's process. Axes: geometry.axes.

Each face is tabulated over its two parameters; where a line of the table passes the plane, the point is closed in on
the face itself by the secant method (Illinois), so that its x is exact to 1e-9 m. Trimmed faces are cut at their edges.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from geometry.meshing.gmsh_fill import gmsh_session
from geometry.meshing.gmsh_process import reading
from geometry.surfaces.bodies import BODIES, CrossingError
from geometry.surfaces.crossing_surface import FLOOR
from geometry.surfaces.section_cuts import MARGIN, SPACING

CHORD = 2e-6  # by which a table's lines may cut a face's curves across the track [m]
CHORD_ALONG = 50e-6  # the same along the track, where points are closed in on the face
LEAST_LINES, MOST_LINES = 9, 1025  # of a table, in either direction
ON_PLANE = 1e-9  # [m]
ASKED = 64  # lines in either direction whose points are asked whether they belong to a face
HALVINGS = 14  # to where a face's edge cuts a line
# turn of a section that gets a point, seen over this length to both sides; less is met to 9 um by points 0.2 mm apart
CORNER, BESIDE = np.radians(10), 0.05e-3
FOOT, STEEP = 2e-6, 20.0  # of a straight side beside its edge: how far it is put, and the slope from which on [m]
TOO_NEAR = 10e-6  # to a corner for another point [m]


@dataclass(frozen=True, eq=False)
class Face:
    """A face tabulated: u (n,), v (m,) parameters; points (n, m, 3) [m]; trimmed : not all of them belong to it;
    ends : least and largest x of every line of the table, in both directions [m]"""

    tag: int
    u: np.ndarray
    v: np.ndarray
    points: np.ndarray
    trimmed: bool
    ends: tuple[tuple[np.ndarray, np.ndarray], ...]


@contextmanager
def opened_step(path: Path) -> Iterator:
    """Gmsh with the shapes of a STEP file, in metres. Errors: CrossingError."""
    with gmsh_session() as gmsh:
        gmsh.option.setString("Geometry.OCCTargetUnit", "M")
        try:
            with reading():
                gmsh.model.occ.importShapes(str(path), highestDimOnly=False)
        except Exception as error:  # gmsh raises plain Exceptions
            raise CrossingError(f"{path}: Gmsh cannot read it as STEP ({error})") from None
        gmsh.model.occ.synchronize()
        yield gmsh


def faces_by_body(gmsh, path: Path, named: bool) -> dict[str, list[int]]:
    """Tags of the faces of "wing" and "nose" by the names of shapes, parts or assemblies; all of them under "wing"
    where they are to be found. Errors: CrossingError that says which names there are."""
    everything = [tag for _, tag in gmsh.model.getEntities(2)]
    if not everything:
        raise CrossingError(f"{path}: holds no face")
    if not named:
        return {"wing": everything}
    found: dict[str, list[int]] = {name: [] for name in BODIES}
    labels = set()
    for dim in (2, 3):
        for _, tag in gmsh.model.getEntities(dim):
            label = gmsh.model.getEntityName(dim, tag)
            words = [word.strip() for word in label.split("/")[1:] if word.strip()]
            labels |= set(words[-1:])
            for name in BODIES:
                if name in (word.lower() for word in words):
                    found[name] += [tag] if dim == 2 else [int(of) for of in gmsh.model.getAdjacencies(3, tag)[1]]
    missing = [name for name in BODIES if not found[name]]
    if missing:
        there = ", ".join(f'"{label[:40]}"' for label in sorted(labels)[:12]) or "none"
        raise CrossingError(
            f"{path}: no body or sheet is named {' or '.join(missing)} (names in the file: {there}): name the parts or"
            ' bodies "wing" and "nose" in the CAD system, or give faces = "found" to take the highest of all faces'
        )
    return {name: sorted(set(tags)) for name, tags in found.items()}


def tabulated(gmsh, tag: int) -> Face:
    """The face's table, its lines so near to each other that their chords stay within CHORD."""
    low, high = gmsh.model.getParametrizationBounds(2, tag)
    lines = [np.linspace(a, b, LEAST_LINES) for a, b in zip(low, high)]
    while True:
        points = _values(gmsh, tag, *lines)
        grown = []
        for axis in (0, 1):
            finer = len(lines[axis]) < MOST_LINES and _chord(points, axis) > 1.0
            grown.append(np.linspace(low[axis], high[axis], 2 * len(lines[axis]) - 1) if finer else lines[axis])
        if all(len(new) == len(old) for new, old in zip(grown, lines)):
            break
        lines = grown
    asked = [line[1 : -1 : max(1, len(line) // ASKED)] for line in lines]
    inner = np.stack(np.meshgrid(*asked, indexing="ij"), axis=-1).reshape(-1, 2)
    trimmed = gmsh.model.isInside(2, tag, inner.ravel(), parametric=True) < len(inner)
    ends = tuple((points[..., 0].min(axis=axis), points[..., 0].max(axis=axis)) for axis in (1, 0))
    u, v = lines
    return Face(tag, u, v, points, trimmed, ends)


def _values(gmsh, tag: int, u: np.ndarray, v: np.ndarray) -> np.ndarray:
    at = np.stack(np.meshgrid(u, v, indexing="ij"), axis=-1)
    return np.array(gmsh.model.getValue(2, tag, at.ravel())).reshape(len(u), len(v), 3)


def _chord(points: np.ndarray, axis: int) -> float:
    """Largest distance of every second point from the chord of its neighbours along an axis, over what is allowed."""
    p = np.moveaxis(points, axis, 0)
    first, middle, last = p[:-2:2], p[1:-1:2], p[2::2]
    chord = last - first
    length = np.maximum(np.linalg.norm(chord, axis=-1), 1e-12)
    away = np.linalg.norm(np.cross(middle - first, chord), axis=-1) / length
    along = np.abs(chord[..., 0]) > 0.7 * length
    return float(np.max(away / np.where(along, CHORD_ALONG, 4 * CHORD), initial=0.0))


def slice_face(gmsh, face: Face, x: float) -> np.ndarray:
    """(k, 2, 2)  pieces of the face's section at x: y, z of both ends [m]."""
    face = _near(face, x)
    away = face.points[..., 0] - x
    away = np.where(np.abs(away) < ON_PLANE, ON_PLANE, away)  # no point of the table lies on the plane itself
    above = away > 0
    along_u, along_v = above[1:] != above[:-1], above[:, 1:] != above[:, :-1]
    i, j = np.nonzero(along_u)
    k, m = np.nonzero(along_v)
    first = np.r_[np.column_stack([face.u[i], face.v[j]]), np.column_stack([face.u[k], face.v[m]])]
    last = np.r_[np.column_stack([face.u[i + 1], face.v[j]]), np.column_stack([face.u[k], face.v[m + 1]])]
    values = np.r_[away[i, j], away[k, m]], np.r_[away[i + 1, j], away[k, m + 1]]
    if not len(first):
        return np.empty((0, 2, 2))
    at, points = _closed_in(gmsh, face.tag, first, last, *values, x)
    number_u, number_v = np.full(along_u.shape, -1), np.full(along_v.shape, -1)
    number_u[i, j], number_v[k, m] = np.arange(len(i)), len(i) + np.arange(len(k))
    sides = np.stack([number_u[:, :-1], number_v[1:], number_u[:, 1:], number_v[:-1]], axis=-1).reshape(-1, 4)
    crossed = np.array([row[row >= 0] for row in sides[(sides >= 0).sum(axis=1) == 2]], int).reshape(-1, 2)
    saddles = sides[(sides >= 0).all(axis=1)]
    ends = np.r_[crossed, saddles[:, :2], saddles[:, 2:]]
    pieces = points[ends][..., 1:]
    return _cut_at_edges(gmsh, face.tag, at[ends], pieces) if face.trimmed else pieces


def _near(face: Face, x: float) -> Face:
    """The part of a table that the plane may pass."""
    parts = []
    for ends in face.ends:
        low, high = np.minimum(ends[0][1:], ends[0][:-1]), np.maximum(ends[1][1:], ends[1][:-1])
        passed = np.flatnonzero((low <= x + ON_PLANE) & (high >= x - ON_PLANE))
        parts.append(slice(passed[0], passed[-1] + 2) if len(passed) else slice(0, 1))
    return Face(face.tag, face.u[parts[0]], face.v[parts[1]], face.points[parts[0], parts[1]], face.trimmed, face.ends)


def _closed_in(gmsh, tag, first, last, low, high, x) -> tuple[np.ndarray, np.ndarray]:
    """Parameters (k, 2) and points (k, 3) where lines from first to last pass the plane: regula falsi, Illinois."""
    a, b = np.zeros(len(first)), np.ones(len(first))
    fa, fb = low.copy(), high.copy()
    side = np.zeros(len(first), int)
    for _ in range(40):
        t = np.clip((a * fb - b * fa) / (fb - fa), a, b)
        at = first + t[:, None] * (last - first)
        points = np.array(gmsh.model.getValue(2, tag, at.ravel())).reshape(-1, 3)
        f = points[:, 0] - x
        if np.abs(f).max(initial=0.0) < ON_PLANE:
            break
        same = np.sign(f) == np.sign(fa)
        fb = np.where(same & (side == 1), fb / 2, np.where(same, fb, f))
        fa = np.where(~same & (side == -1), fa / 2, np.where(same, f, fa))
        a, b = np.where(same, t, a), np.where(same, b, t)
        side = np.where(same, 1, -1)
    return at, points


def _cut_at_edges(gmsh, tag: int, at: np.ndarray, pieces: np.ndarray) -> np.ndarray:
    """Pieces of a trimmed face: those inside, shortened where the face's edge cuts them. at : (k, 2, 2) parameters of
    their ends"""
    inside = lambda uv: gmsh.model.isInside(2, tag, uv, parametric=True) > 0
    known: dict[bytes, bool] = {}
    kept = []
    for ends, piece in zip(at, pieces):
        within = [known.setdefault(end.tobytes(), inside(end)) for end in ends]
        if not any(within):
            continue
        if not all(within):
            good, bad = (ends[0], ends[1]) if within[0] else (ends[1], ends[0])
            for _ in range(HALVINGS):
                middle = 0.5 * (good + bad)
                good, bad = (middle, bad) if inside(middle) else (good, middle)
            piece = piece.copy()
            piece[0 if not within[0] else 1] = gmsh.model.getValue(2, tag, good)[1:]
        kept.append(piece)
    return np.array(kept).reshape(-1, 2, 2)


def upper_line(pieces: np.ndarray, spacing: float = SPACING) -> np.ndarray:
    """(n, 2)  y, z of the highest of all pieces (k, 2, 2), evenly spaced in y, with points on the corners; the floor
    beside and between them."""
    if not len(pieces):
        return np.empty((0, 2))
    pieces = np.where((pieces[:, :1, :1] <= pieces[:, 1:, :1]), pieces, pieces[:, ::-1])
    first, last = (
        np.floor((end + by) / spacing) for end, by in ((pieces[..., 0].min(), -MARGIN), (pieces[..., 0].max(), MARGIN))
    )
    y, corners = spacing * np.arange(first, last + 2), _corners(pieces)
    y = y[np.abs(y[:, None] - corners).min(axis=1, initial=np.inf) > TOO_NEAR]
    y = np.sort(np.r_[y, corners])
    return np.column_stack([y, _highest(pieces, y)])


def _corners(pieces: np.ndarray) -> np.ndarray:
    """y (k,) [m] of the ends of pieces where their highest line turns by more than CORNER, and FOOT beside those from
    which it falls straight down."""
    y, z = np.unique(pieces.reshape(-1, 2), axis=0).T
    top = z > _highest(pieces, y) - ON_PLANE
    y, z = y[top], z[top]
    left, right = (np.arctan2(side * (_highest(pieces, y + side * BESIDE) - z), BESIDE) for side in (-1, 1))
    y, z = (part[np.abs(right - left) > CORNER] for part in (y, z))
    feet = [y + foot for foot in (-FOOT, FOOT) if len(y)]
    fallen = [at[z - _highest(pieces, at) > STEEP * FOOT] for at in feet]
    y = np.sort(np.concatenate([y, *fallen]))
    return y[np.diff(y, prepend=-np.inf) > FOOT / 2]


def _highest(pieces: np.ndarray, y: np.ndarray) -> np.ndarray:
    """(n,)  height of the highest of all pieces at y (n,), growing; the floor beside them [m]."""
    low, high = pieces[:, 0, 0], pieces[:, 1, 0]
    begin, end = np.searchsorted(y, low - 1e-12), np.searchsorted(y, high + 1e-12, side="right")
    count = end - begin
    of = np.repeat(np.arange(len(pieces)), count)
    index = np.arange(count.sum()) - np.repeat(np.cumsum(count) - count, count) + begin[of]
    width = np.maximum(high - low, 1e-15)[of]
    share = np.clip((y[index] - low[of]) / width, 0.0, 1.0)
    z = np.full(len(y), FLOOR)
    np.maximum.at(z, index, (1 - share) * pieces[of, 0, 1] + share * pieces[of, 1, 1])
    return z
