"""A pass on a simulated card against the processor's kernels, and its kernels compiled for real ones."""

import os
import re
import shutil
import subprocess
import sys
from importlib.util import find_spec
from types import SimpleNamespace

import numpy as np
import pytest

from rail_fem.case.casefile import load_case
from rail_fem.fe.card.fits import room_on_card, unfit_for_card
from rail_fem.fe.run import CHECK_EVERY, Run
from rail_fem.result.result import load
from tests.fe.card_job import Job, by_card, by_processor
from tests.fe.card_pass import run as run_pass

WHOLE, WINDOW = Job(20), Job(20, window=1)
AGAIN = Job(20, every=5, anew=1)
LAWS = [Job(6, steel="kinematic"), Job(6, steel="cyclic")]
FULL = [Job(6, element="full", steel="isotropic"), Job(6, element="full", steel="cyclic")]
# 20 steps of sums of some ten terms, each to 2e-16, in which what is left is down to a hundredth of the terms
ROUND_OFF = 1e-12
# of forces, differences of stresses that are a thousand times their sum, and of works
OF_SUMS = 1e-9


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("card")


def apart(one: dict, other: dict) -> dict[str, float]:
    """Largest difference of each quantity over the largest entry."""
    return {
        name: float(np.nan_to_num(np.abs(one[name] - there)[np.isfinite(there)].max(initial=0.0)))
        / float(max(np.abs(there[np.isfinite(there)]).max(initial=0.0), 1e-300))
        for name, there in other.items()
    }


@pytest.fixture(scope="module")
def by_cards(folder):
    """Of all jobs, by one process."""
    return by_card(folder, [WHOLE, WINDOW, AGAIN, *LAWS, *FULL])


@pytest.mark.parametrize("job", [WHOLE, WINDOW], ids=["whole", "window"])
def test_the_card_makes_the_steps_of_the_processor(job, by_cards):
    """Positions, stresses, contact forces, works, groups and springs, what is recorded, to round-off; a block that
    flows under a rolling cap with friction and free spin."""
    assert_same_steps(by_cards, job)


@pytest.mark.parametrize("job", LAWS, ids=lambda job: job.steel)
def test_the_card_has_every_return_law(job, by_cards):
    """Back stresses that turn with the steel, of one point an element."""
    expected = assert_same_steps(by_cards, job)
    assert np.abs(expected["back"]).max() > 0


@pytest.mark.parametrize("job", FULL, ids=lambda job: job.steel)
def test_the_card_has_the_element_of_eight_points(job, by_cards):
    expected = assert_same_steps(by_cards, job)
    assert (np.abs(expected["back"]).max(initial=0.0) > 0) == (job.steel == "cyclic")


def assert_same_steps(by_cards, job):
    expected, found = by_processor(job), by_cards[job]
    assert expected["plastic strain"].max() > 0 and expected["contact normal_force"].max() > 0  # it flows and carries
    assert np.array_equal(found["active"], expected["active"])
    off = apart(found, expected)
    limits = {name: ROUND_OFF if name in ("x", "v", "position", "state", "back") else OF_SUMS for name in off}
    assert {name: value for name, value in off.items() if not value <= limits[name]} == {}
    return expected


def test_the_card_makes_the_same_bits_however_it_is_looked_at(by_cards):
    """Looked at every 7 steps, or every 5 and given all anew from what was read, as by a restart: a step reads nothing
    that is not read back, and sums come in one order."""
    once, again = by_cards[WHOLE], by_cards[AGAIN]
    names = ("x", "v", "force", "state", "contact force", "contact slip", "wheel spin", "plate velocity")
    assert all(np.array_equal(once[name], again[name]) for name in names)


def test_a_case_that_a_card_does_not_take_is_refused_with_what_it_lacks(monkeypatch):
    """Before any mesh is made; elements of eight points it takes, with room for their state: 64 numbers for 20."""
    monkeypatch.setattr("rail_fem.fe.card.device.missing", lambda: "")
    on_card = {"run.fe_full.device": "cuda"}
    one, full = (
        load_case("nose_transfer", on_card | {"run.fe_full.element": element}) for element in ("one-point", "full")
    )
    assert unfit_for_card(full.scene, full.runs["fe_full"], 1) == []
    (why,) = unfit_for_card(full.scene, full.runs["fe_full"], 2)
    assert "2 ranks" in why and 'take "cpu"' in why
    more = room_on_card(1.0, full.scene, full.runs["fe_full"]) - room_on_card(1.0, one.scene, one.runs["fe_full"])
    assert more == pytest.approx(8 * 44, abs=1e-3)  # of half a gigabyte more


