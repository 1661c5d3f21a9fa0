"""Wheels rolled one after the other over steel that remembers, and the file to go on from after a stop."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from rail_fem.files.sealed import read_sealed, write_sealed


@dataclass(frozen=True)
class Wheels:
    """How many wheels are rolled over a body, one after the other, each under the same forces.

    tell : what is told after each of the flow so far (its residual stress is not there yet), plain numbers by name
    file : where the state is kept after each, whose `identity` it is, and whether one that is there is gone on from
    """

    count: int = 1
    tell: Callable[..., dict[str, float]] = lambda flow: {}
    file: Path | None = None
    identity: dict[str, str] = field(default_factory=dict)
    goes_on: bool = False

    def keep(self, arrays: dict[str, np.ndarray], told: dict[str, Any]) -> None:
        """After a wheel: arrays, and plain values. Errors: OSError."""
        if self.file is not None and self.count > 1:
            self.file.parent.mkdir(parents=True, exist_ok=True)
            write_sealed(self.file, {**arrays, "told": np.array(json.dumps(told))}, self.identity)

    def kept(self) -> tuple[dict[str, np.ndarray], dict[str, Any]] | None:
        """What an earlier start has kept, None where there is nothing. Errors: SealError."""
        if self.file is None or not self.goes_on or not self.file.is_file():
            return None
        arrays, _ = read_sealed(self.file, self.identity, "--overwrite begins again")
        return arrays, json.loads(str(arrays.pop("told")))
