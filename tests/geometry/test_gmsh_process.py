"""Gmsh's child: knows no MPI, is shared and ends, and its faults come back as errors of one mesh."""

import os
import signal
import sys
import time

import numpy as np
import pytest

from geometry.meshing import gmsh_process as module
from geometry.meshing.gmsh_fill import _check_simple, fill_with_quads, inner_angles
from geometry.meshing.gmsh_process import gmsh_process, in_gmsh_process
from geometry.meshing.hexmesh import MeshError

SQUARE = np.array([[0, 0], [1, 0], [2, 0], [2, 1], [2, 2], [1, 2], [0, 2], [0, 1]], float)


def loaded(name: str) -> bool:
    """In the child: whether a module is loaded there."""
    return name in sys.modules


def test_a_square_of_four_quadrilaterals_comes_back_without_gmsh_in_this_process():
    before = "gmsh" in sys.modules  # another test of this process may have needed it
    points, quads = fill_with_quads(SQUARE, 1.0, inner_angles(SQUARE)[None])
    assert np.array_equal(points[:8], SQUARE) and len(quads) == 4
    corners = points[quads]
    turned = np.roll(corners, -1, axis=1)
    area = 0.5 * (corners[..., 0] * turned[..., 1] - corners[..., 1] * turned[..., 0]).sum(axis=1)
    assert (area > 0).all() and area.sum() == pytest.approx(4.0, rel=1e-12)
    assert ("gmsh" in sys.modules) == before


def test_the_child_knows_no_mpi(monkeypatch):
    monkeypatch.setenv("OMPI_COMM_WORLD_SIZE", "2")
    monkeypatch.setenv("PMIX_RANK", "0")
    monkeypatch.setenv("KEPT", "yes")
    with gmsh_process():
        assert [in_gmsh_process(os.getenv, name) for name in ("OMPI_COMM_WORLD_SIZE", "PMIX_RANK", "KEPT")] == [
            None,
            None,
            "yes",
        ]
        assert not in_gmsh_process(loaded, "mpi4py") and not in_gmsh_process(loaded, "numba")


def test_one_child_serves_all_inside_and_is_gone_outside():
    with gmsh_process():
        first = in_gmsh_process(os.getpid)
        with gmsh_process():
            assert in_gmsh_process(os.getpid) == first != os.getpid()
        assert in_gmsh_process(os.getpid) == first
    with pytest.raises(ProcessLookupError):
        os.kill(first, 0)
    assert in_gmsh_process(os.getpid) != first


def test_errors_of_the_child_are_raised_here_with_their_kind_and_words():
    bow_tie = np.array([[0, 0], [1, 1], [1, 0], [0, 1]], float)
    with gmsh_process():
        with pytest.raises(MeshError, match=r"crosses itself near"):
            in_gmsh_process(_check_simple, bow_tie)
        with pytest.raises(ModuleNotFoundError, match="module_that_is_absent"):
            in_gmsh_process(__import__, "module_that_is_absent")
        assert in_gmsh_process(abs, -2.0) == 2.0


@pytest.mark.parametrize(
    "ends, said",
    [
        ((os.abort,), "by SIGABRT"),
        ((os._exit, 3), "with exit code 3"),
        ((signal.raise_signal, signal.SIGKILL), "by SIGKILL"),
    ],
)
def test_a_gmsh_that_dies_is_an_error_of_one_mesh(ends, said):
    with gmsh_process():
        with pytest.raises(MeshError, match=f"Gmsh's process ended {said}; mend the file .* change the element sizes"):
            in_gmsh_process(*ends)
        assert len(fill_with_quads(SQUARE, 1.0, inner_angles(SQUARE)[None])[1]) == 4


def test_a_gmsh_that_hangs_is_ended(monkeypatch):
    monkeypatch.setattr(module, "LONGEST", 0.3)
    with pytest.raises(MeshError, match="without an answer in 0.3 s"):
        in_gmsh_process(time.sleep, 600.0)


def read_without_end() -> None:
    with module.reading():
        while True:
            pass


def test_a_file_that_is_read_for_ever_ends_with_the_child(monkeypatch):
    """By the processor's time, which a busy machine does not shorten; the bound goes with the child."""
    source = "from geometry.meshing import gmsh_process as m; m.LONGEST_READING = 0.2; m.serve()"
    command = module.subprocess.Popen
    monkeypatch.setattr(module.subprocess, "Popen", lambda words, **rest: command([*words[:-1], source], **rest))
    with pytest.raises(MeshError, match="without having read the file in 60 s of processor time; mend the file"):
        in_gmsh_process(read_without_end)


def read_without_measure() -> None:
    with module.reading():
        np.zeros(module.MOST_MEMORY, dtype=np.int8)  # more than is left beside the interpreter's own


def test_a_file_that_takes_all_memory_is_refused_and_the_child_lives():
    """Zeros that nobody touches: what the system promises, before a page of it is filled."""
    with gmsh_process():
        with pytest.raises(MeshError, match="the file takes more than .* GB, half of the memory, to read"):
            in_gmsh_process(read_without_measure)
        assert in_gmsh_process(len, [1, 2]) == 2


def test_what_a_child_prints_does_not_disturb_its_answers():
    assert in_gmsh_process(os.write, 1, b"Info    : printed by a library\n") > 0
    assert in_gmsh_process(print, "and by Python") is None
