"""Are results the same to the last bit? python tests/same_results.py --against CHECKOUT [--only WORD]

Runs the light cases below by the program of this checkout and of another one (its .venv, where it has one; the cases
are this one's) and compares every array that both write, bit by bit. Says what differs, by how much, and ends with 1;
arrays that only one of them writes are named. Without --against: prints a digest of each run. Times and wall clocks are
left out. Some five minutes of a core for each checkout with its kernels compiled.
"""

import argparse
import hashlib
import os
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parent.parent
THESIS = [str(path) for path in sorted((ROOT / "cases/thesis").glob("case_*.toml"))]
CASE, OTHER = "cases/nose_transfer.toml", "cases/thesis/case_02.toml"
LIGHT = ["--model", "p2_formula", "--model", "rigid_hertz"]
SHORT = ["element_size=5 mm", "element_aspect=1", "wheel_element_ratio=1", "error_twin=false", "end=325 mm"]
WHEELSET = ["degrees_of_freedom=lateral_roll", "start=250 mm", "end=400 mm", "path_spacing=5 mm", "lateral_range=8 mm"]


def sets(model: str, values: list[str]) -> list[str]:
    """Options of a command for these keys of a model."""
    return [word for value in values for word in ("--set", f"run.{model}.{value}")]


RUNS: dict[str, list[str]] = {
    "sixteen": ["sweep", *THESIS, *LIGHT],
    "lumped": ["run", OTHER, "--model", "lumped"],
    "wheelset": ["run", OTHER, "--model", "rigid_hertz", *sets("rigid_hertz", WHEELSET)],
    "bem_passage": ["run", OTHER, "--model", "bem_passage", *sets("bem_passage", ["start=340 mm", "end=360 mm"])],
    "fe_full": ["run", CASE, "--model", "fe_full", *sets("fe_full", ["start=300 mm", *SHORT])],
    "fe_window": ["run", OTHER, "--model", "fe_window", *sets("fe_window", ["element_size=5 mm"])],
    "switch": ["damage", "cases/damage/switch_section.toml", "--passes", "20"],
    "crossing": ["damage", "cases/damage/crossing_transfer.toml", "--passes", "2"],
}
# in names of arrays that may differ: times, and seals over them
UNLIKE = ("time_spent", "wall", "seconds", "cost", "version", "identity", "digest", "seal", ":plain")


def run(checkout: Path, name: str, out: Path) -> Path:
    """The folder of what a checkout's program writes. Errors: SystemExit with its last words."""
    python = checkout / ".venv/bin/python"
    own = {f"{name}_NUM_THREADS": "1" for name in ("OMP", "NUMBA", "OPENBLAS")} | {"PYTHONPATH": str(checkout)}
    command = [
        *(str(python if python.is_file() else sys.executable), "-m", "rail_fem", "--quiet"),
        *(*RUNS[name], "--out", str(out / name)),
    ]
    answer = subprocess.run(command, cwd=checkout, env=os.environ | own, capture_output=True, text=True)
    if answer.returncode:
        raise SystemExit(f"{checkout}, {name}: {(answer.stdout + answer.stderr)[-1500:]}")
    return out / name


def arrays_of(folder: Path) -> dict[str, np.ndarray]:
    """Every array below a folder by file and name."""
    found = {}
    for path in sorted(folder.rglob("*.npz")):
        with np.load(path, allow_pickle=False) as stored:
            found |= {f"{path.relative_to(folder)}:{name}": stored[name] for name in stored.files}
    for name in [name for name in found if name.endswith("checkpoint.npz:summed")]:
        found[name] = found[name][:, :-1]  # the last is a time
    return {name: values for name, values in found.items() if not any(word in name for word in UNLIKE)}


def digest(arrays: dict[str, np.ndarray]) -> str:
    """Of names, shapes and bits."""
    whole = hashlib.sha256()
    for name, values in sorted(arrays.items()):
        whole.update(f"{name}{values.dtype}{values.shape}".encode() + np.ascontiguousarray(values).tobytes())
    return whole.hexdigest()[:16]


def differences(ours: dict[str, np.ndarray], theirs: dict[str, np.ndarray]) -> list[str]:
    """A line for each array of both that is not the same."""
    lines = []
    for name in sorted(set(ours) & set(theirs)):
        one, two = ours[name], theirs[name]
        if one.shape != two.shape or one.dtype != two.dtype:
            lines.append(f"{name}: {one.dtype} {one.shape}, there {two.dtype} {two.shape}")
        elif one.tobytes() != two.tobytes():
            size = (
                ""
                if one.dtype.kind != "f"
                else f" by {np.nanmax(np.abs(one - two)):.3g} of {np.nanmax(np.abs(two)):.3g}"
            )
            lines.append(f"{name}: differs{size}")
    return lines


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--against", type=Path, help="root of another checkout")
    parser.add_argument("--only", choices=RUNS, action="append", help="only this run; may be given several times")
    words, wrong = parser.parse_args(), 0
    with tempfile.TemporaryDirectory() as kept:
        for name in words.only or RUNS:
            ours = arrays_of(run(ROOT, name, Path(kept) / "ours"))
            print(f"{name}: {len(ours)} arrays, {digest(ours)}", flush=True)
            if words.against is None:
                continue
            theirs = arrays_of(run(words.against.resolve(), name, Path(kept) / "theirs"))
            lines = differences(ours, theirs)
            alone = sorted(set(ours) ^ set(theirs))
            wrong += bool(lines) or not ours
            print("\n".join([f"  {line}" for line in lines] or ["  the same"]))
            print(f"  only one has: {', '.join(alone)}\n" if alone else "", end="", flush=True)
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
