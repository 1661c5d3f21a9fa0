"""Stress below the patch: closed forms for evenly loaded rectangles, summed over the patch by FFT at each depth.

Body 2 (below) is the half-space z < 0, body 1 (above) z > 0; depth is the distance from the surface, positive.
With V = sum of 1/R, chi = sum of ln(R + depth) and Theta (its second depth derivative is V) over a loaded rectangle,
the stresses are those of Boussinesq and Cerruti; each derivative that appears has a closed form at the corners.
Source: Love (1929); Johnson, Contact Mechanics (1985), eq. 3.1 to 3.8 (potentials), integrated here and held to
quadrature of the point-load solutions (tests/bem/test_halfspace_stress.py).
Error: exact for cells of constant traction; of second order in the cell below half a cell's depth.
"""

from __future__ import annotations

import numpy as np
from scipy import fft

from bem.checks import is_finite
from bem.halfspace.influence import backward, forward, padded_shape
from bem.patch import ContactInputError, Grid, Patch


def _corner_terms(x: np.ndarray, y: np.ndarray, z: float) -> dict[str, np.ndarray]:
    """Double antiderivatives in x and y at the corners; z is the depth > 0. Vx is the x derivative of V, and so on."""
    r = np.sqrt(x**2 + y**2 + z**2)
    return {
        "Vz": -np.arctan2(x * y, z * r),
        "Vx": np.log(y + r),
        "Vy": np.log(x + r),
        "Vxy": 1 / r,
        "Vxz": z / (r * (y + r)),
        "Vyz": z / (r * (x + r)),
        "Vxx": x / (r * (y + r)),
        "Vyy": y / (r * (x + r)),
        "Cxy": np.log(r + z),
        "Cxx": np.arctan(y / x) - np.arctan(y * z / (x * r)),
        "Cyy": np.arctan(x / y) - np.arctan(x * z / (y * r)),
        "Cxyy": y / (r * (r + z)),
        "Cxxy": x / (r * (r + z)),
        "Txxy": -x / (r + z),
        "Txyy": -y / (r + z),
    }


def _pressure_stress(t: dict, z: float, nu: float) -> list[np.ndarray]:
    """xx yy zz yz xz xy by unit pressure, z into the body."""
    vzz = -(t["Vxx"] + t["Vyy"])
    return [
        2 * nu * t["Vz"] - (1 - 2 * nu) * t["Cxx"] - z * t["Vxx"],
        2 * nu * t["Vz"] - (1 - 2 * nu) * t["Cyy"] - z * t["Vyy"],
        t["Vz"] - z * vzz,
        -z * t["Vyz"],
        -z * t["Vxz"],
        -(1 - 2 * nu) * t["Cxy"] - z * t["Vxy"],
    ]


def _traction_x_stress(t: dict, z: float, nu: float) -> list[np.ndarray]:
    """xx yy zz yz xz xy by unit traction along x on the body, z into the body."""
    txxx, cxxx = -t["Txyy"] - t["Vx"], -t["Cxyy"] - t["Vxz"]
    return [
        2 * (1 + nu) * t["Vx"] + 2 * nu * txxx - z * cxxx,
        2 * nu * (t["Vx"] + t["Txyy"]) - z * t["Cxyy"],
        -z * t["Vxz"],
        -z * t["Vxy"],
        t["Vz"] - z * t["Vxx"],
        t["Vy"] + 2 * nu * t["Txxy"] - z * t["Cxxy"],
    ]


def _traction_y_stress(t: dict, z: float, nu: float) -> list[np.ndarray]:
    """The same along y: x and y change places."""
    swapped = {name: t[name[0] + "".join(sorted(name[1:].translate(str.maketrans("xy", "yx"))))] for name in t}
    xx, yy, zz, yz, xz, xy = _traction_x_stress(swapped, z, nu)
    return [yy, xx, zz, xz, yz, xy]


_LOADS = (_pressure_stress, _traction_x_stress, _traction_y_stress)


def offsets(count: int, side: float) -> np.ndarray:
    """Edges of cells at all offsets -(count - 1) .. count - 1 between two cells."""
    return (np.arange(-count + 1, count + 1) - 0.5) * side


