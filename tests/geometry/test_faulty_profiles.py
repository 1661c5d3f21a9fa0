"""Files of every format with the faults that real ones have: read right, repaired with a word, or refused with the
remedy. No outside file."""

import numpy as np
import pytest

from geometry.profiles.doctor import examine
from geometry.profiles.formats.by_suffix import read_raw
from geometry.profiles.formats.raw import RawProfile
from geometry.profiles.formats.slices import read_slices
from geometry.profiles.profile import Profile, ProfileError
from geometry.profiles.rail import rail_head
from geometry.profiles.wheel import WHEEL_NAMES, wheel_profile, worn
from geometry.surfaces.sections import SectionCrossing
from geometry.wheelset import Track, Wheelset, WheelsetError
from tests.geometry.faulty_profiles import (
    MINIPROF_KEYS,
    MINIPROF_OLD,
    leaning_rail,
    measured_rail,
    measured_wheel,
    rows,
    simpack,
    written,
)
from tests.geometry.test_profile_doctor import raw, says

MM, UM = 1e-3, 1e-6


def off_tread(found, name: str = "S1002") -> float:
    """Largest distance [m] in height from the standard wheel between root and rim."""
    y = np.linspace(-34 * MM, 55 * MM, 400)
    return np.abs(found.profile.graph_part().height(y) - wheel_profile(name).height(y)).max()


def test_a_wheel_whose_rim_face_reaches_farther_than_its_flange_stands_on_its_flange(tmp_path):
    """Rim face 32 mm, flange 28 mm beyond the tread, vertical axis down: what stands farthest from the tread is not the
    flange.

    The line begins 1.55 mm behind the flange back, which MiniProf puts at y = 0. Printed to 0.1 um, every second point
    kept, the spline between them 4 um at the root."""
    found = examine(read_raw(written(tmp_path / "a.whl", MINIPROF_OLD + rows(measured_wheel()))))
    assert off_tread(found) < 5 * UM
    assert says(found, "repaired", "from the file's y = 0, the flange back as it says: shifted by -70.000")
    assert not says(found, "repaired", "mirrored")


DISGUISES = [
    (up, mirror, order, unit)
    for up in (1, -1)
    for mirror in (1, -1)
    for order in (1, -1)
    for unit in (1e-3, 1.0, 0.0254)
]
SHAPES = {
    "S1002 with a high rim face": ("wheel", measured_wheel(begin=0.0)[::3] * MM),
    "hollow by 4 mm": ("wheel", worn(wheel_profile("P8"), 4 * MM, 33 * MM, "hollow").points[::4]),
    **{name: ("wheel", wheel_profile(name).points[::4]) for name in WHEEL_NAMES},
    **{name: ("rail", rail_head(name, lean).points[::4]) for name, lean in (("56E1", 0.05), ("60E2", 0.0))},
    "half a rail": ("rail", rail_head("60E1").points[rail_head("60E1").points[:, 0] < 12 * MM][::4]),
}


@pytest.mark.parametrize("name", SHAPES)
def test_every_disguise_of_a_profile_reads_the_same_with_its_kind_told_or_not(name):
    """Axis up or down, mirrored, reversed, in three units, as two columns: 24 disguises. A rail's sides cannot be told;
    it may come out mirrored."""
    kind, points = SHAPES[name]
    plain = examine(raw(points, kind)).profile.points
    for up, mirror, order, unit in DISGUISES:
        disguised = (points * [mirror, up] / unit)[::order]
        for told in (kind, None) if unit == 1.0 else (None,):
            found = examine(raw(disguised, told))
            assert found.kind == kind
            same = [np.abs(found.profile.points - plain).max()]
            if kind == "rail":
                same.append(np.abs(found.profile.points[::-1] * [-1, 1] - plain).max())
            assert min(same) < 1e-9


@pytest.mark.parametrize(
    "points, width",
    [
        (measured_wheel()[measured_wheel()[:, 0] > 32.0] * MM, 107),
        (np.column_stack([np.linspace(0, 0.07, 90), np.zeros(90)]), 70),
    ],
)
def test_what_is_neither_wheel_nor_rail_by_its_shape_asks_for_its_kind(points, width):
    with pytest.raises(ProfileError, match="neither a whole wheel .* name the kind"):
        examine(raw(points, None))


