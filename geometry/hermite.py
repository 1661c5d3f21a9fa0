"""The cubic between two points with given slopes: one definition for profiles, outlines, lofts and paths."""

from typing import NamedTuple

from kernel_cache import njit


class Cubic(NamedTuple):
    """Value of a cubic at one position, its slope and second derivative there."""

    value: float
    slope: float
    second: float


@njit(cache=True, error_model="numpy", forceinline=True)
def cubic_between(t, h, first, last, leaving, reaching):
    """Cubic over an interval of length h at its fraction t, from its values at both ends and its slopes there; numbers,
    or arrays (n,) of each.

    Exact for cubics; elsewhere the error is of fourth order in h (value), third (slope) and second (second derivative).
    """
    m0, m1, rise = leaving * h, reaching * h, last - first
    c2, c3 = 3 * rise - 2 * m0 - m1, m0 + m1 - 2 * rise
    return Cubic(
        first + t * (m0 + t * (c2 + t * c3)), (m0 + t * (2 * c2 + t * 3 * c3)) / h, (2 * c2 + 6 * c3 * t) / (h * h)
    )
