"""[scene.crossing]: parameters of the cast crossing, and crossings by files of their own sections."""

import dataclasses
import re
import shutil

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter1d

from geometry.profiles.profile import lengths
from geometry.surfaces.crossing import CastCrossing
from rail_fem.case.casefile import CaseError, load_case
from rail_fem.case.preflight import preflight_errors
from rail_fem.case.warnings import case_warnings
from rail_fem.contact.rigid import rigid_path
from rail_fem.models import rigid_hertz
from rail_fem.result.result import load
from rail_fem.scene.base import KEPT_SECTIONS as KEPT
from rail_fem.scene.crossing import NAMED_CASTINGS
from rail_fem.scene.scene import Crossing, Scene
from tests.geometry.cut_sections import write_cut_sections
from tests.outside import needs, outside
from tests.rail_fem.test_casefile import GOOD

MM = 1e-3
STATIONS = np.concatenate([[-1.0, -0.9], np.arange(-0.8, -0.05, 0.05), np.arange(0.0, 0.85, 0.01)])
RUN = '[run.rigid_hertz]\nstart = "95 mm"\nend = "600 mm"\n'


def case_with(folder, *lines, name="case.toml"):
    """The reference case with these lines for its crossing, run by rigid_hertz."""
    scene = GOOD.partition("[run.")[0].replace('family = "UK-cast"\nratio = 10.75', "\n".join(lines))
    path = folder / name
    path.write_text(scene + RUN, encoding="utf-8")
    return path


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    folder = tmp_path_factory.mktemp("sections")
    write_cut_sections(folder, STATIONS)
    return folder


SECTIONS = 'family = "sections"', 'file = "crossing.slcs"', "extend = true"


def test_a_pass_over_sections_is_the_pass_over_the_surface_they_were_cut_from(files, tmp_path):
    """Light model, 1:9.25: the force history to 2 %, where sections lie 10 mm apart."""
    by_sections, by_rules = load_case(case_with(files, *SECTIONS)), load_case(case_with(tmp_path, "ratio = 9.25"))
    runs = [rigid_hertz.solve(case.scene, case.runs["rigid_hertz"]) for case in (by_sections, by_rules)]
    one, two = (run.history["force"] for run in runs)
    assert np.linalg.norm(one - two) < 0.02 * np.linalg.norm(two)
    one, two = (run.peaks["impact_on_wheel"].value for run in runs)
    assert one == pytest.approx(two, rel=0.02)
    runs[0].save(tmp_path / "run")
    assert load(tmp_path / "run").scene.plain() == by_sections.scene.plain()


def test_scatter_of_sections_is_taken_out_and_told(files, tmp_path):
    """10 um of it, of which six samples move the impact by 6 % rms and the wing's largest force by 7; unsmoothed it was
    8 and 14, with 20 um 22 (for 7) and 20 (for 12), and a wheel climbed a spike between two sections of the nose's
    tip."""
    true = load_case(case_with(files, *SECTIONS))
    read, rng = true.scene.crossing.read, np.random.default_rng(1)
    moved = [points + [0.0, 10e-6] * rng.standard_normal(points.shape) for points in read.sections]
    dataclasses.replace(read, sections=tuple(moved)).keep(tmp_path)
    rough = load_case(case_with(tmp_path, SECTIONS[0], f'file = "{KEPT}"', SECTIONS[2]))
    one, two = (rigid_hertz.solve(case.scene, case.runs["rigid_hertz"]).peaks for case in (true, rough))
    for name, most in (("first_impact_on_nose", 0.03), ("largest_force", 0.04), ("largest_force_wing", 0.12)):
        assert two[name].value == pytest.approx(one[name].value, rel=most), name
    assert rough.scene.crossing.read.crossing(False).sections.scatter() == pytest.approx(10e-6, rel=0.15)
    told = rough.scene.crossing.read.warnings
    assert not read.warnings and any("> 5 um" in one for one in told)


