import io
import json
import subprocess
import sys
import threading

import pytest

from rail_fem.files import lock
from rail_fem.processes import progress as module
from rail_fem.processes.progress import Progress, duration, read_status, write_status


class Terminal(io.StringIO):
    def isatty(self):
        return True


@pytest.fixture
def clock(monkeypatch):
    """A clock that the test turns."""
    now = [100.0]
    monkeypatch.setattr(module, "_clock", lambda: now[0])
    monkeypatch.setattr(module.time, "monotonic", lambda: now[0])
    return now


def test_status_file_says_percent_eta_step_and_energy_balance(tmp_path, clock):
    with Progress(tmp_path, stream=io.StringIO()) as progress:
        progress.update(step=0, time=0.0, end_time=10e-3)
        clock[0] += 30.0
        progress.update(step=250, time=2.5e-3, end_time=10e-3, energy_balance=0.004)
        status = read_status(tmp_path)
        assert (status["state"], status["percent"], status["step"]) == ("running", 25.0, 250)
        assert status["energy_balance"] == 0.004
        assert status["eta"] == pytest.approx(90.0)  # a quarter took 30 s
    status = read_status(tmp_path)
    assert (status["state"], status["percent"], status["eta"]) == ("finished", 100.0, 0.0)


def test_what_goes_on_before_the_first_step_is_told_now_and_then(tmp_path, clock):
    stream = io.StringIO()
    with Progress(tmp_path, stream=stream) as progress:
        for step in range(0, 1000, 10):
            progress.before_the_first_step(f"static contact: step {step}")
            clock[0] += 1.0
        status = read_status(tmp_path)
        assert status["percent"] == 0.0 and status["eta"] is None and "static contact: step 9" in status["message"]
        progress.update(step=1, time=1e-4, end_time=1e-3)
    lines = [line for line in stream.getvalue().splitlines() if "static contact" in line]
    assert 2 <= len(lines) <= 20


def test_the_log_hears_at_least_every_ten_seconds_of_what_goes_on_before_a_step(clock):
    """A mesh is made, kernels are compiled: nobody but a thread can speak. Once steps tell of themselves it is silent,
    until something else than steps goes on."""
    stream = io.StringIO()
    with Progress(None, stream=stream) as progress:
        progress.note("mesh of 2 mm")
        for _ in range(60):
            clock[0] += 1.0
            progress._tell_what_goes_on()
        lines = stream.getvalue().splitlines()
        assert len(lines) >= 6 and lines[-1].startswith("mesh of 2 mm (") and lines[-1].endswith(" s)")
        progress.update(step=1, time=0.0, end_time=1.0)
        clock[0] += 20.0
        progress._tell_what_goes_on()
        assert len(stream.getvalue().splitlines()) == len(lines) + 1  # the step's own
        progress.note("pass 2")
        clock[0] += 10.0
        progress._tell_what_goes_on()
        assert stream.getvalue().splitlines()[-1].startswith("pass 2 (")


def test_a_thread_tells_it_while_the_run_itself_is_silent(monkeypatch):
    spoken = threading.Event()

    class Log(io.StringIO):
        def write(self, text):
            spoken.set()
            return super().write(text)

    monkeypatch.setattr(module, "BEFORE_STEPS", 0.0)
    with Progress(None, stream=Log(), interval=1e-3):
        assert spoken.wait(60.0)


def test_parts_of_a_run_share_its_percent_and_each_tells_its_pace(tmp_path, clock):
    """A twin that is a tenth of the work, then the run; eta by the pace of what runs, without the meshing before it."""
    with Progress(tmp_path, stream=io.StringIO(), interval=0.0) as progress:
        with progress.part(0.0, 0.1, "coarse twin"):
            clock[0] += 500.0  # meshing
            progress.update(step=0, time=0.0, end_time=1.0)
            clock[0] += 5.0
            progress.update(step=50, time=0.5, end_time=1.0)
            status = read_status(tmp_path)
            assert (status["percent"], status["message"]) == (5.0, "coarse twin")
            assert status["eta"] == pytest.approx(95.0)  # a twentieth took 5 s
        with progress.part(0.1, 1.0):
            clock[0] += 500.0
            progress.update(step=0, time=0.0, end_time=1.0)
            assert read_status(tmp_path)["percent"] == 10.0 and read_status(tmp_path)["eta"] is None
            clock[0] += 45.0
            progress.update(step=500, time=0.5, end_time=1.0)
            status = read_status(tmp_path)
            assert (status["percent"], status["eta"], status["message"]) == (55.0, pytest.approx(45.0), "")


