"""A crossing from its sections: exact on planes, converging to the surface the sections were cut
from, and the benchmark's."""

import numpy as np
import pytest

from geometry.path.wheel_path import wheel_path
from geometry.profiles.formats.slices import read_slices
from geometry.profiles.profile import Profile, ProfileError, line
from geometry.profiles.wheel import wheel_profile
from geometry.surfaces.crossing import CastCrossing
from geometry.surfaces.measured_crossing import MeasuredCrossing, measured_crossing
from geometry.surfaces.sections import SectionCrossing
from tests.geometry.cut_sections import write_cut_sections
from tests.outside import needs, outside

MM = 1e-3
BENCHMARK = outside("formats/uk_crossing.slcs")


def block(face: float, top: float = 0.0) -> np.ndarray:
    """Section of one body with a face of 1:10 at `face`, 60 mm wide."""
    return np.array(
        [[face - 3 * MM, top - 30 * MM], [face, top], [face + 60 * MM, top], [face + 61 * MM, top - 30 * MM]]
    )


def test_a_cylinder_on_a_ramp_of_sections_touches_ahead_of_its_axle():
    """Ramp of slope a: the axle is R (sqrt(1 + a^2) - 1) above the ramp below it, for planes between sections are
    exact."""
    x, slope, radius = np.linspace(0.0, 2.0, 21), 0.008, 0.425
    crossing = measured_crossing(x, [block(-36 * MM, slope * at) for at in x])
    wheel = Profile.from_pieces([line((-10 * MM, 0), (10 * MM, 0), 1 * MM)], "cylinder")
    at = np.array([0.6, 1.0, 1.333])
    path = wheel_path(wheel, crossing, at, radius)
    rise = slope * (at - crossing.plain_x) + radius * (np.sqrt(1 + slope**2) - 1)
    assert np.diff(path.height) == pytest.approx(np.diff(rise), abs=1e-9)
    assert path.contact_point[:, 2] == pytest.approx(slope * path.contact_point[:, 0], abs=1e-9)
    assert path.contact_point[:, 0] - at == pytest.approx(radius * slope / np.sqrt(1 + slope**2), abs=1e-6)
    assert not path.on_nose.any()


def cut(crossing: CastCrossing, stations: np.ndarray) -> MeasuredCrossing:
    y = np.arange(-60, 110, 0.05) * MM
    tops = lambda x: np.fmax(np.fmax(crossing.top_height(x, y, "wing"), crossing.top_height(x, y, "nose")), -55 * MM)
    return measured_crossing(stations, [np.column_stack([y, np.nan_to_num(tops(x), nan=-55 * MM)]) for x in stations])


@pytest.mark.parametrize("limits, gate", [((-0.80, -0.50), 0.02), ((0.20, 0.36), 0.01)])
def test_the_path_over_sections_converges_to_that_over_the_surface_they_were_cut_from(limits, gate):
    """The leg transition and the transfer to the nose: sections 4 mm apart leave less than half of what 16 mm leave."""
    surface, wheel, x = CastCrossing(9.25), wheel_profile("P8"), np.arange(*limits, 4 * MM)
    exact = wheel_path(wheel, surface, x).height
    errors = []
    for spacing in (16 * MM, 4 * MM):
        before, about = np.arange(-1.0, limits[0] - 0.11, 0.05), np.arange(limits[0] - 0.11, limits[1] + 0.12, spacing)
        stations = np.unique(np.round(np.concatenate([[-1.0], before, about]), 6))
        errors.append(np.abs(wheel_path(wheel, cut(surface, stations), x).height - exact).max())
    assert errors[1] < max(0.5 * errors[0], 3e-6)
    assert errors[1] < gate * MM


@needs("formats/uk_crossing.slcs")
@pytest.mark.parametrize(
    "name, gate", [("P8", 0.06), ("P8-worn", 0.09), ("P8-hollow", 0.13), ("P1", 0.05), ("S1002", 0.045)]
)
def test_wheels_run_over_the_benchmark_as_over_the_parametric_crossing(name, gate):
    """Height of the axle [mm] from x = -0.85 to 0.75 m; gates a fifth above what was measured. The larger part is what
    11 to 24 mm between sections leave: sections cut from the parametric surface itself err by 0.048 (P8) and 0.127 mm
    (hollow)."""
    wheel, x = wheel_profile(name), np.arange(-0.85, 0.75, 4 * MM)
    data = wheel_path(wheel, MeasuredCrossing(SectionCrossing.from_slices(read_slices(BENCHMARK))), x, 0.46)
    model = wheel_path(wheel, CastCrossing(9.25), x, radius=0.46)
    assert np.abs(data.height - model.height).max() < gate * MM
    assert data.transfers[0] == pytest.approx(model.transfers[0], abs=2 * MM)


@pytest.fixture(scope="module")
def own_file(tmp_path_factory) -> MeasuredCrossing:
    """The 1:9.25 crossing cut every 16 mm, every 5 mm beside the nose's tip, as the benchmark's is, written as .slcs
    and .prr and read back."""
    stations = np.unique(np.round(np.concatenate([np.arange(-1.0, 1.0, 16 * MM), np.arange(0.12, 0.22, 5 * MM)]), 6))
    file = write_cut_sections(tmp_path_factory.mktemp("cut"), stations)
    return MeasuredCrossing(SectionCrossing.from_slices(read_slices(file)))


@pytest.mark.parametrize(
    "name, gate", [("P8", 0.065), ("P8-worn", 0.09), ("P8-hollow", 0.13), ("P1", 0.05), ("S1002", 0.045)]
)
def test_wheels_run_over_a_file_of_cut_sections_as_over_the_crossing_they_were_cut_from(own_file, name, gate):
    """The gates of the benchmark's own sections (above), with a file of ours: sections 16 mm apart, points 0.2 mm
    apart."""
    wheel, x = wheel_profile(name), np.arange(-0.85, 0.75, 8 * MM)
    data, model = (wheel_path(wheel, crossing, x, radius=0.46) for crossing in (own_file, CastCrossing(9.25)))
    assert np.abs(data.height - model.height).max() < gate * MM
    assert data.transfers[0] == pytest.approx(model.transfers[0], abs=2 * MM)


def test_sections_that_cannot_be_are_refused():
    with pytest.raises(ProfileError, match="turns back"):
        SectionCrossing.from_points(np.array([0.0, 1.0]), [block(0.0)[::-1], block(0.0)])
    with pytest.raises(ProfileError, match="vertical axis"):
        SectionCrossing.from_points(np.array([0.0, 1.0]), [block(0.0, -0.2), block(0.0)])