def test_a_wheel_whose_flange_back_is_not_measured_asks_for_it_and_is_then_right(tmp_path):
    """Measured from 3.93 mm behind the back on, where the flange leans: by its first point it would stand 3.93 mm off
    sideways."""
    points = measured_wheel(begin=3.93, rim=0.0)[:-61]
    file = written(tmp_path / "a.prw", simpack(points * [1, -1], "wheel"))
    with pytest.raises(
        ProfileError, match=r"a.prw: the flange back is not measured: .* at y = 3.9\d\d mm, .* give flange_back"
    ):
        examine(read_raw(file))
    found = examine(read_raw(file), flange_back=0.0)
    assert off_tread(found) < 5 * UM and says(found, "repaired", "from the flange back as told")
    shifted = written(tmp_path / "b.prw", simpack((points + [12.5, 3.0]) * [1, -1], "wheel"))
    assert off_tread(examine(read_raw(shifted), flange_back=12.5 * MM)) < 5 * UM
    mirrored = raw(points * [-MM, MM], "wheel")
    assert off_tread(examine(mirrored, flange_back=0.0)) < 5 * UM
    for wrong in (-60 * MM, 60 * MM, np.nan):
        with pytest.raises(ProfileError, match="flange_back"):
            examine(read_raw(file), flange_back=wrong)


def test_a_flange_back_measured_beside_a_files_own_datum_is_said():
    points = wheel_profile("P8").points[::3] + [1.0 * MM, 0.0]
    assert says(examine(raw(points, "wheel")), "warning", "flange back is measured at y = -69.00 mm")


def test_the_crown_of_a_rail_is_set_to_zero_and_its_gauge_side_mirrored_as_told(tmp_path):
    file = written(tmp_path / "a.ban", MINIPROF_KEYS.format(count=999) + rows(measured_rail()))
    found = examine(read_raw(file))
    assert says(found, "repaired", "crown set to z = 0: moved by 6.010 mm") and says(
        found, "warning", "use the option mirror"
    )
    told = examine(read_raw(file), mirror=True)
    y = np.linspace(-30, 30, 301) * MM
    assert np.abs(told.profile.height(y) - rail_head("60E1").height(y)).max() < 0.5 * UM
    assert says(told, "repaired", "mirrored as told") and not says(told, "warning", "mirror")
    kept = examine(read_raw(file), origin="file")
    assert kept.profile.points[:, 1].max() == pytest.approx(-6.01 * MM, abs=1e-9) and says(
        kept, "warning", "kept (as told)"
    )
    placed = examine(read_raw(file), mirror=True, origin=(2 * MM, -6.01 * MM))
    crown = placed.profile.points[np.argmax(placed.profile.points[:, 1])]
    assert crown == pytest.approx([2 * MM, 0.0], abs=0.3 * MM)


def test_a_track_refuses_a_rail_whose_crown_is_not_at_zero():
    low = rail_head("60E1").shifted(0.0, -6.01 * MM)
    with pytest.raises(
        WheelsetError, match=r"left rail 60E1 upright: its crown lies at z = -6.010 mm.*rail.shifted\(0, 0.006010\)"
    ):
        Track(low)
    with pytest.raises(WheelsetError, match="right rail"):
        Track(rail_head("60E1"), low)
    with pytest.raises(WheelsetError, match="look like mm"):
        Track(Profile.from_points(rail_head("60E1").points * 1e3))


def test_a_format_whose_axis_points_the_other_way_than_the_shape_is_doubted():
    """A .prr and a .prw exported with z up: taken by their shape, with a word."""
    for kind, points in (("rail", rail_head("60E1").points), ("wheel", wheel_profile("P8").points)):
        found = examine(RawProfile(points, np.arange(len(points)), raw(points).path, "Simpack", 1.0, kind, -1))
        assert says(found, "warning", "by its format the vertical axis points down")
        assert np.abs(found.profile.points - points).max() < 1e-12


def test_a_leaning_gauge_face_is_said_and_its_foot_stays_in_reach_of_a_flange():
    found = examine(raw(leaning_rail(), "rail", up=1))
    assert says(found, "warning", "the gauge face leans over by 2.00 mm, 15.8 mm below the crown")
    placed = Track(found.profile).placed("left")
    assert placed.is_graph
    whole, offset = found.profile.points, Track(found.profile).gauge_offset("left")
    # cut, it would begin at the lean's edge, 5 mm further in
    assert placed.points[0] - [offset, 0] == pytest.approx(whole[0], abs=1e-12)
    foot = whole[whole[:, 0] < whole[:, 0].min() + 4 * MM]
    assert placed.height(foot[1:-1, 0] + offset) == pytest.approx(foot[1:-1, 1], abs=0.15 * MM)
    crown = whole[whole[:, 1] > -10 * MM]
    assert placed.height(crown[1:-1, 0] + offset) == pytest.approx(crown[1:-1, 1], abs=1e-9)


