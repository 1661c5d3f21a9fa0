"""Figures say which case they show, one colour has one meaning, and no path is drawn where no body is."""

import re
from pathlib import Path

import numpy as np
import pytest
from matplotlib.text import Text

from rail_fem.hierarchy import solve
from rail_fem.result.events import peak_at
from rail_fem.result.result import PassResult
from rail_fem.show.energies import LINES, SHARES
from rail_fem.show.force import force_figure
from rail_fem.show.histories import patches_figure
from rail_fem.show.plan import contact_path
from rail_fem.show.report import flight_rows, headlines
from rail_fem.show.style import new_figure, save

WINDOW = {"start": "300 mm", "end": "400 mm"}


def test_the_path_of_contact_breaks_where_both_bodies_carry(scene):
    """Between wing (y = 0) and nose (y = 40 mm) lies the flangeway: the mean of both positions is no contact."""
    nose = np.array([0.0, 0.0, 50e3, 99.9e3, 100e3])
    columns = {
        "time": np.arange(5.0),
        "x": np.arange(5.0),
        "force": np.array([100e3, 0.0, 100e3, 100e3, 100e3]),
        "force_nose": nose,
        "force_wing": np.array([100e3, 0.0, 50e3, 0.1e3, 0.0]),
        "contact_x": np.arange(5.0),
        "contact_y": 0.04 * nose / 100e3,
    }
    y = contact_path(PassResult("rigid_hertz", scene, {}, columns))[1]
    assert np.isnan(y[1:3]).all() and np.allclose(y[[0, 3, 4]], [0.0, 39.96, 40.0])
    at = [peak_at(columns, "force_wing", row).y for row in range(5)]
    assert np.isnan(at[2]) and np.allclose(np.delete(at, 2), [0.0, 0.0, 0.03996, 0.04])


def test_the_transfer_is_told_from_the_body_that_the_wheel_leaves(scene):
    words = [
        {
            one.name
            for one in headlines(
                PassResult("rigid_hertz", scene.replace(direction=way), {}, {"time": [0.0], "x": [0.0]})
            )
        }
        for way in ("facing", "trailing")
    ]
    assert "transfer from wing to nose" in words[0] and "transfer from nose to wing" in words[1]


def test_no_colour_of_the_energies_means_two_things():
    colours = [colour for colour, _ in LINES.values()]
    assert len(set(colours)) == len(colours)
    shared = {name: SHARES[name][1] for name in SHARES if name in LINES}
    assert shared == {name: LINES[name][0] for name in shared}


def test_a_figure_names_its_case(scene):
    result = PassResult(**{**vars(solve("lumped", scene, WINDOW)), "title": "my crossing at dawn"})
    assert "my crossing at dawn" in force_figure(result, "run_1")._suptitle.get_text()


@pytest.mark.parametrize("words", ["a$\\frac{x^$", "50 $ a $t", "$_$"])
def test_a_title_with_dollars_is_drawn_as_it_is_written(tmp_path, words):
    """It was read as a formula: no figure of the run, or none of a whole search. Powers of ten at ticks still are."""
    figure = new_figure(2.0)
    axes = figure.subplots()
    axes.loglog([1e-9, 1e9], [1.0, 1e12], label=words)
    figure.suptitle(words)
    axes.legend()
    save(figure, tmp_path / "a.png")
    formulas = {text.get_text(): text.get_parse_math() for text in figure.findobj(Text) if "$" in text.get_text()}
    assert not formulas[words] and any(on for text, on in formulas.items() if "mathdefault{10" in text)


def test_the_patches_of_a_result_are_drawn_by_body_in_engineers_units(scene):
    result = solve("rigid_hertz", scene, {"start": "300 mm", "end": "420 mm"})
    above = patches_figure(result, "run_1").axes[0]
    drawn = {line.get_label(): line.get_ydata() for line in above.lines}
    for body in ("wing", "nose"):
        expected = [patch.max_pressure / 1e6 for patch in result.patches if patch.region == body]
        assert expected and np.allclose(drawn[f"{body}, patches"], expected)
    assert above.get_ylabel() == "elastic pressure\n(Hertz) [MPa]"


SMALLEST = 9  # points, on figures that are 12 inches wide


def test_no_letters_of_figures_are_too_small_to_read():
    root = Path(__file__).parents[2]
    sources = [path for package in ("rail_fem", "geometry", "bem") for path in (root / package).rglob("*.py")]
    sizes = [float(size) for path in sources for size in re.findall(r"fontsize=([\d.]+)", path.read_text("utf-8"))]
    assert len(sizes) > 10 and min(sizes) >= SMALLEST


def test_a_joint_has_one_rail_and_a_switch_no_nose(scene):
    """Both were told as crossings: "on the nose: never touched", "x = 0: gauge lines intersect"."""
    said = {}
    for family, start in (("joint", -0.1), ("switch", 2.7)):
        result = solve(
            "rigid_hertz",
            scene.replace_si(crossing={"family": family}),
            {"start": f"{start} m", "end": f"{start + 0.2} m"},
        )
        texts = [text.get_text() for text in force_figure(result).findobj(Text)]
        said[family] = " ".join([*texts, *(row.name for row in headlines(result))])
    assert "on the rail: largest" in said["joint"] and "x = 0: the joint)" in said["joint"]
    assert all(word not in said["joint"] for word in ("on the nose", "wing rail", "transfer", "gauge lines"))
    assert "transfer from stock rail to switch rail" in said["switch"] and "x = 0: the switch's toe" in said["switch"]
    assert "on the switch rail: largest" in said["switch"] and "wing rail" not in said["switch"]
    told = solve("p2_formula", scene.replace_si(direction="trailing", crossing={"family": "joint"})).warnings
    assert not any("trailing" in text for text in told)


def test_a_model_that_knows_one_body_resolves_no_transfer(scene):
    at = {row.name: row.value for row in headlines(solve("lumped", scene, WINDOW))}
    assert at["transfer from wing to nose"] == "not resolved"


def test_a_wheel_that_the_rail_falls_away_from_is_launched_downwards(scene):
    """At 300 mph over the falling wing: "launched at -0.03 m/s upwards"."""
    fast = scene.replace(speed="300 mph", foundation={"stiffness": "80 kN/mm"}, wheel={"profile": "P8"})
    (told,) = flight_rows(solve("rigid_hertz", fast, {"start": "95 mm", "end": "400 mm"}))
    assert told[2].endswith("launched at 0.03 m/s downwards")