def rectangle_stress(load: int, x_edges: np.ndarray, y_edges: np.ndarray, depth: float, poisson: float) -> np.ndarray:
    """(6, len(x_edges) - 1, len(y_edges) - 1) stress by unit load on a rectangle, order VOIGT, z into the body.

    load : 0 pressure, 1 traction along x, 2 along y; the edges are distances from the rectangle's edges to the
        observer:
    entry (i, j) belongs to an observer with x - x_rectangle between the edges i and i + 1 of the rectangle moved there.
    """
    x, y = np.meshgrid(x_edges, y_edges, indexing="ij")
    corners = _LOADS[load](_corner_terms(x, y, depth), depth, poisson)
    return np.array([np.diff(np.diff(corner, axis=0), axis=1) for corner in corners]) / (2 * np.pi)


def subsurface_stress(patch: Patch, depths: np.ndarray, poisson: float, body: int = 2) -> np.ndarray:
    """Stress below (body 2) or above (body 1) every cell centre of the patch.

    Parameters
    ----------
    patch : Patch
        With its pressure, and tractions where it has any.
    depths : (nz,) array
        Distances from the surface > 0 [m].
    poisson : float
        Of the body [1].
    body : {1, 2}
        1 above, 2 below.

    Returns
    -------
    (nz, nx, ny, 6) array
        Stress [Pa], order VOIGT, tension positive, in the patch's axes (z up).

    Examples
    --------
    >>> window = (-0.01, 0.01), (-0.01, 0.01)
    >>> sphere = lambda x, y: (x**2 + y**2) / 0.6
    >>> patch = bem.normal_contact(sphere, bem.STEEL, bem.STEEL, load=50e3, window=window, cells=24)
    >>> bem.subsurface_stress(patch, np.array([1e-3, 2e-3]), poisson=0.3).shape
    (2, 24, 24, 6)
    """
    depths = np.atleast_1d(np.asarray(depths, dtype=float))
    if not depths.size or depths.ndim > 1:
        how = f"of shape {depths.shape}" if depths.size else "empty"
        raise ContactInputError(f"depths are {how}: give at least one depth > 0 [m]")
    if not (np.isfinite(depths).all() and (depths > 0).all()):
        raise ContactInputError(f"depths between {depths.min():g} and {depths.max():g} m: give finite depths > 0")
    if body not in (1, 2):
        raise ContactInputError(f"body {body!r}: 1 is above, 2 below")
    if not (is_finite(poisson) and -1 < poisson <= 0.5):
        raise ContactInputError(f"Poisson's ratio {poisson!r}: must lie above -1 and at most at 0.5")
    if patch.curved:
        raise ContactInputError(
            f"stress below a patch by {patch.method}: it lies along a curved face with a section of its own, and these"
            " are the closed forms of a half-space; take a flat patch (normal_contact), or for the plane"
            " bem.plane.internal"
        )
    loads = [patch.pressure]
    if patch.traction is not None:
        sign = 1.0 if body == 1 else -1.0
        loads += [sign * patch.traction[..., axis] for axis in (0, 1)]
    spectra = [forward(load, padded_shape(*patch.grid.shape)) for load in loads]
    return np.stack([_layer(patch.grid, spectra, depth, poisson, body) for depth in depths])


def _layer(grid: Grid, spectra: list[np.ndarray], depth: float, poisson: float, body: int) -> np.ndarray:
    """(nx, ny, 6) stress at a depth by the spectra of pressure and of the tractions on this body, where there are
    any."""
    x_edges, y_edges, size = offsets(grid.nx, grid.dx), offsets(grid.ny, grid.dy), padded_shape(*grid.shape)
    total = sum(
        fft.rfft2(rectangle_stress(load, x_edges, y_edges, depth, poisson), s=size) * spectrum
        for load, spectrum in enumerate(spectra)
    )
    stress = backward(total, grid.shape, size, (grid.nx - 1, grid.ny - 1))
    if body == 2:
        stress[3:5] *= -1.0
    return np.moveaxis(stress, 0, -1)