def test_headers_without_blank_line_comments_and_offsets_are_read(tmp_path):
    text = MINIPROF_KEYS.format(count=len(measured_rail())) + rows(measured_rail())
    for name, content in (
        ("a.ban", text),
        ("b.ban", text + "\n\n"),
        ("c.ban", text.replace("Gauge=1436.9\n", "Gauge=1436.9\n\n")),
    ):
        assert len(read_raw(written(tmp_path / name, content)).points) == len(measured_rail())
    moved = read_raw(written(tmp_path / "d.ban", text.replace("Xoffset=0.0000", "Xoffset=1.5000")))
    assert any("Xoffset = 1.5000, which is not applied" in note for note in moved.notes)
    head = rail_head("60E1").points[::3] / MM
    commented = simpack(head, "rail", "% a test body\n").replace("  point.end", "% end of the head\n  point.end")
    assert np.allclose(read_raw(written(tmp_path / "e.prr", commented)).points, head * [1, -1], atol=1e-6)


def slcs(sections: int, features: int = 0, stations=None, kinks: str = "", scale: float = 1.0, unit: str = "mm") -> str:
    stations = [20.0 * k for k in range(sections)] if stations is None else stations
    names = "".join(f" {x:10.6f}  'made/s_{k + 1}.prr'\n" for k, x in enumerate(stations))
    table = (
        "".join(
            f" {x:10.6f} {' '.join(['-1'] + [f'{3.0 * f + k:.3f}' for f in range(1, features)])}\n"
            for k, x in enumerate(stations)
        )
        if features
        else ""
    )
    nkink = 1 if kinks else 0
    return (
        f"% made\n\n 0.0 {scale:.1f} S_OFFSET [{unit}], S_SCALE [mm/{unit}]\n {sections} NSLC\n {features} {nkink} 0"
        f" NFEAT, NKINK, NACCEL\n 1 S_METHOD\n\n{names}\n% parts\n{kinks}% features\n{table}"
    )


def test_slices_of_simpack_sections_with_features_and_kinks_are_read(tmp_path):
    """Sections in mm by their own word while the stations' scale says metres; features are counted alone."""
    head = rail_head("60E1").points[::3] / MM + [0.0, -1.5]
    for k in (1, 2, 3):
        written(tmp_path / "made" / f"s_{k}.prr", simpack(head, "rail"))
    slices = read_slices(written(tmp_path / "a.slcs", slcs(3, 4, [0.0, 0.02, 0.04], " 2 P_KINK\n", 1000.0, "m")))
    assert slices.x == pytest.approx([0.0, 0.02, 0.04])
    assert np.allclose(slices.sections[1].points, head * [MM, -MM], atol=1e-9)
    SectionCrossing.from_slices(slices)
    found = examine(read_raw(tmp_path / "a.slcs", number=2))
    assert says(found, "found", "4 features along each section") and says(
        found, "found", "crown at z = -1.500 mm by the file's own zero, kept"
    )
    with pytest.raises(ProfileError, match="station 4.5e-06 m lies 4.5 um beyond 0 m"):
        read_slices(written(tmp_path / "b.slcs", slcs(3, stations=[0.0, 0.0045, 0.0089])))


@pytest.mark.parametrize("unit, width", [(1e-3, 1.0), (1.0, 1e-3)])
def test_the_unit_of_two_column_sections_is_theirs_not_the_stations(tmp_path, unit, width):
    head = rail_head("60E1").points[::3]
    for k in (1, 2):
        written(tmp_path / "made" / f"s_{k}.txt", rows(head / unit * [1, -1], "{:.7f} {:.7f}"))
    file = written(tmp_path / "a.slcs", slcs(2).replace(".prr", ".txt"))
    assert np.allclose(read_slices(file).sections[0].points, head * [1, -1], atol=1e-7)
    assert np.allclose(read_slices(file, section_unit=2 * unit).sections[0].points, head * [2, -2], atol=2e-7)


@pytest.mark.parametrize("name", ["a.slcw", "renamed.slcs"])
def test_slices_round_a_wheel_are_no_rail(tmp_path, name):
    text = slcs(3).replace("S_OFFSET [mm], S_SCALE [mm/mm]", "TH_OFFSET [rad], TH_SCALE [rad/rad]")
    for read in (read_slices, read_raw):
        with pytest.raises(ProfileError, match="slices round a wheel, with angles for stations .line 3."):
            read(written(tmp_path / name, text))


def test_a_declared_unit_holds_where_no_other_fits_and_a_told_one_always():
    """A crown of 20 mm in mm as declared: no other unit makes it a rail. 70 units told to be inches: the caller's
    word."""
    y = np.linspace(-10, 10, 81)
    narrow = np.column_stack([y, -(y**2) / 600])
    found = examine(raw(narrow, "rail", unit=1e-3, up=1))
    assert says(found, "warning", "in mm as declared the rail is 20 mm wide") and np.ptp(
        found.profile.points[:, 0]
    ) == pytest.approx(20 * MM)
    head = rail_head("60E1").points[::3] / MM
    assert says(examine(raw(head, "rail", unit=0.0254, unit_told=True)), "warning", "in inch as told the rail is 1")
    with pytest.raises(ProfileError, match="would fit in mm: state the unit"):
        examine(raw(head, "rail", unit=0.0254))


