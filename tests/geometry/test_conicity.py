"""Equivalent conicity: cones and a hardening curve with closed forms, order on a table; curves of P8 on BS113A."""

import numpy as np
import pytest
from scipy.integrate import quad

from geometry.conicity import equivalent_conicity, shift_curves, wavelength
from geometry.contact_points import ContactSearch
from geometry.profiles import Profile, line
from geometry.wheel import wheel_profile
from geometry.wheelset import Track, Wheelset, WheelsetError

MM = 1e-3
RADIUS, BASE = 0.46, 1.5


@pytest.mark.parametrize("amplitude", [0.5 * MM, 3 * MM, 7 * MM])
@pytest.mark.parametrize("centre", [0.0, 1.3 * MM])
def test_cones_have_klingels_wavelength_at_every_amplitude(amplitude, centre):
    """L = 2 pi sqrt(e r0 / (2 tan gamma)), wherever the wheelset runs straight."""
    tangent = 0.05
    shift = np.arange(-120, 121) * 0.1 * MM
    found = wavelength(shift, 2 * tangent * (shift - centre), amplitude, RADIUS, BASE)
    assert found == pytest.approx(2 * np.pi * np.sqrt(BASE * RADIUS / (2 * tangent)), rel=1e-9)


def test_a_hardening_curve_has_the_wavelength_of_its_first_integral_and_is_second_order_or_better():
    """Dr = a y + b y^3: y' = sqrt((2 / (e r0)) (U(A) - U(y))), U = a y^2/2 + b y^4/4; Duffing by quadrature of smooth integrand."""
    a, b, amplitude = 0.1, 2e3, 5 * MM
    # (U(A) - U(y)) / (A^2 - y^2) = a/2 + b (A^2 + y^2) / 4
    smooth = lambda t: 1 / np.sqrt(2 / (BASE * RADIUS) * (a / 2 + b * amplitude**2 * (1 + np.sin(t) ** 2) / 4))
    exact = 2 * quad(smooth, -np.pi / 2, np.pi / 2, epsabs=1e-13)[0]
    steps, errors = np.array([2.0, 1.0, 0.5]) * MM, []
    for step in steps:
        shift = np.arange(-round(12 * MM / step), round(12 * MM / step) + 1) * step
        errors.append(wavelength(shift, a * shift + b * shift**3, amplitude, RADIUS, BASE) - exact)
    assert abs(errors[-1]) < 1e-3 * exact
    assert abs(errors[-1]) < abs(errors[0]) / 10  # second order would be 16; monotone cubics are between second and third


def cone_search(slope: float) -> ContactSearch:
    wheel = Profile.from_pieces([line((-50 * MM, -50 * MM * slope), (60 * MM, 60 * MM * slope), 1 * MM)], "cone")
    return ContactSearch(Wheelset(wheel, radius=RADIUS), Track.plain_line("60E1", 1 / 40))


@pytest.mark.parametrize("slope", [0.025, 0.05])
def test_conical_wheels_have_their_slope_as_conicity(slope):
    """Dr = 2 y slope, but that the wheelset rolls by slope * y / 0.75 m and its contacts drift with the roll over crown and radius:

    the conicity differs from the slope by no more than (crown + RADIUS) slope / 0.75 relative.
    """
    curves = shift_curves(cone_search(slope), np.arange(-8, 8.1, 0.5) * MM)
    crown = 0.3
    assert equivalent_conicity(curves, 3 * MM) == pytest.approx(slope, rel=(crown + RADIUS) * slope / 0.75)
    assert equivalent_conicity(curves, 3 * MM) == pytest.approx(equivalent_conicity(curves, 6 * MM), rel=1e-3)


def test_p8_on_bs113a_is_odd_smooth_and_jumps_only_where_the_contact_does():
    """Thesis Figs. 3-7 to 3-9 in kind: flange contact at about 9 to 11 mm, between the jumps no step larger than neighbours allow."""
    curves = shift_curves(ContactSearch(Wheelset(wheel_profile("P8")), Track.plain_line()), np.arange(-120, 121) * 0.1 * MM)
    assert np.array_equal(curves.radius_difference, -curves.radius_difference[::-1])
    assert np.array_equal(curves.angle_difference, -curves.angle_difference[::-1])
    flange = np.abs(curves.shift[np.degrees(np.abs(curves.angle)).max(axis=0) > 60]).min()
    assert 8 * MM < flange < 11 * MM
    between = np.abs(np.diff(curves.station, axis=1)).max(axis=0) < 2 * MM
    assert np.abs(np.diff(curves.radius_difference))[between].max() < 0.5 * MM
    assert len(curves.jumps()) <= 8
    assert (np.diff(curves.radius_difference) > -1e-9).all()


def test_what_gives_no_wave_is_refused():
    shift = np.arange(-5, 5.1, 0.5) * MM
    with pytest.raises(WheelsetError, match="no zero"):
        wavelength(shift, 0.1 * shift + 1 * MM, 1 * MM, RADIUS)
    with pytest.raises(WheelsetError, match="amplitude"):
        wavelength(shift, 0.1 * shift, 8 * MM, RADIUS)
    with pytest.raises(WheelsetError, match="back"):
        wavelength(shift, -0.1 * shift, 2 * MM, RADIUS)
