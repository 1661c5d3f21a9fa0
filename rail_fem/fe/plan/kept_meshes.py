"""Meshes of crossing and wheel, kept for the next run on the same shapes.

A mesh follows from what its mesher is given: surface or profile, and sizes. It is kept beside the compiled kernels
(kernel_cache.py) and found by the content of all that, of the sources of the mesher and of every class among it, and
of the packages that compute it: another speed, load, friction, steel or foundation finds it, an edited mesher does not.
What is damaged or another's is made anew; of more than MOST_BYTES those go that have not been asked for longest.
"""

import contextlib
import hashlib
import os
import sys
from collections.abc import Iterator
from dataclasses import fields, is_dataclass, replace
from functools import partial
from pathlib import Path
from types import FunctionType
from typing import Any, TypeVar

import numpy as np

import kernel_cache
from geometry.meshing.crossing_mesh import mesh_crossing
from geometry.meshing.hexmesh import HexMesh
from geometry.meshing.wheel import mesh_wheel
from geometry.path.wheel_path import WheelPath
from rail_fem.contact.rigid import anchored_path, meshed_stretch
from rail_fem.fe.plan.fine_zone import crossing_spec, wheel_spec
from rail_fem.files.sealed import SealError, read_sealed, write_sealed
from rail_fem.result.versions import versions
from rail_fem.scene.scene import Frozen, Scene
from rail_fem.settings.explicit import FeSettings

Made = TypeVar("Made")
MOST_BYTES = 2e9  # of all meshes kept; those of the main job and its twin take 20 MB
COMPUTED_BY = (
    "numpy",
    "scipy",
    "gmsh",
    "dolfinx",
    "petsc4py",
)  # a mesh is the same to the last bit by the same versions alone


def body_meshes(scene: Scene, settings: FeSettings, path: WheelPath) -> list[partial[HexMesh]]:
    """The mesher of each body with all that it is given: those of the crossing, then the wheel. path : the rigid
    wheel's, around what is meshed"""
    crossing = scene.crossing.surface
    spec = crossing_spec(crossing, path, *meshed_stretch(scene, settings), settings)
    wheel = wheel_spec(path, scene.wheel_datum_y, settings)
    one_body = [replace(spec, nose=None)] * (spec.wing is not None) + [replace(spec, wing=None)] * bool(spec.nose)
    return [
        *(partial(mesh_crossing, crossing, one) for one in one_body),
        partial(mesh_wheel, scene.wheel.shape, scene.wheel.radius, wheel),
    ]


def is_kept(mesher: partial[HexMesh]) -> bool:
    """Whether its mesh lies there."""
    file = _file(mesher)
    return file is not None and file.is_file()


def are_kept(scene: Scene, settings: FeSettings) -> bool:
    """Whether all meshes of a run lie there but a twin's, which is meshed before. Errors: as anchored_path."""
    path = anchored_path(scene, *meshed_stretch(scene, settings))
    return all(map(is_kept, body_meshes(scene, settings, path)))


def kept(mesher: partial[Made], of: type[Made] = HexMesh) -> Made:  # type: ignore[assignment]
    """The mesh that it makes, or another data class of arrays and numbers: read where it is kept, else made, and kept
    where the user's cache can be written. Errors: MeshError."""
    file = _file(mesher)
    if file is None:
        return mesher()
    identity = {"mesh": file.stem}
    try:
        arrays, _ = read_sealed(file, identity, "")
        os.utime(file)
        return of(**{name: _plain(value) for name, value in arrays.items()})
    except (SealError, OSError):
        pass
    mesh = mesher()
    with contextlib.suppress(OSError):  # a full disk: the run goes on without
        file.parent.mkdir(mode=0o700, exist_ok=True)
        write_sealed(file, {field.name: getattr(mesh, field.name) for field in fields(of)}, identity)  # type: ignore[arg-type]
        _prune(file.parent)
    return mesh


def _plain(value: np.ndarray) -> Any:
    """A value as it was before it was written."""
    if value.dtype.kind == "U":
        return tuple(map(str, value))
    return value if value.ndim else value.item()


def _file(mesher: partial[Any]) -> Path | None:
    """Where its mesh is kept; None without a cache of the user's own, and for arguments that are not known by their
    content."""
    folder = kernel_cache.lasting_folder()
    try:
        content = b"".join(_content((mesher.func, mesher.args, *sorted(mesher.keywords.items()))))
    except (TypeError, ValueError):
        return None
    found = hashlib.sha256(content + repr([versions()[name] for name in COMPUTED_BY]).encode())
    return None if folder is None else folder / "meshes" / f"{found.hexdigest()}.npz"


def _content(item: Any) -> Iterator[bytes]:
    """All that tells a value from others: of a data class its sources and fields, of a function its sources. Errors:
    TypeError, ValueError for what is not known by its content."""
    if isinstance(item, (np.ndarray, np.generic)):
        yield f"{item.dtype.str} {item.shape} ".encode()
        yield item.tobytes()
    elif isinstance(item, (tuple, list)):
        yield f"{len(item)} ".encode()
        for one in item:
            yield from _content(one)
    elif item is None or isinstance(item, (bool, int, float, str)):
        yield f"{item!r} ".encode()
    elif isinstance(item, Frozen):
        yield _sources(type(item)) + repr(sorted(item.model_dump(mode="json").items())).encode()
    elif is_dataclass(item) and not isinstance(item, type):
        yield _sources(type(item))
        for field in fields(item):
            yield from _content(getattr(item, field.name))
    elif isinstance(item, FunctionType) and "." not in item.__qualname__:
        yield _sources(item)
    else:
        raise TypeError(f"a {type(item).__name__} is not known by its content")


def _sources(item: Any) -> bytes:
    """Name of a class or function, and the digest of its file and of all that this imports."""
    return f"{item.__qualname__} {kernel_cache.digest(Path(str(sys.modules[item.__module__].__file__)))} ".encode()


def _prune(folder: Path) -> None:
    """Remove what has not been asked for longest, beyond MOST_BYTES in all."""
    entries = sorted(((entry.stat(), entry) for entry in folder.iterdir()), key=lambda one: -one[0].st_mtime)
    total = 0
    for status, entry in entries:
        total += status.st_size
        if total > MOST_BYTES:
            entry.unlink(missing_ok=True)
