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
    line z(y).

    kind, unit, number : as of `read_raw`;  options : as of `examine` (smoothing, mirror, flange_back, origin)

    What was repaired or calls for care comes as a Python warning. Errors: ProfileError (file, line, reason), OSError.
    """
    found = examine(read_raw(Path(path), kind, unit, number), **options)
    for finding in found.findings:
        if finding.weight != "found":
            warnings.warn(f"{path}: {finding.weight}: {finding.text}", stacklevel=2)
    return found.profile.graph_part()
