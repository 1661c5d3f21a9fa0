"""The study of a wheelset's contact: curves, a figure, errors that fall with the sections and not with the stations."""

import numpy as np

from geometry.contact.conicity import shift_curves
from geometry.contact.prismatic_search import ContactSearch
from geometry.profiles.wheel import wheel_profile
from geometry.surfaces.crossing import CastCrossing
from geometry.wheelset import Track, Wheelset
from rail_fem.contact.load_sharing import static_equilibrium
from rail_fem.studies.wheelset import MM, curve_table, panels, speed_against_error


def test_tables_and_figure_of_a_short_study():
    search = ContactSearch(Wheelset(wheel_profile("P8")), Track.plain_line())
    shift = np.linspace(-12, 12, 9) * MM
    curves, loaded = shift_curves(search, shift), [static_equilibrium(search, (49e3, 49e3), y) for y in shift]
    table = np.array(curve_table(curves, loaded).rows)
    assert np.allclose(table[:, 0], shift / MM) and np.allclose(table[:, 1], curves.radius_difference / MM)
    drawn = panels(curves, loaded, [0.1] * 8)
    stations, points, _ = drawn[3].lines["left rail"]
    assert len(drawn) == 6 and len(stations) == len(points) == sum(len(one.left.normal_force) for one in loaded)


def test_carrying_points_do_not_depend_on_the_resolution():
    """0.01 mm is asked for; the refined search leaves 1e-6 mm."""
    states = ((-6e-3, 0.01, 3e4, 1e5), (2e-3, -0.01, 9e4, 5e4), (9e-3, 0.0, 5e4, 5e4))
    found = []
    for resolution in (2 * MM, 0.02 * MM):
        search = ContactSearch(Wheelset(wheel_profile("P8")), Track.plain_line(), resolution)
        sides = [static_equilibrium(search, (left, right), y, yaw).left for y, yaw, left, right in states]
        most = [int(np.argmax(side.normal_force)) for side in sides]
        found.append([(*s.contacts.position[k], s.normal_force[k] * 1e-5) for s, k in zip(sides, most)])
    off = np.abs(np.subtract(*found)).max(axis=0)
    assert off[:3].max() < 1e-6 * MM and off[3] < 1e-6


def test_errors_fall_with_the_sections_and_not_with_the_stations():
    """Against sections 2 mm apart. Most states stand on smooth parts, which sections 4 mm apart hold to 1e-6 mm; the
    largest errors are those on edges. At stations 1 mm apart one state of these has only one of two neighbouring
    points."""
    settings = ((16, 0.5), (4, 0.5), (4, 0.25))
    rows = speed_against_error(CastCrossing(9.25), "P8", 20, settings, (2 * MM, 0.25 * MM))
    coarse, fine, few = rows
    assert fine[3] < 1e-6 and fine[5] < 0.5 * coarse[5]
    assert fine[6] < 1e-8 and fine[7] < coarse[7] < 0.01
    assert np.allclose(few[3:], fine[3:], atol=1e-4)
