"""The card's kernels compiled for a card of some capability, on a machine that needs none.

    python -m tests.fe.card_ptx 9.0 FOLDER [KERNEL ...]

prints registers and spills of each, by ptxas; PTX is left in the folder. Needs numba-cuda with its libraries
(pip install '.[cuda]').
"""

import re
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numba.cuda.dispatcher as dispatcher
from numba import typeof
from numba.cuda import compile_ptx

from rail_fem.fe.card import device

device.SIMULATED = True  # arrays stay here: only their types are asked for

from rail_fem.fe.card import kernels, on_card  # noqa: E402
from tests.fe.card_job import STEP, regions, scene  # noqa: E402


def argument_types() -> dict[str, tuple]:
    """Of each kernel, as a step launches it."""
    found: dict[str, tuple] = {}

    class Launched:
        def __init__(self, name: str):
            self.name = name

        def __getitem__(self, grid: Any):
            return lambda *arguments: found.setdefault(self.name, tuple(map(typeof, arguments)))

    names = ("kick", "groups", "contact", "impose", "push", "drift", "elements", "small_elements", "gather", "collect")
    on_card.kernels = SimpleNamespace(**{name: Launched(name) for name in names})  # type: ignore[assignment]
    dynamics = scene(0)
    card = on_card.OnCard(dynamics, regions(dynamics))
    card.push()
    card._move(STEP, None)
    card._forces(STEP, None)
    on_card.kernels.collect[1](card.nodes, card.touching)
    return found


def main(capability: str, folder: str, *names: str) -> None:
    cc = tuple(map(int, capability.split(".")))
    dispatcher.get_current_device = lambda: SimpleNamespace(compute_capability=cc)  # type: ignore[attr-defined]
    types = argument_types()
    for name in names or types:
        ptx, _ = compile_ptx(getattr(kernels, name).py_func, types[name], cc=cc)
        path = Path(folder) / f"{name}_{capability}.ptx"
        path.write_text(ptx)
        command = ["ptxas", "-v", f"-arch=sm_{cc[0]}{cc[1]}", str(path), "-o", str(path.with_suffix(".cubin"))]
        told = subprocess.run(command, capture_output=True, text=True, check=True).stderr
        registers = max(map(int, re.findall(r"Used (\d+) registers", told)))
        spilled = sum(map(int, re.findall(r"(\d+) bytes spill (?:stores|loads)", told)))
        print(f"{name}: {registers} registers, {spilled} B spilled", flush=True)


if __name__ == "__main__":
    main(*sys.argv[1:])
