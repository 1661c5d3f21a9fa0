"""From measured accelerations back to the crossing: records as numbers, known states found again, what is refused and
flagged, the command."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import chi2, kstest

from rail_fem.case.casefile import load_case
from rail_fem.case.examples import examples
from rail_fem.design import state
from rail_fem.design.emulator import Emulator
from rail_fem.design.inversion import Inversion, covered, invert
from rail_fem.design.observations import FORM
from rail_fem.design.posterior import Known, interval
from rail_fem.design.problem import DesignError
from rail_fem.design.proof import check_proof
from rail_fem.design.record_facts import RecordFact
from rail_fem.design.record_report import StateReport
from rail_fem.design.search import Trial
from rail_fem.design.state import state_problem
from rail_fem.measurement.record import Record, RecordError, of_result, read_record
from rail_fem.measurement.trace import PassWindow, Sensor, quietest, trace_of
from rail_fem.processes.pool import Workers
from rail_fem.result.low_pass import low_pass
from rail_fem.settings.light import RigidHertzSettings
from tests.commands import call

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


@pytest.fixture(scope="module")
def on_bearers(case):
    """The same on bearers."""
    path = case.with_name("bearers.toml")
    path.write_text(case.read_text().replace("[scene.materials]", BEARERS + "\n[scene.materials]"))
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
def test_a_hundred_states_on_bearers_are_found_again(on_bearers, tmp_path):
    """Ballast, two bearers that may hang, height of the nose and lateral position from a sleeper's record, 128 trials:
    each unknown of 100 seeded states lies in its 95 % interval in 95 at least."""
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
    """The state behind one record of the axle box: problem, inversion, folder."""
    folder = tmp_path_factory.mktemp("found")
    file = write_record(folder / "train.csv", case, states(TRUTH), Sensor("axle_box_acceleration"), seed=4)
    problem = with_rounds(state_problem(case, [file], FIND, [], None, 48, None), 1)
    return problem, invert(problem, folder / "out", Workers(1), lambda _: None), folder


def test_a_state_lies_in_its_bars(found):
    problem, one, _ = found
    low, high = interval(one.samples)[:, :-1]
    truth = problem.scaled(np.array([[110.0, 80.0, 600.0]]))[0]
    assert ((low <= truth) & (truth <= high)).all() and (high - low < 0.6).any()
    state = StateReport(problem, one)
    assert not state.doubts and state.met[0].known < 2


def test_the_record_of_another_wheel_gives_no_verdict(found, case):
    """A wheel of half the unsprung mass on a worn tread less hollow: the light model meets it by no state within the
    bounds, the error of form says so, and nothing is told to be ground."""
    problem, one, folder = found
    other = {"scene.wheel.profile": "P1", "scene.speed": "50 mph"}
    file = write_record(folder / "other.csv", case, states(TRUTH) | other, Sensor("axle_box_acceleration"))
    strange = with_rounds(state_problem(case, [file], FIND, [], None, 32, None), 0)
    seen = invert(strange, folder / "strange", Workers(1), lambda _: None)
    state = StateReport(strange, seen)
    assert state.doubts and state.verdicts[0].startswith("No verdict, ")


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
        (lambda path: path.write_text("\n".join(path.read_text().splitlines()[:60]) + "\n"), FIND, "mm shorter than"),
        (lambda path: path.write_text(path.read_text().replace("sleeper_acceleration [m/s^2]", "force [N]")), FIND,
         "force is no acceleration"),
        (lambda path: path.write_text("# scene.wheel.profile: P1\n" + path.read_text()), FIND, "no physical quantity"),
        (lambda path: path.write_text("# scene.speeed: 60 mph\n" + path.read_text()), FIND, "did you mean 'speed'"),
        (lambda path: path.write_text("# scene.speed: fast\n" + path.read_text()), FIND, 'r.csv: scene.speed: "fast"'),
        (lambda path: path.write_text("# nois: 2 m/s^2\n" + path.read_text()), FIND, "r.csv: # nois.* mean 'noise'"),
        (lambda path: path.write_text("# noise: 0 m/s^2\n" + path.read_text()), FIND, "noise: 0 .* must be positive"),
        (lambda path: None, ["scene.foundation.stiffness=60 kN/mm"], "write KEY=LOW..HIGH"),
        (lambda path: None, ["scene.foundation.stiffness=60 kN/mm..30 kN/mm"], "must lie below"),
    ],
)  # fmt: skip
def test_what_cannot_be_searched_is_refused_with_its_remedy(case, tmp_path, spoil, find, complaint):
    file = write_record(tmp_path / "r.csv", case, {})
    spoil(file)
    with pytest.raises(ValueError, match=complaint):
        state_problem(case, [file], find, [], None, 20, None)


def test_a_sleeper_s_record_says_on_which_bearer(on_bearers, tmp_path):
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


def test_two_axles_in_one_window_are_refused(case):
    """In a pass of 2200 mm both of two that are 1800 mm apart are seen; of 2600 mm one, and its scene meets it."""
    made = load_case(case, {"run.rigid_hertz.start": "-1200 mm", "run.rigid_hertz.end": "1000 mm"})
    scene, settings = made.scene, made.runs["rigid_hertz"]
    own = Sensor("sleeper_acceleration").of(scene, settings)
    values = low_pass(own.values, own.rate, 1e3)[::6]
    one = replace(own, position=own.position[::6], values=values, rate=own.rate / 6)
    step = one.position[1] - one.position[0]

    def trace(apart):
        before = np.zeros(round(apart / step))
        values = np.r_[one.values, before] + np.r_[before, one.values]
        position = one.position[0] + step * (np.arange(len(values)) - len(before))
        return trace_of(
            replace(one, position=position, values=values, notes={"noise": "1 m/s^2"}), scene, settings, 0.1
        )

    with pytest.raises(RecordError, match="comes again 1[78].. mm on .* second axle .* less than 1[78].. mm apart"):
        trace(1.8)
    fact = RecordFact("far", trace(2.6))
    assert fact.misfit(fact.measured(scene, settings), FORM[0])[0] < 1


def test_a_bearer_that_hangs_is_to_be_packed(on_bearers, tmp_path):
    """Samples of the posterior as drawn here: bearer 0 has 0.1 to 0.4 of the others' ballast, bearer 1 0.9 to 1.2, the
    nose is 0.4 to 0.6 mm lower than the case's, the error of form 3 %."""
    values, sensor = np.array([0.5, 0.25, 1.05]), Sensor("casting_acceleration", place=0.35)
    truth = {"scene.crossing.nose_lowering": "0.5 mm", "scene.bearers.unlike": [0, 1]}
    truth["scene.bearers.unlike_ballast"] = [*values[1:]]
    file = write_record(tmp_path / "r.csv", on_bearers, truth, sensor, notes="# place: 350 mm\n")
    problem = state_problem(on_bearers, [file], ["scene.crossing.nose_lowering=-1 mm..1 mm"], [], "0,1", 20, None)
    (fact,), numbers, rng = problem.records, problem.numbers(values), np.random.default_rng(1)
    at = np.column_stack([rng.uniform(*one, 200) for one in ((0.7, 0.8), (0.08, 0.3), (0.7, 0.92), (0, 0.01))])
    likely = Trial(values, numbers, np.nan)
    missed = 1e-3 * np.abs(numbers).max() * rng.standard_normal((200, len(numbers)))
    emulator = Emulator(at[:, :-1], missed, np.zeros((4, len(numbers))), np.ones(3), missed)
    state = StateReport(problem, Inversion([Known(fact, emulator, np.ones(200, bool))], at, at, likely, likely, [], 0))
    nose, first, second = state.verdicts
    assert nose.startswith("**nose: weld it up**: -0.6") and first.startswith("**pack bearer 0**: its ballast has 0.1")
    assert second.startswith("**bearer 1 is carried**")
    assert all("(a verdict from 95 % on)" in one for one in state.verdicts)
    sure = replace(state.found, samples=np.r_[at, at + [0, 0.6, 0, 0]])
    assert StateReport(problem, sure).verdicts[1].startswith("**bearer 0: not known**")
    with pytest.raises(DesignError, match="fe_full has no accelerometer: leave --prove out"):
        check_proof(problem, {}, ())


