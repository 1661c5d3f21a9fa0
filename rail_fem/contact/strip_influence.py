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


@njit(cache=True, error_model="numpy", forceinline=True)
def corner(x, y, log_x, log_y):
    """Love's double antiderivative of 1 / r; log_x, log_y : ln |x|, ln |y|. Without branches, so that a loop over
    corners takes several at once."""
    wide, high = max(abs(x), abs(y)), min(abs(x), abs(y))
    ratio = high / wide
    z = 2 * ratio * ratio - 1
    square, even, odd = z * z, 0.0, 0.0
    for k in range(DEGREE, 0, -2):  # two short chains instead of one long one
        even = even * square + SERIES[k]
        odd = odd * square + SERIES[k - 1]
    total = high * (even * square + SERIES[0] + odd * z + abs(log_x - log_y))
    total = total if high > 0 else 0.0
    return total if (x < 0) == (y < 0) else -total


@njit(cache=True, error_model="numpy")
def over_edges(first, number, shift, apart, length, one, other):
    """(4 number,) Love's antiderivative on the edges across of cells, from the nearer edge of row `first` on, at both
    sides of a strip `one` wide, then of one `other` wide."""
    corners = np.empty((5, 4 * number))  # one array: the making of five costs as much as the corners
    x, y, log_x, log_y, value = corners[0], corners[1], corners[2], corners[3], corners[4]
    for e in range(number):
        x[e] = (first + e - ROWS) * length + shift + 0.5 * length
        log_x[e] = np.log(abs(x[e]))
    for c in range(4):
        side = apart + (0.5 if c % 2 == 0 else -0.5) * (one if c < 2 else other)
        log_side = np.log(abs(side))
        for e in range(number):
            q = c * number + e
            x[q], log_x[q], y[q], log_y[q] = x[e], log_x[e], side, log_side
    for q in range(4 * number):
        value[q] = corner(x[q], y[q], log_x[q], log_y[q])
    return value


@njit(cache=True, error_model="numpy")
def far_inverse(x, y, length, width_square):
    """Mean of 1 / r over a rectangle about (x, y), far from it, by 1 / r and its second derivatives [1/m]."""
    inverse = 1 / (x * x + y * y)
    along, across = 3 * x * x * inverse - 1, 3 * y * y * inverse - 1
    return (1 + (along * length**2 + across * width_square) * inverse / 24) * np.sqrt(inverse)


@njit(cache=True, error_model="numpy")
def fill_pair(table, first, last, shift, apart, length, one, other):
    """Mean of 1 / r over the cells of one strip and of the other, for numbers of rows that lie between them, into
    (LINE,) [1/m].

    first, last : places in it that are filled
    shift, apart : from one to the other along x and across;  one, other : their widths [m]
    """
    width_square = 0.5 * (one * one + other * other)
    for k in range(first, last + 1):
        table[k] = far_inverse((k - ROWS + 1) * length + shift, apart, length, width_square)
    near = NEAR * max(length, one), NEAR * max(length, other)
    if apart * apart > max(near[0], near[1]) ** 2:
        return
    nearest = np.sqrt(max(near[0], near[1]) ** 2 - apart * apart)
    first = max(first, ROWS - 1 + int(np.ceil((-nearest - shift) / length)))
    last = min(last, ROWS - 1 + int(np.floor((nearest - shift) / length)))
    if last < first:
        return
    number = last - first + 2
    love = over_edges(first, number, shift, apart, length, one, other)
    for k in range(first, last + 1):
        x = (k - ROWS + 1) * length + shift
        square = x * x + apart * apart
        e = k - first
        mean_one = ((love[e + 1] - love[number + e + 1]) - (love[e] - love[number + e])) / (length * one)
        e += 2 * number
        mean_other = ((love[e + 1] - love[number + e + 1]) - (love[e] - love[number + e])) / (length * other)
        if square > near[0] ** 2:
            mean_one = far_inverse(x, apart, length, one * one)
        if square > near[1] ** 2:
            mean_other = far_inverse(x, apart, length, other * other)
        table[k] = 0.5 * (mean_one + mean_other)
