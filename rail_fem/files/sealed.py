"""Arrays in a file that knows whether it is whole and unchanged, and what it belongs to.

Beside its arrays a file holds its identity (plain words, such as the digest of its case) and its seal: a digest of
both. Restart files and meshes are such files: what is cut, altered or another run's is refused before a number of it is
used.
"""

import hashlib
import json
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from rail_fem.files.atomic import write_atomically

LABEL = "seal"
CHUNK = 4096  # rows that are digested, and that a rank reads and writes, at a time


class SealError(ValueError):
    """A file that must not be used; the message names it and says what to do."""


def leaves(array: np.ndarray) -> list[bytes]:
    """Digests of an array's bytes, of CHUNK rows along the first axis at a time."""
    rows = np.ascontiguousarray(array)  # a single number is one row
    parts = (rows[first : first + CHUNK] for first in range(0, len(rows), CHUNK))
    return [hashlib.sha256(part.data if part.size else b"").digest() for part in parts]


def seal_from(digests: Mapping[str, tuple[str, tuple[int, ...], list[bytes]]], identity: Mapping[str, str]) -> str:
    """Seal of arrays by type, shape and `leaves` of each, and the identity."""
    digest = hashlib.sha256(json.dumps(dict(identity), sort_keys=True).encode())
    for name in sorted(digests):
        dtype, shape, parts = digests[name]
        digest.update(f"{name} {dtype} {shape}".encode() + b"".join(parts))
    return digest.hexdigest()


def seal_of(arrays: Mapping[str, np.ndarray], identity: Mapping[str, str]) -> str:
    """Digest of names, types, shapes and bytes of all arrays, and of the identity."""
    every = {name: np.asarray(array) for name, array in arrays.items()}
    return seal_from({name: (a.dtype.str, a.shape, leaves(a)) for name, a in every.items()}, identity)


def label_of(seal: str, identity: Mapping[str, str]) -> np.ndarray:
    """What a sealed file holds beside its arrays, under the name LABEL (k,) uint8."""
    return np.frombuffer(json.dumps({"seal": seal, "identity": dict(identity), "chunk": CHUNK}).encode(), np.uint8)


def write_sealed(path: Path, arrays: Mapping[str, np.ndarray], identity: Mapping[str, str]) -> str:
    """Write the arrays to a file .npz, whole or not at all; returns the seal. Errors: OSError."""
    arrays = {name: np.asarray(array) for name, array in arrays.items()}
    seal = seal_of(arrays, identity)
    whole = {LABEL: label_of(seal, identity), **arrays}
    write_atomically(Path(path), lambda temporary: np.savez(temporary, **whole))
    return seal


def read_sealed(path: Path, identity: Mapping[str, str], remedy: str) -> tuple[dict[str, np.ndarray], str]:
    """Arrays and seal of a file that holds exactly what was written, with this identity. Errors: SealError, with the
    remedy."""
    try:
        with np.load(path) as stored:
            arrays = dict(stored)
        label = json.loads(bytes(arrays.pop(LABEL)).decode())
        sound = label["chunk"] == CHUNK and label["seal"] == seal_of(arrays, label["identity"])
    except Exception as error:  # a damaged file fails anywhere in zip, zlib, numpy or json
        raise SealError(f"{path}: {damaged(error)}: {remedy}") from error
    fault = unfit(sound, label["identity"], identity)
    if fault:
        raise SealError(f"{path}: {fault}: {remedy}")
    return arrays, label["seal"]


def damaged(error: Exception) -> str:
    """What is wrong with a file that cannot be read."""
    return f"damaged, or not written by this version of the program ({type(error).__name__}: {error})"


def unfit(sound: bool, theirs: Mapping[str, str], ours: Mapping[str, str]) -> str | None:
    """Why a file must not be used that can be read; None where it may. sound : its seal is that of its content;
    theirs, ours : its identity and the one that is wanted"""
    if not sound:
        return "its contents were changed after it was written"
    other = [name for name, value in ours.items() if theirs.get(name) != value]
    return f"belongs to another {' and another '.join(other)}" if other else None
