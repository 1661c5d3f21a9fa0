"""Units of length that profile files are written in, and those in which a width can be that of a wheel or rail."""

from geometry.profiles.profile import ProfileError

UNITS = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "inch": 0.0254}  # [m]
GUESSED = ("mm", "m", "inch")  # so far apart that a width fits one of them at most; centimetres have to be said
WIDTHS = {"wheel": (0.090, 0.200), "rail": (0.035, 0.300)}  # between the outermost points [m]


def fitting_units(width: float, kind: str) -> list[str]:
    """Units in which a line of this width can be of this kind."""
    low, high = WIDTHS[kind]
    return [name for name in GUESSED if low <= width * UNITS[name] <= high]


def metres_of(unit: str | None) -> float | None:
    """Length of a unit [m]; None for one that was not told. Errors: ProfileError for one that is none of UNITS."""
    if unit is not None and unit not in UNITS:
        raise ProfileError(f"unit {unit!r}: known are {', '.join(UNITS)}")
    return None if unit is None else UNITS[unit]
