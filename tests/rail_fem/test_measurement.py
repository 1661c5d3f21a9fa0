"""Measured records: filters with known answers, a synthetic record that is found again, what is refused."""

from dataclasses import replace

import numpy as np
import pytest

from rail_fem.measurement.record import Record, RecordError, of_result, read_record
from rail_fem.measurement.score import align, score, score_table
from rail_fem.result.low_pass import CUTOFFS, filtered_peak, low_pass, low_passed
from rail_fem.result.result import PassResult
from rail_fem.show.report import result_report
from tests.commands import call
from tests.rail_fem.test_scene import make_scene

RATE, SPEED = 10e3, 33.528
LOAD = 86e3


def test_a_sine_keeps_its_phase_and_loses_half_at_the_cut_off():
    """Fourth-order Butterworth forwards and backwards: 1 / (1 + (f / f_c)^8) of the amplitude."""
    time = np.arange(0, 2, 1 / RATE)
    for frequency in (10.0, 50.0, 80.0):
        sine = np.sin(2 * np.pi * frequency * time)
        middle = slice(5000, 15000)  # away from the ends
        found = low_pass(sine, RATE, 50.0)[middle]
        amplitude = 2 * np.mean(found * sine[middle])
        # the bilinear transform moves the cut-off's neighbourhood by (f / rate)^2
        assert amplitude == pytest.approx(1 / (1 + (frequency / 50) ** 8), abs=1e-3)
        assert np.mean(found * np.cos(2 * np.pi * frequency * time[middle])) == pytest.approx(0, abs=1e-3)


def test_a_constant_and_a_slow_record_stay_what_they_are():
    assert low_pass(np.full(300, LOAD), RATE, 20.0) == pytest.approx(np.full(300, LOAD), rel=1e-9)
    values = np.random.default_rng(1).standard_normal(50)
    assert (low_pass(values, 100.0, 50.0) == values).all()  # beyond Nyquist there is nothing to take


@pytest.mark.parametrize("values, cutoff", [([1.0, np.nan, 1.0, 1.0], 20.0), ([1.0] * 4, 0.0), ([1.0] * 4, np.nan)])
def test_what_cannot_be_filtered_is_refused(values, cutoff):
    with pytest.raises(ValueError, match="low pass"):
        low_pass(np.array(values), 100.0, cutoff)


def force_at(x):
    """A pass with a dip's P1 and P2 and a landing."""
    bump = lambda at, width, height: height * np.exp(-(((x - at) / width) ** 2))
    return LOAD + bump(0.35, 0.012, 110e3) + bump(0.48, 0.05, 60e3) - bump(0.1, 0.03, 40e3)


@pytest.fixture(scope="module")
def result():
    x = np.arange(-2.0, 2.4, SPEED * 20e-6)
    height = -1e-3 * np.exp(-(((x - 0.4) / 0.08) ** 2))
    columns = {
        "time": (x + 2.0) / SPEED,
        "x": x,
        "force": force_at(x),
        "wheel_height": height,
        "crossing_height": height / 2,
    }
    return PassResult("rigid_hertz", make_scene(), {}, columns)


def write(path, heading, *columns, first=""):
    rows = "\n".join(",".join(f"{value:.9g}" for value in row) for row in zip(*columns))
    path.write_text(f"{first}{heading}\n{rows}\n", encoding="utf-8")
    return path


