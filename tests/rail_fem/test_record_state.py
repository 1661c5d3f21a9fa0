"""From measured accelerations back to the crossing: records as numbers, known states found again, what is refused and
flagged, the command."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import chi2, kstest
from typer.testing import CliRunner

from rail_fem.case.casefile import load_case
from rail_fem.case.examples import examples
from rail_fem.cli import app
from rail_fem.design import state
from rail_fem.design.inversion import covered, invert, scaled
from rail_fem.design.observations import FORM
from rail_fem.design.posterior import interval
from rail_fem.design.problem import DesignError
from rail_fem.design.record_report import doubts, met, verdicts
from rail_fem.design.state import state_problem
from rail_fem.measurement.record import Record, RecordError, of_result, read_record
from rail_fem.measurement.trace import PassWindow, Sensor, quietest, trace_of
from rail_fem.processes.pool import Workers
from rail_fem.result.low_pass import low_pass
from rail_fem.settings.light import RigidHertzSettings

SPEED = 30.0
RUN = """
[run.rigid_hertz]
start = "-100 mm"
end = "900 mm"
time_step = "40 us"
path_spacing = "10 mm"
"""
BEARERS = """
[scene.bearers]
position = "60 mm"
pad_stiffness = "200 kN/mm"
pad_damping = "30 kN s/m"
mass = "150 kg"
ballast_stiffness = "76 kN/mm"
ballast_damping = "60 kN s/m"
casting = { start = "-800 mm", end = "2200 mm", second_moment = "7000 cm^4", mass = "200 kg/m", foot_depth = "80 mm" }
"""
FIND = [
    "scene.foundation.stiffness=60 kN/mm..300 kN/mm",
    "scene.foundation.damping=20 kN s/m..120 kN s/m",
    "scene.foundation.track_mass=300 kg..1200 kg",
]
TRUTH = {"stiffness": "110 kN/mm", "damping": "80 kN s/m", "track_mass": "600 kg"}


@pytest.fixture(scope="module")
def case(tmp_path_factory):
    """The reference crossing from where the leg is left to behind the nose, in coarse steps."""
    text = examples()["nose_transfer"].read_text()
    path = tmp_path_factory.mktemp("case") / "crossing.toml"
    path.write_text(text[: text.index("[run.")] + RUN)
    return path


def write_record(path, case, changes, sensor=Sensor("sleeper_acceleration"), rate=4e3, noise=0.03, seed=1, notes=""):
    """What a sensor writes of a pass that begins 150 mm before the case's, with noise: as a CSV."""
    finer = {"run.rigid_hertz.start": "-250 mm", "run.rigid_hertz.end": "1050 mm", "run.rigid_hertz.time_step": "20 us"}
    made = load_case(case, changes | finer)
    own = sensor.of(made.scene, made.runs["rigid_hertz"])
    time = np.arange(0, np.ptp(own.position) / made.scene.speed, 1 / rate)
    values = np.interp(time, np.arange(len(own.values)) / own.rate, low_pass(own.values, own.rate, 0.4 * rate))
    deviation = noise * values.std()
    values = values + deviation * np.random.default_rng(seed).standard_normal(len(values))
    rows = "\n".join(f"{1e3 * t:.6f},{a:.7g}" for t, a in zip(time, values))
    noted = f"# noise: {deviation:.6g} m/s^2\n" if noise else ""
    path.write_text(f"{notes}{noted}time [ms], {sensor.quantity} [m/s^2]\n{rows}\n")
    return path


def states(truth):
    return {f"scene.foundation.{name}": value for name, value in truth.items()}


