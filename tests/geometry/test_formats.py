"""Profile files: every format read back as written, units, mirrors and order made explicit, malformed files refused by
line."""

import numpy as np
import pytest

from geometry.profiles.doctor import examine
from geometry.profiles.formats.by_suffix import read_raw, write_profile
from geometry.profiles.formats.slices import read_slices
from geometry.profiles.formats.units import metres_of
from geometry.profiles.profile import ProfileError
from geometry.profiles.rail import rail_head
from geometry.profiles.wheel import wheel_profile
from tests.outside import found, needs, outside

real_files = needs("formats/MBench_UIC60_v3.prr")
RAIL, WHEEL = rail_head("56E1").points, wheel_profile("S1002").points


def test_a_unit_that_is_none_is_refused():
    assert metres_of(None) is None and metres_of("mm") == 1e-3
    with pytest.raises(ProfileError, match="unit 'furlong': known are m, cm, mm, inch"):
        metres_of("furlong")
    for unit in ("mm", 0, -1e-3, np.nan):
        with pytest.raises(ProfileError, match="length in metres"):
            read_raw(__file__, unit=unit)


def written(path, text):
    path.write_text(text, encoding="utf-8")
    return path


@pytest.mark.parametrize(
    "name, kind, points", [("a.prr", "rail", RAIL), ("a.prw", "wheel", WHEEL), ("a.csv", "rail", RAIL)]
)
def test_a_written_profile_reads_back(tmp_path, name, kind, points):
    """Nine digits of mm: 1e-9 relative."""
    write_profile(tmp_path / name, points, kind)
    read = examine(read_raw(tmp_path / name, kind))
    assert read.unit_name == "mm" and read.kind == kind
    assert np.abs(read.profile.points - points).max() < 2e-9 * np.abs(points).max() / 1e-1


def test_a_rail_is_not_written_as_a_wheels_file(tmp_path):
    """A .prw of a rail says that it is a wheel, and was refused when it was read."""
    for name, kind, points in (("a.prw", "rail", RAIL), ("a.prr", "wheel", WHEEL), ("a.step", "rail", RAIL)):
        with pytest.raises(ProfileError, match=f"a {kind} cannot be written as {name[1:]}"):
            write_profile(tmp_path / name, points, kind)


def test_simpack_processing_is_applied_in_the_files_order(tmp_path):
    """shift, rotation by +90 degrees (y to z), mirror of y, inversion; unit factor 1e3: mm."""
    body = (
        "header.begin\n type = 0 ! rail\nheader.end\nspline.begin\n type = 1\n shift.y = 1.0\n rotate = 90\n mirror.y ="
        " 1\n inversion = 1\n"
    )
    body += (
        " units.len.f = 1e3\n units.ang.f = 57.29577951308232\n point.begin\n 0 0 1.0\n! 9 9\n 10 0\n 10 5\n"
        " point.end\nspline.end\n"
    )
    raw = read_raw(written(tmp_path / "a.prr", body))
    assert raw.kind == "rail" and raw.unit == pytest.approx(1e-3) and raw.up == -1
    assert np.allclose(raw.points, [[5, 11], [0, 11], [0, 1]])
    assert raw.lines.tolist() == [16, 15, 13]


def test_miniprof_leaves_out_switched_off_points_and_reads_several_profiles(tmp_path):
    rows = "\n".join(f"{1000 * y:.4f} {1000 * z:.4f} 0.0" for y, z in RAIL)
    raw = read_raw(written(tmp_path / "a.ban", f'XYPoints=99\nChars=Win\n\n{rows}\n" 99.0 99.0\n'))
    assert len(raw.points) == len(RAIL) and raw.kind == "rail"
    assert any("switched off" in n for n in raw.notes) and any("header says 99" in n for n in raw.notes)
    both = written(
        tmp_path / "a.mpt",
        f"[FileInfo]\nx=1\n\n[Profile1Points]\n{rows}\n\n[Profile2Info]\nq=2\n[Profile2Points]\n{rows}\n1 2\n",
    )
    assert [len(read_raw(both, number=k).points) - len(RAIL) for k in (1, 2)] == [0, 1]
    with pytest.raises(ProfileError, match="profile 3 asked for, the file holds 2"):
        read_raw(both, number=3)


