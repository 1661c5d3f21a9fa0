"""Subsurface fatigue from the elastic stress history of a passing patch: Dang Van, Jiang and Sehitoglu.

A point at depth z and side y is led through the stress field of the patch along x. Dang Van: the deviator, less the
centre of the smallest sphere that holds its path, has at each moment a largest shear stress tau; the equivalent stress
is the largest tau + c sigma_h over the pass, sigma_h the hydrostatic stress. Below the shear fatigue limit no crack
begins. Jiang and Sehitoglu: on the plane where it is largest, FP = <sigma_max> d_eps/2 + J d_tau d_gamma [Pa], ranges
over the pass, here of elastic strains.
Residual stress (deviator aside, which moves the sphere with it) enters by its hydrostatic part.

Sources: Dang Van, ASTM STP 1191 (1993) 120; Ekberg, Kabo, Andersson, Fatigue Fract. Eng. Mater. Struct. 25 (2002) 899;
Jiang & Sehitoglu, Wear 224 (1999) 38. Cited from memory of their equations, not opened; constants are parameters.
Smallest sphere: Yildirim, SIAM J. Optim. 19 (2008) 1368, away steps (from memory; held to brute force, and each answer
carries its bound). tests/damage/test_subsurface.py.
"""

from dataclasses import dataclass, replace

import numpy as np

from bem.halfspace.stress import subsurface_stress
from bem.patch import Patch
from kernel_cache import njit
from rail_fem.damage.wear import WearError

TIGHT = 1e-5  # relative, of a sphere's radius
MOST = 2000  # steps towards a sphere
REACH = 3.0  # half lengths of the patch before and behind it that a point is led through
PLANES, DIRECTIONS = 9, 8  # of normals over a right angle; of shear in a plane


@dataclass(frozen=True)
class SubsurfaceSteel:
    """dang_van : c, weight of the hydrostatic stress;  limit : shear fatigue limit [Pa];  hydrostatic : residual [Pa];
    jiang : J;  young [Pa], poisson"""

    dang_van: float = 0.3
    limit: float = 200e6
    hydrostatic: float = 0.0
    jiang: float = 0.25
    young: float = 210e9
    poisson: float = 0.3


@dataclass(frozen=True)
class SubsurfaceFatigue:
    """depth (d,) [m];  dang_van (d, n) equivalent stress [Pa];  jiang (d, n) FP [Pa];  limit [Pa]"""

    depth: np.ndarray
    dang_van: np.ndarray
    jiang: np.ndarray
    limit: float

    @property
    def worst(self) -> tuple[float, float]:
        """Largest equivalent stress over its limit, and the depth at which it is [m]. Above 1 cracks begin."""
        i, _ = np.unravel_index(int(np.argmax(self.dang_van)), self.dang_van.shape)
        return float(self.dang_van.max() / self.limit), float(self.depth[i])