def test_a_record_moved_along_the_track_is_found_again(result, tmp_path):
    """Sampled at 8 kHz by its own clock, 0.237 m further on, with 2 % noise: offset to 1 mm, score by the noise."""
    x, rng = np.arange(-0.2, 0.9, SPEED / 8e3), np.random.default_rng(2)
    noise = 0.02 * LOAD * rng.standard_normal(len(x))
    file = write(tmp_path / "r.csv", "time [ms], force [kN]", 1e3 * (x - x[0]) / SPEED, (force_at(x) + noise) / 1e3)
    record = read_record(file, SPEED)
    pair = align(record, of_result(result, "force"), None)
    assert pair.shift == pytest.approx(-0.2, abs=1e-3)  # its clock began at x = -0.2
    raw, smooth = score(pair, 4e3), score(pair, 500.0)
    assert smooth.measured == pytest.approx(smooth.computed, rel=0.02) and abs(smooth.offset) < 3e-3
    assert raw.difference > smooth.difference and smooth.difference < 0.03
    assert score(pair, 100.0).computed < smooth.computed
    short = score(pair, 50.0)  # of 33 ms all is the filter's ends: 5 % more was told as a difference of 80 %
    assert np.isnan([short.measured, short.computed, short.offset, short.difference]).all()
    told = score_table(record, pair, [short]).splitlines()
    assert told[-2].split()[:7] == ["50", "Hz", *"-----"] and "peaks -: in a record shorter than two" in told[-1]
    assert smooth.coherence > 0.97


def test_a_part_of_a_short_pass_is_found_where_it_was_cut_from(result):
    """9 of 33 ms, 12 mm aside. Through 50 Hz both were what the filter's ends make of them: 2.4 mm off, 10 % apart."""
    own = of_result(result, "force")
    part = slice(*np.searchsorted(own.position, (0.2, 0.5)))
    cut = Record("force", own.position[part] + 0.012, own.values[part], own.rate)
    pair = align(cut, own, None)
    assert pair.shift == pytest.approx(-0.012, abs=2e-4) and score(pair, 4e3).difference < 0.02


def test_a_record_of_forces_of_the_other_sign_is_told(result):
    record = of_result(result, "force")
    turned, pair = replace(record, values=-record.values), align(record, record, None)
    said = [score_table(one, pair, [score(pair, 500.0)]) for one in (record, turned)]
    assert "turn their sign" not in said[0] and "turn their sign" in said[1] and "peaks -" not in said[0]
    dynamic = replace(record, values=record.values - record.values.mean() * 1.01)
    assert "forces here hold the static load" in score_table(dynamic, pair, [])
    thousandth = score_table(record, pair, [score(replace(pair, measured=pair.measured / 1e3), 500.0)])
    assert "1000.000" in thousandth.split()  # apart from its neighbour


@pytest.mark.parametrize("common, found", [(0.92, True), (0.88, False)])
def test_an_alignment_keeps_half_of_the_shorter_one(common, found):
    """Two stretches of 1.8 m of which 51 and 49 % are common, the dip's blows in the midst of them: half is 0.9 m."""
    step = SPEED / 8e3
    x = lambda low: np.arange(low, low + 1.8, step)
    stretch = lambda low, moved: Record("force", x(low) - moved, force_at(x(low)), 8e3)
    pair = align(stretch(common - 0.16 - 1.8, 0.05), stretch(-0.16, 0.0), None)
    assert (abs(pair.shift - 0.05) < 1e-3) == found and np.ptp(pair.x) >= 0.9 - 2 * step


def test_positions_that_are_known_are_kept_where_that_is_asked_for(result, tmp_path):
    x = np.arange(-0.2, 0.9, 2e-3)
    file = write(tmp_path / "r.csv", "x [mm], force [N]", 1e3 * (x + 0.02), force_at(x))
    pair = align(read_record(file, SPEED), of_result(result, "force"), 0.0)
    assert pair.shift == 0.0 and score(pair, 500.0).offset == pytest.approx(-0.02, abs=2e-3)


def test_an_acceleration_is_held_against_the_height(result, tmp_path):
    """z = -h exp(-(x/w)^2) at speed v: z'' = 2 h v^2 / w^2 at its lowest."""
    most = 2e-3 * SPEED**2 / 0.08**2
    own = of_result(result, "axle_box_acceleration")
    assert own.values.max() == pytest.approx(most, rel=1e-3)
    time = np.arange(0, 0.05, 1e-4)
    file = write(tmp_path / "a.csv", "time [s], axle_box_acceleration [g]", time, np.sin(60 * time))
    assert read_record(file, SPEED).values.max() == pytest.approx(9.80665, rel=1e-3)
    samples = write(
        tmp_path / "b.csv", "sleeper_acceleration [m/s^2]", np.sin(60 * time), first="# sampling rate: 10 kHz\n"
    )
    assert read_record(samples, SPEED).rate == pytest.approx(10e3)
    assert np.diff(read_record(samples, -SPEED).position).max() < 0  # trailing


