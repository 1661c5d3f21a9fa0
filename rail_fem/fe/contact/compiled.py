"""How the kernels of contact are compiled: what Python calls is `compiled`, its parts are `inlined`, those that take
tables of arrays and allocate nothing `uncounted`. Self-contained kernels: the same bits from the compiler and from the
cache."""

from kernel_cache import UNCOUNTED, njit

compiled = njit(cache=True, error_model="numpy")
inlined = njit(forceinline=True, error_model="numpy")
uncounted = njit(forceinline=True, error_model="numpy", **UNCOUNTED)