def test_slices_hold_stations_in_metres_and_their_section_files(tmp_path):
    for k in (1, 2):
        (tmp_path / f"s_{k}.txt").write_text("\n".join(f"{y:.6e} {-z:.6e}" for y, z in RAIL * k))
    text = "% two\n 0.5 1000.0 U_OFFSET\n 2 NSLC\n 0 0 0\n 1\n -1.0 's_1.txt'\n 2.0 's_2.txt'\n"
    slices = read_slices(written(tmp_path / "a.slcs", text))
    assert slices.x.tolist() == [-0.5, 2.5]
    assert np.allclose(slices.sections[1].points, RAIL * [2, -2], atol=1e-7)
    second = read_raw(tmp_path / "a.slcs", number=2)
    assert (
        np.array_equal(second.points, slices.sections[1].points)
        and "section 2 of 2, at x = 2.5000 m" in second.notes[0]
    )
    with pytest.raises(ProfileError, match="section 3 asked for, the file holds 2"):
        read_raw(tmp_path / "a.slcs", number=3)
    with pytest.raises(ProfileError, match="NSLC = 3, but 2"):
        read_slices(written(tmp_path / "b.slcs", text.replace(" 2 NSLC", " 3 NSLC")))
    with pytest.raises(ProfileError, match="line 7: station -2.5 m does not lie beyond"):
        read_slices(written(tmp_path / "c.slcs", text.replace(" 2.0 's", " -3.0 's")))
    with pytest.raises(ProfileError, match="line 7: section file .* is not there"):
        read_slices(written(tmp_path / "d.slcs", text.replace("s_2", "s_9")))


@pytest.mark.parametrize(
    "text, complaint",
    [
        ("1 2\n3 x\n5 6\n", 'line 2: "x" is not a number'),
        ("1 2\n3 nan\n5 6\n", 'line 2: "nan" is not finite'),
        ("nan 2\n3 4\n5 6\n", 'line 1: "nan" is not finite'),
        ("1 2\n3\n5 6\n", "line 2: 1 number"),
        ("1,5,2,5\n2,5,3,5\n", "commas both inside and between"),
        ("1 2\n", "at least 3"),
        ("a\0b", "no text file"),
        ("# unit: furlong\n1 2\n3 4\n5 6\n", "line 1: unit 'furlong': known are m, cm, mm, inch"),
        ("Info\nUnit = Furlong\n1 2\n3 4\n5 6\n", "line 2: unit 'Furlong'"),
    ],
)
def test_malformed_text_is_refused_with_its_line(tmp_path, text, complaint):
    with pytest.raises(ProfileError, match=complaint):
        read_raw(written(tmp_path / "a.txt", text))


@pytest.mark.parametrize(
    "text",
    [
        "1.5;2\n2.5;3\n4.5;9\n",
        "\ufeff1,5;2\n2,5;3\n4,5;9\n",
        "1,5 2,0\n2,5\t3,0\n4,5 9,0\n",
        "y,z\n1.5,2\n2.5,3\n4.5,9\n",
        '"y","z"\n"1.5","2"\n"2.5","3"\n"4.5","9"\n',
        '"1,5";"2"\n"2,5";"3,0"\n"4,5";"9"\n',
        '"1,5","2"\n"2,5","3,0"\n"4,5","9"\n',
    ],
)
def test_separators_decimal_commas_and_byte_order_marks_give_the_same_points(tmp_path, text):
    assert read_raw(written(tmp_path / "a.txt", text)).points.tolist() == [[1.5, 2], [2.5, 3], [4.5, 9]]


def test_a_half_simpack_file_is_refused(tmp_path):
    with pytest.raises(ProfileError, match="no point.end"):
        read_raw(written(tmp_path / "a.prw", "point.begin\n1 2\n2 3\n3 4\n"))


@real_files
def test_the_manchester_files_agree_with_each_other_and_with_the_standard():
    """The same UIC60 as .prr and .ban; S1002 against our standard profile: 0.2 um, as its joints are printed to 1
    um."""
    prr, ban = (examine(read_raw(outside(f"formats/MBench_UIC60_v3.{s}"))).profile.graph_part() for s in ("prr", "ban"))
    y = np.linspace(-0.030, 0.030, 401)
    assert np.abs(prr.height(y) - ban.height(-y)).max() < 5e-8 or np.abs(prr.height(y) - ban.height(y)).max() < 5e-8
    wheel = examine(read_raw(outside("formats/MBench_S1002_v3.prw"))).profile
    inner = (wheel.points[:, 0] > -0.055) & (wheel.points[:, 0] < 0.0599)
    y, z = wheel.points[inner].T
    assert np.abs(wheel_profile("S1002").height(y) - z).max() < 2e-7


