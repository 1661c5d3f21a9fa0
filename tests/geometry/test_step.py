"""STEP files: the crossing written as surfaces and sliced again; cylinders and planes whose sections are known; what is
refused."""

import re

import numpy as np
import pytest

from geometry.cad.step_crossing import StepReading, read_step
from geometry.cad.step_slices import upper_line
from geometry.cad.step_writer import SplineSurface, StepLines, spline_patch, step_text
from geometry.path.wheel_path import wheel_path
from geometry.profiles.wheel import wheel_profile
from geometry.surfaces.crossing import CastCrossing, CrossingError
from geometry.surfaces.measured_crossing import measured_crossing
from geometry.surfaces.section_cuts import cut_section, cut_stations

MM = 1e-3
WINDOW = 0.05, 0.50
PLAIN = -1.0, -0.95


@pytest.fixture(scope="module")
def cast():
    return CastCrossing(10.75)


@pytest.fixture(scope="module")
def step(cast, tmp_path_factory):
    """The crossing about the nose, written as STEP."""
    x, _ = cut_stations(lambda at: cut_section(cast, at), *WINDOW, 10e-6, (cast.nose_x + 1e-6,))
    path = tmp_path_factory.mktemp("step") / "own.step"
    path.write_text(step_text(cast, x))
    return path


def test_a_crossing_written_as_step_and_sliced_again_carries_wheels_as_before(cast, step):
    """To 0.01 mm about the nose. The first section must be plain rail: two of it are put before those of the file."""
    x, sections = read_step(step)
    assert x[0] == pytest.approx(WINDOW[0], abs=2e-6) and x[-1] == pytest.approx(WINDOW[1], abs=2e-6)
    leg = np.r_[np.linspace(*PLAIN, 2), np.linspace(-0.8, 0.04, 85)]
    sliced = measured_crossing(np.r_[leg, x], [*(cut_section(cast, at) for at in leg), *sections])
    axle = np.arange(0.16, 0.38, 4 * MM)
    for wheel in ("P8-worn", "P8", "P1"):
        exact, own = (wheel_path(surface, wheel_profile(wheel), axle) for surface in (cast, sliced))
        assert np.abs(own.height - exact.height).max() < 10e-6
        assert own.transfers == pytest.approx(exact.transfers, abs=0.1 * MM)


def test_sections_of_a_sheet_with_known_sections(tmp_path):
    """A sheet on a circle of 300 mm across whose middle rises along the track by x^2 / 4 m: in CAD as cubics, exact."""
    across = np.linspace(-0.03, 0.03, 31)
    x = np.linspace(0.0, 0.4, 41)
    points = np.array([np.column_stack([across, np.sqrt(0.09 - across**2) - 0.3 + at**2 / 4]) for at in x])
    stations, sections = read_step(_file(tmp_path, ("wing", points), ("nose", points - [0.12, 0.0]), x=x))
    assert len(stations) > 4
    for at, line in zip(stations, sections):
        y, z = line[np.abs(line[:, 0]) < 0.029].T
        exact = np.sqrt(0.09 - y**2) - 0.3 + at**2 / 4
        assert np.abs(z - exact).max() < 8e-6  # slopes at the ends of a PCHIP are of second order, and chords of 0.2 mm


def _file(folder, *bodies, x):
    lines = StepLines()
    for name, points in bodies:
        lines.body(name, [spline_patch(x, points)])
    cast = CastCrossing(10.75)
    whole = step_text(cast, np.linspace(0.0, 0.01, 4))
    head, tail = whole[: whole.index("#1=")], "ENDSEC;\nEND-ISO-10303-21;\n"
    path = folder / "sheets.step"
    path.write_text(head + "".join(f"#{k}={text};\n" for k, text in enumerate(lines.entities, 1)) + tail)
    return path


@pytest.mark.parametrize(
    "harm, complaint",
    [
        (
            lambda text: text.replace("PRODUCT('nose','nose'", "PRODUCT('frog','frog'"),
            'named nose .*"frog", "wing".*faces = "found"',
        ),
        (lambda text: text.replace("'wing'", "'a'").replace("'nose'", "'b'"), "wing or nose"),
        (lambda text: text[:3000], "cannot read it as STEP|holds no face"),
        (lambda text: "solid no step\n", "cannot read it as STEP|holds no face"),
    ],
)
def test_what_is_no_step_of_a_crossing_is_refused(step, tmp_path, harm, complaint):
    path = tmp_path / "bad.step"
    path.write_text(harm(step.read_text()))
    with pytest.raises(CrossingError, match=complaint):
        read_step(path)


def test_unnamed_faces_are_found_as_the_highest(step, tmp_path):
    path = tmp_path / "unnamed.step"
    path.write_text(re.sub(r"PRODUCT\('\w+','\w+'", "PRODUCT('part','part'", step.read_text()))
    named, found = read_step(step, StepReading(tolerance=50e-6)), read_step(path, StepReading(False, 50e-6))
    assert np.array_equal(named[0], found[0]) and all(np.array_equal(*pair) for pair in zip(named[1], found[1]))


def test_the_unit_is_that_of_the_file(step, tmp_path):
    """The same numbers in metres are a crossing of 450 m."""
    path = tmp_path / "metres.step"
    path.write_text(step.read_text().replace("SI_UNIT(.MILLI.,.METRE.)", "SI_UNIT($,.METRE.)"))
    with pytest.raises(CrossingError, match="the file's unit right"):
        read_step(path)


def test_the_upper_line_is_that_of_the_highest_piece():
    pieces = np.array([[[0.0, -0.01], [0.01, -0.01]], [[0.012, 0.0], [0.004, -0.02]]])
    line = upper_line(pieces, 1e-3)
    at = lambda y: line[np.argmin(np.abs(line[:, 0] - y)), 1]
    assert (at(0.002), at(0.006), at(0.012)) == pytest.approx((-0.01, -0.01, 0.0))
    assert at(-0.002) == at(0.014) < -0.05


def test_a_patch_goes_through_its_points():
    x = np.array([0.0, 0.1, 0.15, 0.4])
    points = np.random.default_rng(1).normal(size=(4, 7, 2))
    patch: SplineSurface = spline_patch(x, points)
    assert patch.control.shape == (8, 7, 3) and len(patch.along) == 12 and len(patch.across) == 11
    assert patch.control[[0, -1], 0, 1:] == pytest.approx(points[[0, -1], 0])
