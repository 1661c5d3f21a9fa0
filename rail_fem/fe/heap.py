"""Memory that the C library has free but keeps: making a distributed mesh leaves more of it than the elements need, and
SuperLU_DIST, which PETSc loads, has it keep all that a process ever frees."""

from __future__ import annotations

import ctypes
import sys

# numbers of glibc's mallopt: below LARGE an array lies in the heap, whose free end goes back from FREE_END on [B]
M_TRIM_THRESHOLD, M_MMAP_THRESHOLD, M_MMAP_MAX = -1, -3, -4
LARGE, FREE_END, MOST_MAPS = 1 << 24, 1 << 26, 1 << 16


def _of_glibc(name: str):
    """A function of the C library; None where it has none of glibc's."""
    return getattr(ctypes.CDLL(None), name, None) if sys.platform.startswith("linux") else None


def give_back_large_arrays() -> None:
    """From now on the system has an array's memory as soon as it is freed. Rank-local."""
    if (mallopt := _of_glibc("mallopt")) is not None:
        for parameter, value in ((M_MMAP_MAX, MOST_MAPS), (M_MMAP_THRESHOLD, LARGE), (M_TRIM_THRESHOLD, FREE_END)):
            mallopt(parameter, value)


def give_back_free_memory() -> None:
    """Free pages of the C heap go back to the system, where its library can (glibc's malloc_trim); else nothing.
    Rank-local."""
    if (trim := _of_glibc("malloc_trim")) is not None:
        trim(ctypes.c_size_t(0))