def test_eta_of_a_restart_counts_only_what_was_done_since(tmp_path, clock):
    with Progress(tmp_path, stream=io.StringIO()) as progress:
        progress.update(step=800, time=8e-3, end_time=10e-3)
        clock[0] += 10.0
        progress.update(step=900, time=9e-3, end_time=10e-3)
        assert read_status(tmp_path)["eta"] == pytest.approx(10.0)


def test_status_file_is_not_written_more_often_than_every_interval(tmp_path, clock):
    with Progress(tmp_path, stream=io.StringIO(), interval=2.0) as progress:
        for step in range(100):
            clock[0] += 0.01
            progress.update(step=step, time=step * 1e-5, end_time=1e-3)
        assert read_status(tmp_path)["step"] == 0
        clock[0] += 2.0
        progress.update(step=100, time=1e-3, end_time=1e-3)
        assert read_status(tmp_path)["step"] == 100


@pytest.mark.parametrize(
    "failure, state, said",
    [(ValueError("unstable at x = 0.3 m"), "failed", "unstable at x"), (KeyboardInterrupt(), "stopped", "--restart")],
)
def test_status_file_says_how_a_run_ended(tmp_path, failure, state, said):
    with pytest.raises(type(failure)):
        with Progress(tmp_path, stream=io.StringIO()) as progress:
            progress.update(step=3, time=1e-4, end_time=1e-3, energy_balance=float("nan"))
            raise failure
    status = read_status(tmp_path)
    assert (
        status["state"] == state
        and said in status["message"]
        and status["percent"] == 10.0
        and status["energy_balance"] is None
    )


def test_log_gets_plain_lines_and_terminal_gets_a_bar(tmp_path):
    log, terminal = io.StringIO(), Terminal()
    for stream in (log, terminal):
        with Progress(None, title="pass", stream=stream) as progress:
            progress.note("mesh: 1000 cells")
            progress.update(step=5, time=5e-4, end_time=1e-3, energy_balance=0.001)
    assert log.getvalue().splitlines() == [
        "mesh: 1000 cells",
        " 50.0 %  step 5  t 0.500 ms  energy balance 0.10 %  eta unknown",
    ]
    assert "\x1b" not in log.getvalue() and "\x1b" in terminal.getvalue() and "mesh: 1000 cells" in terminal.getvalue()


def test_ranks_other_than_the_root_write_nothing(tmp_path):
    stream = io.StringIO()
    with Progress(tmp_path, active=False, stream=stream) as progress:
        progress.update(step=1, time=0.5, end_time=1.0)
        progress.note("never seen")
    assert not list(tmp_path.iterdir()) and not stream.getvalue()


def test_status_file_is_always_whole(tmp_path):
    with Progress(tmp_path, stream=io.StringIO(), interval=0.0) as progress:
        for step in range(50):
            progress.update(step=step, time=step / 49, end_time=1.0)
            json.loads((tmp_path / "status.json").read_text())
    assert [path.name for path in tmp_path.iterdir()] == ["status.json"]


def test_durations_are_read_at_a_glance():
    assert [duration(seconds) for seconds in (45, 720, 12240)] == ["45 s", "12 min", "3.4 h"]


def test_run_whose_process_is_gone_is_seen_as_dead(tmp_path):
    """Of another host nobody here can know."""
    done = subprocess.Popen([sys.executable, "-c", ""])
    done.wait()
    gone = lock.this_process() | {"pid": done.pid}
    write_status(tmp_path, {"state": "running", "percent": 12.0, "step": 7, **gone})
    assert read_status(tmp_path)["state"] == "died" and "go on with --restart" in read_status(tmp_path)["message"]
    for state, owner in (
        ("running", lock.this_process()),
        ("running", gone | {"host": "elsewhere"}),
        ("finished", gone),
    ):
        write_status(tmp_path, {"state": state, **owner})
        assert read_status(tmp_path)["state"] == state


@pytest.mark.parametrize("text", ["", "{", "[]", "{}", '"running"', '{"state": "running", "pid": "x", "host": "HOST"}'])
def test_damaged_status_is_named(tmp_path, text):
    (tmp_path / "status.json").write_text(text.replace("HOST", lock.this_process()["host"]))
    with pytest.raises(ValueError, match=r"status.json: damaged .* gone on with by --restart"):
        read_status(tmp_path)


def test_status_is_written_without_room_for_a_second_file(tmp_path, monkeypatch):
    """A full disk: no new file can be made, the one that is there can be written over."""
    write_status(tmp_path, {"state": "running", "message": "x" * 100})

    def full(path, text):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(module, "write_text_atomically", full)
    write_status(tmp_path, {"state": "failed"})
    assert read_status(tmp_path)["state"] == "failed"
    (tmp_path / "status.json").unlink()
    with pytest.raises(OSError, match="No space left"):
        write_status(tmp_path, {"state": "failed"})
