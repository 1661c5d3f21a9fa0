"""What the surface and the yielding cells feel of each other: stress below loads, displacement above plastic strain."""

from __future__ import annotations

import numpy as np
from scipy import fft

from bem.halfspace.influence import backward, forward, padded_shape
from bem.halfspace.stress import offsets, rectangle_stress
from bem.material import Elastic
from bem.patch import Grid
from bem.plastic.corners import corner_planes
from bem.plastic.symbols import coefficient_tables, depth_parity
from bem.steel.deviator import FROM_DEVIATOR, MEAN, TO_DEVIATOR


class LoadStress:
    """Deviator and mean stress at the centres of layers below a loaded grid, in depth-positive axes.

    loads : 0 pressure, 1 and 2 tractions along x and y on the body
    """

    def __init__(self, grid: Grid, depths: np.ndarray, poisson: float, loads: tuple[int, ...] = (0,)) -> None:
        self.grid, self.size, self.loads = grid, padded_shape(*grid.shape), loads
        x, y = offsets(grid.nx, grid.dx), offsets(grid.ny, grid.dy)
        rows = np.vstack([TO_DEVIATOR, MEAN])
        self.spectra = []
        for load in loads:
            kernels = np.stack([np.tensordot(rows, rectangle_stress(load, x, y, z, poisson), 1) for z in depths])
            self.spectra.append(fft.rfft2(kernels, s=self.size))

    def __call__(self, fields: tuple[np.ndarray, ...], layers: int | None = None) -> tuple[np.ndarray, np.ndarray]:
        """(nz, 5, nx, ny) deviator and (nz, nx, ny) mean stress [Pa] under loads (nx, ny) [Pa], one for each of
        `loads`; of the first `layers` only, where given."""
        nx, ny = self.grid.shape
        total = sum(kernel[:layers] * forward(field, self.size) for kernel, field in zip(self.spectra, fields))
        stress = backward(total, (nx, ny), self.size, (nx - 1, ny - 1))
        return np.ascontiguousarray(stress[:, :5]), stress[:, 5]


class SurfaceDisplacement:
    """Normal displacement of the surface by plastic strain below a grid, at the centres of its cells, positive
    downwards."""

    def __init__(self, grid: Grid, layers: int, thickness: float, elastic: Elastic) -> None:
        self.grid, self.size = grid, padded_shape(*grid.shape)
        x, y = offsets(grid.nx, grid.dx), offsets(grid.ny, grid.dy)
        levels = np.arange(layers + 1) * thickness
        tables = coefficient_tables(elastic.poisson)
        parity = np.array([depth_parity((2,), k) for k in range(6)])
        full = tables["full displacement"][2] * parity[:, None, None, None]
        faces = np.stack([_face(x, y, z, full, tables["surface displacement"][2]) for z in levels])
        kernels = np.diff(np.diff(faces[:-1] - faces[1:], axis=-2), axis=-1)
        self.spectra = fft.rfft2(kernels, s=self.size)

    def __call__(self, strain: np.ndarray) -> np.ndarray:
        """(nx, ny) displacement [m] by plastic strain (nz, 5, nx, ny)."""
        nx, ny = self.grid.shape
        total = np.einsum("kcij,kcij->ij", self.spectra[: len(strain)], forward(strain, self.size))
        return backward(total, (nx, ny), self.size, (nx - 1, ny - 1))


def _face(x: np.ndarray, y: np.ndarray, z: float, full: np.ndarray, free: np.ndarray) -> np.ndarray:
    """(5, ...) corner values of a layer's face at depth z, seen from the surface."""
    values = corner_planes(x, y, np.array([z]))[0]
    table = full[..., 0, 0] + z * full[..., 1, 0] + free[..., 0, 0] + z * free[..., 0, 1]
    return np.einsum("kf,kc,fij->cij", table, FROM_DEVIATOR, values, optimize=True)
