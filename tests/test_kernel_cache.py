"""A cached kernel belongs to the sources it was made from: an edited callee is never run in its old form, by any
package, command or test."""

import hashlib
import os
import pickle
import platform
import re
import shutil
import stat
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest

import kernel_cache

ROOT = Path(__file__).resolve().parents[1]


def answer(code: str, root: Path, **settings: str) -> str:
    environment = (
        {name: value for name, value in os.environ.items() if name != "NUMBA_CACHE_DIR"}
        | {"PYTHONPATH": str(root)}
        | settings
    )
    run = subprocess.run([sys.executable, "-c", code], cwd=root, env=environment, capture_output=True, text=True)
    assert run.returncode == 0, run.stderr
    return run.stdout


def copy_of_geometry(to: Path) -> Path:
    shutil.copytree(ROOT / "geometry", to / "geometry", ignore=shutil.ignore_patterns("__pycache__"))
    shutil.copy(ROOT / "kernel_cache.py", to)
    return to


def one_kernel(root: Path) -> str:
    """A project of one kernel; code that calls it and prints its value and whether it was read from the cache."""
    (root / "geometry").mkdir(parents=True)
    shutil.copy(ROOT / "kernel_cache.py", root)
    (root / "geometry" / "one.py").write_text(
        "from kernel_cache import njit\n\n@njit(cache=True)\ndef height(x):\n    return x\n"
    )
    return "from geometry.one import height; print(height(1.0), sum(height.stats.cache_hits.values()))"


def test_a_kernel_that_numba_cannot_keep_runs_and_is_told_of(tmp_path):
    """A large global array, or any kernel without optimization (NUMBA_OPT=0)."""
    (tmp_path / "geometry").mkdir()
    shutil.copy(ROOT / "kernel_cache.py", tmp_path)
    (tmp_path / "geometry" / "one.py").write_text(
        "import numpy as np\nfrom kernel_cache import njit\n\nMANY = np.ones(1_000_000)\n\n"
        "@njit(cache=True)\ndef height(i):\n    return MANY[i]\n"
    )
    code = "import warnings; warnings.simplefilter('error'); from geometry.one import height"
    told = f"{code}\ntry: height(3)\nexcept Warning as w: print(type(w).__name__)"
    assert answer(told, tmp_path, NUMBA_CACHE_DIR=str(tmp_path / "kernels")) == "NumbaWarning\n"


def test_an_edited_callee_is_never_run_in_its_old_form(tmp_path):
    """A kernel of one file calls one of another; the callee is edited; the caller's cache is not asked, and both caches
    lie outside the sources."""
    root, home = tmp_path / "project", str(tmp_path / "home")
    (root / "geometry").mkdir(parents=True)
    shutil.copy(ROOT / "kernel_cache.py", root)
    (root / "geometry" / "callee.py").write_text(
        "from kernel_cache import njit\n\n@njit(cache=True)\ndef height(x):\n    return x\n"
    )
    (root / "geometry" / "caller.py").write_text(
        "from kernel_cache import njit\nfrom geometry.callee import (\n    height,\n)\n\n@njit(cache=True)\ndef"
        " twice(x):\n    return 2 * height(x)\n"
    )
    ask = "from geometry.caller import twice; print(twice(1.0), sum(twice.stats.cache_hits.values()))"
    assert answer(ask, root, XDG_CACHE_HOME=home).split() == ["2.0", "0"]
    assert answer(ask, root, XDG_CACHE_HOME=home).split() == ["2.0", "1"]
    callee = root / "geometry" / "callee.py"
    callee.write_text(callee.read_text().replace("return x", "return x + 1"))
    assert answer(ask, root, XDG_CACHE_HOME=home).split() == ["4.0", "0"]
    assert not list(root.rglob("*.nbc")) and list(Path(home).rglob("*.nbc"))


