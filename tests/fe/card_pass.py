"""A pass of the whole model over few and large elements, its steps by cores or by a simulated card.

    NUMBA_ENABLE_CUDASIM=1 python -m tests.fe.card_pass DEVICE FOLDER STEPS

goes on from what the folder holds. What the threads of the card do is compiled for the processor.
"""

import os
import subprocess
import sys
from pathlib import Path

from rail_fem.case.casefile import load_case
from rail_fem.fe.run import CHECKPOINT
from rail_fem.models import fe_full
from rail_fem.settings.explicit import FeSettings

LONGEST = 7200  # of a part of the pass [s]


def main(device: str, folder: str, steps: str) -> None:
    scene = load_case("nose_transfer").scene
    settings = FeSettings(
        element_size="5 mm",
        start="310 mm",
        end="400 mm",
        settle_time="60 us",
        history_interval="20 us",
        field_frames=1,
        max_steps=int(steps),
        device=device,
    )
    below = Path(folder)
    below.mkdir(parents=True, exist_ok=True)
    fe_full.solve(scene, settings, below, restart=(below / CHECKPOINT).is_file()).save(below)


def run(device: str, folder: Path, steps: int) -> None:
    """In a process of its own, for numba decides when it is first imported whether it simulates a card."""
    command = [sys.executable, "-m", "tests.fe.card_pass", device, str(folder), str(steps)]
    switches = {"NUMBA_ENABLE_CUDASIM": "1"} if device == "cuda" else {}
    subprocess.run(command, check=True, timeout=LONGEST, env=os.environ | switches)


if __name__ == "__main__":
    main(*sys.argv[1:])
