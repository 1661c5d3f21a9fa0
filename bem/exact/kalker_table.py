"""Kalker's coefficients for any ellipse in microseconds: Chebyshev interpolation of rows computed by bem.exact.kalker.

The rows are C11 C22 C23 C33 at the Chebyshev nodes of log(a/b) within 1/20 to 20 (outer) and of Poisson's ratio within
0 to 0.5 (inner), from `creepage_coefficients` at degree 12. `python -m bem.exact.kalker_table` prints them anew; a test
holds them to fresh values. Beyond 1/20 and 20 the problem itself is solved (0.3 s, kept for the next call).
Error: of the interpolation 3e-5, of the rows 2e-4 in C11 and C22 to 5e-4 in C33 (tests/bem/test_kalker.py).
"""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.polynomial import chebyshev

from bem.exact.kalker import CreepageCoefficients, check_ellipse, creepage_coefficients

_RATIO_NODES, _POISSON_NODES, _WIDEST, _DEGREE = 13, 7, 20.0, 12


def _nodes(count: int) -> np.ndarray:
    return np.cos((np.arange(count) + 0.5) * np.pi / count)


def coefficients(axis_ratio: float, poisson: float) -> CreepageCoefficients:
    """Creepage coefficients of an ellipse with a/b = axis_ratio (a along x), combined Poisson's ratio 0 to 0.5."""
    check_ellipse(axis_ratio, poisson)
    found = coefficient_rows(np.array([axis_ratio], float), poisson)
    return CreepageCoefficients(float(found.c11[0]), float(found.c22[0]), float(found.c23[0]), float(found.c33[0]))


class CoefficientRows(NamedTuple):
    """CreepageCoefficients of k ellipses, each (k,)."""

    c11: np.ndarray
    c22: np.ndarray
    c23: np.ndarray
    c33: np.ndarray


def coefficient_rows(axis_ratio: np.ndarray, poisson: float) -> CoefficientRows:
    """The same for axis ratios (k,) at once."""
    within = (1 / _WIDEST <= axis_ratio) & (axis_ratio <= _WIDEST)
    ratio = np.where(within, axis_ratio, 1.0)
    along = chebyshev.chebvander(np.log(ratio) / np.log(_WIDEST), _RATIO_NODES - 1)
    across = chebyshev.chebvander(4 * poisson - 1, _POISSON_NODES - 1)[0]
    rows = np.exp(np.einsum("ni,ijk,j->nk", along, _series(), across))
    for k in np.flatnonzero(~within):
        check_ellipse(float(axis_ratio[k]), poisson)
        solved = _beyond(float(axis_ratio[k]), float(poisson))
        rows[k] = solved.c11, solved.c22, solved.c23, solved.c33
    return CoefficientRows(*rows.T)


@lru_cache(maxsize=256)
def _beyond(axis_ratio: float, poisson: float) -> CreepageCoefficients:
    return creepage_coefficients(axis_ratio, poisson)


@lru_cache(maxsize=1)
def _series() -> np.ndarray:
    """(ratio, poisson, 4) Chebyshev coefficients of the rows' logarithms."""
    rows = np.log(np.array(_ROWS.split(), dtype=float).reshape(_RATIO_NODES, _POISSON_NODES, 4))
    along = np.linalg.inv(chebyshev.chebvander(_nodes(_RATIO_NODES), _RATIO_NODES - 1))
    across = np.linalg.inv(chebyshev.chebvander(_nodes(_POISSON_NODES), _POISSON_NODES - 1))
    return np.einsum("ai,bj,ijk->abk", along, across, rows)


def computed_rows() -> str:
    """The rows, one line for each pair of nodes, as they stand below."""
    lines = []
    for ratio in _WIDEST ** _nodes(_RATIO_NODES):
        for poisson in (1 + _nodes(_POISSON_NODES)) / 4:
            c = creepage_coefficients(ratio, poisson, _DEGREE)
            lines.append(f"{c.c11:.6g} {c.c22:.6g} {c.c23:.6g} {c.c33:.6g}")
    return "\n".join(lines)