def test_a_window_s_numbers_are_those_of_the_motion_at_any_rate_and_place():
    """a cos(w t) of a whole number of periods: Tukey's window takes a share of them, its mean 1 - SLOPING / 2, of the
    number at its own frequency; the sum over samples is exact but for what the window lets through at the rate less
    the frequency, which falls with its square."""
    window = PassWindow(0.0, 1.2, SPEED, 500.0)
    frequency = window.frequencies[7]
    for rate in (4e3, 9.7e3):
        x = np.arange(-0.3, 1.5, SPEED / rate)
        record = Record("sleeper_acceleration", x, 5 * np.cos(2 * np.pi * frequency * x / SPEED), rate)
        numbers = window.of(record)
        assert numbers[7] == pytest.approx(5 * 0.85, rel=1e-3)
        moved = replace(record, position=x - 0.07)
        assert window.of(moved, 0.07) == pytest.approx(numbers, abs=1e-9)


def test_a_record_and_its_pass_make_the_same_numbers(case, tmp_path):
    """Written at 4 kHz, begun elsewhere, in half the step: chi-square of the truth is that of its noise, and its
    offset is found to half the distance of those looked at, a sixtieth of the shortest wave, and a step of the pass."""
    file = write_record(tmp_path / "r.csv", case, states(TRUTH))
    made = load_case(case, states(TRUTH))
    settings = made.runs["rigid_hertz"]
    problem = state_problem(case, [file], FIND, [], None, 20, None)
    (fact,) = problem.records
    numbers = fact.measured(made.scene, settings)
    per_number, chance = fact.misfit(numbers, 0.03)
    assert per_number < 1.5 and chance > 0.01
    assert fact.offset(numbers) == pytest.approx(-0.25, abs=made.scene.speed * (1 / 500 / 60 + 20e-6))
    other = fact.measured(load_case(case).scene, settings)
    assert fact.misfit(other, 0.03)[0] > 5


def test_noise_is_seen_with_the_covariance_that_is_counted(case, tmp_path):
    """White noise of known size on a record: the numbers' squared distance from the noiseless ones, by Trace.noise, is
    chi-square of as many degrees of freedom as there are numbers, less the two of a sensor's constant and drift."""
    clean = read_record(write_record(tmp_path / "r.csv", case, {}, noise=0), load_case(case).scene.velocity)
    rng = np.random.default_rng(3)
    made = load_case(case)
    trace = trace_of(replace(clean, notes={"noise": "2 m/s^2"}), made.scene, made.runs["rigid_hertz"], 0.05)
    rows = trace.window.rows(clean.position + trace.moved[trace.strongest], clean.rate)
    inverse = np.linalg.inv(trace.noise)
    drawn = rows @ (2.0 * rng.standard_normal((len(clean.values), 400)))
    square = np.einsum("ik,ij,jk->k", drawn, inverse, drawn)
    assert kstest(square, chi2(len(rows) - 2).cdf).pvalue > 0.01
    drift = rows @ np.linspace(-3, 5, len(clean.values))
    assert drift @ inverse @ drift < 10, "a drift of the sensor is no sign of the crossing"
    quiet = np.r_[np.zeros(200), clean.values]  # before the train
    assert quietest(quiet + 2.0 * rng.standard_normal(len(quiet))) == pytest.approx(2.0, rel=0.3)


def test_known_states_are_found_again(case, tmp_path):
    """Ten states of three unknowns, found by the emulators of others from records with all errors that are counted. Of
    30 unknowns of 95 % intervals at least 25 lie inside with a probability of 0.997."""
    file = write_record(tmp_path / "r.csv", case, {})
    problem = state_problem(case, [file], FIND, [], None, 64, None)
    found = covered(problem, tmp_path / "out", 10, Workers(1))
    assert found[..., 0].sum() >= 25 and found[..., 1].mean() < 0.7


def with_rounds(problem, rounds):
    return replace(problem, design=problem.design.model_copy(update={"rounds": rounds}))


