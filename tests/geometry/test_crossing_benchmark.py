"""The parametric crossing at 1:9.25 against the sections of the S&C benchmark's UK crossing (skipped where not at
hand).

Deviations are taken along the surface normal and printed per zone with `pytest -s`.
"""

import numpy as np
import pytest

from geometry.axes import tread_datum_y
from geometry.profiles.formats.slices import read_slices
from geometry.profiles.wheel import wheel_profile
from geometry.surfaces.crossing import CastCrossing
from geometry.surfaces.crossing_surface import centre_line_y, nose_gauge_y
from tests.outside import needs, outside

BENCHMARK = "formats/uk_crossing.slcs"
pytestmark = needs(BENCHMARK)
MM = 1e-3
# zone: body, x range [mm], gate on rms and on the largest deviation [mm]: a fifth above what was measured
ZONES = {
    "plain rail": ("wing", (-1000, -730), 0.001, 0.003),
    "leg transition": ("wing", (-730, -613), 0.044, 0.39),
    "leg": ("wing", (-613, -474), 0.030, 0.18),
    "knuckle and wing before the nose": ("wing", (-474, 0), 0.036, 0.54),
    "wing beside the nose": ("wing", (0, 1000), 0.013, 0.10),
    "nose ramp": ("nose", (118.9, 162), 0.075, 0.25),
    "nose topping": ("nose", (162, 390), 0.006, 0.023),
    "nose roof": ("nose", (390, 1000), 0.002, 0.011),
}
# the running band: where the tread of a centred wheel can stand, without gauge corner and field fall
BAND_GATES = {
    "plain rail": 0.001,
    "leg transition": 0.032,
    "leg": 0.002,
    "wing": 0.002,
    "nose topping": 0.009,
    "nose roof": 0.002,
}


@pytest.fixture(scope="module")
def crossing():
    return CastCrossing(9.25)


@pytest.fixture(scope="module")
def sections():
    """{section number: (x [m], points (n, 2) y, z up [m])}, between x = -1 and +1 m."""
    slices = read_slices(outside(BENCHMARK))
    return {
        n: (x, raw.points * [1.0, raw.up])
        for n, (x, raw) in enumerate(zip(slices.x, slices.sections), 1)
        if abs(x) <= 1.0
    }


def normal_deviation(crossing, body: str, x: float, points: np.ndarray) -> np.ndarray:
    """Distance (n,) of points from the surface along its normal [m], NaN beside the body."""
    step = 1e-6
    height = crossing.top_height(x, points[:, 0], body)
    slope = (crossing.top_height(x, points[:, 0] + step, body) - crossing.top_height(x, points[:, 0] - step, body)) / (
        2 * step
    )
    return (points[:, 1] - height) / np.sqrt(1 + slope**2)


def of_body(crossing, body: str, x: float, points: np.ndarray) -> np.ndarray:
    """Points of a section that belong to the running part of this body: down to 7.5 mm (wing), 30 mm (nose) below the
    crown."""
    if x < crossing.nose_x - 0.01 * MM:
        middle = -np.inf
    else:
        middle = nose_gauge_y(x, crossing.shape) + crossing.flangeway / 2
    mine = points[:, 0] > middle if body == "wing" else points[:, 0] < middle
    return points[mine & (points[:, 1] > (-7.5 if body == "wing" else -30) * MM)]


def zone_deviation(crossing, sections, body, limits, band=None) -> np.ndarray:
    deviations = []
    for x, points in sections.values():
        if not limits[0] * MM <= x < limits[1] * MM:
            continue
        at = max(x, crossing.nose_x) if body == "nose" else x  # the data round the nose's tip to 0.01 mm
        mine = of_body(crossing, body, x, points)
        if band is not None:
            low, high = band(x)
            mine = mine[(mine[:, 0] > low) & (mine[:, 0] < high)]
        deviations.append(normal_deviation(crossing, body, at, mine))
    deviations = np.concatenate(deviations) / MM
    return deviations[np.isfinite(deviations)]


@pytest.mark.parametrize("zone", ZONES)
def test_the_surface_follows_the_benchmark_sections(crossing, sections, zone):
    body, limits, rms_gate, largest_gate = ZONES[zone]
    deviation = zone_deviation(crossing, sections, body, limits)
    rms, largest = np.sqrt(np.mean(deviation**2)), np.abs(deviation).max()
    print(f"{zone}: rms {rms:.4f} mm, largest {largest:.3f} mm, {len(deviation)} points")
    assert len(deviation) > 400
    assert rms < rms_gate and largest < largest_gate


@pytest.mark.parametrize("zone", BAND_GATES)
def test_the_running_band_follows_the_benchmark_to_a_few_hundredths(crossing, sections, zone):
    c = crossing.shape
    bands = {
        "plain rail": ("wing", (-1000, -730), lambda x: (-20 * MM, 25 * MM)),
        "leg transition": ("wing", (-730, -613), lambda x: (-20 * MM, 30 * MM)),
        "leg": ("wing", (-613, -474), lambda x: (-20 * MM, 30 * MM)),
        "wing": ("wing", (150, 500), lambda x: (nose_gauge_y(x, c) + c.flangeway + 4 * MM, 62 * MM)),
        "nose topping": ("nose", (162, 390), lambda x: (-30 * MM, centre_line_y(x, c))),
        "nose roof": ("nose", (390, 1000), lambda x: (-30 * MM, -5 * MM)),
    }
    deviation = zone_deviation(crossing, sections, *bands[zone])
    rms = np.sqrt(np.mean(deviation**2))
    print(f"{zone}: rms {rms:.4f} mm, largest {np.abs(deviation).max():.3f} mm on the running band")
    assert rms < BAND_GATES[zone]


def planar_height(heights: np.ndarray, y: np.ndarray, tread: np.ndarray) -> float:
    """How high a wheel would stand on one section alone, without looking ahead or behind."""
    return float(np.nanmax(heights - tread))


@pytest.mark.parametrize(
    "name, gate", [("P8", 0.06), ("P8-worn", 0.095), ("P8-hollow", 0.11), ("P1", 0.045), ("S1002", 0.037)]
)
def test_wheels_stand_as_high_on_the_parametric_as_on_the_benchmark_sections(crossing, sections, name, gate):
    """The height of a wheel over every section, data against model, apart from the path's own search [mm].

    The largest deviations lie in the leg transition; on the cast leg the data's points overshoot the edge of the fall.
    """
    wheel = wheel_profile(name)
    y = np.arange(-58, 62, 0.02) * MM
    tread = wheel.height(y - tread_datum_y())
    errors = []
    for x, points in sections.values():
        data = np.full(len(y), -np.inf)
        for (y0, z0), (y1, z1) in zip(points[:-1], points[1:]):
            inside = (y >= y0) & (y <= y1)
            if y1 > y0:
                data[inside] = np.maximum(data[inside], z0 + (y[inside] - y0) / (y1 - y0) * (z1 - z0))
        model = np.fmax(crossing.top_height(x, y, "wing"), np.nan_to_num(crossing.top_height(x, y, "nose"), nan=-1.0))
        errors.append((planar_height(data, y, tread) - planar_height(model, y, tread)) / MM)
    errors = np.array(errors)
    print(
        f"{name}: wheel height data - model: rms {np.sqrt(np.mean(errors**2)):.4f} mm, largest"
        f" {np.abs(errors).max():.4f} mm"
    )
    assert np.abs(errors).max() < gate
