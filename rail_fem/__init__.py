"""What happens when a wheel passes a crossing: one scene, a ladder of models, an honest error on each rung.

Compiled kernels are cached in a folder named after the sources of all kernels: numba looks only at the file of the function that it
caches, not at the files of those that this one calls, and would run stale code after an edit or an upgrade. `geometry` and `bem`, used
without `rail_fem`, leave numba's caches in their own __pycache__: delete those after an edit.
"""

import hashlib
import os
import sys
import tempfile
from pathlib import Path

PACKAGES = "geometry", "bem", "rail_fem"


def _kernel_cache() -> Path:
    digest = hashlib.sha256()
    for source in sorted(path for name in PACKAGES for path in (Path(__file__).parents[1] / name).rglob("*.py")):
        text = source.read_bytes()
        if b"numba" in text:
            digest.update(text)
    home = Path(os.environ.get("XDG_CACHE_HOME", Path.home() / ".cache"))
    folder = home / "rail_fem" / digest.hexdigest()[:16]
    try:
        folder.mkdir(parents=True, exist_ok=True)
        return folder if os.access(folder, os.W_OK) else Path(tempfile.mkdtemp(prefix="rail_fem_"))
    except OSError:
        return Path(tempfile.mkdtemp(prefix="rail_fem_"))


if "NUMBA_CACHE_DIR" not in os.environ:
    os.environ["NUMBA_CACHE_DIR"] = str(_kernel_cache())  # not by importing numba: VTK does not bear it loaded first
    if "numba" in sys.modules:
        sys.modules["numba"].config.CACHE_DIR = os.environ["NUMBA_CACHE_DIR"]
