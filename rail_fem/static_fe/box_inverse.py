"""Fast approximate inverse of the elastic stiffness of a block whose elements lie in lines: a preconditioner.

On a box whose elements are a product of three lines the stiffness without the coupling of the three displacement
components is a sum of products of one-dimensional matrices, and is inverted exactly through their eigenvectors, however
unequal the elements' sides are. By Korn's inequality it stays within a fixed factor of the true stiffness, so the steps
of conjugate gradients do not grow with the mesh.
Source: R. E. Lynch, J. R. Rice, D. H. Thomas, Direct solution of partial difference equations by tensor product methods
(1964).
"""

import numpy as np
from scipy.linalg import eigh

from bem.material import Elastic


def line_matrices(line: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Stiffness and mass (n, n) of linear elements between the positions (n,) [m] of a line."""
    step, n = np.diff(line), len(line)
    stiff, mass = np.zeros((n, n)), np.zeros((n, n))
    for i, h in enumerate(step):
        stiff[i : i + 2, i : i + 2] += np.array([[1, -1], [-1, 1]]) / h
        mass[i : i + 2, i : i + 2] += np.array([[2, 1], [1, 2]]) * h / 6
    return stiff, mass


def line_modes(line: np.ndarray, held: slice) -> tuple[np.ndarray, np.ndarray]:
    """Eigenvalues (m,) and modes (n, m) of a line's stiffness to its mass; zero where it is held."""
    stiff, mass = line_matrices(line)
    free = np.setdiff1d(np.arange(len(line)), np.arange(len(line))[held])
    values, vectors = eigh(stiff[np.ix_(free, free)], mass[np.ix_(free, free)])
    modes = np.zeros((len(line), len(free)))
    modes[free] = vectors
    return values, modes


class BoxInverse:
    """Block with nodes at the product of lines x (a,), s (b,), z (c,) [m], z from the face, held at its end; x
    displacement held at x[0].

    Nodes as in rail_fem.static_fe.solid_blocks.block: z fastest.
    """

    def __init__(self, x: np.ndarray, s: np.ndarray, z: np.ndarray, material: Elastic) -> None:
        shear = material.young / (2 * (1 + material.poisson))
        along = shear * (2 - 2 * material.poisson) / (1 - 2 * material.poisson)
        self.shape, nothing, last = (len(x), len(s), len(z)), slice(0, 0), slice(-1, None)
        self._parts = []
        for component in range(3):
            lines = [
                line_modes(x, slice(0, 1) if component == 0 else nothing),
                line_modes(s, nothing),
                line_modes(z, last),
            ]
            factor = [along if axis == component else shear for axis in range(3)]
            value = factor[0] * lines[0][0][:, None, None] + factor[1] * lines[1][0][:, None] + factor[2] * lines[2][0]
            self._parts.append(([modes for _, modes in lines], 1 / value))

    def __call__(self, force: np.ndarray) -> np.ndarray:
        """Displacements (3n,) [m] under forces (3n,) [N]."""
        field, out = force.reshape(*self.shape, 3), np.empty((*self.shape, 3))
        for component, (modes, inverse) in enumerate(self._parts):
            out[..., component] = _turned(_turned(field[..., component], [mode.T for mode in modes]) * inverse, modes)
        return out.ravel()

    def between_face_nodes(self, component: int, i: np.ndarray, j: np.ndarray) -> np.ndarray:
        """Displacements (m, m) [m/N] of a component at face nodes x[i], s[j] under unit forces along it there."""
        (along, across, down), inverse = self._parts[component]
        share = inverse @ down[0] ** 2
        modes = (along[i][:, :, None] * across[j][:, None, :] * np.sqrt(share)).reshape(len(i), -1)
        return modes @ modes.T


def _turned(field: np.ndarray, modes: list[np.ndarray]) -> np.ndarray:
    """Field (a, b, c) with a matrix applied along each axis."""
    a, b, c = field.shape
    out = (modes[0] @ field.reshape(a, -1)).reshape(-1, b, c)
    out = np.matmul(modes[1], out)
    return out @ modes[2].T