@pytest.mark.validate
def test_a_hundred_states_on_bearers_are_found_again(case, tmp_path):
    """Ballast, two bearers that may hang, height of the nose and lateral position from a sleeper's record, 128 trials:
    each unknown of 100 seeded states lies in its 95 % interval in 95 at least."""
    on_bearers = tmp_path / "bearers.toml"
    on_bearers.write_text(case.read_text().replace("[scene.materials]", BEARERS + "\n[scene.materials]"))
    file = write_record(
        tmp_path / "r.csv", on_bearers, {}, Sensor("sleeper_acceleration", bearer=1), notes="# bearer: 1\n"
    )
    find = [
        "scene.bearers.ballast_stiffness=40 kN/mm..120 kN/mm",
        "scene.crossing.nose_lowering=-0.3 mm..0.5 mm",
        "scene.gauge=1434 mm..1436 mm",
    ]
    found = covered(state_problem(on_bearers, [file], find, [], "0,1", 128, None), tmp_path / "out", 100, Workers(2))
    assert (found[..., 0].mean(axis=0) >= 0.95).all() and found[..., 1].mean() < 0.5


def test_a_record_without_the_wheel_is_met_by_no_state(case, tmp_path):
    """Noise of the size that it says, and no pass in it: even at the largest error of form chi-square has no chance."""
    file = write_record(tmp_path / "r.csv", case, {})
    head, rows = file.read_text().splitlines()[:2], file.read_text().splitlines()[2:]
    noise = float(head[0].split()[2]) * np.random.default_rng(5).standard_normal(len(rows))
    file.write_text("\n".join([*head, *(f"{row.split(',')[0]},{a:.6g}" for row, a in zip(rows, noise))]) + "\n")
    (fact,) = state_problem(case, [file], FIND, [], None, 20, None).records
    made = load_case(case)
    assert fact.misfit(fact.measured(made.scene, made.settings(RigidHertzSettings)), FORM[1])[1] < 1e-3


@pytest.fixture(scope="module")
def found(case, tmp_path_factory):
    """The state behind one record of the sleeper: problem, inversion, folder."""
    folder = tmp_path_factory.mktemp("found")
    file = write_record(folder / "train.csv", case, states(TRUTH), seed=4)
    problem = with_rounds(state_problem(case, [file], FIND, [], None, 48, None), 1)
    return problem, invert(problem, folder / "out", Workers(1), lambda _: None), folder


def test_a_state_lies_in_its_bars(found):
    problem, one, _ = found
    low, high = interval(one.samples)[:, :-1]
    truth = scaled(problem, np.array([[110.0, 80.0, 600.0]]))[0]
    assert ((low <= truth) & (truth <= high)).all() and (high - low < 0.6).any()
    assert not doubts(problem, one) and met(problem, one)[0].known < 2


def test_the_record_of_another_wheel_gives_no_verdict(found, case):
    """A wheel of half the unsprung mass on a worn tread less hollow: the light model meets it by no state within the
    bounds, the error of form says so, and nothing is told to be ground."""
    problem, one, folder = found
    other = {"scene.wheel.profile": "P1", "scene.speed": "50 mph"}
    file = write_record(folder / "other.csv", case, states(TRUTH) | other)
    strange = with_rounds(state_problem(case, [file], FIND, [], None, 32, None), 0)
    seen = invert(strange, folder / "strange", Workers(1), lambda _: None)
    assert doubts(strange, seen) and verdicts(strange, seen)[0].startswith("No verdict: ")


def clip(path, share=0.5):
    head, *rows = path.read_text().splitlines()[1:]
    values = np.array([row.split(",") for row in rows], float)
    most = share * values[:, 1].max()
    rows = "\n".join(f"{t},{min(a, most)}" for t, a in values)
    path.write_text(f"{head}\n{rows}\n")
    return path


