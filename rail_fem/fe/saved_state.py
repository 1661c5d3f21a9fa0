"""What a restart must know, declared once, by the class that holds it.

STATE   : attributes that change in time and are the same on all ranks: numbers, arrays, plain lists and dictionaries,
    or further objects
          with a STATE, alone or in a list. `gather_state` and `restore_state` walk that tree and need no change for a
          new attribute.
SCRATCH : attributes that change and are written anew before they are read, or that belong to this process alone
    (clocks).
What is spread over the ranks (NODAL, SUMMED, the elements' state) is declared likewise and carried by
rail_fem.fe.checkpoint.

All other attributes must be fixed by scene, settings and mesh: tests/fe/test_restart.py compares every attribute of
every object after a restart, so that a forgotten one is found.
"""

from __future__ import annotations

from typing import Any

import numpy as np


def gather_state(value: Any, key: str = "state") -> dict[str, Any]:
    """All leaves of a tree by their path, such as "state/dynamics/supports/groups/0/velocity": arrays, or plain values
    for JSON. Replicated."""
    if hasattr(value, "STATE"):
        return {
            path: leaf
            for name in value.STATE
            for path, leaf in gather_state(getattr(value, name), f"{key}/{name}").items()
        }
    if _holds_state(value):
        return {path: leaf for i, entry in enumerate(value) for path, leaf in gather_state(entry, f"{key}/{i}").items()}
    return {key: value.item() if isinstance(value, np.generic) else value}


def restore_state(value: Any, stored: dict[str, Any], key: str = "state") -> Any:
    """The value with the leaves of `gather_state`: objects are changed in place, tuples and leaves made anew. Errors:
    KeyError for a missing leaf."""
    if hasattr(value, "STATE"):
        entries = {name: restore_state(getattr(value, name), stored, f"{key}/{name}") for name in value.STATE}
        if isinstance(value, tuple):
            return value._replace(**entries)  # type: ignore[attr-defined]
        for name, entry in entries.items():
            setattr(value, name, entry)
        if hasattr(value, "after_restore"):
            value.after_restore()
        return value
    if _holds_state(value):
        return [restore_state(entry, stored, f"{key}/{i}") for i, entry in enumerate(value)]
    leaf = stored[key]
    return tuple(leaf) if isinstance(value, tuple) else leaf


def _holds_state(value: Any) -> bool:
    return isinstance(value, list) and any(hasattr(entry, "STATE") for entry in value)
