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

from rail_fem.atomic import write_atomically

LABEL = "seal"


class SealError(ValueError):
    """A file that must not be used; the message names it and says what to do."""


def seal_of(arrays: Mapping[str, np.ndarray], identity: Mapping[str, str]) -> str:
    """Digest of names, types, shapes and bytes of all arrays, and of the identity."""
    digest = hashlib.sha256(json.dumps(dict(identity), sort_keys=True).encode())
    for name in sorted(arrays):
        array = np.ascontiguousarray(arrays[name])
        digest.update(f"{name} {array.dtype.str} {array.shape}".encode())
        digest.update(array.data if array.size else b"")
    return digest.hexdigest()


def write_sealed(path: Path, arrays: Mapping[str, np.ndarray], identity: Mapping[str, str]) -> str:
    """Write the arrays, whole or not at all; returns the seal. Errors: OSError."""
    arrays = {name: np.asarray(array) for name, array in arrays.items()}
    seal = seal_of(arrays, identity)
    label = np.frombuffer(json.dumps({"seal": seal, "identity": dict(identity)}).encode(), np.uint8)

    def write(temporary: Path) -> None:
        with temporary.open("wb") as stream:
            np.savez(stream, **{LABEL: label}, **arrays)

    write_atomically(Path(path), write)
    return seal


def read_sealed(path: Path, identity: Mapping[str, str], remedy: str) -> tuple[dict[str, np.ndarray], str]:
    """Arrays and seal of a file that holds exactly what was written, with this identity. Errors: SealError, with the
    remedy."""
    try:
        with np.load(path) as stored:
            arrays = dict(stored)
        label = json.loads(bytes(arrays.pop(LABEL)).decode())
        sound = label["seal"] == seal_of(arrays, label["identity"])
    except Exception as error:  # a damaged file fails anywhere in zip, zlib, numpy or json
        raise SealError(
            f"{path}: damaged, or not written by this version of the program ({type(error).__name__}: {error}):"
            f" {remedy}"
        ) from error
    if not sound:
        raise SealError(f"{path}: its contents were changed after it was written: {remedy}")
    other = [name for name, value in identity.items() if label["identity"].get(name) != value]
    if other:
        raise SealError(f"{path}: belongs to another {' and another '.join(other)}: {remedy}")
    return arrays, label["seal"]