def test_scatter_that_neighbouring_points_of_sections_share_is_told(files):
    """20 um over 0.2 mm, of which third differences show 4: the wing's largest force was up to 22 % off."""
    read, rng = load_case(case_with(files, *SECTIONS)).scene.crossing.read, np.random.default_rng(1)
    shared = lambda points: gaussian_filter1d(rng.standard_normal(points.shape), 1, axis=0) * [0.0, 38e-6]
    alike = dataclasses.replace(read, sections=tuple(points + shared(points) for points in read.sections))
    assert any("> 5 um" in one for one in alike.warnings)


def test_points_too_far_apart_across_a_section_are_told(files):
    """Every 3 mm moved the wing's largest force by 22 % without a word."""
    read = load_case(case_with(files, *SECTIONS)).scene.crossing.read

    def told(every):
        thin = lambda points: points[np.unique(np.floor(lengths(points) / every), return_index=True)[1]]
        return " ".join(dataclasses.replace(read, sections=tuple(map(thin, read.sections))).warnings)

    assert "points too far apart across: arcs stand" in told(3 * MM) and "across" not in told(1 * MM)


@pytest.mark.parametrize("extend", ["false", "true"])
def test_a_path_that_meets_no_section_is_refused_or_where_ends_are_carried_on_told(files, extend):
    """A crossing brought 5 m along, and the path where it was."""
    case = load_case(case_with(files, *SECTIONS[:2], 'along = "5 m"', f"extend = {extend}"))
    settings = case.runs["rigid_hertz"]
    errors, told = preflight_errors(case.scene, settings, 1, "rigid_hertz"), case_warnings(case.scene, settings)
    assert [error.partition(":")[0] for error in errors] == ["run.rigid_hertz.start, end"] * (extend == "false")
    assert any("meets none of the sections" in warning for warning in told)
    here = load_case(case_with(files, *SECTIONS))
    assert not any("none of the sections" in one for one in case_warnings(here.scene, here.runs["rigid_hertz"]))


def test_sections_too_far_apart_are_told_with_about_what_a_wheel_misses_between_them(files, tmp_path):
    """By the file alone, a third of what it misses without every second of them: second order leaves a quarter, an edge
    half, and a section may lie anywhere between where they miss most. 70 mm apart the impact was up to 13 % off."""
    write_cut_sections(tmp_path, np.r_[-1.0, np.arange(-0.9, 0.96, 0.07)])
    sparse, dense = load_case(case_with(tmp_path, *SECTIONS)), load_case(case_with(files, *SECTIONS, name="dense.toml"))
    say = lambda case: [one for one in case_warnings(case.scene, case.runs["rigid_hertz"]) if "too far apart" in one]
    (told,) = say(sparse)
    assert not say(dense)
    x = np.arange(95, 600, 4) * MM
    true = abs(rigid_path(sparse.scene, x).height - rigid_path(dense.scene, x).height).max() / MM
    assert 0.5 < float(re.search(r"some ([\d.]+) mm off", told)[1]) / true < 2
    low, at, high = (float(one) for one in re.search(r"x = (\S+) to (\S+) mm .* at (\S+) mm", told).group(1, 3, 2))
    assert high - low == pytest.approx(140, abs=1) and low < at < high


def test_sections_are_known_by_their_content_and_kept_to_the_last_bit(files, tmp_path):
    shutil.copytree(files / "cut", tmp_path / "cut")
    shutil.copy(files / "crossing.slcs", tmp_path)
    scene = load_case(case_with(tmp_path, *SECTIONS)).scene
    assert scene.plain() == load_case(case_with(files, *SECTIONS)).scene.plain()
    assert scene.replace_si(speed=20.0).crossing.surface is scene.crossing.surface
    scene.keep_files(tmp_path)
    again = Scene.model_validate(scene.model_dump(mode="json"), context={"run_folder": tmp_path})
    assert again.plain() == scene.plain() and again.crossing.surface is scene.crossing.surface
    text = (tmp_path / KEPT).read_text().replace(",-0.055", ",-0.0550001", 1)
    (tmp_path / KEPT).write_text(text)
    with pytest.raises(ValueError, match="has other content"):
        Scene.model_validate(scene.model_dump(mode="json"), context={"run_folder": tmp_path})


