"""Make plane quadrilaterals well shaped: move the free nodes until each corner is near its target shape.

Source: P. M. Knupp, Introducing the target-matrix paradigm for mesh optimization via node-movement, Engineering with
Computers 28 (2012): T = J W^-1, shape measure |T|^2 / (2 det T); the regularised determinant that untangles folded
corners is that of Escobar et al., Comput. Methods Appl. Mech. Eng. 192 (2003).
"""

from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize

from kernel_cache import njit


@dataclass(frozen=True)
class Smoother:
    """What a plane mesh should look like.

    quads : (k, 4) anticlockwise nodes;  inverse_target : (k, 4, 2, 2) from corner_targets [1/m]
    size_weight : (k,) weight of the size measure det T + 1 / det T against the shape's (0: the quad may have any size)
    free : (n,) bool, nodes that may move
    """

    quads: np.ndarray
    inverse_target: np.ndarray
    size_weight: np.ndarray
    free: np.ndarray

    def smooth(self, points: np.ndarray, rounds: tuple[float, ...] = (1e-3,), iterations: int = 300) -> np.ndarray:
        """Positions (n, 2) with the free nodes moved from `points` (n, 2) towards the least sum of squared corner
        measures.

        rounds : regularisations of the determinant, one minimisation each; begin with 0.1 where corners may be folded.
        Folded corners are unfolded where possible; nothing is promised, measure after.
        """
        scale = np.sqrt(np.abs(np.linalg.det(self.inverse_target)).mean())
        moved, gradient = points.copy(), np.empty_like(points)

        def energy(unknown, regular):
            moved[self.free] = unknown.reshape(-1, 2) / scale
            value = add_corner_energy(moved, self.quads, self.inverse_target, self.size_weight, regular, gradient)
            return value, gradient[self.free].ravel() / scale

        for regular in rounds:
            found = minimize(
                energy,
                moved[self.free].ravel() * scale,
                args=(regular,),
                jac=True,
                method="L-BFGS-B",
                options={"maxiter": iterations, "maxcor": 20, "ftol": 1e-7},
            )
            moved[self.free] = found.x.reshape(-1, 2) / scale
        return moved


def corner_targets(ideal: np.ndarray) -> np.ndarray:
    """Inverse target Jacobians (k, 4, 2, 2) of quads whose ideal shapes are given by corner positions ideal (k, 4, 2)
    [m]."""
    edges = np.stack([np.roll(ideal, -1, axis=1) - ideal, np.roll(ideal, 1, axis=1) - ideal], axis=-1)
    return np.ascontiguousarray(np.linalg.inv(edges))


@njit(cache=True)
def add_corner_energy(points, quads, inverse_target, size_weight, regular, gradient):
    """Sum of squared corner measures; gradient (n, 2) is overwritten with its derivative by the points (n, 2).

    measure = |T|^2 / (2 d) - 1 + weight * (d + 1 / d - 2) / 2, d = (det T + sqrt(det T^2 + regular^2)) / 2 > 0
    """
    gradient[:] = 0.0
    total = 0.0
    for k in range(quads.shape[0]):
        for c in range(4):
            o, a, b = quads[k, c], quads[k, (c + 1) % 4], quads[k, (c + 3) % 4]
            w = inverse_target[k, c]
            j00, j10 = points[a, 0] - points[o, 0], points[a, 1] - points[o, 1]
            j01, j11 = points[b, 0] - points[o, 0], points[b, 1] - points[o, 1]
            t00, t01 = j00 * w[0, 0] + j01 * w[1, 0], j00 * w[0, 1] + j01 * w[1, 1]
            t10, t11 = j10 * w[0, 0] + j11 * w[1, 0], j10 * w[0, 1] + j11 * w[1, 1]
            det = t00 * t11 - t01 * t10
            root = np.sqrt(det * det + regular * regular)
            d = 0.5 * (det + root) if det > 0 else 0.5 * regular * regular / (root - det)
            square = t00 * t00 + t01 * t01 + t10 * t10 + t11 * t11
            measure = square / (2 * d) - 1 + size_weight[k] * (d + 1 / d - 2) / 2
            total += measure * measure
            by_det = (-square / (2 * d * d) + size_weight[k] * (1 - 1 / (d * d)) / 2) * d / root
            s00, s01 = 2 * measure * (t00 / d + by_det * t11), 2 * measure * (t01 / d - by_det * t10)
            s10, s11 = 2 * measure * (t10 / d - by_det * t01), 2 * measure * (t11 / d + by_det * t00)
            a0, a1 = s00 * w[0, 0] + s01 * w[0, 1], s10 * w[0, 0] + s11 * w[0, 1]
            b0, b1 = s00 * w[1, 0] + s01 * w[1, 1], s10 * w[1, 0] + s11 * w[1, 1]
            gradient[a, 0] += a0
            gradient[a, 1] += a1
            gradient[b, 0] += b0
            gradient[b, 1] += b1
            gradient[o, 0] -= a0 + b0
            gradient[o, 1] -= a1 + b1
    return total
