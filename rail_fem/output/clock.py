"""The clock by which models tell what they cost: it stands still while kernels are compiled, which happens once."""

import time

from kernel_cache import compile_time


def working_time() -> float:
    """Wall time less what was spent compiling, from some moment on [s]."""
    return time.perf_counter() - compile_time()
