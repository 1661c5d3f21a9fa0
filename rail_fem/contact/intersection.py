"""What a wheel's surface and a body's make at a small depth: the gap between them about a contact, and the paraboloid
that intersects a plane as deep, as long, as wide and over the same area."""

import numpy as np

from geometry.path.path_search import rise
from geometry.profiles.profile import hermite, hermite_many
from geometry.surfaces.bodies import NO_METAL
from geometry.surfaces.surface_height import surface_height
from kernel_cache import njit

FAR = 1.0  # gap where there is no surface [m]

_part = njit(cache=True, forceinline=True, error_model="numpy")


@_part
def _gap_at(rail, tread, ahead, radius):
    return tread + rise(ahead, radius - tread) - rail if rail > 0.5 * NO_METAL and not np.isnan(tread) else np.inf


@njit(cache=True, error_model="numpy")
def gaps_at(x, at_x, at_y, rail, radius, datum, profile):
    """How far (n,) [m] a wheel with its axle over x is above heights `rail` at (at_x, at_y), up to a constant, each
    (n,); inf without metal. profile : tables of the wheel"""
    out = np.empty(len(x))
    for i in range(len(x)):
        tread, _ = hermite(at_y[i] - datum, *profile)
        out[i] = _gap_at(rail[i], tread, at_x[i] - x[i], radius)
    return out


@njit(cache=True, error_model="numpy")
def gaps_about(x, at, along, across, cosine, radius, datum, profile, nose, c, loft):
    """Gaps (n, p, q) [m] around contact points at (n, 3) of a wheel with its axle over x (n,), along their normals,
    which have this cosine (n,) to the vertical: 0 at the contact, at most FAR."""
    out = np.empty((len(x), len(along), len(across)))
    for i in range(len(x)):
        y = at[i, 1] + across * cosine[i]
        tread, _ = hermite_many(y - datum, *profile)
        for j in range(len(along)):
            at_x = at[i, 0] + along[j]
            for k in range(len(across)):
                out[i, j, k] = _gap_at(surface_height(at_x, y[k], nose, c, loft), tread[k], at_x - x[i], radius)
        least = out[i, len(along) // 2, len(across) // 2]
        for j in range(len(along)):
            for k in range(len(across)):
                out[i, j, k] = min((out[i, j, k] - least) * cosine[i], FAR)
    return out


@njit(cache=True, error_model="numpy")
def equivalent_paraboloid(gap, rows, columns, along, across, depth):
    """Radii (n, 2) [m] of the paraboloid that intersects to `depth` (n,) as the gaps do, the centre of pressure across
    (n,) [m], and how asymmetric the intersection is (n,). gap : (n, p, q) at distances along (p,) and across (q,), its
    least in each of the rows (n, p) and columns (n, q)

    Length, width and area are those of the position where the gap, linear between its samples, is below the depth; the
    centre is that of its piece at the contact point: over a groove, which the wheel spans, there is no contact.
    """
    radii, centre, asymmetry = np.empty((len(depth), 2)), np.empty(len(depth)), np.empty(len(depth))
    lengths, strips = np.empty(len(along) - 1), np.empty(len(along))
    widths, moments = np.empty(len(across) - 1), np.empty(len(across) - 1)
    for i in range(len(depth)):
        for j in range(len(along)):
            strips[j] = 0.0
            if rows[i, j] < depth[i]:
                strips[j] = _length_below(gap[i, j], across, depth[i], widths)
        length = _length_below(rows[i], along, depth[i], lengths)
        area = _sum((along[1:] - along[:-1]) * (strips[1:] + strips[:-1]) / 2)
        width = _length_below(columns[i], across, depth[i], widths)
        balance = _sum(widths * (across[1:] + across[:-1]) / 2) / max(width, 1e-15)
        scale = area / (np.pi / 4 * length * width)
        radii[i, 0] = length * length / 4 * scale / (2 * depth[i])
        radii[i, 1] = width * width / 4 * scale / (2 * depth[i])
        centre[i] = _centre_of_pressure(columns[i], across, depth[i], widths, moments)
        asymmetry[i] = abs(balance) / (width / 2)
    return radii, centre, asymmetry


@_part
def _lane(values, first):
    """Of eight partial sums of a sum, those of NumPy, which do not wait for one another."""
    total = values[first]
    for k in range(first + 8, len(values), 8):
        total += values[k]
    return total


@_part
def _sum(values):
    """Of (eight or more,) values."""
    first = (_lane(values, 0) + _lane(values, 1)) + (_lane(values, 2) + _lane(values, 3))
    return first + ((_lane(values, 4) + _lane(values, 5)) + (_lane(values, 6) + _lane(values, 7)))


@_part
def _length_below(gap, positions, depth, shares):
    """Length [m] of the positions (q,) where the gap (q,) is below the depth; of each stretch between positions into
    shares (q - 1,)."""
    for k in range(len(shares)):
        low, high = min(gap[k], gap[k + 1]), max(gap[k], gap[k + 1])
        share = (depth - low) / max(high - low, 1e-15)
        shares[k] = min(max(share, 0.0), 1.0) * (positions[k + 1] - positions[k])
    return _sum(shares)


@_part
def _centre_of_pressure(gap, across, depth, loads, moments):
    """[m]: of strips at across (q,), q odd, that carry in proportion to how far the gap (q,), linear in between, is
    below the depth; as an ellipse's strips do, and those of Piotrowski and Kik's pressure. Of the piece about the
    middle one alone. loads, moments : (q - 1,), room

    On a wing's lopsided gaps 0.2 to 0.5 mm too far out: half-spaces have 0.8 to 1.0 mm, the intersection's middle lies
    at 1.6 to 2.2 mm (tests/damage/test_patch_centre.py)."""
    first = last = len(gap) // 2
    while first > 0 and gap[first] < depth:
        first -= 1
    while last < len(loads) and gap[last] < depth:
        last += 1
    loads[:], moments[:] = 0.0, 0.0
    for k in range(first, last):
        left, right = depth - gap[k], depth - gap[k + 1]
        zero = across[k] + (across[k + 1] - across[k]) * left / (1.0 if left == right else left - right)
        begin, end = zero if left < 0 else across[k], zero if right < 0 else across[k + 1]
        left, right = max(left, 0.0), max(right, 0.0)
        loads[k] = (end - begin) * (left + right) / 2
        moments[k] = (end - begin) * (left * (2 * begin + end) + right * (begin + 2 * end)) / 6
    return _sum(moments) / max(_sum(loads), 1e-30)
