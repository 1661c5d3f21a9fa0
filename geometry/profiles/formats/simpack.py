"""Simpack rail and wheel profiles, .prr and .prw: read with the processing that the file declares, and write."""

import re
from pathlib import Path

import numpy as np

from geometry.profiles.formats.raw import RawProfile, collect, numbers, read_text
from geometry.profiles.profile import ProfileError

KEY = re.compile(r"^\s*([\w.]+)\s*=\s*('[^']*'|\S+)")
COMMENT = re.compile(r"[!%]")
ASKED = ("shift.y", "shift.z", "rotate", "mirror.y", "mirror.z", "inversion", "units.len.f", "units.ang.f")


def read_simpack(path: Path) -> RawProfile:
    """Points of a .prr or .prw with its shift, rotation, mirrors, order and unit applied as it declares them.

    Simpack's vertical axis points down. Bounds, approximation and smoothing that the file asks for are not done: its
    points are taken as they are; for smoothing a note says so. Raises ProfileError with file and line where it is
    malformed.
    """
    lines, notes = read_text(path)
    keys, rows, inside, ended = {}, [], False, False
    for number, line in enumerate(lines, 1):
        text = COMMENT.split(line)[0].strip()
        if text == "point.begin":
            inside = True
        elif text == "point.end":
            inside, ended = False, True
        elif inside and text:
            rows.append((number, numbers(text.split(), path, number)))
        elif match := KEY.match(text):
            keys[match[1]] = match[2].strip("'")
    if not ended:
        raise ProfileError(
            f"{path}: no {'point.end' if inside else 'point.begin'}: not a whole Simpack profile; export it again"
        )
    value = {key: declared(keys, key, path) for key in ASKED}
    if declared(keys, "approx.smooth", path):
        notes.append(f"asks for smoothing {keys['approx.smooth']}, which is not done")
    kind = {"0": "rail", "1": "wheel"}.get(keys.get("type", ""))
    kind = kind_of(lines, path) or kind
    raw = collect(rows, path, "Simpack", kind=kind, up=-1, notes=tuple(notes))
    return processed(raw, value)


def declared(keys: dict, key: str, path: Path) -> float:
    try:
        return float(keys.get(key, 1.0 if key.startswith("units") else 0.0))
    except ValueError:
        raise ProfileError(f"{path}: {key} = {keys[key]} is not a number") from None


def kind_of(lines: list[str], path: Path) -> str | None:
    """What the header says (the spline block has a `type` too), else what the suffix says."""
    head = next((i for i, line in enumerate(lines) if line.strip().startswith("header.end")), 0)
    for line in lines[:head]:
        if (match := KEY.match(COMMENT.split(line)[0])) and match[1] == "type":
            return "wheel" if match[2] == "1" else "rail"
    return {".prw": "wheel", ".prr": "rail"}.get(Path(path).suffix.lower())


def processed(raw: RawProfile, value: dict[str, float]) -> RawProfile:
    """Shift, rotate, mirror, invert, in the order of the file's own numbering."""
    points, notes = raw.points + [value["shift.y"], value["shift.z"]], list(raw.notes)
    lines = raw.lines
    if value["rotate"]:
        angle = value["rotate"] / value["units.ang.f"]
        cosine, sine = np.cos(angle), np.sin(angle)
        points = points @ np.array([[cosine, sine], [-sine, cosine]])
        notes.append(f"rotated by {angle:g} rad as the file asks")
    for column, key in enumerate(("mirror.y", "mirror.z")):
        if value[key]:
            points[:, column] *= -1
            notes.append(f"{key} applied as the file asks")
    if value["inversion"]:
        points, lines = points[::-1], lines[::-1]
        notes.append("order inverted as the file asks")
    return RawProfile(
        points.copy(), lines.copy(), raw.path, raw.layout, 1 / value["units.len.f"], raw.kind, raw.up, tuple(notes)
    )


def write_simpack(path: Path, points: np.ndarray, kind: str, comment: str = "") -> None:
    """Write points (n, 2) [m], z up, as .prr ("rail") or .prw ("wheel") in mm with the vertical axis down."""
    body = [f"    {1e3 * y:+.9e} {-1e3 * z:+.9e}" for y, z in np.asarray(points)]
    head = ["header.begin", "  version = 1", f"  type = {1 if kind == 'wheel' else 0}", "header.end", "spline.begin",
            "  approx.smooth = 0.0", f"  comment = '{comment}'", "  mirror.y = 0", "  mirror.z = 0", "  inversion = 0",
            "  units.len.f = 1000.0", "  units.ang.f = 1.0", "  point.begin"]  # fmt: skip
    Path(path).write_text("\n".join([*head, *body, "  point.end", "spline.end"]) + "\n", encoding="utf-8")
