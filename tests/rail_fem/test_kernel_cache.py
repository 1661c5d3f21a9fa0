"""Kernels are cached by their sources, so that an edited callee is never run in its old form."""

import os
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
ASK = "import os, rail_fem, geometry.path_search, numba; print(os.environ['NUMBA_CACHE_DIR']); print(numba.config.CACHE_DIR)"


def folders(root: Path, home: Path, code: str = ASK) -> list[str]:
    environment = {k: v for k, v in os.environ.items() if k != "NUMBA_CACHE_DIR"} | {"XDG_CACHE_HOME": str(home), "PYTHONPATH": str(root)}
    return subprocess.run([sys.executable, "-c", code], cwd=root, env=environment, capture_output=True, text=True, check=True).stdout.split()


def copy(to: Path) -> Path:
    for name in ("geometry", "rail_fem"):
        for source in (ROOT / name).rglob("*.py"):
            place = to / source.relative_to(ROOT)
            place.parent.mkdir(parents=True, exist_ok=True)
            place.write_bytes(source.read_bytes())
    return to


def test_an_edit_of_any_kernel_gives_another_folder(tmp_path):
    root = copy(tmp_path / "project")
    first = folders(root, tmp_path / "home")
    assert first[0] == first[1] and Path(first[0]).is_dir() and str(tmp_path) in first[0]
    assert folders(root, tmp_path / "home") == first
    with open(root / "geometry" / "crossing_surface.py", "a", encoding="utf-8") as file:
        file.write("# another line\n")
    assert folders(root, tmp_path / "home") != first


def test_numba_imported_first_is_told_too(tmp_path):
    answer = folders(ROOT, tmp_path, "import numba, rail_fem; print(numba.config.CACHE_DIR)")
    assert answer and answer[0].startswith(str(tmp_path))


def test_a_folder_of_the_users_own_is_kept(tmp_path):
    environment = os.environ | {"NUMBA_CACHE_DIR": str(tmp_path), "PYTHONPATH": str(ROOT)}
    answer = subprocess.run([sys.executable, "-c", ASK], env=environment, capture_output=True, text=True, check=True).stdout.split()
    assert answer == [str(tmp_path)] * 2
