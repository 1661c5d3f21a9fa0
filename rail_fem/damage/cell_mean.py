"""Mean over a cell of a coefficient that jumps between regions of pressure and velocity.

A cell that lies across a border of the map belongs to both regions. Its share of each follows from pressure and
velocity as they run through the cell, linear between its neighbours; across a jump (where slip begins) they are even.
"""

from kernel_cache import njit

PARTS = 8  # of a cell each way, where it lies across a border


@njit(cache=True)
def _region(value, borders):
    n = 0
    while n < len(borders) and borders[n] < value:
        n += 1
    return n


@njit(cache=True)
def _change(before, own, after):
    """Over a cell: the smaller of the two differences to its neighbours, 0 at a peak."""
    left, right = own - before, after - own
    if left * right <= 0.0:
        return 0.0
    return left if abs(left) < abs(right) else right


@njit(cache=True)
def means_over_cells(first, second, first_borders, second_borders, values, out):
    """Means (k, nx, ny) of values (m + 1, n + 1), told by regions between borders (m,) and (n,) of two fields
    (k, nx, ny), into out. A cell's region is all of it where no border runs through it."""
    count, nx, ny = first.shape
    for k in range(count):
        for i in range(nx):
            low, high = max(i - 1, 0), min(i + 1, nx - 1)
            for j in range(ny):
                near, far = max(j - 1, 0), min(j + 1, ny - 1)
                p, v = first[k, i, j], second[k, i, j]
                p_x = _change(first[k, low, j], p, first[k, high, j])
                p_y = _change(first[k, i, near], p, first[k, i, far])
                v_x = _change(second[k, low, j], v, second[k, high, j])
                v_y = _change(second[k, i, near], v, second[k, i, far])
                p_half, v_half = (abs(p_x) + abs(p_y)) / 2, (abs(v_x) + abs(v_y)) / 2
                row, column = _region(p - p_half, first_borders), _region(v - v_half, second_borders)
                if row == _region(p + p_half, first_borders) and column == _region(v + v_half, second_borders):
                    out[k, i, j] = values[row, column]
                    continue
                total = 0.0
                for a in range(PARTS):
                    s = (a + 0.5) / PARTS - 0.5
                    for b in range(PARTS):
                        t = (b + 0.5) / PARTS - 0.5
                        row = _region(p + s * p_x + t * p_y, first_borders)
                        total += values[row, _region(v + s * v_x + t * v_y, second_borders)]
                out[k, i, j] = total / PARTS**2
