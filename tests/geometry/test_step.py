"""STEP files: the crossing written as surfaces and sliced again; cylinders and planes whose sections are known; what is
refused."""

import math
import re

import numpy as np
import pytest

from geometry.cad.step_crossing import StepReading, read_step
from geometry.cad.step_slices import upper_line
from geometry.cad.step_writer import SplineSurface, StepLines, spline_patch, step_text
from geometry.meshing.gmsh_process import in_gmsh_process
from geometry.path.wheel_path import wheel_path
from geometry.profiles.wheel import wheel_profile
from geometry.surfaces.crossing import CastCrossing, CrossingError
from geometry.surfaces.crossing_surface import FLOOR
from geometry.surfaces.measured_crossing import measured_crossing
from geometry.surfaces.section_cuts import FIRST_STEP, cut_section, cut_stations

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
        exact, own = (wheel_path(wheel_profile(wheel), surface, axle) for surface in (cast, sliced))
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


def _polygon(half, top, chamfer=0.0, foot=None):
    foot = half if foot is None else foot
    right = [(half, top - chamfer), (half - chamfer, top)] if chamfer else [(half, top)]
    return [(-foot, -60), (foot, -60), *right, *((-y, z) for y, z in right[::-1])]


BODIES = {
    "prism": [_polygon(30, 0)] * 2,
    "trapezoid": [_polygon(20, 0, foot=50)] * 2,
    "wedge": [_polygon(20, 0), _polygon(45, -6)],
    "chamfer": [_polygon(30, 0, 5)] * 2,
    "chamfered wedge": [_polygon(30, 0, 5), _polygon(40, -3, 5)],
}


def _occ_body(path, kind, length):
    """A body with its top at z = 0 as STEP, written by Gmsh; lengths in mm there, in m here."""
    import gmsh

    gmsh.initialize(interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        occ, long = gmsh.model.occ, 1e3 * length

        def loft(*outlines):
            """Solid through polygons (y, z) at evenly spaced x [mm]."""
            wires = []
            for k, outline in enumerate(outlines):
                corners = [occ.addPoint(long * k / (len(outlines) - 1), *corner) for corner in outline]
                lines = [occ.addLine(a, b) for a, b in zip(corners, corners[1:] + corners[:1])]
                wires.append(occ.addWire(lines))
            occ.addThruSections(wires, makeRuled=True)

        if kind == "cylinder":
            whole = occ.addCylinder(0, 0, -300, long, 0, 0, 300)
            occ.intersect([(3, whole)], [(3, occ.addBox(0, -30, -60, long, 60, 60))])
        else:
            loft(*BODIES[kind])
        occ.synchronize()
        gmsh.write(path)
    finally:
        gmsh.finalize()


@pytest.mark.parametrize(
    "kind, length",
    [
        ("cylinder", 0.6),
        *(
            pytest.param(*row, marks=pytest.mark.validate)
            for row in [("prism", 2.6), *((kind, 0.6) for kind in BODIES)]
        ),
    ],
)
def test_sharp_edges_take_no_more_sections_than_the_shape_along_the_track(tmp_path, kind, length):
    """What is straight along x needs no station beside those that are tried first; its edges lie on points, to a foot's
    2 um and what a trimmed face's edge is halved to."""
    in_gmsh_process(_occ_body, str(tmp_path / "body.step"), kind, length)
    x, sections = read_step(tmp_path / "body.step", StepReading(named=False))
    assert len(x) == 1 + math.ceil((length - 2e-6) / FIRST_STEP)
    for at, line in zip(x, sections):
        share = at / length
        for first, last in zip(BODIES.get(kind, [[]])[0], BODIES.get(kind, [[]])[-1]):
            y, z = MM * ((1 - share) * np.array(first) + share * np.array(last))
            if z > FLOOR:
                assert np.abs(line - [y, z]).max(axis=1).min() < 3e-6


def test_a_surface_that_no_number_of_sections_meets_is_named_by_its_place(monkeypatch):
    monkeypatch.setattr("geometry.surfaces.section_cuts.MOST_STATIONS", 20)
    y = np.arange(-0.03, 0.03, 1e-4)
    bumps = lambda x: np.column_stack([y, -0.03 * np.abs(y) + 1e-3 * np.sin(x / 5e-3) * (np.abs(y - 0.01) < 2e-3)])
    place = r"at x = 0\.\d+ m, y = 0\.0(08|09|1[0-2])\d* m the surface still lies \d\.\d+ mm"  # on the bumps
    with pytest.raises(CrossingError, match=place):
        cut_stations(bumps, 0.0, 0.4, 10e-6)