def test_a_folder_with_its_stations_and_a_table_are_the_same_crossing(files, tmp_path):
    crossing = Crossing(family="sections", file=str(files / "crossing.slcs"))
    crossing.read.keep(tmp_path)
    assert Crossing(family="sections", file=str(tmp_path / KEPT)).digest == crossing.digest
    rows = ["# unit: m", "file, x"]
    for k, (x, points) in enumerate(zip(crossing.read.x, crossing.read.sections)):
        np.savetxt(tmp_path / f"s{k}.txt", points / MM, fmt="%.12f")
        rows.append(f"s{k}.txt, {float(x)!r}")
    (tmp_path / "stations.csv").write_text("\n".join(rows))
    folder = Crossing(family="sections", file=str(tmp_path))
    assert np.abs(folder.read.sections[40] - crossing.read.sections[40]).max() < 1e-12
    with pytest.raises(ValueError, match="no list of stations"):
        Crossing(family="sections", file=str(tmp_path), stations="there.csv")


def test_decimal_commas_in_sections_are_read_as_points_or_refused(files, tmp_path):
    """A station of -1,5 m is not -1 m."""
    crossing = Crossing(family="sections", file=str(files / "crossing.slcs"))
    rows = [(f"s{k}.txt", x, points) for k, (x, points) in enumerate(zip(crossing.read.x, crossing.read.sections))]
    for name, _, points in rows:
        np.savetxt(tmp_path / name, points / MM, fmt="%.12f")
    table = "\n".join(f"{float(x)!r};{y!r};{z!r}" for _, x, points in rows for y, z in points.tolist())
    (tmp_path / "own.csv").write_text("# unit: m\n" + table.replace(".", ","))
    stations = "# unit: m\n" + "\n".join(
        f"{name}; {float(x)!r}".replace(".", ",").replace(",txt", ".txt") for name, x, _ in rows
    )
    (tmp_path / "stations.csv").write_text(stations)
    for file in tmp_path / "own.csv", tmp_path:
        read = Crossing(family="sections", file=str(file)).read
        assert np.abs(read.x - crossing.read.x).max() < 1e-12
        assert max(np.abs(one - two).max() for one, two in zip(read.sections, crossing.read.sections)) < 1e-12
    (tmp_path / "stations.csv").write_text(stations.replace("; ", ","))
    with pytest.raises(ValueError, match=r'line 2: "s0.txt,-\d+,\d+" is not a file of .* and its x'):
        Crossing(family="sections", file=str(tmp_path))


def test_a_table_is_read_by_the_names_of_its_columns(files, tmp_path):
    """Columns of other names, in another order; without names the first three; a unit in the name is the column's."""
    crossing = Crossing(family="sections", file=str(files / "crossing.slcs"))
    rows = [
        f"{k},{x / MM:.17g},{y / MM:.17g},{z / MM:.17g}"
        for k, (x, points) in enumerate(zip(crossing.read.x, crossing.read.sections))
        for y, z in points
    ]
    for head in ("# unit: mm\nsection,x,y,z", "# unit: m\nSection; X [mm]; Y [mm]; Z [mm]", "section,x_mm,y_mm,z_mm"):
        (tmp_path / "own.csv").write_text("\n".join([head, *rows]))
        read = Crossing(family="sections", file=str(tmp_path / "own.csv")).read
        assert np.abs(read.x - crossing.read.x).max() < 1e-12
        assert max(np.abs(one - two).max() for one, two in zip(read.sections, crossing.read.sections)) < 1e-12
    for head, said in (
        ("# unit: mm", "line 2: 4 columns without names"),
        ("# unit: mm\nn,chainage,y,z", 'line 2: columns "n", "chainage", "y", "z": no column is named x'),
    ):
        (tmp_path / "own.csv").write_text("\n".join([head, *rows]))
        with pytest.raises(ValueError, match=said):
            Crossing(family="sections", file=str(tmp_path / "own.csv"))