def test_the_force_of_a_blow_is_quoted_low_passed(result):
    """Gaussian of 3.6 ms is passed at 500 Hz and nearly lost at 20 Hz; a history's other columns stay."""
    peaks = [filtered_peak(result, cutoff) for cutoff in CUTOFFS]
    assert peaks[2].x == pytest.approx(0.35, abs=5e-3) and peaks[2].value > peaks[1].value > peaks[0].value > LOAD
    found = low_passed(result.history, 20.0)
    assert found["force"].max() == pytest.approx(peaks[0].value, rel=1e-6)
    assert (found["x"] == result.history["x"]).all() and np.isnan(found["force_nose"]).all()


def test_a_low_passed_force_above_the_force_itself_is_told(result):
    """Of a rise that stays the filter makes 1.07; of a blow less than it was."""
    rise = np.where(np.abs(result.history["x"] - 0.35) < 0.2, 2 * LOAD, LOAD)
    risen = replace(result, history=result.history | {"force": rise})
    assert filtered_peak(risen, 500.0).value == pytest.approx((1 + 1.068) * LOAD, rel=2e-3)
    assert "the filter overshoots" in result_report(risen) and "overshoots" not in result_report(result)


@pytest.mark.parametrize(
    "low, high", [(0.0, 0.6), (-1.3, 0.9), (-2.0, 0.5)], ids=["short", "less than two periods", "at its end"]
)
def test_a_peak_of_the_filter_s_ends_is_none(result, low, high):
    """At 20 Hz: 18 and 66 ms, and 75 ms of which the largest lies 4 ms from the end; 50 ms are needed to both sides."""
    on = (result.history["x"] > low) & (result.history["x"] < high)
    part = replace(result, history={name: values[on] for name, values in result.history.items()})
    assert filtered_peak(part, 20.0) is None and filtered_peak(part, 500.0).x == filtered_peak(result, 500.0).x
    assert "low-passed at 500 Hz" in result_report(part) and "low-passed at 20 Hz" not in result_report(part)
    assert "low-passed at 20 Hz" in result_report(result)


@pytest.mark.parametrize(
    "text, complaint",
    [
        ("time, force\n1,2\n", "names each column with its unit"),
        ("time [ms], forc [kN]\n1,2\n", "did you mean 'force'"),
        ("time [ms], force [mm]\n1,2\n", 'is in "mm"'),
        ("time [ms], force [furlong]\n1,2\n", "unknown unit|is in"),
        ("time [ms], x [mm]\n1,2\n", "0 measured columns|row"),
        ("time [ms], force [kN], force [N]\n1,2,3\n", 'column "force" stands twice'),
        ("force [kN]\n" + "1\n" * 30, "sampling rate"),
        ("# sampling rate: 10 kg\nforce [kN]\n" + "1\n" * 30, "dimension"),
        ("time [ms], force [kN]\n" + "".join(f"{k % 7},1\n" for k in range(30)), "does not run one way"),
        ("time [ms], force [kN]\n" + "".join(f"{k},nan\n" for k in range(30)), "not finite"),
        ("time [ms], force [kN]\n" + "".join(f"{k},eins\n" for k in range(30)), "line 2: 2 value.s., not 2 numbers"),
        ("time [ms], force [kN]\n1,2\n", "at least 20"),
        ("", "no line of data"),
        (f"time [ms], force [{'k' * 100_000}N]\n1,2\n", "line 1: 100020 characters, at most 1000"),
        (f"time [ms], force [{'k' * 500}N]\n1,2\n", "a unit of 501 characters, at most 100"),
        (
            "time [s], force [kN]\n" + "".join(f"{k * 1e-3 + (k > 20) * 3.15e7},1\n" for k in range(30)),
            "3.15e[+]07 s between rows 21 and 22 of the data, where its smallest step is 0.001 s",
        ),
        ("time [s], force [kN]\n" + "".join(f"{6 * k}e306,1\n" for k in range(1, 30)), "to be placed along the track"),
    ],
)
def test_a_record_that_cannot_be_read_is_refused_with_line_and_remedy(tmp_path, text, complaint):
    (tmp_path / "r.csv").write_text(text)
    with pytest.raises(RecordError, match=complaint):
        read_record(tmp_path / "r.csv", SPEED)