_ROWS = """
19.9539 26.7762 41.3395 0.172639
19.6496 25.3995 39.2847 0.233637
19.124 23.2456 36.055 0.34791
18.5065 21.0221 32.7019 0.490202
17.9275 19.1866 29.919 0.626486
17.4886 17.931 28.0075 0.729609
17.2541 17.3025 27.0484 0.784258
17.7639 23.421 33.2354 0.186378
17.4783 22.2491 31.6332 0.246867
16.9861 20.4086 29.1045 0.359321
16.4096 18.4999 26.4657 0.498679
15.8708 16.9175 24.2652 0.631946
15.4635 15.8313 22.7482 0.732793
15.2464 15.2866 21.9853 0.786259
14.3028 18.1454 21.8752 0.218287
14.0463 17.2909 20.8904 0.27741
13.6065 15.938 19.3223 0.385717
13.095 14.5208 17.6679 0.518637
12.6204 13.3348 16.2739 0.645304
12.2638 12.5149 15.3052 0.741142
12.0744 12.1019 14.8158 0.79199
10.7576 12.7719 12.2291 0.280152
10.5288 12.2325 11.7421 0.336224
10.1399 11.3671 10.9554 0.436857
9.69322 10.445 10.1099 0.55853
9.28393 9.66099 9.38483 0.673734
8.97969 9.11226 8.87411 0.760785
8.81925 8.83375 8.61387 0.806993
7.94056 8.49366 6.1508 0.399686
7.72687 8.19557 5.95082 0.449325
7.3692 7.70764 5.62069 0.536305
6.96659 7.17435 5.25602 0.639354
6.60528 6.7096 4.935 0.735821
6.34131 6.378 4.70416 0.808377
6.20364 6.20766 4.585 0.84684
6.11535 5.63421 3.02608 0.642104
5.89602 5.48851 2.95172 0.678144
5.53754 5.24348 2.82597 0.739787
5.14652 4.9661 2.68259 0.811037
4.80643 4.71587 2.55241 0.876548
4.56418 4.53233 2.45644 0.9253
4.43987 4.43638 2.40612 0.95101
5.16961 3.97271 1.62628 1.15898
4.92006 3.90923 1.59158 1.16414
4.5254 3.79882 1.53296 1.1732
4.11262 3.66819 1.46609 1.18403
3.76781 3.5451 1.40518 1.19433
3.52985 3.45158 1.36008 1.20221
3.41014 3.40157 1.33635 1.20644
4.82039 3.12141 1.05608 2.27065
4.52275 3.09706 1.02359 2.20072
4.06861 3.05259 0.97139 2.09004
3.61414 2.9968 0.915494 1.97418
3.24958 2.94133 0.867551 1.87734
3.00559 2.89738 0.833664 1.81049
2.8851 2.87326 0.816331 1.77685
4.76169 2.73487 0.837815 4.50292
4.41622 2.72719 0.793752 4.26107
3.90429 2.71158 0.726155 3.89005
3.40947 2.68986 0.658031 3.51626
3.02453 2.66653 0.602998 3.21461
2.77259 2.64707 0.565947 3.01179
2.64981 2.63608 0.547577 2.91135
4.78725 2.57717 0.748192 8.36631
4.40822 2.57562 0.691311 7.80022
3.85678 2.57103 0.60662 6.95506
3.33497 2.56303 0.52435 6.13085
2.93638 2.55332 0.460129 5.48464
2.67888 2.54469 0.418027 5.0593
2.55432 2.53965 0.397496 4.85131
4.81599 2.51708 0.698032 13.7795
4.41837 2.51735 0.632904 12.7416
3.8454 2.51638 0.53761 11.219
3.30913 2.51334 0.446914 9.76426
2.90328 2.50894 0.377366 8.64375
2.64281 2.50473 0.332357 7.91558
2.51729 2.50219 0.310576 7.56216
4.83291 2.49477 0.664084 19.4962
4.42636 2.49545 0.595322 17.9544
3.84316 2.49553 0.495605 15.7136
3.30009 2.49417 0.401661 13.5954
2.89086 2.49175 0.330233 11.9789
2.629 2.48929 0.28428 10.9352
2.50304 2.48777 0.262117 10.4306
4.8401 2.48727 0.645902 23.2875
4.43005 2.48801 0.576037 21.4108
3.84285 2.48834 0.475092 18.6937
3.29713 2.48751 0.380378 16.1368
2.8866 2.48576 0.308609 14.1928
2.62421 2.4839 0.262541 12.9411
2.49808 2.48274 0.24035 12.3368
"""

if __name__ == "__main__":
    print(computed_rows())