def test_a_point_mistyped_in_a_table_of_sections_is_told(files, tmp_path):
    """A height out of its section's line (2 mm on the wing make three times the impact); a row that begins with no
    number, which was left out as a heading."""
    crossing = Crossing(family="sections", file=str(files / "crossing.slcs")).read
    assert crossing.warnings == []
    k = int(np.argmin(np.abs(crossing.x - 0.25)))
    sections = [points.copy() for points in crossing.sections]
    at = int(np.argmin(np.abs(sections[k][:, 0] - 40 * MM)))
    sections[k][at, 1] += 2 * MM
    rows = [f"{x:.17g},{y:.17g},{z:.17g}" for x, points in zip(crossing.x, sections) for y, z in points]
    (tmp_path / "own.csv").write_text("\n".join(["# unit: m", "x,y,z", *rows]))
    path = case_with(tmp_path, 'family = "sections"', 'file = "own.csv"', "extend = true")
    case = load_case(path)
    told = [line for line in case_warnings(case.scene, case.runs["rigid_hertz"]) if "stand out" in line]
    assert len(told) == 1 and "1 point(s)" in told[0] and "the wing's at x = 250.0 mm, y = 40" in told[0]
    assert "by +2 mm" in told[0]
    for word in ("nan", "O.25"):
        (tmp_path / "own.csv").write_text("\n".join(["# unit: m", "x,y,z", *rows[:9], f"{word},0,0", *rows[9:]]))
        with pytest.raises(CaseError, match=f'line 12: "{word}" is not '):
            load_case(path)


def test_sections_upside_down_are_asked_whether_z_points_up(files, tmp_path):
    """Seen at the first glance, not told a height that would lead to the next refusal."""
    crossing = Crossing(family="sections", file=str(files / "crossing.slcs")).read
    rows = [f"{x:.17g},{y:.17g},{-z:.17g}" for x, points in zip(crossing.x, crossing.sections) for y, z in points]
    (tmp_path / "down.csv").write_text("\n".join(["# unit: m", "x,y,z", *rows]))
    with pytest.raises(ValueError, match="section at x = -1 m: its middle lies lower than its ends.* does z point up"):
        Crossing(family="sections", file=str(tmp_path / "down.csv"))


def test_all_parameters_of_the_cast_crossing_reach_it(tmp_path):
    lines = (
        "ratio = 10.75",
        'flangeway = "44 mm"',
        'transition_length = "300 mm"',
        "transition_smoothness = 2",
        'leg_lowering = "0.5 mm"',
        'wing_raise = "1 mm"',
        'wing_flare = "10 mrad"',
        'flare_start = "600 mm"',
        'nose_lowering = "0.5 mm"',
        'nose_widening = "1 mm"',
        'gauge_widening = "1 mm"',
        'topping_depth = "5 mm"',
    )
    scene = load_case(case_with(tmp_path, *lines)).scene
    base, cast, x = CastCrossing(10.75), scene.crossing.surface, np.array([0.3])
    assert scene.crossing.plain()["transition_length"] == 0.3 and "topping_slope" not in scene.crossing.plain()
    rise = lambda x, y, body: float(cast.top_height(x, y, body) - base.top_height(x, y, body))
    assert rise(0.01, 0.02, "wing") == pytest.approx(1 * MM, abs=1e-9)
    assert rise(cast.leg_range[1], 0.01, "wing") == pytest.approx(-0.5 * MM, abs=1e-9)
    assert rise(0.25, -0.022, "nose") == pytest.approx(-1.276 * MM, abs=1e-6)  # lowered by 0.5, topped 0.776 deeper
    assert cast.leg_range[1] - cast.leg_range[0] == pytest.approx(0.3)
    for body, last in (("wing", cast.wing_features["plane"]), ("nose", -1)):  # the mesh's outlines lie on the surface
        line = getattr(cast, f"{body}_section")(x[0])[1:last]
        assert np.abs(cast.top_height(x[0], line[:, 0], body) - line[:, 1]).max() < 1e-12


