"""A yielding rail section by boundary and by finite elements, compared in means over equal squares.

Point by point two discretisations differ by the size of their own cells. A mean over a square of stated side is a
number of the steel, and has a limit as cells vanish. Each method's own field is averaged: plastic strain and stress of
a cell, and the line through the three Gauss points of a triangle, read every sixteenth of a millimetre.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from matplotlib.tri import Triangulation
from scipy.spatial import cKDTree

from bem.exact.subsurface import von_mises
from bem.plane_plastic.yielding_contact import PlasticContact
from geometry.meshing.hexmesh import cross_2d
from rail_fem.files.markdown import markdown_table
from rail_fem.result.extrapolation import limit_of, observed_order
from rail_fem.static_fe.plastic_plane import PlasticPlaneContact

MM = 1e-3
READ = MM / 16  # between the points read
SIDES = 0.5e-3, 1e-3, 2e-3, 4e-3  # of the squares [m]


class Window(NamedTuple):
    """Squares begin at its left end and highest point: x from left to right, down from top to bottom [m]."""

    left: float
    right: float
    bottom: float
    top: float

    def points(self) -> np.ndarray:
        """(rows, columns, 2) [m] from the top down."""
        columns, rows = round((self.right - self.left) / READ), round((self.top - self.bottom) / READ)
        x = self.left + READ * (np.arange(columns) + 0.5)
        y = self.top - READ * (np.arange(rows) + 0.5)
        return np.stack(np.meshgrid(x, y), axis=-1)


class Sampled(NamedTuple):
    """One method by one size: plastic strain and von Mises stress [Pa] at a window's points (rows, columns), NaN
    outside the body; largest plastic strain of any cell or Gauss point; size [m]."""

    peeq: np.ndarray
    von_mises: np.ndarray
    largest: float
    size: float


def equivalent(stress: np.ndarray) -> np.ndarray:
    """Von Mises stress (m,) of stress (m, 4) xx yy zz xy."""
    xx, yy, zz, xy = stress.T
    none = np.zeros_like(xy)
    return von_mises(np.column_stack([xx, yy, zz, none, none, xy]))


def window_of(contact: PlasticContact) -> Window:
    """Of whole 4 mm about the cells of the boundary elements."""
    low, high = contact.section.cells.vertices.min(axis=0), contact.section.cells.vertices.max(axis=0)
    width, depth = (max(SIDES) * np.ceil((high - low) / max(SIDES) - 1e-9)).tolist()
    middle = float(low[0] + high[0]) / 2
    return Window(middle - width / 2, middle + width / 2, float(high[1]) - depth, float(high[1]))


def of_cells(contact: PlasticContact, window: Window, size: float) -> Sampled:
    """The last step of boundary elements: each cell's own strain and stress."""
    cells, step = contact.section.cells, contact.steps[-1]
    vertices, number = np.unique(cells.vertices[cells.corners].reshape(-1, 2), axis=0, return_inverse=True)
    corner = number.reshape(-1, 4)
    halves = np.stack([corner[:, [0, 1, 2]], corner[:, [0, 2, 3]]], axis=1).reshape(-1, 3)
    points = window.points()
    at = Triangulation(*vertices.T, halves).get_trifinder()(points[..., 0], points[..., 1])
    read = lambda values: np.where(at >= 0, values[at // 2], np.nan)
    return Sampled(read(step.step.peeq), read(equivalent(step.stress)), float(step.step.peeq.max()), size)


def of_elements(found: PlasticPlaneContact, window: Window, size: float) -> Sampled:
    """The last step of finite elements: linear in each triangle through its Gauss points."""
    step, body, points = found.steps[-1], found.pressed.below, window.points()
    used, corners = np.unique(body.triangles[:, :3], return_inverse=True)
    corners = corners.reshape(-1, 3)
    at = Triangulation(*body.nodes[used].T, corners).get_trifinder()(points[..., 0], points[..., 1])
    gauss = step.points.reshape(-1, 3, 2)  # in the solver's order of the triangles
    _, order = cKDTree(gauss.mean(axis=1)).query(body.nodes[used][corners].mean(axis=1))
    a, b, c = np.moveaxis(gauss[order][at], -2, 0)
    one, two, from_a = b - a, c - a, points - a
    second, third = cross_2d(from_a, two) / cross_2d(one, two), cross_2d(one, from_a) / cross_2d(one, two)
    share = np.stack([1 - second - third, second, third], axis=-1)
    read = lambda values: np.where(at >= 0, (values.reshape(-1, 3)[order][at] * share).sum(axis=-1), np.nan)
    return Sampled(read(step.peeq), read(step.von_mises), float(step.peeq.max()), size)


def block_means(fields: Sequence[np.ndarray], side: float, width: float | None = None) -> tuple[np.ndarray, np.ndarray]:
    """Means (k, squares) of fields (k of (rows, columns)) over squares of a side [m], or slices of that depth and a
    width [m], of the points where all have a value; and the number of those (squares,), none left out but the empty."""
    stack = np.stack(fields)
    kept = np.isfinite(stack).all(axis=0)
    deep, wide = (round(length / READ) for length in (side, width or side))
    rows, columns = (kept.shape[0] // deep, kept.shape[1] // wide)
    summed = lambda values: (
        values[..., : rows * deep, : columns * wide]
        .reshape(*values.shape[:-2], rows, deep, columns, wide)
        .sum(axis=(-3, -1))
        .reshape(*values.shape[:-2], -1)
    )
    count = summed(kept.astype(float))
    return summed(np.where(kept, stack, 0.0))[:, count > 0] / count[count > 0], count[count > 0]


def norm(values: np.ndarray, weight: np.ndarray) -> float:
    """Root of the weighted sum of squares."""
    return float(np.sqrt((weight * values**2).sum()))


def extrapolated(means: np.ndarray, weight: np.ndarray, sizes: Sequence[float]) -> tuple[np.ndarray, float]:
    """Limit (squares,) of means (3, squares) at sizes coarse to fine, by the order with which they approach one another
    in the norm, and this order; the finest where that is below one or none (NaN): such a line adds too much."""
    steps = [norm(one - two, weight) for one, two in zip(means, means[1:])]
    order = observed_order(sizes, [steps[0] + steps[1], steps[1], 0.0])
    if math.isnan(order) or order < 1:
        return means[-1], order
    factor = sizes[2] ** order / (sizes[1] ** order - sizes[2] ** order)
    return means[-1] + factor * (means[-1] - means[-2]), order


def compared(ours: Sequence[Sampled], judge: Sequence[Sampled], name: str) -> list[list[str]]:
    """A row for each length, one of the fields: norm of the difference from the judge's limit over that limit's norm,
    of every size and of the limit of ours; both orders."""
    fields = [getattr(one, name) for one in (*ours, *judge)]
    whole = READ * fields[0].shape[1]
    kinds = [(f"{side / MM:g} mm squares", side, None) for side in SIDES]
    kinds += [("1 mm slices in depth", MM, whole), ("all of it", READ * fields[0].shape[0], whole)]
    rows = []
    for words, side, width in kinds:
        means, weight = block_means(fields, side, width)
        n = len(ours)
        mine, order = extrapolated(means[:n], weight, [one.size for one in ours])
        limit, its_order = extrapolated(means[n:], weight, [one.size for one in judge])
        off = [f"{norm(one - limit, weight) / norm(limit, weight):.2%}" for one in (*means[:n], mine, *means[n:])]
        rows.append([words, *off[:n], f"{off[n]} ({order:.1f})", *off[n + 1 :], f"({its_order:.1f})"])
    return rows


def means_table(ours: Sequence[Sampled], judge: Sequence[Sampled], words: str) -> str:
    """Markdown: both fields by side of the squares, and the largest plastic strain with its limit (second order)."""
    head = ["mean over", *(f"cells of {one.size / MM:.3g} mm" for one in ours), "their limit (order)"]
    head += [*(f"elements of {one.size / MM:.3g} mm" for one in judge), "(order)"]
    text = [f"{words}: cells of {_sizes(ours)} mm against the limit of finite elements of {_sizes(judge)} mm.", ""]
    for name, title in (("peeq", "plastic strain"), ("von_mises", "von Mises stress")):
        text += [f"Norm of the difference, {title}:", "", *markdown_table(head, compared(ours, judge, name)), ""]
    for each, title in ((ours, "boundary elements"), (judge, "finite elements")):
        limit = limit_of([one.size for one in each], [one.largest for one in each], 2.0)
        values = ", ".join(f"{1e4 * one.largest:.2f}" for one in each)
        text.append(
            f"Largest plastic strain by {title}: {values} e-4, limit {1e4 * limit.value:.2f} +- {1e4 * limit.doubt:.2f}"
            f" e-4 (observed order {limit.order:.1f})."
        )
    return "\n".join(text) + "\n"


def _sizes(each: Sequence[Sampled]) -> str:
    return ", ".join(f"{one.size / MM:.3g}" for one in each)
