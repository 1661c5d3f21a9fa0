"""Plastic strain of leg, wing rail and nose of several results side by side, each with its own error bar and flags."""

import numpy as np

from rail_fem.files.markdown import markdown_table
from rail_fem.result.quantities import BODIES
from rail_fem.result.result import PassResult
from rail_fem.show.metal import with_bar
from rail_fem.sweeps.compare import Comparison, common_path

SHOWN = {"block": "worst 5 x 5 x 3 mm", "worst_1000": "worst 1000 mm3", "integral": "integral over the volume"}
STRAIN_FLAGS = ("edge", "corner", "large strain", "stiff cells", "no friction", "elastic")  # of bem_plastic


def strain_table(comparison: Comparison) -> str:
    """Markdown: a row for each quantity of each part that some result resolves, "not resolved" where one does not, a
    value in brackets where its block lies outside the common path, "none" where nothing has yielded; empty where
    fewer than two results resolve any."""
    told = [(name, result) for name, result in zip(comparison.names, comparison.results) if result.metal]
    if len(told) < 2:
        return ""
    parts = [part for part in reversed(BODIES) if any(part in result.metal for _, result in told)]
    rows = []
    for part in parts:
        for quantity, words in SHOWN.items():
            rows.append([f"{part}: {words}", *(_value(comparison, r, part, quantity) for _, r in told)])
        rows.append([f"{part}: x of that block [mm]", *(_place(result, part) for _, result in told)])
    rows.append(["flags about it", *(_flags(result, parts) for _, result in told)])
    head = ["plastic strain", *(f"{name} ({result.model})" for name, result in told)]
    return "\n".join(markdown_table(head, rows)) + "\n"


def _value(comparison: Comparison, result: PassResult, part: str, quantity: str) -> str:
    if part not in result.metal:
        return _missing(result, part)
    shown = with_bar(result, f"{quantity}_{part}")
    path, x = common_path(result, comparison.reference), result.metal[part]["block"][0]
    return shown if quantity == "integral" or path.holds(x) else f"({shown})"


def _missing(result: PassResult, part: str) -> str:
    """A result that resolves strain and does not name a part has run over it elastically, or not at all."""
    force = result.peaks.get(f"largest_force_{part}")
    return "none" if force is not None and force.value > 0 else "not resolved"


def _place(result: PassResult, part: str) -> str:
    x = result.metal[part]["block"][0] if part in result.metal else np.nan
    return f"{x * 1e3:.0f}" if np.isfinite(x) else "-"


def _flags(result: PassResult, parts: list[str]) -> str:
    """Names of the validity flags about strain, by part."""
    found = []
    for flag in result.trust.get("validity", ()):
        part = flag["reason"].partition(":")[0]
        if flag["what"] in STRAIN_FLAGS and part in parts:
            found.append(f"{part} {flag['what']}")
    return ", ".join(found) or "-"
