"""Measures of trilinear hexahedra, corners (m, 8, 3) in VTK order [m]: volume, mean gradient, edges, faces, shape and
the length that a stable step goes by."""

import numpy as np

from geometry.meshing.hexmesh import FACES
from kernel_cache import njit

# Corner k of a VTK hexahedron and its three neighbours in right-handed order.
CORNERS = np.array(
    [[0, 1, 3, 4], [1, 2, 0, 5], [2, 3, 1, 6], [3, 0, 2, 7], [4, 7, 5, 0], [5, 4, 6, 1], [6, 5, 7, 2], [7, 6, 4, 3]]
)
EDGES = np.array([[0, 1], [1, 2], [2, 3], [3, 0], [4, 5], [5, 6], [6, 7], [7, 4], [0, 4], [1, 5], [2, 6], [3, 7]])

_part = njit(cache=True, forceinline=True, error_model="numpy")


@_part
def _volume(corner, gradient):
    """Volume of a cell (8, 3), exact, by the divergence theorem over bilinear faces, and its derivative by the
    positions of the corners -> gradient (8, 3). It is of third degree in these: a third of positions times gradient."""
    gradient[:] = 0.0
    for face in range(6):
        for i in range(4):
            here, b, c, d = FACES[face, i], FACES[face, (i + 1) % 4], FACES[face, (i + 2) % 4], FACES[face, (i + 3) % 4]
            for axis in range(3):
                j, k = (axis + 1) % 3, (axis + 2) % 3
                y, z = corner[here, j], corner[here, k]
                by, bz, cy, cz = corner[b, j] - y, corner[b, k] - z, corner[c, j] - y, corner[c, k] - z
                dy, dz = corner[d, j] - y, corner[d, k] - z
                gradient[here, axis] += (by * (cz + dz) - bz * (cy + dy) + cy * dz - cz * dy) / 12
    volume = 0.0
    for node in range(1, 8):
        for axis in range(3):
            volume += (corner[node, axis] - corner[0, axis]) * gradient[node, axis] / 3
    return volume


@_part
def _edge(corner, one, other):
    """Vector from a corner to another."""
    return (corner[other, 0] - corner[one, 0], corner[other, 1] - corner[one, 1], corner[other, 2] - corner[one, 2])


@_part
def _dot(a, b):
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@_part
def _cross(a, b):
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@njit(cache=True, error_model="numpy")
def cell_volume(corner):
    """Exact volumes (m,) [m3] of trilinear hexahedra (m, 8, 3)."""
    out, gradient = np.empty(len(corner)), np.empty((8, 3))
    for m in range(len(corner)):
        out[m] = _volume(corner[m], gradient)
    return out


@njit(cache=True, error_model="numpy")
def mean_gradient(corner):
    """Volume mean of the shape function gradients (m, 8, 3) [1/m] of hexahedra (m, 8, 3): d V / d x_I / V (Flanagan and
    Belytschko 1981)."""
    out = np.empty((len(corner), 8, 3))
    for m in range(len(corner)):
        out[m] /= _volume(corner[m], out[m])
    return out


@njit(cache=True, error_model="numpy")
def face_area(corner):
    """Areas [m2] of the six faces (m, 6) of hexahedra (m, 8, 3), half the cross product of the diagonals (exact for
    plane faces)."""
    out = np.empty((len(corner), 6))
    for m in range(len(corner)):
        for face in range(6):
            a, b, c, d = FACES[face]
            normal = _cross(_edge(corner[m], a, c), _edge(corner[m], b, d))
            out[m, face] = 0.5 * np.sqrt(_dot(normal, normal))
    return out


@njit(cache=True, error_model="numpy")
def edge_length(corner):
    """Lengths [m] of the twelve edges (m, 12) of hexahedra (m, 8, 3)."""
    out = np.empty((len(corner), 12))
    for m in range(len(corner)):
        for edge in range(12):
            along = _edge(corner[m], EDGES[edge, 0], EDGES[edge, 1])
            out[m, edge] = np.sqrt(_dot(along, along))
    return out


@njit(cache=True, error_model="numpy")
def scaled_jacobian(corner):
    """Least over the 8 corners of det(e1, e2, e3) / (|e1| |e2| |e3|): (m,), 1 for a brick, <= 0 for a tangled cell; not
    a number where an edge has no length.

    corner : (m, 8, 3) corner positions, VTK order
    """
    out = np.empty(len(corner))
    for m in range(len(corner)):
        least = np.inf
        for k in range(8):
            here, i, j, l = CORNERS[k]
            a, b, c = _edge(corner[m], here, i), _edge(corner[m], here, j), _edge(corner[m], here, l)
            share = _dot(a, _cross(b, c)) / np.sqrt(_dot(a, a) * _dot(b, b) * _dot(c, c))
            if share < least or share != share:  # keeps what is not a number: no later one is below it
                least = share
        out[m] = least
    return out


@njit(cache=True, error_model="numpy")
def eigen_length(corner, poisson=0.3):
    """Wave speed times the step bound 2 / omega_max [m] of the free one-point hexahedron with lumped mass: (m,).

    omega_max^2 = 8 / rho * largest eigenvalue of C (B B^T); C elastic with Poisson's ratio `poisson`, in units of
    lambda + 2 mu. A cube of side h gives 0.734 h (all three directions in phase), a bound for any mesh of such cells.
    In the principal axes of G = B^T B, with invariants I1 to I3, shear strains stand alone and below the others, whose
    eigenvalues are the roots of s^3 - I1 s^2 + (1 - r^2) I2 s - (1 - r)^2 (1 + 2 r) I3, r = nu / (1 - nu).
    """
    out, gradient, r = np.empty(len(corner)), np.empty((8, 3)), poisson / (1 - poisson)
    for m in range(len(corner)):
        volume = _volume(corner[m], gradient)
        xx = yy = zz = yz = xz = xy = 0.0
        for node in range(8):
            x, y, z = gradient[node, 0] / volume, gradient[node, 1] / volume, gradient[node, 2] / volume
            xx, yy, zz = xx + x * x, yy + y * y, zz + z * z
            yz, xz, xy = yz + y * z, xz + x * z, xy + x * y
        mean = (xx + yy + zz) / 3
        linear = (1 - r**2) * (xx * yy + yy * zz + zz * xx - yz**2 - xz**2 - xy**2)
        determinant = xx * (yy * zz - yz**2) - xy * (xy * zz - xz * yz) + xz * (xy * yz - xz * yy)
        p = mean**2 - linear / 3
        q = mean**3 - mean * linear / 2 + (1 - r) ** 2 * (1 + 2 * r) * determinant / 2
        angle = np.arctan2(np.sqrt(max(p**3 - q**2, 0.0)), q)
        out[m] = 2 / np.sqrt(8 * (mean + 2 * np.sqrt(p) * np.cos(angle / 3)))
    return out
