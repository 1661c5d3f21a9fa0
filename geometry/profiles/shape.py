"""What a line of points is by its shape: its unit, rail or wheel, which way up, at which end its flange. Nothing is
repaired here."""

import numpy as np

from geometry.profiles.formats.raw import RawProfile
from geometry.profiles.formats.units import GUESSED, UNITS, WIDTHS, fitting_units
from geometry.profiles.profile import ProfileError, along, lengths

WIDEST_HEAD = 0.100  # of a line whose kind nobody told, to pass for a rail head [m]
FLANGE = (0.020, 0.045)  # height of a flange over its tread [m]
# of the flange at FLANGE_AT beyond the tread; a rim face, vertical, spans 1 to 5 mm there [m]
FLANGE_SPAN = (0.008, 0.045)
FLANGE_AT = 0.010
TREAD_BAND = 0.010  # within which the middle of a tread lies [m]
# turn that a head may make the wrong way; turn that a head makes at least
STRAIGHT, TURNED = np.radians(30.0), np.radians(60.0)


def find_unit(raw: RawProfile, kind: str) -> tuple[float, str, str, str]:
    """Length of the unit [m], its name, a remark, a warning. What the caller told holds; what the file declares, unless
    another unit fits better.

    Where neither says, the one unit that makes the width fit. Raises ProfileError where there is none, or the file's
    cannot be.
    """
    low, high = (1e3 * limit for limit in WIDTHS[kind])
    width = np.ptp(raw.points[:, 0])
    fitting = fitting_units(width, kind)
    if raw.unit is None:
        if len(fitting) != 1:
            which = "neither mm, m nor inch" if not fitting else " and ".join(fitting)
            raise ProfileError(
                f"{raw.path}: the points span {width:.4g}; a {kind} is {low:g} to {high:g} mm wide, which fits {which}:"
                f" state the unit{raw.as_read}"
            )
        return UNITS[fitting[0]], fitting[0], f" (by its width of {1e3 * width * UNITS[fitting[0]]:.4g} mm)", ""
    name = next((n for n, u in UNITS.items() if np.isclose(u, raw.unit)), f"units of {raw.unit:g} m")
    if low <= 1e3 * width * raw.unit <= high:
        return raw.unit, name, "", ""
    said = (
        f"in {name} as {'told' if raw.unit_told else 'declared'} the {kind} is {1e3 * width * raw.unit:.4g} mm wide,"
        f" one is {low:g} to {high:g} mm"
    )
    if fitting and not raw.unit_told:
        raise ProfileError(f"{raw.path}: {said}; it would fit in {fitting[0]}: state the unit")
    return raw.unit, name, "", f"{said}: a part of one, or the wrong unit"


def guess_kind(raw: RawProfile) -> str:
    """Wheel or rail by shape. Raises ProfileError where the line has neither a flange and a tread nor one convex
    head."""
    width = np.ptp(raw.points[:, 0])
    units = [UNITS[unit] for unit in GUESSED] if raw.unit is None else [raw.unit]
    fitting = lambda low, high: [unit for unit in units if low <= width * unit <= high]
    ups = (raw.up,) if raw.up else (1, -1)
    if any(wheel_poses(raw.points * unit, ups) for unit in fitting(*WIDTHS["wheel"])):
        return "wheel"
    right, left = turning(raw.points)
    if min(right, left) < STRAIGHT and max(right, left) > TURNED and fitting(WIDTHS["rail"][0], WIDEST_HEAD):
        return "rail"
    raise ProfileError(
        f"{raw.path}: neither a whole wheel (flange and tread) nor one rail head by its shape: name the kind, rail or"
        f" wheel{raw.as_read}"
    )


def evenly(points: np.ndarray, count: int) -> np.ndarray:
    """(count, 2)  points at equal lengths along the line, from smaller to larger y."""
    points = points if points[0, 0] <= points[-1, 0] else points[::-1]
    return along(points, np.linspace(0.0, lengths(points)[-1], count))


def turning(points: np.ndarray) -> tuple[float, float]:
    """How far the line, from smaller to larger y, turns to the right and to the left at most, scatter averaged away
    [rad].

    A rail head upright turns to the right alone, upside down to the left alone; a wheel turns both ways, at its flange
    and at its root.
    """
    smooth = evenly(points, 600).reshape(60, 10, 2).mean(axis=1)
    angle = np.unwrap(np.arctan2(*np.diff(smooth, axis=0).T[::-1]))
    right = np.max(np.maximum.accumulate(angle) - angle)
    left = np.max(angle - np.minimum.accumulate(angle))
    return float(right), float(left)


def wheel_poses(points: np.ndarray, ups: tuple[int, ...] = (1, -1)) -> list[tuple[int, int]]:
    """All (up, side) with which points (n, 2) [m] * [side, up] are a wheel: flange at -y pointing down, then root and
    tread.

    The flange is told from the rim face, which may reach farther from the tread: where both stand 10 mm beyond it the
    flange is 8 to 45 mm wide, the rim face, being vertical, 1 to 5 mm.
    """
    line = evenly(points, 1500)
    return [(up, side) for up in ups for side in (1, -1) if is_wheel(line * [side, up])]


def is_wheel(line: np.ndarray) -> bool:
    """Whether a line (n, 2) [m], evenly sampled, has a flange at its smaller y that points down and a tread beside
    it."""
    y, z = line.T
    y = y - y.min()
    width = y.max()
    tread = z[(y > 0.45 * width) & (y < 0.8 * width)]
    if len(tread) == 0:
        return False
    level = np.median(tread)
    beyond = (y < 0.5 * width) & (z < level - FLANGE_AT)
    if not beyond.any() or np.abs(tread - level).max() > TREAD_BAND:
        return False
    height, span = level - z[y < 0.5 * width].min(), np.ptp(y[beyond])
    return bool(0.9 * FLANGE[0] < height < 1.1 * FLANGE[1] and FLANGE_SPAN[0] < span < FLANGE_SPAN[1])


def rail_up(points: np.ndarray) -> tuple[int, bool]:
    """+1 where the head points up, -1 down; and whether that is certain: a head is convex all along."""
    right, left = turning(points)
    if min(right, left) < STRAIGHT:
        return (1 if right > left else -1), max(right, left) > TURNED
    y, z = points.T if points[0, 0] < points[-1, 0] else points[::-1].T
    chord = np.interp(y, [y[0], y[-1]], [z[0], z[-1]])
    return (1 if np.median(z - chord) > 0 else -1), False
