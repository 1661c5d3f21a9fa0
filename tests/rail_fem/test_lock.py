"""One folder, one run: the second is refused, a dead one's place is taken."""

import errno
import json
import multiprocessing
import os
import signal
import subprocess
import sys

import pytest

from rail_fem.files import lock
from rail_fem.result.runfolder import RunFolderError, fingerprint, held, prepare_folder
from rail_fem.settings.explicit import FeSettings
from tests.rail_fem.test_scene import make_scene
from tests.ranks import HANGS

CASE = fingerprint("fe_full", make_scene(), FeSettings(element_size="1.5 mm"))
HOLD = "import sys, time\nfrom rail_fem.files import lock\nprint(lock.take(sys.argv[1]), flush=True)\ntime.sleep(60)"


@pytest.fixture
def other(tmp_path):
    """Another process that holds the folder."""
    with subprocess.Popen([sys.executable, "-c", HOLD, str(tmp_path)], stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout.readline() == "None\n"
        yield process
        process.kill()


def test_a_lock_that_is_a_link_costs_nobody_the_file_that_it_leads_to(tmp_path):
    (tmp_path / "precious").write_text("mine")
    (tmp_path / "run").mkdir()
    (tmp_path / "run" / lock.LOCK).symlink_to(tmp_path / "precious")
    with pytest.raises(RunFolderError, match="choose a folder that can be written"), held(tmp_path / "run"):
        pass
    assert (tmp_path / "precious").read_text() == "mine"


def test_folder_of_a_living_run_is_refused_and_untouched(tmp_path, other):
    before = (tmp_path / lock.LOCK).read_text()
    with (
        pytest.raises(RunFolderError, match=rf"process {other.pid} on .* runs there: wait until it ends") as error,
        held(tmp_path),
    ):
        pass
    assert "choose another folder" in str(error.value) and (tmp_path / lock.LOCK).read_text() == before


@pytest.mark.parametrize("reaped", [True, False])
def test_place_of_a_dead_run_is_taken(tmp_path, other, reaped):
    """Also of one that its parent has not looked after yet."""
    other.send_signal(signal.SIGKILL)
    if reaped:
        other.wait()
    else:
        os.waitid(os.P_PID, other.pid, os.WEXITED | os.WNOWAIT)
    with held(tmp_path):
        assert json.loads((tmp_path / lock.LOCK).read_text())["pid"] == os.getpid()
    assert not (tmp_path / lock.LOCK).exists()


def test_number_of_a_process_that_is_given_again_deceives_nobody(tmp_path):
    """This process's number, but begun at another time."""
    (tmp_path / lock.LOCK).write_text(json.dumps(lock.this_process() | {"began": "1"}))
    assert lock.take(tmp_path) is None
    lock.release(tmp_path)


def test_run_of_another_host_is_believed_and_the_way_out_is_said(tmp_path):
    (tmp_path / lock.LOCK).write_text(json.dumps({"host": "node17", "pid": 1, "began": "1"}))
    with (
        pytest.raises(
            RunFolderError, match=r"process 1 on node17 runs there: if it has ended there, remove .*run\.lock"
        ),
        held(tmp_path),
    ):
        pass
    assert "node17" in (tmp_path / lock.LOCK).read_text()
    lock.release(tmp_path)
    assert (tmp_path / lock.LOCK).exists()  # another's lock is not removed


@pytest.mark.parametrize("text", ["", "{", "[1]", '{"host": 3}'])
def test_lock_that_a_kill_left_in_parts_holds_nobody(tmp_path, text):
    (tmp_path / lock.LOCK).write_text(text)
    with held(tmp_path):
        pass


def try_it(folder, ready, out):
    ready.wait()
    out.put(lock.take(folder) is None)
    ready.wait()  # all have tried before one ends


@pytest.mark.parametrize("stale", [pytest.param(False, marks=pytest.mark.validate), True])
def test_of_eight_that_come_at_once_one_gets_it(tmp_path, stale):
    if stale:
        (tmp_path / lock.LOCK).write_text(json.dumps(lock.this_process() | {"began": "1"}))
    context = multiprocessing.get_context("forkserver")  # its server has no threads, and imports this file once
    context.set_forkserver_preload([__name__])
    ready, out = context.Barrier(8), context.Queue()
    runs = [context.Process(target=try_it, args=(tmp_path, ready, out)) for _ in range(8)]
    for run in runs:
        run.start()
    assert sorted(out.get(timeout=HANGS) for _ in runs) == [False] * 7 + [True]
    for run in runs:
        run.join()


def test_lock_is_no_file_of_a_run_and_outlives_the_emptying(tmp_path):
    with held(tmp_path):
        assert prepare_folder(tmp_path, CASE) is False
        (tmp_path / "history.csv").write_text("old")
        assert prepare_folder(tmp_path, CASE, overwrite=True) is False
        assert {path.name for path in tmp_path.iterdir()} == {lock.LOCK, "case.json"}


def test_leftovers_of_killed_writers_are_removed_and_nothing_else(tmp_path):
    with held(tmp_path):
        prepare_folder(tmp_path, CASE)
        left = [
            tmp_path / ".checkpoint.123.partial.npz",
            tmp_path / "fields" / ".frame_0001.99.partial.vtu",
            tmp_path / "figures" / ".force.7.partial.png",
        ]
        kept = [
            tmp_path / ".notes.2024.txt",
            tmp_path / ".partial",
            tmp_path / "fields" / "frame_0001.vtu",
            tmp_path / "a.1.partial.txt",
        ]
        for path in left + kept:
            path.parent.mkdir(exist_ok=True)
            path.write_text("")
        assert prepare_folder(tmp_path, CASE, restart=True) is True
        assert all(path.exists() for path in kept) and not any(path.exists() for path in left)


@pytest.mark.parametrize("links", [True, False])
def test_of_two_machines_one_gets_it_where_file_locks_hold_nobody(tmp_path, monkeypatch, links):
    """As on NFS, whose file locks may be each machine's own: another machine looks, too, finds nothing, and comes first
    while this one says who it is; also where there are no hard links."""
    this = lock.this_process()

    def too_late():
        (tmp_path / lock.LOCK).write_text(json.dumps({"host": "node17", "pid": 1, "began": "1"}))
        return this

    def no_link(*_):
        raise OSError(errno.EPERM, "no hard links")

    monkeypatch.setattr(lock.fcntl, "flock", lambda *_: None)
    monkeypatch.setattr(lock.os, "link", os.link if links else no_link)
    monkeypatch.setattr(lock, "this_process", too_late)
    assert (lock.take(tmp_path) or {}).get("host") == "node17"
    assert {path.name for path in tmp_path.iterdir()} == {lock.LOCK}
    (tmp_path / lock.LOCK).unlink()
    monkeypatch.setattr(lock, "this_process", lambda: this)
    assert lock.take(tmp_path) is None and lock.is_ours(tmp_path)