@pytest.mark.parametrize(
    "name, kind, flange_back, shift",
    [
        ("Car7216_0001r.whl", "wheel", None, -70.0),
        ("MBench_S1002_v3.prw", "wheel", None, None),
        ("MBench_UIC60_v3.ban", "rail", None, None),
        ("MBench_UIC60_v3.prr", "rail", None, None),
        ("SNX00500.mpt", "rail", None, None),
        ("avg_HR.BAN", "rail", None, None),
        ("avg_wheel.whl", "wheel", None, -70.0),
        ("worn_high_mileage.prw", "wheel", 0.0, -70.0),
    ],
)
def test_every_sample_file_is_read(name, kind, flange_back, shift):
    """Wheels measured from their flange back stand on it; our own files with the same faults: test_faulty_profiles."""
    diagnosis = examine(read_raw(found(f"formats/{name}")), flange_back=flange_back)
    assert diagnosis.kind == kind
    y, z = diagnosis.profile.points.T
    if kind == "rail":
        assert z.max() == pytest.approx(0.0, abs=1e-6)
    else:
        assert 0.027 < -z.min() < 0.036 and y[np.argmin(z)] < -0.045
        assert shift is None or any(f"shifted by {shift:.3f}" in finding.text for finding in diagnosis.findings)


@needs("formats/uk_crossing.slcs")
def test_the_benchmarks_slices_are_read():
    slices = read_slices(outside("formats/uk_crossing.slcs"))
    assert len(slices.x) == 148 and slices.x[10] == pytest.approx(-0.72913)


def test_the_same_head_in_every_format_is_the_same(tmp_path):
    """What the Manchester files show, with files of our own: .prr, .ban, .mpt and two columns, printed to 1 nm and 0.1
    um."""
    y = np.linspace(-0.030, 0.030, 401)
    rows = "\n".join(f"{1e3 * v:.4f} {1e3 * w:.4f}" for v, w in RAIL)
    write_profile(tmp_path / "a.prr", RAIL, "rail")
    write_profile(tmp_path / "a.txt", RAIL)
    for name, text in (
        ("a.ban", f"XYPoints={len(RAIL)}\n{rows}\n"),
        ("a.mpt", f"[FileInfo]\n\n[Profile1Points]\n{rows}\n"),
    ):
        written(tmp_path / name, text)
    for name, off in (("a.prr", 1e-9), ("a.txt", 1e-9), ("a.ban", 1e-7), ("a.mpt", 1e-7)):
        profile = examine(read_raw(tmp_path / name, "rail"), mirror=False).profile
        # its spline has no exact tangents
        assert np.abs(profile.height(y) - rail_head("56E1").height(y)).max() < off + 2e-8


@pytest.mark.parametrize(
    "head, unit",
    [
        ("# Length units: [cm]", 1e-2),
        ("angle unit: deg\nunit = inch", 0.0254),
        ("% unit: Millimeters", 1e-3),
        ("angle unit: deg", None),
    ],
)
def test_a_unit_in_words_is_known_and_one_told_overrules_it(tmp_path, head, unit):
    rows = "\n1 2\n3 4\n5 6\n"
    assert read_raw(written(tmp_path / "a.txt", head + rows)).unit == unit
    assert read_raw(written(tmp_path / "b.txt", "# unit: furlong" + rows), unit=0.3048).unit == 0.3048


def test_lines_of_words_before_the_first_numbers_are_headings_and_told(tmp_path):
    """As an export of a measuring device has them; words between rows of numbers are a fault."""
    rows = [f"{y};{-(y**2) / 600}" for y in range(-30, 31)]
    path = tmp_path / "rail.csv"
    path.write_text("\n".join(["Track;12", "Info;left rail", "X [mm];Y [mm]", *rows]))
    raw = read_raw(path, kind="rail")
    assert len(raw.points) == 61 and sum(note.startswith("heading") for note in raw.notes) == 3
    path.write_text("\n".join([*rows[:20], "Info;left rail", *rows[20:]]))
    with pytest.raises(ProfileError, match='line 21: "Info" is not a number'):
        read_raw(path, kind="rail")