@pytest.mark.parametrize(
    "spoil, find, complaint",
    [
        (clip, FIND, "samples in a row lie at .* wider range"),
        (lambda path: path.write_text("\n".join(path.read_text().splitlines()[:60]) + "\n"), FIND, "mm longer than"),
        (lambda path: path.write_text(path.read_text().replace("sleeper_acceleration [m/s^2]", "force [N]")), FIND,
         "force is no acceleration"),
        (lambda path: path.write_text("# scene.wheel.profile: P1\n" + path.read_text()), FIND, "no physical quantity"),
        (lambda path: path.write_text("# scene.speeed: 60 mph\n" + path.read_text()), FIND, "did you mean 'speed'"),
        (lambda path: None, ["scene.foundation.stiffness=60 kN/mm"], "write KEY=LOW..HIGH"),
        (lambda path: None, ["scene.foundation.stiffness=60 kN/mm..30 kN/mm"], "must lie below"),
    ],
)  # fmt: skip
def test_what_cannot_be_searched_is_refused_with_its_remedy(case, tmp_path, spoil, find, complaint):
    file = write_record(tmp_path / "r.csv", case, {})
    spoil(file)
    with pytest.raises(ValueError, match=complaint):
        state_problem(case, [file], find, [], None, 20, None)


def test_a_sleeper_s_record_says_on_which_bearer(case, tmp_path):
    on_bearers = tmp_path / "bearers.toml"
    text = case.read_text()
    on_bearers.write_text(text.replace("[scene.materials]", BEARERS + "\n[scene.materials]"))
    sensor = Sensor("sleeper_acceleration", bearer=1)
    file = write_record(tmp_path / "r.csv", on_bearers, {}, sensor)
    find = ["scene.bearers.ballast_stiffness=40 kN/mm..120 kN/mm"]
    with pytest.raises(DesignError, match="say on which bearer"):
        state_problem(on_bearers, [file], find, [], "0,1", 20, None)
    file = write_record(tmp_path / "r.csv", on_bearers, {}, sensor, notes="# bearer: 77\n")
    with pytest.raises(DesignError, match="77 is none of this case"):
        state_problem(on_bearers, [file], find, [], "0,1", 20, None)
    notes = "# bearer: 1\n# scene.speed: 60 mph\n"
    file = write_record(tmp_path / "r.csv", on_bearers, {"scene.speed": "60 mph"}, sensor, notes=notes)
    problem = state_problem(on_bearers, [file], find, ["scene.gauge=1432 mm..1438 mm"], "0,1", 20, None)
    assert [v.name for v in problem.design.vary] == [
        "scene.bearers.ballast_stiffness",
        "scene.bearers.unlike_ballast.0",
        "scene.bearers.unlike_ballast.1",
        "scene.gauge of r",
    ]
    (fact,) = problem.records
    for factor, alike in ((1.0, True), (0.0, False)):
        one = problem.changed(np.array([76.0, 1.0, factor, 1435.0]), problem.design.passes[0])
        numbers = fact.measured(one.scene, one.settings(RigidHertzSettings))
        assert (fact.misfit(numbers, 0.03)[0] < 2) == alike
    made = load_case(on_bearers)
    with pytest.raises(RecordError, match="no bearer's"):
        from rail_fem.hierarchy import solve

        of_result(solve("rigid_hertz", made.scene, made.runs["rigid_hertz"]), "sleeper_acceleration")


def test_the_command_finds_a_state(found, case, monkeypatch):
    """A folder with the trials that are done: the command goes on with them, and reports."""
    monkeypatch.setattr(state, "ROUNDS", 0)
    _, _, folder = found
    out = folder / "out"
    given = ["measured", str(folder / "train.csv"), str(case), "--out", str(out), "--trials", "48", "--workers", "1"]
    for text in FIND:
        given += ["--find", text]
    done = CliRunner().invoke(app, given)
    assert done.exit_code == 0, done.output
    text = (out / "inversion.md").read_text()
    assert "(scene.foundation.stiffness) | 60 kN/mm to 300 kN/mm |" in text and "chi-square, form 3 %" in text
    assert (out / "state.png").stat().st_size > 10_000