def test_a_refused_file_tells_how_it_was_read(tmp_path):
    """A column of numbers before y and z: y is the number."""
    points = wheel_profile("P8").points[::2] / MM
    np.savetxt(tmp_path / "w.csv", np.column_stack([np.arange(len(points)), points]), header="No,y,z", comments="")
    with pytest.raises(ProfileError, match='heading "No,y,z" on line 1; 3 columns: the first two are used'):
        examine(read_raw(tmp_path / "w.csv", "wheel"))


@pytest.mark.parametrize(
    "kind, points", [("wheel", wheel_profile("P8").points[::5]), ("rail", rail_head("60E1").points[::5])]
)
def test_single_points_that_stand_out_of_a_quiet_line_are_put_back(kind, points):
    """The median of the scatter does not see two points of 500; points printed to 0.1 um."""
    clean = np.round(points, 7)
    spiked = clean.copy()
    for at, height in ((len(clean) // 3, 0.3 * MM), (len(clean) // 2, -0.05 * MM)):
        spiked[at, 1] += height
    found = examine(raw(spiked, kind))
    assert says(found, "repaired", "2 point(s) stood out of the line")
    near = np.clip(clean[:, 0], -46 * MM if kind == "wheel" else -30 * MM, 30 * MM)
    off = found.profile.graph_part().height(near) - examine(raw(clean, kind)).profile.graph_part().height(near)
    assert np.abs(off).max() < 30 * UM  # of 300, where the points' distance changes
    assert not says(examine(raw(clean, kind)), "repaired", "stood out")


def test_points_nearer_than_their_print_shows_a_tangent_are_left_out():
    """A drawing exported with steps of 0.3 um and 100 um, printed to 0.1 um: tangents up to 40 degrees off, scatter
    0.03 um."""
    y = np.sort(np.concatenate([np.linspace(-30, 30, 601), np.linspace(20, 21, 3001)]))
    points = np.round(np.column_stack([y, -(y**2) / 60]), 4)
    points = points[np.append(True, np.hypot(*np.diff(points, axis=0).T) > 0)]
    found = examine(raw(points, "rail", unit=1e-3, up=1))
    assert says(found, "repaired", "nearer to their neighbour")
    inner = np.abs(found.profile.points[:, 0]) < 29 * MM
    assert np.abs(np.tan(found.profile.angle_after) + found.profile.points[:, 0] / 0.03)[inner].max() < 0.02


@pytest.mark.parametrize("level", [3e-6, 20e-6])
def test_the_scatter_to_take_out_can_be_told(level):
    """3 um would be left as it is; told, the splines move points by that much rms across the line and come nearer to
    the true line."""
    clean = rail_head("60E1", spacing=0.4 * MM).points
    noisy = clean + np.random.default_rng(7).normal(0, level, clean.shape)
    found = examine(raw(noisy, up=1), smoothing=level)
    assert says(found, "repaired", f"{level / UM:.3g} um taken out as told")
    crown = np.linspace(-20, 20, 201) * MM
    off = lambda profile: np.std(profile.graph_part().height(crown) - rail_head("60E1").height(crown))
    assert off(found.profile) < 0.6 * off(examine(raw(noisy, up=1), smooth=False).profile)
    with pytest.raises(ProfileError, match="between 0 and 1 mm"):
        examine(raw(noisy, up=1), smoothing=-1e-6)


def test_options_of_the_other_kind_are_refused():
    with pytest.raises(ProfileError, match="this is a rail"):
        examine(raw(rail_head("60E1").points, "rail"), flange_back=0.0)
    for option in ({"mirror": True}, {"origin": "file"}, {"origin": (0.0, 0.0)}):
        with pytest.raises(ProfileError, match="are for rails"):
            examine(raw(wheel_profile("P8").points, "wheel"), **option)
    for origin in ("top", (0.0,), (0.0, np.nan)):
        with pytest.raises(ProfileError, match="origin"):
            examine(raw(rail_head("60E1").points, "rail"), origin=origin)


def test_a_file_that_is_not_there_is_said_in_words(tmp_path):
    with pytest.raises(ProfileError, match="nothere.csv: no such file"):
        read_raw(tmp_path / "nothere.csv")
    with pytest.raises(ProfileError, match="a folder"):
        read_raw(tmp_path)


def test_a_wheel_in_mm_is_no_wheel_of_a_wheelset():
    with pytest.raises(WheelsetError, match="look like mm"):
        Wheelset(Profile.from_points(wheel_profile("P8").points[::5] * 1e3))
