"""Which point of one section's outline belongs to which point of another's."""

import numpy as np

from geometry.meshing.section.curve import SectionCurve


def feature_lengths(curves: list[SectionCurve]) -> tuple[np.ndarray, np.ndarray]:
    """Section indices (k,) and mean arc length (k,) [m] up to each over all sections: a measure of outline common to
    them.

    A foot prolonged down to the base lies beyond the section's own indices, on the left below 0
    (mesh_curve.cut_at_base).
    """
    first = min(0.0, np.floor(min(curve.index[0] for curve in curves)))
    last = np.ceil(max(curve.index[-1] for curve in curves))
    index = np.arange(first, last + 1)
    return index, np.mean([np.interp(index, curve.index, curve.arc) for curve in curves], axis=0)


def outline_arcs(
    nodes: np.ndarray,
    features: tuple[np.ndarray, np.ndarray],
    source: tuple[SectionCurve, np.ndarray],
    target: tuple[SectionCurve, np.ndarray],
    reach: float,
) -> np.ndarray:
    """Arc lengths [m] on a target outline of nodes at arc lengths (k,) on the source; each outline with its block's
    columns."""
    (first, first_columns), (second, second_columns) = source, target
    near = [
        min(reach, 0.7 * min(first_columns[0], second_columns[0])),
        min(reach, 0.7 * min(first.length - first_columns[-1], second.length - second_columns[-1])),
    ]
    knots = [
        np.concatenate([[columns[0] - near[0]], columns, [columns[-1] + near[1]]])
        for columns in (first_columns, second_columns)
    ]
    arcs = np.interp(nodes, *knots)
    for outside, feet in ((nodes < knots[0][0], [0, 0]), (nodes > knots[0][-1], [-1, -1])):
        if outside.any():
            ends = [[curve.arc[foot], knot[foot]] for curve, foot, knot in zip((first, second), feet, knots)]
            measure, goal = (_measure(features, curve, pair) for curve, pair in zip((first, second), ends))
            share = (_measure(features, first, nodes[outside]) - measure[0]) / (measure[1] - measure[0])
            arcs[outside] = _arc(features, second, goal[0] + share * (goal[1] - goal[0]))
    return arcs


def _measure(features, curve, arcs):
    """Mean feature length [m] at arc lengths on a curve."""
    return np.interp(np.interp(arcs, curve.arc, curve.index), *features)


def _arc(features, curve, measure):
    """Arc length on a curve at mean feature lengths."""
    return np.interp(np.interp(measure, *features[::-1]), curve.index, curve.arc)
