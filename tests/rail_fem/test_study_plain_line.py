"""The study of plain line: tables that hold what they say, a figure, errors that do not grow with the resolution."""

import numpy as np

from geometry.contact.conicity import shift_curves
from geometry.contact.prismatic_search import ContactSearch
from geometry.profiles.wheel import wheel_profile
from geometry.wheelset import Track, Wheelset
from rail_fem.light.load_sharing import static_equilibrium
from rail_fem.studies.plain_line import draw, speed_against_error, write_curves

MM = 1e-3


def test_tables_and_figure_of_a_short_study(tmp_path):
    search = ContactSearch(Wheelset(wheel_profile("P8")), Track.plain_line())
    shift = np.linspace(-12, 12, 9) * MM
    curves, loaded = shift_curves(search, shift), [static_equilibrium(search, (49e3, 49e3), y) for y in shift]
    write_curves(tmp_path / "curves.csv", curves, loaded)
    table = np.genfromtxt(tmp_path / "curves.csv", delimiter=",", names=True)
    assert np.allclose(table["shift"], shift / MM) and np.allclose(
        table["radius_difference"], curves.radius_difference / MM, atol=1e-6
    )
    assert draw(tmp_path / "curves.png", curves, loaded, [0.1] * 8, "short").stat().st_size > 20_000


def test_carrying_points_do_not_depend_on_the_resolution():
    """0.01 mm is asked for (issue 3); the refined search leaves 1e-6 mm."""
    search = ContactSearch(Wheelset(wheel_profile("P8")), Track.plain_line())
    rows = speed_against_error(search, count=4)
    assert rows[:, 2].max() < 1e-6
    assert rows[:, 3].max() < 1e-6