@pytest.mark.validate
@pytest.mark.parametrize("seed", range(3))
def test_axle_box_and_casting_together_tell_which_bearer_hangs(on_bearers, tmp_path, seed):
    """Two files of two trains, of other mass and speed, begun at different places: of 4 unknowns at most one lies
    outside its interval, with a probability of 0.986; the bearer that hangs is to be packed, the other not."""
    rng = np.random.default_rng(seed)
    ballast, nose = rng.uniform(50, 110), rng.uniform(-0.2, 0.4)
    changes = {"scene.bearers.ballast_stiffness": f"{ballast:.6g} kN/mm", "scene.bearers.unlike": [0, 1]}
    changes |= {"scene.crossing.nose_lowering": f"{nose:.6g} mm", "scene.bearers.unlike_ballast": [0.1, 1.0]}
    other = {"scene.vehicle.wheelset_unsprung_mass": "1.6 t", "scene.speed": "62 mph"}
    noted = "".join(f"# {key}: {value}\n" for key, value in other.items())
    casting, box = Sensor("casting_acceleration", place=0.35), Sensor("axle_box_acceleration")
    files = [
        write_record(tmp_path / "a.csv", on_bearers, changes, casting, 1e4, seed=seed, notes="# place: 350 mm\n"),
        write_record(tmp_path / "b.csv", on_bearers, changes | other, box, 2e3, seed=seed + 9, notes=noted),
    ]
    find = ["scene.bearers.ballast_stiffness=40 kN/mm..120 kN/mm", "scene.crossing.nose_lowering=-0.3 mm..0.5 mm"]
    problem = state_problem(on_bearers, files, find, [], "0,1", 128, None)
    seen = invert(problem, tmp_path / "out", Workers(2), lambda _: None)
    low, high = interval(seen.samples)[:, :-1]
    truth = problem.scaled(np.array([[ballast, nose, 0.1, 1.0]]))[0]
    assert ((low <= truth) & (truth <= high)).sum() >= 3
    told = StateReport(problem, seen).verdicts
    assert any("pack bearer 0" in one for one in told) and not any("pack bearer 1" in one for one in told)


def test_the_command_finds_a_state(found, case, monkeypatch):
    """A folder with the trials that are done: the command goes on with them, and reports."""
    monkeypatch.setattr(state, "ROUNDS", 0)
    _, _, folder = found
    out = folder / "out"
    given = ["measured", str(folder / "train.csv"), str(case), "--out", str(out), "--trials", "48", "--workers", "1"]
    for text in FIND:
        given += ["--find", text]
    call(*given)
    text = (out / "inversion.md").read_text()
    assert "(scene.foundation.stiffness) | 60 kN/mm to 300 kN/mm |" in text and "chi-square, form 3 %" in text
    assert (out / "state.png").stat().st_size > 10_000