def test_a_leg_that_had_a_name_says_what_to_write_instead(tmp_path):
    """Results written while legs had names say "benchmark" and are still read."""
    for leg, length in (("fitted", "322.184"), ("fitted-explicit", "271")):
        with pytest.raises(CaseError, match=f'scene.crossing.leg: .*transition_length = "{length} mm", .*leg_lowering'):
            load_case(case_with(tmp_path, f'leg = "{leg}"'))
    with pytest.raises(CaseError, match="scene.crossing.leg: unknown key"):
        load_case(case_with(tmp_path, 'leg = "steep"'))
    assert Crossing.checked({"ratio": 10.75, "leg": "benchmark"}) == Crossing(ratio=10.75)


def test_a_named_casting_is_its_keys_and_gives_way_to_one_that_is_given(tmp_path):
    keys = NAMED_CASTINGS["thesis-fit"]
    plain = lambda *lines: load_case(case_with(tmp_path, *lines)).scene.crossing.plain()
    written = [f'{key} = "{value}"' for key, value in keys.items()]
    assert plain('casting = "thesis-fit"') == plain(*written) != plain()
    assert plain('casting = "thesis-fit"', 'wing_raise = "1 mm"') == plain(*written[1:], 'wing_raise = "1 mm"')
    named = load_case(case_with(tmp_path, 'casting = "thesis-fit"')).scene.crossing
    assert Crossing.model_validate(named.model_dump(mode="json")) == named


def test_unchanged_parameters_leave_a_case_what_it_was(tmp_path):
    assert load_case(case_with(tmp_path, "ratio = 10.75")).scene.plain()["crossing"] == {
        "family": "UK-cast",
        "ratio": 10.75,
    }


def test_a_ratio_may_be_written_with_its_one():
    """It was refused as a number of the unit ":9.25"."""
    assert Crossing(ratio="1:9.25").ratio == Crossing(ratio=" 1 : 9.25").ratio == Crossing(ratio=9.25).ratio == 9.25


@pytest.mark.parametrize(
    "lines, complaint",
    [
        (['family = "sections"'], "scene.crossing.file: family sections needs the file"),
        (['family = "sections"', 'file = "no.slcs"'], 'scene.crossing.file: no file "no.slcs"'),
        (['family = "sections"', 'file = "bad.toml"'], 'scene.crossing.file: .*".toml" is none of them'),
        ([*SECTIONS, 'flangeway = "50 mm"'], "scene.crossing.flangeway: does not belong to family sections"),
        (['file = "crossing.slcs"'], "scene.crossing.file: does not belong to family UK-cast"),
        ([*SECTIONS, "mirror = true"], "scene.crossing.file: .* mirror = true"),
        (['wing_flare = "50 mrad"', 'flare_start = "0 mm"', 'flangeway = "70 mm"'], "the wing is .* mm wide"),
        (['flangeway = "90 mm"'], "scene.crossing.flangeway: .* is outside"),
        (['flangway = "40 mm"'], "did you mean 'flangeway'"),
    ],
)
def test_crossings_that_cannot_be_are_refused_by_key(files, lines, complaint):
    with pytest.raises(CaseError, match=complaint):
        load_case(case_with(files, *lines, name="bad.toml"))


@needs("formats/uk_crossing.slcs")
def test_the_benchmarks_sections_run_as_the_parametric_crossing(tmp_path):
    """148 public sections; the force history is 4.2 % off (L2): what 24 mm between sections leave."""
    file = outside("formats/uk_crossing.slcs")
    cases = [
        load_case(case_with(tmp_path, 'family = "sections"', f"file = '{file}'")),
        load_case(case_with(tmp_path, "ratio = 9.25")),
    ]
    one, two = (rigid_hertz.solve(case.scene, case.runs["rigid_hertz"]).history["force"] for case in cases)
    assert np.linalg.norm(one - two) < 0.045 * np.linalg.norm(two)
