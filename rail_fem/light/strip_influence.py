"""Mean of 1 / r between the cells of strips: Love's integral where they are near, a series beyond.

Love's double antiderivative of 1 / r is L(x, y) = x asinh(y / |x|) + y asinh(x / |y|), odd in both. With m and M the
lesser and the larger of |x| and |y|

    |L| = m (S(m^2 / M^2) + ln M - ln m),    S(u) = ln(1 + sqrt(1 + u)) + asinh(sqrt(u)) / sqrt(u),

S analytic from 0 to 1: a polynomial of degree DEGREE has it to round-off, and what is left are the logarithms of the
coordinates, which the corners of a strip's cells share.

Error: Love's integral to 1e-13; the series to 0.3 % where it begins (tests/rail_fem/test_load_pressure.py).
Source: Johnson, Contact Mechanics (1985), section 3.3, equation 3.25.
"""

import numpy as np

from kernel_cache import njit

ROWS = 14  # of cells, along the longest strip
LINE = 2 * ROWS - 1  # numbers of rows that may lie between two cells of two strips
NEAR = 1.6  # cells from which the first two terms of the series are good to 0.3 %
DEGREE = 20


def series_coefficients(degree: int = DEGREE) -> np.ndarray:
    """(degree + 1,) of S as a power series in 2 u - 1."""
    inner = lambda u: np.log(1 + np.sqrt(1 + u)) + np.arcsinh(np.sqrt(u)) / np.sqrt(u)
    return np.polynomial.chebyshev.cheb2poly(np.polynomial.Chebyshev.interpolate(inner, degree, domain=[0, 1]).coef)


SERIES = series_coefficients()


@njit(cache=True, error_model="numpy")
def corner(x, y, log_x, log_y):
    """Love's double antiderivative of 1 / r; log_x, log_y : ln |x|, ln |y|."""
    wide, high, apart = abs(x), abs(y), log_x - log_y
    if wide < high:
        wide, high, apart = high, wide, -apart
    if high == 0.0:
        return 0.0
    ratio = high / wide
    z = 2 * ratio * ratio - 1
    square, even, odd = z * z, 0.0, 0.0
    for k in range(DEGREE, 0, -2):  # two short chains instead of one long one
        even = even * square + SERIES[k]
        odd = odd * square + SERIES[k - 1]
    total = high * (even * square + SERIES[0] + odd * z + apart)
    return total if (x < 0) == (y < 0) else -total


@njit(cache=True, error_model="numpy")
def both_edges(x, y_one, y_other, logs):
    """Differences of Love's antiderivative along an edge at x, over the strip from y_one[0] to y_one[1] and over that
    from y_other[0] to y_other[1]; logs : ln |y| of these four."""
    log_x = np.log(abs(x))
    first = corner(x, y_one[1], log_x, logs[1]) - corner(x, y_one[0], log_x, logs[0])
    if y_one[0] == y_other[0] and y_one[1] == y_other[1]:
        return first, first
    return first, corner(x, y_other[1], log_x, logs[3]) - corner(x, y_other[0], log_x, logs[2])


@njit(cache=True, error_model="numpy")
def far_inverse(x, y, length, width_square):
    """Mean of 1 / r over a rectangle about (x, y), far from it, by 1 / r and its second derivatives [1/m]."""
    square = x * x + y * y
    along, across = 3 * x * x / square - 1, 3 * y * y / square - 1
    return (1 + (along * length**2 + across * width_square) / (24 * square)) / np.sqrt(square)


@njit(cache=True, error_model="numpy")
def fill_pair(table, shift, apart, length, one, other):
    """Mean of 1 / r over the cells of one strip and of the other, for every number of rows that lie between them, into
    (LINE,) [1/m].

    shift, apart : from one to the other along x and across;  one, other : their widths [m]
    """
    width_square = 0.5 * (one * one + other * other)
    for k in range(LINE):
        table[k] = far_inverse((k - ROWS + 1) * length + shift, apart, length, width_square)
    near = NEAR * max(length, one), NEAR * max(length, other)
    if apart * apart > max(near[0], near[1]) ** 2:
        return
    y_one, y_other = (apart - 0.5 * one, apart + 0.5 * one), (apart - 0.5 * other, apart + 0.5 * other)
    logs = np.log(abs(y_one[0])), np.log(y_one[1]), np.log(abs(y_other[0])), np.log(y_other[1])
    known, right = -2, (0.0, 0.0)
    for k in range(LINE):
        x = (k - ROWS + 1) * length + shift
        square = x * x + apart * apart
        if square > near[0] ** 2 and square > near[1] ** 2:
            continue
        left = right if known == k - 1 else both_edges(x - 0.5 * length, y_one, y_other, logs)
        right = both_edges(x + 0.5 * length, y_one, y_other, logs)
        known = k
        first, second = (right[0] - left[0]) / (length * one), (right[1] - left[1]) / (length * other)
        if square > near[0] ** 2:
            first = far_inverse(x, apart, length, one * one)
        if square > near[1] ** 2:
            second = far_inverse(x, apart, length, other * other)
        table[k] = 0.5 * (first + second)