def test_a_class_in_a_kernels_signature_may_go(tmp_path):
    """The index of cached kernels names the classes of their signatures: after one is renamed the index of before must
    not be read."""
    root, home = tmp_path / "project", str(tmp_path / "home")
    (root / "geometry").mkdir(parents=True)
    shutil.copy(ROOT / "kernel_cache.py", root)
    module = root / "geometry" / "places.py"
    module.write_text(
        "from typing import NamedTuple\nfrom kernel_cache import njit\n\nclass Place(NamedTuple):\n    x: float\n\n"
        "@njit(cache=True)\ndef inner(place):\n    return place.x\n\n@njit(cache=True)\ndef height(x):\n    return"
        " inner(Place(x))\n"
    )
    ask = "from geometry.places import height; print(height(1.0), sum(height.stats.cache_hits.values()))"
    assert answer(ask, root, XDG_CACHE_HOME=home).split() == ["1.0", "0"]
    module.write_text(module.read_text().replace("Place", "Position"))
    assert answer(ask, root, XDG_CACHE_HOME=home).split() == ["1.0", "0"]
    assert answer(ask, root, XDG_CACHE_HOME=home).split() == ["1.0", "1"]


def test_a_real_kernel_notices_its_callee_and_not_a_stranger(tmp_path):
    root = copy_of_geometry(tmp_path / "project")
    ask = (
        "import kernel_cache; from pathlib import Path;"
        " print(kernel_cache.digest(Path('geometry/contact/gap_kernel.py').resolve()))"
    )
    first = answer(ask, root)
    with open(root / "geometry" / "contact" / "conicity.py", "a", encoding="utf-8") as file:
        file.write("# nothing that the kernel imports\n")
    assert answer(ask, root) == first
    with open(root / "geometry" / "contact" / "wheel_outline.py", "a", encoding="utf-8") as file:
        file.write("# a callee\n")
    assert answer(ask, root) != first


def test_every_kernel_is_declared_under_the_one_rule():
    """No file of the packages takes its compiler from numba directly."""
    direct = re.compile(
        r"numba\.(njit|jit|vectorize|guvectorize|cfunc)|from numba import .*\b(njit|jit|vectorize|guvectorize|cfunc)\b"
    )
    others = [
        path
        for name in kernel_cache.PACKAGES
        for path in (ROOT / name).rglob("*.py")
        if direct.search(path.read_text(encoding="utf-8"))
    ]
    assert not others


def test_imports_are_found_in_every_form_that_the_sources_use():
    """Against Python's own account: what importing a kernel's file really loads from the packages lies in its
    sources."""
    for module in (
        "geometry.contact.gap_kernel",
        "bem.slices.prism_kernel",
        "rail_fem.contact.load_kernel",
        "rail_fem.passes.wheelset_dynamics",
    ):
        code = (
            f"import sys, {module}; print(*[m.__file__ for n, m in sys.modules.items() if n.partition('.')[0] in"
            " ('geometry', 'bem', 'rail_fem')])"
        )
        loaded = {Path(name).resolve() for name in answer(code, ROOT).split() if not name.endswith("__init__.py")}
        assert loaded <= set(kernel_cache.sources(ROOT / (module.replace(".", "/") + ".py")))


def test_a_folder_of_the_users_own_is_kept(tmp_path):

    assert answer(
        "import kernel_cache; print(kernel_cache.folder())", ROOT, NUMBA_CACHE_DIR=str(tmp_path / "mine")
    ).strip() == str(tmp_path / "mine")


def test_a_read_only_home_does_not_stop_the_kernels(tmp_path):
    (tmp_path / "home").write_text("a file where a folder should be")
    assert (
        answer(
            "import kernel_cache; print(kernel_cache.folder().is_dir())", ROOT, XDG_CACHE_HOME=str(tmp_path / "home")
        ).strip()
        == "True"
    )


def test_checkouts_of_the_same_sources_share_their_kernels(tmp_path):
    home = str(tmp_path / "home")
    for name, read in (("one", "0"), ("two", "1")):
        assert answer(one_kernel(tmp_path / name), tmp_path / name, XDG_CACHE_HOME=home).split() == ["1.0", read]


def test_kernels_are_kept_for_the_user_alone(tmp_path):
    ask = one_kernel(tmp_path / "project")
    answer(ask, tmp_path / "project", XDG_CACHE_HOME=str(tmp_path / "home"))
    home = tmp_path / "home" / "rail_fem" / "kernels"
    assert stat.S_IMODE(home.stat().st_mode) == 0o700
    assert {stat.S_IMODE(path.stat().st_mode) for path in home.rglob("*.nb?")} == {0o600}


