"""Warnings of a run as records: kind, words, place. They are read from the words, which is all that older results hold;
every model's sentences have one of these forms (tests/rail_fem/test_result.py)."""

import re
from typing import NamedTuple

NAN = float("nan")
# kind -> what its sentences have; the first that fits
KINDS = {
    "trust": r"\(rule: [^()]*(\([^()]*\))?[^()]*\)$",
    "window": r"^the run ends|from where (the path|path and steel)|^between start |changes body at |^the path from "
    r"|while it settles: ",
    "scene": r"^wheel profile .* surrogate|^crossing 1:|from memory|^(friction|speed) .* > |^track mass "
    r"|^Poisson's ratio",
    "numerics": r"^patch .* elements of |^courant |field outputs > |^history interval |^penalty .* outside"
    r"|^hourglass \S+ < |^no error bars|takes? smaller cells|largest pressure .* times",
    "model": r"^(trailing|no dip|dip limit|one impact|P[12] limit|P1 mass|unsprung mass|lift-off|contact stiffness"
    r"|two bodies|plastic|edges?|contact law|conforming|bearer .*|a half-space .*|steel of the .*): "
    r"|^(bearer|a half-space|steel of the) ",
}
PLACE = re.compile(r"\bx = (-?[\d.]+)(?: to -?[\d.]+)? mm")


class WarningRecord(NamedTuple):
    """A warning of a run.

    Parameters
    ----------
    kind : str
        "trust" (a row of the trust report), "window" (of the path that was run), "scene" (what is known of the case),
        "numerics" (elements, steps, bars), "model" (what the model leaves out), "other" (of a file that was read).
    text : str
        The sentence.
    x : float
        Where along the crossing [m]; NaN where it is of no one place.
    """

    kind: str
    text: str
    x: float = NAN


def record(text: str) -> WarningRecord:
    """The record of a sentence."""
    kind = next((kind for kind, form in KINDS.items() if re.search(form, text)), "other")
    place = PLACE.search(text)
    return WarningRecord(kind, text, NAN if place is None else float(place[1].rstrip(".")) / 1e3)
