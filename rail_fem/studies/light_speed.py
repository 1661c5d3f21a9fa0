"""Processor time of the light models over a whole crossing: rigid path, pass, passes of a design.

Of this process, the least of several rounds where a row can be repeated; kernels are compiled before.
"""

from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from rail_fem.case.casefile import Case, load_case
from rail_fem.contact.contact_table import table_of
from rail_fem.contact.rigid import rigid_path
from rail_fem.models import rigid_hertz
from rail_fem.settings.light import RigidHertzSettings
from rail_fem.studies.harness import least, spent

START, END = -1.35, 0.75  # [m]
WHEELS = "P8-worn", "P8", "P8-hollow", "P1"
CORES, STUDY = 2, 2000  # of a design study that the last row is extrapolated to
LENGTHS = 0.116, 0.6  # transitions of the designs [m]


def case_with(path: Path, wheel: str, spacing: str = "2.5 mm", **crossing: Any) -> Case:
    """The case over the whole crossing. Errors: CaseError."""
    window = {"start": f"{START * 1e3:g} mm", "end": f"{END * 1e3:g} mm", "path_spacing": spacing}
    changes = {f"run.rigid_hertz.{key}": value for key, value in window.items()}
    changes |= {f"scene.crossing.{key}": value for key, value in crossing.items()}
    return load_case(path, {"scene.wheel.profile": wheel, **changes})


def run(case: Case) -> None:
    """The pass by rigid_hertz."""
    rigid_hertz.solve(case.scene, case.settings(RigidHertzSettings))


def rows_of(path: Path, designs: int) -> Iterator[list[str]]:
    """What is measured, milliseconds, and what it stands for."""
    cases = {wheel: case_with(path, wheel) for wheel in WHEELS}
    for case in cases.values():  # kernels, surfaces
        run(case)
    for spacing in (5e-3, 2.5e-3):
        x = np.arange(START, END, spacing)
        paths = [least(partial(rigid_path, case.scene, x))[0] for case in cases.values()]
        words = f"rigid path, {len(x)} positions every {1e3 * spacing:g} mm, surfaces kept"
        yield [words, f"{1e3 * np.mean(paths):.0f}", f"a wheel; at most {1e3 * max(paths):.0f}"]
    kept = [least(partial(run, case))[0] for case in cases.values()]
    yield ["pass by rigid_hertz, contacts kept (another speed or foundation)", f"{1e3 * np.mean(kept):.0f}", "a wheel"]
    for gap in ("5 mm", "2.5 mm"):
        anew = []
        for wheel in WHEELS:
            case = case_with(path, wheel, gap)
            table_of.cache_clear()
            anew.append(spent(partial(run, case))[0])
        words = f"pass by rigid_hertz, contacts every {gap} searched, surfaces kept"
        yield [words, f"{1e3 * np.mean(anew):.0f}", f"a wheel; at most {1e3 * max(anew):.0f}"]
    if designs:
        lengths = [f"{1e3 * length:.6g} mm" for length in np.linspace(*LENGTHS, designs)]
        new = [case_with(path, WHEELS[k % 4], "5 mm", transition_length=text) for k, text in enumerate(lengths)]
        each = sum(spent(partial(run, case))[0] for case in new) / designs
        whole = f"a pass; {STUDY} on {CORES} cores: {each * STUDY / CORES / 60:.0f} min (extrapolated)"
        yield [f"{designs} passes of crossings not seen before, every 5 mm", f"{1e3 * each:.0f}", whole]