CUT, FLIPPED = lambda b: b[: len(b) // 2], lambda b: b[:-9] + bytes([b[-9] ^ 1]) + b[-8:]


@pytest.mark.parametrize("damage", [CUT, FLIPPED])
def test_a_damaged_kernel_is_compiled_anew(tmp_path, damage):
    """Cut, or with one bit flipped: the run goes on, and the next one reads what this one wrote."""
    home, root = str(tmp_path / "home"), tmp_path / "project"
    ask = one_kernel(root)
    answer(ask, root, XDG_CACHE_HOME=home)
    (file,) = Path(home).rglob("*.nbc")
    file.write_bytes(damage(file.read_bytes()))
    assert answer(ask, root, XDG_CACHE_HOME=home).split() == ["1.0", "0"]
    assert answer(ask, root, XDG_CACHE_HOME=home).split() == ["1.0", "1"]


class Trap:
    """Leaves a file where it is read by pickle."""

    def __init__(self, file: Path):
        self.file = str(file)

    def __reduce__(self):
        return (open, (self.file, "w"))


@pytest.mark.parametrize("writable", ["folder", "file"])
def test_a_cache_that_others_may_write_is_not_read(tmp_path, writable):
    """A stranger's pickle, with the seal that anybody can compute, where others may write."""
    home, root = tmp_path / "home", tmp_path / "project"
    ask = one_kernel(root)
    answer(ask, root, NUMBA_CACHE_DIR=str(home))
    (file,) = home.rglob("*.nbc")
    content = pickle.dumps(Trap(tmp_path / "executed"))
    file.write_bytes(hashlib.sha256(content).digest() + content)
    (home if writable == "folder" else file).chmod(0o777)
    assert answer(ask, root, NUMBA_CACHE_DIR=str(home)).split() == ["1.0", "0"]
    assert not (tmp_path / "executed").exists()


def test_signatures_compiled_at_once_are_each_kept_under_their_own(tmp_path):
    """Two processes add two signatures of one kernel to the same folder at the same time."""
    for turn in range(50):
        start, keys = threading.Barrier(2), ("of floats", "of integers")

        def add(key, start=start, turn=turn):
            files = kernel_cache.SealedFiles(str(tmp_path), f"kernel{turn}", "sources")
            start.wait()
            files.save(key, f"code {key}")

        writers = [threading.Thread(target=add, args=(key,)) for key in keys]
        for writer in writers:
            writer.start()
        for writer in writers:
            writer.join()
        read = kernel_cache.SealedFiles(str(tmp_path), f"kernel{turn}", "sources")
        assert [read.load(key) for key in keys] == [f"code {key}" for key in keys]


def test_kernels_of_long_ago_are_removed(tmp_path):
    """What nobody asked for in a month goes, and of one file all but the latest; what is not ours stays."""
    home, root = tmp_path / "home", tmp_path / "project"
    ask = one_kernel(root)
    for age, name in enumerate(["other_" + 16 * "0", "notes", *(f"one_{number:016x}" for number in range(9))]):
        (home / name).mkdir(parents=True)
        os.utime(home / name, (time.time() - age * 3600,) * 2)
    os.utime(home / ("other_" + 16 * "0"), (0, 0))
    answer(ask, root, NUMBA_CACHE_DIR=str(home))
    left = {path.name for path in home.iterdir()}
    assert "notes" in left and len(left) == 1 + kernel_cache.VERSIONS
    assert f"one_{0:016x}" in left and f"one_{7:016x}" not in left


def test_kernels_take_the_whole_vectors_of_a_processor_or_those_that_the_user_says():
    """The machine code of a loop has registers of 512 bits where the processor has them, which LLVM alone leaves unused
    on Intel's; with the user's own features it is as they say."""
    code = (
        "import llvmlite.binding as llvm\nfrom kernel_cache import njit\n\n@njit\ndef scale(a):\n"
        "    for i in range(a.size):\n        a[i] = 3.0 * a[i] + 1.0\n\nscale.compile('void(float64[::1])')\n"
        "print(llvm.get_host_cpu_features().get('avx512f', False), 'zmm' in next(iter(scale.inspect_asm().values())))"
    )
    has_them, takes_them = answer(code, ROOT).split()
    assert has_them == takes_them
    if platform.machine() == "x86_64":
        assert answer(code, ROOT, NUMBA_CPU_NAME="haswell", NUMBA_CPU_FEATURES="+avx,+avx2,+fma").split()[1] == "False"
    assert kernel_cache.whole_vectors("+avx2,+avx512f") == "+avx2,+avx512f,-prefer-256-bit"
    assert kernel_cache.whole_vectors("+avx2,-avx512f") == "+avx2,-avx512f"
