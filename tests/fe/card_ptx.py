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

import numba.cuda.dispatcher as dispatcher
from numba import typeof
from numba.cuda import compile_ptx

from rail_fem.fe.card import device, kernels

device.SIMULATED = True  # from here on: arrays stay here, for only their types are asked for

from rail_fem.fe.card.on_card import OnCard  # noqa: E402
from tests.fe.card_job import STEP, regions, scene  # noqa: E402


def main(capability: str, folder: str, *names: str) -> None:
    cc = tuple(map(int, capability.split(".")))
    dispatcher.get_current_device = lambda: SimpleNamespace(compute_capability=cc)  # type: ignore[attr-defined]
    dynamics = scene(0)
    card = OnCard(dynamics, regions(dynamics))
    card.push(STEP)
    of_step = typeof(card.there)
    kinds = [kernels.of_elements(*kind) for kind in ((True, None), (False, 2), (True, 2))]
    for kernel, count in (*kernels.MOVE, *card.force, *kinds, *kernels.COLLECT):
        name = kernel.py_func.__name__
        if names and name not in names:
            continue
        ptx, _ = compile_ptx(kernel.py_func, (of_step,), cc=cc)
        path = Path(folder) / f"{name}_{capability}.ptx"
        path.write_text(ptx)
        most = ["-maxrregcount=128"] if count is None else []
        command = ["ptxas", "-v", *most, f"-arch=sm_{cc[0]}{cc[1]}", str(path), "-o", str(path.with_suffix(".cubin"))]
        told = subprocess.run(command, capture_output=True, text=True, check=True).stderr
        registers = max(map(int, re.findall(r"Used (\d+) registers", told)))
        spilled = sum(map(int, re.findall(r"(\d+) bytes spill (?:stores|loads)", told)))
        stack = max(map(int, re.findall(r"(\d+) bytes stack frame", told)))
        print(f"{name}: {registers} registers, {spilled} B spilled, {stack} B of stack", flush=True)


if __name__ == "__main__":
    main(*sys.argv[1:])
