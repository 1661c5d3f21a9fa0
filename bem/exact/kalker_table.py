"""Kalker's coefficients for any ellipse in microseconds: Chebyshev interpolation of rows computed by bem.exact.kalker.

The rows are C11 C22 C23 C33 at the Chebyshev nodes of log(a/b) within 1/20 to 20 (outer) and of Poisson's ratio within
0 to 0.5 (inner), from `creepage_coefficients` at degree 12. `python -m bem.exact.kalker_table` writes them anew to the
file of text beside this one; a test holds them to fresh values. Beyond 1/20 and 20 the problem itself is solved (0.3 s,
kept for the next call).
Error: of the interpolation 3e-5, of the rows 2e-4 in C11 and C22 to 5e-4 in C33 (tests/bem/test_kalker.py).
"""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path

import numpy as np
from numpy.polynomial import chebyshev

from bem.exact.kalker import CreepageCoefficients, check_ellipse, creepage_coefficients

_RATIO_NODES, _POISSON_NODES, _WIDEST, _DEGREE = 13, 7, 20.0, 12
_ROWS = Path(__file__).with_suffix(".txt")


def _nodes(count: int) -> np.ndarray:
    return np.cos((np.arange(count) + 0.5) * np.pi / count)


def coefficients(axis_ratio: float, poisson: float) -> CreepageCoefficients:
    """Creepage coefficients of an ellipse with a/b = axis_ratio (a along x), combined Poisson's ratio 0 to 0.5."""
    check_ellipse(axis_ratio, poisson)
    found = coefficient_rows(np.array([axis_ratio], float), poisson)
    return CreepageCoefficients(*(float(row[0]) for row in found))


def coefficient_rows(axis_ratio: np.ndarray, poisson: float) -> CreepageCoefficients:
    """The same for axis ratios (k,) at once."""
    within = (1 / _WIDEST <= axis_ratio) & (axis_ratio <= _WIDEST)
    ratio = np.where(within, axis_ratio, 1.0)
    along = chebyshev.chebvander(np.log(ratio) / np.log(_WIDEST), _RATIO_NODES - 1)
    across = chebyshev.chebvander(4 * poisson - 1, _POISSON_NODES - 1)[0]
    rows = np.exp(np.einsum("ni,ijk,j->nk", along, _series(), across))
    for k in np.flatnonzero(~within):
        check_ellipse(float(axis_ratio[k]), poisson)
        rows[k] = _beyond(float(axis_ratio[k]), float(poisson))
    return CreepageCoefficients(*rows.T)


@lru_cache(maxsize=256)
def _beyond(axis_ratio: float, poisson: float) -> CreepageCoefficients:
    return creepage_coefficients(axis_ratio, poisson)


@lru_cache(maxsize=1)
def _series() -> np.ndarray:
    """(ratio, poisson, 4) Chebyshev coefficients of the rows' logarithms."""
    rows = np.log(np.loadtxt(_ROWS).reshape(_RATIO_NODES, _POISSON_NODES, 4))
    along = np.linalg.inv(chebyshev.chebvander(_nodes(_RATIO_NODES), _RATIO_NODES - 1))
    across = np.linalg.inv(chebyshev.chebvander(_nodes(_POISSON_NODES), _POISSON_NODES - 1))
    return np.einsum("ai,bj,ijk->abk", along, across, rows)


def computed_rows() -> str:
    """The rows, one line for each pair of nodes, as they stand in the file."""
    lines = []
    for ratio in _WIDEST ** _nodes(_RATIO_NODES):
        for poisson in (1 + _nodes(_POISSON_NODES)) / 4:
            lines.append(" ".join(f"{c:.6g}" for c in creepage_coefficients(ratio, poisson, _DEGREE)))
    return "\n".join(lines)


if __name__ == "__main__":
    _ROWS.write_text(f"{computed_rows()}\n", encoding="utf-8")
