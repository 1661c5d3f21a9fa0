"""A profile file to a profile, in one call."""

import warnings
from pathlib import Path
from typing import Any

from geometry.profiles.doctor import examine
from geometry.profiles.formats.by_suffix import read_raw
from geometry.profiles.profile import Profile


def read_profile(
    path: Path | str, kind: str | None = None, unit: float | None = None, number: int = 1, **options: Any
) -> Profile:
    """Read a wheel or rail profile of any format, repair and examine it (geometry.profiles.doctor); the part that is a
    line z(y). What was repaired or calls for care comes as a Python warning.

    Parameters
    ----------
    path : Path or str
        The file.
    kind, unit, number
        As of `read_raw`.
    **options
        As of `examine` (smoothing, mirror, flange_back, origin).

    Returns
    -------
    Profile

    Raises
    ------
    ProfileError
        File, line, reason.
    OSError
        Where it cannot be read.

    Examples
    --------
    >>> np.savetxt("wheel.csv", geometry.wheel_profile("P8").points * 1e3, delimiter=",")  # [mm]
    >>> wheel = geometry.read_profile("wheel.csv", kind="wheel")
    >>> bool(abs(wheel.height(0.0)) < 1e-5)  # at the tread datum [m]
    True
    """
    found = examine(read_raw(Path(path), kind, unit, number), **options)
    for finding in found.findings:
        if finding.weight != "found":
            warnings.warn(f"{path}: {finding.weight}: {finding.text}", stacklevel=2)
    return found.profile.graph_part()
