"""Graded divisions of a line, by their properties."""

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from geometry.meshing.axis import graded_line, growing_steps
from geometry.meshing.hexmesh import MeshError

LENGTHS = st.floats(0.0, 2.0)


@settings(max_examples=200, deadline=None)
@given(start=st.floats(1e-3, 0.1), length=LENGTHS, growth=st.floats(1.05, 2.0), times=st.floats(1.0, 20.0))
def test_growing_steps_fill_the_length_and_never_fall(start, length, growth, times):
    steps = growing_steps(start, length, growth, start * times)
    if length <= 1e-9 * start:
        assert len(steps) == 0
        return
    assert steps.sum() == pytest.approx(length, rel=1e-9)
    assert (np.diff(steps) >= -1e-12).all()
    assert len(steps) == 1 or steps.min() >= 0.7 * start


@settings(max_examples=200, deadline=None)
@given(
    left=LENGTHS,
    fine=st.floats(0.01, 1.0),
    right=LENGTHS,
    size=st.floats(5e-3, 0.2),
    growth=st.floats(1.1, 2.0),
    multiple=st.sampled_from([1, 3]),
)
def test_graded_line_is_fine_where_asked_and_grows_outside(left, fine, right, size, growth, multiple):
    assume(all(length == 0.0 or length > 1e-8 for length in (left, right)))  # the comparisons below know 1e-9
    ends = (-left, fine + right)
    line = graded_line(*ends, (0.0, fine), size, growth, 10 * size, multiple)
    steps = np.diff(line)
    assert line[0] == ends[0] and line[-1] == ends[1] and (steps > 0).all()
    inside = (line[:-1] > -1e-9) & (line[1:] < fine + 1e-9)
    count = inside.sum()
    assert count >= 1 and len(steps) % multiple == 0 and count % multiple == 0
    assert np.allclose(steps[inside], fine / count, rtol=1e-6)
    # n groups of the nearest step: within half a step in n
    assert abs(count * size - fine) <= multiple * size * (0.5 + 1e-9) or count == multiple
    for outside in (steps[line[1:] <= 1e-12][::-1], steps[line[:-1] >= fine - 1e-12]):
        assert (np.diff(outside) >= -1e-9).all()


@pytest.mark.parametrize(
    "arguments, message",
    [
        (
            ((0.0, 1.0, (0.2, 1.2), 0.1)),
            r"fine range \(0.2, 1.2\) m must be ordered and lie in the range \[0.0, 1.0\] m; change one",
        ),
        (((0.0, 1.0, (0.5, 0.5), 0.1)), "must be ordered"),
        (((0.0, 1.0, (0.2, 0.4), 0.0)), "size 0.0 m must be positive"),
        (((0.0, 1.0, (0.2, 0.4), float("nan"))), "size nan m must be positive"),
        (((0.0, 1.0, (0.2, 0.4), 0.1, 1.0)), "growth 1.0 above 1"),
    ],
)
def test_line_that_cannot_be_divided_is_refused(arguments, message):
    with pytest.raises(MeshError, match=message):
        graded_line(*arguments)
