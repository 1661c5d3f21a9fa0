"""Anderson's mixing: a fixed point x = g(x) from the last few pairs of x and g(x)."""

from __future__ import annotations

import numpy as np


class Mixing:
    """Next x of a fixed-point iteration.

    depth : pairs that are remembered
    Source: Walker and Ni, SIAM J. Numer. Anal. 49 (2011) 1715, algorithm AA with undamped mixing (from memory).
    """

    def __init__(self, depth: int = 6) -> None:
        self.depth = depth
        self.points: list[np.ndarray] = []
        self.answers: list[np.ndarray] = []

    def __call__(self, point: np.ndarray, answer: np.ndarray) -> np.ndarray:
        self.points = [*self.points[-self.depth :], point.ravel().copy()]
        self.answers = [*self.answers[-self.depth :], answer.ravel().copy()]
        if len(self.points) == 1:
            return point + (answer - point)
        residuals = np.array(self.answers) - np.array(self.points)
        changes = np.diff(residuals, axis=0)
        weights = np.linalg.lstsq(changes.T, residuals[-1], rcond=1e-10)[0]
        return (self.answers[-1] - weights @ np.diff(np.array(self.answers), axis=0)).reshape(point.shape)