def test_a_comma_beside_semicolons_or_tabs_is_a_decimal_one(tmp_path):
    path, rows = tmp_path / "record.csv", [f"{k}.25,{k}.5" for k in range(30)]
    found = {}
    for apart in ",;\t":
        text = "\n".join(["time [ms],force [kN]", *rows]).replace(",", apart)
        path.write_text(text if apart == "," else text.replace(".", ","), encoding="utf-8")
        found[apart] = read_record(path, SPEED).values
    assert found[","][1] == 1500 and (found[";"] == found[","]).all() and (found["\t"] == found[","]).all()


@pytest.mark.parametrize("unit", ["ps", "yr"])
def test_a_record_in_a_unit_that_cannot_be_meant_is_refused_before_it_is_resampled(result, tmp_path, unit):
    """Sampled alike, record or result would have filled the memory."""
    record = read_record(write(tmp_path / "r.csv", f"time [{unit}], force [kN]", np.arange(90.0), np.ones(90)), SPEED)
    with pytest.raises(RecordError, match="at most 5e[+]06 .*is r.csv's unit of time"):
        align(record, of_result(result, "force"), None)


def test_a_constant_record_has_no_deviation_to_be_held_against(result, tmp_path):
    """Its deviation from its mean is round-off, by which the difference was divided, and which found it a place."""
    time = np.arange(0, 40, 0.1)
    record = read_record(write(tmp_path / "r.csv", "time [ms], force [kN]", time, np.full(400, 86.1)), SPEED)
    with pytest.raises(RecordError, match="no shift at which record and result rise and fall alike.*--reach"):
        align(record, of_result(result, "force"), None)
    pair = align(record, of_result(result, "force"), 0.0)
    assert all(np.isnan(score(pair, cutoff).difference) for cutoff in (np.inf, *CUTOFFS[1:]))


def test_records_that_lie_elsewhere_are_refused(result, tmp_path):
    x = np.arange(5.0, 6.0, 2e-3)
    record = read_record(write(tmp_path / "r.csv", "x [m], force [kN]", x, force_at(x - 5)), SPEED)
    with pytest.raises(RecordError, match="do not overlap"):
        align(record, of_result(result, "force"), 0.0)
    with pytest.raises(RecordError, match="no shift within"):
        align(record, of_result(result, "force"), 0.1)


def test_the_commands_score_draw_and_filter_a_run(result, tmp_path):
    result.save(tmp_path / "run")
    x = np.arange(-0.2, 0.9, 2e-3)
    file, picture, table = (
        write(tmp_path / "r.csv", "x [mm], force [kN]", 1e3 * x, force_at(x) / 1e3),
        tmp_path / "m.png",
        tmp_path / "h.csv",
    )
    done = call("measured", tmp_path / "run", file, "--draw", picture)
    assert "20 Hz" in done.output and picture.stat().st_size > 10_000, done.output
    for note, code, said in (
        ("90 mph", 2, "# scene.speed: 90 mph, but the run has "),
        (f"{SPEED} m/s", 0, "20 Hz"),
        ("fast", 2, "fast"),
    ):
        other = write(
            tmp_path / "n.csv", "x [mm], force [kN]", 1e3 * x, force_at(x) / 1e3, first=f"# scene.speed: {note}\n"
        )
        assert said in call("measured", tmp_path / "run", other, code=code).output
    done = call("low-pass", tmp_path / "run", "--out", table)
    assert "largest force low-passed at 20 Hz" in done.output
    assert table.read_text().startswith("# low-passed at 20 Hz") and "as it is" not in done.output
    done = call("low-pass", tmp_path / "run", "--out", table, "--cutoff", "1 MHz")
    assert "too few for 1 MHz: it is written as it is" in done.output, done.output
