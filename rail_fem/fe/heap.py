"""Memory that the C library has free but keeps: making a distributed mesh leaves more of it than the elements need."""

from __future__ import annotations

import ctypes
import sys


def give_back_free_memory() -> None:
    """Free pages of the C heap go back to the system, where its library can (glibc's malloc_trim); else nothing.
    Rank-local."""
    if not sys.platform.startswith("linux"):
        return
    trim = getattr(ctypes.CDLL(None), "malloc_trim", None)
    if trim is not None:
        trim(ctypes.c_size_t(0))
