"""How long each stage of a solution took."""

from __future__ import annotations

import time


class StageClock:
    """Seconds by stage, those of a stage entered again added up."""

    def __init__(self) -> None:
        self.seconds: dict[str, float] = {}
        self._last = time.perf_counter()

    def stop(self, stage: str) -> None:
        now = time.perf_counter()
        self.seconds[stage] = self.seconds.get(stage, 0.0) + now - self._last
        self._last = now