def subsurface_fatigue(
    patch: Patch, steel: SubsurfaceSteel | None = None, depth: np.ndarray | None = None, rows: int | None = None
) -> SubsurfaceFatigue:
    """Of a pass of a patch that carries, with its tractions where they are solved.

    depth : (d,) [m]; None: from a tenth to twice the smaller half-width of the patch;  rows : about so many of the
    patch's rows along x are looked at; None: all
    Error: second order in the patch's cell below half a cell; first order in the depths' spacing. At the surface, and
    where the stress passes the yield stress, an elastic criterion says nothing.
    """
    steel = steel or SubsurfaceSteel()
    if not patch.contact.any():
        raise WearError("a patch without force has no stress history")
    x, y = (positions[patch.contact] for positions in patch.grid.points())
    half = min(np.ptp(x) + patch.grid.dx, np.ptp(y) + patch.grid.dy) / 2
    depth = half * np.linspace(0.1, 2.0, 20) if depth is None else np.atleast_1d(np.asarray(depth, float))
    stress = subsurface_stress(_lengthened(patch), depth, steel.poisson)
    kept = slice(None, None, max(1, patch.grid.ny // (rows or patch.grid.ny)))
    path = np.ascontiguousarray(np.moveaxis(stress, 1, 2)[:, kept])  # (d, n, moments, 6)
    path[..., :3] += steel.hydrostatic
    dang_van, jiang = np.empty(path.shape[:2]), np.empty(path.shape[:2])
    _criteria(path, steel.dang_van, steel.jiang, steel.young, steel.poisson, plane_normals(), dang_van, jiang)
    return SubsurfaceFatigue(depth, dang_van, jiang, steel.limit)


def _lengthened(patch: Patch) -> Patch:
    """The patch on a grid REACH of its half lengths longer at both ends."""
    more = int(np.ceil(REACH * patch.grid.nx / 2))
    grid = replace(patch.grid, x_first=patch.grid.x_first - more * patch.grid.dx, nx=patch.grid.nx + 2 * more)
    pad = lambda values: None if values is None else np.pad(values, ((more, more),) + ((0, 0),) * (values.ndim - 1))
    return Patch(grid, None, pad(patch.pressure), patch.approach, patch.method, pad(patch.traction))


def plane_normals() -> np.ndarray:
    """(k, 3) unit normals of planes, a half sphere of them."""
    found = []
    for polar in np.linspace(0, np.pi / 2, PLANES + 1):
        count = max(1, int(round(4 * PLANES * np.sin(polar))))
        for turn in np.arange(count) * 2 * np.pi / count:
            found.append((np.sin(polar) * np.cos(turn), np.sin(polar) * np.sin(turn), np.cos(polar)))
    return np.array(found)


@njit(cache=True)
def enclosing_sphere(points, centre):
    """Radius of the smallest sphere about points (t, d), at most TIGHT too large; leaves the centre (d,). Frank and
    Wolfe's method on the dual, with away steps."""
    t, d = points.shape
    share = np.zeros(t)
    first = _farthest(points, points[0])
    other = _farthest(points, points[first])
    share[first] += 0.5
    share[other] += 0.5
    centre[:] = 0.5 * (points[first] + points[other])
    largest = 0.0
    for _ in range(MOST):
        square, far, near, largest, least = 0.0, 0, 0, -1.0, np.inf
        for i in range(t):
            distance = 0.0
            for k in range(d):
                distance += (points[i, k] - centre[k]) ** 2
            square += share[i] * distance
            if distance > largest:
                far, largest = i, distance
            if share[i] > 0.0 and distance < least:
                near, least = i, distance
        if square <= 0.0:
            break
        ahead, away = largest / square - 1.0, 1.0 - least / square
        if ahead <= 2.0 * TIGHT:
            break
        if ahead >= away:
            step = ahead / (2.0 * (1.0 + ahead))
            share *= 1.0 - step
            share[far] += step
            centre[:] = (1.0 - step) * centre + step * points[far]
        else:
            most = share[near] / (1.0 - share[near]) if share[near] < 1.0 else np.inf
            step = min(away / (2.0 * (1.0 - away)) if away < 1.0 else np.inf, most)
            share *= 1.0 + step
            share[near] = 0.0 if step == most else share[near] - step
            centre[:] = (1.0 + step) * centre - step * points[near]
    return np.sqrt(max(largest, 0.0))


@njit(cache=True)
def _farthest(points, origin):
    best, at = -1.0, 0
    for i in range(points.shape[0]):
        distance = 0.0
        for k in range(points.shape[1]):
            distance += (points[i, k] - origin[k]) ** 2
        if distance > best:
            best, at = distance, i
    return at


@njit(cache=True)
def _largest_shear(s):
    """(sigma_1 - sigma_3) / 2 of a deviator (6,)."""
    second = 0.5 * (s[0] ** 2 + s[1] ** 2 + s[2] ** 2) + s[3] ** 2 + s[4] ** 2 + s[5] ** 2
    if second <= 0.0:
        return 0.0
    third = s[0] * (s[1] * s[2] - s[3] ** 2) - s[5] * (s[5] * s[2] - s[3] * s[4]) + s[4] * (s[5] * s[3] - s[1] * s[4])
    cosine = 1.5 * np.sqrt(3.0) * third / second**1.5
    angle = np.arccos(min(1.0, max(-1.0, cosine))) / 3.0
    return np.sqrt(second) * np.sin(angle + np.pi / 3.0)


@njit(cache=True)
def dang_van_stress(path, weight):
    """Largest tau + weight sigma_h [Pa] of a closed path (t, 6) of stresses, order VOIGT."""
    t = path.shape[0]
    points, centre, s = np.empty((t, 6)), np.empty(6), np.empty(6)
    root = np.sqrt(2.0)  # shears count twice in a tensor's norm
    for i in range(t):
        mean = (path[i, 0] + path[i, 1] + path[i, 2]) / 3.0
        for k in range(3):
            points[i, k], points[i, k + 3] = path[i, k] - mean, root * path[i, k + 3]
    enclosing_sphere(points, centre)
    worst = -np.inf
    for i in range(t):
        for k in range(3):
            s[k], s[k + 3] = points[i, k] - centre[k], (points[i, k + 3] - centre[k + 3]) / root
        mean = (path[i, 0] + path[i, 1] + path[i, 2]) / 3.0
        worst = max(worst, _largest_shear(s) + weight * mean)
    return worst


@njit(cache=True)
def jiang_sehitoglu(path, share, young, poisson, normals):
    """FP [Pa] of a closed path (t, 6) of elastic stresses, the largest over planes of normals (k, 3); the shear range
    is that of the widest of DIRECTIONS in the plane. Error: planes 10 degrees apart, 2 % at most."""
    best, shear = 0.0, young / (2.0 * (1.0 + poisson))
    turn = np.pi / DIRECTIONS * np.arange(DIRECTIONS)
    cosine, sine = np.cos(turn), np.sin(turn)
    one, two = np.empty(3), np.empty(3)
    for p in range(normals.shape[0]):
        n = normals[p]
        across = np.hypot(n[0], n[1])
        if across > 1e-9:
            one[0], one[1], one[2] = -n[1] / across, n[0] / across, 0.0
        else:
            one[0], one[1], one[2] = 1.0, 0.0, 0.0
        two[0] = n[1] * one[2] - n[2] * one[1]
        two[1] = n[2] * one[0] - n[0] * one[2]
        two[2] = n[0] * one[1] - n[1] * one[0]
        low, high = np.full(DIRECTIONS, np.inf), np.full(DIRECTIONS, -np.inf)
        highest, shortest, longest = -np.inf, np.inf, -np.inf
        for i in range(path.shape[0]):
            s = path[i]
            tx = s[0] * n[0] + s[5] * n[1] + s[4] * n[2]
            ty = s[5] * n[0] + s[1] * n[1] + s[3] * n[2]
            tz = s[4] * n[0] + s[3] * n[1] + s[2] * n[2]
            normal = tx * n[0] + ty * n[1] + tz * n[2]
            a = tx * one[0] + ty * one[1] + tz * one[2]
            b = tx * two[0] + ty * two[1] + tz * two[2]
            strain = ((1.0 + poisson) * normal - poisson * (s[0] + s[1] + s[2])) / young
            highest, shortest, longest = max(highest, normal), min(shortest, strain), max(longest, strain)
            for k in range(DIRECTIONS):
                value = a * cosine[k] + b * sine[k]
                low[k], high[k] = min(low[k], value), max(high[k], value)
        range_ = (high - low).max()
        best = max(best, max(highest, 0.0) * (longest - shortest) / 2.0 + share * range_**2 / shear)
    return best


@njit(cache=True)
def _criteria(path, weight, share, young, poisson, normals, dang_van, jiang):
    for i in range(path.shape[0]):
        for j in range(path.shape[1]):
            dang_van[i, j] = dang_van_stress(path[i, j], weight)
            jiang[i, j] = jiang_sehitoglu(path[i, j], share, young, poisson, normals)
