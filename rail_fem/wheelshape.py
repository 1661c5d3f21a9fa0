"""The wheel's profile that a scene names: one of geometry's by name, or a measured one from a file.

Files in the formats of the field (.prw .whl .ban .mpt) go through the profile doctor. Any other profile file is plain text, one point a line, y and z in mm separated by comma, semicolon or blanks, from the flange back to the
field side; axes of geometry.axes (y = 0, z = 0 at the tread datum, flange downwards). Lines that begin with # are comments, and one
heading line may come first.
"""

from pathlib import Path

import numpy as np

from geometry.formats import read_raw
from geometry.profile_doctor import examine
from geometry.profiles import Profile, ProfileError
from geometry.wheel import WHEEL_NAMES, wheel_profile

FORMATS = (".prw", ".whl", ".ban", ".mpt")
FEWEST_POINTS = 20
WIDTHS = (0.09, 0.20)        # between the outermost points of a wheel [m]
FLANGE_HEIGHTS = (0.02, 0.045)
DATUM_HEIGHT = 2e-3          # how far the profile may pass the tread datum


def wheel_shape(profile: str, far_tread_slope: float = 0.067) -> Profile:
    """The profile of a name or a file. Errors: ProfileError, OSError."""
    if profile in WHEEL_NAMES:
        return wheel_profile(profile, far_tread_slope)
    return read_wheel_file(Path(profile))


def read_wheel_file(path: Path) -> Profile:
    """Read and check a profile file. Errors: ProfileError that says where and what is wrong, OSError."""
    if Path(path).suffix.lower() in FORMATS:
        profile = examine(read_raw(Path(path), "wheel")).profile.graph_part()
        _check(path, profile.points)
        return profile
    try:
        lines = Path(path).read_text(encoding="utf-8-sig").splitlines()
    except UnicodeDecodeError as error:
        raise ProfileError(f"{path}: byte {error.start} is not text") from error
    rows = [(number, line.strip()) for number, line in enumerate(lines, 1) if line.strip() and not line.lstrip().startswith("#")]
    if rows and not _is_point(rows[0][1]):
        rows = rows[1:]
    points = np.array([_point(path, number, line) for number, line in rows]).reshape(-1, 2) * 1e-3
    _check(path, points)
    return Profile.from_points(points, Path(path).name, f"file {path}")


def _split(line: str) -> list[str]:
    return line.replace(",", " ").replace(";", " ").split()


def _is_point(line: str) -> bool:
    try:
        return len([float(word) for word in _split(line)]) == 2
    except ValueError:
        return False


def _point(path: Path, number: int, line: str) -> list[float]:
    if not _is_point(line):
        raise ProfileError(f'{path}: line {number} "{line}" is not "y, z" in mm (decimal point, not comma)')
    return [float(word) for word in _split(line)]


def _check(path: Path, points: np.ndarray) -> None:
    if len(points) < FEWEST_POINTS:
        raise ProfileError(f"{path}: {len(points)} point(s), a wheel profile needs at least {FEWEST_POINTS}")
    if not np.isfinite(points).all():
        raise ProfileError(f"{path}: point {int(np.argmin(np.isfinite(points).all(axis=1))) + 1} is not finite")
    width, flange = np.ptp(points[:, 0]), -points[:, 1].min()
    if not WIDTHS[0] <= width <= WIDTHS[1]:
        raise ProfileError(f"{path}: the profile is {width * 1e3:.4g} mm wide, a wheel is {WIDTHS[0] * 1e3:g} to {WIDTHS[1] * 1e3:g} mm: are its units mm?")
    if not FLANGE_HEIGHTS[0] <= flange <= FLANGE_HEIGHTS[1]:
        raise ProfileError(f"{path}: the lowest point is {flange * 1e3:.4g} mm below the datum, a flange {FLANGE_HEIGHTS[0] * 1e3:g} to {FLANGE_HEIGHTS[1] * 1e3:g} mm: does z point up?")
    if points[0, 0] > points[-1, 0]:
        raise ProfileError(f"{path}: runs from the field side to the flange back: reverse the order of its points")
    nearest = np.abs(points[:, 0]).argmin()
    if not (abs(points[nearest, 0]) < 5e-3 and abs(points[nearest, 1]) < DATUM_HEIGHT):
        raise ProfileError(f"{path}: passes the tread datum (0, 0) at ({points[nearest, 0] * 1e3:.3g}, {points[nearest, 1] * 1e3:.3g}) mm: shift it")