def test_a_card_stops_wherever_a_run_looks():
    """Rows, frames, checks, the end of settling and the last step fall on the same steps as one by one."""

    def walk(one_by_one: bool) -> list[tuple[int, str]]:
        run = object.__new__(Run)
        run.dynamics, run.dt, run.settled = SimpleNamespace(time=0.0, step_count=0), 1.3e-7, False
        run.settings = SimpleNamespace(max_steps=777, settle_time=3.33e-5)
        run.passage = SimpleNamespace(running=SimpleNamespace(duration=1.0))
        run.next_row, run.next_frame, seen, d = 1e-5, 2.5e-5, [], run.dynamics
        while d.step_count < run.settings.max_steps:
            if not run.settled and d.time >= run.settings.settle_time:
                run.settled = True
                seen.append((d.step_count, "let go"))
            for _ in range(1 if one_by_one else run._steps_to_a_look()):
                d.time += run.dt
                d.step_count += 1
            if d.time >= run.next_row:
                run.next_row += 1e-5
                seen.append((d.step_count, "row"))
            if d.step_count % CHECK_EVERY == 0:
                seen.append((d.step_count, "check"))
            if d.time >= run.next_frame:
                run.next_frame += 2.5e-5
                seen.append((d.step_count, "frame"))
        return [*seen, (d.step_count, "end")]

    assert walk(True) == walk(False) and len(walk(True)) > 25


@pytest.mark.validate
def test_card_and_cores_go_on_from_the_restart_file_of_the_other(folder):
    """A pass of the whole model that cores begin, the card goes on with and cores end, beside one by cores alone: all
    of its history, every verdict. Forces and works of bodies are differences of stresses a thousand times as large, the
    balance one of energies a thousand times as large again: ROUND_OFF times that, at the most."""
    assert_same_pass(folder, (("cpu", 80),), (("cpu", 40), ("cuda", 60), ("cpu", 80)))


@pytest.mark.validate
def test_a_thousand_steps_of_the_card_are_those_of_the_processor(folder):
    """A pass of the whole model up to the nose: all of its history to 1e-9, every verdict."""
    assert_same_pass(folder, (("cpu", 1000),), (("cuda", 1000),))


def assert_same_pass(folder, *ways):
    """ways : of each pass, the device of each part and the step at which it ends"""
    results = []
    for parts in ways:
        below = folder / "_".join(f"{device}{steps}" for device, steps in parts)
        for device, steps in parts:
            run_pass(device, below, steps)
        results.append(load(below))
    expected, found = results
    off = apart(found.history, expected.history)
    assert {name: value for name, value in off.items() if not value <= OF_SUMS} == {}
    verdicts = [[(row["name"], row["verdict"]) for row in one.trust["rows"]] for one in (found, expected)]
    assert verdicts[0] == verdicts[1] and expected.history["force"].max() > 0


COMPILER = shutil.which("ptxas")
# stored and loaded again by a thread of these kernels [B]: by ptxas 13.0 for 9.0, and half as much again for others
SPILLED = {"advance_element_cyclic": 216, "advance_full_element_cyclic": 618}


@pytest.mark.validate
@pytest.mark.skipif(find_spec("numba_cuda") is None or COMPILER is None, reason="needs numba-cuda and ptxas")
@pytest.mark.parametrize("capability", ["8.0", "9.0"])
def test_kernels_compile_for_cards_with_few_spills(capability, folder):
    """What a thread holds stays in registers, 255 at most, and in the blocks of 512 threads 128, but where SPILLED says
    how much does not."""
    command = [sys.executable, "-m", "tests.fe.card_ptx", capability, str(folder)]
    answer = subprocess.run(command, capture_output=True, text=True, timeout=3600, env=os.environ.copy())
    assert answer.returncode == 0, answer.stderr[-800:]
    found = re.findall(r"(\w+): (\d+) registers, (\d+) B spilled", answer.stdout)
    assert len(found) == 13
    assert all(int(spilled) <= SPILLED.get(name, 0) for name, _, spilled in found)
    assert all(int(registers) <= (128 if name in ("groups", "contact") else 255) for name, registers, _ in found)
