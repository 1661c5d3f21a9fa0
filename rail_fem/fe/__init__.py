"""Explicit elastoplastic dynamics on dolfinx meshes: the only part that uses dolfinx and MPI.

Compiled kernels are cached in a folder named after the kernels' own source: numba looks only at the file of the function
that it caches, not at the files of those that this one calls, and would run stale code after an edit or an upgrade.
"""

import hashlib
import os
import tempfile
from pathlib import Path

import numba


def _kernel_cache() -> Path:
    digest = hashlib.sha256()
    for source in sorted(Path(__file__).parent.glob("*.py")):
        digest.update(source.read_bytes())
    home = Path(os.environ.get("XDG_CACHE_HOME", Path.home() / ".cache"))
    folder = home / "rail_fem" / digest.hexdigest()[:16]
    try:
        folder.mkdir(parents=True, exist_ok=True)
        return folder if os.access(folder, os.W_OK) else Path(tempfile.mkdtemp(prefix="rail_fem_"))
    except OSError:
        return Path(tempfile.mkdtemp(prefix="rail_fem_"))


if "NUMBA_CACHE_DIR" not in os.environ:
    numba.config.CACHE_DIR = str(_kernel_cache())
